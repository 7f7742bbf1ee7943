"""The pitch of a sound, to a fraction of a cent."""

from __future__ import annotations

import math

import numpy as np

from livebass.rows.arrays import Floats


def pitch(sound: Floats, rate: int, expected: float) -> float:
    """Frequency (Hz) of the partial near `expected`, from the phases of two overlapping Hann windows.

    The partial's decay is measured the same way and taken out, so that the windows do not leak.
    """
    length = len(sound) * 2 // 3
    shift = len(sound) - length
    apart = shift / rate
    t = np.arange(len(sound)) / rate
    probe = np.hanning(length) * np.exp(-2j * math.pi * expected * t[:length])
    growth = 0.0
    for _ in range(4):
        still = sound * np.exp(growth * t)
        ratio = np.sum(still[shift:] * probe) / np.sum(still[:length] * probe)
        growth -= math.log(abs(ratio)) / apart
    turn = np.angle(ratio * np.exp(-2j * math.pi * expected * apart))
    return float(expected + turn / (2 * math.pi * apart))
