"""The rows of a comparison: each figure, the notes it applies to, and its range over five real basses.

That range covers their medians by bass and dynamic. They are a Squier Jazz Bass, an Ibanez BTB with dead flat wounds,
another bass of the jazz type and a Yamaha RBX, recorded direct and played with the fingers, the last with a pick too,
and the bass of the sound font Fluid, the only source of slap and pop, where the range is mostly one number.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

SOFT, MEDIUM, HARD, ALL = "soft", "medium", "hard", "all"


class Range(NamedTuple):
    """A range of figures of real basses, from `low` to `high`."""

    low: float
    high: float


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    key: str  # of the figure
    when: str  # the notes used: SOFT, MEDIUM, HARD or ALL
    title: str
    unit: str
    digits: int = 1
    real: Range | None = None  # range of five real basses
    by_technique: dict[str, Range | None] = field(default_factory=dict)  # exceptions

    def range_of(self, technique: str) -> Range | None:
        """Returns the range for a technique."""
        return self.by_technique.get(technique, self.real)

    def shown(self, value: float) -> str:
        """Returns a value as shown in the table."""
        return f"{value:.{self.digits}f}"

    def verdict(self, value: float, technique: str) -> str:
        """Returns "inside", or how far a value is above or below the range; "" without a range."""
        real = self.range_of(technique)
        if real is None:
            return ""
        rounded, low, high = (float(self.shown(v)) for v in (value, *real))
        if low <= rounded <= high:
            return "inside"
        return f"{self.shown(rounded - high)} above" if rounded > high else f"{self.shown(low - rounded)} below"


def _each(key: str, title: str, unit: str, digits: int = 1, soft: Range | None = None, hard: Range | None = None,
          **by_technique: Range | None) -> list[Row]:  # fmt: skip
    """Rows of a figure for soft, medium and hard notes; techniques have their own range only in hard ones."""
    none: dict[str, Range | None] = dict.fromkeys(("slap", "pop"))
    return [
        Row(key, SOFT, title, unit, digits, soft, none),
        Row(key, MEDIUM, title, unit, digits, None),
        Row(key, HARD, title, unit, digits, hard, none | by_technique),
    ]


def _one(value: float) -> Range:
    return Range(value, value)


OCTAVES = ("50-100", "100-200", "200-400", "400-800", "800-1600", "1600-3200", "3200-6400")  # Hz
T60 = ((8.0, 17.0), (4.2, 13.0), (2.9, 10.5), (1.5, 6.7), (0.8, 4.3), (0.9, 1.9), (1.1, 2.1))  # s
BANDS = ("1.5 f0 to 300 Hz", "300 to 700 Hz", "700 to 1500 Hz", "1.5 to 3 kHz", "3 to 6 kHz")
BAND_KEYS = ("band_low", "band_300", "band_700", "band_1500", "band_3000")
BAND_SOFT = ((-6.0, 8.0), (-24.0, 2.0), (-35.0, -10.0), (-46.0, -16.0), (-61.0, -18.0))  # dB
BAND_HARD = ((1.0, 10.0), (-9.0, 16.0), (-15.0, 12.0), (-23.0, 5.0), (-31.0, 8.0))
SHARES = ("31", "63", "125", "250", "500", "1k", "2k", "4k", "8k")  # Hz
SHARE_KEYS = tuple(f"octave_{round(31.25 * 2**k)}" for k in range(len(SHARES)))
# of the first 30 ms, dB: three slapped notes of two basses, and a pop
SLAPPED: tuple[tuple[float, float] | None, ...] = (
    (-16, -8), (-9, -3), (-6, -2), None, (-26, -14), None, (-18, -13), (-23, -13), (-25, -11)
)  # fmt: skip
POPPED = (-14.0, -12.0, -4.0, None, -10.0, None, -18.0, -12.0, -15.0)

ROWS: tuple[Row, ...] = (
    *_each("level", "level of the first 0.3 s", "dBFS"),
    *_each("level_1s", "level 1 s after the peak", "dB", soft=Range(-9.8, -5.4)),
    *_each("level_2s", "level 2 s after the peak", "dB", soft=Range(-17.5, -9.0)),
    *(
        Row(f"t60_{octave.split('-')[0]}", ALL, f"T60 of stopped notes, {octave} Hz", "s", 1, Range(*real))
        for octave, real in zip(OCTAVES, T60, strict=True)
    ),
    Row("t60_ratio", ALL, "T60 stopped / open, 200-1600 Hz", "", 2, Range(0.5, 1.1)),
    Row("t60_scatter", ALL, "scatter of ln T60 from partial to partial", "", 2, Range(0.22, 0.59)),
    Row("growth", ALL, "0.7-3 kHz over the fundamental, softest to next dynamic", "dB", 1, Range(1, 21)),
    Row("level_growth", ALL, "   for a level that grows by", "dB", 1),
    *(
        row
        for key, band, soft, hard in zip(BAND_KEYS, BANDS, BAND_SOFT, BAND_HARD, strict=True)
        for row in _each(key, f"over the fundamental, 0-0.3 s, {band}", "dB", 0, Range(*soft), Range(*hard))
    ),
    *_each("centroid_20", "centroid at 20 ms", "Hz", 0, hard=Range(157, 1256)),
    *_each("centroid_100", "centroid at 100 ms", "Hz", 0, hard=Range(145, 772)),
    *_each("centroid_fall", "centroid at 20 / at 100 ms", "", 2, hard=Range(1.1, 1.9), pick=_one(1.1),
           slap=_one(1.35), pop=Range(0.6, 0.8)),
    *_each("fundamental_fall", "fundamental at 100 re 20 ms", "dB", 1, hard=Range(-1.7, 1.9), slap=_one(-3),
           pop=_one(-11)),
    Row("glide_early", HARD, "glide of partials 1-5 at 50-110 ms", "cents", 1, Range(2, 65)),
    Row("glide_late", HARD, "glide of partials 1-5 at 130-230 ms", "cents", 1, Range(1, 34)),
    Row("wobble", SOFT, "wobble of partials 5-12 off a straight decay", "dB", 2, Range(0.6, 1.5)),
    Row("wobble", MEDIUM, "wobble of partials 5-12 off a straight decay", "dB", 2, Range(0.6, 1.5)),
    Row("between_200", SOFT, "between partials at 0.4 s, 0.2-0.5 kHz", "dB", 0, Range(-74, -53)),
    Row("between_500", SOFT, "between partials at 0.4 s, 0.5-1.5 kHz", "dB", 0, Range(-71, -41)),
    Row("between_1500", SOFT, "between partials at 0.4 s, 1.5-4 kHz", "dB", 0, Range(-73, -31)),
    Row("between_50ms", HARD, "between partials at 50 ms, 0.5-4 kHz", "dB", 0, Range(-44, -15)),
    Row("snap", HARD, "2-4 kHz: peak over 100-150 ms", "dB", 0, Range(11, 40),
        {"pick": Range(8, 12), "slap": _one(16), "pop": _one(9)}),
    *(
        Row(f"high_{ms}", HARD, f"2-8 kHz {ms} ms after its peak", "dB", 0, Range(*real),
            {"pick": _one(pluck), "slap": _one(slap), "pop": _one(pluck)})
        for ms, real, slap, pluck in (
            (100, (-28, -12), -12, -5), (200, (-35, -17), -17, -8), (400, (-45, -25), -25, -13)
        )
    ),
    Row("thump", HARD, "0-30 re 100-200 ms", "dB", 1, None, {"slap": Range(7, 8.4), "pop": _one(7)}),
    *(
        Row(key, HARD, f"share of the first 30 ms, octave of {octave} Hz", "dB", 0, None,
            {"slap": Range(*slap) if slap else None, "pop": None if pop is None else _one(pop)})
        for key, octave, slap, pop in zip(SHARE_KEYS, SHARES, SLAPPED, POPPED, strict=True)
    ),
    Row("take_level", ALL, "round robin: scatter of the level", "dB", 2, Range(0.4, 0.7)),
    Row("knock", ALL, "release: peak over that of the note after 1 s", "dB", 0, Range(4, 11)),
    Row("knock_centroid", ALL, "release: centroid", "Hz", 0, Range(130, 1350)),
    Row("take_distance", ALL, "distance of round robins, 1 s", "dB", 1, Range(1.1, 5.5)),
    Row("touch_distance", ALL, "distance of soft and hard notes, 1 s", "dB", 1),
    Row("nearest_1s", ALL, "distance to the nearest note of a real bass, 1 s", "dB", 1, Range(4.5, 11.6)),
    Row("nearest_2s", ALL, "the same, 2.5 s", "dB", 1, Range(4.9, 10.4)),
    Row("nearest_equalized", ALL, "the same, 2.5 s, each band's level free", "dB", 1, Range(2.5, 6.6)),
    Row("alike_1s", ALL, "distance to real notes as soft or hard, 1 s", "dB", 1),
)  # fmt: skip
