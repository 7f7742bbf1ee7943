"""MIDI ports: the system's, or those of a JACK server. [main thread]"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress

from livebass.kernels.player.performer import CHANNELS
from livebass.live.device_errors import MidiLost, NoMidi
from livebass.live.guards import jack_hangs
from livebass.live.jackmidi import JackMidi
from livebass.live.synth import Synth
from livebass.live.systemmidi import CLIENT, SystemMidi
from livebass.rows.units import is_number

THROUGH = "Midi Through"  # ALSA's own port, without a device behind it
LOOK_EVERY = 1.0  # s, to check for ports that come and go


class MidiPort:
    """Plays `synth` from the port `wanted` (a number or part of a name), else the first port, else a virtual one.

    Every message plays `delay` frames after it arrives, so the block length causes no jitter. `look` reopens a port
    that was unplugged; if none was named, it takes any other, except ports that the user connected to the virtual
    one. Raises NoMidi, and MidiLost if there is no such port; without `virtual`, also if there is no port at all.
    `jack`: the ports of a JACK server will do if the system has no MIDI, but not beside a JackOutput.
    """

    def __init__(self, synth: Synth, wanted: str | None, delay: int, virtual: bool = True, jack: bool = True) -> None:
        self.wanted = wanted
        self._ports = new_ports(jack)
        self._ports.synth, self._ports.delay = synth, delay
        self._open = self._virtual = False
        self._device: str | None = None  # the last port opened
        try:
            names = self._ports.names()
            index = find_port(names, wanted)
            if index is not None:
                self._take(names[index])
            elif wanted is not None:
                raise MidiLost(f"MIDI input {wanted!r}: not found; there is {', '.join(names) or 'none'}")
            elif virtual:
                self._ports.open_virtual()
                self._virtual = True
            else:
                raise MidiLost("MIDI: no input")
        except BaseException:
            self.close()
            raise

    @property
    def synth(self) -> Synth:
        return self._ports.synth

    @synth.setter
    def synth(self, synth: Synth) -> None:
        self._ports.synth = synth

    @property
    def name(self) -> str:
        return self._device if self._open and self._device else f"virtual port {CLIENT}"

    def _take(self, name: str) -> None:
        """Opens the port `name`. Raises MidiLost."""
        self._ports.open(name)
        self._open, self._device = True, name

    def _leave(self) -> None:
        """Closes the open port."""
        self._open = False
        self._ports.close_port()

    def look(self) -> str | None:
        """Reopens a returned port, closes a lost one; returns a line about the change, or None."""
        by_hand = self._ports.by_hand() if self._virtual else frozenset()
        names = [name for name in self._ports.names() if name not in by_hand and _address(name) not in by_hand]
        if self._open:
            if any(bare(self.name) == bare(name) for name in names):
                return None
            gone = self.name
            self._leave()
            if by_hand & {gone, _address(gone)}:
                return f"MIDI: {gone} is connected to the virtual port {CLIENT}"
            let_go(self.synth)
            return f"MIDI: {gone} is gone, waiting for it"
        device = self._device
        index = next((k for k, name in enumerate(names) if device and bare(name) == bare(device)), None)
        if index is None and self.wanted is None:
            index = find_port(names, None)
        if index is None:
            return None
        try:
            self._take(names[index])
        except MidiLost:
            return None  # the next call tries again
        return f"MIDI: {self.name} is {'back' if device and bare(device) == bare(self.name) else 'there'}"

    def close(self) -> None:
        """Closes all ports; safe to call twice."""
        self._ports.close()


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


def bare(name: str) -> str:
    """Returns a port name without the numbers that ALSA changes each time a device is plugged in."""
    return re.sub(r" \d+:\d+$", "", name)


def port_names() -> list[str]:
    """Returns the names of all MIDI inputs, without livebass' own. Raises NoMidi."""
    ports = new_ports()
    try:
        return ports.names()
    finally:
        ports.close()


def new_ports(jack: bool = True) -> SystemMidi | JackMidi:
    """Returns the system's MIDI; with `jack`, a JACK server's if the system has none. Raises NoMidi."""
    try:
        return SystemMidi()
    except MidiLost as error:
        why = str(error)
    if jack and not jack_hangs.is_set():
        with suppress(MidiLost):
            return JackMidi(CLIENT)
        why = f"no JACK server, and {why}"
    raise NoMidi(f"no MIDI ports: {why}")


def find_port(names: list[str], wanted: str | None) -> int | None:
    """Returns the index of the port `wanted` (a number or part of a name); None: the first device."""
    if wanted is None:
        return next((i for i, name in enumerate(names) if THROUGH not in name), None)
    if is_number(wanted):
        return int(wanted) if int(wanted) < len(names) else None
    return next((i for i, name in enumerate(names) if wanted.casefold() in name.casefold()), None)
