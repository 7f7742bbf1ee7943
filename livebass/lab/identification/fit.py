"""Laws for the partials of an open string, and resonances of a neck that explain deviations from them.

Equation numbers: C. Issanchou et al. (2018). As in section 3.2 there, f0, B and the losses of eqs. 9 to 11 serve beyond
the measured partials. They are fitted to the higher ones, which the neck disturbs least.

A mode's loss beyond air, viscoelastic and thermoelastic losses goes into the neck and gives Re Y at the modes'
frequencies. A mode's distance from the law of the others gives Im Y there, less accurately. `fit_neck` seeks the fewest
resonances that explain both. Where the modes do not determine a Q, or the height of a peak between two of them, limits
and a prior decide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from livebass.lab.identification.partials import median_line
from livebass.model import modes
from livebass.model.instrument import STIFFNESS_LAWS, Neck, String, speaking, stretch_ratio
from livebass.model.neck import Admittance, Resonance, detuning, neck_damping
from livebass.rows.arrays import Complexes, Floats, Ints

FEW = 10  # up to so many partials, the laws are fitted to all of them
MAX_B = 0.01  # the limit of a preset
CLEARLY = 0.8  # ratio of misfits below which one law is better: a smaller gain may come from the neck
DIAMETER_SPREAD = 0.3  # of the base preset's diameter: standard deviation of the prior
ANGLE, ANGLE_SPREAD = 0.01, 0.5  # a delta_ve, and the prior's standard deviation as a multiple of it
THERMOELASTIC_SPREAD = 2e-5  # 1/Q, minimum standard deviation of the prior; else it equals the preset's value
MIN_SHARE = 0.1  # of 1/Q: a smaller remainder is not attributed to the neck
MIN_MISFIT, MAX_MISFIT = 0.01, 0.3  # limits of the law's relative error of 1/Q at a partial
ENVELOPE = 0.02  # weight of a partial above the law relative to one below: the neck only adds losses


@dataclass(frozen=True)
class Law:
    """nu_j as a function of j on a rigid neck: a law of model/modes.py with its f0 and B."""

    stiffness_law: str  # "hinged" or "paper"
    fundamental: float  # f0, Hz
    inharmonicity: float  # B, at least 0
    deviation: float  # relative, root mean square, over the fitted partials
    first: int  # the lowest partial fitted
    misfit: float  # relative, mean size, over all partials

    def frequency(self, j: Floats | Ints) -> Floats:
        """Returns nu_j (Hz) of partials j (n,)."""
        mode = np.asarray(j, np.float64)
        return np.asarray(mode * self.fundamental * stretch_ratio(self.stiffness_law, self.inharmonicity, mode))


def fit_laws(number: Ints, frequency: Floats, base: String) -> tuple[Law, Law]:
    """Fits both laws to partials `number` (n,) at `frequency` (n,), Hz; returns the better one first.

    That is the law of `base` unless the other's misfit over all partials is below `CLEARLY` times as large. With `FEW`
    partials or fewer the neck hides the effect of B, and B is taken from `base`. Raises ValueError for fewer than two
    partials.
    """
    few = number.size <= FEW
    known = base.inharmonicity if few else None
    mine, other = (
        fit_law(number, frequency, law, known)
        for law in sorted(STIFFNESS_LAWS, key=lambda law: law != base.stiffness_law)
    )
    return (other, mine) if not few and other.misfit < CLEARLY * mine.misfit else (mine, other)


def fit_law(number: Ints, frequency: Floats, law: str, known: float | None = None) -> Law:
    """Fits `law`, "hinged" or "paper", to partials `number` (n,) at `frequency` (n,), Hz.

    Takes medians over pairs of the upper half, because resonances of the neck pull single partials aside. B is `known`
    if given. Raises ValueError for fewer than two partials.
    """
    if number.size < 2:
        raise ValueError("one partial: two or more are needed for f0 and B")
    upper = _upper(number.size)
    j, ratio = number[upper].astype(np.float64), (frequency / number)[upper]
    # in j^2, nu_j / j is a straight line for one law, its square for the other
    power = 1 if law == "paper" else 2
    slope, at_zero = median_line(j**2, ratio**power)
    b = 2 / power * slope / at_zero if known is None else known
    b = min(max(b, 0.0), MAX_B)
    at_zero = float(np.median(ratio / stretch_ratio(law, b, j)))
    fitted = Law(law, at_zero, b, 0.0, int(number[upper][0]), 0.0)
    off = frequency / fitted.frequency(number) - 1
    deviation = float(np.sqrt(np.mean(off[upper] ** 2)))
    return replace(fitted, deviation=deviation, misfit=float(np.mean(np.abs(off))))


@dataclass(frozen=True)
class Losses:
    """Terms of 1/Q, eq. 9."""

    diameter: float  # m, d_eq of eq. 10
    viscoelastic_angle: float  # delta_ve of eq. 11
    thermoelastic: float  # 1/Q_te
    conductance: tuple[tuple[float, float], ...]  # (Hz, m/s/N), Re Y_nut of eq. 9 at the partials; empty: none found

    @property
    def admittance(self) -> Admittance:
        return Admittance(table=tuple((nu, y, 0.0) for nu, y in self.conductance))


def fit_losses(string: String, neck: Neck, number: Ints, damping: Floats, deviation: Floats) -> Losses:
    """Fits the losses of `string`, whose f0, B and tension are already fitted, to the dampings of partials `number`.

    number, damping, deviation (n,): damping and its standard deviation in 1/s. 1/Q is a sum of terms, each proportional
    to one unknown, plus the neck's, which is never negative: a partial above the law weighs less than one below, by
    `ENVELOPE`, and the law runs along the lower edge. The remainder of 1/Q above the law is the neck's conductance at
    that partial, if it exceeds two deviations and a tenth of 1/Q. Terms that the partials hardly determine, such as the
    thermoelastic one or, with few partials, delta_ve, stay near those of `string`. Needs SciPy.
    """
    s = speaking(string, replace(neck, admittance=Admittance()), 0)
    nominal = modes.law_frequencies(s, number.astype(np.float64), string.nominal_fundamental)
    loss = damping / (math.pi * nominal)
    bare = replace(s, diameter=0.0, viscoelastic_angle=0.0, thermoelastic=0.0)
    constant = modes.loss_factor(bare, nominal)
    columns = np.stack([
        modes.loss_factor(replace(bare, diameter=string.diameter), nominal) - constant,
        modes.loss_factor(replace(bare, viscoelastic_angle=ANGLE), nominal) - constant,
        modes.loss_factor(replace(bare, thermoelastic=THERMOELASTIC_SPREAD), nominal) - constant,
    ], axis=1)  # fmt: skip
    high = _upper(number.size)
    known = np.array([1.0, string.viscoelastic_angle / ANGLE, string.thermoelastic / THERMOELASTIC_SPREAD])
    x, misfit = known, 0.1
    for _ in range(3):
        spread = np.hypot(deviation / damping, misfit)[high]  # relative
        x = _envelope(columns[high], (loss - constant)[high], spread * loss[high], known)
        away = np.abs(loss - constant - columns @ x)[high] / loss[high]
        misfit = min(max(float(np.median(away)), MIN_MISFIT), MAX_MISFIT)
    rest = loss - constant - columns @ x
    rest[(rest < 2 * deviation / damping * loss) | (rest < MIN_SHARE * loss)] = 0.0
    conductance: tuple[tuple[float, float], ...] = ()
    if rest.any():
        last = int(np.flatnonzero(rest)[-1]) + 2  # one zero ends the table
        values = math.pi * nominal * rest / neck_damping(1.0, modes.impedance(s), s.fundamental)
        nu = modes.frequencies(s, int(number[-1]))[number - 1]
        conductance = tuple((float(f), float(y)) for f, y in zip(nu[:last], values, strict=False))
    return Losses(float(x[0] * string.diameter), float(x[1] * ANGLE), float(x[2] * THERMOELASTIC_SPREAD), conductance)


def _upper(count: int) -> NDArray[np.bool_]:
    """Mask (count,) of the partials used to fit the laws."""
    return np.arange(count) >= (count // 2 if count > FEW else 0)


def _envelope(columns: Floats, goal: Floats, spread: Floats, known: Floats) -> Floats:
    """x (3,), near `known` (3,), with columns @ x along the lower edge of `goal` (n,), whose deviation is `spread`."""
    from scipy.optimize import lsq_linear

    prior = np.diag([1 / DIAMETER_SPREAD, 1 / ANGLE_SPREAD, 1 / max(1.0, known[2])])
    limits = ([0.5, 0.0, 0.0], [2.0, 50.0, 0.01 / THERMOELASTIC_SPREAD])  # delta_ve up to 0.5, the limit of a preset
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


CLOSE = 0.065  # target for the relative misfit of the dampings, root mean square
MAXIMUM = 24  # resonances
SCATTER = 2e-4  # relative distance of modes from their law for reasons other than the neck
DEFAULT_QUALITY, TRIED = 30.0, (12.0, 20.0, 35.0, 60.0)  # Q, and the values tried for a new resonance
QUALITY = (8.0, 150.0)
MAX_CONDUCTANCE = 0.04  # m/s/N, of one resonance at its peak: the maximum of figure 3 (c)
OPEN = 0.05  # the misfit that a Q e times off the usual one counts as ...
PLACE = 0.01  # ... and a resonance one mode's distance off the nearest mode
EVALUATIONS = 400  # most misfits computed in a least-squares search: with fewer, rounding decides how many are found
KEPT = 0.1  # of the squared misfit: a given initial neck stays if refining it gains less
GRID = 6  # places tried per mode spacing


@dataclass(frozen=True)
class NeckFit:
    """Resonances at the nut, and the modes they were fitted to.

    A preset's stopped notes have their modes at the frequencies of its law, not at those measured on the open string:
    `played` and the distances from the string's own law show how well the neck serves there.
    """

    resonances: tuple[Resonance, ...]  # ascending in frequency, shapes 1, 2, 3 ...
    frequency: Floats  # (n,), Hz, of the modes
    damping: Floats  # (n,), 1/s, as given
    law: Floats  # (n,), 1/s, without the neck
    fitted: Floats  # (n,), 1/s, with it at the measured frequencies ...
    played: Floats  # (n,), 1/s, ... and at those of the string's law
    scatter: float  # distance of the modes from their law with best f0 and B, relative, root mean square ...
    left: float  # ... and without the neck's part of eq. 8
    own_scatter: float  # the same with the f0 and B of the string ...
    own_left: float  # ... and without the neck's part

    @property
    def deviation(self) -> float:
        """Relative misfit of the dampings, root mean square over the modes that lose to the neck."""
        return _deviation(self.fitted / self.damping - 1, self.damping > self.law)

    @property
    def deviation_played(self) -> float:
        """Relative misfit of `played`, root mean square over the modes that lose to the neck."""
        return _deviation(self.played / self.damping - 1, self.damping > self.law)

    @property
    def below(self) -> tuple[int, ...]:
        """Numbers of the modes damped less than by the law alone: a neck can only add losses."""
        return tuple(int(j) for j in np.flatnonzero(self.damping < self.law) + 1)


def fit_neck(
    string: String, close: float = CLOSE, maximum: int = MAXIMUM, start: tuple[Resonance, ...] = ()
) -> NeckFit:
    """Finds the fewest resonances, up to `maximum`, that meet the measured dampings of `string` to within `close`.

    `close` is relative, root mean square. Resonances are added one by one where they help most, with a least-squares
    refinement of all each time. The minimum is flat: different rounding leads to others, equally good. An initial neck
    `start` is kept if refining it gains less than `KEPT`, so a neck found once is found again. Raises ValueError for a
    string with fewer than four measured modes. Needs SciPy: pip install 'livebass[analysis]'.
    """
    if len(string.measured_dampings) < 4:
        raise ValueError(f"string {string.name}: {len(string.measured_dampings)} measured modes, 4 are needed")
    problem = _problem(string)
    x, dictionary = _logarithms(start), problem.dictionary()
    if start and problem.cost(refined := problem.refined(x)) < (1 - KEPT) * problem.cost(x):
        x = refined
    while len(x) < maximum and problem.deviation(x) > close:
        x = problem.refined(problem.with_another(x, dictionary))
    x = x[np.argsort(x[:, 0])]
    rows = np.exp(x).tolist()
    found = tuple(Resonance(f, q, q / (2 * math.pi * f * peak), k) for k, (f, q, peak) in enumerate(rows, 1))
    by_law = replace(string, measured_frequencies=(), measured_dampings=())
    rigid = speaking(by_law, rigid_neck(string), 0)
    yields = replace(rigid, admittance=Admittance(found))
    count = problem.nu.size
    own = (modes.frequencies(s, count) / problem.nu - 1 for s in (rigid, yields))
    spread = (*(problem.aside(y) for y in (x[:0], x)), *own)
    return NeckFit(
        found, problem.nu, problem.sigma, problem.law, problem.law + problem.neck(x), modes.dampings(yields, count),
        *(float(np.sqrt(np.mean(each**2))) for each in spread),
    )  # fmt: skip


def _logarithms(resonances: tuple[Resonance, ...]) -> Floats:
    """Returns `resonances` as the x of a `_Problem`."""
    rows = [(r.frequency, r.quality, r.quality / (2 * math.pi * r.frequency * r.mass)) for r in resonances]
    return np.log(np.array(rows).reshape(-1, 3))


@dataclass(frozen=True)
class _Problem:
    """Measured modes. x (resonances, 3) are logarithms of frequency (Hz), Q and Re Y at the peak (m/s/N)."""

    nu: Floats  # (n,), Hz
    sigma: Floats  # (n,), 1/s
    law: Floats  # (n,), 1/s
    fundamental: float  # Hz
    impedance: float  # kg/s
    stiffness_law: str

    @cached_property
    def number(self) -> Floats:
        return np.arange(1.0, self.nu.size + 1)

    @cached_property
    def lines(self) -> Floats:
        """An orthonormal basis of the straight lines over j^2, (n, 2)."""
        return np.linalg.qr(np.stack([np.ones(self.nu.size), self.number**2], axis=1))[0]

    def neck(self, x: Floats) -> Floats:
        """Damping added by the neck, (n,), 1/s."""
        return neck_damping(_admittance(x, self.nu), self.impedance, self.fundamental)

    def misfit(self, x: Floats) -> Floats:
        """Misfit of the dampings, (n,), relative; for a mode damped less than the law, no loss of the neck is best."""
        return np.asarray((self.law + self.neck(x) - np.maximum(self.sigma, self.law)) / self.sigma)

    def deviation(self, x: Floats) -> float:
        return _deviation(self.misfit(x), self.sigma > self.law)

    def aside(self, x: Floats) -> Floats:
        """Distance of the modes from their best law, (n,), relative, without the neck's part."""
        harmonic = self.number * self.fundamental
        off = self.nu / harmonic - detuning(_admittance(x, harmonic), self.impedance, self.number)
        power = 1 if self.stiffness_law == "paper" else 2  # of `off`, which is a straight line over j^2
        off = off**power / power
        return np.asarray(off - self.lines @ (self.lines.T @ off))

    def misfits(self, x: Floats) -> Floats:
        """Misfits of dampings and frequencies, (2 n,), both scaled like dampings."""
        return np.concatenate([self.misfit(x), self.aside(x) * CLOSE / SCATTER])

    def cost(self, x: Floats) -> float:
        """The sum of squares that the least-squares search minimises."""
        return float(np.sum(self.misfits(x) ** 2) + np.sum(self.prior(x) ** 2))

    def dictionary(self) -> tuple[Floats, Floats]:
        """Resonances at all places and Qs tried, (m, 3), and the misfits that 1 m/s/N of each adds, (m, 2 n)."""
        places = np.arange(self.nu[0], self.nu[-1], self.nu[0] / GRID)
        units = np.array([[math.log(f), math.log(q), 0.0] for f in places for q in TRIED])
        none = self.misfits(units[:0])
        return units, np.array([self.misfits(unit[None]) - none for unit in units])

    def with_another(self, x: Floats, dictionary: tuple[Floats, Floats]) -> Floats:
        """x plus the resonance of the dictionary that, at its best strength, leaves the least misfit."""
        units, columns = dictionary
        rest = self.misfits(x)
        strength = np.clip(-(columns @ rest) / np.sum(columns**2, axis=1), 1e-9, MAX_CONDUCTANCE)
        best = int(np.argmin(np.sum((rest + strength[:, None] * columns) ** 2, axis=1)))
        return np.vstack([x, units[best] + [0.0, 0.0, math.log(strength[best])]])

    def refined(self, x: Floats) -> Floats:
        """x moved to the least misfit."""
        from scipy.optimize import least_squares

        low = np.log([0.9 * self.nu[0], QUALITY[0], 1e-10])
        high = np.log([1.05 * self.nu[-1], QUALITY[1], MAX_CONDUCTANCE])
        ends = np.tile(low, len(x)), np.tile(high, len(x))

        def residuals(flat: Floats) -> Floats:
            each = flat.reshape(-1, 3)
            return np.concatenate([self.misfits(each), self.prior(each)])

        start = np.clip(x.ravel(), ends[0] + 1e-6, ends[1] - 1e-6)
        return np.asarray(least_squares(residuals, start, bounds=ends, max_nfev=EVALUATIONS).x.reshape(-1, 3))

    def prior(self, x: Floats) -> Floats:
        """Misfits of Q from the usual one, and of resonances from the nearest mode, which the modes leave open."""
        away = np.min(np.abs(np.exp(x[:, :1]) - self.nu), axis=1) / self.nu[0]
        return np.concatenate([OPEN * (x[:, 1] - math.log(DEFAULT_QUALITY)), PLACE * away])


def rigid_neck(string: String) -> Neck:
    """Returns a rigid neck with any frets: an open string touches none."""
    return Neck((string.length / 2,), (-1.0,))


def _problem(string: String) -> _Problem:
    nu, sigma = np.array(string.measured_frequencies), np.array(string.measured_dampings)
    s = speaking(string, rigid_neck(string), 0)
    nominal = modes.law_frequencies(s, np.arange(1.0, nu.size + 1), string.nominal_fundamental)
    law = math.pi * nominal * modes.loss_factor(s, nominal)
    return _Problem(nu, sigma, law, s.fundamental, modes.impedance(s), string.stiffness_law)


def _admittance(x: Floats, nu: Floats) -> Complexes:
    """Y at nu (n,), Hz: a resonance is its peak over 1 + i Q (nu / nu_r - nu_r / nu)."""
    f, q, peak = np.exp(x).T[:, :, None]
    return np.asarray(np.sum(peak / (1 + 1j * q * (nu / f - f / nu)), axis=0))


def _deviation(misfit: Floats, which: NDArray[np.bool_]) -> float:
    return float(np.sqrt(np.mean(misfit[which] ** 2))) if which.any() else 0.0
