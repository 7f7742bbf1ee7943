"""The noise floor: the power of a sound per Hz, and what is typical of noise."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from livebass.rows.arrays import Floats

FINEST = 1.0  # Hz between bins
SHAPE = 12.0  # of the Kaiser window: its side lobes lie 110 dB below a line


def density(sound: Floats, rate: float) -> tuple[Floats, Floats]:
    """Returns frequencies (bins,), Hz, at most FINEST apart, and the power per Hz there, of `sound` (n,)."""
    window = np.kaiser(sound.size, SHAPE)
    size = 1 << (max(sound.size, math.ceil(rate / FINEST)) - 1).bit_length()
    power = np.abs(np.fft.rfft(sound * window, size)) ** 2
    return np.arange(power.size) * rate / size, 2 * power / (rate * float(np.sum(window**2)))


def typical(power: ArrayLike) -> float:
    """Returns the mean power of noise by the median over bins, which single lines do not raise; 0 without any bin.

    The power of noise in a bin is exponentially distributed: its median is ln 2 of its mean.
    """
    values = np.asarray(power)
    return float(np.median(values)) / math.log(2) if values.size else 0.0
