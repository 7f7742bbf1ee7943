"""The terminal during `livebass play`: log lines above a status line; and the file of --log."""

from __future__ import annotations

import logging
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

import click

from livebass.cli.messages import fill_line, width
from livebass.files.whole import output_error
from livebass.rows.units import one_line

LOG = logging.getLogger("livebass")


class OutputGone(OSError):
    """The output disappeared during play."""


@contextmanager
def log_to(console: Console, path: Path | None) -> Iterator[None]:
    """Sends livebass' log to `console` and, with any final error, to the file at `path`.

    Raises OutputError if the file cannot be written.
    """
    handlers: list[logging.Handler] = [console, *([LogFile(path)] if path else [])]
    level, root, none = LOG.level, logging.getLogger(), logging.NullHandler()
    root.addHandler(none)  # else a library that logs (python-osc) gives root a handler, and every line comes twice
    LOG.setLevel(logging.DEBUG)
    for handler in handlers:
        LOG.addHandler(handler)
    try:
        yield
    except BaseException as error:
        if not isinstance(error, OutputGone):
            LOG.debug(str(error) or type(error).__name__)
        raise
    finally:
        for handler in handlers:
            LOG.removeHandler(handler)
            handler.close()
        LOG.setLevel(level)
        root.removeHandler(none)


class Console(logging.Handler):
    """Shows log lines from INFO up on stderr unless `quiet`; on a terminal, above a status line."""

    def __init__(self, quiet: bool) -> None:
        super().__init__(logging.INFO)
        self.quiet = quiet
        self.terminal = sys.stderr.isatty() and not quiet and os.environ.get("TERM") != "dumb"
        self._unended = False  # the cursor is at the end of a status line

    def emit(self, record: logging.LogRecord) -> None:
        self.show(record.getMessage())

    def show(self, line: str) -> None:
        """Shows a line on the terminal only, not in the log."""
        if not self.quiet:
            line = one_line(line)
            self._print(fill_line(line) if self.terminal else line)

    def status(self, line: str) -> None:
        """Replaces the status line by `line`, cut to the width; a narrow terminal gets no bar."""
        columns = width()
        shown = one_line(line) if columns >= NARROW else BAR.sub("", one_line(line))
        self._print(shown[: columns - 1], end="")

    def close(self) -> None:
        """Removes the status line."""
        self._print("", end="")
        super().close()

    def _print(self, line: str, end: str = "\n") -> None:
        self.acquire()  # other threads log too
        try:
            before = "\r\x1b[K" if self.terminal and self._unended else ""
            self._unended = self.terminal and not end and bool(line)
            if before or line or end:
                with suppress(OSError):  # the terminal was closed: the bass plays on until told to stop
                    click.echo(f"{before}{line}{end}", nl=False, err=True)
        finally:
            self.release()


class LogFile(logging.FileHandler):
    """Appends time-stamped lines to a file; an error ends the file with a warning, not the session.

    Raises OutputError if the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._ended = path, False
        try:
            super().__init__(path, encoding="utf-8", errors="replace")
        except OSError as error:
            raise output_error(path, error) from None
        except ValueError:  # a null byte in the name
            raise output_error(path, OSError("not a file name")) from None

    def format(self, record: logging.LogRecord) -> str:
        when = datetime.fromtimestamp(record.created).astimezone()
        return f"{when.isoformat(' ', 'milliseconds')}  {one_line(record.getMessage())}"

    def emit(self, record: logging.LogRecord) -> None:
        if not self._ended:
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:
        error = sys.exc_info()[1]
        if not isinstance(error, OSError):
            super().handleError(record)
            return
        self.close()
        LOG.warning("%s: the log ends here", output_error(self.path, error))

    def close(self) -> None:
        self._ended = True
        with suppress(OSError):
            super().close()


NARROW, BAR = 60, re.compile(r"\[[# ]*\] *")  # below this width (columns) the meter has no bar
