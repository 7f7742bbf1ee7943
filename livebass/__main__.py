"""`livebass` and `python -m livebass`: little enough that an early Ctrl-C finds somebody who answers it."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import NoReturn

INTERRUPTED = 130


def main() -> NoReturn:
    """Run the command line and exit."""
    try:
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, _too_early)
        from livebass.cli import main as cli

        cli.main()
    except KeyboardInterrupt:  # around what `cli` catches itself
        sys.exit(INTERRUPTED)


def _too_early(number: int, frame: FrameType | None) -> NoReturn:
    """Nothing is open yet; an exception in the middle of an import could be lost or show where it was."""
    os.write(2, b"livebass: error: interrupted, nothing written\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
