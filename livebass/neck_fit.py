"""Resonances of a neck from the modes of a string on it, by eqs. 8 and 9 of Issanchou et al. (2018).

What a mode loses beyond air, viscoelastic and thermoelastic losses it loses to the neck: that gives Re Y at the
frequencies of the modes. How far it lies off the law of the others gives Im Y there, less surely. Few resonances are
sought that do both. Where modes leave a Q open, or how high a peak between two of them is, limits and a prior decide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass import modes
from livebass.admittance import Resonance, detuning, neck_damping
from livebass.instrument import Neck, String, speaking

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

CLOSE = 0.065  # relative: how well the dampings are to be met, root mean square
MOST = 24  # resonances
SCATTER = 2e-4  # relative: modes lie off their law by so much for other reasons
USUAL_QUALITY, TRIED = 30.0, (12.0, 20.0, 35.0, 60.0)  # Q, and those tried for a new resonance
QUALITY = (8.0, 150.0)
MOST_CONDUCTANCE = 0.04  # m/s/N, of one resonance at its peak: as high as figure 3 (c) goes
OPEN = 0.05  # what a Q e times off the usual one counts as, of misfit ...
PLACE = 0.01  # ... and a resonance a mode's distance off the nearest mode
GRID = 6  # places tried from one mode to the next


@dataclass(frozen=True)
class NeckFit:
    """Resonances at the nut, and how well they meet the modes they were fitted to."""

    resonances: tuple[Resonance, ...]  # ascending in frequency, shapes 1, 2, 3 ...
    frequency: Floats  # (n,), Hz, of the modes
    damping: Floats  # (n,), 1/s, as given
    law: Floats  # (n,), 1/s, without the neck
    fitted: Floats  # (n,), 1/s, with it
    scatter: float  # relative, root mean square: how far the modes lie off f0 (1 + B j^2 / 2) with best f0 and B ...
    left: float  # ... and how far with the neck's part of eq. 8 taken out

    @property
    def deviation(self) -> float:
        """Root mean square of the relative misfit of the dampings, of those modes that lose to the neck at all."""
        return _deviation(self.fitted / self.damping - 1, self.damping > self.law)

    @property
    def below(self) -> tuple[int, ...]:
        """Modes damped less than the law alone has it: no neck, which only takes, can meet these."""
        return tuple(int(j) for j in np.flatnonzero(self.damping < self.law) + 1)


def fit_neck(string: String, close: float = CLOSE, most: int = MOST) -> NeckFit:
    """The fewest resonances, up to `most`, that meet the measured dampings of `string` to within `close`.

    One after the other is added where it helps most, and all are refined by least squares each time. Raises ValueError
    for a string with fewer than four measured modes. Needs SciPy: pip install 'livebass[analysis]'.
    """
    if len(string.measured_dampings) < 4:
        raise ValueError(f"string {string.name}: {len(string.measured_dampings)} measured modes, 4 are needed")
    problem = _problem(string)
    x, dictionary = np.zeros((0, 3)), problem.dictionary()
    while len(x) < most and problem.deviation(x) > close:
        x = problem.refined(problem.with_another(x, dictionary))
    x = x[np.argsort(x[:, 0])]
    rows = np.exp(x).tolist()
    found = tuple(Resonance(f, q, q / (2 * math.pi * f * peak), k) for k, (f, q, peak) in enumerate(rows, 1))
    scatter, left = (float(np.sqrt(np.mean(problem.aside(y) ** 2))) for y in (x[:0], x))
    return NeckFit(found, problem.nu, problem.sigma, problem.law, problem.law + problem.neck(x), scatter, left)


@dataclass(frozen=True)
class _Problem:
    """x (resonances, 3): logarithms of frequency (Hz), Q and Re Y at the peak (m/s/N)."""

    nu: Floats  # (n,), Hz
    sigma: Floats  # (n,), 1/s
    law: Floats  # (n,), 1/s
    fundamental: float  # Hz
    impedance: float  # kg/s

    @property
    def number(self) -> Floats:
        return np.arange(1.0, self.nu.size + 1)

    def neck(self, x: Floats) -> Floats:
        """What the neck adds to sigma, (n,), 1/s."""
        return neck_damping(_admittance(x, self.nu), self.impedance, self.fundamental)

    def misfit(self, x: Floats) -> Floats:
        """Relative, (n,); a mode the neck cannot meet, damped less than the law, asks for none of it."""
        return np.asarray((self.law + self.neck(x) - np.maximum(self.sigma, self.law)) / self.sigma)

    def deviation(self, x: Floats) -> float:
        return _deviation(self.misfit(x), self.sigma > self.law)

    def aside(self, x: Floats) -> Floats:
        """Relative, (n,): how far the modes lie off their best law, with the neck's part taken out."""
        harmonic = self.number * self.fundamental
        off = self.nu / harmonic - detuning(_admittance(x, harmonic), self.impedance, self.number)
        basis, _ = np.linalg.qr(np.stack([np.ones(off.size), self.number**2], axis=1))
        return np.asarray(off - basis @ (basis.T @ off))

    def misfits(self, x: Floats) -> Floats:
        """Of dampings and frequencies, (2 n,), as many times their scatter."""
        return np.concatenate([self.misfit(x), self.aside(x) * CLOSE / SCATTER])

    def dictionary(self) -> tuple[Floats, Floats]:
        """Resonances of all places and some Qs, (m, 3), and what 1 m/s/N of each adds to the misfits, (m, 2 n)."""
        places = np.arange(self.nu[0], self.nu[-1], self.nu[0] / GRID)
        units = np.array([[math.log(f), math.log(q), 0.0] for f in places for q in TRIED])
        none = self.misfits(units[:0])
        return units, np.array([self.misfits(unit[None]) - none for unit in units])

    def with_another(self, x: Floats, dictionary: tuple[Floats, Floats]) -> Floats:
        """The resonance of the dictionary that, as strong as is best, leaves least."""
        units, columns = dictionary
        rest = self.misfits(x)
        strength = np.clip(-(columns @ rest) / np.sum(columns**2, axis=1), 1e-9, MOST_CONDUCTANCE)
        best = int(np.argmin(np.sum((rest + strength[:, None] * columns) ** 2, axis=1)))
        return np.vstack([x, units[best] + [0.0, 0.0, math.log(strength[best])]])

    def refined(self, x: Floats) -> Floats:
        """All of them moved to where they leave least."""
        from scipy.optimize import least_squares

        low = np.log([0.9 * self.nu[0], QUALITY[0], 1e-10])
        high = np.log([1.05 * self.nu[-1], QUALITY[1], MOST_CONDUCTANCE])
        ends = np.tile(low, len(x)), np.tile(high, len(x))

        def residuals(flat: Floats) -> Floats:
            each = flat.reshape(-1, 3)
            return np.concatenate([self.misfits(each), self.prior(each)])

        start = np.clip(x.ravel(), ends[0] + 1e-6, ends[1] - 1e-6)
        return np.asarray(least_squares(residuals, start, bounds=ends, max_nfev=60).x.reshape(-1, 3))

    def prior(self, x: Floats) -> Floats:
        """Q near the usual one; and resonances near modes, which are all the string tells of."""
        away = np.min(np.abs(np.exp(x[:, :1]) - self.nu), axis=1) / self.nu[0]
        return np.concatenate([OPEN * (x[:, 1] - math.log(USUAL_QUALITY)), PLACE * away])


def _problem(string: String) -> _Problem:
    nu, sigma = np.array(string.measured_frequencies), np.array(string.measured_dampings)
    rigid = Neck((string.length / 2,), (-1.0,))  # any frets: the open string has none
    s = speaking(string, rigid, 0)
    nominal: Floats = np.arange(1.0, nu.size + 1) * string.nominal_fundamental  # as modes.dampings has it
    return _Problem(nu, sigma, math.pi * nominal * modes.loss_factor(s, nominal), s.fundamental, modes.impedance(s))


def _admittance(x: Floats, nu: Floats) -> Complexes:
    """Y at nu (n,), Hz: a resonance is its peak over 1 + i Q (nu / nu_r - nu_r / nu)."""
    f, q, peak = np.exp(x).T[:, :, None]
    return np.asarray(np.sum(peak / (1 + 1j * q * (nu / f - f / nu)), axis=0))


def _deviation(misfit: Floats, which: NDArray[np.bool_]) -> float:
    return float(np.sqrt(np.mean(misfit[which] ** 2))) if which.any() else 0.0
