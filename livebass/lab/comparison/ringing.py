"""Finds the partials of a note and their decay, T60.

A partial's level is read in windows of four periods of the note, whose zeros lie on the other partials. A straight
line is fitted to it from 0.1 s on, down to 30 dB below. Partials less than 10 dB above the noise between them are left
out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from livebass.lab.identification.partials import median_line
from livebass.rows.arrays import Floats, Ints

OCTAVES = (50.0, 100.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0)  # Hz, limits of the octaves of T60
HIGHEST = OCTAVES[-1]  # Hz, of a partial
PERIODS = 4  # of a note in a window
FROM, DOWN = 0.1, 30.0  # s after the attack; dB
FAINTEST, CLEAR = 60.0, 10.0  # dB below the loudest partial; dB over the noise between partials
NEAR = 0.12  # of f0: the search range around the expected place of a partial
SHORTEST = 0.15  # s of decay; shorter ones are ignored


@dataclass(frozen=True)
class Ringing:
    """The partials of a note that decay, (n,) each."""

    number: Ints  # from 1, the fundamental
    frequency: Floats  # Hz
    t60: Floats  # s


NO_RINGING = Ringing(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))


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
    tones, noise = level(frames, found), np.median(level(frames[-8:], found + f0 / 2), axis=0)
    kept: list[tuple[int, float, float]] = []
    for k in range(found.size):
        start = tones[0, k]
        if start < tones[0].max() - FAINTEST:
            continue
        clear = (tones[:, k] > start - DOWN) & (tones[:, k] > noise[k] + CLEAR)
        count = int(np.argmin(clear)) if not clear.all() else clear.size
        if (count - 1) * hop < SHORTEST * rate or count < 4:
            continue
        seconds = np.arange(count) * hop / rate
        slope = np.polyfit(seconds, tones[:count, k], 1)[0]  # dB/s
        if slope < -0.1:
            kept.append((int(numbers[k]), float(found[k]), float(-60 / slope)))
    if not kept:
        return NO_RINGING
    return Ringing(*(np.array(column) for column in zip(*kept, strict=True)))


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
