"""A JACK server on a virtual clock: a period lasts as long as its client plays, and none is lost.

It calls the client through the C pointers of the JACK library, so the audio thread's side is as it is behind a real
server. It has one client and no speakers.
"""

from __future__ import annotations

import ctypes as c
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from livebass.live import jack, jackmidi, outputs, portaudio
from livebass.live.thread.desk import POSITION_FRAME, ROLLING
from livebass.rows.arrays import Floats
from support.structures import struct

RATE, PERIOD = 48000, 256
PAUSE = 0.001  # s between two periods in a thread: others, such as a recorder's, keep up
I32, U32, I64, P = c.c_int32, c.c_uint32, c.c_int64, c.c_void_p
PROCESS, BUFFER, COUNT = c.CFUNCTYPE(I32, U32, P), c.CFUNCTYPE(P, P, U32), c.CFUNCTYPE(U32, P)
GET, QUERY = c.CFUNCTYPE(I32, P, P, U32), c.CFUNCTYPE(I32, P, P)


Event = struct(time=U32, size=c.c_size_t, data=P)  # a jack_midi_event_t


class Ports(list[SimpleNamespace]):
    """The ports of one kind of a client."""

    def __init__(self, server: Server) -> None:
        super().__init__()
        self.server = server

    def register(self, name: str) -> SimpleNamespace:
        ports = self.server.ports
        port = SimpleNamespace(name=f"fake:{name}", shortname=name, _ptr=len(ports) + 1, sound=np.zeros(PERIOD, "f4"))
        ports.append(port)
        self.append(port)
        return port


class Server:
    """A server, its only client, and the module `jack` that opens it."""

    JackError = JackOpenError = ConnectionError
    blocksize, realtime = PERIOD, False

    def __init__(self) -> None:
        self.samplerate, self.frame, self.rolling, self.transport_frame = RATE, 0, False, 0
        self.process: Any = None
        self.data = 0
        self.active = False
        self.midi: list[tuple[int, bytes]] = []  # (offset, bytes) for the next period
        self.heard: dict[str, list[Floats]] = {}  # periods of each output since `listen`
        self.listening = False
        self.took: list[float] = []  # processor time of each period, s
        self.since = 0  # frames of a period that have passed when it plays
        self._functions = {
            "jack_port_get_buffer": BUFFER(self._buffer),
            "jack_midi_get_event_count": COUNT(lambda port: len(self._events)),
            "jack_midi_event_get": GET(self._event),
            "jack_transport_query": QUERY(self._query),
            "jack_frames_since_cycle_start": COUNT(lambda client: self.since),
        }
        self._lib = SimpleNamespace(jack_set_process_callback=self._set_process)
        for name, function in self._functions.items():
            setattr(self._lib, name, c.cast(function, P).value)
        self._ffi = SimpleNamespace(cast=lambda kind, value: value)
        self._events: list[tuple[int, Any]] = []
        self._turn = threading.Lock()

    def Client(self, name: str, no_start_server: bool) -> Server:
        self.name, self._ptr = name, 1
        self.ports: list[SimpleNamespace] = []
        self.outports, self.midi_inports = Ports(self), Ports(self)
        return self

    def version_string(self) -> str:
        return "fake"

    def _ignore(self, *_: object, **__: object) -> None:
        """Does nothing: callbacks for errors, and connections."""

    set_error_function = set_info_function = set_samplerate_callback = set_shutdown_callback = _ignore
    set_xrun_callback = set_blocksize_callback = connect = _ignore

    def get_ports(self, *_: object, **__: object) -> list[object]:
        return []

    get_all_connections = get_ports

    def activate(self) -> None:
        self.active = True

    def deactivate(self, ignore_errors: bool = True) -> None:
        with self._turn:
            self.active = False

    close = deactivate

    def transport_start(self) -> None:
        self.rolling = True

    def transport_stop(self) -> None:
        self.rolling = False

    def _set_process(self, _client: int, function: int, data: int) -> int:
        self.process, self.data = PROCESS(function), data
        return 0

    def _buffer(self, port: int, _frames: int) -> int:
        return int(self.ports[port - 1].sound.ctypes.data)

    def _event(self, event: int, _port: int, index: int) -> int:
        offset, data = self._events[index]
        Event.from_address(event).time, Event.from_address(event).size = offset, len(data) - 1
        Event.from_address(event).data = c.addressof(data)
        return 0

    def _query(self, _client: int, position: int) -> int:
        U32.from_address(position + 8 * POSITION_FRAME + 4).value = self.transport_frame
        return ROLLING if self.rolling else 0

    def period(self) -> None:
        """Plays the next period."""
        with self._turn:
            if not self.active:
                return
            self._events = [(offset, c.create_string_buffer(data)) for offset, data in self.midi]
            self.midi = []
            began = time.thread_time()
            self.process(PERIOD, self.data)
            self.took.append(time.thread_time() - began)
            if self.listening:
                for port in self.outports:
                    self.heard.setdefault(port.shortname, []).append(port.sound.copy())
            self.frame += PERIOD
            self.transport_frame += PERIOD * self.rolling

    def play(self, seconds: float) -> dict[str, Floats]:
        """Plays for `seconds`; returns the sound of each output."""
        self.heard, self.listening = {}, True
        for _ in range(round(seconds * RATE / PERIOD)):
            self.period()
        self.listening = False
        return {name: np.concatenate(parts) for name, parts in self.heard.items()}


@contextmanager
def fake_jack(runs: bool = False) -> Iterator[Server]:
    """A server in place of the JACK library. If it `runs`, a thread plays one period after another."""
    server, over = Server(), threading.Event()

    def run() -> None:
        while not over.is_set():
            server.period()
            time.sleep(PAUSE)

    thread = threading.Thread(target=run)
    with pytest.MonkeyPatch.context() as patch:
        for module in (jack, jackmidi, outputs, portaudio):
            patch.setattr(module, "jack_library", lambda: server)
        if runs:
            thread.start()
        try:
            yield server
        finally:
            over.set()
            if runs:
                thread.join()
