"""The lines of a partial: one damped sine, or two close ones, and the audible decay.

A string swings in two directions, up from the neck (u) and across it (v), and the neck damps one more than the other.
So a partial may have two lines, slightly apart in frequency, and one dies sooner: they beat, and after a quick
decay the slower one stays (G. Weinreich, J. Acoust. Soc. Am. 62 (1977), 1474-1484, on pianos). The faster one is
assigned to u, the slower to v, as necks give way more easily upwards.

The audible decay is the envelope: the damping of a partial is the slope of a straight line through its level in dB,
from the beginning of the take down to `DOWN` below or to the noise. If one damped sine explains the sound, its own
damping is used. Two are used if their error is less than `BETTER` of the error of one, in the mean of the relative
error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from livebass.lab.identification.esprit import WIDTH, Band, Component, band
from livebass.rows.arrays import Complexes, Floats

DOWN = 30.0  # dB down to which a decay is followed
CLEAR = 10.0  # dB over the noise
BETWEEN = 0.35, 0.65  # f0 from a partial: the noise is measured here
BEAT = 0.3  # s that a beat may hide a partial
FEWEST = 8  # samples of an envelope
MAX_SAMPLES = 4000  # of a band
BETTER = 0.5  # of the error of one line: two lines that leave more are not distinguished from one
EXPLAINED = 0.03  # relative error, of power, below which lines explain a partial ...
ALONE = 0.01  # ... and below which one line alone does
OVER_NOISE = 4.0  # ... or this multiple of the noise's share
TWIN = 0.04  # of f0: a sine this close to a partial belongs to it
TWIN_LEVEL = 30.0  # dB below the partial
MIN_DAMPING = 0.02  # 1/s: a sine that hardly decays is hum
MAX_CANDIDATES = 6  # damped sines; one or two are chosen
STEPS = 12  # of Gauss-Newton, at most


@dataclass(frozen=True)
class Line:
    """One damped sine of a partial."""

    frequency: float  # Hz, undamped
    damping: float  # 1/s
    amplitude: float  # at the beginning of the take, in units of the sound


@dataclass(frozen=True)
class Envelope:
    """The decay of a partial, in a band around it."""

    band: Band
    count: int  # samples down to DOWN, or to the noise
    damping: float  # 1/s, of the straight line through the level of these samples
    deviation: float  # 1/s, its standard deviation
    noise: float  # power of the noise over that of the partial, relative to the line, mean
    amplitude: float  # of the straight line, at the beginning of the take, in units of the sound

    @property
    def weights(self) -> Floats:
        """Factors (count,) that make the samples of a sound on the straight line all equal."""
        y = np.abs(self.band.samples[: self.count])
        rise = np.exp(self.damping * np.arange(self.count) / self.band.rate)
        return np.asarray(rise / math.exp(float(np.mean(np.log(np.maximum(y * rise, 1e-300))))))


@dataclass(frozen=True)
class Decay:
    """The lines of a partial and its audible damping."""

    u: Line  # the only line, or the one that dies sooner
    v: Line | None  # the one that stays
    damping: float  # 1/s, audible
    deviation: float  # 1/s, its standard deviation; 0: damping of the only line
    amplitude: float  # audible, at the beginning of the take, in units of the sound

    @property
    def loudest(self) -> Line:
        """The line with more energy."""
        lines = (self.u,) if self.v is None else (self.u, self.v)
        return max(lines, key=lambda line: line.amplitude**2 / line.damping)


def envelope(sound: Floats, rate: float, frequency: float, f0: float, late: Floats) -> Envelope | None:
    """Returns the decay of the partial at `frequency` (Hz) of a string of `f0` (Hz) in `sound` (n,); None if too short.

    `late` is the sound's `late_spectrum`. A partial that does not fall gets the least damping.
    """
    b = band(sound, rate, frequency, WIDTH * f0, MAX_SAMPLES)
    if b is None:
        return None
    level = 20 * np.log10(np.abs(b.samples) + 1e-300)
    noise = _noise(late, frequency, f0) * float(np.sum(np.abs(b.taps) ** 2))
    minimum = max(float(level[:3].max()) - DOWN, 10 * math.log10(noise + 1e-300) + CLEAR)
    count = until(level > minimum, max(3, round(BEAT * b.rate)))
    if count < FEWEST:
        return None
    t = np.arange(count) / b.rate
    slope, start = np.polyfit(t, level[:count], 1)
    damping = -slope * math.log(10) / 20
    off = level[:count] - (start + slope * t)
    gain = abs(complex(b.gain(np.array([complex(-damping, 2 * math.pi * frequency)]))[0]))
    independent = max(4.0, count * rate / b.rate / b.taps.size)  # samples within the filter are alike
    spread = math.log(10) / 20 * float(np.std(off)) * math.sqrt(12 / independent) / (t[-1] + 1 / b.rate)
    relative = noise * float(np.mean(np.exp(2 * damping * t))) * 10 ** (-float(np.mean(level[:3])) / 10)
    return Envelope(b, count, max(float(damping), MIN_DAMPING), spread, relative, 2 * 10 ** (start / 20) / gain)


def until(clear: np.ndarray, gap: int) -> int:
    """Returns the number of samples before `clear` (n,) is false for `gap` in a row: a beat is shorter."""
    missing = 0
    for k, good in enumerate(clear):
        missing = 0 if good else missing + 1
        if missing >= gap:
            return k + 1 - missing
    return len(clear) - missing


def late_spectrum(sound: Floats, rate: float) -> Floats:
    """Returns frequencies (Hz) and mean squares per sample, (2, bins), of the last third of `sound` (n,)."""
    late = sound[2 * sound.size // 3 :]
    window = np.hanning(late.size)
    power = np.abs(np.fft.rfft(late * window)) ** 2 / float(np.sum(window**2))
    return np.array([np.fft.rfftfreq(late.size, 1 / rate), power])


def _noise(late: Floats, frequency: float, f0: float) -> float:
    """Mean square of the noise per sample, from halfway to the next partials in a `late_spectrum`."""
    heard, power = late
    away = np.abs(heard - frequency) / f0
    beside = power[(away > BETWEEN[0]) & (away < BETWEEN[1])]
    return float(np.median(beside)) / math.log(2) if beside.size else 0.0  # the median of squares of noise


def decay(found: Component, near: Sequence[Component], seen: Envelope | None, f0: float) -> Decay:
    """Returns the lines of the partial `found`, chosen from it and the damped sines `near` it."""
    only = Decay(Line(found.frequency, found.damping, found.amplitude), None, found.damping, 0.0, found.amplitude)
    if seen is None:
        return only
    limit = 10 ** (-TWIN_LEVEL / 20)
    candidates: list[Component] = [found]
    for c in sorted(near, key=lambda c: -c.energy):
        beside = abs(c.frequency - found.frequency) < TWIN * f0 and c.amplitude > limit * found.amplitude
        alike = any(_alike(c, other, seen.band.rate / seen.count) for other in candidates)
        if beside and not alike and len(candidates) < MAX_CANDIDATES:
            candidates.append(c)
    problem = _Problem(seen)
    poles = [_pole(c.frequency, c.damping, seen.band.centre) for c in candidates]
    enough = max(EXPLAINED, OVER_NOISE * seen.noise)
    first = problem.error(np.array(poles[:1]))
    singles = [problem.refined(np.array([pole])) for pole in poles]
    one = min(singles, key=problem.error)
    if problem.error(one) < max(ALONE, OVER_NOISE * seen.noise):
        if first < enough:
            return only
        (line,) = problem.lines(one)
        return Decay(line, None, line.damping, seen.deviation, seen.amplitude)
    pairs = [np.array(pair) for pair in combinations(poles, 2)]
    pairs += [np.array([poles[0], complex(2 * poles[0].real, poles[0].imag)])]  # a second one, if none was seen
    pairs += [np.array([poles[0], complex(-seen.damping / 2, poles[0].imag)])]
    pairs = sorted(pairs, key=problem.error)[:2]
    two = min((problem.refined(pair) for pair in pairs), key=problem.error)
    left = problem.error(one), problem.error(two)
    lines = problem.lines(two)
    real = all(line.damping > MIN_DAMPING and line.amplitude > 0 for line in lines)
    real = real and abs(lines[0].frequency - lines[1].frequency) < TWIN * f0
    real = real and problem.weakest(two) > 10 ** (-TWIN_LEVEL / 20)
    if real and left[1] < BETTER * left[0]:
        u, v = sorted(lines, key=lambda line: -line.damping)
        heard = problem.heard(two) if left[1] < enough else seen.damping
        return Decay(u, v, heard, seen.deviation, seen.amplitude)
    if first < enough:
        return only
    return Decay(only.u, None, seen.damping, seen.deviation, seen.amplitude)


def _alike(a: Component, b: Component, resolution: float) -> bool:
    """True for damped sines that are the same in two bands."""
    return abs(a.frequency - b.frequency) < 0.1 * resolution and abs(math.log(a.damping / b.damping)) < 0.1


def _pole(frequency: float, damping: float, centre: float) -> complex:
    """Pole of a damped sine, 1/s, in a band around `centre` (Hz)."""
    omega = math.sqrt(max((2 * math.pi * frequency) ** 2 - damping**2, 0.0))
    return complex(-damping, omega - 2 * math.pi * centre)


class _Problem:
    """Damped sines in an envelope: poles s (k,), 1/s, whose best amplitudes follow by least squares."""

    def __init__(self, seen: Envelope) -> None:
        self.band, self.t = seen.band, np.arange(seen.count) / seen.band.rate
        self.weights = seen.weights
        self.goal = seen.band.samples[: seen.count] * self.weights
        self.size = float(np.sum(np.abs(self.goal) ** 2))

    def _solved(self, s: Complexes) -> tuple[Complexes, Complexes]:
        """Amplitudes (k,) and the remainder of the goal (n,)."""
        columns = np.exp(np.outer(self.t, s)) * self.weights[:, None]
        amplitude: Complexes = np.linalg.lstsq(columns, self.goal, rcond=1e-10)[0].astype(np.complex128)
        return amplitude, self.goal - columns @ amplitude

    def error(self, s: Complexes) -> float:
        """Returns the remaining power relative to the goal's."""
        return float(np.sum(np.abs(self._solved(s)[1]) ** 2)) / self.size

    def refined(self, s: Complexes) -> Complexes:
        """Returns `s` moved to the least error, by Gauss-Newton with Levenberg's damping."""
        damp, best = 1e-3, self.error(s)
        for _ in range(STEPS):
            amplitude, rest = self._solved(s)
            powers = np.exp(np.outer(self.t, s)) * self.weights[:, None]
            slopes = np.concatenate([powers * amplitude * self.t[:, None], powers], axis=1)
            size = np.linalg.norm(slopes, axis=0) + 1e-300
            gram = (slopes / size).conj().T @ (slopes / size)
            side = (slopes / size).conj().T @ rest
            step = np.linalg.solve(gram + damp * np.eye(size.size), side) / size
            moved = s + step[: s.size]
            moved = np.minimum(moved.real, -MIN_DAMPING / 2) + 1j * moved.imag
            error = self.error(moved)
            if error < best:
                gain, s, best, damp = best - error, moved, error, damp / 5
                if gain < 1e-6 * best:
                    break
            else:
                damp *= 10
                if damp > 1e3:
                    break
        return s

    def lines(self, s: Complexes) -> list[Line]:
        """Returns the lines of poles `s`."""
        amplitude = self._solved(s)[0]
        gain = np.abs(self.band.gain(s + 2j * np.pi * self.band.centre))
        return [
            Line(math.hypot(p.imag + 2 * math.pi * self.band.centre, p.real) / (2 * math.pi), -float(p.real), float(a))
            for p, a in zip(s, 2 * np.abs(amplitude) / np.maximum(gain, 1e-300), strict=True)
        ]

    def weakest(self, s: Complexes) -> float:
        """Returns the largest amplitude share that the weaker of two lines ever has."""
        each = np.abs(np.exp(np.outer(self.t, s)) * self._solved(s)[0])
        share = each / (each.sum(axis=1, keepdims=True) + 1e-300)
        return float(share.max(axis=0).min())

    def heard(self, s: Complexes) -> float:
        """Returns the damping (1/s) of the straight line through the level of lines `s`."""
        sound = np.exp(np.outer(self.t, s)) @ self._solved(s)[0]
        level = np.log(np.abs(sound) + 1e-300)
        return max(-float(np.polyfit(self.t, level, 1)[0]), MIN_DAMPING)
