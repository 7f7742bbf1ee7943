"""Playing live: output, MIDI, computer keyboard, score and recorder around one synth. [main thread]

The audio thread plays on its own; this loop looks in on it twenty times a second: hands over the next messages of a
score, takes what was recorded, answers program changes, and says how it goes.

Another preset or quality while it sounds: prepared in a thread beside, put on at a block's edge. [main thread]
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

from livebass.live.hush import PATIENCE
from livebass.live.inputs import LOOK_EVERY, MidiLost, MidiPort, TerminalKeys, let_go
from livebass.live.outputs import JackOutput, OutputLost, PortAudioOutput, hush_jack
from livebass.live.recording import Recorder
from livebass.live.synth import Gauge, LiveBass, Meters, Reading, Synth, strings
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES, Quality
from livebass.preset.load import load_preset, preset_names
from livebass.score import Score

TURN = 0.05  # s
STALLED = 60  # turns in which an output asked for nothing: it is gone
SAY_EVERY = 0.25  # s
NOTE_EVERY = 60.0  # s, without any trouble
AFTER = 3.0  # s of sound after a score's end
Output = PortAudioOutput | JackOutput
Line = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """What to play with."""

    instrument: Instrument
    quality: Quality
    preset: str = ""  # the instrument's name among the presets, if it has one
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
    lost: str | None  # why the output ended it


class StopFlag:
    """A settings to end. Without the lock of an Event, which a signal's handler may find taken by who it interrupts."""

    def __init__(self) -> None:
        self._wanted = False

    def set(self) -> None:
        self._wanted = True

    def is_set(self) -> bool:
        return self._wanted


class Session:
    """One evening on the synth.

    `say` hears of changes, a line each; `status`, where it is given, four times a second what plays and the load;
    `note` of the load where there was trouble, and once a minute.
    """

    def __init__(self, settings: Settings, say: Line, status: Line | None = None, note: Line | None = None) -> None:
        self.settings, self.say, self.status, self.note = settings, say, status, note
        self.stop = StopFlag()
        self.synth: Synth | None = None  # as soon as it plays

    def run(self) -> Summary:
        """Plays until `stop` is set, the score is over, or the output is gone.

        Raises OutputLost and MidiLost for what is not there, OutputError for a take that cannot be written, and
        what the score's reader raises: all before anything sounds. [main thread]
        """
        settings = self.settings
        with ExitStack() as ends:
            beside = ends.enter_context(ThreadPoolExecutor(1))
            coming: list[Future[LiveBass]] = []  # prepared while the output gets ready

            def make_synth(rate: int) -> Synth:
                coming.append(beside.submit(LiveBass, settings.instrument, settings.quality, rate))
                return Synth(rate, settings.channel, settings.gain)

            output = self._output(make_synth)
            ends.callback(output.close)
            synth = output.synth
            score = settings.read(synth.rate) if settings.read else None
            take = Recorder(settings.record, synth, self.say) if settings.record else None
            if take:
                ends.callback(take.discard)
            synth.switch_to(coming.pop().result())
            changes = PresetSwitch(synth, settings.preset, settings.quality)
            ends.callback(changes.close)
            others = {"\t": changes.next_preset, "\n": changes.next_quality, "\r": changes.next_quality}
            keys = ends.enter_context(TerminalKeys(synth.send, synth.panic, others)) if settings.keyboard else None
            output.start()
            midi = self._midi(synth, output)
            if midi:
                ends.callback(midi.close)
            hush_jack()
            if take:
                ends.push(take)  # the first that is ended: whatever hangs after it does not lose it
            self.say(f"playing through {output.name}, {synth.rate} Hz, about {output.latency * 1e3:.1f} ms")
            gauge, self.synth = Gauge(synth), synth
            lost = _Loop(self, output, midi, changes, keys, take, score, gauge).run()
            meters, seconds = gauge.read().meters, synth.frame / synth.rate
        return Summary(output.name, seconds, meters, gauge.worst, take.kept if take else None, lost)

    def _output(self, make_synth: Callable[[int], Synth]) -> Output:
        settings = self.settings
        if settings.backend in ("auto", "jack") and settings.audio is None:
            try:
                return JackOutput("livebass", make_synth)
            except OutputLost:
                if settings.backend == "jack":
                    raise
        return PortAudioOutput(make_synth(settings.rate), settings.audio, settings.block, settings.latency)

    def _midi(self, synth: Synth, output: Output) -> MidiPort | None:
        """JACK's own MIDI where there is some, or else a port of the system's."""
        wanted, virtual = self.settings.midi, True
        if isinstance(output, JackOutput):
            connected = output.connect_midi(wanted)[0] if wanted is None or not wanted.isdigit() else []
            if wanted is None or connected:
                self.say(f"MIDI: the JACK port {output.midi.name}" + "".join(f", from {name}" for name in connected))
            if connected:
                return None
            virtual = False
        try:
            port = MidiPort(synth, wanted, output.block, virtual, hardware_only=not virtual and wanted is None)
        except MidiLost as error:
            if wanted is not None:
                raise
            if virtual:
                self.say(f"{error}; the computer keyboard and --file still play")
            return None
        self.say(f"MIDI: {port.name}")
        return port


@dataclass
class _Loop:
    """What runs beside the audio thread."""

    session: Session
    output: Output
    midi: MidiPort | None
    changes: PresetSwitch
    keys: TerminalKeys | None
    take: Recorder | None
    score: Score | None
    gauge: Gauge
    heard: deque[str] = field(default_factory=deque)

    looking: threading.Thread = field(default_factory=threading.Thread)  # for MIDI, beside: a server may hang

    def run(self) -> str | None:
        """Until something ends it; why, if it is the output."""
        try:
            return self._run()
        finally:
            if self.looking.is_alive():
                self.looking.join(PATIENCE)

    def _run(self) -> str | None:
        synth, fed, waited, frame = self.output.synth, 0, 0, -1
        said = looked = noted = time.monotonic()
        troubles: tuple[int, ...] = (0, 0, 0, 0)
        start = synth.frame + synth.rate // 5
        while not self.session.stop.is_set():
            time.sleep(TURN)
            if self.keys:
                self.keys.read()
            if self.score is not None:
                fed = synth.feed(self.score, fed, start)
                if frame > start + self.score.end_frame + AFTER * synth.rate:
                    return None
            if self.take:
                self.take.turn()
            synth.release_faded()
            self._say(self.changes.turn())
            before, frame = frame, synth.frame
            waited = 0 if frame != before else waited + 1
            if not self.output.alive or waited > STALLED:
                return f"{self.output.name} is gone"
            now = time.monotonic()
            if now - looked > LOOK_EVERY and not self.looking.is_alive():
                looked = now
                self.looking = threading.Thread(target=self._look, daemon=True)
                self.looking.start()
            while self.heard:
                self._say(self.heard.popleft())
            if now - said > SAY_EVERY:
                said = now
                reading = self.gauge.read()
                if self.session.status:
                    self.session.status(f"{strings(synth)}   {reading.text()}")
                if reading.troubles != troubles or now - noted > NOTE_EVERY:
                    troubles, noted = reading.troubles, now
                    self._note(reading)
        return None

    def _look(self) -> None:
        """MIDI that has come or gone: lines for `heard`. [a thread of its own]"""
        line = self.midi.look() if self.midi else None
        if line:
            self.heard.append(line)
        if isinstance(self.output, JackOutput):
            new, gone = self.output.connect_midi(self.session.settings.midi)
            self.heard.extend(f"MIDI: {name} is there" for name in new)
            self.heard.extend(f"MIDI: {name} is gone, waiting for it" for name in gone)
            if gone:
                let_go(self.output.synth)

    def _say(self, line: str | None) -> None:
        if line:
            self.session.say(line)

    def _note(self, reading: Reading) -> None:
        if self.session.note:
            self.session.note(reading.text())


NICENESS = 10  # of the thread that prepares: what sounds comes first


class PresetSwitch:
    """What is wished for and what plays. The last settings counts; those that it overtook are never prepared."""

    def __init__(self, synth: Synth, preset: str, quality: Quality) -> None:
        """`preset`, a name or path, and `quality` are what is on the synth already."""
        self.synth = synth
        self.qualities = {**QUALITIES, quality.name: quality}
        self.playing = self.wanted = (preset, quality.name)
        self._thread = ThreadPoolExecutor(1, "changes", _step_back)
        self._coming: tuple[tuple[str, str], Future[LiveBass]] | None = None
        self._leaving = False  # the bass before
        self._programs = synth.program[0]

    def next_preset(self) -> None:
        names = preset_names()
        known = self.wanted[0] in names
        self.wanted = names[(names.index(self.wanted[0]) + 1) % len(names) if known else 0], self.wanted[1]

    def next_quality(self) -> None:
        names = list(self.qualities)
        self.wanted = self.wanted[0], names[(names.index(self.wanted[1]) + 1) % len(names)]

    def turn(self) -> str | None:
        """Looks for program changes, starts what is to be prepared, puts on what is ready; a line for people, or None.

        Returns at once. What a preset's file has wrong is such a line too, and the bass before plays on.
        """
        self._hear()
        self.synth.release_faded()
        fading = self.synth.switching
        if self._leaving and not fading:
            self._leaving = False
            self._thread.submit(give_back)
        if self._coming is None:
            if self.wanted != self.playing:
                preset, quality = self.wanted
                self._coming = (
                    self.wanted,
                    self._thread.submit(prepared, preset, self.qualities[quality], self.synth.rate),
                )
            return None
        wanted, future = self._coming
        if not future.done():
            return None
        if wanted == self.wanted and fading:
            return None
        self._coming = None
        if wanted != self.wanted:
            return None
        try:
            bass = future.result()
        except (ValueError, OSError) as error:
            self.wanted = self.playing
            return f"{wanted[0]}: {error}"
        before, self.playing = self.synth.bass, wanted
        if before is not None:
            take_over(before, bass)
        self.synth.switch_to(bass)
        self._leaving = True
        return f"preset {wanted[0]}, quality {wanted[1]}"

    def _hear(self) -> None:
        """A program change means the preset of that number, in the order of `livebass presets list`."""
        count, number = self.synth.program
        if count != self._programs:
            self._programs = count
            names = preset_names()
            self.wanted = names[((number >> 8) * 128 + (number & 0x7F)) % len(names)], self.wanted[1]

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)


def prepared(preset: str, quality: Quality, rate: int) -> LiveBass:
    """A bass for the synth. Raises PresetError and ValueError. [any thread]"""
    bass = LiveBass(load_preset(preset), quality, rate)
    give_back()
    return bass


def give_back() -> None:
    """What was allocated on the way goes back to the system, where the C library would keep it. [any thread]"""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def take_over(old: LiveBass, new: LiveBass) -> None:
    """Volume, pedal, wheel and the other controllers of `old` hold for `new`, which has not been put on."""
    p, q = old.engine.performer, new.engine.performer
    for name in ("volume", "expression", "wheel", "pedal", "parameter"):
        q[name] = p[name]
    if p["range"][0] != old.engine.instrument.player.bend_range:
        q["range"] = p["range"]
    if p["position"][0] != p["usual_position"][0]:
        part = (p["position"] - p["nearest"]) / (p["farthest"] - p["nearest"])
        q["position"] = q["nearest"] + (q["farthest"] - q["nearest"]) * part
    for v in new.engine.voices:
        v.record["gain"] = v.record["gain_wanted"] = (q["volume"] * q["expression"]) ** 2
        v.record["bend"] = v.record["tuned"] = 2.0 ** (q["wheel"] * q["range"] / 12.0)


def _step_back() -> None:
    if sys.platform == "linux":  # where a thread has a niceness of its own
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
