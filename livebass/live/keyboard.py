"""Plays from the computer keyboard: turns terminal keys into messages. [main thread]"""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

from livebass.live.midi import send_everywhere
from livebass.live.terminal import Terminal
from livebass.model.keymap import MODO, KeyMap
from livebass.rows.techniques import BUTTONS, OF_CHANNEL

LOG = logging.getLogger(__name__)
# Semitones above the lowest key, an E. In the upper row, capitals are a semitone higher.
NOTES = {key: place for place, key in enumerate("zsxdcvgbhnjm,l.;/")} | dict(
    zip("qwertyuiop", (12, 14, 16, 17, 19, 21, 23, 24, 26, 28), strict=True)
)
# The page's technique buttons on the number keys. Strokes are brief; ways to play stay on, by a controller (and its
# value) or a held key switch, until switched off.
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
SWITCHED = 64  # velocity of a key switch


class TerminalKeys(Terminal):
    """Turns keys of the terminal into messages for `send(status, first, second)`; `others` adds further keys.

    If the terminal reports released keys, a note lasts while its key is down; else until the next note or the space
    bar. A way to play is on while its key is down, or from one press to the next. `key_map` returns the map of the
    bass that plays.
    """

    def __init__(
        self,
        send: Any,
        panic: Any,
        others: dict[str, Callable[[], None]] | None = None,
        key_map: Callable[[], KeyMap] = lambda: MODO,
    ) -> None:
        super().__init__()
        self.send, self.panic, self.others, self.key_map = send, panic, others or {}, key_map
        self.octave, self.velocity = 2, 100
        self._ways: dict[str, Callable[[], object]] = {}  # by key, for those that are on: switches it off
        self._held: dict[str, int] = {}  # notes by key

    def carry_out(self, typed: str) -> None:
        key = typed.lower()
        if key in NOTES:
            raised = key in "qwertyuiop" and typed != key
            note = min(127, 12 * self.octave + 4 + NOTES[key] + raised)
            if self.releases:
                self._end(key)
            else:
                self.stop()
            self.send(0x90, note, self.velocity)
            self._held[key] = note
        elif key == " ":
            self.stop()
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
        """The key switch of a technique; None, and a log line, if the bass has none."""
        number = next((number for number, name, _ in self.key_map().keys if name == technique), None)
        if number is None:
            LOG.info("%s: the bass that plays has no key for it", technique)
        return number

    def _begin_way(self, key: str) -> None:
        """Switches on the way to play of `key`, by a controller with a value if it has one."""
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

    def release(self, key: str) -> None:
        self._end(key)
        self._end_way(key)

    def _end(self, key: str) -> None:
        """Ends the note that `key` holds, if any."""
        note = self._held.pop(key, None)
        if note is not None and note not in self._held.values():
            self.send(0x80, note, 0)

    def stop(self) -> None:
        for key in list(self._held):
            self._end(key)
