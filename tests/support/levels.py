"""Levels of sounds, and sounds to measure them by."""

from __future__ import annotations

import numpy as np

from livebass.rows.arrays import Floats


def rms(sound: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(sound, dtype=np.float64))))


def db(ratio: float) -> float:
    """20 log10 of an amplitude ratio; silence is -600 dB."""
    return float(20 * np.log10(max(ratio, 1e-30)))


def sine(hertz: float, seconds: float, rate: int = 48_000, amplitude: float = 1.0) -> Floats:
    return amplitude * np.sin(2 * np.pi * hertz * np.arange(round(seconds * rate)) / rate)
