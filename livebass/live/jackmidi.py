"""MIDI inputs of a JACK server, by a client of JACK-Client's. [main thread]

JACK's thread moves the messages into the synth without Python: see thread/callbacks.py.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import Any

import numpy as np

from livebass.live.device_errors import MidiLost, OutputLost, one_line
from livebass.live.guards import call_with_timeout, never_release, open_jack_client, silenced_stderr
from livebass.live.jack import jack_library, midi_sources, silence
from livebass.live.synth import Synth
from livebass.live.thread import callbacks

IN, VIRTUAL = range(callbacks.MIDI_PORTS)


class JackMidi:
    """Inputs of a JACK client that only hears MIDI: one connected to a source, and a virtual one.

    `synth` plays each message `delay` frames after its place in the server's time. It must not play in a JackOutput,
    whose own MIDI port writes into the same ring. Raises MidiLost if JACK-Client is missing, or no server answers.
    """

    def __init__(self, name: str) -> None:
        try:
            self._jack = jack_library()
        except OutputLost as error:
            raise MidiLost(str(error)) from None
        silence(self._jack)
        try:
            self.client = open_jack_client(self._jack, name)
        except self._jack.JackError:
            raise MidiLost("no JACK server") from None
        self.name = name
        self.record = np.zeros(1, callbacks.JACK_MIDI)
        self._ports: list[Any] = [None] * callbacks.MIDI_PORTS
        self._gone = threading.Event()
        self._active = False
        self._synths: list[Synth] = []  # all so far: JACK's thread may still be in the last but one

    @property
    def synth(self) -> Synth:
        return self._synths[-1]

    @synth.setter
    def synth(self, synth: Synth) -> None:
        self._synths = [*self._synths[-1:], synth]
        self.record["desk"] = synth.desk.address if synth.desk else 0
        self.record["synth"] = synth.address

    @property
    def delay(self) -> int:
        return int(self.record["delay"][0])

    @delay.setter
    def delay(self, frames: int) -> None:
        self.record["delay"] = frames

    def names(self) -> list[str]:
        """Returns the names of all MIDI sources; none if the server has gone."""
        return [] if self._gone.is_set() else midi_sources(self._jack, self.client)

    def open(self, name: str) -> None:
        """Connects the source `name` to the port `in`. Raises MidiLost."""
        try:
            port = self._port(IN, "in")
            with silenced_stderr():
                if name not in [source.name for source in self.client.get_all_connections(port)]:
                    self.client.connect(name, port)
        except self._jack.JackError as error:
            raise MidiLost(f"MIDI input {name}: {one_line(error)}") from None

    def open_virtual(self) -> None:
        """Opens a port named like the client. Raises MidiLost."""
        try:
            self._port(VIRTUAL, self.name)
        except self._jack.JackError as error:
            raise MidiLost(f"no MIDI input, and no virtual one can be opened: {one_line(error)}") from None

    def _port(self, which: int, name: str) -> Any:
        """The port `which`, registered and heard."""
        if self._ports[which] is None:
            self._ports[which] = port = self.client.midi_inports.register(name)
            self.record["port"][0, which] = self._address(port._ptr)
        if not self._active:
            self._activate()
        return self._ports[which]

    def _activate(self) -> None:
        """Hands the callback to the server. Raises JackError."""
        r, lib, ffi = self.record, self._jack._lib, self._jack._ffi
        r["get_buffer"] = self._address(lib.jack_port_get_buffer)
        r["event_count"] = self._address(lib.jack_midi_get_event_count)
        r["event_get"] = self._address(lib.jack_midi_event_get)
        r["frames_since"] = self._address(lib.jack_frames_since_cycle_start)
        r["client"] = self._address(self.client._ptr)
        r["rate"] = self.client.samplerate
        function = ffi.cast("JackProcessCallback", callbacks.jack_midi.address)
        if lib.jack_set_process_callback(self.client._ptr, function, ffi.cast("void *", r.ctypes.data)):
            raise self._jack.JackError("the server refuses the callback")
        self.client.set_shutdown_callback(lambda *_: self._gone.set())
        self.client.activate()
        self._active = True

    def _address(self, value: Any) -> int:
        """Returns the address held in a C pointer of the JACK library."""
        return int(self._jack._ffi.cast("intptr_t", value))

    def close_port(self) -> None:
        """Disconnects the port `in`."""
        port = self._ports[IN]
        if port is not None and not self._gone.is_set():
            with suppress(self._jack.JackError), silenced_stderr():
                port.disconnect()

    def by_hand(self) -> frozenset[str]:
        """Returns the names of the sources connected to the virtual port."""
        port = self._ports[VIRTUAL]
        if port is None or self._gone.is_set():
            return frozenset()
        with suppress(self._jack.JackError), silenced_stderr():
            return frozenset(source.name for source in self.client.get_all_connections(port))
        return frozenset()

    def close(self) -> None:
        """Leaves the server; safe to call twice. A server that has gone or does not answer is abandoned."""
        client, self.client = self.client, None
        if client is None:
            return
        answers: list[bool] = []
        if not call_with_timeout(lambda: answers.append(self._answers()), None) or not any(answers):
            never_release((client, self.record, self._synths))  # closing it would hang or could crash
            return
        call_with_timeout(lambda: client.close(ignore_errors=True), (client, self.record, self._synths))

    def _answers(self) -> bool:
        """Returns whether there is a server; hangs if it hangs."""
        with suppress(self._jack.JackError):
            open_jack_client(self._jack, f"{self.name}-look").close()
            return True
        return False
