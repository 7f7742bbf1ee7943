"""A live session: output, MIDI, computer keyboard, score and recorder around one synth. [main thread]

The audio thread plays on its own. The session's loop runs twenty times a second, and plays keys as they are pressed: it
sends the next messages of a score, writes what was recorded, answers program changes and watches the devices. Another
preset or quality is prepared in a thread of its own and begins at the start of a block, while the one before rings out.
When the server's rate changes, the bass is prepared anew in a synth of its own. Events are logged to
"livebass.live.session": lines for the musician as INFO or WARNING, the load as DEBUG.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path

from livebass.cores import core_count
from livebass.interrupts import StopFlag
from livebass.live.carried import prepared
from livebass.live.control import control_table, meter_table, tuner_meters
from livebass.live.desk import Desk, MidiLearn
from livebass.live.guards import TIMEOUT
from livebass.live.inputs import LOOK_EVERY, MidiLost, MidiPort, TerminalKeys, let_go
from livebass.live.osc import HOST, OscServer, Value
from livebass.live.outputs import JackOutput, OutputLost, PortAudioOutput, restart_portaudio, silence_jack
from livebass.live.presets import PresetSwitch, return_freed_memory
from livebass.live.recording import MidiRecorder, Recorder
from livebass.live.synth import Gauge, LiveBass, Meters, Reading, Synth, strings
from livebass.live.thread import block
from livebass.live.tuner import frequency_of, tuning_text
from livebass.model.instrument import A4_HZ, Instrument
from livebass.model.keymap import KeyMap
from livebass.model.quality import Quality
from livebass.preset.load import load_preset
from livebass.score.score import Score
from livebass.units import is_number

LOG = logging.getLogger(__name__)
TURN = 0.05  # s
STALLED = 60  # turns without a new block after which the output counts as gone
STATUS_EVERY = 0.25  # s
LOG_EVERY = 60.0  # s, without any trouble
AFTER = 3.0  # s of sound after a score's end
TEMPO_STEP = 0.05  # of a key
WAIT = 30.0  # s for a sound card that has gone
SETTLED = 1.0  # s after the start in which underruns are nobody's fault
LOW_LOAD = 0.5  # part of a block's time: with less, underruns are the system's fault ...
SEVERAL = 3  # ... which is said from so many on
Output = PortAudioOutput | JackOutput


@dataclass(frozen=True)
class Settings:
    """The bass that a session plays, and the devices to play through."""

    instrument: Instrument
    quality: Quality | None  # None: the one that the machine carries
    preset: str = ""  # the instrument's name or path as a preset, if it has one
    load: Callable[[str], Instrument] = load_preset  # of each preset that is chosen
    backend: str = "auto"  # "auto", "portaudio" or "jack"
    audio: int | str | None = None  # PortAudio device
    midi: str | None = None
    rate: int = 48000  # Hz, of PortAudio
    block: int = 128  # frames, of PortAudio and PipeWire
    latency: str | float = "low"  # s, or as PortAudio names it
    asked: tuple[str, ...] = ()  # of "rate", "block" and "latency", those that the player has chosen
    channel: int = -1  # 0-15; -1: all
    gain: float = 1.0
    record: Path | None = None
    record_midi: Path | None = None
    given: Callable[[str], Mapping[str, str]] = lambda preset: {}  # the options that change a preset, for the take
    read: Callable[[int], Score] | None = None  # returns the score to play at a rate
    programs: Mapping[int, str] = field(default_factory=dict)  # presets that programs of the score choose, from 0
    keyboard: bool = True  # play from the computer keyboard
    midi_if_there: bool = False  # without the port `midi`, play as if none had been named
    client: str = "livebass"  # name of the JACK client
    connect: bool = True  # to JACK's speakers and MIDI sources
    strings: bool = False  # a JACK port for each string, beside the mix
    transport: bool = False  # the score follows JACK's transport
    loop: tuple[float, float] | None = None  # s of the score, which are repeated; (0, 0): all
    tempo: float = 1.0  # part of the score's own
    controllers: Mapping[str, int] = field(default_factory=dict)  # learned, by the parameter's symbol
    learn: tuple[str, ...] = ()  # parameters to learn a controller for
    osc: int | None = None  # UDP port of the control socket; 0: any that is free
    metronome: float = 0.0  # beats a minute; 0: none
    metronome_port: bool = False  # in a JACK port of its own
    tuner: bool = False
    cores: int | None = None  # of the processor, that play strings; None: as many as there are


@dataclass(frozen=True)
class Summary:
    """The figures of a session that has ended."""

    output: str
    seconds: float
    meters: Meters
    worst: float  # load of a block, part of the time it lasts
    peak: float  # 1 is full scale
    recorded: tuple[Path, ...]  # the files
    short: str | None  # why not all was recorded
    lost: str | None  # the reason, if it ended because the output went away
    dropped: int  # notes that no string could play
    preset: str  # that played last
    audio: str | None  # the PortAudio device, by a name that it alone has
    midi: str | None  # the MIDI port


class Session:
    """Plays live with `settings`. `status`, if given, gets a status line four times a second."""

    def __init__(self, settings: Settings, status: Callable[[str], None] | None = None) -> None:
        self.settings, self.status = settings, status
        self.stop = StopFlag()
        self.desk = Desk()
        self.desk.tempo = settings.tempo
        for symbol, controller in settings.controllers.items():
            self.desk.learn(symbol, controller)
        self.output: Output  # opened by `run`
        self.synth: Synth | None = None  # set when it begins to play ...
        self.loop: _Loop | None = None  # ... as is this

    def run(self) -> Summary:
        """Plays until `stop` is set, the score is over, or the output is gone.

        Raises OutputLost and MidiLost for missing devices, OutputError for a recording that cannot be written, and
        whatever the score's reader raises: all before anything sounds. [main thread]
        """
        settings = self.settings
        return_freed_memory()
        with ExitStack() as ends:
            beside = ends.enter_context(ThreadPoolExecutor(1))
            coming: list[Future[LiveBass]] = []  # prepared while the output opens

            def make_synth(rate: int) -> Synth:
                coming.append(beside.submit(prepared, settings.instrument, settings.quality, rate))
                return self._new_synth(rate)

            self.output = output = self._open_output(make_synth)
            ends.callback(self._close)
            synth = output.synth
            score = settings.read(synth.rate) if settings.read else None
            if score:
                self.desk.load(score)
                self.desk.loop = settings.loop
            recorder = Recorder(settings.record, synth) if settings.record else None
            if recorder:
                ends.callback(recorder.discard)
            messages = None
            if settings.record_midi:
                messages = MidiRecorder(settings.record_midi, synth, settings.preset, settings.given)
                ends.callback(messages.discard)
            synth.switch_to(coming.pop().result())
            self.start_helpers(synth)
            ends.callback(lambda: self.output.synth.stop_helpers())
            presets = PresetSwitch(synth, settings.preset, settings.quality, settings.load, settings.programs)
            ends.callback(presets.close)
            osc = self._control_socket(presets)
            if osc:
                ends.callback(osc.close)
            learn = MidiLearn(self.desk, settings.learn)
            others = {"\t": presets.next_preset, "\n": presets.next_quality, "\r": presets.next_quality}
            others |= {"\\": learn.next_parameter} | (self._score_keys() if score else {})
            keys = TerminalKeys(self._send, self._panic, others, self._key_map) if settings.keyboard else None
            if keys:
                ends.enter_context(keys)
            output.start()
            midi = self._midi(synth, output)
            if midi:
                ends.callback(midi.close)
            silence_jack()
            for take in (messages, recorder):
                if take:
                    ends.push(take)  # ends first: a device that hangs later cannot lose the recording
            self._say_playing()
            if settings.quality is None:
                LOG.info(
                    "quality %s, by what this machine carries; --quality and Enter choose another", presets.quality
                )
            if osc:
                LOG.info("control socket: OSC at %s:%d", HOST, osc.port)
            gauge, self.synth = Gauge(synth), synth
            loop = self.loop = _Loop(self, midi, presets, keys, recorder, messages, score, gauge, learn, osc)
            lost = loop.run()
            synth = self.output.synth
            meters, seconds = gauge.read().meters, synth.frame / synth.rate
        takes = [take for take in (recorder, messages) if take]
        return Summary(
            self.output.name, seconds, meters, gauge.worst, gauge.peak,
            tuple(take.kept for take in takes if take.kept), next((t.short for t in takes if t.short), None), lost,
            synth.dropped, presets.playing[0], getattr(self.output, "full_name", None), midi.name if midi else None,
        )  # fmt: skip

    def _control_socket(self, presets: PresetSwitch) -> OscServer | None:
        """Opens the control socket, if one is wanted. Raises OscLost."""
        if self.settings.osc is None:
            return None
        controls = control_table(lambda: self.output.synth, self.desk, presets, self.roll, self.seek)
        return OscServer(self.settings.osc, controls, lambda: self.loop.meters() if self.loop else {})

    def _score_keys(self) -> dict[str, Callable[[], None]]:
        """What the keys of a score do: see SCORE_HELP of the inputs."""
        desk = self.desk

        def loop(begin: float, end: float) -> None:
            try:
                desk.loop = (begin, end)
            except ValueError as error:
                LOG.info("%s", error)

        def here(begins: bool) -> None:
            part = desk.loop or (0.0, desk.length)
            loop(*((max(desk.position, 0.0), part[1]) if begins else (part[0], desk.position)))

        def change_tempo(by: float) -> None:
            desk.tempo = round(desk.tempo + by, 2)

        def switch_loop() -> None:
            if desk.loop:
                desk.loop = None
            else:
                loop(*desk.looped_last)

        keys = {
            "k": lambda: self.roll(not desk.rolling),
            "a": lambda: self.seek(desk.loop[0] if desk.loop else 0.0),
            "<": lambda: change_tempo(-TEMPO_STEP),
            ">": lambda: change_tempo(TEMPO_STEP),
        }
        if not desk.follows_transport:
            keys |= {"f": switch_loop, "(": lambda: here(True), ")": lambda: here(False)}
        return keys

    def roll(self, rolling: bool) -> None:
        """Starts or stops the score, by JACK's transport if it follows that. [any thread]"""
        if self.desk.follows_transport and isinstance(self.output, JackOutput):
            self.output.roll(rolling)
        else:
            self.desk.rolling = rolling

    def seek(self, seconds: float) -> None:
        """Goes to a place of the score, by JACK's transport if it follows that. [any thread]"""
        if self.desk.follows_transport and isinstance(self.output, JackOutput):
            self.output.locate(max(seconds, 0.0) / self.desk.tempo)
        else:
            self.desk.seek(seconds)

    def _send(self, status: int, first: int, second: int) -> None:
        self.output.synth.send(status, first, second)

    def _key_map(self) -> KeyMap:
        bass = self.output.synth.bass
        return (bass.engine.instrument if bass else self.settings.instrument).player.keys

    def _panic(self) -> None:
        self.output.synth.panic()

    def _close(self) -> None:
        self.output.close()

    def _new_synth(self, rate: int) -> Synth:
        return Synth(rate, self.settings.channel, self.settings.gain, desk=self.desk)

    def start_helpers(self, synth: Synth) -> None:
        """Starts the threads that play strings beside the audio thread: one a core that is left, and a string.

        Without real-time priority other programs can hold them up in the middle of a string, and the audio thread with
        them: then they help only if cores were asked for.
        """
        cores = self.settings.cores or core_count()
        refused = synth.start_helpers(min(cores, len(self.settings.instrument.strings)) - 1)
        if refused and self.settings.cores is None:
            synth.stop_helpers()

    def _say_playing(self) -> None:
        output = self.output
        LOG.info("playing through %s, %d Hz, about %.1f ms", output.name, output.synth.rate, output.latency * 1e3)

    def _open_output(self, make_synth: Callable[[int], Synth]) -> Output:
        settings = self.settings
        if settings.backend == "jack" or (settings.backend == "auto" and settings.audio is None):
            try:
                output = JackOutput(
                    settings.client, make_synth, settings.connect, (settings.block, settings.rate),
                    settings.metronome_port,
                )  # fmt: skip
            except OutputLost:
                if settings.backend == "jack":
                    raise
            else:
                if ignored := [f"--{name}" for name in settings.asked if name != "block" or not output.pipewire]:
                    server = "PipeWire" if output.pipewire else "the JACK server"
                    LOG.info("%s: %s decides that itself", ", ".join(ignored), server)
                if settings.strings:
                    output.open_strings(len(settings.instrument.strings))
                if settings.transport:
                    output.follow_transport(self.desk)
                return output
        return self.open_portaudio(make_synth(settings.rate))

    def open_portaudio(self, synth: Synth) -> PortAudioOutput:
        """Opens the sound card for `synth`. Raises OutputLost."""
        settings = self.settings
        return PortAudioOutput(synth, settings.audio, settings.block, settings.latency)

    def _midi(self, synth: Synth, output: Output) -> MidiPort | None:
        """Opens MIDI input: JACK's own port if something is connected to it, else a port of the system."""
        wanted, virtual = self.settings.midi, True
        if isinstance(output, JackOutput):
            connected = output.connect_midi(wanted)[0] if wanted is None or not is_number(wanted) else []
            if wanted is None or connected:
                LOG.info("MIDI: the JACK port %s%s", output.midi.name, "".join(f", from {name}" for name in connected))
            if connected or not self.settings.connect:
                return None
            virtual = False
        try:
            port = MidiPort(synth, wanted, output.block, virtual, hardware_only=not virtual and wanted is None)
        except MidiLost as error:
            if wanted is not None and self.settings.midi_if_there:
                LOG.info("MIDI: %s is not there", wanted)
                self.settings = replace(self.settings, midi=None)
                return self._midi(synth, output)
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
    midi: MidiPort | None
    presets: PresetSwitch
    keys: TerminalKeys | None
    recorder: Recorder | None
    messages: MidiRecorder | None
    score: Score | None
    gauge: Gauge
    learn: MidiLearn | None = None
    osc: OscServer | None = None
    reading: Reading | None = None  # the last
    looking: threading.Thread = field(default_factory=threading.Thread)  # looks for ports: a server may hang
    moving: Future[LiveBass] | None = None  # the bass at another rate
    gain: float = 1.0  # linear, before it
    underruns: int = 0  # at the last reading
    excused: int = 0  # underruns while the load was low
    advised: bool = False

    def run(self) -> str | None:
        """Runs until something ends the session; returns the reason if it is the output."""
        try:
            return self._run()
        finally:
            if self.looking.is_alive():
                self.looking.join(TIMEOUT)

    @property
    def output(self) -> Output:
        return self.session.output

    def _run(self) -> str | None:
        waited, frame = 0, -1
        began = shown = looked = logged = time.monotonic()
        troubles: tuple[int, ...] = (0, 0, 0, 0)
        self._begin()
        while not self.session.stop.is_set():
            if self.keys:
                self.keys.read(TURN)
            else:
                time.sleep(TURN)
            synth = self.output.synth
            if self._score_is_over():
                return None
            for take in (self.recorder, self.messages):
                if take:
                    take.turn()
            if self.session.settings.tuner and not (self.recorder and self.recorder.writing):
                synth.recorded()
            if self.learn:
                self.learn.turn()
            synth.release_faded()
            synth.follow_cores()
            try:
                preset = self.presets.playing[0]
                line = self.presets.turn() if self.output.rate == synth.rate else self._follow_rate()
                if self.presets.playing[0] != preset:
                    self._follow_preset(self.presets.playing[0])
            except ValueError as error:  # a rate that the bass cannot be played at
                return f"{self.output.name}: {error}"
            if line:
                LOG.info("%s", line)
            before, frame = frame, synth.frame
            waited = 0 if frame != before else waited + 1
            if not self.output.alive or waited > STALLED:
                lost = f"{self.output.name} is gone"
                if not self._reopen():
                    self.output.abandon()
                    return None if self.session.stop.is_set() else lost
                waited = 0
            now = time.monotonic()
            if now - looked > LOOK_EVERY and not self.looking.is_alive():
                looked = now
                self.looking = threading.Thread(target=self._look, daemon=True)
                self.looking.start()
            if now - shown > STATUS_EVERY:
                shown = now
                self.reading = reading = self.gauge.read()
                if self.osc:
                    self.osc.publish()
                if self.session.status:
                    self.session.status(self._status(reading))
                if reading.troubles != troubles or now - logged > LOG_EVERY:
                    troubles, logged = reading.troubles, now
                    LOG.debug("%s", reading.text())
                self._advise(reading, now - began)
        return None

    def _begin(self) -> None:
        """Starts the score, the metronome and the tuner."""
        settings, desk, synth = self.session.settings, self.session.desk, self.output.synth
        desk.rolling = True
        if settings.metronome:
            desk.click(settings.metronome, synth.rate, synth.frame + synth.rate // 5)
        if settings.tuner and not self.recorder:
            synth.start_recording()

    def _score_is_over(self) -> bool:
        """True some time after the end of a score that is played once."""
        desk = self.session.desk
        if self.score is None or desk.follows_transport or desk.loop or not desk.rolling:
            return False
        return desk.position > self.score.end_frame / self.score.rate + AFTER * desk.tempo

    def _follow_preset(self, preset: str) -> None:
        """Notes in the MIDI take that another preset plays, and opens ports for all of its strings."""
        bass = self.output.synth.bass
        if self.messages and bass is not None:
            self.messages.choose(preset, bass)
        if self.session.settings.strings and isinstance(self.output, JackOutput) and bass is not None:
            self.output.open_strings(bass.engine.strings)

    def frequency(self) -> float:
        """The pitch of what sounds, Hz; NaN without a tuner. [any thread]"""
        synth = self.output.synth
        return frequency_of(synth.recent, synth.rate) if self.session.settings.tuner else math.nan

    def a4(self) -> float:
        """The pitch of A4 (Hz) that the bass is tuned to. [any thread]"""
        bass = self.output.synth.bass
        return bass.engine.instrument.a4 if bass else A4_HZ

    def meters(self) -> dict[str, Value]:
        """All meters for the control socket, by name. [any thread]"""
        desk, notes = self.session.desk, strings(self.output.synth)
        return meter_table(self.reading) | {
            "notes": notes, "preset": self.presets.playing[0], "quality": self.presets.quality,
            "position": desk.position, "tempo": desk.tempo,
        } | tuner_meters(self.frequency(), self.a4())  # fmt: skip

    def _status(self, reading: Reading) -> str:
        """The status line: level, notes, preset, load, and the keyboard's velocity and octave."""
        notes, preset = strings(self.output.synth) or "-", Path(self.presets.playing[0]).stem
        parts = [reading.meter(), notes, preset, reading.load_text()]
        desk = self.session.desk
        if self.session.settings.tuner:
            parts.insert(0, tuning_text(self.frequency(), self.a4()))
        if desk.score:
            loop = "loop {} to {}".format(*map(clock, desk.loop)) if desk.loop else ""
            tempo = f"tempo {desk.tempo:.0%}" if desk.tempo != 1 else ""
            stands = "" if desk.rolling else "paused"
            place = f"{clock(desk.position)} of {clock(desk.length)}"
            parts.append(", ".join(part for part in (place, loop, tempo, stands) if part))
        if desk.beats:
            parts.append(f"metronome {desk.beats:g}")
        if self.keys and self.keys.active:
            parts.append(f"velocity {self.keys.velocity}, octave {self.keys.octave}")
            parts.append(self.keys.ways)
        return "   ".join(part for part in parts if part)

    def _advise(self, reading: Reading, seconds: float) -> None:
        """Says once what helps if there are underruns although the load is low."""
        new = reading.meters.underruns - self.underruns
        self.underruns += new
        if seconds > SETTLED and reading.meters.worst < LOW_LOAD:
            self.excused += new
        if self.excused >= SEVERAL and not self.advised:
            self.advised = True
            LOG.warning(
                "%d underruns while no block took half of its time: the system is late, not the bass; %s",
                self.excused, self.output.advice(),
            )  # fmt: skip

    def _follow_rate(self) -> str | None:
        """Prepares the bass for the server's new rate, in silence, and then plays it; returns a line, or None.

        Raises ValueError for a rate that the bass cannot be played at.
        """
        old, rate = self.output.synth, self.output.rate
        if self.moving is None:
            playing = old.bass
            assert playing is not None and isinstance(self.output, JackOutput)
            self.gain = float(old.record["gain_target"][0])
            old.set_gain(0.0)
            self.moving = self.presets.prepare(playing.engine.instrument, rate)
            return f"{self.output.name} now runs at {rate} Hz: preparing the bass for it"
        if not self.moving.done():
            return None
        bass, self.moving = self.moving.result(), None
        if bass.engine.rate == rate:
            self._move(old, bass)
            self.session._say_playing()
        return None

    def _move(self, old: Synth, bass: LiveBass) -> None:
        """Plays on with `bass` in a new synth at its rate."""
        assert isinstance(self.output, JackOutput)
        synth = self.session._new_synth(bass.engine.rate)
        synth.take_over(old)
        synth.record["gain"] = synth.record["gain_target"] = self.gain
        if old.bass is not None:
            block.keep_controllers(bass.address, old.bass.address)
        synth.switch_to(bass)
        synth.start_helpers(old.cores - 1)
        if self.recorder:
            self.recorder.follow(synth)
        if self.messages:
            self.messages.follow(synth)
        self.output.play(synth)
        old.stop_helpers()
        self.session.synth = self.presets.synth = synth
        self.gauge.follow(synth)
        if self.midi:
            self.midi.synth = synth
        desk = self.session.desk
        desk.click(desk.beats, synth.rate, synth.frame)
        if self.session.settings.tuner and not (self.recorder and self.recorder.writing):
            synth.start_recording()

    def _reopen(self) -> bool:
        """Waits for a sound card that has gone, or another one in its place; returns whether there is one."""
        gone = self.output
        if not isinstance(gone, PortAudioOutput) or not gone.can_return or not gone.close():
            return False
        LOG.warning("%s is gone, waiting for it", gone.name)
        end = time.monotonic() + WAIT
        while time.monotonic() < end and not self.session.stop.is_set():
            time.sleep(0.5)
            try:
                restart_portaudio()
                self.session.output = self.session.open_portaudio(gone.synth)
                self.session.output.start()
            except OutputLost:
                continue
            self.session._say_playing()
            return True
        return False

    def _look(self) -> None:
        """Logs speakers and MIDI ports that have come or gone, and reconnects them. [a thread of its own]"""
        line = self.midi.look() if self.midi else None
        if line:
            LOG.info("%s", line)
        if isinstance(self.output, JackOutput):
            for line in self.output.look():
                LOG.info("%s", line)
            new, gone = self.output.connect_midi(self.session.settings.midi)
            for name in new:
                LOG.info("MIDI: %s is there", name)
            for name in gone:
                LOG.info("MIDI: %s is gone, waiting for it", name)
            if gone:
                let_go(self.output.synth)


def clock(seconds: float) -> str:
    """`1:05` for a time in a score."""
    whole = max(int(seconds), 0)
    return f"{whole // 60}:{whole % 60:02d}"
