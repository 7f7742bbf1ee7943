"""The computer keyboard as a keyboard: two rows of keys, in a terminal. [main thread]"""

from __future__ import annotations

import select
import sys
from contextlib import suppress
from typing import Any

LOWER, UPPER = "zsxdcvgbhnjm,l.;/", "q2w3er5t6y7ui9o0p"
HELP = (
    "keys: z x c ... and q w e ... are the white keys, the rows above them the black ones; space damps; "
    "[ and ] an octave; - and = velocity; ! panic; Ctrl-C ends"
)
OCTAVES, VELOCITIES = (1, 6), (10, 127)
STEP = 10  # of velocity


class TerminalKeys:
    """Keys become messages for `send(status, first, second)`. A terminal tells of no key let go: a note lasts until
    the next one, or the space bar.
    """

    def __init__(self, send: Any, panic: Any) -> None:
        self.send, self.panic = send, panic
        self.octave, self.velocity = 2, 100
        self._note = -1
        self._before: Any = None

    def __enter__(self) -> TerminalKeys:
        with suppress(ImportError, OSError, ValueError):
            import termios
            import tty

            if sys.stdin.isatty():
                self._before = termios.tcgetattr(sys.stdin)
                tty.setcbreak(sys.stdin)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)

    @property
    def there(self) -> bool:
        return self._before is not None

    def read(self) -> None:
        """Plays the keys that were pressed since."""
        while self.there and select.select([sys.stdin], [], [], 0)[0]:
            key = sys.stdin.read(1)
            if not key:
                return
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

    def _stop(self) -> None:
        if self._note >= 0:
            self.send(0x80, self._note, 0)
            self._note = -1
