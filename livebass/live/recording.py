"""Records what a synth plays into a sound file, which is kept however the session ends. [main thread]"""

from __future__ import annotations

import logging
from pathlib import Path
from types import TracebackType
from typing import Self

from livebass.audiofile import AudioWriter, encoding
from livebass.files import OutputError, Transaction
from livebass.live.synth import Synth

LOG = logging.getLogger(__name__)


class Recorder:
    """`with Recorder(path, synth) as take:` writes what the synth plays; call `take.turn()` often.

    Leaving the block puts the file in its place, after an exception too, if anything was recorded; after `discard`
    there is no file. A full disk ends the recording, not the session: the file keeps what fitted, and a warning is
    logged. Raises OutputError if no file can be written at `path`, and ValueError for an unknown format.
    """

    def __init__(self, path: Path, synth: Synth) -> None:
        self.path, self.synth = path, synth
        self.kept: Path | None = None  # the file, once it is in its place
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
        """Leaves no file, unless the recording has ended already."""
        if self._writer is not None:
            self._writer = None
            self._leave_nothing()

    def turn(self) -> None:
        """Writes what was played since the last call."""
        sound = self.synth.recorded()
        if self._writer is None:
            return
        try:
            self._writer.write(sound)
        except OutputError as error:
            LOG.warning("%s: recording has ended, playing goes on", error)
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
            LOG.warning("%s", error)
            frames = writer.close_short()
        if not frames:
            LOG.warning("%s", self._leave_nothing())
            return
        try:
            self._files.__exit__(None, None, None)
        except OutputError as error:
            LOG.warning("%s", error)
            return
        self.kept = self.path
        if short:
            LOG.warning("%s: %.1f s are kept", self.path, frames / self.synth.rate)

    def _leave_nothing(self) -> OutputError:
        """Ends the transaction without a file; returns the reason."""
        reason = OutputError(f"{self.path}: nothing was recorded")
        self._files.__exit__(type(reason), reason, None)
        return reason
