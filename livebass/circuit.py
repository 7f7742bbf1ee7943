"""Coil, cable, volume and tone pot as a digital filter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebass.instrument import Coil

Floats = NDArray[np.float64]
ORDER = 3


def analogue(coil: Coil) -> tuple[Floats, Floats]:
    """(numerator, denominator) of output over induced voltage, powers of s ascending.

    The coil (L, R) feeds, in parallel, the volume pot, the cable's capacitance, and the tone branch: what is left
    of the tone pot in series with its capacitor.
    """
    tone_time = coil.tone_capacitor * coil.tone_pot * coil.tone  # s
    branch = np.array([1.0, tone_time])  # tone branch admittance is s Ct / branch
    source = np.array([coil.resistance, coil.inductance])
    load = np.convolve([1.0 / coil.volume_pot, coil.capacitance], branch)
    load[1] += coil.tone_capacitor
    denominator = np.convolve(source, load)
    denominator[:2] += branch
    return np.pad(branch, (0, ORDER - 1)), denominator


def digital(coil: Coil, rate: float) -> tuple[Floats, Floats]:
    """(b, a), each (4,), a[0] = 1, by the bilinear transform at `rate` Hz, exact at the resonance."""
    numerator, denominator = analogue(coil)
    resonance = 1.0 / np.sqrt(coil.inductance * coil.capacitance)  # rad/s
    warp = min(resonance, 0.9 * np.pi * rate)
    c = warp / np.tan(warp / (2 * rate))  # s = c (1 - z^-1) / (1 + z^-1)
    b = bilinear(numerator, c)
    a = bilinear(denominator, c)
    return b / a[0], a / a[0]


def bilinear(powers: Floats, c: float) -> Floats:
    """Polynomial in s (ascending, degree `ORDER`) with s = c (1 - z^-1)/(1 + z^-1), times (1 + z^-1)^ORDER."""
    total = np.zeros(ORDER + 1)
    for k, value in enumerate(powers):
        term = np.array([value * c**k])
        for _ in range(k):
            term = np.convolve(term, [1.0, -1.0])
        for _ in range(ORDER - k):
            term = np.convolve(term, [1.0, 1.0])
        total += term
    return total
