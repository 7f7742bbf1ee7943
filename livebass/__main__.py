"""`livebass` and `python -m livebass`: answers Ctrl-C before the command line is even loaded, then runs it."""

from __future__ import annotations

import sys
from typing import NoReturn

from livebass.interrupts import INTERRUPTED, exit_while_loading


def main() -> NoReturn:
    """Runs the command line and exits."""
    try:
        exit_while_loading()
        from livebass.cli import main as cli

        cli.main()
    except KeyboardInterrupt:  # before or after the part in which `cli.main` catches it
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
