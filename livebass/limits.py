"""What a simulated pluck may be: a row a value, by which the command line and the function both go."""

from __future__ import annotations

from typing import NamedTuple

from livebass.quality import LEAST_CONTACT_RATE, MOST_CONTACT_RATE
from livebass.units import DIMENSIONS, format_quantity


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
