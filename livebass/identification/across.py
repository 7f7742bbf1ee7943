"""Finds how the motion across the neck, v, is tuned and damped beside that away from it, u.

By the lines of those partials that are two. In the terms of eqs. 8 and 9 of C. Issanchou et al. (2018) the neck has
another admittance for v: the difference of the dampings is that of the conductances, the detuning that of the
susceptances.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from livebass.identification.partials import Found
from livebass.model.neck import neck_damping


@dataclass(frozen=True)
class Double:
    """A partial of two lines: v beside u."""

    number: int  # j
    frequency: float  # Hz, of u
    detuning: float  # of v over u, less 1
    damping: float  # 1/s, of v less that of u: never above 0
    conductance: float  # m/s/N, of the neck for v less that for u
    susceptance: float  # m/s/N, likewise


@dataclass(frozen=True)
class Across:
    """The law of v: constants, medians over the partials that are two lines, and what each of these tells."""

    detuning: float  # relative to u
    detuning_spread: float  # median distance from it
    damping: float  # 1/s, of v less that of u
    damping_spread: float  # 1/s, median distance from it
    partials: tuple[Double, ...]


def across(found: Sequence[Found], impedance: float, fundamental: float) -> Across | None:
    """Returns the law of v by the partials `found` of a string of `impedance` (kg/s) and f0 (Hz); None if all are one.

    With a detuning of Im Y by -mu c / (j pi), and a damping of Re Y by 2 f0 mu c.
    """
    lost = float(neck_damping(1.0, impedance, fundamental))  # 1/s for 1 m/s/N
    double = []
    for p in found:
        if p.v is None:
            continue
        detuning, damping = p.v.frequency / p.u.frequency - 1, p.v.damping - p.u.damping
        double.append(Double(p.number, p.u.frequency, detuning, damping, damping / lost,
                             -detuning * p.number * math.pi / impedance))  # fmt: skip
    if not double:
        return None
    detunings, dampings = np.array([(d.detuning, d.damping) for d in double]).T
    middle = float(np.median(detunings)), float(np.median(dampings))
    spread = (float(np.median(np.abs(x - m))) for x, m in zip((detunings, dampings), middle, strict=True))
    detuning_spread, damping_spread = spread
    return Across(middle[0], detuning_spread, middle[1], damping_spread, tuple(double))
