"""Phrases built to have known ends, ghost notes and sounds between notes."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from livebass.rows.arrays import Floats

RATE = 48_000
BEAT = 0.5  # s


@cache  # phrases have few notes, many times
def plucked(f0: float, held: float, end: float, seconds: float = BEAT, t60: float = 6.0) -> Floats:
    """A note with a bright attack that falls by `end` dB/s after `held` (s); its first 0.15 s have a level of 0 dB."""
    t = np.arange(round(seconds * RATE)) / RATE
    sound = sum(np.sin(2 * math.pi * j * f0 * t + j) / j**1.5 for j in range(1, 12))
    sound = sound + 0.5 * np.exp(-t / 0.02) * sum(np.sin(2 * math.pi * j * f0 * t + j**2) for j in range(12, 40)) / 10
    sound = sound * 10 ** (-3 * t / t60)
    sound /= math.sqrt(float(np.mean(sound[: round(0.15 * RATE)] ** 2)))
    sound *= 10 ** (-end * np.maximum(t - held, 0) / 20)
    sound.flags.writeable = False
    return sound


@cache
def burst(low: float, high: float, seconds: float, level_db: float, seed: int = 3) -> Floats:
    """Noise of a band that swells and fades; its loudest 20 ms have this level."""
    n = round(seconds * RATE)
    spectrum = np.fft.rfft(np.random.default_rng(seed).normal(size=n))
    nu = np.fft.rfftfreq(n, 1 / RATE)
    sound = np.fft.irfft(np.where((nu > low) & (nu < high), spectrum, 0), n) * np.hanning(n)
    power = np.convolve(sound**2, np.ones(round(0.02 * RATE)) / round(0.02 * RATE), "same")
    sound *= 10 ** (level_db / 20) / math.sqrt(float(power.max()))
    sound.flags.writeable = False
    return sound


def add(sound: Floats, at: float, part: Floats) -> None:
    first = round(at * RATE)
    sound[first : first + part.size] += part[: sound.size - first]


def phrase(
    end: float = 500.0, levels: tuple[float, ...] = (0.0,) * 8, knock: float | None = None,
    ghosts: float | None = None, placed: float | None = None, f0: float = 55.0, floor: float = -75.0,
) -> Floats:  # fmt: skip
    """Notes on every beat, held for half of it; with knocks at their ends, ghost notes, or fingers placed between."""
    sound = 10 ** (floor / 20) * np.random.default_rng(1).normal(size=round(BEAT * len(levels) * RATE))
    for k, level in enumerate(levels):
        at = k * BEAT + 0.02
        add(sound, at, 10 ** (level / 20) * plucked(f0, 0.25, end))
        if knock is not None:
            add(sound, at + 0.245, burst(1500, 4000, 0.05, knock, k))
        if ghosts is not None:
            t = np.arange(round(0.1 * RATE)) / RATE
            ghost = np.exp(-t / 0.012) * np.sin(2 * math.pi * 900 * t)
            ghost *= 10 ** (ghosts / 20) / math.sqrt(float(np.mean(ghost[: round(0.02 * RATE)] ** 2)))
            add(sound, at + 0.38, ghost)
        if placed is not None:
            add(sound, at + 0.36, burst(1200, 2800, 0.09, placed, k))
    return 0.1 * sound
