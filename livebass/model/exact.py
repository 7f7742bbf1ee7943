"""Powers of 2 rounded once, and so the same on every system: C libraries round differently.

Uses Taylor's series in integers of PLACES binary places: slow, some microseconds each, for the numbers that define a
bass. Kernels have their own (kernels/machine/elementary.py), faster and within one unit in the last place.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache

PLACES = 160
ONE = 1 << PLACES
LN2 = round(Fraction("0.69314718055994530941723212145817656807550013436025525412068000949339362196969471560586") * ONE)


@lru_cache(maxsize=4096)
def exp2(x: float) -> float:
    """Returns 2^x, rounded to the nearest float."""
    octaves = round(x)
    above, below = (x - octaves).as_integer_ratio()
    rest = above * LN2 // below
    total, term, n = 0, ONE, 0
    while term not in (0, -1):
        total += term
        n += 1
        term = (term * rest >> PLACES) // n
    return math.ldexp(float(total), octaves - PLACES)
