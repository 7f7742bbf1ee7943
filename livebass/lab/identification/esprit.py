"""Damped sines in a band of a sound: the band is cut out exactly, and ESPRIT finds the sines.

A sum of damped exponentials z_k^n makes a Hankel matrix whose column space, read one row lower, is itself times a small
matrix with the eigenvalues z_k: R. Roy, A. Paulraj and T. Kailath, IEEE Trans. Acoust. Speech Signal Process. 34
(1986), 1340-1342. Their number is the one that satisfies this best, ESTER: R. Badeau, B. David and G. Richard, IEEE
Trans. Signal Process. 54 (2006), 450-458.

A band is cut out by shifting its centre to 0 Hz, filtering, and decimating. Only samples whose filter lies within the
sound are used: an exponential leaves it as the same exponential times a known factor, so the filter adds no error at
the beginning of the note.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from livebass.rows.arrays import Complexes, Floats

WIDTH = 1.6  # rate of a band, in fundamentals: neighbours fall where the filter rejects them
SAMPLES = 200  # of a band at most: a Hankel matrix of 100 by 101
PASS, STOP = 0.125, 0.5  # edges of the filter's transition, in sampling rates of the band
USABLE = 0.35  # in sampling rates of the band: farther from the centre, a line may be an alias
REJECTION = 100.0  # dB beyond STOP
BANDWIDTH = PASS + STOP  # of noise through the filter, in sampling rates of the band
MAX_ORDER = 16  # exponentials in a band
FLATNESS = 0.1  # the order is the largest with a tenth of the best merit: one exponential too many does little harm


@dataclass(frozen=True)
class Band:
    """A band of a sound, shifted to 0 Hz."""

    samples: Complexes  # (n,), the first is from the first `taps.size` samples of the sound
    rate: float  # Hz, of these samples
    centre: float  # Hz, now at 0 Hz
    taps: Complexes  # of the filter, before the shift
    sound_rate: float  # Hz

    def gain(self, s: Complexes) -> Complexes:
        """Returns the filter's gains for exp(s t) in the sound; s (k,), 1/s."""
        return np.exp(np.outer(s / self.sound_rate, np.arange(self.taps.size))) @ self.taps


@dataclass(frozen=True)
class Component:
    """One damped sine, a exp(-damping t) cos(2 pi frequency t + phase) from the first sample of the sound."""

    frequency: float  # Hz, undamped: omega^2 = omega_d^2 + sigma^2, as in eq. 4
    damping: float  # 1/s
    amplitude: float  # a, in units of the sound
    energy: float  # sum of its squared samples in the band, over the mean square of the noise
    frequency_sd: float  # Hz, Cramer-Rao bound with the noise found
    damping_sd: float  # 1/s


def shortest(width: float) -> float:
    """Returns the filter length (s) for a band `width` Hz wide: a shorter sound gives no sample."""
    return (REJECTION - 8) / (2.285 * 2 * math.pi * (STOP - PASS) * width)


def band(sound: Floats, rate: float, centre: float, width: float, maximum: int = SAMPLES) -> Band | None:
    """Cuts the band around `centre` (Hz) out of `sound` (n,), at a rate of about `width` (Hz).

    The samples are the first of the sound, `maximum` at most; half of `width` passes with little loss. None if the
    sound is too short for a single sample.
    """
    count = math.ceil(shortest(width) * rate) | 1
    if sound.size < count:
        return None
    step = max(1, math.floor(rate / width))
    taps = _low_pass(count, step) * np.exp(-2j * np.pi * centre / rate * np.arange(count))
    samples = _decimate(sound, taps, step, maximum)
    turn = np.exp(-2j * np.pi * centre / rate * step * np.arange(samples.size))
    return Band(samples * turn, rate / step, centre, taps, rate)


@lru_cache(maxsize=16)
def _low_pass(count: int, step: int) -> Floats:
    """The filter (count,) before one sample of `step` is taken; its sum is 1."""
    cutoff = (PASS + STOP) / step  # of both sides together, in cycles a sample
    low = np.sinc(cutoff * (np.arange(count) - (count - 1) / 2)) * np.kaiser(count, 0.1102 * (REJECTION - 8.7))
    return np.asarray(low / low.sum())


def _decimate(sound: Floats, taps: Complexes, step: int, maximum: int) -> Complexes:
    """Sums of `taps` times `sound`, from every `step`th sample on, as a product of matrices with rows of `step`."""
    size, parts = min(maximum, (sound.size - taps.size) // step + 1), -(-taps.size // step)
    rows, filters = np.zeros((size + parts - 1, step)), np.zeros((parts, step), np.complex128)
    rows.flat[: sound.size] = sound[: rows.size]
    filters.flat[: taps.size] = taps
    products = rows @ filters.T
    return np.asarray(sum(products[k : k + size, k] for k in range(parts)))


def components(b: Band) -> list[Component]:
    """Finds the damped sines in the usable part of a band, strongest first; drops growing ones."""
    y = b.samples
    if y.size < 8:
        return []
    hankel = sliding_window_view(y, y.size // 2).T
    vectors = np.linalg.svd(hankel, full_matrices=False)[0]
    turn = _invariance(vectors, order(vectors))[0]
    z = np.linalg.eigvals(turn)
    z = z[np.abs(z) > 1e-6]
    n = np.arange(y.size)
    powers = z[None, :] ** n[:, None]
    scale = np.sqrt(np.sum(np.abs(powers) ** 2, axis=0))  # growing ones would spoil the least squares
    amplitude = np.linalg.lstsq(powers / scale, y, rcond=None)[0] / scale
    rest = y - powers @ amplitude
    spare = max(1.0, y.size - 2 * z.size)
    noise = max(float(np.sum(np.abs(rest) ** 2)) / spare / BANDWIDTH, 1e-30 * float(np.max(np.abs(y))) ** 2, 1e-300)
    deviation = _deviations(powers, amplitude, noise) * b.rate
    s = np.log(z) * b.rate  # 1/s
    heard = np.abs(amplitude) / np.maximum(np.abs(b.gain(s + 2j * np.pi * b.centre)), 1e-300)
    found = []
    for k in range(z.size):
        if s[k].real < 0 and abs(s[k].imag) < 2 * math.pi * USABLE * b.rate:
            damped = s[k].imag + 2 * math.pi * b.centre
            frequency, sigma = math.hypot(damped, s[k].real) / (2 * math.pi), -float(s[k].real)
            energy = float(np.sum(np.abs(powers[:, k] * amplitude[k]) ** 2)) / noise
            sd = float(deviation[k])
            found.append(Component(frequency, sigma, 2 * float(heard[k]), energy, sd / (2 * math.pi), sd))
    return sorted(found, key=lambda c: -c.energy)


def order(vectors: Complexes) -> int:
    """Returns the number of exponentials, by ESTER, from left singular vectors (rows, columns) of the Hankel matrix."""
    maximum = min(MAX_ORDER, vectors.shape[0] // 3)
    merit = np.array([1 / max(_invariance(vectors, p)[1], 1e-30) ** 2 for p in range(1, maximum + 1)])
    return 1 + int(np.flatnonzero(merit >= FLATNESS * merit.max())[-1])


def _invariance(vectors: Complexes, p: int) -> tuple[Complexes, float]:
    """The matrix that maps the first p vectors to themselves one row lower, by least squares, and its error's norm."""
    above, below, last = vectors[:-1, :p], vectors[1:, :p], vectors[-1, :p]
    turn: Complexes = above.conj().T @ below
    # The vectors are orthonormal, so the normal equations have the matrix 1 - last^H last
    turn = turn + np.outer(last.conj(), last @ turn) / max(1 - float(np.vdot(last, last).real), 1e-30)
    error = below - above @ turn
    return turn, math.sqrt(max(float(np.linalg.eigvalsh(error.conj().T @ error)[-1]), 0.0))


def _deviations(powers: Complexes, amplitude: Complexes, noise: float) -> Floats:
    """Standard deviations of the real and of the imaginary part of ln z, (components,): the Cramer-Rao bound."""
    n = np.arange(len(powers))[:, None]
    slopes = np.concatenate([powers, powers * amplitude * n], axis=1)
    size = np.linalg.norm(slopes, axis=0) + 1e-300
    covariance = np.linalg.pinv((slopes / size).conj().T @ (slopes / size), hermitian=True)
    variance = np.real(np.diag(covariance)) / size**2 * noise / 2
    return np.sqrt(np.maximum(variance[amplitude.size :], 0.0))
