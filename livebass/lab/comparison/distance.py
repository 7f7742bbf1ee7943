"""The distance of two notes: the mean difference of their levels over time and third octaves, in dB.

Levels are taken in Hann windows of 0.1 s, half a window apart, in third octaves from 40 Hz to 8 kHz, from the attack
on; anything fainter than 60 dB below the loudest counts as 60 dB below. The overall loudness of a note does not count;
with `equalized`, neither does the loudness of each band, and only the change in time remains.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from livebass.lab.comparison.measures import attack
from livebass.rows.arrays import Floats

WINDOW, HOP = 0.1, 0.05  # s
FLOOR = 60.0  # dB below the loudest
BANDS = 1000.0 * 2.0 ** (np.arange(-14, 10) / 3)  # Hz, centres of third octaves
SPANS = (1.0, 2.5)  # s, over which distances are given
FINEST = 2.0  # Hz between bins: the lowest band is 9 Hz wide


def shape(sound: Floats, rate: float, longest: float = SPANS[-1]) -> Floats:
    """Returns the levels (frames, bands), dB, 0 the loudest, of the first `longest` seconds of `sound` (n,).

    They begin with its attack; none is below -FLOOR. Raises ValueError below 0.1 s.
    """
    sound = sound[attack(sound, rate) :][: round(longest * rate) + 1]
    n, hop = round(WINDOW * rate), HOP * rate
    if sound.size < n:
        raise ValueError(f"{sound.size / rate:.3g} s of sound: at least {WINDOW:g} s are needed")
    count = 1 + int((sound.size - n) / hop + 1e-9)
    starts = np.round(np.arange(count) * hop).astype(np.int64)
    starts = starts[starts + n <= sound.size]
    size = 1 << (max(n, round(rate / FINEST)) - 1).bit_length()
    frames = sound[starts[:, None] + np.arange(n)] * np.hanning(n + 1)[:-1]
    power = np.abs(np.fft.rfft(frames, size)) ** 2 @ _shares(size, rate)
    return np.maximum(10 * np.log10(np.maximum(power / power.max(), 1e-30)), -FLOOR)


@lru_cache(4)
def _shares(size: int, rate: float) -> Floats:
    """Returns the share of each bin in each band, (bins, bands)."""
    edges = BANDS[:, None] * 2.0 ** (np.array([-1, 1]) / 6) * size / rate  # in bins, which extend half a bin each way
    low = np.arange(size // 2 + 1)[:, None] - 0.5
    inside = np.minimum(low + 1, edges[:, 1]) - np.maximum(low, edges[:, 0])
    return np.asarray(np.maximum(inside, 0.0))


def between(a: Floats, b: Floats, seconds: float = SPANS[0], equalized: bool = False) -> float:
    """Returns the distance of two notes' levels over `seconds`, dB; NaN if one is shorter."""
    count = 1 + int((seconds - WINDOW) / HOP + 1e-9)  # windows that end by then
    if min(len(a), len(b)) < count:
        return float("nan")
    off = a[:count] - b[:count]
    return float(np.mean(np.abs(off - (off.mean(axis=0) if equalized else off.mean()))))


def distance(
    a: Floats, b: Floats, rate: float, seconds: float = SPANS[0], *, other_rate: float | None = None,
    equalized: bool = False,
) -> float:  # fmt: skip
    """Returns the distance of two notes, `a` (n,) at `rate` Hz and `b` (m,) at `other_rate` or the same, dB.

    Compares `seconds` from the attack; `equalized`: ignores the level of each band. NaN if a note is shorter.
    """
    return between(shape(a, rate, seconds), shape(b, other_rate or rate, seconds), seconds, equalized)
