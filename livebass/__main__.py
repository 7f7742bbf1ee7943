"""`livebass` and `python -m livebass`: handles Ctrl-C, then loads and runs the command line."""

from __future__ import annotations

import contextlib
import gc
import io
import os
import sys
from typing import Any, NoReturn

from livebass.system.cores import ONE_THREAD
from livebass.system.interrupts import INTERRUPTED, exit_while_loading

COLLECTED = 20_000  # new objects until Python looks for garbage: at 700, loading modules takes a tenth longer


def main() -> NoReturn:
    """Runs the command line and exits."""
    try:
        open_streams()
        exit_while_loading()
        os.environ.update(ONE_THREAD)
        gc.set_threshold(COLLECTED)
        from livebass.cli import main as cli

        cli.main()
    except KeyboardInterrupt:  # before or after `cli.main` catches it
        sys.exit(INTERRUPTED)


class Messages(io.FileIO):
    """Standard error. Ignores write errors: an unwritable message is no reason to lose a file."""

    def write(self, data: Any, /) -> int:
        left = memoryview(data)
        with contextlib.suppress(OSError):
            while left and (done := super().write(left)):
                left = left[done:]
        return len(data)


def open_streams() -> None:
    """Opens the standard streams that the shell closed, as in `livebass >&-`: else a sound file would get their number.

    Output to them is lost, as in a pipe that nobody reads.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number
            os.set_inheritable(number, True)
    if sys.stdin is None:
        sys.stdin = open(0)  # noqa: SIM115
    if sys.stdout is None:
        sys.stdout = open(1, "w")  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper):  # escapes names that are not text, as on standard error
        sys.stdout.reconfigure(errors="backslashreplace")
    encoding = sys.stderr.encoding if sys.stderr else "utf-8"
    unbuffered: Any = Messages(2, "w", closefd=False)  # io's buffer says a line again if Ctrl-C comes right after it
    sys.stderr = io.TextIOWrapper(unbuffered, encoding, errors="backslashreplace", line_buffering=True)


if __name__ == "__main__":
    main()
