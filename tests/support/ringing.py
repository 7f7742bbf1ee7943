"""Notes computed without the engine: partials that decay, and the free sound of a plucked string."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import soundfile

from livebass.model import modes
from livebass.model.instrument import Pluck, Speaking
from livebass.rows.arrays import Floats
from support.strings import paper_g

RATE = 48_000
NOTE_RATE = 44_100  # of `tone`


def ring(amplitudes: Any, frequencies: Any, dampings: Any, seconds: float, rate: int = RATE) -> Floats:
    """A sum of damped cosines; frequencies (Hz) as in eq. 4, dampings in 1/s."""
    sigma, size = np.asarray(dampings), round(seconds * rate)
    s = -sigma + 1j * np.sqrt((2 * np.pi * np.asarray(frequencies)) ** 2 - sigma**2)
    rows = np.exp(np.outer(np.arange(0, size, 512) / rate, s)) * amplitudes
    return (rows @ np.exp(np.outer(s, np.arange(512) / rate))).real.ravel()[:size]


@cache
def pluck(
    s: Speaking | None = None, seconds: float = 4.0, rate: int = RATE, at: float = 0.02, count: int = 80,
    sensor: float = 0.009,
) -> Floats:  # fmt: skip
    """The sound of a string plucked at `at` (m), section 3.2 of the paper, at `sensor` (m from the saddle).

    Its peak is 0.5.
    """
    s = s or paper_g()
    heard = modes.shapes(s, count, np.array([s.length - sensor]))[0]
    q = modes.pluck_amplitudes(s, count, Pluck(1e-3, at, 1e-3)) * heard
    sound = ring(q, modes.frequencies(s, count), modes.dampings(s, count), seconds, rate)
    sound *= 0.5 / np.abs(sound).max()
    sound.flags.writeable = False  # kept for the next test
    return sound


def tone(
    f0: float = 98.0, level_db: float = -12.0, seconds: float = 1.2, t60: float = 6.0, partials: int = 12
) -> Floats:
    """A note of harmonic partials that decay alike, at NOTE_RATE."""
    t = np.arange(round(seconds * NOTE_RATE)) / NOTE_RATE
    sound = sum(np.sin(2 * math.pi * j * f0 * t) / j for j in range(1, partials + 1)) * 10 ** (-3 * t / t60)
    return np.asarray(10 ** (level_db / 20) * sound / np.abs(sound).max())


def uneven(
    f0: float, levels_db: dict[int, float], seconds: float = 1.0, rate: int = RATE, glide: float = 0.0,
    inharmonicity: float = 1e-4,
) -> Floats:  # fmt: skip
    """A note of stiff partials 1 to 30, plucked at a fifth of the string; it glides by `glide` octaves a second.

    levels_db: of single partials, over that of partial 1 of such a pluck.
    """
    t = np.arange(round(seconds * rate)) / rate
    phase = 2 * math.pi * np.cumsum(f0 * 2 ** (glide * t)) / rate
    sound = np.zeros(t.size)
    for j in range(1, 31):
        level = math.sin(math.pi / 5 * j) / j
        if j in levels_db:
            level = math.sin(math.pi / 5) * 10 ** (levels_db[j] / 20)
        ratio = j * math.sqrt((1 + inharmonicity * j**2) / (1 + inharmonicity))
        sound += level * np.exp(-1.15 * (0.85 + 0.15 * j) * t) * np.sin(ratio * phase)
    return np.asarray(0.5 * sound / np.abs(sound).max())


def save_tones(folder: Path, **files: Floats) -> Path:
    """Writes sounds at NOTE_RATE as WAV files of these names, where "__" is a "/"; returns `folder`."""
    for name, sound in files.items():
        path = folder / f"{name.replace('__', '/')}.wav"
        path.parent.mkdir(parents=True, exist_ok=True)
        soundfile.write(path, sound, NOTE_RATE, subtype="FLOAT")
    return folder
