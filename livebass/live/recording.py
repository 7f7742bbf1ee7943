"""What is heard, into a file: it is there in the end, however the session ends. [main thread]

A log of a session: lines with the time, in a file that is written as it goes. [main thread]
"""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from livebass.audiofile import AudioWriter, encoding
from livebass.files import OutputError, Transaction, output_error
from livebass.live.synth import Synth


class Recorder:
    """`with Recorder(path, synth, say) as take:` writes what the synth plays; call `take.turn()` often.

    Leaving the block puts the file in its place, with any exception too, if anything was recorded; `discard` before
    leaves nothing. A disk that is full ends the recording, not the session: what fitted is kept, and `say` hears of it.
    Raises OutputError for a place where no file can be, and ValueError for a format that does not exist.
    """

    def __init__(self, path: Path, synth: Synth, say: Callable[[str], None]) -> None:
        self.path, self.synth, self.say = path, synth, say
        self.kept: Path | None = None
        self._files = Transaction()
        try:
            self._writer: AudioWriter | None = AudioWriter(self._files, path, encoding(path, synth.rate))
        except BaseException as error:
            self._files.__exit__(type(error), error, None)
            raise
        synth.start_recording()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.turn()
        if self._writer is not None:
            self._end(self._writer)

    def discard(self) -> None:
        """Leaves nothing, where the take has not ended: nothing was played."""
        if self._writer is not None:
            self._writer = None
            never = OutputError(f"{self.path}: nothing was recorded")
            self._files.__exit__(type(never), never, None)

    def turn(self) -> None:
        """Writes what has been played since."""
        sound = self.synth.recorded()
        if self._writer is None:
            return
        try:
            self._writer.write(sound)
        except OutputError as error:
            self.say(f"{error}: recording has ended, playing goes on")
            self._end(self._writer, short=True)

    def _end(self, writer: AudioWriter, short: bool = False) -> None:
        self._writer = None
        frames = writer.frames
        try:
            if not short:
                writer.close()
            else:
                frames = writer.close_short()
        except OutputError as error:
            self.say(str(error))
            frames = writer.close_short()
        nothing = None if frames else OutputError(f"{self.path}: nothing was recorded")
        try:
            self._files.__exit__(type(nothing) if nothing else None, nothing, None)
        except OutputError as error:
            self.say(str(error))
            return
        if nothing is None:
            self.kept = self.path
            if short:
                self.say(f"{self.path}: {frames / self.synth.rate:.1f} s are kept")
        else:
            self.say(str(nothing))


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
