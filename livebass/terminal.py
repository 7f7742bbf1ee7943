"""The computer keyboard as a keyboard: two rows of keys, in a terminal. [main thread]"""

from __future__ import annotations

import os
import re
import select
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

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


