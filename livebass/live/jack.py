"""Plays through a JACK server, with a MIDI port and the transport. [main thread]"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from livebass.kernels.player.performer import MAX_STRINGS
from livebass.live.desk import Desk
from livebass.live.device_errors import OutputLost, one_line
from livebass.live.guards import call_with_timeout, open_jack_client, silenced_stderr
from livebass.live.synth import Synth, touch
from livebass.live.thread import callbacks
from livebass.model.quality import BLOCK
from livebass.rows.units import is_number
from livebass.system.extras import install

FIRST_BLOCK = 0.5  # s to wait for the server to request it


class JackOutput:
    """Plays as a client of a running JACK server, with two output ports and a MIDI input. Raises OutputLost.

    `connect` connects the outputs to the speakers and MIDI sources to the input. `period` (frames, Hz) is requested
    from PipeWire, which gives each client its own. The synth's desk, if any, plays along; with `click_port` its
    metronome has its own port, `metronome`.
    """

    def __init__(
        self,
        name: str,
        make_synth: Callable[[int], Synth],
        connect: bool = True,
        period: tuple[int, int] | None = None,
        click_port: bool = False,
    ) -> None:
        if period:
            os.environ.setdefault("PIPEWIRE_LATENCY", f"{period[0]}/{period[1]}")
        jack = jack_library()
        self._jack = jack
        self.pipewire = "PipeWire" in _jack_version(jack)
        silence(jack)
        try:
            self.client = open_jack_client(jack, name)
        except jack.JackError as error:
            raise no_server(one_line(error)) from None
        try:
            self._prepare(make_synth)
            if click_port:
                self.click = self.client.outports.register("metronome")
                self.record["click"] = self._address(self.click._ptr)
        except BaseException:
            self.client.close(ignore_errors=True)
            raise
        self._connect = connect
        self._strings: list[Any] = []  # ports of single strings, lowest first
        self._seen: set[str] = set()
        self._speakers: list[str] = []  # ports that the outputs are connected to
        self._silent: Synth | None = None  # the previous one; the audio thread may still be in it

    def _prepare(self, make_synth: Callable[[int], Synth]) -> None:
        """Makes the synth for the server's rate, the ports and the callbacks. Raises the errors of `make_synth`."""
        self.name = f"JACK client {self.client.name}"
        self.block = int(self.client.blocksize)
        self.rate = 0  # the server's; `play` follows it
        self.client.set_samplerate_callback(self._change_rate)
        end = time.monotonic() + FIRST_BLOCK
        while self.pipewire and not self.rate and time.monotonic() < end:
            time.sleep(0.005)  # before that, PipeWire's library reports the rate in PIPEWIRE_LATENCY as the server's
        self.rate = self.rate or int(self.client.samplerate)
        self.synth = make_synth(self.rate)
        self.outputs = [self.client.outports.register(f"out_{k}") for k in (1, 2)]
        self.midi = self.client.midi_inports.register("midi_in")
        self.record = np.zeros(1, callbacks.JACK)
        ffi, lib, r, address = self._jack._ffi, self._jack._lib, self.record, self._address
        self._sheets = np.zeros((2 + MAX_STRINGS, callbacks.MAX_FRAMES), np.float32)
        touch(self._sheets)
        r["sheets"] = self._sheets.ctypes.data
        r["synth"], r["outputs"] = self.synth.address, len(self.outputs)
        r["desk"] = self.synth.desk.address if self.synth.desk else 0
        r["get_buffer"] = address(lib.jack_port_get_buffer)
        r["event_count"] = address(lib.jack_midi_get_event_count)
        r["event_get"] = address(lib.jack_midi_event_get)
        for k, port in enumerate(self.outputs):
            r["output"][0, k] = address(port._ptr)
        r["midi"] = address(self.midi._ptr)
        function = ffi.cast("JackProcessCallback", callbacks.jack.address)
        if lib.jack_set_process_callback(self.client._ptr, function, ffi.cast("void *", r.ctypes.data)):
            raise OutputLost("JACK: the server refuses the callback")
        self._gone = self._closed = False
        self.client.set_shutdown_callback(self._shut_down)
        self.client.set_xrun_callback(self._xrun)
        self.client.set_blocksize_callback(self._resize)

    def _address(self, value: Any) -> int:
        """Returns the address held in a C pointer of the JACK library."""
        return int(self._jack._ffi.cast("intptr_t", value))

    def open_strings(self, count: int) -> None:
        """Opens `count` string ports beside the mix, lowest first: `string_1` and so on."""
        while len(self._strings) < min(count, MAX_STRINGS):
            port = self.client.outports.register(f"string_{len(self._strings) + 1}")
            self._strings.append(port)
            self.record["string"][0, len(self._strings) - 1] = self._address(port._ptr)
            self.record["strings"] = len(self._strings)

    def follow_transport(self, desk: Desk) -> None:
        """Makes the score of `desk` start, stop and move with JACK's transport."""
        desk.follows_transport = True
        desk.record["transport_query"] = self._address(self._jack._lib.jack_transport_query)
        desk.record["client"] = self._address(self.client._ptr)

    def roll(self, rolling: bool) -> None:
        """Starts or stops JACK's transport."""
        (self.client.transport_start if rolling else self.client.transport_stop)()

    def locate(self, seconds: float) -> None:
        """Moves JACK's transport."""
        self.client.transport_frame = round(seconds * self.rate)

    def _shut_down(self, _status: object, _reason: str) -> None:
        self._gone = True

    def _xrun(self, _delay: float) -> None:
        self.synth.record["underruns"] += 1

    def _resize(self, frames: int) -> None:
        self.block = frames

    def _change_rate(self, rate: int) -> None:
        self.rate = rate

    def start(self) -> None:
        """Starts playing, connected to the speakers if there are any."""
        try:
            self.client.activate()
            self._connect_speakers()
        except self._jack.JackError as error:
            raise OutputLost(f"JACK: {one_line(error)}") from None

    def play(self, synth: Synth) -> None:
        """Plays `synth` from the next block on, instead of the previous one."""
        self._silent, self.synth = self.synth, synth
        self.record["synth"] = synth.address

    def _connect_speakers(self) -> list[str]:
        """Connects the outputs to the speakers unless they were already; returns the ports."""
        if not self._connect or self._speakers:
            return []
        speakers = self.client.get_ports(is_physical=True, is_input=True, is_audio=True)[: len(self.outputs)]
        self._speakers = [port.name for port in speakers]
        for mine, port in zip(self.outputs, speakers, strict=False):
            self.client.connect(mine, port)
        return self._speakers

    def look(self) -> list[str]:
        """Connects to other speakers if the connected ones disappear; returns lines about it.

        A connection that the user removes stays removed.
        """
        if self._gone:
            return []
        try:
            there = {port.name for port in self.client.get_ports(is_input=True, is_audio=True)}
            gone = [name for name in self._speakers if name not in there]
            lines = [f"{_device(gone)} is gone"] if gone else []
            if gone:
                self._speakers = []
            if found := self._connect_speakers():
                lines.append(f"playing into {_device(found)}")
        except self._jack.JackError:
            return []
        return lines

    def advice(self) -> str:
        """Returns a remedy for underruns at low load."""
        if self.pipewire:
            block = f", or take --block {2 * self.block}" if 2 * self.block <= BLOCK[1] else ""
            return f"set PIPEWIRE_LATENCY={2 * self.block}/{self.rate}{block}"
        return f"give the JACK server a larger period than {self.block} frames (jackd -p), and real-time priority (-R)"

    def connect_midi(self, wanted: str | None = None) -> tuple[list[str], list[str]]:
        """Connects MIDI sources that are new since the last call; returns their names and those of lost sources.

        `wanted` is a part of a name; None means hardware. A source that the user disconnects stays disconnected.
        """
        if not self._connect or self._gone:
            return [], []
        try:
            ports = {p.name: p for p in self.client.get_ports(is_physical=wanted is None, is_output=True, is_midi=True)}
            heard = {p.name for p in self.client.get_all_connections(self.midi)}
            fitting = [name for name in ports if (wanted or "").casefold() in name.casefold()]
            new = [name for name in fitting if name not in self._seen]
            for name in new:
                if name not in heard:
                    self.client.connect(ports[name], self.midi)
        except self._jack.JackError:
            return [], []
        gone, self._seen = self._seen - set(fitting), set(fitting)
        return new, sorted(gone)

    def midi_source(self, number: str) -> str | None:
        """Returns the name of the server's MIDI source with this number, as `livebass devices` counts; or None."""
        names = midi_sources(self._jack, self.client)
        return names[int(number)] if is_number(number) and int(number) < len(names) else None

    @property
    def alive(self) -> bool:
        return not self._gone

    @property
    def latency(self) -> float:
        return self.block / self.synth.rate

    def abandon(self) -> None:
        """Marks the server as gone before it reports so: there is nothing to deactivate."""
        self._gone = True

    def close(self) -> None:
        """Stops playback; safe to call twice. A server that does not answer is abandoned."""
        if self._closed:
            return
        self._closed = True
        call_with_timeout(self._end, self)

    def _end(self) -> None:
        if not self._gone:
            self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


def _device(ports: list[str]) -> str:
    """The name of the client that has these ports."""
    return ports[0].rpartition(":")[0]


def _jack_version(jack: Any) -> str:
    """Returns the JACK library's version text; PipeWire's contains its name."""
    try:
        return str(jack.version_string())
    except (AttributeError, jack.JackError):
        return ""


def midi_sources(jack: Any, client: Any) -> list[str]:
    """Returns the names of all MIDI sources of the server of `client`; none if it has gone."""
    with suppress(jack.JackError), silenced_stderr():
        return [port.name for port in client.get_ports(is_midi=True, is_output=True)]
    return []


def jack_server() -> str | None:
    """Returns a line about the running JACK server; None if there is none, or no JACK library."""
    try:
        jack = jack_library()
    except OutputLost:
        return None
    try:
        client = open_jack_client(jack, "livebass-look")
    except jack.JackError:
        return None
    try:
        sources = len(midi_sources(jack, client))
        return f"{client.samplerate} Hz, {client.blocksize} frames, {sources} MIDI sources"
    finally:
        client.close(ignore_errors=True)


def no_server(why: object) -> OutputLost:
    named = f" named {os.environ['JACK_DEFAULT_SERVER']}" if os.environ.get("JACK_DEFAULT_SERVER") else ""
    return OutputLost(
        f"JACK: no server{named} can be reached ({why}): start one, or use --backend portaudio;"
        " `livebass render` needs neither"
    )


def jack_library() -> Any:
    try:
        import jack
    except ImportError as error:
        raise OutputLost(f"JACK: {one_line(error)}; {install('live')}") from None
    except OSError as error:
        raise OutputLost(f"JACK: {one_line(error)}; on Debian: sudo apt install libjack-jackd2-0") from None
    return jack


def silence_jack() -> None:
    """Silences JACK again: some libraries reinstall its message handlers."""
    if "jack" in sys.modules:
        silence(sys.modules["jack"])


def silence(jack: Any) -> None:
    """Stops JACK from printing to stderr; exceptions say what matters."""
    for quiet in (jack.set_error_function, jack.set_info_function):
        quiet(lambda message: None)
