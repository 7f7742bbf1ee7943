"""Times of a piece as it sounds, by its tempos: whole microseconds per quarter note, as a MIDI file stores them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from fractions import Fraction
from functools import cached_property
from math import floor

from livebass.tab.model import Hold, Tempo

TICKS = 3840  # in a quarter note
MINUTE = 60_000_000  # us
DEFAULT_TEMPO = 120.0  # beats a minute, without a tempo
SLOWEST, FASTEST = 5.0, 2000.0
RAMP = Fraction(1, 8)  # quarter notes of a step in a gradual change ...
MAX_STEPS = 64  # ... unless it has more steps


class Tempos:
    """From quarter notes to seconds and back."""

    def __init__(self, tempos: Iterable[tuple[Fraction, Tempo]], holds: Iterable[tuple[Fraction, Hold]] = ()) -> None:
        """`tempos` are (its place in quarter notes, tempo), in order; `holds` (the beginning of its bar, hold)."""
        steps: list[tuple[Fraction, float]] = [(Fraction(0), DEFAULT_TEMPO)]
        for place, tempo in tempos:
            at = max(place, Fraction(0))  # a damaged file may have one before its first bar
            while steps[-1][0] > at:  # a new tempo ends a gradual change
                steps.pop()
            bpm = steps[-1][1]
            if steps[-1][0] == at:
                steps.pop()
            count = min(-(-tempo.over // RAMP), MAX_STEPS)
            for k in range(count):
                steps.append((at + tempo.over * k / count, bpm + (tempo.bpm - bpm) * (k + 0.5) / count))
            steps.append((at + tempo.over, tempo.bpm))
        changes = [(at, 0, bpm) for at, bpm in steps]
        changes += [(begin + x, 1, y) for begin, hold in holds for x, y in ((hold.at, hold.times), (hold.end, 1.0))]
        found: dict[Fraction, float] = {}
        bpm, times = DEFAULT_TEMPO, 1.0
        for at, kind, value in sorted(changes):
            bpm, times = (bpm, value) if kind else (value, times)
            found[at] = min(max(bpm / times, SLOWEST), FASTEST)
        self.steps = [(at, round(MINUTE / bpm)) for at, bpm in found.items()]
        self._at = [float(at) for at, _ in self.steps]
        self._times = [0.0]
        for (begin, us), (end, _) in zip(self.steps, self.steps[1:], strict=False):
            self._times.append(self._times[-1] + float(end - begin) * us / 1e6)

    def seconds(self, quarters: Fraction | float) -> float:
        """The time of a place."""
        k = max(bisect_right(self._at, quarters) - 1, 0)
        return self._times[k] + (float(quarters) - self._at[k]) * self.steps[k][1] / 1e6

    def tick(self, seconds: float) -> int:
        """The tick nearest to a time."""
        return nearest_tick(self.quarters(seconds))

    @cached_property
    def ticks(self) -> list[tuple[int, int, int]]:
        """(tick, us per quarter note, time in us times TICKS) of each tempo, as a MIDI file has them."""
        rows, time = list[tuple[int, int, int]](), 0
        for at, us in self.steps:
            begin = nearest_tick(at)
            time += (begin - rows[-1][0]) * rows[-1][1] if rows else 0
            rows.append((begin, us, time))
        return rows

    def time(self, at: int) -> Fraction:
        """The exact time of a tick, s."""
        begin, us, time = self.ticks[bisect_right(self.ticks, (at, MINUTE)) - 1]
        return Fraction(time + (at - begin) * us, TICKS * 1_000_000)

    def frame(self, at: int, rate: int) -> int:
        """The frame nearest to a tick, at `rate` Hz."""
        return floor(self.time(at) * rate + Fraction(1, 2))

    def quarters(self, seconds: float) -> float:
        """The place at a time."""
        k = max(bisect_right(self._times, seconds) - 1, 0)
        return self._at[k] + (seconds - self._times[k]) * 1e6 / self.steps[k][1]


def nearest_tick(quarters: Fraction | float) -> int:
    """The tick nearest to a place in quarter notes."""
    return max(round(quarters * TICKS), 0)
