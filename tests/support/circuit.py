"""The circuit of a pickup and its digital filter, by numpy: the reference for kernels/pickup/coil.py."""

from __future__ import annotations

import numpy as np

from livebass.model.instrument import Coil
from livebass.rows.arrays import Complexes, Floats

ORDER = 3  # poles of the circuit
FITTED = 0.45  # of the sampling rate: the response is fitted up to here
LATE = 0.25  # samples of delay allowed in the fit


def analogue(coil: Coil) -> tuple[Floats, Floats]:
    """(numerator, denominator), each (4,), of output over induced voltage, in ascending powers of s.

    The coil (L, R) feeds three things in parallel: the volume pot, the cable's capacitance, and the tone branch: the
    open part of the tone pot in series with its capacitor.
    """
    tone_time = coil.tone_capacitor * coil.tone_pot * coil.tone  # s
    branch = np.array([1.0, tone_time])  # the admittance of the tone branch is s Ct / branch
    source = np.array([coil.resistance, coil.inductance])
    load = np.convolve([1.0 / coil.volume_pot, coil.capacitance], branch)
    load[1] += coil.tone_capacitor
    denominator = np.convolve(source, load)
    denominator[:2] += branch
    return np.pad(branch, (0, ORDER - 1)), denominator


def response(coil: Coil, frequency: Floats) -> Complexes:
    """Output over induced voltage at `frequency` (Hz, any shape), complex."""
    s = 2j * np.pi * frequency
    numerator, denominator = analogue(coil)
    return np.asarray(np.polyval(numerator[::-1], s) / np.polyval(denominator[::-1], s))


def digital(coil: Coil, rate: float) -> tuple[Floats, Floats]:
    """Coefficients (b, a), each (4,), a[0] = 1, of a filter at `rate` Hz with the circuit's poles and its response.

    The numerator is fitted by least squares of the relative error up to `FITTED` of the rate. There the response is
    within 0.7 dB of the circuit's (1.2 dB with the tone closed, far below the low notes) and `LATE` samples late. A
    bilinear transform would be 18 dB off.
    """
    poles = np.roots(analogue(coil)[1][::-1])
    a = np.zeros(ORDER + 1)
    monic = np.real(np.poly(np.exp(poles / rate)))
    a[: monic.size] = monic
    frequency = np.linspace(0, FITTED * rate, 400)
    delays = np.exp(-2j * np.pi * np.outer(frequency / rate, np.arange(ORDER + 1)))
    wanted = response(coil, frequency) * np.exp(-2j * np.pi * frequency / rate * LATE)
    relative = delays / (delays @ a * wanted)[:, None]
    matrix = np.concatenate([relative.real, relative.imag])
    b = np.linalg.lstsq(matrix, np.concatenate([np.ones(400), np.zeros(400)]), rcond=None)[0]
    return b, a
