"""The devices of a live session, its synth, and the desk that plays its score. [main thread]"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

from livebass.live.desk import Desk
from livebass.live.device_errors import MidiLost, NoMidi, OutputLost
from livebass.live.jack import JackOutput
from livebass.live.midi import MidiPort
from livebass.live.outputs import Output
from livebass.live.portaudio import PortAudioOutput
from livebass.live.settings import Settings
from livebass.live.synth import Synth
from livebass.model.keymap import KeyMap
from livebass.rows.units import is_number
from livebass.system.cores import core_count
from livebass.system.interrupts import StopFlag

LOG = logging.getLogger("livebass.live.session")


class Rig:
    """Opens devices by `settings`, and routes messages."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.stop = StopFlag()
        self.desk = Desk()
        self.desk.tempo = settings.tempo
        for symbol, controller in settings.controllers.items():
            self.desk.learn(symbol, controller)
        self.output: Output  # opened by the session's `run`
        self.synth: Synth | None = None  # set when it starts playing

    def roll(self, rolling: bool) -> None:
        """Starts or stops the score, through JACK's transport if it follows that. [any thread]"""
        if self.desk.follows_transport and isinstance(self.output, JackOutput):
            self.output.roll(rolling)
        else:
            self.desk.rolling = rolling

    def seek(self, seconds: float) -> None:
        """Moves to a time of the score, through JACK's transport if it follows that. [any thread]"""
        if self.desk.follows_transport and isinstance(self.output, JackOutput):
            self.output.locate(max(seconds, 0.0) / self.desk.tempo)
        else:
            self.desk.seek(seconds)

    def key_map(self) -> KeyMap:
        bass = self.output.synth.bass
        return (bass.engine.instrument if bass else self.settings.instrument).player.keys

    def new_synth(self, rate: int) -> Synth:
        return Synth(rate, self.settings.channel, self.settings.gain, desk=self.desk)

    def start_helpers(self, synth: Synth) -> None:
        """Starts the threads that play strings beside the audio thread: one per spare core, at most one per string.

        Without real-time priority other programs can interrupt them in mid-string, and delay the audio thread: then
        they help only if cores were requested.
        """
        cores = self.settings.cores or core_count()
        refused = synth.start_helpers(min(cores, len(self.settings.instrument.strings)) - 1)
        if refused and self.settings.cores is None:
            synth.stop_helpers()

    def say_playing(self) -> None:
        output = self.output
        LOG.info("playing through %s, %d Hz, about %.1f ms", output.name, output.synth.rate, output.latency * 1e3)

    def open_output(self, make_synth: Callable[[int], Synth]) -> Output:
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
                if ignored := [f"--{name}" for name in settings.requested if name != "block" or not output.pipewire]:
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

    def open_midi(self, synth: Synth, output: Output) -> MidiPort | None:
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
            port = MidiPort(synth, wanted, output.block, virtual, jack=virtual)
        except MidiLost as error:
            name = None
            if isinstance(error, NoMidi) and isinstance(output, JackOutput):
                name = output.midi_source(wanted or "")  # whose number `livebass devices` shows
            if name:
                self.settings = replace(self.settings, midi=name)
                return self.open_midi(synth, output)
            if wanted is not None and self.settings.midi_if_there:
                LOG.info("MIDI: %s is not there", wanted)
                self.settings = replace(self.settings, midi=None)
                return self.open_midi(synth, output)
            if wanted is not None:
                raise
            if virtual:
                LOG.info("%s; the computer keyboard and --file still play", error)
            return None
        LOG.info("MIDI: %s", port.name)
        return port
