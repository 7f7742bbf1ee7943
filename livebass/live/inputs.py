"""Inputs of the synth: MIDI ports by python-rtmidi, and the computer keyboard in a terminal. [main thread]"""

from __future__ import annotations

import logging
import math
import os
import re
import select
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from livebass.extras import install
from livebass.kernels.player.performer import CHANNELS
from livebass.live.guards import call_with_timeout, jack_hangs, never_release, open_jack_client, silenced_stderr
from livebass.live.synth import Synth
from livebass.model.keymap import MODO, KeyMap
from livebass.techniques import BUTTONS, OF_CHANNEL
from livebass.units import is_number

LOG = logging.getLogger(__name__)
CLIENT = "livebass"
THROUGH = "Midi Through"  # ALSA's own port, which no device is behind
SYSTEMS = {"alsa": "ALSA's sequencer", "jack": "a JACK server"}  # by rtmidi's names
LOOK_EVERY = 1.0  # s, for ports that come and go
ALSA_CLIENTS = Path("/proc/asound/seq/clients")


class MidiLost(OSError):
    """A MIDI port is missing; one line, with the ports there are."""


class MidiPort:
    """Plays `synth` from the port `wanted` (a number or part of a name), else the first port, else a virtual one.

    Every message is played `delay` frames after it arrives, so that the length of a block is not heard as jitter.
    `look` reopens a port that was unplugged; if none was named, it takes any other, but none that somebody has
    connected to the virtual port. Raises MidiLost if there is no MIDI or no such port; without `virtual`, also if there
    is no port at all; with `hardware_only`, also if the system has no MIDI but JACK's.
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
        self._connections: Any = None  # a JACK client that sees what is connected to the virtual port
        self._jack_gone = threading.Event()
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
        """Reopens a port that is back, closes one that is gone; returns a line about the change, or None."""
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
            self._open(index, names[index])
        except MidiLost:
            return None  # try again next time
        return f"MIDI: {self.name} is {'back' if device and bare(device) == bare(self.name) else 'there'}"

    def _connected_by_hand(self) -> frozenset[str]:
        """Names of the sources connected to the virtual port: JACK's ports, or ALSA's addresses such as 24:0."""
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
            never_release([*ports, connections])  # closing them would hang and hold the interpreter
            return
        if connections is not None and not any(answers):
            never_release(connections)  # the server is gone: closing its client could crash
            connections = None
        call_with_timeout(end, ports)


def is_message(message: list[int]) -> bool:
    """True for a whole channel message: a status, as many data bytes as it takes, each below 128."""
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
    """Returns the address at the end of an ALSA port's name; "" if it has none."""
    return found[1] if (found := re.search(r" (\d+:\d+)$", name)) else ""


def let_go(synth: Synth) -> None:
    """Ends all held notes, for a keyboard that has gone: pedals up and all notes off on every channel."""
    for controller in (64, 123):
        send_everywhere(synth.send, controller, 0)


def send_everywhere(send: Callable[[int, int, int], object], controller: int, value: int) -> None:
    """Moves a controller on every channel: for notes of whatever channel."""
    for channel in range(CHANNELS):
        send(0xB0 | channel, controller, value)


def _jack_answers() -> bool:
    """Returns whether there is a JACK server; hangs with one that hangs."""
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
    apis = rtmidi.get_compiled_api()
    for api in apis:
        if api == rtmidi.API_UNIX_JACK and (hardware_only or jack_hangs.is_set()):
            continue
        try:
            with silenced_stderr():
                return rtmidi.MidiIn(rtapi=api, name=name)
        except rtmidi.RtMidiError:  # which names the library's functions
            continue
    tried = " or ".join(SYSTEMS.get(rtmidi.get_api_name(api), rtmidi.get_api_display_name(api)) for api in apis)
    raise MidiLost(f"MIDI input: no answer from {tried or 'python-rtmidi, which was built without any system'}")


def find_port(names: list[str], wanted: str | None) -> int | None:
    """Returns the index of the port that `wanted` (a number or part of a name) means; None: of the first device."""
    if wanted is None:
        return next((i for i, name in enumerate(names) if THROUGH not in name), None)
    if is_number(wanted):
        return int(wanted) if int(wanted) < len(names) else None
    return next((i for i, name in enumerate(names) if wanted.casefold() in name.casefold()), None)


def _rtmidi() -> Any:
    try:
        import rtmidi
    except ImportError as error:
        raise MidiLost(f"MIDI input: {' '.join(str(error).split())}; {install('live')}") from None
    return rtmidi


# Semitones above the lowest key, an E. Of the upper row capitals are a semitone higher.
NOTES = {key: place for place, key in enumerate("zsxdcvgbhnjm,l.;/")} | dict(
    zip("qwertyuiop", (12, 14, 16, 17, 19, 21, 23, 24, 26, 28), strict=True)
)
# Techniques as the page has them, and its number keys: strokes last; ways to play are on, by a controller (and its
# value) or a held key switch, until they are switched off.
DIGITS = dict(zip("1234567890", BUTTONS, strict=True))
STROKES = {key: button for key, button in DIGITS.items() if button.strikes}
WAYS = {key: button for key, button in DIGITS.items() if not button.strikes}
HELP = (
    "keys: z x c ... and q w e ... are the white keys, s d g ... and capitals of the upper row the black ones; "
    + "; ".join(f"{key} {button.name.lower()}" for key, button in DIGITS.items())
    + "; space damps; [ and ] octave; - and = velocity; Tab next preset; Enter next quality; \\ MIDI learn; ! panic; "
    "Ctrl-C ends"
)
SCORE_HELP = "file: k pause; a from the beginning; f loop; ( and ) its ends; < and > tempo"
OCTAVES, VELOCITIES = (1, 6), (10, 127)
STEP = 10  # of velocity
REPEATS = 0.1  # s: a key comes again sooner only if the terminal repeats it
REPEATABLE = "[]-=<>"  # keys that do more when held
SWITCHED = 64  # velocity of a key switch
# One key as a terminal sends it: a character, or an escape sequence.
TOKEN = re.compile(r"\x1b(\[[0-9:;<=>?]*[ -/]*[@-~]|O.|[^\[])?|.", re.DOTALL)
UNFINISHED = re.compile(r"\x1b\[[0-9:;<=>?]*$")
# Terminals that speak the kitty keyboard protocol report when a key is released: CSI code:shifted ; modifiers:event u.
KEY = re.compile(r"\x1b\[(\d+)(?::(\d*))?[\d:]*(?:;(\d*)(?::(\d))?)?[\d:;]*u")
SHIFT, CONTROL, OTHERS = 1, 4, 2 | 8 | 16 | 32  # bits of modifiers - 1; others: alt, super, hyper, meta
PRESSED, REPEATED, RELEASED = 1, 2, 3
ASK_PROTOCOL, PROTOCOL_THERE = "\x1b[?u", re.compile(r"\x1b\[\?\d+u")
PROTOCOL_ON, PROTOCOL_OFF = "\x1b[>15u", "\x1b[<u"
NO_REPEATS, USUAL_REPEATS = "\x1b[?8l", "\x1b[?8h"  # DECARM, which some terminals know


class TerminalKeys:
    """Turns keys of the terminal into messages for `send(status, first, second)`; `others` adds further keys.

    A terminal that speaks the kitty keyboard protocol says when a key is released: the note lasts as long as its key is
    down. Others repeat a held key instead: repeats are left out as far as their pace shows them, and a note lasts until
    the next one or the space bar. A way to play is on while its key is down, or from one press of it to the next.
    `key_map` gives the map of the bass that plays. Within `with` the terminal delivers single keys, again after Ctrl-Z
    and fg; afterwards it is as before. In the background the terminal is left alone.
    """

    def __init__(
        self,
        send: Any,
        panic: Any,
        others: dict[str, Callable[[], None]] | None = None,
        key_map: Callable[[], KeyMap] = lambda: MODO,
    ) -> None:
        self.send, self.panic, self.others, self.key_map = send, panic, others or {}, key_map
        self.octave, self.velocity = 2, 100
        self._ways: dict[str, Callable[[], object]] = {}  # keys of those that are on, and what switches them off
        self._held: dict[str, int] = {}  # notes by their keys
        self._releases = False  # the terminal reports them
        self._latest = ("", -math.inf)  # key, and when it came
        self._rest = ""  # beginning of an escape sequence
        self._before: Any = None  # attributes of the terminal
        self._stop_before: Any = None  # handler of SIGTSTP

    def __enter__(self) -> TerminalKeys:
        try:
            import termios
        except ImportError:  # Windows
            if os.isatty(0):
                LOG.warning("the computer keyboard does not play on this system: Python has no termios here")
            return self
        with suppress(OSError, ValueError, termios.error):
            if interactive():
                self._before = termios.tcgetattr(0)
                self._take()
                self._stop_before = signal.signal(signal.SIGTSTP, self._suspend)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            self._give_back()
            self._before = None
        if self._stop_before is not None:
            signal.signal(signal.SIGTSTP, self._stop_before)
            self._stop_before = None

    def _take(self) -> None:
        """Makes the terminal deliver single keys, without repeats if it can."""
        import tty

        tty.setcbreak(0)
        _write(NO_REPEATS + ASK_PROTOCOL)

    def _give_back(self) -> None:
        """Makes the terminal what it was before."""
        import termios

        with suppress(termios.error), _no_stop_in_the_background():
            if interactive():
                _write(USUAL_REPEATS + PROTOCOL_OFF * self._releases)
            termios.tcsetattr(0, termios.TCSADRAIN, self._before)
        self._releases = False

    def _suspend(self, _number: int, _frame: object) -> None:
        """Ctrl-Z: stops this program with the terminal as it was; `read` takes it again."""
        self._stop()
        if self._before is not None:
            self._give_back()
        signal.signal(signal.SIGTSTP, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGTSTP)  # goes on here after SIGCONT
        signal.signal(signal.SIGTSTP, self._suspend)

    @property
    def active(self) -> bool:
        return self._before is not None

    def read(self, seconds: float = 0.0) -> None:
        """Plays keys as they are pressed, for `seconds`."""
        end = time.monotonic() + seconds
        while True:
            left = max(end - time.monotonic(), 0.0)
            if not self.active or not self._in_front():
                time.sleep(left)
                return
            try:
                pressed = os.read(0, 1024) if select.select([0], [], [], left)[0] else None
            except OSError:
                pressed = b""
            if pressed is None:
                return
            if not pressed:  # the terminal is gone
                self._before = None
                continue
            self._hear(pressed.decode(errors="replace"))

    def _in_front(self) -> bool:
        """True in the foreground, where the terminal is made to deliver single keys if the shell has changed it."""
        import termios

        if not interactive():
            return False
        with suppress(termios.error):
            if termios.tcgetattr(0)[3] & termios.ICANON:
                self._take()
        return True

    def _hear(self, text: str) -> None:
        """Carries out what the terminal sent: keys, escape sequences of keys, and its answer to ASK_PROTOCOL."""
        text = self._rest + text
        unfinished = UNFINISHED.search(text)
        self._rest = unfinished[0] if unfinished else ""
        for token in TOKEN.finditer(text[: len(text) - len(self._rest)]):
            if len(token[0]) == 1 and token[0] != "\x1b":
                self.press(token[0])
            elif self._releases and (key := KEY.fullmatch(token[0])):
                self._report(key)
            elif PROTOCOL_THERE.fullmatch(token[0]) and not self._releases:
                self._releases = True
                _write(PROTOCOL_ON)

    def _report(self, key: re.Match[str]) -> None:
        """A key with its modifiers, pressed, repeated or released; in this mode Ctrl-C and Ctrl-Z are keys, too."""
        modifiers, event = int(key[3] or 1) - 1, int(key[4] or PRESSED)
        code = int(key[2]) if key[2] and modifiers & SHIFT else int(key[1])
        if code > sys.maxunicode or modifiers & OTHERS:
            return
        if modifiers & CONTROL:
            number = {"c": signal.SIGINT, "z": signal.SIGTSTP, "\\": signal.SIGQUIT}.get(chr(code))
            if number and event == PRESSED:
                signal.raise_signal(number)
        elif event == RELEASED:
            for name in {chr(int(key[1])), chr(code).lower()}:  # shift may have come or gone since
                self._end(name)
                self._end_way(name)
        elif event == PRESSED or chr(code) in REPEATABLE:
            self._carry_out(chr(code))

    def press(self, key: str) -> None:
        """Carries out a key of a terminal that does not report releases."""
        now = time.monotonic()
        again = key == self._latest[0] and now - self._latest[1] < REPEATS
        self._latest = (key, now)
        if not again or key in REPEATABLE:
            self._carry_out(key)

    def _carry_out(self, typed: str) -> None:
        key = typed.lower()
        if key in NOTES:
            raised = key in "qwertyuiop" and typed != key
            note = min(127, 12 * self.octave + 4 + NOTES[key] + raised)
            if self._releases:
                self._end(key)
            else:
                self._stop()
            self.send(0x90, note, self.velocity)
            self._held[key] = note
        elif key == " ":
            self._stop()
        elif key in "[]":
            self.octave = min(max(self.octave + (1 if key == "]" else -1), OCTAVES[0]), OCTAVES[1])
        elif key in "-=":
            self.velocity = min(max(self.velocity + (STEP if key == "=" else -STEP), VELOCITIES[0]), VELOCITIES[1])
        elif key in STROKES:
            if (number := self._switch(STROKES[key].symbol)) is not None:
                self.send(0x90, number, SWITCHED)
                self.send(0x80, number, 0)
        elif key in WAYS and key in self._ways:
            self._end_way(key)
        elif key in WAYS:
            self._begin_way(key)
        elif key == "!":
            for way in list(self._ways):
                self._end_way(way)
            self.panic()
        elif key in self.others:
            self.others[key]()

    def _switch(self, technique: str) -> int | None:
        """The key switch of a technique; None, with a line about it, if the bass has none."""
        number = next((number for number, name, _ in self.key_map().keys if name == technique), None)
        if number is None:
            LOG.info("%s: the bass that plays has no key for it", technique)
        return number

    def _begin_way(self, key: str) -> None:
        """Switches on the way to play of `key`, by a controller if it has one with a value."""
        way = WAYS[key]
        given = (number for number, symbol in self.key_map().controllers if way.value and symbol == way.symbol)
        if (controller := next(given, None)) is not None:
            move = partial(self._move, way.symbol, controller)
            move(way.value)
            self._ways[key] = partial(move, 0)
        elif (number := self._switch(way.symbol)) is not None:
            self.send(0x90, number, SWITCHED)
            self._ways[key] = partial(self.send, 0x80, number, 0)

    def _move(self, symbol: str, controller: int, value: int) -> None:
        """Moves the controller of a function for the whole bass."""
        if symbol in OF_CHANNEL:
            send_everywhere(self.send, controller, value)
        else:
            self.send(0xB0, controller, value)

    def _end_way(self, key: str) -> None:
        """Switches off the way to play of `key`, if it is on."""
        if key in self._ways:
            self._ways.pop(key)()

    @property
    def ways(self) -> str:
        """The ways to play that are on."""
        return ", ".join(WAYS[key].name.lower() for key in sorted(self._ways, key=list(WAYS).index))

    def _end(self, key: str) -> None:
        """Ends the note of `key`, if it holds one."""
        note = self._held.pop(key, None)
        if note is not None and note not in self._held.values():
            self.send(0x80, note, 0)

    def _stop(self) -> None:
        for key in list(self._held):
            self._end(key)


def _write(text: str) -> None:
    """Writes to the terminal that standard input is, unless that one knows no sequences."""
    if os.environ.get("TERM", "dumb") != "dumb":
        with suppress(OSError):
            os.write(0, text.encode())


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
