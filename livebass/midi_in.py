"""MIDI input ports by python-rtmidi: what arrives goes to the stage, late by the same time for all. [main thread]"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from livebass.hush import hushed
from livebass.stage import Stage

CLIENT = "livebass"
LOOK_EVERY = 1.0  # s, for ports that come and go


class MidiLost(OSError):
    """A MIDI port that is not there; one line with those that are."""


class MidiPort:
    """The port `wanted` (number or part of a name), or the first there is, or else a virtual one to connect to.

    Messages are played `ahead` frames after they arrive, so that a block's length is not heard as jitter. A port
    that is unplugged is opened again when it is back, at `look`.
    """

    def __init__(self, stage: Stage, wanted: str | None, ahead: int) -> None:
        self.stage, self.wanted, self.ahead = stage, wanted, ahead
        self._rtmidi = _rtmidi()
        self._in: Any = None
        self.name = ""
        self._open()

    def _open(self) -> None:
        names = port_names()
        index = find_port(names, self.wanted)
        if index is None and self.wanted is not None:
            raise MidiLost(f"MIDI port {self.wanted!r}: there is {', '.join(names) or 'none'}")
        port = new_input(CLIENT)
        if index is not None:
            port.open_port(index, name="in")
            self.name = names[index]
        else:
            try:
                port.open_virtual_port("in")
                self.name = f"virtual port {CLIENT}"
            except (NotImplementedError, self._rtmidi.RtMidiError) as error:
                raise MidiLost(f"no MIDI input, and none can be made: {error}") from None
        port.set_callback(self._heard)
        self._in = port

    def _heard(self, event: tuple[list[int], float], _data: object = None) -> None:
        message = event[0]
        if 1 <= len(message) <= 3 and 0x80 <= message[0] < 0xF0:
            status, first, second = (*message, 0, 0)[:3]
            self.stage.send(status, first, second, self.stage.frame_now(self.ahead))

    def look(self) -> str | None:
        """Opens the port again where it came back; what has changed, for people."""
        if self.name.startswith("virtual"):
            return None
        there = self.name in port_names()
        if self._in is not None and not there:
            self.close()
            return f"MIDI: {self.name} is gone, waiting for it"
        if self._in is None and there:
            with suppress(MidiLost, self._rtmidi.RtMidiError):
                self._open()
                return f"MIDI: {self.name} is back"
        return None

    def close(self) -> None:
        if self._in is not None:
            self._in.cancel_callback()
            self._in.close_port()
            self._in.delete()
            self._in = None


def port_names() -> list[str]:
    """The MIDI inputs of this system that are not livebass's own; MidiLost where there is no MIDI."""
    probe = new_input(f"{CLIENT}-look")
    try:
        return [name for name in probe.get_ports() if not name.startswith(CLIENT)]
    finally:
        probe.delete()


def new_input(name: str) -> Any:
    """An input of the system's MIDI, or of JACK's where the system has none; MidiLost where neither works."""
    rtmidi = _rtmidi()
    why = "this build of python-rtmidi knows no system"
    for api in rtmidi.get_compiled_api():
        try:
            with hushed():
                return rtmidi.MidiIn(rtapi=api, name=name)
        except rtmidi.RtMidiError as error:
            why = str(error)
    raise MidiLost(f"MIDI input: {why}")


def find_port(names: list[str], wanted: str | None) -> int | None:
    """Index of the port `wanted` means: its number, or a part of its name; the first for None."""
    if wanted is None:
        return 0 if names else None
    if wanted.isdigit():
        return int(wanted) if int(wanted) < len(names) else None
    return next((i for i, name in enumerate(names) if wanted.casefold() in name.casefold()), None)


def _rtmidi() -> Any:
    try:
        import rtmidi
    except ImportError as error:
        raise MidiLost(f"MIDI input: {error}; pip install 'livebass[live]'") from None
    return rtmidi
