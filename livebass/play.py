"""Playing live: output, MIDI, computer keyboard, score and recorder around one stage. [main thread]

The audio thread plays on its own; this loop looks in on it twenty times a second: hands over the next messages of a
score, takes what was recorded, answers program changes, and says how it goes.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from livebass.atomic import Transaction
from livebass.audiofile import AudioWriter, encoding
from livebass.instrument import Instrument
from livebass.midi_in import LOOK_EVERY, MidiLost, MidiPort
from livebass.outputs import JackOutput, OutputLost, PortAudioOutput
from livebass.preset import PresetError, load_preset, preset_names
from livebass.quality import Quality
from livebass.score import Score
from livebass.stage import LiveBass, Meters, Stage
from livebass.terminal import TerminalKeys

TURN = 0.05  # s
SAY_EVERY = 0.25  # s
AFTER = 3.0  # s of sound after a score's end


@dataclass(frozen=True)
class Wish:
    """What to play with."""

    instrument: Instrument
    quality: Quality
    backend: str = "auto"  # "auto", "portaudio" or "jack"
    audio: int | str | None = None  # PortAudio device
    midi: str | None = None
    rate: int = 48000
    block: int = 128
    latency: str | float = "low"
    channel: int = -1  # 0-15; -1: all
    gain: float = 1.0
    record: Path | None = None
    read: Callable[[int], Score] | None = None  # a score at a rate
    keyboard: bool = True


@dataclass(frozen=True)
class Summary:
    """What a session was."""

    output: str
    seconds: float
    meters: Meters
    worst: float  # load of a block, of the time it lasts
    recorded: Path | None


class Session:
    """One evening on the stage. `say` hears of changes, a line each; `status` of how it goes."""

    def __init__(self, wish: Wish, say: Callable[[str], None], status: Callable[[str], None] | None = None) -> None:
        self.wish, self.say, self.status = wish, say, status
        self.stop = threading.Event()
        self.worst = 0.0
        self._programs = 0

    def run(self) -> Summary:
        """Plays until `stop` is set, the score is over, or the output is gone. Raises OutputLost, MidiLost."""
        with ExitStack() as ends:
            output = self._output()
            ends.callback(output.close)
            stage = output.stage
            stage.put_on(LiveBass(self.wish.instrument, self.wish.quality, stage.rate))
            midi = self._midi(stage, output)
            if midi:
                ends.callback(midi.close)
            keys = ends.enter_context(TerminalKeys(stage.send, stage.panic))
            writer = self._recorder(stage, ends)
            score = self.wish.read(stage.rate) if self.wish.read else None
            output.start()
            self.say(f"playing through {output.name}, {stage.rate} Hz, about {output.latency * 1e3:.1f} ms")
            self._loop(stage, output, midi, keys if self.wish.keyboard else None, writer, score)
            seconds = float(stage.record["frame"][0]) / stage.rate
            output.close()
            if writer:
                writer.write(stage.recorded())
                writer.close()
            return Summary(output.name, seconds, stage.meters(), self.worst, self.wish.record if writer else None)

    def _output(self) -> PortAudioOutput | JackOutput:
        wish = self.wish
        if wish.backend in ("auto", "jack") and wish.audio is None:
            try:
                return JackOutput("livebass", lambda rate: Stage(rate, wish.channel, wish.gain))
            except OutputLost:
                if wish.backend == "jack":
                    raise
        return PortAudioOutput(Stage(wish.rate, wish.channel, wish.gain), wish.audio, wish.block, wish.latency)

    def _midi(self, stage: Stage, output: PortAudioOutput | JackOutput) -> MidiPort | None:
        if output.midi_included and self.wish.midi is None:
            self.say("MIDI: the JACK port livebass:midi_in")
            return None
        try:
            port = MidiPort(stage, self.wish.midi, output.block)
        except MidiLost as error:
            if self.wish.midi is not None:
                raise
            self.say(f"{error}; the computer keyboard and --file still play")
            return None
        self.say(f"MIDI: {port.name}")
        return port

    def _recorder(self, stage: Stage, ends: ExitStack) -> AudioWriter | None:
        if self.wish.record is None:
            return None
        files = ends.enter_context(Transaction())
        writer = AudioWriter(files, self.wish.record, encoding(self.wish.record, stage.rate))
        stage.start_recording()
        return writer

    def _loop(
        self, stage: Stage, output: PortAudioOutput | JackOutput, midi: MidiPort | None, keys: TerminalKeys | None,
        writer: AudioWriter | None, score: Score | None,
    ) -> None:  # fmt: skip
        fed, said, looked = 0, 0.0, time.monotonic()
        start = int(stage.record["frame"][0]) + stage.rate // 5
        while not self.stop.wait(TURN):
            if not output.alive:
                self.say(f"{output.name} is gone")
                return
            stage.clear_away()
            if keys:
                keys.read()
            if score is not None:
                fed = stage.feed(score, fed, start)
                if stage.record["frame"][0] > start + score.end_frame + AFTER * stage.rate:
                    return
            if writer:
                writer.write(stage.recorded())
            self._program(stage)
            now = time.monotonic()
            if midi and now - looked > LOOK_EVERY:
                looked = now
                change = midi.look()
                if change:
                    self.say(change)
            if now - said > SAY_EVERY:
                said = now
                self._report(stage)

    def _program(self, stage: Stage) -> None:
        """Answers a program change: the preset of that number, in the order of `livebass presets list`."""
        count = int(stage.record["program_count"][0])
        if count == self._programs:
            return
        self._programs = count
        names = preset_names()
        number = int(stage.record["program"][0])
        name = names[((number >> 8) * 128 + (number & 0x7F)) % len(names)]
        try:
            stage.put_on(LiveBass(load_preset(name), self.wish.quality, stage.rate))
        except (PresetError, ValueError) as error:
            self.say(f"preset {name}: {error}")
            return
        self.say(f"preset {name}")

    def _report(self, stage: Stage) -> None:
        meters = stage.meters()
        self.worst = max(self.worst, meters.worst)
        bass = stage.bass
        if self.status is None or bass is None:
            return
        fingers = " ".join(
            f"{name}{fret}{'*' if touching else ''}" if sounding else f"{name}-"
            for name, fret, sounding, touching in bass.fingers()
        )
        more = f", {meters.overload} strings coarse" if meters.overload else ""
        self.status(
            f"{fingers}   load {meters.load:.0%}, worst {meters.worst:.0%}, peak {meters.peak:.2f}, "
            f"underruns {meters.underruns}{more}"
        )
