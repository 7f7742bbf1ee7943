"""MIDI ports through python-rtmidi. [main thread]"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from livebass.extras import install
from livebass.kernels.player.performer import CHANNELS
from livebass.live.guards import call_with_timeout, jack_hangs, never_release, open_jack_client, silenced_stderr
from livebass.live.lost import MidiLost, one_line
from livebass.live.synth import Synth
from livebass.units import is_number

CLIENT = "livebass"
THROUGH = "Midi Through"  # ALSA's own port, without a device behind it
SYSTEMS = {"alsa": "ALSA's sequencer", "jack": "a JACK server"}  # by rtmidi's names
LOOK_EVERY = 1.0  # s, to check for ports that come and go
ALSA_CLIENTS = Path("/proc/asound/seq/clients")


class MidiPort:
    """Plays `synth` from the port `wanted` (a number or part of a name), else the first port, else a virtual one.

    Every message plays `delay` frames after it arrives, so the block length causes no jitter. `look` reopens a port
    that was unplugged; if none was named, it takes any other, except ports that the user connected to the virtual
    one. Raises MidiLost if there is no MIDI or no such port; without `virtual`, also if there is no port at all; with
    `hardware_only`, also if the system has no MIDI but JACK's.
    """

    def __init__(
        self, synth: Synth, wanted: str | None, delay: int, virtual: bool = True, hardware_only: bool = False
    ) -> None:
        self.synth, self.wanted, self.delay = synth, wanted, delay
        self._rtmidi = _rtmidi()
        self._looker = new_input(f"{CLIENT}-look", hardware_only)  # stays open: new clients disturb JACK
        self._by_jack = self._looker.get_current_api() == self._rtmidi.API_UNIX_JACK
        self._in: Any = None
        self._virtual: Any = None
        self._connections: Any = None  # a JACK client that sees the connections of the virtual port
        self._jack_gone = threading.Event()
        self._device: str | None = None  # the last port opened
        try:
            names = _names(self._looker)
            index = find_port(names, wanted)
            if index is not None:
                self._open(names[index])
            elif wanted is not None:
                raise MidiLost(f"MIDI input {wanted!r}: not found; there is {', '.join(names) or 'none'}")
            elif virtual:
                self._open_virtual()
            else:
                raise MidiLost("MIDI: no input")
        except BaseException:
            self.close()
            raise

    @property
    def name(self) -> str:
        return self._device if self._in is not None and self._device else f"virtual port {CLIENT}"

    def _listen(self, open_port: Callable[[Any], None], failed: str) -> Any:
        """A new input, opened by `open_port` and heard. Raises MidiLost, which begins with `failed`."""
        port = new_input(CLIENT)
        try:
            with silenced_stderr():
                open_port(port)
        except (NotImplementedError, self._rtmidi.RtMidiError, ValueError, OSError) as error:
            port.delete()
            raise MidiLost(f"{failed}: {error}") from None
        port.set_callback(self._heard)
        return port

    def _open(self, name: str) -> None:
        def open_port(port: Any) -> None:  # rtmidi also lists this program's ports: find the name in the whole list
            port.open_port(port.get_ports().index(name), name="in")

        self._in, self._device = self._listen(open_port, f"MIDI input {name}"), name

    def _open_virtual(self) -> None:
        failed = "no MIDI input, and no virtual one can be opened"
        self._virtual = self._listen(lambda port: port.open_virtual_port(CLIENT), failed)
        if self._by_jack:
            with suppress(Exception):
                import jack

                self._connections = open_jack_client(jack, f"{CLIENT}-look")
                self._connections.set_shutdown_callback(lambda *_: self._jack_gone.set())

    def _heard(self, event: tuple[list[int], float], _data: object = None) -> None:
        message = event[0]
        if is_message(message):
            status, first, second = (*message, 0)[:3]
            self.synth.receive(status, first, second, self.synth.frame_now(self.delay))

    def look(self) -> str | None:
        """Reopens a returned port, closes a lost one; returns a line about the change, or None."""
        by_hand = self._connected_by_hand() if self._virtual is not None else frozenset()
        names = [name for name in _names(self._looker) if name not in by_hand and _address(name) not in by_hand]
        if self._in is not None:
            if any(bare(self.name) == bare(name) for name in names):
                return None
            if by_hand & {self.name, _address(self.name)}:
                _delete(self._in)
                self._in = None
                return f"MIDI: {self._device} is connected to the virtual port {CLIENT}"
            gone = self.name
            _delete(self._in)
            self._in = None
            let_go(self.synth)
            return f"MIDI: {gone} is gone, waiting for it"
        device = self._device
        index = next((k for k, name in enumerate(names) if device and bare(name) == bare(device)), None)
        if index is None and self.wanted is None:
            index = find_port(names, None)
        if index is None:
            return None
        try:
            self._open(names[index])
        except MidiLost:
            return None  # the next call tries again
        return f"MIDI: {self.name} is {'back' if device and bare(device) == bare(self.name) else 'there'}"

    def _connected_by_hand(self) -> frozenset[str]:
        """Names of the sources connected to the virtual port: JACK ports, or ALSA addresses such as 24:0."""
        if self._connections is not None and not self._jack_gone.is_set():
            with suppress(Exception), silenced_stderr():
                ports = self._connections.get_ports(f"^{CLIENT}[^:]*:{CLIENT}$", is_input=True, is_midi=True)
                return frozenset(p.name for port in ports for p in self._connections.get_all_connections(port))
            return frozenset()
        if self._by_jack:
            return frozenset()
        try:
            return alsa_sources(ALSA_CLIENTS.read_text(errors="replace"))
        except OSError:
            return frozenset()

    def close(self) -> None:
        """Closes all ports; safe to call twice."""
        ports = [port for port in (self._in, self._virtual, self._looker) if port is not None]
        connections = self._connections
        self._in = self._virtual = self._looker = self._connections = None

        def end() -> None:
            for port in ports:
                _delete(port)
            if connections is not None:
                connections.close(ignore_errors=True)

        answers: list[bool] = []
        if self._by_jack and not call_with_timeout(lambda: answers.append(_jack_answers()), None):
            never_release([*ports, connections])  # closing them would hang and block the interpreter
            return
        if connections is not None and not any(answers):
            never_release(connections)  # the server is gone: closing its client could crash
            connections = None
        call_with_timeout(end, ports)


def is_message(message: list[int]) -> bool:
    """True for a complete channel message: a status and its number of data bytes, each below 128."""
    if not message or not 0x80 <= message[0] < 0xF0:
        return False
    return len(message) == (2 if message[0] & 0xE0 == 0xC0 else 3) and max(message[1:]) < 0x80


def alsa_sources(clients: str) -> frozenset[str]:
    """Returns the addresses (client:port) connected to a virtual port of livebass, from ALSA's list of `clients`."""
    client = port = ""
    found: set[str] = set()
    for line in clients.splitlines():
        if named := re.match(r'Client +\d+ : "(.*)"', line):
            client = named[1]
        elif named := re.match(r' +Port +\d+ : "(.*)"', line):
            port = named[1]
        elif "Connected From:" in line and client == port == CLIENT:
            found.update(re.findall(r"\d+:\d+", line))
    return frozenset(found)


def _address(name: str) -> str:
    """Returns the address at the end of an ALSA port name; "" if it has none."""
    return found[1] if (found := re.search(r" (\d+:\d+)$", name)) else ""


def let_go(synth: Synth) -> None:
    """Ends all held notes when a keyboard disappears: pedals up and all notes off on every channel."""
    for controller in (64, 123):
        send_everywhere(synth.send, controller, 0)


def send_everywhere(send: Callable[[int, int, int], object], controller: int, value: int) -> None:
    """Moves a controller on every channel, and so for notes of any channel."""
    for channel in range(CHANNELS):
        send(0xB0 | channel, controller, value)


def _jack_answers() -> bool:
    """Returns whether there is a JACK server; hangs if the server hangs."""
    with suppress(Exception):
        import jack

        open_jack_client(jack, f"{CLIENT}-look").close()
        return True
    return False


def _delete(port: Any) -> None:
    with silenced_stderr():
        port.cancel_callback()
        port.close_port()
        port.delete()


def _names(looker: Any) -> list[str]:
    with silenced_stderr():
        return [name for name in looker.get_ports() or [] if not name.startswith(CLIENT)]


def bare(name: str) -> str:
    """Returns a port name without the numbers that ALSA changes each time a device is plugged in."""
    return re.sub(r" \d+:\d+$", "", name)


def port_names() -> list[str]:
    """Returns the system's MIDI inputs, without livebass' own. Raises MidiLost if there is no MIDI."""
    looker = new_input(f"{CLIENT}-look")
    try:
        return _names(looker)
    finally:
        _delete(looker)


def new_input(name: str, hardware_only: bool = False) -> Any:
    """Returns an rtmidi input of the system's MIDI, or of JACK's unless `hardware_only`. Raises MidiLost."""
    rtmidi = _rtmidi()
    apis = rtmidi.get_compiled_api()
    for api in apis:
        if api == rtmidi.API_UNIX_JACK and (hardware_only or jack_hangs.is_set()):
            continue
        try:
            with silenced_stderr():
                return rtmidi.MidiIn(rtapi=api, name=name)
        except rtmidi.RtMidiError:  # names the library's functions
            continue
    tried = " or ".join(SYSTEMS.get(rtmidi.get_api_name(api), rtmidi.get_api_display_name(api)) for api in apis)
    raise MidiLost(f"MIDI input: no answer from {tried or 'python-rtmidi, which was built without a MIDI system'}")


def find_port(names: list[str], wanted: str | None) -> int | None:
    """Returns the index of the port `wanted` (a number or part of a name); None: the first device."""
    if wanted is None:
        return next((i for i, name in enumerate(names) if THROUGH not in name), None)
    if is_number(wanted):
        return int(wanted) if int(wanted) < len(names) else None
    return next((i for i, name in enumerate(names) if wanted.casefold() in name.casefold()), None)


def _rtmidi() -> Any:
    try:
        import rtmidi
    except ImportError as error:
        raise MidiLost(f"MIDI input: {one_line(error)}; {install('live')}") from None
    return rtmidi
