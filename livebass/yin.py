"""Fundamental frequency over time by YIN: A. de Cheveigne and H. Kawahara, J. Acoust. Soc. Am. 111 (2002), 1917-1930.

Steps 2 to 5 of the paper: the squared difference of the sound and itself, a lag later, summed over a window; divided by
its mean over all shorter lags; the first dip of it below a threshold; a parabola through its lowest three points. The
best local estimate (step 6) is left out: it smooths over time, and a glide is what is looked for here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

Floats = NDArray[np.float64]

THRESHOLD = 0.1  # of the normalised difference: a tenth of the power may be anything but periodic
CHUNK = 256  # frames at a time, which bounds the memory


@dataclass(frozen=True)
class Pitch:
    """The fundamental, frame by frame."""

    time_s: Floats  # (frames,), the middle of what the frame is computed from
    frequency_hz: Floats  # (frames,), NaN where no lag is below the threshold
    aperiodicity: Floats  # (frames,), the normalised difference at the lag found, or its least: 0 periodic, 1 noise


def fundamental(
    sound: Floats,
    rate: float,
    least: float = 25.0,
    most: float = 500.0,
    hop: float = 5e-3,
    window: float | None = None,
    threshold: float | None = THRESHOLD,
) -> Pitch:
    """Fundamental frequency of `sound` (n,), Hz, between `least` and `most` (Hz), every `hop` (s).

    window (s): over which the difference is summed, 1 / least if left out; a frame takes that and the longest lag.
    threshold None: the deepest of all dips counts, for sounds too rough for any threshold, and limits within an octave.
    Lags are multiples of a sample, refined to some thousandth of one. Raises ValueError for limits that are not
    0 < least < most < rate / 4, and for a sound shorter than one frame.
    """
    if not 0 < least < most < rate / 4:
        raise ValueError(f"pitch from {least:g} to {most:g} Hz: allowed is 0 < least < most < {rate / 4:g} Hz")
    longest, shortest = math.ceil(rate / least) + 1, max(2, math.floor(rate / most))
    width, step = max(2, round((window or 1 / least) * rate)), max(1, round(hop * rate))
    sound = np.asarray(sound, np.float64)
    if sound.size < width + longest:
        raise ValueError(f"{sound.size / rate:.3g} s of sound: at least {(width + longest) / rate:.3g} s are needed")
    frames = sliding_window_view(sound, width + longest)[::step]
    parts = [_lags(frames[i : i + CHUNK], width, longest, shortest, threshold) for i in range(0, len(frames), CHUNK)]
    lag, rest = (np.concatenate(column) for column in zip(*parts, strict=True))
    middle: Floats = (np.arange(len(frames), dtype=np.float64) * step + (width + longest) / 2) / rate
    return Pitch(middle, rate / lag, rest)


def relative_variation(frequency_hz: Floats, reference_hz: float) -> Floats:
    """(nu(t) - nu_r) / nu_r, as in figure 7 of Issanchou et al. (2018); nu_r is the first eigenfrequency there."""
    return (np.asarray(frequency_hz, np.float64) - reference_hz) / reference_hz


def _lags(frames: Floats, width: int, longest: int, shortest: int, threshold: float | None) -> tuple[Floats, Floats]:
    """Period in samples, NaN if there is none, and the normalised difference there, (frames,) each."""
    size = 1 << (frames.shape[1] + width - 1).bit_length()
    spectrum = np.fft.rfft(frames, size)
    cross = np.fft.irfft(spectrum * np.conj(np.fft.rfft(frames[:, :width], size)), size)[:, : longest + 1]
    running = np.cumsum(np.pad(frames**2, ((0, 0), (1, 0))), axis=1)
    energy = running[:, width : width + longest + 1] - running[:, : longest + 1]
    difference = np.maximum(energy[:, :1] + energy - 2 * cross, 0.0)  # eqs. 6 and 7
    difference[difference < 1e-12 * energy[:, :1]] = 0.0  # rounding
    mean = np.cumsum(difference[:, 1:], axis=1) / np.arange(1, longest + 1)
    normal = np.ones_like(difference)  # eq. 8
    np.divide(difference[:, 1:], mean, out=normal[:, 1:], where=mean > 0)
    lag, rest = np.full(len(frames), np.nan), np.ones(len(frames))
    for i, d in enumerate(normal):
        least = float(d[shortest:longest].min())
        below = np.flatnonzero(d[shortest:longest] <= least if threshold is None else d[shortest:longest] < threshold)
        if not below.size:
            rest[i] = least
            continue
        k = shortest + int(below[0])
        while k + 1 < longest and d[k + 1] < d[k]:
            k += 1
        bend = difference[i, k - 1] - 2 * difference[i, k] + difference[i, k + 1]
        lag[i] = k + (0.5 * (difference[i, k - 1] - difference[i, k + 1]) / bend if bend > 0 else 0.0)
        rest[i] = d[k]
    return lag, rest
