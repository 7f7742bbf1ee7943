"""A bass that a plugin builds anew by its parameters sounds as `livebass render` of a preset with these changes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from support.clap import Plugin, value
from support.plugins import RATE

from livebass import QUALITIES, load_preset, render_to_array, score_of
from livebass.arrays import Floats
from livebass.engine.render import mixed
from livebass.plugin import clap
from livebass.plugin.instrument import SLIDERS_ENDING
from livebass.techniques import BUILT_ROWS

PRESET = "jazz-finger"
NUMBERS = {symbol: row.number for symbol, row in BUILT_ROWS.items()}
SCORE = score_of([(0.0, 0.5, 28, 110), (0.2, 0.6, 36, 80)], RATE)
FRAMES = 16000
ALIKE = 1e-4  # of the loudest: numbers that are moved by a difference are rounded otherwise
UNITS = {"diameter": " m", "linear_density": " kg/m", "tension": " N", "axial_stiffness": " N"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("built") / "livebass"
    clap.write_bundle({PRESET: load_preset(PRESET)}, made)
    return made


@pytest.fixture
def plugin(folder: Path) -> Iterator[Plugin]:
    with closing(Plugin(folder, active=False)) as made:
        yield made


def rendered_with(folder: Path, keys: str) -> Floats:
    """What `livebass render` makes of the preset with these keys."""
    file = folder / "changed.toml"
    file.write_text(f'like = "{PRESET}"\n{keys}\n')
    sound = render_to_array(load_preset(str(file)), SCORE, QUALITIES["live"], tail=0.1)
    return mixed(sound.astype(np.float32))[:FRAMES]


def strings(**factors: float) -> str:
    """Keys of all strings, so many times those of the preset."""
    made = []
    for string in load_preset(PRESET).strings:
        made.append(f'[[string]]\nname = "{string.name}"\nextra_damping = "{string.extra_damping + 4.0} /s"')
        for name, factor in factors.items():
            number = getattr(string, name) * factor
            made.append(f'{name} = "{number!r}{UNITS[name]}"' if name in UNITS else f"{name} = {number!r}")
    return "\n".join(made)


def pickups() -> str:
    """Keys of pickups nearer to the saddle by 12 mm and to the strings by 0.5, of a longer cable and other fingers."""
    bass, made = load_preset(PRESET), []
    for p in bass.output.pickups:
        level = p.level * np.exp(0.5e-3 / p.decay_length)
        made.append(f'[[pickup]]\nposition = "{p.position - 0.012!r} m"\nlevel = {float(level)!r}')
    player, coil = bass.player, bass.output.coil
    return "\n".join(
        [
            *made,
            f'[coil]\ncapacitance = "{coil.capacitance + 300e-12!r} F"',
            f'[player]\nrounding = "{player.rounding * 1.5!r} m"\nrounding_soft = "{player.rounding_soft * 1.5!r} m"',
            f'pluck_angle = "{np.rad2deg(player.pluck_angle) + 20} deg"\nhardest = {player.hardest * 1.2!r}',
        ]
    )


NECK = """
[neck]
action = {unit = "mm", values = [1.6, 1.4, 1.3, 1.2]}
relief = "0.4 mm"
nut_height = "0.45 mm"
[player]
graze_action = {unit = "mm", values = [2.4, 2.2, 2.1, 2.0]}
graze_relief = "0.3 mm"
graze_nut_height = "0.5 mm"
"""
G, T = 1.15, 0.95
STRINGS = {
    "diameter": G, "linear_density": G * G * T, "tension": G * G * T, "inharmonicity": G * G / T,
    "axial_stiffness": G * G, "viscoelastic_angle": 4.0, "thermoelastic": 4.0,
}  # fmt: skip
CASES = {
    "neck": ({"action": -0.8, "neck_relief": 0.1, "nut_height": -0.05}, NECK),
    "strings": ({"gauge": 15, "tension": -5, "wear": 300, "foam": 4}, strings(**STRINGS)),
    "pickups": (
        {"pickup_place": -12, "pickup_height": 0.5, "cable": 300, "finger_width": 50, "pluck_angle": 20, "hardest": 20},
        pickups(),
    ),
    "loss": ({"contact_loss": -100}, '[neck]\ncontact_loss = "0 N s/m"'),
}


@pytest.mark.parametrize("case", CASES)
def test_it_sounds_as_the_preset_with_these_changes(plugin: Plugin, folder: Path, tmp_path: Path, case: str) -> None:
    values, keys = CASES[case]
    own, wanted = rendered_with(tmp_path, ""), rendered_with(tmp_path, keys)
    for symbol, number in values.items():
        plugin.set(NUMBERS[symbol], number)
    plugin.activate()
    sound = plugin.play(SCORE, FRAMES)
    most = np.abs(wanted).max()
    assert np.abs(own - wanted).max() > 0.05 * most
    assert np.abs(sound - wanted).max() < ALIKE * most


def test_a_state_and_a_change_while_it_plays(plugin: Plugin, folder: Path) -> None:
    """Offline a change is waited for, and a second bounce, of a saved state, is the same."""
    plugin.activate()
    plugin.offline()
    quiet = plugin.play([], 512)
    plugin.set(NUMBERS["gauge"], 20.0)
    given = [(600, value(NUMBERS["foam"], 30.0))]
    first = plugin.play(given, 8192)
    state = plugin.save()
    sound = plugin.play(SCORE, FRAMES)
    assert not quiet.any() and not first.any() and np.abs(sound).max() > 0.01
    with closing(Plugin(folder, active=False)) as other:
        assert other.load(state)
        other.activate()
        again = other.play(SCORE, FRAMES)
    assert np.array_equal(sound, again)


def test_what_cannot_be_built_is_said_and_the_bass_plays_as_it_is(plugin: Plugin, folder: Path) -> None:
    plugin.activate()
    own = plugin.play(SCORE, FRAMES)
    file = folder / f"{PRESET}{SLIDERS_ENDING}"
    kept = file.read_bytes()
    try:
        for damaged in (kept[:-8], b"", kept[:900] + b"?" + kept[901:], kept[:16] + bytes(8) + kept[24:]):
            file.write_bytes(damaged)
            with closing(Plugin(folder, active=False)) as other:
                other.set(NUMBERS["action"], 1.0)
                other.activate()
                assert np.array_equal(other.play(SCORE, FRAMES), own)
    finally:
        file.write_bytes(kept)
