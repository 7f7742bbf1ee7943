"""Keys of a preset that change no note: `presets check` names all of them, and none that does."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import Run, cli_text

from livebass import quality_with, render_to_array, score_of
from livebass.preset.build import Builder, PresetError
from livebass.preset.idle import _given, _other_values, idle_keys
from livebass.preset.load import laboratory_names, preset_names, preset_tables

TWO_STRINGS = """\
name = "Two strings"
[neck]
scale_length = "34 in"
[[string]]
name = "E"
open_note = "E1"
linear_density = "35.4 g/m"
diameter = "0.105 in"
inharmonicity = 1e-4
[[string]]
name = "G"
open_note = "G2"
linear_density = "6.7 g/m"
diameter = "0.045 in"
inharmonicity = 4e-5
[[pickup]]
position = "90 mm"
[player]
softest = 0.1
"""
SHARED = 'scale_length = "34 in"\n'
OWN = 'inharmonicity = 1e-4\nneck.action = "2 mm"\n', 'inharmonicity = 4e-5\nneck.action = "2 mm"\n'
RESONANT = 'resonance_frequencies = ["150 Hz"]\nresonance_qualities = [30]\nresonance_masses = ["1 kg"]\n'
CASES = [  # changes of TWO_STRINGS, and the keys that do nothing then
    ((), {}),
    (
        (
            (SHARED, SHARED + 'action = "1.5 mm"\n'),
            ("inharmonicity = 1e-4\n", OWN[0]),
            ("inharmonicity = 4e-5\n", OWN[1]),
        ),
        {"neck.action": "every string has its own"},
    ),
    (((SHARED, SHARED + 'action = "1.5 mm"\n'), ("inharmonicity = 1e-4\n", OWN[0])), {}),
    (((SHARED, SHARED + 'action = ["2.2 mm", "1.8 mm"]\n'),), {}),
    ((("softest = 0.1", 'technique = "slap"'),), {}),
    ((("softest = 0.1", 'technique = "pluck"'),), {}),
    (
        (("softest = 0.1", 'technique = "slap"\nslapped_strings = 0\nstrike_force = 2'),),
        {"player.technique": "slapped_strings is 0", "player.strike_force": "no string is slapped"},
    ),
    (
        (("softest = 0.1", 'slapped_strings = 1\nstrike_time = "3 ms"'),),
        {"player.slapped_strings": 'technique is "pluck"', "player.strike_time": "no string is slapped"},
    ),
    (
        (("softest = 0.1", 'technique = "slap"\nslapped_strings = 2\nrounding = "9 mm"\npull_time = "4 ms"'),),
        {"player.rounding": "strikes every string", "player.pull_time": "strikes every string"},
    ),
    (
        (("inharmonicity = 1e-4", "inharmonicity = 1e-4\nstiffness_ratio = 2"),),
        {"string[E].stiffness_ratio": "inharmonicity is given"},
    ),
    (((SHARED, SHARED + 'free_length = "500 mm"\n'),), {"neck.free_length": "rigid"}),
    (((SHARED, SHARED + RESONANT + 'free_length = "500 mm"\n'),), {}),
    (((SHARED, SHARED + 'friction = "300 N/m"\n'),), {"neck.friction": "pluck_angle is 0"}),
    (((SHARED, SHARED + 'friction = "300 N/m"\n'), ("softest = 0.1", 'pluck_angle = "30 deg"')), {}),
    (((SHARED, SHARED + 'frets = 1\naction = "1 mm"\n'),), {"neck.action": "other keys leave it without effect"}),
    (
        (('position = "90 mm"', 'position = "90 mm"\n[[pickup]]\nposition = "60 mm"\nlevel = 0'),),
        {"pickup[2].position": "level is 0"},
    ),
    (
        (("[player]", '[output]\nkind = "displacement"\nacross = 1\n[coil]\ntone = 0.5\n[player]'),),
        {"pickup[1].position": "no pickups", "coil.tone": "no pickups", "output.across": "pluck_angle is 0"},
    ),
    ((("[player]", '[output]\nsensor = "20 mm"\n[player]'),), {"output.sensor": "no sensor"}),
]


def text_of(changes: tuple[tuple[str, str], ...]) -> str:
    text = TWO_STRINGS
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


@pytest.mark.parametrize(("changes", "expected"), CASES, ids=[f"{i}-{'-'.join(c[1])}" for i, c in enumerate(CASES)])
def test_idle_keys_are_named_with_a_reason(changes: tuple[tuple[str, str], ...], expected: dict[str, str]) -> None:
    found = dict(idle_keys(tomllib.loads(text_of(changes))))
    assert found.keys() == expected.keys()
    for place, why in expected.items():
        assert why in found[place]


def sound(data: dict[str, Any]) -> np.ndarray:
    """A softer and a hard note on each string, and the controller of the pluck position between."""
    bass = Builder("f").instrument(data)
    notes = [string.open_note + fret for string in bass.strings for fret in (0, 1)]
    played = [(0.03 * k, 0.02, note, (90, 127)[k % 2]) for k, note in enumerate(notes)]
    score = score_of(played, 22050, bends=[(0.05, 0.5), (0.051, 0.0)])
    at = int(np.flatnonzero(score.messages[:, 0] == 0xE0)[1])
    score.messages[at] = (0xB0, 16, 40)
    return render_to_array(bass, score, quality_with("live", modes=40, contact_rate=100e3), tail=0.02)


def test_what_is_idle_changes_no_sample_and_all_else_does() -> None:
    """Every other value of every key that the cases above have, heard."""
    seen = set()
    for changes, _ in CASES:
        data = tomllib.loads(text_of(changes))
        idle, before = dict(idle_keys(data)), sound(data)
        for given in _given(data):
            if (given.place, given.place in idle) in seen:
                continue
            seen.add((given.place, given.place in idle))
            sounds = []
            for raw in _other_values(given.key, given.raw):
                try:
                    sounds.append(sound(given.with_value(data, raw)))
                except PresetError:
                    continue
            same = all(s.shape == before.shape and np.array_equal(s, before) for s in sounds)
            assert same == (given.place in idle) or not sounds, f"{given.place}, {changes}"
    assert len(seen) > 25


@pytest.mark.parametrize("name", preset_names() + laboratory_names())
def test_first_edits_of_a_shipped_preset_do_something(name: str) -> None:
    """The friction of `fretless` is there for those who give it oblique plucks; its comment says so."""
    data = preset_tables(name)[1]
    assert [place for place, _ in idle_keys(data)] == ["neck.friction"] * (name == "fretless")
    slapped = copy.deepcopy(data)
    slapped["player"]["technique"] = "slap"
    assert Builder("f").instrument(slapped).player.slapped_strings == (len(data["string"]) + 1) // 2
    if "action" in data["neck"]:
        low = copy.deepcopy(data)
        low["neck"]["action"] = "1.95 mm"
        for before, after in zip(*(Builder("f").instrument(d).necks for d in (data, low)), strict=True):
            assert before.fret_heights != after.fret_heights


def test_check_prints_idle_keys(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text_of((("softest = 0.1", 'slapped_strings = 1\nstrike_time = "3 ms"\nstrike_force = 2'),)))
    good, first, second = cli_text(run, "presets", "check", file).splitlines()
    assert good.startswith(f"{file}: good; Two strings")
    assert first == f'{file}: player.slapped_strings changes no note: player.technique is "pluck"'
    assert second.startswith(f"{file}: player.strike_force, player.strike_time change no note: no string is slapped")


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ('["2 mm"]', "neck.action: 1 values for 2 strings; give one for all, or one for each"),
        ('["2 mm", 3]', "item 2, 3: needs a text with a unit"),
        ('{unit = "mm", values = [2, 30]}', 'item 2, "30 mm": allowed: 0 mm to 20 mm'),
        ("[]", 'allowed: ["1 mm", "2 mm"]'),
    ],
)
def test_a_list_in_the_neck_has_one_value_for_each_string(value: str, says: str) -> None:
    with pytest.raises(PresetError) as error:
        Builder("f").instrument(tomllib.loads(text_of(((SHARED, f"{SHARED}action = {value}\n"),))))
    assert says in str(error.value)
