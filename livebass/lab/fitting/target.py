"""The score of played notes beside recorded ones: rows of `livebass compare` in spreads of real basses, and distances.

A spread is the usual distance between two real basses in a row: the range of `compare` over SPREADS. Hz and seconds
count by their logarithm. The score is the mean of the rows' differences, each at most CAP spreads, plus the mean
distance in dB over 1 s, weighted, with and without the level of each band.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from livebass.lab.comparison.distance import between, shape
from livebass.lab.comparison.measures import GLIDE_KEYS, KEYS, attack, measure
from livebass.lab.comparison.names import DEFAULT_TECHNIQUE
from livebass.lab.comparison.rows import ALL, HARD, MEDIUM, ROWS, SOFT
from livebass.lab.fitting.notes import Place
from livebass.rows.arrays import Floats

SECONDS = 1.6  # s of a note that are compared
LEAD = 0.03  # s before its attack
LONG = {"level", "level_2s", "growth", "between_level", "fall_time"}  # absolute, or longer than SECONDS
SLOW = set(GLIDE_KEYS)  # costly to measure, for little
SPREADS = 2.5  # in a range over a handful of basses
CAP = 3.0  # spreads
LEVEL = 3.0  # dB, a spread of the level of a layer, and of its peak over its level
DYNAMIC, HEAVY = ("level", "crest"), 4.0  # rows of a layer's loudness, and their weight: hands are known by it
FAR, SHAPED = 0.2, 0.1  # score of 1 dB distance, as it is and with the level of each band free
MISSING = 1.0  # spreads, of a row that recorded notes show and played ones do not
LOGARITHMIC = ("Hz", "s")  # units


@dataclass(frozen=True, eq=False)
class Heard:
    """One note as the fit hears it."""

    figures: dict[str, float]  # NaN: not shown
    shape: Floats  # levels over time and bands


class Difference(NamedTuple):
    """One row of one layer."""

    spreads: float  # ours over theirs
    theirs: float
    ours: float


@dataclass(frozen=True)
class Score:
    """The parts of a score; the less, the nearer."""

    rows: float  # spreads
    distance: float  # dB over 1 s
    equalized: float  # dB, with the level of each band free

    @property
    def total(self) -> float:
        """The score."""
        return self.rows + FAR * self.distance + SHAPED * self.equalized


@lru_cache(8)
def spreads(technique: str) -> dict[tuple[str, str], float]:
    """The spread of each row by key and SOFT, MEDIUM or HARD, for a technique.

    A row without a range for some notes takes the range of the others, or the range of fingers.
    """
    found: dict[str, dict[str, float]] = {}
    for row in ROWS:
        if row.key not in KEYS or row.key in LONG or not row.of(technique):
            continue
        ranges = [row.range_of(each) for each in (technique, DEFAULT_TECHNIQUE)]
        real = next((r for r in ranges if r is not None and r.low < r.high), None)
        if real is not None:
            log = row.unit in LOGARITHMIC and real.low > 0
            wide = math.log(real.high / real.low) if log else real.high - real.low
            found.setdefault(row.key, {})[row.when] = max(wide / SPREADS, 0.0 if log else 10.0**-row.digits)
    return {
        (key, when): by.get(when, by.get(ALL, float(np.mean(list(by.values())))))
        for key, by in found.items()
        for when in (SOFT, MEDIUM, HARD)
    }


def searched_figures(technique: str) -> frozenset[str]:
    """The figures that a search measures."""
    return frozenset(key for key, _ in spreads(technique)) - SLOW


def measure_note(sound: Floats, rate: int, pitch: float, only: frozenset[str] = frozenset()) -> Heard:
    """Measures SECONDS of a note from its attack; `only` some figures. Raises ValueError for silence."""
    begin = max(0, attack(sound, rate) - round(LEAD * rate))
    cut = sound[begin:][: round((LEAD + SECONDS) * rate)]
    measures = dict(measure(cut, rate, pitch, {*(only or KEYS), "level", "peak"}))
    return Heard(measures | {"crest": measures["peak"] - measures["level"]}, shape(cut, rate, 1.0))


def when(rank: int, layers: int) -> str:
    """The kind of notes of a layer; the only layer counts as hard."""
    return HARD if rank == layers - 1 else SOFT if rank == 0 else MEDIUM


def differences(
    theirs: Mapping[Place, Sequence[Heard]], ours: Mapping[Place, Heard], technique: str, layers: int
) -> dict[tuple[str, int], Difference]:
    """The difference of each row, by its key and layer: the median over the places of the layer."""
    found = {}
    logarithmic = {row.key for row in ROWS if row.unit in LOGARITHMIC}
    for rank in sorted({p.rank for p in ours}):
        places = [p for p in ours if p.rank == rank]
        for (key, kind), spread in spreads(technique).items():
            if kind != when(rank, layers) or key not in next(iter(ours.values())).figures:
                continue
            real = np.array([_median(h.figures.get(key, math.nan) for h in theirs[p]) for p in places])
            made = np.array([ours[p].figures[key] for p in places])
            if key in logarithmic:
                real, made = (np.log(np.where(x > 1e-3, x, 1e-3)) + 0 * x for x in (real, made))
            valid, both = np.isfinite(real), np.isfinite(real) & np.isfinite(made)
            if both.any():
                ends = float(np.median(real[both])), float(np.median(made[both]))
                ends = tuple(map(math.exp, ends)) if key in logarithmic else ends  # type: ignore[assignment]
                found[key, rank] = Difference(float(np.median((made - real)[both])) / spread, *ends)
            elif valid.any():
                found[key, rank] = Difference(MISSING, math.nan, math.nan)
    return found


def level_differences(
    theirs: Mapping[Place, Sequence[Heard]], ours: Mapping[Place, Heard]
) -> dict[tuple[str, int], Difference]:
    """The difference of each layer's level, apart from the level of all, and of its peaks over it, in spreads."""
    ranks = sorted({p.rank for p in ours})
    found = {}
    for key in DYNAMIC:
        real = [_median(h.figures[key] for p in ours if p.rank == rank for h in theirs[p]) for rank in ranks]
        made = [_median(ours[p].figures[key] for p in ours if p.rank == rank) for rank in ranks]
        off = float(np.mean(np.subtract(made, real))) if key == "level" else 0.0
        for rank, a, b in zip(ranks, real, made, strict=True):
            found[key, rank] = Difference((b - a - off) / LEVEL, a, b - off)
    return found


def score(
    theirs: Mapping[Place, Sequence[Heard]], ours: Mapping[Place, Heard], rows: Mapping[tuple[str, int], Difference]
) -> Score:
    """The score of notes, given the differences of their rows."""
    found = [min(abs(row.spreads), CAP) for row in rows.values()]
    weights = [HEAVY if key in DYNAMIC else 1.0 for key, _ in rows]
    return Score(
        float(np.average(found, weights=weights)) if found else 0.0,
        float(np.mean([apart(theirs[p], h) for p, h in ours.items()])),
        float(np.mean([apart(theirs[p], h, equalized=True) for p, h in ours.items()])),
    )


def apart(takes: Sequence[Heard], other: Heard, seconds: float = 1.0, equalized: bool = False) -> float:
    """The mean distance from all takes of a place to another note, dB."""
    return float(np.mean([between(take.shape, other.shape, seconds, equalized) for take in takes]))


def _median(values: Iterable[float]) -> float:
    valid = [v for v in values if not math.isnan(v)]
    return float(np.median(valid)) if valid else math.nan
