"""Preset keys that change no note: `presets check` names exactly these."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import Run, cli_text
from support.costs import of_each_kind

from livebass import quality_with, render_to_array, score_of
from livebass.engine.engine import Engine
from livebass.preset.build import Builder, PresetError
from livebass.preset.idle import Given, given_keys, idle_keys, other_values
from livebass.preset.keys import KEYS, key_names
from livebass.preset.load import laboratory_names, preset_names, preset_tables

G_STRING = """\
[[string]]
name = "G"
open_note = "G2"
linear_density = "6.7 g/m"
diameter = "0.045 in"
inharmonicity = 4e-5
[[pickup]]
position = "90 mm"
"""
TWO_STRINGS = (
    """\
name = "Two strings"
[neck]
scale_length = "34 in"
[[string]]
name = "E"
open_note = "E1"
linear_density = "35.4 g/m"
diameter = "0.105 in"
inharmonicity = 1e-4
"""
    + G_STRING
    + """\
[player]
softest = 0.1
"""
)
SHARED = 'scale_length = "34 in"\n'
OWN = 'inharmonicity = 1e-4\nneck.action = "2 mm"\n', 'inharmonicity = 4e-5\nneck.action = "2 mm"\n'
RESONANT = 'resonance_frequencies = ["150 Hz"]\nresonance_qualities = [30]\nresonance_masses = ["1 kg"]\n'


def neck(lines: str) -> tuple[str, str]:
    """The change of TWO_STRINGS that adds lines to its neck."""
    return SHARED, f"{SHARED}{lines}\n"


def player(lines: str) -> tuple[str, str]:
    """The change of TWO_STRINGS that describes another player."""
    return "softest = 0.1", lines


ACTION, ANGLED, FRICTION = neck('action = "1.5 mm"'), player('pluck_angle = "30 deg"'), neck('friction = "300 N/m"')
ACROSS = "stiffness_across = 3\nstop_across = 0.5"
# Changes of TWO_STRINGS, and the keys that then do nothing
CASES: list[tuple[list[tuple[str, str]], dict[str, str]]] = [
    ([], {}),
    ([ACTION, ("inharmonicity = 1e-4\n", OWN[0]), ("inharmonicity = 4e-5\n", OWN[1])],
     {"neck.action": "every string has its own"}),
    ([ACTION, ("inharmonicity = 1e-4\n", OWN[0])], {}),
    ([neck('action = ["2.2 mm", "1.8 mm"]')], {}),
    ([player('technique = "slap"')], {}),
    ([player('technique = "pluck"')], {}),
    ([player('technique = "slap"\nslapped_strings = 0\nstrike_force = 2')],
     {"player.technique": "slapped_strings is 0", "player.strike_force": "no string is slapped"}),
    ([player('slapped_strings = 1\nstrike_time = "3 ms"')],
     {"player.slapped_strings": 'technique is "pluck"', "player.strike_time": "no string is slapped"}),
    ([player('technique = "slap"\nslapped_strings = 2\nrounding = "9 mm"\npull_time = "4 ms"')],
     {"player.rounding": "strikes every string", "player.pull_time": "strikes every string"}),
    ([("inharmonicity = 1e-4", "inharmonicity = 1e-4\nstiffness_ratio = 2")],
     {"string[E].stiffness_ratio": "inharmonicity is given"}),
    ([neck('free_length = "500 mm"')], {"neck.free_length": "rigid"}),
    ([neck(RESONANT + 'free_length = "500 mm"')], {}),
    ([FRICTION], {"neck.friction": "pluck_angle is 0"}),
    ([FRICTION, ANGLED], {}),
    ([FRICTION, player('angle_when_hard = "30 deg"')], {}),
    ([neck('longer_across = "1 mm"')], {"neck.longer_across": "pluck_angle is 0"}),
    ([neck(ACROSS), ANGLED], {"neck.stiffness_across": "rigid", "neck.stop_across": "stop_conductance is 0"}),
    ([neck(RESONANT + ACROSS + '\nstop_conductance = "1 mm/s/N"'), ANGLED], {}),
    ([neck('frets = 1\naction = "1 mm"')], {"neck.action": "other keys leave it without effect"}),
    ([('position = "90 mm"', 'position = "90 mm"\n[[pickup]]\nposition = "60 mm"\nlevel = 0')],
     {"pickup[2].position": "level is 0"}),
    ([("[player]", '[output]\nkind = "displacement"\nacross = 1\n[coil]\ntone = 0.5\n[player]')],
     {"pickup[1].position": "no pickups", "coil.tone": "no pickups", "output.across": "pluck_angle is 0"}),
    ([("[player]", '[output]\nsensor = "20 mm"\n[player]')], {"output.sensor": "no sensor"}),
    ([player("softest = 0.1\n[pick]\nlift = 0.7")], {"pick.lift": 'stroke is not "pick"'}),
    ([player('[effects]\neq_treble = "3 dB"\neq_low_mid_frequency = "250 Hz"\neq_high_mid_frequency = "1 kHz"')],
     {"effects.eq_low_mid_frequency": "eq_low_mid is 0 dB", "effects.eq_high_mid_frequency": "eq_high_mid is 0 dB"}),
    ([player('[effects]\nclean_blend = 0.5\nresponse_level = "normalized"\ncabinet = "closed-4x10"')],
     {"effects.clean_blend": "drive is 0", "effects.response_level": "response is missing"}),
]  # fmt: skip


def text_of(*changes: tuple[str, str]) -> str:
    text = TWO_STRINGS
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


@pytest.mark.parametrize(("changes", "expected"), CASES, ids=[f"{i}-{'-'.join(c[1])}" for i, c in enumerate(CASES)])
def test_idle_keys_are_named_with_a_reason(changes: list[tuple[str, str]], expected: dict[str, str]) -> None:
    found = dict(idle_keys(tomllib.loads(text_of(*changes))))
    assert found.keys() == expected.keys()
    for place, why in expected.items():
        assert why in found[place]


def sound(data: dict[str, Any]) -> np.ndarray:
    """Softer and harder notes on each string, the lowest string's last fret, and one below it; half of them after the
    controller of the pluck position and a bend; finally a slide, and the palm.
    """
    bass = Builder("f").instrument(data)
    notes = [string.open_note + fret for string in bass.strings for fret in (0, 1)]
    lowest = bass.strings[0].open_note
    notes += [lowest + len(bass.necks[0].fret_positions), lowest - 2]
    notes += notes
    played = [(0.03 * k, 0.02, note, (90, 127)[k % 2]) for k, note in enumerate(notes)]
    middle = 0.03 * len(notes) / 2
    end = 0.03 * len(notes) + 0.06  # a finger that comes down for the slide is heard
    played += [(end, 0.2, lowest + 1, 90), (end + 0.06, 0.14, lowest + 5, 90)]
    bends = [(middle - 0.01, 0.5), (middle - 0.005, 0.0), (end - 0.005, 0.0), (end + 0.1, 0.0)]
    score = score_of(played, 16000, bends=bends)
    _, *at = np.flatnonzero(score.messages[:, 0] == 0xE0)
    score.messages[at] = (0xB0, 16, 40), (0xB0, 65, 127), (0xB0, 9, 90)
    return render_to_array(bass, score, quality_with("live", modes=30, contact_rate=100e3), tail=0.02)


def others_heard(data: dict[str, Any], given: Given, before: np.ndarray) -> Iterator[bool]:
    """Tells, for each allowed other value of a key, if it changes the sound `before`."""
    for raw in other_values(given.key, given.raw):
        with suppress(PresetError):
            yield not np.array_equal(sound(given.with_value(data, raw)), before)


def assert_idle_is_not_heard(data: dict[str, Any], but: set[str]) -> int:
    """Other values of every key but the idle ones change the sound. Returns the number of keys tried."""
    idle, before, tried = dict(idle_keys(data)), sound(data), 0
    for given in given_keys(data):
        heard = others_heard(data, given, before)
        first = next(heard, None)
        if first is not None:
            tried += 1
            assert (first or any(heard)) == (given.place not in idle) or given.place in but, given.place
    return tried


@pytest.mark.parametrize(
    ("changes", "expected"), [c for c in CASES if c[1]], ids=[",".join(c[1]) for c in CASES if c[1]]
)
def test_what_is_idle_is_not_heard(changes: list[tuple[str, str]], expected: dict[str, str]) -> None:
    data = tomllib.loads(text_of(*changes))
    before = sound(data)
    for given in given_keys(data):
        if given.place in expected:
            assert not any(others_heard(data, given, before)), given.place


def mix(data: dict[str, Any]) -> np.ndarray:
    """One note behind the effects, (n_frames,)."""
    engine = Engine(Builder("f").instrument(data), quality_with("live", modes=30, contact_rate=100e3), 16000)
    blocks = engine.play_with_mix(score_of([(0.0, 0.05, 43, 90)], 16000), 0.0)
    return np.concatenate([strings.sum(axis=0) if behind is None else behind for strings, behind in blocks])


AMP = {
    "drive": 0.3, "clean_blend": 0.5, "eq_low_mid": "6 dB", "eq_low_mid_frequency": "250 Hz",
    "eq_high_mid": "-6 dB", "eq_high_mid_frequency": "1 kHz",
}  # fmt: skip


@pytest.mark.parametrize("off", ["", "drive", "eq_low_mid", "eq_high_mid"])
def test_a_key_of_the_amp_is_heard_or_idle(off: str) -> None:
    data = tomllib.loads(text_of()) | {"effects": {key: value for key, value in AMP.items() if key != off}}
    idle, before = dict(idle_keys(data)), mix(data)
    assert len(idle) == bool(off)
    for given in (given for given in given_keys(data) if given.key.section == "effects"):
        others = (mix(given.with_value(data, raw)) for raw in other_values(given.key, given.raw))
        assert any(not np.array_equal(other, before) for other in others) == (given.place not in idle), given.place


def test_every_number_of_a_pick_is_heard_where_it_plucks() -> None:
    table = tomllib.loads(f"[pick]{ALL_KEYS.partition('[pick]')[2]}")["pick"]
    data = tomllib.loads(text_of(player('stroke = "pick"'))) | {"pick": table}
    before = sound(data)
    for given in (given for given in given_keys(data) if given.key.section == "pick"):
        for raw in list(other_values(given.key, given.raw))[:1]:
            assert not np.array_equal(sound(given.with_value(data, raw)), before), given.place
    assert {key.name for key in KEYS if key.section == "pick"} == set(table)


ALL_KEYS = (
    """\
name = "All keys"
[neck]
scale_length = "34 in"
frets = 12
action = "1.5 mm"
relief = "0.3 mm"
nut_height = "0.5 mm"
{lift}
obstacle = "{obstacle}"
contact_stiffness = 1e10
contact_exponent = 1.5
contact_loss = "10 N s/m"
grid_step = "1 mm"
friction = "300 N/m"
friction_speed = "10 um/s"
axes_turned = "20 deg"
free_length = "500 mm"
stop_conductance = "1 mm/s/N"
stiffness_across = 2
stop_across = 0.5
longer_across = "0.4 mm"
resonance_frequencies = ["150 Hz"]
resonance_qualities = [30]
resonance_masses = ["1 kg"]
resonance_shapes = [1]
[[string]]
name = "E"
open_note = "E1"
linear_density = "35.4 g/m"
tension = "179.4 N"
diameter = "0.105 in"
core_diameter = "0.022 in"
core_modulus = "200 GPa"
stiffness_ratio = 2
stiffness_law = "hinged"
viscoelastic_angle = 0.001
thermoelastic = 2e-4
relaxation = 1e-3
relaxation_frequency = "2 kHz"
extra_damping = "1 /s"
extra_damping_slope = 1e-4
axial_stiffness = "49000 N"
winding = "0.45 mm"
level = 1
law_fundamental = "41.2 Hz"
measured_frequencies = ["41.2 Hz", "82.5 Hz"]
measured_dampings = ["1 /s", "2 /s"]
"""
    + G_STRING
    + """\
aperture = "20 mm"
decay_length = "4 mm"
level = 1
across = 0.15
[coil]
inductance = "4 H"
resistance = "7500 ohm"
capacitance = "600 pF"
volume_pot = "250 kohm"
tone_pot = "250 kohm"
tone_capacitor = "47 nF"
tone = 0.7
[output]
kind = "{kind}"
sensor = "9 mm"
sensor_v = "18 mm"
across = 0.5
gain = 1
[player]
technique = "{technique}"
slapped_strings = {slapped}
pluck_position = 0.74
pluck_nearest = 0.55
pluck_farthest = 0.93
pluck_angle = "{angle} deg"
angle_when_hard = "{angle} deg"
stroke = "finger"
nearer_when_hard = "10 mm"
rounding = "5 mm"
rounding_soft = "9 mm"
release_time = "50 us"
release_time_soft = "200 us"
release_speed = "0.3 m/s"
softest = 0.08
hardest = 4.5
greatest_apex = "6 mm"
unevenness = 0.1
strike_position = 0.68
strike_force = 1
strike_width = "20 mm"
strike_time = "1.5 ms"
thumb_mass = "{mass}"
strike_softest = "0.5 m/s"
strike_hardest = "3.5 m/s"
thumb_width = "5 mm"
thumb_stiffness = 7e5
thumb_loss = 0.35
pull_time = "2 ms"
hand_damping = "90 /s"
palm_resistance = "0.2 N s/m"
palm_pressed = "5 N s/m"
palm_place = "30 mm"
pick_noise = "-20 dB"
hum = "-50 dB"
mains = "50 Hz"
resting_hand = "0.2 N s/m"
palm_width = "8 mm"
skin_noise = "-14 dB"
release_noise = "-3 dB"
release_cutoff = "600 Hz"
release_spread = 0.5
fretting_noise = 1
floor_noise = "-65 dB"
floor_cutoff = "2 kHz"
floor_corner = "500 Hz"
squeak = "-6 dB"
answering = "always"
bend_range = 2
out_of_range = "transpose"
position_controller = 16
keys = "modo"
velocity_curve = "linear"
ghost_below = 90
wheel = "bend"
graze_action = "1.8 mm"
graze_relief = "0.25 mm"
graze_nut_height = "0.4 mm"
[pick]
soft_width = "1.4 mm"
hard_width = "0.9 mm"
soft_release = "0.2 ms"
hard_release = "20 us"
place = 0.9
angle = "30 deg"
nearer = "40 mm"
lift = 0.8
"""
)
ELSEWHERE = {  # another key may describe the neck
    "neck.fret_positions", "neck.fret_heights", "neck.height_scale", "neck.height_offset", "neck.fret_height",
    "neck.board_end", "neck.profile_positions", "neck.profile_heights", "neck.conductance_frequencies",
    "neck.conductance_values", "neck.susceptance_values",
}  # fmt: skip
BASSES = [  # all pairs of values of two keys occur
    ("pluck", 1, "pickups", 0, "frets"),
    ("pluck", 1, "pickups", 20, "board"),
    ("pluck", 1, "displacement", 0, "board"),
    ("slap", 1, "pickups", 20, "frets"),
    ("slap", 1, "displacement", 0, "board"),
    ("slap", 2, "pickups", 0, "board"),
    ("slap", 2, "displacement", 20, "frets"),
]
QUICK = BASSES[-1:]


@pytest.mark.parametrize(
    ("technique", "slapped", "kind", "angle", "obstacle"),
    [
        pytest.param(*bass, marks=() if bass in QUICK else pytest.mark.slow, id="-".join(map(str, bass)))
        for bass in BASSES
    ],
)
def test_every_key_is_heard_or_idle(technique: str, slapped: int, kind: str, angle: int, obstacle: str) -> None:
    lift = 'lift = {6 = "0.1 mm"}' * (obstacle == "frets")
    text = ALL_KEYS
    for name, value in (
        ("technique", technique), ("slapped", slapped), ("kind", kind), ("angle", angle), ("obstacle", obstacle),
        ("lift", lift), ("mass", "30 g" if slapped == 1 else "0 kg"),
    ):  # fmt: skip
        text = text.replace(f"{{{name}}}", str(value))
    data = tomllib.loads(text)
    written = {f"{key.section}.{key.name}" for key in KEYS if f"\n{key.name} =" in ALL_KEYS or key.name == "lift"}
    all_keys = {f"{key.section}.{key.name}" for key in KEYS if key.section and key.name != "strings"}
    # Effects follow the DI, on a mix that hides single strings; sliders have their own tests.
    others = {f"{section}.{name}" for section in ("effects", "bench", "plugin") for name in key_names(section)}
    assert all_keys - written - others == ELSEWHERE
    # Over a board the grid is finer than its step, except in the quality `reference`.
    but = {"neck.grid_step"} if obstacle == "board" else set()
    if slapped == 2 and kind == "displacement":  # a thumb's strike depends on fret 12, whose height these omit
        but |= {"player.graze_relief", "player.graze_nut_height"}
    assert assert_idle_is_not_heard(data, but) > 60


@pytest.mark.parametrize("name", of_each_kind(preset_names() + laboratory_names()))
def test_first_edits_of_a_shipped_preset_do_something(name: str) -> None:
    data = preset_tables(name)[1]
    assert not list(idle_keys(data))
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
    file.write_text(text_of(player('slapped_strings = 1\nstrike_time = "3 ms"\nstrike_force = 2')))
    good, first, second = cli_text(run, "presets", "check", file).splitlines()
    assert good.startswith(f"{file}: good; Two strings")
    assert first == f'{file}: player.slapped_strings changes no note: player.technique is "pluck"'
    assert second.startswith(f"{file}: player.strike_force, player.strike_time change no note: no string is slapped")


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ('["2 mm"]', "neck.action: 1 values for 2 strings; give one for all, or one for each"),
        ('["2 mm", 3]', "item 2 must be a text with a unit"),
        ('{unit = "mm", values = [2, 30]}', 'item 2 must be from 0 mm to 20 mm, not "30 mm"'),
        ("[]", 'must be a list such as ["1 mm", "2 mm"]'),
    ],
)
def test_a_list_in_the_neck_has_one_value_for_each_string(value: str, says: str) -> None:
    with pytest.raises(PresetError) as error:
        Builder("f").instrument(tomllib.loads(text_of(neck(f"action = {value}"))))
    assert says in str(error.value)
