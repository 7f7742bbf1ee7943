"""The glide of a note: a string pulled far begins sharp, and all its partials with it, in proportion.

The tension grows with the square of the motion and falls with it. A method that looks for damped sines then sees two in
each partial, always the same cents apart, which are no polarisations: the sharp one is heard first, and dies. So the
glide is measured on all partials at once and removed: the sound is played at a varying speed that makes them steady.
It is a sum of decaying exponentials, like the energy of a string.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from livebass.lab.identification.esprit import WIDTH, band
from livebass.lab.identification.lines import MAX_SAMPLES
from livebass.lab.identification.partials import Partial, Take
from livebass.rows.arrays import Floats
from livebass.rows.units import cents

MAX_PARTIALS = 30  # the strongest
FEWEST = 6  # partials needed for a glide
TIMES = (0.06, 0.1, 0.17, 0.3, 0.5, 0.9, 1.5)  # s, decay times (to 1/e) of its parts
LONGEST = 2.5  # s of the take examined
SHALLOW = 25.0  # dB down to which a partial is followed
SURE = 5.0  # standard deviations of the median over partials
MINIMUM = 0.2  # cents
ROUNDS = 10  # that alternate between the curve and the frequencies of the partials


@dataclass(frozen=True)
class Glide:
    """The sharpness of a take over time: a sum of frequency fractions, each with its decay time (to 1/e)."""

    parts: tuple[tuple[float, float], ...]  # (initial fraction of the frequency, s)

    @property
    def cents(self) -> float:
        """The initial sharpness in cents."""
        return float(cents(1 + sum(part for part, _ in self.parts)))

    def ahead(self, t: Floats) -> Floats:
        """Returns the lead (s) of a gliding string over a steady one after t (n,), s."""
        each = (part * time * (1 - np.exp(-t / time)) for part, time in self.parts)
        return np.asarray(sum(each, np.zeros(t.size)))


def glide_of(take: Take, partials: Sequence[Partial], f0: float) -> Glide | None:
    """Returns the glide that the `partials` of `take` share; None unless it is certain. Needs SciPy."""
    from scipy.optimize import nnls

    loud = sorted(partials, key=lambda p: -p.amplitude)[:MAX_PARTIALS]
    seen = [each for p in loud if (each := _deviation(take, p.frequency, f0)) is not None]
    if len(seen) < FEWEST:
        return None
    rate, taps = seen[0][1:]
    off = np.full((len(seen), max(each[0].size for each in seen)), np.nan)
    for row, (values, _, _) in zip(off, seen, strict=True):
        row[: values.size] = values
    off = off[:, np.count_nonzero(np.isfinite(off), axis=0) >= FEWEST]
    if off.shape[1] < FEWEST:
        return None
    curve = _common_curve(off)
    t = (np.arange(curve.size) + 0.5) / rate
    # the filter only multiplies an exponential by a factor
    lag = np.arange(taps.size) / take.rate
    times = [time for time in TIMES if time > lag[-1] / 2]  # the filter hides shorter ones
    shapes = np.array([np.exp(-t / time) * (taps @ np.exp(-lag / time)) / taps.sum() for time in times]).T
    parts = nnls(np.column_stack([shapes, np.ones(t.size), -np.ones(t.size)]), curve)[0][: len(times)]
    glide = Glide(tuple((float(a), time) for a, time in zip(parts, times, strict=True) if a > 0))
    shape = shapes @ parts
    if not glide.parts or glide.cents < MINIMUM:
        return None
    shares = np.array([_share(row, shape) for row in off])
    shares = shares[np.isfinite(shares)]
    middle = float(np.median(shares))
    spread = 1.4826 * float(np.median(np.abs(shares - middle))) * 1.25 / math.sqrt(shares.size)
    return glide if middle > SURE * spread else None


def _deviation(take: Take, frequency: float, f0: float) -> tuple[Floats, float, Floats] | None:
    """Relative deviations (n,) of the frequency of a partial, their rate (Hz), and the filter used."""
    b = band(take.sound, take.rate, frequency, WIDTH * f0, MAX_SAMPLES)
    if b is None:
        return None
    y = b.samples[: round(LONGEST * b.rate)]
    clear = np.abs(y) > np.abs(y[:3]).max() * 10 ** (-SHALLOW / 20)
    count = y.size if clear.all() else int(np.argmin(clear))
    if count < FEWEST:
        return None
    turned = np.angle(y[1:count] * np.conj(y[: count - 1])) * b.rate / (2 * math.pi)
    return turned / frequency, b.rate, np.abs(b.taps)


def _common_curve(off: Floats) -> Floats:
    """The curve (n,) common to deviations (partials, n), each up to a constant; NaN means no value."""
    curve = np.zeros(off.shape[1])
    for _ in range(ROUNDS):
        own = np.nanmedian(off - curve, axis=1, keepdims=True)
        curve = np.nanmedian(off - own, axis=0)
    return np.asarray(curve)


def _share(off: Floats, shape: Floats) -> float:
    """The share of the `shape` (n,) in the deviations of one partial; NaN if too short."""
    known = np.isfinite(off)
    near = shape[known] - shape[known].mean()
    return float(near @ off[known] / (near @ near)) if np.count_nonzero(known) >= FEWEST and near.any() else math.nan


def straighten(take: Take, glide: Glide) -> Take:
    """Returns `take` resampled so that it does not glide. Needs SciPy."""
    from scipy.interpolate import CubicSpline
    from scipy.signal import resample_poly

    fine = resample_poly(take.sound, 2, 1)
    t = np.arange(fine.size) / (2 * take.rate)
    steady = t + glide.ahead(t)
    at = np.arange(int(steady[-1] * take.rate)) / take.rate
    return replace(take, sound=np.asarray(CubicSpline(steady, fine)(at)))
