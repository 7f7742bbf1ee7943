"""Reads single keys from the terminal on standard input: pressed and, where reported, released. [main thread]"""

from __future__ import annotations

import logging
import math
import os
import re
import select
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Self

LOG = logging.getLogger(__name__)
REPEATS = 0.1  # s: a key that comes again sooner is a repeat by the terminal
REPEATABLE = "[]-=<>"  # keys that repeat while held
# One key as a terminal sends it: a character, or an escape sequence.
TOKEN = re.compile(r"\x1b(\[[0-9:;<=>?]*[ -/]*[@-~]|O.|[^\[])?|.", re.DOTALL)
UNFINISHED = re.compile(r"\x1b\[[0-9:;<=>?]*$")
# Terminals with the kitty keyboard protocol report released keys: CSI code:shifted ; modifiers:event u.
KEY = re.compile(r"\x1b\[(\d+)(?::(\d*))?[\d:]*(?:;(\d*)(?::(\d))?)?[\d:;]*u")
SHIFT, CONTROL, OTHERS = 1, 4, 2 | 8 | 16 | 32  # bits of modifiers - 1; others: alt, super, hyper, meta
PRESSED, REPEATED, RELEASED = 1, 2, 3
ASK_PROTOCOL, PROTOCOL_THERE = "\x1b[?u", re.compile(r"\x1b\[\?\d+u")
PROTOCOL_ON, PROTOCOL_OFF = "\x1b[>15u", "\x1b[<u"
NO_REPEATS, DEFAULT_REPEATS = "\x1b[?8l", "\x1b[?8h"  # DECARM, known to some terminals


class Terminal:
    """Reads keys; within `with` the terminal delivers single keys, also after Ctrl-Z and fg.

    A terminal with the kitty keyboard protocol reports released keys. Others repeat a held key; repeats are dropped if
    they come fast enough. On exit the terminal is restored; in the background it is left alone.
    """

    def __init__(self) -> None:
        self.releases = False  # the terminal reports released keys
        self._latest = ("", -math.inf)  # key, and its time
        self._rest = ""  # the beginning of an escape sequence
        self._before: Any = None  # attributes of the terminal
        self._stop_before: Any = None  # handler of SIGTSTP

    def carry_out(self, key: str) -> None:
        """A key is pressed. [subclasses]"""

    def release(self, key: str) -> None:
        """A key is released, on a terminal that reports it. [subclasses]"""

    def stop(self) -> None:
        """The program is about to be suspended. [subclasses]"""

    def __enter__(self) -> Self:
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
        """Sets the terminal to single keys, without repeats if possible; Ctrl-C discards nothing that was written."""
        import termios
        import tty

        tty.setcbreak(0)
        modes = termios.tcgetattr(0)
        modes[3] |= termios.NOFLSH
        termios.tcsetattr(0, termios.TCSADRAIN, modes)
        _write(NO_REPEATS + ASK_PROTOCOL)

    def _give_back(self) -> None:
        """Restores the terminal."""
        import termios

        with suppress(termios.error), _no_stop_in_the_background():
            if interactive():
                _write(DEFAULT_REPEATS + PROTOCOL_OFF * self.releases)
            termios.tcsetattr(0, termios.TCSADRAIN, self._before)
        self.releases = False

    def _suspend(self, _number: int, _frame: object) -> None:
        """Ctrl-Z: restores the terminal and stops this program; `read` sets the terminal again."""
        self.stop()
        if self._before is not None:
            self._give_back()
        signal.signal(signal.SIGTSTP, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGTSTP)  # SIGCONT continues here
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
        """True in the foreground; sets the terminal to single keys again if the shell has changed it."""
        import termios

        if not interactive():
            return False
        with suppress(termios.error):
            if termios.tcgetattr(0)[3] & termios.ICANON:
                self._take()
        return True

    def _hear(self, text: str) -> None:
        """Handles input from the terminal: keys, escape sequences of keys, and its answer to ASK_PROTOCOL."""
        text = self._rest + text
        unfinished = UNFINISHED.search(text)
        self._rest = unfinished[0] if unfinished else ""
        for token in TOKEN.finditer(text[: len(text) - len(self._rest)]):
            if len(token[0]) == 1 and token[0] != "\x1b":
                self.press(token[0])
            elif self.releases and (key := KEY.fullmatch(token[0])):
                self._report(key)
            elif PROTOCOL_THERE.fullmatch(token[0]) and not self.releases:
                self.releases = True
                _write(PROTOCOL_ON)

    def _report(self, key: re.Match[str]) -> None:
        """Handles a key with modifiers, pressed, repeated or released; in this mode Ctrl-C and Ctrl-Z are keys too."""
        modifiers, event = int(key[3] or 1) - 1, int(key[4] or PRESSED)
        code = int(key[2]) if key[2] and modifiers & SHIFT else int(key[1])
        if code > sys.maxunicode or modifiers & OTHERS:
            return
        if modifiers & CONTROL:
            number = {"c": signal.SIGINT, "z": signal.SIGTSTP, "\\": signal.SIGQUIT}.get(chr(code))
            if number and event == PRESSED:
                signal.raise_signal(number)
        elif event == RELEASED:
            for name in {chr(int(key[1])), chr(code).lower()}:  # shift may have changed since
                self.release(name)
        elif event == PRESSED or chr(code) in REPEATABLE:
            self.carry_out(chr(code))

    def press(self, key: str) -> None:
        """Handles a key of a terminal that does not report releases."""
        now = time.monotonic()
        again = key == self._latest[0] and now - self._latest[1] < REPEATS
        self._latest = (key, now)
        if not again or key in REPEATABLE:
            self.carry_out(key)


def _write(text: str) -> None:
    """Writes to the terminal on standard input, unless it knows no escape sequences."""
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
