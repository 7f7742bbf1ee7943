"""MIDI input ports by python-rtmidi: what arrives goes to the synth, late by the same time for all. [main thread]

The computer keyboard as a keyboard: two rows of keys, in a terminal. [main thread]
"""

from __future__ import annotations

import os
import re
import select
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from livebass.live.hush import hushed, keep_for_ever, patiently
from livebass.live.synth import Synth

CLIENT = "livebass"
THROUGH = "Midi Through"  # ALSA's own, that nobody plays on
LOOK_EVERY = 1.0  # s, for ports that come and go


class MidiLost(OSError):
    """A MIDI port that is not there; one line with those that are."""


class MidiPort:
    """The port `wanted` (number or part of a name), or the first there is, or else a virtual one to connect to.

    Messages are played `ahead` frames after they arrive, so that a block's length is not heard as jitter. A port
    that is unplugged is opened again when it is back, at `look`; where none was named, the next best will do.
    Raises MidiLost where there is no MIDI, no such port, or none at all and `virtual` ones are not wanted or known;
    with `hardware_only`, also where the system has no MIDI of its own but JACK's.
    """

    def __init__(
        self, synth: Synth, wanted: str | None, ahead: int, virtual: bool = True, hardware_only: bool = False
    ) -> None:
        self.synth, self.wanted, self.ahead = synth, wanted, ahead
        self._rtmidi = _rtmidi()
        self._looker = new_input(f"{CLIENT}-look", hardware_only)  # stays: new clients disturb JACK
        self._by_jack = self._looker.get_current_api() == self._rtmidi.API_UNIX_JACK
        warm = Synth(synth.rate)
        warm.send(0xF8, 0, 0, warm.frame_now(0))  # a kernel that is loaded when the first note comes makes it late
        self._in: Any = None
        self._virtual: Any = None
        self._device: str | None = None  # the last one open
        try:
            names = _names(self._looker)
            index = find_port(names, wanted)
            if index is not None:
                self._open(index, names[index])
            elif wanted is not None:
                raise MidiLost(f"MIDI input {wanted!r}: there is {', '.join(names) or 'none'}")
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

    def _open(self, index: int, name: str) -> None:
        port = new_input(CLIENT)
        try:
            with hushed():
                # ports of this program are listed as well: find the name in the whole list
                port.open_port(port.get_ports().index(name), name="in")
        except (self._rtmidi.RtMidiError, ValueError, OSError) as error:
            port.delete()
            raise MidiLost(f"MIDI input {name}: {error}") from None
        port.set_callback(self._heard)
        self._in, self._device = port, name

    def _open_virtual(self) -> None:
        port = new_input(CLIENT)
        try:
            with hushed():
                port.open_virtual_port(CLIENT)
        except (NotImplementedError, self._rtmidi.RtMidiError) as error:
            port.delete()
            raise MidiLost(f"no MIDI input, and none can be made: {error}") from None
        port.set_callback(self._heard)
        self._virtual = port

    def _heard(self, event: tuple[list[int], float], _data: object = None) -> None:
        message = event[0]
        if 1 <= len(message) <= 3 and 0x80 <= message[0] < 0xF0:
            status, first, second = (*message, 0, 0)[:3]
            self.synth.receive(status, first, second, self.synth.frame_now(self.ahead))

    def look(self) -> str | None:
        """Opens the port again where it came back, lets go of one that has gone; what has changed, for people."""
        names = _names(self._looker)
        if self._in is not None:
            if any(bare(self.name) == bare(name) for name in names):
                return None
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
            self._open(index, names[index])
        except MidiLost:
            return None  # perhaps the next time
        return f"MIDI: {self.name} is {'back' if device and bare(device) == bare(self.name) else 'there'}"

    def close(self) -> None:
        """Ends listening; again does nothing."""
        ports = [port for port in (self._in, self._virtual, self._looker) if port is not None]
        self._in = self._virtual = self._looker = None

        def end() -> None:
            for port in ports:
                _delete(port)

        if self._by_jack and not patiently(_ask_jack, None):
            keep_for_ever(ports)  # to close them would hang, with the interpreter held
        else:
            patiently(end, ports)


def let_go(synth: Synth) -> None:
    """Ends all notes that are held: whoever would let the keys go is no longer there."""
    for channel in range(16):
        for controller in (64, 123):
            synth.send(0xB0 | channel, controller, 0)


def _ask_jack() -> None:
    """Comes back where the JACK server answers, or there is none."""
    with suppress(Exception):
        import jack

        with hushed():
            jack.Client(f"{CLIENT}-look", no_start_server=True).close()


def _delete(port: Any) -> None:
    with hushed():
        port.cancel_callback()
        port.close_port()
        port.delete()


def _names(looker: Any) -> list[str]:
    with hushed():
        return [name for name in looker.get_ports() or [] if not name.startswith(CLIENT)]


def bare(name: str) -> str:
    """A port's name without the numbers that ALSA gives anew each time a device is plugged in."""
    return re.sub(r" \d+:\d+$", "", name)


def port_names() -> list[str]:
    """The MIDI inputs of this system that are not livebass's own; MidiLost where there is no MIDI."""
    looker = new_input(f"{CLIENT}-look")
    try:
        return _names(looker)
    finally:
        _delete(looker)


def new_input(name: str, hardware_only: bool = False) -> Any:
    """An input of the system's MIDI, or else of JACK's unless `hardware_only`; MidiLost where neither works."""
    rtmidi = _rtmidi()
    why = "this build of python-rtmidi knows no system"
    for api in rtmidi.get_compiled_api():
        if hardware_only and api == rtmidi.API_UNIX_JACK:
            continue
        try:
            with hushed():
                return rtmidi.MidiIn(rtapi=api, name=name)
        except rtmidi.RtMidiError as error:
            why = str(error)
    raise MidiLost(f"MIDI input: {why}")


def find_port(names: list[str], wanted: str | None) -> int | None:
    """Index of the port `wanted` means: its number, or a part of its name; the first that is a device for None."""
    if wanted is None:
        return next((i for i, name in enumerate(names) if THROUGH not in name), None)
    if wanted.isdigit():
        return int(wanted) if int(wanted) < len(names) else None
    return next((i for i, name in enumerate(names) if wanted.casefold() in name.casefold()), None)


def _rtmidi() -> Any:
    try:
        import rtmidi
    except ImportError as error:
        raise MidiLost(f"MIDI input: {' '.join(str(error).split())}; pip install 'livebass[live]'") from None
    return rtmidi


LOWER, UPPER = "zsxdcvgbhnjm,l.;/", "q2w3er5t6y7ui9o0p"
HELP = (
    "keys: z x c ... and q w e ... are the white keys, the rows above them the black ones; space damps; "
    "[ and ] octave; - and = velocity; Tab next preset; Enter next quality; ! panic; Ctrl-C ends"
)
OCTAVES, VELOCITIES = (1, 6), (10, 127)
STEP = 10  # of velocity
FUNCTION_KEY = re.compile(r"\x1b(\[[0-9;?]*[ -/]*[@-~]|O.|.)?", re.DOTALL)  # arrows and the like: not for us


class TerminalKeys:
    """Keys become messages for `send(status, first, second)`. A terminal tells of no key let go: a note lasts until
    the next one, or the space bar. `others` says what further keys do.

    Within `with`, the terminal hands over single keys; it is as before afterwards. In the background it is left alone.
    """

    def __init__(self, send: Any, panic: Any, others: dict[str, Callable[[], None]] | None = None) -> None:
        self.send, self.panic, self.others = send, panic, others or {}
        self.octave, self.velocity = 2, 100
        self._note = -1
        self._before: Any = None

    def __enter__(self) -> TerminalKeys:
        with suppress(ImportError, OSError, ValueError):
            import termios
            import tty

            if interactive():
                with suppress(termios.error):
                    self._before = termios.tcgetattr(0)
                    tty.setcbreak(0)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            import termios

            with suppress(termios.error), _no_stop_in_the_background():
                termios.tcsetattr(0, termios.TCSADRAIN, self._before)
            self._before = None

    @property
    def there(self) -> bool:
        return self._before is not None

    def read(self) -> None:
        """Plays the keys that were pressed since."""
        if not self.there or not interactive():
            return
        try:
            pressed = os.read(0, 1024) if select.select([0], [], [], 0)[0] else None
        except OSError:
            pressed = b""
        if pressed == b"":  # the terminal is gone
            self._before = None
        elif pressed:
            for key in FUNCTION_KEY.sub("", pressed.decode(errors="replace")):
                self.press(key)

    def press(self, key: str) -> None:
        key = key.lower()
        if key in LOWER or key in UPPER:
            place = LOWER.index(key) if key in LOWER else 12 + UPPER.index(key)
            note = min(127, 12 * self.octave + 4 + place)  # the lowest key is an E
            self._stop()
            self.send(0x90, note, self.velocity)
            self._note = note
        elif key == " ":
            self._stop()
        elif key in "[]":
            self.octave = min(max(self.octave + (1 if key == "]" else -1), OCTAVES[0]), OCTAVES[1])
        elif key in "-=":
            self.velocity = min(max(self.velocity + (STEP if key == "=" else -STEP), VELOCITIES[0]), VELOCITIES[1])
        elif key == "!":
            self.panic()
        elif key in self.others:
            self.others[key]()

    def _stop(self) -> None:
        if self._note >= 0:
            self.send(0x80, self._note, 0)
            self._note = -1


def interactive() -> bool:
    """Whether standard input is a terminal that listens to this program, not to another in front of it."""
    try:
        return os.isatty(0) and os.tcgetpgrp(0) == os.getpgrp()
    except (OSError, AttributeError):
        return False


@contextmanager
def _no_stop_in_the_background() -> Iterator[None]:
    """Who sets the terminal from the background is stopped by the system, unless deaf to it."""
    before = signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGTTOU, before)
