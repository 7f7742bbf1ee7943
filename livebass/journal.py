"""A log of a session: lines with the time, in a file that is written as it goes. [main thread]"""

from __future__ import annotations

import io
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from livebass.atomic import output_error


class Journal:
    """Appends to the file at `path`, which is made where there is none. Raises OutputError where that cannot be."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file: io.TextIOWrapper | None = open(path, "a", encoding="utf-8", errors="replace", buffering=1)  # noqa: SIM115
        except OSError as error:
            raise output_error(path, error) from None
        except ValueError:  # a zero byte in the name
            raise output_error(path, OSError("not a file name")) from None

    def write(self, line: str) -> str | None:
        """Adds a line; one for people where the file takes no more, and from then on nothing."""
        if self._file is None:
            return None
        try:
            self._file.write(f"{datetime.now().astimezone().isoformat(' ', 'milliseconds')}  {line}\n")
            self._file.flush()
        except OSError as error:
            self.close()
            return f"{output_error(self.path, error)}: no more log"
        return None

    def close(self) -> None:
        if self._file is not None:
            with suppress(OSError):
                self._file.close()
            self._file = None
