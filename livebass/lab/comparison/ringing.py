"""Finds the partials of a note and their decay, T60.

A partial's level is read in windows of four periods of the note, whose zeros lie on the other partials. A straight
line is fitted to it from 0.1 s on, down to 30 dB below, while it stands 10 dB over the noise floor: the level halfway
between partials in the last third of the note. The peaks of noise look like partials that never decay, so a band tells
no T60 if half of its partials drown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from livebass.lab.comparison.floor import typical
from livebass.lab.identification.partials import median_line
from livebass.rows.arrays import Floats, Ints

OCTAVES = (50.0, 100.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0)  # Hz, limits of the octaves of T60
HIGHEST = OCTAVES[-1]  # Hz, of a partial
PERIODS = 4  # of a note in a window
FROM, DOWN = 0.1, 30.0  # s after the attack; dB
FAINTEST, CLEAR = 60.0, 10.0  # dB below the loudest partial; dB over the noise floor
BESIDE = 4  # gaps on each side that tell the noise at a partial: one gap alone fades at times
DROWNED = 0.5  # of the partials of a band: it tells no T60
NEAR = 0.12  # of f0: the search range around the expected place of a partial
SHORTEST = 0.15  # s of decay; shorter ones are ignored


@dataclass(frozen=True)
class Ringing:
    """The partials of a note that decay, (n,) each, and those that drown in its noise."""

    number: Ints  # from 1, the fundamental
    frequency: Floats  # Hz
    t60: Floats  # s
    drowned: Floats  # Hz, (m,): partials that do not stand over the noise for SHORTEST

    def between(self, low: float, high: float) -> Floats:
        """Returns the T60 (s) of the partials from `low` to `high` Hz; none if half of them drown."""
        found = self.t60[(self.frequency >= low) & (self.frequency < high)]
        below = np.count_nonzero((self.drowned >= low) & (self.drowned < high))
        return found if below < DROWNED * (found.size + below) else found[:0]


NO_RINGING = Ringing(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0))


def ringing(sound: Floats, rate: float, f0: float, known: tuple[Ints, Floats] | None = None) -> Ringing:
    """Returns the partials of `sound` (samples,), a note of f0 (Hz) to 3 %, which begins with its attack.

    Partials that are too faint or too short, or do not decay, are left out; `known` are the `partials`, if found
    already.
    """
    numbers, found = known or partials(sound, rate, f0)
    if not found.size:
        return NO_RINGING
    window = min(round(PERIODS * rate / f0), sound.size)
    hop = max(1, window // 8)
    starts = np.arange(round(FROM * rate), sound.size - window + 1, hop)
    frames = sound[starts[:, None] + np.arange(window)] * np.hanning(window + 1)[:-1]
    t = np.arange(window) / rate

    def level(frames: Floats, nu: Floats) -> Floats:
        """Returns the levels (frames, nu), dB."""
        turns = 2 * math.pi * np.outer(t, nu)
        return np.asarray(20 * np.log10(np.hypot(frames @ np.cos(turns), frames @ np.sin(turns)) + 1e-30))

    if starts.size < 2:
        return NO_RINGING
    tones, noise = level(frames, found), _noise(level(frames[2 * starts.size // 3 :], found + f0 / 2))
    kept: list[tuple[int, float, float]] = []
    drowned = _missing(numbers, found, f0, rate)
    faintest = tones[0].max() - FAINTEST
    for k in range(found.size):
        start = tones[0, k]
        over = tones[:, k] > noise[k] + CLEAR
        clear = over & (tones[:, k] > start - DOWN)
        count = int(np.argmin(clear)) if not clear.all() else clear.size
        if start < faintest or (count - 1) * hop < SHORTEST * rate or count < 4:
            if not over[: count + 1].all():
                drowned.append(float(found[k]))
            continue
        seconds = np.arange(count) * hop / rate
        slope = np.polyfit(seconds, tones[:count, k], 1)[0]  # dB/s
        if slope < -0.1:
            kept.append((int(numbers[k]), float(found[k]), float(-60 / slope)))
    columns = zip(*kept, strict=True) if kept else ((), (), ())
    number, frequency, t60 = (np.array(column) for column in columns)
    return Ringing(number.astype(np.int64), frequency, t60, np.array(drowned))


def _noise(gaps: Floats) -> Floats:
    """Returns the noise at each partial, dB, (n,), by the levels in the gap above each, (frames, n)."""
    power = 10 ** (gaps / 10)
    each = (power[:, max(0, k - BESIDE) : k + BESIDE + 1] for k in range(gaps.shape[1]))
    return np.array([10 * math.log10(typical(near) + 1e-30) for near in each])


def _missing(numbers: Ints, found: Floats, f0: float, rate: float) -> list[float]:
    """Returns the places (Hz) of the partials up to HIGHEST that are not found."""
    every = np.arange(1, int(min(HIGHEST, 0.45 * rate) / f0) + 1)
    places = every * np.interp(every, numbers, found / numbers)
    return [float(nu) for j, nu in zip(every, places, strict=True) if j not in numbers]


def partials(sound: Floats, rate: float, f0: float) -> tuple[Ints, Floats]:
    """Returns numbers and frequencies (Hz) of the partials up to `HIGHEST`, each near its extrapolated place."""
    size = min(sound.size, round(1.0 * rate))
    padded = 4 * 2 ** math.ceil(math.log2(size))
    spectrum = np.abs(np.fft.rfft(sound[:size] * np.hanning(size), padded))
    step = rate / padded
    numbers: list[int] = []
    found: list[float] = []
    for j in range(1, int(min(HIGHEST, 0.45 * rate) / f0) + 1):
        expected = j * f0
        if found:
            number, near = np.array(numbers[-12:], np.float64), np.array(found[-12:])
            slope, at_zero = median_line(number**2, near / number) if near.size > 3 else (0.0, near[-1] / number[-1])
            expected = j * (at_zero + slope * j**2)
            if expected < found[-1]:
                break
        low, high = round((expected - NEAR * f0) / step), round((expected + NEAR * f0) / step) + 1
        if high + 1 >= spectrum.size:
            break
        k = low + int(np.argmax(spectrum[low:high]))
        # a partial is a peak, not the flank of another, and rises above the level between partials
        valley = np.median(spectrum[max(0, round((expected - 0.6 * f0) / step)) : round((expected - 0.4 * f0) / step)])
        if low < k < high - 1 and spectrum[k] > 4 * valley:
            numbers.append(j)
            found.append(k * step)
    return np.array(numbers, np.int64), np.array(found)
