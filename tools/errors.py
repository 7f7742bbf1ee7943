"""Ends the tools beside this file with one line when something is wrong."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def clear_errors(tool: str) -> Iterator[None]:
    """Ends the program with one line if the data are wrong; after Ctrl-C, with its usual status, 130."""
    try:
        yield
    except (ValueError, LookupError, OSError) as error:
        sys.exit(f"{tool}: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
