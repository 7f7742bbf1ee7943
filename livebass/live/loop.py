"""The main thread's work while the audio thread plays: twenty turns a second. [main thread]

A turn sends the next messages of a score, writes the recording, answers program changes and watches the devices.
When the server's rate changes, it prepares the bass for it in a new synth.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field

from livebass.live.desk import MidiLearn
from livebass.live.device_errors import OutputLost
from livebass.live.guards import TIMEOUT
from livebass.live.jack import JackOutput
from livebass.live.keyboard import TerminalKeys
from livebass.live.midi import LOOK_EVERY, MidiPort, let_go
from livebass.live.osc import OscServer
from livebass.live.portaudio import PortAudioOutput, restart_portaudio
from livebass.live.presets import PresetSwitch
from livebass.live.recording import MidiRecorder, Recorder
from livebass.live.rig import Rig
from livebass.live.status import Status
from livebass.live.synth import LiveBass, Synth
from livebass.live.thread import block
from livebass.score.score import Score

LOG = logging.getLogger("livebass.live.session")
TURN = 0.05  # s
STALLED = 60  # turns without a new block after which the output counts as gone
STATUS_EVERY = 0.25  # s
LOG_EVERY = 60.0  # s, if all is well
AFTER = 3.0  # s of sound after the score's end
WAIT = 30.0  # s for a sound card to return


@dataclass
class Loop:
    """The state of a session, and its turns."""

    rig: Rig
    presets: PresetSwitch
    status: Status
    show: Callable[[str], None] | None  # takes the status line
    learn: MidiLearn
    keys: TerminalKeys | None = None
    midi: MidiPort | None = None
    recorder: Recorder | None = None
    messages: MidiRecorder | None = None
    score: Score | None = None
    osc: OscServer | None = None
    looking: threading.Thread = field(default_factory=threading.Thread)  # checks the ports: a server may hang
    moving: Future[LiveBass] | None = None  # the bass at the new rate
    gain: float = 1.0  # linear, before the change
    frame: int = -1  # of the synth, at the last turn
    waited: int = 0  # turns without a new block

    def run(self) -> str | None:
        """Runs until the session ends; returns the reason if the output ended it."""
        try:
            return self._run()
        finally:
            if self.looking.is_alive():
                self.looking.join(TIMEOUT)

    def _run(self) -> str | None:
        began = shown = looked = logged = time.monotonic()
        troubles: tuple[int, ...] = (0, 0, 0, 0)
        self._begin()
        while not self.rig.stop.is_set():
            if self.keys:
                self.keys.read(TURN)
            else:
                time.sleep(TURN)
            if self._score_is_over():
                return None
            self._serve()
            try:
                self._follow()
            except ValueError as error:  # the bass cannot be played at this rate
                return f"{self.rig.output.name}: {error}"
            if self._stalled():
                lost = f"{self.rig.output.name} is gone"
                if not self._reopen():
                    self.rig.output.abandon()
                    return None if self.rig.stop.is_set() else lost
                self.waited = 0
            now = time.monotonic()
            if now - looked > LOOK_EVERY and not self.looking.is_alive():
                looked = now
                self.looking = threading.Thread(target=self._look, daemon=True)
                self.looking.start()
            if now - shown > STATUS_EVERY:
                shown = now
                reading = self.status.read()
                if self.osc:
                    self.osc.publish()
                if self.show:
                    self.show(self.status.line(reading))
                if reading.troubles != troubles or now - logged > LOG_EVERY:
                    troubles, logged = reading.troubles, now
                    LOG.debug("%s", reading.text())
                self.status.advise(reading, now - began)
        return None

    def _serve(self) -> None:
        """Writes recordings, learns controllers, and maintains the synth."""
        synth = self.rig.output.synth
        for take in (self.recorder, self.messages):
            if take:
                take.turn()
        if self.rig.settings.tuner and not (self.recorder and self.recorder.writing):
            synth.recorded()
        self.learn.turn()
        synth.release_faded()
        synth.follow_cores()

    def _follow(self) -> None:
        """Follows program changes, or the server's rate. Raises ValueError for a rate the bass cannot be played at."""
        preset, output = self.presets.playing[0], self.rig.output
        line = self.presets.turn() if output.rate == output.synth.rate else self._follow_rate()
        if self.presets.playing[0] != preset:
            self._follow_preset(self.presets.playing[0])
        if line:
            LOG.info("%s", line)

    def _stalled(self) -> bool:
        """True if the output is gone, or requests no more blocks."""
        before, self.frame = self.frame, self.rig.output.synth.frame
        self.waited = 0 if self.frame != before else self.waited + 1
        return not self.rig.output.alive or self.waited > STALLED

    def _begin(self) -> None:
        """Starts the score, the metronome and the tuner."""
        settings, desk, synth = self.rig.settings, self.rig.desk, self.rig.output.synth
        desk.rolling = True
        if settings.metronome:
            desk.click(settings.metronome, synth.rate, synth.frame + synth.rate // 5)
        if settings.tuner and not self.recorder:
            synth.start_recording()

    def _score_is_over(self) -> bool:
        """True some time after the end of a score that does not loop."""
        desk = self.rig.desk
        if self.score is None or desk.follows_transport or desk.loop or not desk.rolling:
            return False
        return desk.position > self.score.end_frame / self.score.rate + AFTER * desk.tempo

    def _follow_preset(self, preset: str) -> None:
        """Records a change of preset in the MIDI take, and opens ports for all of its strings."""
        bass = self.rig.output.synth.bass
        if self.messages and bass is not None:
            self.messages.choose(preset, bass)
        if self.rig.settings.strings and isinstance(self.rig.output, JackOutput) and bass is not None:
            self.rig.output.open_strings(bass.engine.strings)

    def _follow_rate(self) -> str | None:
        """Prepares the bass for the server's new rate, in silence, then plays it; returns a line, or None.

        Raises ValueError for a rate that the bass cannot be played at.
        """
        old, rate = self.rig.output.synth, self.rig.output.rate
        if self.moving is None:
            playing = old.bass
            assert playing is not None and isinstance(self.rig.output, JackOutput)
            self.gain = float(old.record["gain_target"][0])
            old.record["gain_target"] = 0.0
            self.moving = self.presets.prepare(playing.engine.instrument, rate)
            return f"{self.rig.output.name} now runs at {rate} Hz: preparing the bass for it"
        if not self.moving.done():
            return None
        bass, self.moving = self.moving.result(), None
        if bass.engine.rate == rate:
            self._move(old, bass)
            self.rig.say_playing()
        return None

    def _move(self, old: Synth, bass: LiveBass) -> None:
        """Continues with `bass` in a new synth at its rate."""
        assert isinstance(self.rig.output, JackOutput)
        synth = self.rig.new_synth(bass.engine.rate)
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
        self.rig.output.play(synth)
        old.stop_helpers()
        self.rig.synth = self.presets.synth = synth
        self.status.gauge.follow(synth)
        if self.midi:
            self.midi.synth = synth
        desk = self.rig.desk
        desk.click(desk.beats, synth.rate, synth.frame)
        if self.rig.settings.tuner and not (self.recorder and self.recorder.writing):
            synth.start_recording()

    def _reopen(self) -> bool:
        """Waits for a lost sound card, or one in its place; returns whether it came."""
        gone = self.rig.output
        if not isinstance(gone, PortAudioOutput) or not gone.can_return or not gone.close():
            return False
        LOG.warning("%s is gone, waiting for it", gone.name)
        end = time.monotonic() + WAIT
        while time.monotonic() < end and not self.rig.stop.is_set():
            time.sleep(0.5)
            try:
                restart_portaudio()
                self.rig.output = self.rig.open_portaudio(gone.synth)
                self.rig.output.start()
            except OutputLost:
                continue
            self.rig.say_playing()
            return True
        return False

    def _look(self) -> None:
        """Logs and reconnects speakers and MIDI ports that come or go. [its own thread]"""
        line = self.midi.look() if self.midi else None
        if line:
            LOG.info("%s", line)
        if isinstance(self.rig.output, JackOutput):
            for line in self.rig.output.look():
                LOG.info("%s", line)
            new, gone = self.rig.output.connect_midi(self.rig.settings.midi)
            for name in new:
                LOG.info("MIDI: %s is there", name)
            for name in gone:
                LOG.info("MIDI: %s is gone, waiting for it", name)
            if gone:
                let_go(self.rig.output.synth)
