"""A live session: output, MIDI, computer keyboard, score and recorder around one synth. [main thread]

The audio thread plays on its own. The session's loop runs twenty times a second: it sends the next messages of a score,
writes what was recorded, answers program changes and watches the devices. Another preset or quality is prepared in a
thread of its own and fades in at the start of a block. Events are logged to "livebass.live.session": lines for the
musician as INFO or WARNING, the load as DEBUG.
"""

from __future__ import annotations

import ctypes
import logging
import os
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

from livebass.interrupts import StopFlag
from livebass.live.guards import TIMEOUT
from livebass.live.inputs import LOOK_EVERY, MidiLost, MidiPort, TerminalKeys, let_go
from livebass.live.outputs import JackOutput, OutputLost, PortAudioOutput, silence_jack
from livebass.live.recording import Recorder
from livebass.live.synth import Gauge, LiveBass, Meters, Synth, strings
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES, Quality
from livebass.preset.load import load_preset, preset_names
from livebass.score import Score

LOG = logging.getLogger(__name__)
TURN = 0.05  # s
STALLED = 60  # turns without a new block after which the output counts as gone
STATUS_EVERY = 0.25  # s
LOG_EVERY = 60.0  # s, without any trouble
AFTER = 3.0  # s of sound after a score's end
Output = PortAudioOutput | JackOutput


@dataclass(frozen=True)
class Settings:
    """The bass that a session plays, and the devices to play through."""

    instrument: Instrument
    quality: Quality
    preset: str = ""  # the instrument's name or path as a preset, if it has one
    backend: str = "auto"  # "auto", "portaudio" or "jack"
    audio: int | str | None = None  # PortAudio device
    midi: str | None = None
    rate: int = 48000  # Hz, of PortAudio
    block: int = 128  # frames, of PortAudio
    latency: str | float = "low"  # s, or as PortAudio names it
    channel: int = -1  # 0-15; -1: all
    gain: float = 1.0
    record: Path | None = None
    read: Callable[[int], Score] | None = None  # returns the score to play at a rate
    keyboard: bool = True  # play from the computer keyboard


@dataclass(frozen=True)
class Summary:
    """The figures of a session that has ended."""

    output: str
    seconds: float
    meters: Meters
    worst: float  # load of a block, part of the time it lasts
    recorded: Path | None
    lost: str | None  # the reason, if it ended because the output went away


class Session:
    """Plays live with `settings`. `status`, if given, gets a status line four times a second."""

    def __init__(self, settings: Settings, status: Callable[[str], None] | None = None) -> None:
        self.settings, self.status = settings, status
        self.stop = StopFlag()
        self.synth: Synth | None = None  # set when it begins to play

    def run(self) -> Summary:
        """Plays until `stop` is set, the score is over, or the output is gone.

        Raises OutputLost and MidiLost for missing devices, OutputError for a recording that cannot be written, and
        whatever the score's reader raises: all before anything sounds. [main thread]
        """
        settings = self.settings
        with ExitStack() as ends:
            beside = ends.enter_context(ThreadPoolExecutor(1))
            coming: list[Future[LiveBass]] = []  # prepared while the output opens

            def make_synth(rate: int) -> Synth:
                coming.append(beside.submit(LiveBass, settings.instrument, settings.quality, rate))
                return Synth(rate, settings.channel, settings.gain)

            output = self._output(make_synth)
            ends.callback(output.close)
            synth = output.synth
            score = settings.read(synth.rate) if settings.read else None
            recorder = Recorder(settings.record, synth) if settings.record else None
            if recorder:
                ends.callback(recorder.discard)
            synth.switch_to(coming.pop().result())
            presets = PresetSwitch(synth, settings.preset, settings.quality)
            ends.callback(presets.close)
            others = {"\t": presets.next_preset, "\n": presets.next_quality, "\r": presets.next_quality}
            keys = ends.enter_context(TerminalKeys(synth.send, synth.panic, others)) if settings.keyboard else None
            output.start()
            midi = self._midi(synth, output)
            if midi:
                ends.callback(midi.close)
            silence_jack()
            if recorder:
                ends.push(recorder)  # ends first: a device that hangs later cannot lose the recording
            LOG.info("playing through %s, %d Hz, about %.1f ms", output.name, synth.rate, output.latency * 1e3)
            gauge, self.synth = Gauge(synth), synth
            lost = _Loop(self, output, midi, presets, keys, recorder, score, gauge).run()
            meters, seconds = gauge.read().meters, synth.frame / synth.rate
        return Summary(output.name, seconds, meters, gauge.worst, recorder.kept if recorder else None, lost)

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
        """Opens MIDI input: JACK's own port if something is connected to it, else a port of the system."""
        wanted, virtual = self.settings.midi, True
        if isinstance(output, JackOutput):
            connected = output.connect_midi(wanted)[0] if wanted is None or not wanted.isdigit() else []
            if wanted is None or connected:
                LOG.info("MIDI: the JACK port %s%s", output.midi.name, "".join(f", from {name}" for name in connected))
            if connected:
                return None
            virtual = False
        try:
            port = MidiPort(synth, wanted, output.block, virtual, hardware_only=not virtual and wanted is None)
        except MidiLost as error:
            if wanted is not None:
                raise
            if virtual:
                LOG.info("%s; the computer keyboard and --file still play", error)
            return None
        LOG.info("MIDI: %s", port.name)
        return port


@dataclass
class _Loop:
    """The main thread's work while the audio thread plays."""

    session: Session
    output: Output
    midi: MidiPort | None
    presets: PresetSwitch
    keys: TerminalKeys | None
    recorder: Recorder | None
    score: Score | None
    gauge: Gauge
    looking: threading.Thread = field(default_factory=threading.Thread)  # looks for MIDI ports: a server may hang

    def run(self) -> str | None:
        """Runs until something ends the session; returns the reason if it is the output."""
        try:
            return self._run()
        finally:
            if self.looking.is_alive():
                self.looking.join(TIMEOUT)

    def _run(self) -> str | None:
        synth, fed, waited, frame = self.output.synth, 0, 0, -1
        shown = looked = logged = time.monotonic()
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
            if self.recorder:
                self.recorder.turn()
            synth.release_faded()
            line = self.presets.turn()
            if line:
                LOG.info("%s", line)
            before, frame = frame, synth.frame
            waited = 0 if frame != before else waited + 1
            if not self.output.alive or waited > STALLED:
                self.output.abandon()
                return f"{self.output.name} is gone"
            now = time.monotonic()
            if now - looked > LOOK_EVERY and not self.looking.is_alive():
                looked = now
                self.looking = threading.Thread(target=self._look, daemon=True)
                self.looking.start()
            if now - shown > STATUS_EVERY:
                shown = now
                reading = self.gauge.read()
                if self.session.status:
                    self.session.status(f"{strings(synth)}   {reading.text()}")
                if reading.troubles != troubles or now - logged > LOG_EVERY:
                    troubles, logged = reading.troubles, now
                    LOG.debug("%s", reading.text())
        return None

    def _look(self) -> None:
        """Logs MIDI ports that have come or gone, and reconnects them. [a thread of its own]"""
        line = self.midi.look() if self.midi else None
        if line:
            LOG.info("%s", line)
        if isinstance(self.output, JackOutput):
            new, gone = self.output.connect_midi(self.session.settings.midi)
            for name in new:
                LOG.info("MIDI: %s is there", name)
            for name in gone:
                LOG.info("MIDI: %s is gone, waiting for it", name)
            if gone:
                let_go(self.output.synth)


NICENESS = 10  # of the thread that prepares basses: sound comes first


class PresetSwitch:
    """Switches preset and quality while the synth plays; requests that another one overtakes are never prepared."""

    def __init__(self, synth: Synth, preset: str, quality: Quality) -> None:
        """`preset`, a name or path, and `quality` are those of the bass that plays already."""
        self.synth = synth
        self.qualities = {**QUALITIES, quality.name: quality}
        self.playing = self.wanted = (preset, quality.name)
        self._thread = ThreadPoolExecutor(1, "presets", _step_back)
        self._coming: tuple[tuple[str, str], Future[LiveBass]] | None = None
        self._fading = False  # the bass before
        self._programs = synth.program[0]

    def next_preset(self) -> None:
        names = preset_names()
        known = self.wanted[0] in names
        self.wanted = names[(names.index(self.wanted[0]) + 1) % len(names) if known else 0], self.wanted[1]

    def next_quality(self) -> None:
        names = list(self.qualities)
        self.wanted = self.wanted[0], names[(names.index(self.wanted[1]) + 1) % len(names)]

    def turn(self) -> str | None:
        """Answers program changes, starts preparing, switches to what is ready; returns a line to show, or None.

        Returns at once. An error in a preset file is such a line as well, and the bass before plays on.
        """
        self._answer_program_changes()
        self.synth.release_faded()
        switching = self.synth.switching
        if self._fading and not switching:
            self._fading = False
            self._thread.submit(trim_memory)
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
        if wanted == self.wanted and switching:
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
            copy_controllers(before, bass)
        self.synth.switch_to(bass)
        self._fading = True
        return f"preset {wanted[0]}, quality {wanted[1]}"

    def _answer_program_changes(self) -> None:
        """A program change selects the preset of that number, in the order of `livebass presets list`."""
        count, number = self.synth.program
        if count != self._programs:
            self._programs = count
            names = preset_names()
            self.wanted = names[((number >> 8) * 128 + (number & 0x7F)) % len(names)], self.wanted[1]

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)


def prepared(preset: str, quality: Quality, rate: int) -> LiveBass:
    """Loads a preset for a synth. Raises PresetError and ValueError. [any thread]"""
    bass = LiveBass(load_preset(preset), quality, rate)
    trim_memory()
    return bass


def trim_memory() -> None:
    """Returns freed memory to the system, which the C library would keep. [any thread]"""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def copy_controllers(old: LiveBass, new: LiveBass) -> None:
    """Copies volume, pedal, pitch bend and the other controllers from `old` to `new`, which must not play yet."""
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
    """Lowers the priority of this thread, on systems where threads have one of their own."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
