"""The rows of a comparison: each figure, the notes it applies to, and its range over real basses.

The ranges stand in ranges.csv, which tools/real_notes.py makes from recordings: for each row and technique the lowest
and the highest median of a bass, and the number of basses and notes behind them. A bass with other strings counts as
another bass. No range comes from one bass alone.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import NamedTuple

from livebass.lab.comparison.measures import BAND_KEYS, FLOOR_KEYS, SHARE_KEYS

SOFT, MEDIUM, HARD, ALL = "soft", "medium", "hard", "all"


class Range(NamedTuple):
    """A range of figures of real basses, from `low` to `high`, and the number of basses and notes behind it."""

    low: float
    high: float
    basses: int
    notes: int


@cache
def ranges() -> dict[tuple[str, str, str], Range]:
    """Returns the ranges of real basses by key, when and technique."""
    table = csv.DictReader(files("livebass.lab.comparison").joinpath("ranges.csv").read_text("utf-8").splitlines())
    return {
        (row["key"], row["when"], row["technique"]): Range(
            float(row["low"]), float(row["high"]), int(row["basses"]), int(row["notes"])
        )
        for row in table
    }


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    key: str  # of the figure
    when: str  # the notes used: SOFT, MEDIUM, HARD or ALL
    title: str
    unit: str
    digits: int = 1
    techniques: tuple[str, ...] = ()  # the only ones that have it; (): all

    def of(self, technique: str) -> bool:
        """Returns whether notes of a technique have it."""
        return not self.techniques or technique in self.techniques

    def range_of(self, technique: str) -> Range | None:
        """Returns the range of real basses for a technique; None if fewer than two tell it."""
        return ranges().get((self.key, self.when, technique))

    def shown(self, value: float) -> str:
        """Returns a value as shown in the table."""
        return f"{value:z.{self.digits}f}"

    def verdict(self, value: float, technique: str) -> str:
        """Returns "inside", or how far a value is above or below the range; "" without a range."""
        real = self.range_of(technique)
        if real is None:
            return ""
        rounded, low, high = (float(self.shown(v)) for v in (value, real.low, real.high))
        if low <= rounded <= high:
            return "inside"
        return f"{self.shown(rounded - high)} above" if rounded > high else f"{self.shown(low - rounded)} below"


def _each(key: str, title: str, unit: str, digits: int = 1) -> list[Row]:
    """Rows of a figure for soft, medium and hard notes."""
    return [Row(key, when, title, unit, digits) for when in (SOFT, MEDIUM, HARD)]


OCTAVES = ("50-100", "100-200", "200-400", "400-800", "800-1600", "1600-3200", "3200-6400")  # Hz
BANDS = ("1.5 f0 to 300 Hz", "300 to 700 Hz", "700 to 1500 Hz", "1.5 to 3 kHz", "3 to 6 kHz")
GAPS = {"between_200": "0.2-0.5", "between_500": "0.5-1.5", "between_1500": "1.5-4"}  # kHz
FLOORS = ("0.2-0.5", "0.5-1.5", "1.5-4", "4-8", "10-16")  # kHz
SHARES = ("31", "63", "125", "250", "500", "1k", "2k", "4k", "8k")  # Hz
STRUCK = ("slap", "pop")  # techniques with a thump before the note

ROWS: tuple[Row, ...] = (
    *_each("level", "level of the first 0.3 s", "dBFS"),
    Row("level_span", ALL, "level of hard notes over soft ones", "dB"),
    *_each("level_1s", "level 1 s after the peak", "dB"),
    *_each("level_2s", "level 2 s after the peak", "dB"),
    *(Row("fall_time", when, "time to fall by 20 dB", "s", 2, ("mute",)) for when in (SOFT, MEDIUM, HARD)),
    *(Row(f"t60_{octave.split('-')[0]}", ALL, f"T60 of stopped notes, {octave} Hz", "s") for octave in OCTAVES),
    Row("t60_ratio", ALL, "T60 stopped / open, 200-1600 Hz", "", 2),
    Row("t60_scatter", ALL, "scatter of ln T60 from partial to partial", "", 2),
    *_each("bend", "1.5-6 kHz: early fall over late fall", "dB/s", 0),
    Row("returns", HARD, "1.5-6 kHz: rise after 0.12 s", "dB"),
    Row("returns_90", HARD, "   in the most restless tenth of notes", "dB"),
    Row("growth", ALL, "0.7-3 kHz over the fundamental, softest to next dynamic", "dB"),
    Row("level_growth", ALL, "   for a level that grows by", "dB"),
    *(row for key, band in zip(BAND_KEYS, BANDS, strict=True)
      for row in _each(key, f"over the fundamental, 0-0.3 s, {band}", "dB", 0)),
    *_each("centroid_20", "centroid at 20 ms", "Hz", 0),
    *_each("centroid_100", "centroid at 100 ms", "Hz", 0),
    *_each("centroid_fall", "centroid at 20 / at 100 ms", "", 2),
    *_each("fundamental_fall", "fundamental at 100 re 20 ms", "dB"),
    *_each("dip", "deepest dip of the fundamental off a straight decay", "dB"),
    Row("dip_90", HARD, "   in the worst tenth of notes", "dB"),
    *_each("drift", "drift of the fundamental", "cents", 2),
    *_each("glide_early", "glide of partials 1-5 at 50-110 ms", "cents"),
    *_each("glide_late", "glide of partials 1-5 at 130-230 ms", "cents"),
    *_each("wobble", "wobble of partials 5-12 off a straight decay", "dB", 2),
    *(row for key, gap in GAPS.items() for row in _each(key, f"between partials at 0.4 s, {gap} kHz", "dB", 0)),
    Row("between_rise", ALL, "   0.2-4 kHz, hard over soft, without reference", "dB", 0),
    *_each("between_50ms", "between partials at 50 ms, 0.5-4 kHz", "dB", 0),
    *_each("lines", "strongest line between partials, 60-700 Hz", "dB", 0),
    *(Row(key, SOFT, f"noise floor, {band} kHz", "dB/kHz", 0) for key, band in zip(FLOOR_KEYS, FLOORS, strict=True)),
    *_each("hiss", "10-16 kHz at 0.4 s over the rest", "dB", 0),
    Row("snap", HARD, "2-4 kHz: peak over 100-150 ms", "dB", 0),
    *(Row(f"high_{ms}", HARD, f"2-8 kHz {ms} ms after its peak", "dB", 0) for ms in (100, 200, 400)),
    Row("thump", HARD, "0-30 re 100-200 ms", "dB", 1, STRUCK),
    *(Row(key, HARD, f"share of the first 30 ms, octave of {octave} Hz", "dB", 0, STRUCK)
      for key, octave in zip(SHARE_KEYS, SHARES, strict=True)),
    Row("take_level", ALL, "round robin: scatter of the level", "dB", 2),
    Row("take_distance", ALL, "distance of round robins, 1 s", "dB"),
    Row("touch_distance", ALL, "distance of soft and hard notes, 1 s", "dB"),
    Row("knock", ALL, "release: peak over that of the note after 1 s", "dB", 0),
    Row("knock_centroid", ALL, "release: centroid", "Hz", 0),
    Row("release_time", ALL, "release: time to fall by 20 dB", "ms", 0),
    Row("nearest_1s", ALL, "distance to the nearest note of a real bass, 1 s", "dB"),
    Row("nearest_2s", ALL, "the same, 2.5 s", "dB"),
    Row("nearest_equalized", ALL, "the same, 2.5 s, each band's level free", "dB"),
    Row("alike_1s", ALL, "distance to real notes as soft or hard, 1 s", "dB"),
)  # fmt: skip
