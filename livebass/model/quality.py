"""Quality tiers: how many modes, how fine the contact steps. One kernel runs them all.

What a simulated pluck may be: a row a value, by which the command line and the function both go.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from livebass.units import DIMENSIONS, format_quantity

MOST_MODES = 1024
LEAST_CONTACT_RATE, MOST_CONTACT_RATE = 44_100.0, 64e6


@dataclass(frozen=True)
class Quality:
    """`modes` count for the open string, a stopped one has proportionally fewer; None: all the grid has."""

    name: str
    modes: int | None
    contact_rate: float  # Hz, at least: raised to a whole multiple of the audio rate


QUALITIES = {
    "live": Quality("live", 400, 384e3),
    "studio": Quality("studio", 600, 4e6),
    "reference": Quality("reference", None, 8e6),
}


def quality_with(name: str, modes: int | None = None, contact_rate: float | None = None) -> Quality:
    """The tier `name`, with `modes` or `contact_rate` (Hz) replaced. ValueError says what is allowed."""
    if name not in QUALITIES:
        raise ValueError(f"quality {name!r}: allowed are {', '.join(QUALITIES)}")
    quality = QUALITIES[name]
    if modes is not None:
        if not 1 <= modes <= MOST_MODES:
            raise ValueError(f"modes {modes}: allowed are 1 to {MOST_MODES}")
        quality = replace(quality, modes=modes)
    if contact_rate is not None:
        if not LEAST_CONTACT_RATE <= contact_rate <= MOST_CONTACT_RATE:
            raise ValueError(
                f"contact rate {contact_rate:g} Hz: allowed are {LEAST_CONTACT_RATE:g} to {MOST_CONTACT_RATE:g} Hz"
            )
        quality = replace(quality, contact_rate=contact_rate)
    return quality


def modes_for(quality: Quality, length: float, open_length: float, grid_points: int) -> int:
    """Modes of a speaking length (m), at most what its grid of `grid_points` steps carries."""
    full = min(grid_points - 1, MOST_MODES)
    if quality.modes is None:
        return full
    return max(1, min(full, round(quality.modes * length / open_length)))


class Limits(NamedTuple):
    """From `least` to `most` in SI, both allowed."""

    dimension: str  # a key of units.DIMENSIONS
    least: float
    most: float
    whole: bool = False  # whole numbers of the SI unit only

    def check(self, name: str, value: float) -> None:
        """Raise ValueError, saying what is allowed, for a `value` (SI) outside; a NaN always is."""
        if not self.least <= value <= self.most or (self.whole and value != int(value)):
            unit = next(unit for unit, size in DIMENSIONS[self.dimension].units.items() if size == 1.0)
            raise ValueError(f"{name} {value:.10g} {unit}: allowed are {self}")

    def __str__(self) -> str:
        kind = "whole numbers of Hz from " if self.whole else ""
        return f"{kind}{_shown(self.least, self.dimension)} to {_shown(self.most, self.dimension)}"


def _shown(value: float, dimension: str) -> str:
    units = DIMENSIONS[dimension].units
    fitting = [u for u, size in units.items() if 1 <= value / size < 1000 and u not in ("in", "cm")]
    return format_quantity(value, dimension, fitting[0] if fitting else None)


APEX = Limits("length", 1e-6, 0.030)
ANGLE = Limits("angle", -1.56, 1.56)  # rad, from straight up
AT = Limits("length", 1e-3, 2.0)  # from the stop; and on the string
DURATION = Limits("time", 1e-4, 60.0)
RATE = Limits("frequency", 22050, 192_000, whole=True)
CONTACT_RATE = Limits("frequency", LEAST_CONTACT_RATE, MOST_CONTACT_RATE, whole=True)
