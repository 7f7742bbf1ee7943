"""MIDI inputs of the system, through supriya-midi: ALSA's sequencer, CoreMIDI, Windows. [main thread]"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from livebass.extras import install
from livebass.live.guards import call_with_timeout, silenced_stderr
from livebass.live.lost import MidiLost, one_line
from livebass.live.synth import Synth

CLIENT = "livebass"
SYSTEMS = {"alsa": "ALSA's sequencer"}  # by RtMidi's names
OTHERS = ("jack", "dummy", "web")  # RtMidi's: JACK has its own client here, see jackmidi.py
ALSA_CLIENTS = Path("/proc/asound/seq/clients")
ALSA_LIBRARY = "libasound.so"
QUIET = 0.05  # s in which a callback that has begun ends


class SystemMidi:
    """Inputs of the system's MIDI: one of its ports and a virtual port, both played by `synth`.

    Each message plays `delay` frames after it arrives. Raises MidiLost if supriya-midi is missing or the system has no
    MIDI.
    """

    synth: Synth
    delay = 0

    def __init__(self) -> None:
        self._rtmidi = rtmidi_library()
        self._api = None
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
            self._api = api
            return made
        tried = " or ".join(SYSTEMS.get(known[api], rtmidi.get_api_display_name(api)) for api in apis)
        raise MidiLost(f"no answer from {tried or 'supriya-midi, which was built without a MIDI system'}")

    def names(self) -> list[str]:
        """Returns the names of all ports but livebass' own."""
        return [name for name in self._all_names(self._looker) if not name.startswith(CLIENT)]

    def _all_names(self, port: Any) -> list[str]:
        """The names by number; "" for a port that has vanished in between."""

        def name_of(number: int) -> str:
            try:
                return str(port.get_port_name(number))
            except self._rtmidi.RtMidiError:
                return ""

        with silenced_stderr():
            return [name_of(number) for number in range(port.get_port_count())]

    def _listen(self, open_port: Callable[[Any], None], failed: str) -> Any:
        """A new input, opened by `open_port` and heard. Raises MidiLost, which begins with `failed`."""
        port = self._new_input(CLIENT)
        try:
            port.set_callback(self._heard)
            with silenced_stderr():
                open_port(port)
        except (NotImplementedError, self._rtmidi.RtMidiError, RuntimeError, ValueError, OSError) as error:
            _delete(port)
            raise MidiLost(f"{failed}: {one_line(error)}") from None
        return port

    def open(self, name: str) -> None:
        """Opens the port `name`. Raises MidiLost."""

        def open_port(port: Any) -> None:
            number = self._all_names(port).index(name)
            port.open_port(number, "in")
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
            _delete(port)

    def _heard(self, message: Sequence[int], _since: float, _data: object) -> None:
        """Plays a message. [RtMidi's thread]"""
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
        ports = [port for port in (self._in, self._virtual, self._looker) if port is not None]
        self._in = self._virtual = self._looker = None

        def end() -> None:
            for port in ports:
                _delete(port)

        call_with_timeout(end, ports)


def _delete(port: Any) -> None:
    """Closes an input for good.

    supriya-midi keeps Python's lock while it waits for the thread that calls back, which waits for the lock if a
    message has just come. So the callbacks end first.
    """
    with silenced_stderr():
        heard = port._callback  # must outlive a callback that has begun
        port.cancel_callback()
        time.sleep(QUIET)
        port.close_port()
        port.delete()
        del heard


def is_message(message: Sequence[int]) -> bool:
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


def rtmidi_library() -> Any:
    """Imports supriya-midi. Raises MidiLost with a way to install it or the library that it needs."""
    try:
        import supriya_midi
    except (ImportError, OSError) as error:
        brings = "on Debian: sudo apt install libportaudio2" if ALSA_LIBRARY in str(error) else install("live")
        raise MidiLost(f"{one_line(error)}; {brings}") from None
    return supriya_midi
