"""How the tools beside this file end when something is wrong: with one line."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def clear_errors(tool: str) -> Iterator[None]:
    """Ends the program with one line if the data are wrong, and with the status of Ctrl-C."""
    try:
        yield
    except (ValueError, LookupError, OSError) as error:
        sys.exit(f"{tool}: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
