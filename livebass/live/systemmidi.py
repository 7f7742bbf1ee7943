"""MIDI inputs of the system, through supriya-midi: ALSA's sequencer, CoreMIDI, Windows. [main thread]"""

from __future__ import annotations

import ctypes
import os
import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from livebass.live.device_errors import MidiLost, one_line
from livebass.live.guards import call_with_timeout, silenced_stderr
from livebass.live.synth import Synth
from livebass.system.extras import install

CLIENT, IN = "livebass", "in"  # names of the client and its virtual port, and of the port that opens another
SYSTEMS = {"alsa": "ALSA's sequencer"}  # by RtMidi's names
OTHERS = ("jack", "dummy", "web")  # RtMidi's: JACK has its own client here, see jackmidi.py
ALSA_CLIENTS = Path("/proc/asound/seq/clients")
ALSA_LIBRARY = "libasound.so.2"
DUPLEX = 3  # SND_SEQ_OPEN_DUPLEX
QUIET, LONGEST_QUEUE = 0.05, 1.0  # s without a message until all that have come are heard; at most


class SystemMidi:
    """Inputs of the system's MIDI: one of its ports and a virtual port, both played by `synth`.

    Each message plays `delay` frames after it arrives. Raises MidiLost if supriya-midi is missing or the system has no
    MIDI.
    """

    synth: Synth
    delay = 0
    _count = 0  # messages heard

    def __init__(self) -> None:
        self._rtmidi = rtmidi_library()
        self._api = None
        self._errors: list[str] = []  # of opening a port
        self._looker = self._new_input(f"{CLIENT}-look")
        self._in: Any = None
        self._virtual: Any = None

    def _new_input(self, name: str) -> Any:
        """Returns an input of the first system that answers. Raises MidiLost."""
        rtmidi = self._rtmidi
        known = {api: rtmidi.get_api_name(api) for api in rtmidi.get_compiled_apis()}
        apis = [api for api in known if known[api] not in OTHERS]
        for api in apis if self._api is None else [self._api]:
            try:
                with silenced_stderr():
                    made = rtmidi.MidiIn(api, name)
            except RuntimeError:  # names the library's functions
                continue
            made.set_error_callback(self._failed)
            self._api = api
            return made
        tried = " or ".join(SYSTEMS.get(known[api]) or rtmidi.get_api_display_name(api) for api in apis)
        raise MidiLost(f"no answer from {tried or 'supriya-midi, which was built without a MIDI system'}")

    def _failed(self, kind: Any, text: str, _data: object) -> None:
        """Keeps an error for `_listen`: raised on RtMidi's thread, as supriya-midi would, it would end the process.

        [any thread]
        """
        if kind not in (self._rtmidi.RtMidiErrorType.WARNING, self._rtmidi.RtMidiErrorType.DEBUG_WARNING):
            self._errors.append(text)

    def names(self) -> list[str]:
        """Returns the names of all ports but livebass' own."""
        return [name for name in self._all_names(self._looker) if name and not name.startswith(CLIENT)]

    def _all_names(self, port: Any) -> list[str]:
        """The names by number; "" for a port that has vanished in between."""
        with silenced_stderr():
            return [port.get_port_name(number) for number in range(port.get_port_count())]

    def _listen(self, open_port: Callable[[Any], None], failed: str) -> Any:
        """A new input, opened by `open_port` and heard. Raises MidiLost, which begins with `failed`."""
        port = self._new_input(CLIENT)
        try:
            self._errors.clear()
            port.set_callback(self._heard)
            with silenced_stderr():
                open_port(port)
            if self._errors:
                raise ValueError(self._errors[0])
        except (NotImplementedError, ValueError) as error:
            self._end([port])
            raise MidiLost(f"{failed}: {one_line(error)}") from None
        return port

    def open(self, name: str) -> None:
        """Opens the port `name`. Raises MidiLost."""

        def open_port(port: Any) -> None:
            number = self._all_names(port).index(name)
            port.open_port(number, IN)
            if port.get_port_name(number) != name:
                raise ValueError("other ports have come or gone")

        self._in = self._listen(open_port, f"MIDI input {name}")

    def open_virtual(self) -> None:
        """Opens a virtual port. Raises MidiLost if this system has none."""
        failed = "no MIDI input, and no virtual one can be opened"
        self._virtual = self._listen(lambda port: port.open_virtual_port(CLIENT), failed)

    def close_port(self) -> None:
        """Closes the port that `open` opened."""
        port, self._in = self._in, None
        if port is not None:
            self._end([port], IN)

    def _heard(self, message: Sequence[int], _since: float, _data: object) -> None:
        """Plays a message. [RtMidi's thread]"""
        self._count += 1
        if is_message(message):
            status, first, second = (*message, 0)[:3]
            self.synth.receive(status, first, second, self.synth.frame_now(self.delay))

    def by_hand(self) -> frozenset[str]:
        """Returns the sources connected to the virtual port by hand: ALSA addresses, such as 24:0."""
        try:
            return alsa_sources(ALSA_CLIENTS.read_text(errors="replace")) if self._virtual is not None else frozenset()
        except OSError:
            return frozenset()

    def close(self) -> None:
        """Closes all ports; safe to call twice."""
        opened = {IN: self._in, CLIENT: self._virtual, "": self._looker}
        ports = {name: port for name, port in opened.items() if port is not None}
        self._in = self._virtual = self._looker = None
        call_with_timeout(lambda: self._end(list(ports.values()), *filter(None, ports)), ports)

    def _end(self, ports: list[Any], *names: str) -> None:
        """Closes inputs for good; ALSA's ports with these `names` are disconnected first.

        supriya-midi keeps Python's lock while it waits for the thread that calls back. That thread waits for the lock
        if a message has just come. The library cannot disconnect a port without closing it.
        """
        if names and disconnect(*names):
            heard, end = -1, time.monotonic() + LONGEST_QUEUE
            while heard != self._count and time.monotonic() < end:
                heard = self._count
                time.sleep(QUIET)
        with silenced_stderr():
            for port in ports:
                port.close_port()
                port.delete()


def is_message(message: Sequence[int]) -> bool:
    """True for a complete channel message: a status and its number of data bytes, each below 128."""
    if not message or not 0x80 <= message[0] < 0xF0:
        return False
    return len(message) == (2 if message[0] & 0xE0 == 0xC0 else 3) and max(message[1:]) < 0x80


def alsa_sources(clients: str) -> frozenset[str]:
    """Returns the addresses (client:port) connected to a virtual port of livebass, from ALSA's list of `clients`."""
    return frozenset(source for _, source in alsa_connections(clients, CLIENT))


def alsa_connections(clients: str, *ports: str) -> list[tuple[str, str]]:
    """Returns the addresses (client:port) of livebass' `ports` and of a source for each of their connections."""
    found, client, number, name, port = [], "", "", "", ""
    for line in clients.splitlines():
        if named := re.match(r'Client +(\d+) : "(.*)"', line):
            number, client = named.groups()
        elif named := re.match(r' +Port +(\d+) : "(.*)"', line):
            port, name = named.groups()
        elif "Connected From:" in line and client == CLIENT and name in ports:
            found += [(f"{number}:{port}", source) for source in re.findall(r"\d+:\d+", line)]
    return found


def disconnect(*ports: str) -> bool:
    """Disconnects this process's ALSA ports with these names; returns whether one was connected."""
    try:
        connections = alsa_connections(ALSA_CLIENTS.read_text(errors="replace"), *ports)
        alsa = ctypes.CDLL(ALSA_LIBRARY) if connections else None
    except OSError:
        return False
    seq, info, wire = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_void_p()
    if alsa is None or alsa.snd_seq_open(ctypes.byref(seq), b"default", DUPLEX, 0) < 0:
        return False
    try:
        alsa.snd_seq_client_info_malloc(ctypes.byref(info))
        alsa.snd_seq_port_subscribe_malloc(ctypes.byref(wire))
        for ours, source in connections:
            alsa.snd_seq_get_any_client_info(seq, int(ours.partition(":")[0]), info)
            if alsa.snd_seq_client_info_get_pid(info) == os.getpid():
                alsa.snd_seq_port_subscribe_set_sender(wire, _alsa_address(source))
                alsa.snd_seq_port_subscribe_set_dest(wire, _alsa_address(ours))
                alsa.snd_seq_unsubscribe_port(seq, wire)
    finally:
        alsa.snd_seq_port_subscribe_free(wire)
        alsa.snd_seq_client_info_free(info)
        alsa.snd_seq_close(seq)
    return True


def _alsa_address(text: str) -> Any:
    """A pointer to the snd_seq_addr_t of an address such as 24:0."""
    return (ctypes.c_ubyte * 2)(*map(int, text.split(":")))


def rtmidi_library() -> Any:
    """Imports supriya-midi. Raises MidiLost with a way to install it or the library that it needs."""
    try:
        import supriya_midi
    except (ImportError, OSError) as error:
        brings = "on Debian: sudo apt install libportaudio2" if ALSA_LIBRARY in str(error) else install("live")
        raise MidiLost(f"{one_line(error)}; {brings}") from None
    return supriya_midi
