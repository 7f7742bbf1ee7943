"""A live session: output, MIDI, computer keyboard, score and recorder around one synth. [main thread]

The audio thread plays on its own; the session's loop serves it. A new preset or quality is prepared in its own
thread and begins at the start of a block, while the previous one rings out. Events are logged to
"livebass.live.session": lines for the musician as INFO or WARNING, the load as DEBUG.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack

from livebass.live.best_quality import prepare_bass
from livebass.live.control import control_table
from livebass.live.desk import MidiLearn
from livebass.live.jack import silence_jack
from livebass.live.keyboard import TerminalKeys
from livebass.live.loop import Loop
from livebass.live.osc import HOST, OscServer
from livebass.live.presets import PresetSwitch, return_freed_memory
from livebass.live.recording import MidiRecorder, Recorder
from livebass.live.rig import Rig
from livebass.live.settings import Settings, Summary
from livebass.live.status import Status
from livebass.live.synth import Gauge, LiveBass, Synth
from livebass.score.score import Score

LOG = logging.getLogger(__name__)
TEMPO_STEP = 0.05  # per key press


class Session(Rig):
    """Plays live with `settings`. `show`, if given, gets a status line four times a second."""

    def __init__(self, settings: Settings, show: Callable[[str], None] | None = None) -> None:
        super().__init__(settings)
        self.show = show
        self.status: Status | None = None  # set when it starts playing

    def run(self) -> Summary:
        """Plays until `stop` is set, the score is over, or the output is gone.

        Raises, before anything sounds, OutputLost and MidiLost for missing devices, OutputError for a recording that
        cannot be written, and the errors of the score's reader. [main thread]
        """
        return_freed_memory()
        with ExitStack() as ends:
            loop = self._set_up(ends)
            lost = loop.run()
            synth, gauge = self.output.synth, loop.status.gauge
            meters, seconds = gauge.read().meters, synth.frame / synth.rate
        takes = [take for take in (loop.recorder, loop.messages) if take]
        return Summary(
            output=self.output.name,
            seconds=seconds,
            meters=meters,
            worst=gauge.worst,
            peak=gauge.peak,
            recorded=tuple(take.kept for take in takes if take.kept),
            short=next((take.short for take in takes if take.short), None),
            lost=lost,
            dropped=synth.dropped,
            preset=loop.presets.playing[0],
            audio=getattr(self.output, "full_name", None),
            midi=loop.midi.name if loop.midi else None,
        )

    def _set_up(self, ends: ExitStack) -> Loop:
        """Opens the devices and starts playing; `ends` closes everything, the takes first."""
        settings = self.settings
        bass = self._open(ends)
        output, synth = self.output, self.output.synth
        score = self._score()
        recorder = Recorder(settings.record, synth) if settings.record else None
        messages = None
        if recorder:
            ends.callback(recorder.discard)
        if settings.record_midi:
            messages = MidiRecorder(settings.record_midi, synth, settings.preset, settings.given)
            ends.callback(messages.discard)
        synth.switch_to(bass.result())
        self.start_helpers(synth)
        ends.callback(lambda: self.output.synth.stop_helpers())
        presets = PresetSwitch(synth, settings.preset, settings.quality, settings.load, settings.programs)
        ends.callback(presets.close)
        osc = self._control_socket(presets)
        if osc:
            ends.callback(osc.close)
        learn = MidiLearn(self.desk, settings.learn)
        keys = self._keys(presets, learn, score) if settings.keyboard else None
        if keys:
            ends.enter_context(keys)
        output.start()
        midi = self.open_midi(synth, output)
        if midi:
            ends.callback(midi.close)
        silence_jack()
        for take in (messages, recorder):
            if take:
                ends.push(take)  # ends first: a device that hangs later cannot lose the recording
        self.say_playing()
        if settings.quality is None:
            LOG.info("quality %s, the best for this machine; --quality and Enter choose another", presets.quality)
        if osc:
            LOG.info("control socket: OSC at %s:%d", HOST, osc.port)
        self.status, self.synth = Status(self, presets, Gauge(synth), keys), synth
        return Loop(self, presets, self.status, self.show, learn, keys, midi, recorder, messages, score, osc)

    def _open(self, ends: ExitStack) -> Future[LiveBass]:
        """Opens the output; returns the bass for its rate, prepared meanwhile."""
        beside = ends.enter_context(ThreadPoolExecutor(1))
        coming: list[Future[LiveBass]] = []

        def make_synth(rate: int) -> Synth:
            coming.append(beside.submit(prepare_bass, self.settings.instrument, self.settings.quality, rate))
            return self.new_synth(rate)

        self.output = self.open_output(make_synth)
        ends.callback(lambda: self.output.close())
        return coming.pop()

    def _score(self) -> Score | None:
        """Reads the score for the output's rate, if there is one, and puts it on the desk."""
        if not self.settings.read:
            return None
        score = self.settings.read(self.output.synth.rate)
        self.desk.load(score)
        self.desk.loop = self.settings.loop
        return score

    def _keys(self, presets: PresetSwitch, learn: MidiLearn, score: Score | None) -> TerminalKeys:
        others = {"\t": presets.next_preset, "\n": presets.next_quality, "\r": presets.next_quality}
        others |= {"\\": learn.next_parameter} | (self._score_keys() if score else {})
        return TerminalKeys(
            lambda *message: self.output.synth.send(*message), lambda: self.output.synth.panic(), others, self.key_map
        )

    def _control_socket(self, presets: PresetSwitch) -> OscServer | None:
        """Opens the control socket, if requested. Raises OscLost."""
        if self.settings.osc is None:
            return None
        controls = control_table(lambda: self.output.synth, self.desk, presets, self.roll, self.seek)
        return OscServer(self.settings.osc, controls, lambda: self.status.meters() if self.status else {})

    def _score_keys(self) -> dict[str, Callable[[], None]]:
        """The actions of the score keys: see SCORE_HELP of the keyboard."""
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
