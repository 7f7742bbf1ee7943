"""Strings are told by inharmonicity: of thinner strings than the preset has, beside lines of rattle, under names."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("scipy")
from livebass.lab.comparison.notes import Note
from livebass.lab.fitting.notes import Place, Recorded
from livebass.lab.fitting.strings import inharmonicity, inharmonicity_at, strings_of, with_strings
from livebass.model.instrument import note_frequency
from livebass.preset.load import load_preset

RATE = 44_100
BASS = load_preset("jazz-finger")
PLAYED = {28: "E", 33: "E", 39: "E", 42: "A", 45: "A", 48: "D", 51: "D", 54: "G", 60: "G"}
THINNER = {"E": 0.45, "A": 0.55, "D": 0.62, "G": 0.6}  # their inharmonicity, times the preset's


def note(key: int, string: str, rattle: float = 0.1) -> Note:
    """A note of 1.2 s with 40 partials, noise, and lines at the harmonics, as a rattling string has them."""
    value = THINNER[string] * inharmonicity_at(BASS, BASS.string_index(string), key)
    t, f0 = np.arange(round(1.2 * RATE)) / RATE, note_frequency(key)
    number = np.arange(1, 1 + min(40, int(5000 / f0)))
    nu = f0 * number * np.sqrt((1 + value * number**2) / (1 + value))
    rng = np.random.default_rng(key)
    phases = 2 * math.pi * rng.random((2, number.size))
    sound = 2e-3 * rng.standard_normal(t.size)
    for j, frequency, (a, b) in zip(number, nu, phases.T, strict=True):
        decay = np.exp(-t * (1 + 0.1 * j)) / j
        sound += decay * (np.sin(2 * math.pi * frequency * t + a) + rattle * np.sin(2 * math.pi * j * f0 * t + b))
    return Note(f"{key}", np.concatenate([np.zeros(500), sound]), RATE, f0)


def test_each_pitch_is_found_on_the_string_that_played_it() -> None:
    takes = {Place(key, "", 0): (note(key, string),) for key, string in PLAYED.items()}
    assert strings_of(takes, BASS) == PLAYED
    # at the lowest frets, another bass
    lowest = {28: "E", 33: "A", 40: "D", 45: "G"}
    assert strings_of({Place(key, "", 0): (note(key, string),) for key, string in lowest.items()}, BASS) == lowest


def test_a_higher_pitch_is_never_on_a_lower_string() -> None:
    odd = PLAYED | {45: "G"}  # one note sounds like a thinner string than its neighbours
    found = strings_of({Place(key, "", 0): (note(key, string),) for key, string in odd.items()}, BASS)
    assert found.pop(45) in ("A", "D")
    assert found == {key: string for key, string in PLAYED.items() if key != 45}


@pytest.mark.parametrize(("key", "string", "rattle"), [(28, "E", 0.0), (36, "E", 0.5), (54, "G", 0.3)])
def test_inharmonicity_is_read_beside_harmonic_lines(key: int, string: str, rattle: float) -> None:
    truth = THINNER[string] * inharmonicity_at(BASS, BASS.string_index(string), key)
    found = inharmonicity(note(key, string, rattle), np.geomspace(truth / 5, truth * 5, 100))
    assert found == pytest.approx(truth, rel=0.1)


def test_names_of_strings_count_more_and_notes_below_the_bass_stay_unknown() -> None:
    takes = {
        Place(39, "A", 1): (note(39, "E"),), Place(25, "", 0): (note(28, "E"),), Place(28, "", 0): (note(28, "E"),),
        Place(39, "", 0): (note(39, "E"),),
    }  # fmt: skip
    given = Recorded("mine", "fingers", takes, ("soft", "hard"), (), (), False, (), "")
    found = with_strings(given, BASS).takes
    assert list(found) == [Place(25, "", 0), Place(28, "E", 0), Place(39, "A", 1), Place(39, "E", 0)]
    assert found[Place(39, "E", 0)] == takes[Place(39, "", 0)]
