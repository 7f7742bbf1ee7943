"""Records a synth's sound, and its messages as a MIDI file. Both are kept however the session ends.

[main thread]
"""

from __future__ import annotations

import io
import logging
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Self

import mido

from livebass.files.whole import OutputError, Transaction, checked_place
from livebass.kernels.player.words import STATUS, Row
from livebass.kernels.score.memory import PROGRAM
from livebass.live.synth import LiveBass, Synth
from livebass.preset.load import kept_text
from livebass.preset.programs import program_of
from livebass.preset.revisions import with_revision
from livebass.preset.source import PresetError, is_path
from livebass.score.reading import TAKE
from livebass.score.takes import text_of, text_of_stroke
from livebass.sound.audiofile import AudioWriter, encoding

LOG = logging.getLogger(__name__)


class Take:
    """A block that records a synth: leaving it, even by an exception, ends the take."""

    def turn(self) -> None:
        """Takes the material played since the last call."""
        raise NotImplementedError

    def end(self) -> None:
        """Writes the rest, and puts the file in its place; does nothing the second time."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.turn()
        self.end()


class Recorder(Take):
    """`with Recorder(path, synth) as take:` writes the synth's sound; call `take.turn()` often.

    Leaving the block, even by an exception, puts the file in its place if anything was recorded; after `discard` there
    is no file. A full disk ends the recording, not the session: the file keeps what fitted, a warning is logged, and
    `short` says why. Raises OutputError if no file can be written at `path`, and ValueError for an unknown format.
    """

    def __init__(self, path: Path, synth: Synth) -> None:
        self.path, self.synth = path, synth
        self.kept: Path | None = None  # the file, once in its place
        self.short: str | None = None  # why it is incomplete
        self._writer: AudioWriter | None = None
        self._begin(path)

    @property
    def writing(self) -> bool:
        """False once the recording has ended."""
        return self._writer is not None

    def _begin(self, path: Path) -> None:
        self._path, self._files = path, Transaction("take")
        try:
            self._writer = AudioWriter(self._files, path, encoding(path, self.synth.rate))
        except BaseException as error:
            self._files.__exit__(type(error), error, None)
            raise
        self.synth.start_recording()

    def follow(self, synth: Synth) -> None:
        """Continues with `synth`, which has another rate, in a separate file such as take-44100.wav."""
        going_on = self._writer is not None
        self.__exit__(None, None, None)
        self.synth = synth
        if not going_on:
            return
        path = self.path.with_stem(f"{self.path.stem}-{synth.rate}")
        number = 2
        while path.exists():
            path, number = self.path.with_stem(f"{self.path.stem}-{synth.rate}-{number}"), number + 1
        try:
            self._begin(path)
        except OutputError as error:
            self.short = str(error)
            LOG.warning("%s: recording has ended, playing goes on", error)
            return
        LOG.info("%s is complete; from here on the sound goes into %s", self._named(), path)

    def _named(self) -> str:
        return str(self.kept or self.path)

    def end(self) -> None:
        if self._writer is not None:
            self._end(self._writer)

    def discard(self) -> None:
        """Leaves no file, unless the recording has already ended."""
        if self._writer is not None:
            self._writer = None
            self._leave_nothing()

    def turn(self) -> None:
        """Writes the sound played since the last call."""
        if self._writer is None:
            return
        try:
            self._writer.write(self.synth.recorded())
        except OutputError as error:
            self.short = str(error)
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
            self.short = str(error)
            LOG.warning("%s", error)
            frames = writer.close_short()
        if not frames:
            LOG.warning("%s", self._leave_nothing())
            return
        try:
            self._files.__exit__(None, None, None)
        except OutputError as error:
            self.short = str(error)
            LOG.warning("%s", error)
            return
        self.kept = self._path
        if short:
            LOG.warning("%s: %.1f s are kept", self._path, frames / self.synth.rate)

    def _leave_nothing(self) -> OutputError:
        """Ends the transaction without a file; returns the error."""
        reason = OutputError(f"{self._path}: nothing was recorded")
        self._files.__exit__(type(reason), reason, None)
        return reason


MAX_TICKS = 0x7FFF  # a quarter note, in a MIDI file
MICROSECONDS = 1_000_000  # in a second
Given = Callable[[str], Mapping[str, str]]  # the options that change a preset, by name


class MidiRecorder(Take):
    """`with MidiRecorder(path, synth, preset) as take:` writes the synth's messages as a MIDI file.

    The file begins with a text that names `preset` and the options `given` for it, so `livebass render` plays the same
    bass, and with a program for other software. A change of preset adds a text and a program at the first frame of its
    bass. A tick is a frame, and one more text marks the file as a take, which `read_score` leaves unchanged: at the
    same rate it renders as it sounded. Call `take.turn()` often. Leaving the block, even by an exception, writes the
    file; after `discard` there is none. Raises OutputError if no file can be written at `path`.
    """

    def __init__(self, path: Path, synth: Synth, preset: str, given: Given = lambda preset: {}) -> None:
        self.path, self.synth, self.rate, self.given = path, synth, synth.rate, given
        self.kept: Path | None = None  # the file, once in its place
        self.short: str | None = None  # why there is no file
        checked_place(path)
        self._played: list[Row] | None = []  # each at its tick
        self._basses = [(0, preset)]  # (tick, preset)
        self._files = dict[str, str]()  # by path: what preset files held when they were chosen
        self._keep(preset)
        self._coming: list[tuple[str, LiveBass]] = []  # chosen presets whose basses have not begun
        synth.keep_messages()

    def end(self) -> None:
        if self._played is None:
            return
        try:
            with Transaction() as files:
                files.write(self.path, self._file(self._played))
            self.kept = self.path
        except OutputError as error:
            self.short = str(error)
            LOG.warning("%s", error)
        self._played = None

    def discard(self) -> None:
        """Leaves no file, unless it is already written."""
        self._played = None

    def turn(self) -> None:
        """Takes the messages played since the last call, except program changes; `choose` notes their presets."""
        if self._played is not None:
            for preset, bass in self._coming.copy():
                if bass.began is not None:
                    self._coming.remove((preset, bass))
                    self._basses.append((self._tick(bass.began), preset))
            for frame, status, first, second in self.synth.played():
                if status < 0xF0 and status & 0xF0 != PROGRAM:
                    self._played.append((self._tick(frame), status, first, second))

    def choose(self, preset: str, bass: LiveBass) -> None:
        """Notes that another preset plays from the first frame of its `bass`."""
        self._keep(preset)
        self._coming.append((preset, bass))

    def _keep(self, preset: str) -> None:
        """Keeps the text of a preset file, which may change later."""
        if is_path(preset):
            with suppress(PresetError):  # it has vanished: the take names it
                self._files[preset] = kept_text(preset)

    def _tick(self, frame: int) -> int:
        return round(frame * self.rate / self.synth.rate)

    def follow(self, synth: Synth) -> None:
        """Continues with the messages of `synth`, which goes on where the previous one ended."""
        self.turn()
        self.synth = synth
        synth.keep_messages()

    def _file(self, played: list[Row]) -> bytes:
        """A MIDI file of type 0, with the presets and their programs, on all channels played."""
        beats = 2
        while self.rate // beats > MAX_TICKS or self.rate % beats or MICROSECONDS % beats:
            beats += 1
        track = mido.MidiTrack([mido.MetaMessage("set_tempo", tempo=MICROSECONDS // beats)])
        track.append(mido.MetaMessage("text", text=TAKE))
        channels = sorted({status & 0x0F for _, status, *_ in played if status >= STATUS})
        events: list[tuple[int, mido.Message | mido.MetaMessage]] = []
        for tick, preset in self._basses:
            named = os.path.abspath(preset) if is_path(preset) else with_revision(preset)
            text = text_of(named, self.given(preset), self._files.get(preset, ""))
            events.append((tick, mido.MetaMessage("text", text=text)))
            events += [
                (tick, mido.Message("program_change", channel=c, program=program_of(preset) - 1)) for c in channels
            ]
        for tick, status, first, second in played:
            if status < STATUS:
                events.append((tick, mido.MetaMessage("text", text=text_of_stroke(status, first, second))))
                continue
            data = [status, first] if status & 0xF0 == 0xD0 else [status, first, second]
            events.append((tick, mido.Message.from_bytes(data)))
        last = 0
        for tick, message in sorted(events, key=lambda event: event[0]):
            message.time = max(tick - last, 0)
            track.append(message)
            last = max(tick, last)
        end = self._tick(self.synth.frame)  # held notes last until here
        track.append(mido.MetaMessage("end_of_track", time=max(end - last, 0)))
        file = io.BytesIO()
        mido.MidiFile(type=0, ticks_per_beat=self.rate // beats, tracks=[track]).save(file=file)
        return file.getvalue()
