"""The partials of a plucked string in a sound: numbered, one after the other, each in a band that fits its decay.

Partial j is looked for near j f0 (1 + B j^2 / 2), eq. 8 of C. Issanchou et al. (2018), with f0 and B from the partials
found before it. Some may be missing, where the string was plucked or is heard at a node.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from livebass.esprit import Component, band, components, shortest

Floats = NDArray[np.float64]

WIDTH = 1.6  # rate of a band, in fundamentals: neighbours fall where the filter rejects them
SCALES = (0.25, 0.5, 1.0, 2.0, 4.0)  # bands are so many times as wide
FIT = 25.0  # scale that suits a decay, in damping / f0: SAMPLES then last about five decay times
NEAR = 0.15  # of f0: a partial is not farther from where it is expected
TWIN = 0.04  # of f0: what is so near to a partial belongs to it, as the string's other polarisation does
TWIN_LEVEL = 30.0  # dB below the partial
LEAST_ENERGY = 60.0  # over the noise of a sample; noise alone reaches about 20
FAINTEST = 85.0  # dB below the peak of the sound: what a band lets through of the rest is less
LEAST_DAMPING = 0.02  # 1/s: what hardly decays is hum
MOST_UNSURE = 0.2  # standard deviation over damping: what is known less well is not known
MISSING = 8  # so many missing ones in a row are the end
HIGHEST = 0.45  # of the sampling rate


@dataclass(frozen=True)
class Partial:
    """One partial of one take."""

    number: int  # j
    frequency: float  # Hz
    damping: float  # 1/s
    amplitude: float  # at the beginning of the window, in units of the sound
    frequency_sd: float  # Hz, of this take alone: the Cramer-Rao bound
    damping_sd: float  # 1/s
    twin: Component | None = None  # a weaker one beside it


def track(sound: Floats, rate: float, f0: float, most: int) -> list[Partial]:
    """Partials 1 to `most` of the string that sounds in `sound` (n,) from its first sample; f0 (Hz) to 3 %."""
    found: list[Partial] = []
    for j in range(1, most + 1):
        expected = predict(found, f0, j)
        if expected > HIGHEST * rate or j - (found[-1].number if found else 0) > MISSING:
            break
        partial = find(sound, rate, expected, f0, j)
        if partial is not None and (not found or partial.frequency > found[-1].frequency):
            found.append(partial)
    return found


def predict(found: Sequence[Partial], f0: float, j: int) -> float:
    """Where partial j should be, Hz."""
    if not found:
        return j * f0
    near = found[-12:]
    number = np.array([p.number for p in near], np.float64)
    ratio = np.array([p.frequency for p in near]) / number
    if len(near) < 4:
        return j * float(np.median(ratio))
    slope, at_zero = median_line(number**2, ratio)
    return j * (at_zero + slope * j**2)


def median_line(x: Floats, y: Floats) -> tuple[float, float]:
    """Slope and value at 0 of the straight line through (x, y) by medians over pairs (Theil and Sen)."""
    a, b = np.triu_indices(x.size, 1)
    slope = float(np.median((y[b] - y[a]) / (x[b] - x[a])))
    return slope, float(np.median(y - slope * x))


def find(sound: Floats, rate: float, expected: float, f0: float, j: int) -> Partial | None:
    """Partial j near `expected` (Hz), or None where nothing stands out of the noise."""
    scales = [m for m in SCALES if 4 * shortest(WIDTH * f0 * m) < sound.size / rate] or [SCALES[-1]]
    tried: dict[float, list[Component]] = {}
    for first in (1.0, 4.0, 0.25):
        scale, centre = _nearest(first, scales), expected
        while scale not in tried:
            tried[scale] = _near(sound, rate, centre, f0, scale, expected)
            if tried[scale]:
                centre = tried[scale][0].frequency
                scale = _nearest(FIT * tried[scale][0].damping / f0, scales)
        if tried[scale]:
            return _partial(j, tried[scale], f0)
    return None


def _nearest(scale: float, scales: Sequence[float]) -> float:
    return min(scales, key=lambda m: abs(math.log(m / max(scale, 1e-6))))


def _near(sound: Floats, rate: float, centre: float, f0: float, scale: float, expected: float) -> list[Component]:
    """What may be the partial, the strongest first."""
    try:
        seen = components(band(sound, rate, centre, WIDTH * f0 * scale))
    except ValueError:  # the window is shorter than the filter
        return []
    faintest = float(np.max(np.abs(sound))) * 10 ** (-FAINTEST / 20)
    return [
        c
        for c in seen
        if abs(c.frequency - expected) < NEAR * f0
        and c.energy > LEAST_ENERGY
        and c.amplitude > faintest
        and c.damping > LEAST_DAMPING
        and c.damping_sd < MOST_UNSURE * c.damping
    ]


def _partial(j: int, near: list[Component], f0: float) -> Partial:
    best = near[0]
    limit = best.amplitude * 10 ** (-TWIN_LEVEL / 20)
    twins = [c for c in near[1:] if abs(c.frequency - best.frequency) < TWIN * f0 and c.amplitude > limit]
    return Partial(
        j, best.frequency, best.damping, best.amplitude, best.frequency_sd, best.damping_sd, twins[0] if twins else None
    )
