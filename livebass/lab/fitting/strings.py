"""The string of each note, by its inharmonicity: a lower string is thicker, and stops higher for the same pitch.

Stopped at a fret, a string's inharmonicity grows with the inverse square of its length, so that inharmonicity over the
square of the pitch stays the same along a string and differs by two or three times from string to string. Each pitch is
taken to be played on a single string, and higher pitches never on lower strings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from livebass.lab.comparison.measures import attack
from livebass.lab.comparison.notes import Note, strings_of_key
from livebass.lab.fitting.notes import Place, Recorded
from livebass.model.instrument import Instrument
from livebass.rows.arrays import Floats

HIGHEST = 4000.0  # Hz, of a partial
LENGTH = 1.0  # s of a note
CLEAREST = 45.0  # dB over the noise: a louder partial counts as much
OFF = 0.004  # of the pitch, by which the fundamental may be off
TRIED = 100  # values of inharmonicity
ROOM = 2.5  # the range of values: times the bass' highest, or its lowest by this
OFFSETS = np.linspace(-1.0, 1.0, 41)  # log of the recorded bass' inharmonicity over the bass' own
TYPICAL_OFFSET = 0.6  # its usual size
SPREAD, FARTHEST = 0.35, 2.0  # log of a note's inharmonicity about that of its string; at most, in spreads
FRET = 0.02  # cost of a fret: a lower one is more likely


def with_strings(recorded: Recorded, bass: Instrument) -> Recorded:
    """The notes with the strings that they sound like, where no name tells them."""
    unknown = [place for place in recorded.takes if not place.string]
    found = strings_of({p: recorded.takes[p] for p in unknown}, bass)
    takes = {p._replace(string=p.string or found.get(p.key, "")): notes for p, notes in recorded.takes.items()}
    return replace(recorded, takes=dict(sorted(takes.items())))


def strings_of(takes: Mapping[Place, Sequence[Note]], bass: Instrument) -> dict[int, str]:
    """The name of the string that plays each pitch (MIDI); pitches that the bass does not have are left out."""
    log_b: dict[int, float] = {}
    for key in sorted({p.key for p in takes}):
        expected = [inharmonicity_at(bass, i, key) for i in strings_of_key(bass, key)]
        if expected:
            values = np.geomspace(min(expected) / ROOM, max(expected) * ROOM, TRIED)
            notes = [note for p, those in takes.items() if p.key == key for note in those]
            log_b[key] = float(np.median([math.log(inharmonicity(note, values)) for note in notes]))
    if not log_b:
        return {}
    _, chosen = min((_cheapest(bass, log_b, offset) for offset in OFFSETS), key=lambda found: found[0])
    return {key: bass.strings[i].name for key, i in zip(log_b, chosen, strict=True)}


def inharmonicity(note: Note, values: Floats) -> float:
    """The one of some values whose partials stand out most in the spectrum of a note."""
    from scipy.ndimage import median_filter

    sound = note.sound[attack(note.sound, note.rate) :][: round(LENGTH * note.rate)]
    size = 4 * 2 ** math.ceil(math.log2(sound.size))
    level = 20 * np.log10(np.abs(np.fft.rfft(sound * np.hanning(sound.size), size)) + 1e-10)
    step = note.rate / size
    every = max(1, round(note.pitch / step / 40))
    noise = median_filter(level[::every], round(note.pitch / step) // every | 1)
    over = np.clip(level - np.interp(np.arange(level.size), np.arange(noise.size) * every, noise), 0.0, CLEAREST)
    highest = min(HIGHEST, 0.45 * note.rate)
    number = np.arange(1, int(highest / note.pitch) + 1)
    tuned = 1 + np.linspace(-OFF, OFF, 33)[:, None]

    def clear(value: float) -> float:
        nu = note.pitch * number * np.sqrt((1 + value * number**2) / (1 + value))
        return float(over[np.round(nu[nu < highest] * tuned / step).astype(np.int64)].mean(axis=1).max())

    return float(values[int(np.argmax([clear(float(value)) for value in values]))])


def inharmonicity_at(bass: Instrument, string: int, key: int) -> float:
    """The inharmonicity of a string, by its index, stopped to sound `key`."""
    s = bass.strings[string]
    return s.inharmonicity * 2.0 ** ((key - s.open_note) / 6)


def _cheapest(bass: Instrument, log_b: Mapping[int, float], offset: float) -> tuple[float, tuple[int, ...]]:
    """The cost and the strings of rising pitches, if the recorded bass' inharmonicity is over this bass' by `offset`.

    Strings never fall as pitches rise: a path through (pitch, string), cheapest first.
    """
    order = sorted(range(len(bass.strings)), key=lambda i: bass.strings[i].open_note)
    paths: dict[int, tuple[float, tuple[int, ...]]] = {0: ((offset / TYPICAL_OFFSET) ** 2, ())}
    for key, found in log_b.items():
        costs = {}
        for i in strings_of_key(bass, key):
            away = abs(found - offset - math.log(inharmonicity_at(bass, i, key))) / SPREAD
            costs[order.index(i)] = min(away, FARTHEST) + FRET * (key - bass.strings[i].open_note)
        paths = {
            k: min((path[0] + cost, (*path[1], order[k])) for last, path in paths.items() if last <= k)
            for k, cost in costs.items()
            if any(last <= k for last in paths)
        }
        if not paths:
            return math.inf, ()
    return min(paths.values())
