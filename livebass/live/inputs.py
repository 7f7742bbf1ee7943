"""Inputs of the synth: MIDI ports by python-rtmidi, and the computer keyboard in a terminal. [main thread]"""

from __future__ import annotations

import logging
import os
import re
import select
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from livebass.live.guards import call_with_timeout, never_release, silenced_stderr
from livebass.live.synth import Synth

LOG = logging.getLogger(__name__)
CLIENT = "livebass"
THROUGH = "Midi Through"  # ALSA's own port, which no device is behind
LOOK_EVERY = 1.0  # s, for ports that come and go


class MidiLost(OSError):
    """A MIDI port is missing; one line, with the ports there are."""


class MidiPort:
    """Plays `synth` from the port `wanted` (a number or part of a name), else the first port, else a virtual one.

    Every message is played `delay` frames after it arrives, so that the length of a block is not heard as jitter.
    `look` reopens a port that was unplugged; if none was named, it takes any other. Raises MidiLost if there is no
    MIDI or no such port; without `virtual`, also if there is no port at all; with `hardware_only`, also if the system
    has no MIDI but JACK's.
    """

    def __init__(
        self, synth: Synth, wanted: str | None, delay: int, virtual: bool = True, hardware_only: bool = False
    ) -> None:
        self.synth, self.wanted, self.delay = synth, wanted, delay
        self._rtmidi = _rtmidi()
        self._looker = new_input(f"{CLIENT}-look", hardware_only)  # stays open: new clients disturb JACK
        self._by_jack = self._looker.get_current_api() == self._rtmidi.API_UNIX_JACK
        unheard = Synth(synth.rate)
        unheard.send(0xF8, 0, 0, unheard.frame_now(0))  # loads the kernel now: otherwise the first note is late
        self._in: Any = None
        self._virtual: Any = None
        self._device: str | None = None  # the port opened last
        try:
            names = _names(self._looker)
            index = find_port(names, wanted)
            if index is not None:
                self._open(index, names[index])
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

    def _open(self, index: int, name: str) -> None:
        port = new_input(CLIENT)
        try:
            with silenced_stderr():
                # rtmidi also lists ports of this program: find the name in the whole list
                port.open_port(port.get_ports().index(name), name="in")
        except (self._rtmidi.RtMidiError, ValueError, OSError) as error:
            port.delete()
            raise MidiLost(f"MIDI input {name}: {error}") from None
        port.set_callback(self._heard)
        self._in, self._device = port, name

    def _open_virtual(self) -> None:
        port = new_input(CLIENT)
        try:
            with silenced_stderr():
                port.open_virtual_port(CLIENT)
        except (NotImplementedError, self._rtmidi.RtMidiError) as error:
            port.delete()
            raise MidiLost(f"no MIDI input, and no virtual one can be opened: {error}") from None
        port.set_callback(self._heard)
        self._virtual = port

    def _heard(self, event: tuple[list[int], float], _data: object = None) -> None:
        message = event[0]
        if 1 <= len(message) <= 3 and 0x80 <= message[0] < 0xF0:
            status, first, second = (*message, 0, 0)[:3]
            self.synth.receive(status, first, second, self.synth.frame_now(self.delay))

    def look(self) -> str | None:
        """Reopens a port that is back, closes one that is gone; returns a line about the change, or None."""
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
            return None  # try again next time
        return f"MIDI: {self.name} is {'back' if device and bare(device) == bare(self.name) else 'there'}"

    def close(self) -> None:
        """Closes all ports; safe to call twice."""
        ports = [port for port in (self._in, self._virtual, self._looker) if port is not None]
        self._in = self._virtual = self._looker = None

        def end() -> None:
            for port in ports:
                _delete(port)

        if self._by_jack and not call_with_timeout(_ask_jack, None):
            never_release(ports)  # closing them would hang and hold the interpreter
        else:
            call_with_timeout(end, ports)


def let_go(synth: Synth) -> None:
    """Ends all held notes, for a keyboard that has gone: pedals up and all notes off on every channel."""
    for channel in range(16):
        for controller in (64, 123):
            synth.send(0xB0 | channel, controller, 0)


def _ask_jack() -> None:
    """Returns when the JACK server answers, or at once if there is none; hangs with a server that hangs."""
    with suppress(Exception):
        import jack

        with silenced_stderr():
            jack.Client(f"{CLIENT}-look", no_start_server=True).close()


def _delete(port: Any) -> None:
    with silenced_stderr():
        port.cancel_callback()
        port.close_port()
        port.delete()


def _names(looker: Any) -> list[str]:
    with silenced_stderr():
        return [name for name in looker.get_ports() or [] if not name.startswith(CLIENT)]


def bare(name: str) -> str:
    """Returns a port's name without the numbers that ALSA changes each time a device is plugged in."""
    return re.sub(r" \d+:\d+$", "", name)


def port_names() -> list[str]:
    """Returns the MIDI inputs of this system but livebass's own. Raises MidiLost if there is no MIDI."""
    looker = new_input(f"{CLIENT}-look")
    try:
        return _names(looker)
    finally:
        _delete(looker)


def new_input(name: str, hardware_only: bool = False) -> Any:
    """Returns an rtmidi input of the system's MIDI, or of JACK's unless `hardware_only`. Raises MidiLost."""
    rtmidi = _rtmidi()
    why = "this build of python-rtmidi supports no MIDI system"
    for api in rtmidi.get_compiled_api():
        if hardware_only and api == rtmidi.API_UNIX_JACK:
            continue
        try:
            with silenced_stderr():
                return rtmidi.MidiIn(rtapi=api, name=name)
        except rtmidi.RtMidiError as error:
            why = str(error)
    raise MidiLost(f"MIDI input: {why}")


def find_port(names: list[str], wanted: str | None) -> int | None:
    """Returns the index of the port that `wanted` (a number or part of a name) means; None: of the first device."""
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
FUNCTION_KEY = re.compile(r"\x1b(\[[0-9;?]*[ -/]*[@-~]|O.|.)?", re.DOTALL)  # arrows and the like: ignored


class TerminalKeys:
    """Turns keys of the terminal into messages for `send(status, first, second)`; `others` adds further keys.

    A terminal does not report released keys: a note lasts until the next one or the space bar. Within `with` the
    terminal delivers single keys; afterwards it is as before. In the background the terminal is left alone.
    """

    def __init__(self, send: Any, panic: Any, others: dict[str, Callable[[], None]] | None = None) -> None:
        self.send, self.panic, self.others = send, panic, others or {}
        self.octave, self.velocity = 2, 100
        self._note = -1
        self._before: Any = None

    def __enter__(self) -> TerminalKeys:
        try:
            import termios
            import tty
        except ImportError:  # Windows
            if os.isatty(0):
                LOG.warning("the computer keyboard does not play on this system: Python has no termios here")
            return self
        with suppress(OSError, ValueError, termios.error):
            if interactive():
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
    def active(self) -> bool:
        return self._before is not None

    def read(self) -> None:
        """Plays the keys that were pressed since the last call."""
        if not self.active or not interactive():
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
    """Returns whether standard input is a terminal and this program is in its foreground."""
    try:
        return os.isatty(0) and os.tcgetpgrp(0) == os.getpgrp()
    except (OSError, AttributeError):
        return False


@contextmanager
def _no_stop_in_the_background() -> Iterator[None]:
    """Ignores SIGTTOU within the block: it stops a program that sets the terminal from the background."""
    before = signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGTTOU, before)
