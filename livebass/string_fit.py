"""From the partials of an open string to the laws it follows: f0 and B of eq. 8, the losses of eqs. 9 to 11.

Equation numbers: C. Issanchou et al. (2018). As in section 3.2 there, the laws serve beyond the measured partials and
are fitted where the neck disturbs least, that is to the higher ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from livebass import modes
from livebass.admittance import Admittance, neck_damping
from livebass.instrument import Neck, String, speaking
from livebass.partials import median_line

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FEW = 10  # so many partials or fewer: the laws are fitted to all of them
MOST_B = 0.01  # as a preset allows
DIAMETER_SPREAD = 0.3  # of what the base preset says: how far the losses in air may pull it
ANGLE, ANGLE_SPREAD = 0.01, 0.5  # a delta_ve, and how many of it the fit may be off what the base preset says
THERMOELASTIC_SPREAD = 2e-5  # 1/Q: as the known strings have 6e-6 or so
LEAST_SHARE = 0.1  # of 1/Q: a smaller part that is left over is not ascribed to the neck
LEAST_MISFIT, MOST_MISFIT = 0.01, 0.3  # relative: what the law leaves of 1/Q at a partial is taken to be within
ENVELOPE = 0.02  # weight of a partial above the law over one below: the neck can only add losses


@dataclass(frozen=True)
class Law:
    """nu_j = j f0 (1 + B j^2 / 2): eq. 8 without the nut term."""

    fundamental: float  # f0, Hz
    inharmonicity: float  # B, at least 0
    deviation: float  # relative, root mean square, of the partials it was fitted to
    first: int  # it was fitted to partials from this number on

    def frequency(self, j: Floats | Ints) -> Floats:
        """nu_j, Hz."""
        return np.asarray(j * self.fundamental * (1 + self.inharmonicity * np.asarray(j, np.float64) ** 2 / 2))


def fit_law(number: Ints, frequency: Floats, known: float | None = None) -> Law:
    """The law through partials `number` (n,) at `frequency` (n,), Hz: medians over pairs of the upper half of them.

    Medians, because single partials are drawn aside by resonances of the neck. With `FEW` or fewer these hide what B
    does to the partials, and it is `known`. Raises ValueError for fewer than two.
    """
    if number.size < 2:
        raise ValueError("one partial: two or more are needed for f0 and B")
    upper = _upper(number.size)
    j, ratio = number[upper].astype(np.float64), (frequency / number)[upper]
    slope, at_zero = median_line(j**2, ratio)
    b = 2 * slope / at_zero if known is None or number.size > FEW else known
    b = min(max(b, 0.0), MOST_B)
    at_zero = float(np.median(ratio / (1 + b * j**2 / 2)))
    law = Law(at_zero, b, 0.0, int(number[upper][0]))
    relative = frequency[upper] / law.frequency(number[upper]) - 1
    return replace(law, deviation=float(np.sqrt(np.mean(relative**2))))


@dataclass(frozen=True)
class Losses:
    """The terms of 1/Q, eq. 9."""

    diameter: float  # m, d_eq of eq. 10
    viscoelastic_angle: float  # delta_ve of eq. 11
    thermoelastic: float  # 1/Q_te
    conductance: tuple[tuple[float, float], ...]  # (Hz, m/s/N), Re Y_nut of eq. 9 at the partials; empty: none found


def fit_losses(string: String, neck: Neck, number: Ints, damping: Floats, deviation: Floats) -> Losses:
    """The losses of `string`, whose f0, B and tension are fitted already, from the dampings of partials `number`.

    damping, deviation (n,), 1/s. 1/Q is a sum of terms each proportional to one of the unknowns. What the neck takes is
    none of them and never negative: a partial above the law counts less than one below it, by `ENVELOPE`, so the law
    runs along the lower edge. What is left of 1/Q above it, where it is more than two deviations and a tenth, is the
    conductance of the neck at that partial. What the partials hardly tell, such as the thermoelastic term or, with few
    of them, delta_ve, stays near what `string` says.
    """
    # Hz: where modes.dampings evaluates the law
    nominal: Floats = number.astype(np.float64) * string.nominal_fundamental
    loss = damping / (math.pi * nominal)
    bare = replace(string, diameter=0.0, viscoelastic_angle=0.0, thermoelastic=0.0)
    unit = replace(neck, admittance=Admittance())

    def factor(s: String) -> Floats:
        return modes.loss_factor(speaking(s, unit, 0), nominal)

    constant = factor(bare)
    columns = np.stack([
        factor(replace(bare, diameter=string.diameter)) - constant,
        factor(replace(bare, viscoelastic_angle=ANGLE)) - constant,
        factor(replace(bare, thermoelastic=THERMOELASTIC_SPREAD)) - constant,
    ], axis=1)  # fmt: skip
    high = _upper(number.size)
    known = np.array([1.0, string.viscoelastic_angle / ANGLE, string.thermoelastic / THERMOELASTIC_SPREAD])
    x, misfit = known, 0.1
    for _ in range(3):
        spread = np.hypot(deviation / damping, misfit)[high]  # relative
        x = _envelope(columns[high], (loss - constant)[high], spread * loss[high], known)
        away = np.abs(loss - constant - columns @ x)[high] / loss[high]
        misfit = min(max(float(np.median(away)), LEAST_MISFIT), MOST_MISFIT)
    rest = loss - constant - columns @ x
    rest[(rest < 2 * deviation / damping * loss) | (rest < LEAST_SHARE * loss)] = 0.0
    conductance: tuple[tuple[float, float], ...] = ()
    if rest.any():
        last = int(np.flatnonzero(rest)[-1]) + 2  # one zero ends the table
        s = speaking(string, unit, 0)
        values = math.pi * nominal * rest / neck_damping(1.0, modes.impedance(s), s.fundamental)
        nu = modes.frequencies(s, int(number[-1]))[number - 1]
        conductance = tuple((float(f), float(y)) for f, y in zip(nu[:last], values, strict=False))
    return Losses(float(x[0] * string.diameter), float(x[1] * ANGLE), float(x[2] * THERMOELASTIC_SPREAD), conductance)


def _upper(count: int) -> NDArray[np.bool_]:
    """Which of `count` partials the laws are fitted to."""
    return np.arange(count) >= (count // 2 if count > FEW else 0)


def _envelope(columns: Floats, goal: Floats, spread: Floats, known: Floats) -> Floats:
    """x (3,) with columns @ x along the lower edge of `goal` (n,), given to within `spread`, and near `known` (3,)."""
    from scipy.optimize import lsq_linear

    prior = np.diag([1 / DIAMETER_SPREAD, 1 / ANGLE_SPREAD, 1.0])
    limits = ([0.5, 0.0, 0.0], [2.0, 50.0, 0.01 / THERMOELASTIC_SPREAD])  # delta_ve up to 0.5, as a preset allows
    weight, x = np.ones(goal.size), np.zeros(3)
    for _ in range(50):
        scale = np.sqrt(weight) / spread
        rows = np.vstack([columns * scale[:, None], prior])
        x = lsq_linear(rows, np.concatenate([goal * scale, prior @ known]), bounds=limits).x
        renewed = np.where(goal > columns @ x, ENVELOPE, 1.0)
        if np.array_equal(renewed, weight):
            break
        weight = renewed
    return x
