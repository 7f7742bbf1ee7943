"""The hands in a performance, stroke by stroke: when notes begin and end, and how strings move meanwhile.

Times are ticks of the exported MIDI file, so that it and the strokes are the same music, frame by frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from livebass.tab.perform import TIED, Stroke
from livebass.tab.tempos import Tempos

PRESSURE, WHEEL, FULL = 127, 8191, 127  # the maximum of vibrato, bend and expression
WHEEL_RANGE = 12.0  # semitones of a string's wheel
STEP = 5e-3  # s of a bend or a fade ...
MAX_STEPS = 2000  # ... unless it has more steps
VIBRATO, BEND, EXPRESSION = "vibrato", "bend", "expression"  # what moves
# Order of what happens at once: notes end, controllers move, notes begin, and what a tied note leaves ends
END, CONTROL, PRESS, BEGIN, LATER = range(5)


class Move(NamedTuple):
    """A string goes to a value: steps of vibrato, of the wheel or of the expression."""

    tick: int
    what: str
    value: int


class Ending(NamedTuple):
    """The end of a note."""

    tick: int
    tied: bool  # the left hand leads on to the next note


def missing(stroke: Stroke, frets: int) -> str:
    """The sign of a stroke that a neck with `frets` cannot play; "": it can. Damaged files have frets below 0."""
    return "" if 0 <= stroke.fret <= frets else f"note beyond fret {frets if stroke.fret > 0 else 0}"


def following(strokes: Sequence[Stroke]) -> Iterator[tuple[Stroke, Stroke | None]]:
    """Each stroke, and the next one on its string."""
    after: dict[int, Stroke] = {}
    found = list[tuple[Stroke, Stroke | None]]()
    for stroke in reversed(strokes):
        found.append((stroke, after.get(stroke.string)))
        after[stroke.string] = stroke
    return reversed(found)


def ending(tempos: Tempos, stroke: Stroke, after: Stroke | None) -> Ending:
    """Returns the end of a stroke's note; `after` is the next stroke on its string, or None."""
    tied = after is not None and after.kind in TIED and after.fret != stroke.fret and after.time - stroke.end < 1e-3
    end = tempos.tick(after.time if tied and after else stroke.end)
    return Ending(max(end, tempos.tick(stroke.time) + 1) + tied, tied)


class Moves:
    """The moves of the strings; it knows where each string is.

    `again`: a stroke also repeats what is not at rest, because a player may jump to it.
    """

    def __init__(self, tempos: Tempos, again: bool = False) -> None:
        self.tempos, self.again = tempos, again
        self._values: dict[tuple[str, int], int] = {}  # by what moves, and the string

    def of(self, stroke: Stroke) -> Iterator[Move]:
        """The moves of a stroke's string while it sounds."""
        yield from self._along(VIBRATO, stroke, [(stroke.time, stroke.vibrato)], PRESSURE)
        yield from self._along(BEND, stroke, [(time, y / WHEEL_RANGE) for time, y in stroke.bend], WHEEL)
        yield from self._along(EXPRESSION, stroke, stroke.fade or [(stroke.time, 1.0)], FULL)

    def _along(self, what: str, stroke: Stroke, curve: Sequence[tuple[float, float]], maximum: int) -> Iterator[Move]:
        """The moves along a curve (s, -1 to 1), from the beginning of a stroke."""
        times = [stroke.time]
        if len(curve) > 1:
            length = min(curve[-1][0], stroke.end) - stroke.time
            count = max(min(int(length / STEP), MAX_STEPS), 0)
            times += [stroke.time + length * (k + 1) / count for k in range(count)]
        for time in times:
            value, rest = round(min(max(height_at(curve, time), -1.0), 1.0) * maximum), rest_of(what)
            repeats = self.again and time == stroke.time and value != rest
            if repeats or value != self._values.get((what, stroke.string), rest):
                self._values[what, stroke.string] = value
                yield Move(self.tempos.tick(time), what, value)


def rest_of(what: str) -> int:
    """The value of a string at rest."""
    return FULL if what == EXPRESSION else 0


def height_at(curve: Sequence[tuple[float, float]], time: float) -> float:
    """The height of a curve, level before its first and after its last point; 0 without points."""
    before = None
    for x, y in curve:
        if x > time:
            return y if before is None else before[1] + (y - before[1]) * (time - before[0]) / (x - before[0])
        before = x, y
    return before[1] if before else 0.0
