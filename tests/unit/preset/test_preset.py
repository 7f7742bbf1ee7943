"""Presets: every fault gives one line naming the key, its value and the allowed ones; loaded ones can be played."""

from dataclasses import MISSING, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.command import python_output
from support.examples import costly
from support.presets import STRING_A, STRING_G
from support.presets import load_text as load

from livebass.model.instrument import note_frequency, speaking
from livebass.model.neck import Admittance, Resonance
from livebass.preset.build import LARGEST_COUNTS, MAX_FRETS, MAX_SENSING, Builder, PresetError
from livebass.preset.checks import overdamped_mode
from livebass.preset.keymap import load_key_map
from livebass.preset.keys import DATACLASSES, HAND, KEYS, Key, check_value, key_names
from livebass.preset.load import (
    laboratory_names,
    load_preset,
    preset_names,
    preset_reference,
    preset_tables,
    preset_text,
)
from livebass.rows.units import DIMENSIONS, quantity

GOOD = f"""\
name = "Test"
[neck]
scale_length = "34 in"
{STRING_A}inharmonicity = 1e-4
{STRING_G}core_diameter = "0.43 mm"
neck.action = "1.8 mm"
[[pickup]]
position = "90 mm"
[player]
technique = "pluck"
"""
GEOMETRY = 'scale_length = "34 in"\n'
MEASURED = GEOMETRY + 'fret_positions = ["48 mm", "94 mm"]\nfret_heights = {unit = "mm", values = [-1.0, -1.25]}\n'
RESONANT = GEOMETRY + 'resonance_frequencies = ["150 Hz"]\nresonance_qualities = [30]\nresonance_masses = ["1 kg"]\n'


# Checking a preset at every fret takes 0.1 s; frozen, it can be shared.
shipped = cache(load_preset)


def message(folder: Path, text: str | bytes) -> str:
    with pytest.raises(PresetError) as caught:
        load(folder, text)
    said = str(caught.value)
    assert said.isprintable(), said
    assert "mine.toml: " in said
    return said


def test_good(tmp_path: Path) -> None:
    bass = load(tmp_path, GOOD)
    low, high = bass.strings
    assert (bass.name, low.name, low.open_note, high.open_note) == ("Test", "A", 33, 43)
    assert low.length == pytest.approx(0.8636) and low.tension == 215.5
    assert low.linear_density == pytest.approx(23.88e-3) and low.diameter == pytest.approx(2.159e-3)
    assert high.tension == pytest.approx(191.67, abs=0.01)  # left out: set by the pitch
    # pi^2 x 1.5 x 200 GPa x pi d^4 / 64 / (T L^2), by hand
    assert high.inharmonicity == pytest.approx(3.475e-5, rel=1e-3)
    assert [n.fret_heights[11] for n in bass.necks] == pytest.approx([-2e-3, -1.8e-3])
    assert bass.output.pickups[0].position == pytest.approx(0.09)


STIFF = 'core_diameter = "2 mm"\nstiffness_ratio = 10\ncore_modulus = "500 GPa"'
PICKUP = 'position = "90 mm"\n'
B = "inharmonicity = 1e-4"
NOTE = 'open_note = "A1"\nlinear_density = "23.88 g/m"\ntension = "215.5 N"'
CONTROLLER = "player.position_controller must be a whole number from 0 to 119 except 6, 7, 11, 38, 64"
CHANGES = [  # text to replace in GOOD, its replacement, and the required message
    ('tension = "215.5 N"', 'tenson = "215.5 N"', ["string[A].tenson", "unknown key", "nearest: tension"]),
    ('technique = "pluck"', 'zzz = "pluck"', ["player.zzz", "unknown key", "technique", "rounding"]),
    ("[player]", "[palyer]", ["palyer", "nearest: player"]),
    ("[[pickup]]", "[[pikcup]]", ["pikcup", "nearest: pickup"]),
    ('tension = "215.5 N"', "tension = 215.5", ["string[A].tension must be", "units: N, lbf or kgf"]),
    ('tension = "215.5 N"', 'tension = "215.5 kg"', ["string[A].tension", "215.5 kg", "units: N, lbf or kgf"]),
    ('tension = "215.5 N"', 'tension = "2155 N"', ["tension", "2155 N", "5 N to 1000 N"]),
    ('tension = "215.5 N"', 'tension = "2155 lbf"', ["2155 lbf", "1.124 lbf to 224.8 lbf"]),
    ('tension = "215.5 N"', 'tension = "-5 N"', ["tension", "negative"]),
    ('tension = "215.5 N"', 'tension = "nan N"', ["tension", "units: N"]),
    ('tension = "215.5 N"', 'tension = "150 N"', ['tension = "150 N"', "45.8", "A1", "215.5 N would do"]),
    ('scale_length = "34 in"', 'scale_length = "900 in"', ["neck.scale_length", "11.81 in to 59.06 in"]),
    ('scale_length = "34 in"', "", ["neck.scale_length", "missing", "300 mm to 1500 mm"]),
    ('name = "Test"', "", ["name", "missing"]),
    ('name = "Test"', 'name = ""', ["name", "1 to 80 characters"]),
    ('open_note = "A1"', 'open_note = "H1"', ["string[A].open_note", "H1", '"E1"']),
    ('open_note = "A1"', "open_note = 200", ["open_note = 200", "0 to 127"]),
    ('name = "G"', 'name = "a"', ["string[a].name", "two strings"]),
    (NOTE, 'open_note = "A2"\nlinear_density = "5 g/m"', ["string[G].open_note", "lowest to the highest"]),
    (B, 'inharmonicity = "1e-4"', ["inharmonicity", "a number from 0 to 0.01"]),
    (B, "inharmonicity = true", ["inharmonicity must be", "a number from 0 to 0.01"]),
    (B, "inharmonicity = nan", ["inharmonicity", "a number from 0 to 0.01"]),
    (B, "", ["string[A].inharmonicity", "core_diameter"]),
    (B, B + '\ncore_diameter = "0.5 mm"', ["give either"]),
    (B, 'core_diameter = "3 mm"', ["core_diameter", "at most the diameter, 2.159 mm"]),
    (B, STIFF, ["string[A].core_diameter", "gives B", "0.01"]),
    (B, B + '\nlaw_fundamental = "65 Hz"', ["law_fundamental", "55 Hz would do"]),
    (
        B,
        B + '\nmeasured_frequencies = ["55 Hz", "110 Hz"]\nmeasured_dampings = ["1 /s"]',
        ["measured_dampings", "1 for 2"],
    ),
    (
        B,
        B + '\nmeasured_frequencies = ["55 Hz", "50 Hz"]\nmeasured_dampings = ["1 /s", "1 /s"]',
        ["measured_frequencies", "item 2", "ascend"],
    ),
    ('position = "90 mm"', 'position = "700 mm"', ["pickup[1].position", "700 mm", "the neck", "272 mm"]),
    ('position = "90 mm"', 'position = "5 mm"', ["pickup[1].position", "aperture"]),
    ('[[pickup]]\nposition = "90 mm"', "", ["pickup", "at least one"]),
    ('[[pickup]]\nposition = "90 mm"', 'pickup = "neck"', ["string[G].pickup", "unknown key"]),
    ('[[pickup]]\nposition = "90 mm"', '[output]\nkind = "laser"', ["output.kind", "pickups or displacement"]),
    ('[[pickup]]\nposition = "90 mm"', '[output]\nkind = "displacement"\nsensor = "400 mm"', ["output.sensor", "272"]),
    ('technique = "pluck"', "technique = 3", ["player.technique must be", "pluck or slap"]),
    ('technique = "pluck"', "slapped_strings = 3", ["player.slapped_strings = 3", "has 2 strings"]),
    ('technique = "pluck"', "slapped_strings = 1.0", ["slapped_strings", "whole number"]),
    ('technique = "pluck"', "pluck_nearest = 0.9\npluck_farthest = 0.6", ["player.pluck_nearest must be", "0.6"]),
    ('technique = "pluck"', "softest = 3\nhardest = 2", ["player.softest must be", "player.hardest, 2"]),
    ('technique = "pluck"', 'rounding = "5 s"', ["player.rounding", "'s'", "mm"]),
    ('neck.action = "1.8 mm"', 'neck.acton = "1.8 mm"', ["string[G].neck.acton", "nearest: action"]),
    ('neck.action = "1.8 mm"', 'neck.action = "80 mm"', ["string[G].neck.action", "0 mm to 20 mm"]),
    ('neck.action = "1.8 mm"', "neck = 3", ["string[G].neck", "must be a table"]),
    (GEOMETRY, GEOMETRY + 'lift = {6 = "3 mm"}\n', ["string[A].neck", "fret 6 stands", "above string A"]),
    (GEOMETRY, GEOMETRY + 'lift = {25 = "1 mm"}\n', ["lift", "frets 1 to 20"]),
    (GEOMETRY, GEOMETRY + 'lift = {six = "1 mm"}\n', ["neck.lift", "fret numbers"]),
    (GEOMETRY, GEOMETRY + "lift = {6 = 1}\n", ["neck.lift", "unit"]),
    (GEOMETRY, MEASURED.replace("-1.0", "0.5"), ["string[A].neck", "fret 1 stands 0.50 mm above"]),
    (GEOMETRY, MEASURED.replace("-1.0, ", ""), ["fret_heights", "1 for 2 fret_positions"]),
    (GEOMETRY, MEASURED.replace("94 mm", "40 mm"), ["fret_positions", "item 2, 40 mm", "ascend"]),
    (GEOMETRY, MEASURED.replace("94 mm", "48.5 mm"), ["fret_positions", "item 2, 48.5 mm", "at least 1 mm"]),
    (GEOMETRY, MEASURED.replace("94 mm", "900 mm"), ["fret_positions", "between 0 mm and 863.6 mm"]),
    (GEOMETRY, MEASURED.replace('"94 mm"', "94"), ["neck.fret_positions", "item 2", "units: mm"]),
    (GEOMETRY, MEASURED.replace('unit = "mm"', 'unit = "N"'), ["neck.fret_heights", "item 1", "units: mm"]),
    (GEOMETRY, MEASURED.replace('unit = "mm", ', ""), ["neck.fret_heights", 'unit = "mm", values']),
    (GEOMETRY, MEASURED + 'relief = "1 mm"\n', ["relief", "not allowed together with measured frets"]),
    (GEOMETRY, GEOMETRY + 'conductance_frequencies = ["50 Hz"]\n', ["conductance_values", "0 for 1"]),
    (
        GEOMETRY,
        GEOMETRY + 'conductance_frequencies = ["50 Hz"]\nconductance_values = ["1 m/s/N"]\n'
        'susceptance_values = ["1 m/s/N", "-1 m/s/N"]\n',
        ["neck.susceptance_values", "2 for 1 conductance_frequencies"],
    ),
    (GEOMETRY, RESONANT.replace("30]", "30, 40]"), ["neck.resonance_qualities", "2 for 1 resonance_frequencies"]),
    (GEOMETRY, RESONANT.replace('z"]', 'z", "100 Hz"]'), ["resonance_frequencies", "item 2, 100 Hz", "ascend"]),
    (GEOMETRY, RESONANT + "resonance_shapes = [41]\n", ["neck.resonance_shapes", "item 1", "0 to 40"]),
    (GEOMETRY, RESONANT + "resonance_shapes = 1\n", ["neck.resonance_shapes must be", "a list such as [1, 2]"]),
    (GEOMETRY, RESONANT.replace("1 kg", "0 kg"), ["neck.resonance_masses", "item 1", "0.001 kg to 1000 kg"]),
    (GEOMETRY, RESONANT.replace("1 kg", "1 N"), ["neck.resonance_masses", "item 1", "units: kg or g"]),
    (
        GEOMETRY,
        RESONANT + 'conductance_frequencies = ["50 Hz"]\nconductance_values = ["1 mm/s/N"]\n',
        ["neck.resonance_frequencies", "not allowed together with a table of conductances"],
    ),
    (
        GEOMETRY,
        RESONANT.replace('["150 Hz"]', '["50 Hz"]').replace("1 kg", "30 g"),
        ['neck.resonance_masses = "0.03 kg"', "item 1: shifts mode 1 at fret 0 by more than 5 %", "from 0.336"],
    ),
    (
        GEOMETRY,
        GEOMETRY + 'conductance_frequencies = ["50 Hz", "90 Hz"]\nconductance_values = ["0 m/s/N", "0 m/s/N"]\n'
        'susceptance_values = ["0.2 m/s/N", "-0.2 m/s/N"]\n',
        ['neck.susceptance_values = "0.2 m/s/N"', "shifts mode 1 at fret 0 by more than 5 %", "allowed up to 0.1"],
    ),
    (GEOMETRY, GEOMETRY + 'free_length = "5 mm"\n', ["neck.free_length", "10 mm to 1500 mm"]),
    ("[[string]]", "[string]", ["mine.toml"]),
    *(
        ('technique = "pluck"', f"position_controller = {number}", [CONTROLLER, f"not {number}"])
        for number in (6, 7, 11, 38, 64, 98, 99, 100, 101, 120, 121, 127, 128, -1)
    ),
    ('technique = "pluck"', "position_controller = 1.0", ["player.position_controller must be", "whole number"]),
    (
        B,
        B + '\nextra_damping = "10000 /s"',
        ['string[A].extra_damping = "10000 /s"', "mode 1 at fret 0", "critical", "allowed up to 7020 /s"],
    ),
    (B, B + "\nextra_damping_slope = 1", ["string[A].extra_damping_slope = 1.0:", "allowed up to 0.99"]),
    (
        B,
        B + '\nmeasured_frequencies = ["55 Hz", "110 Hz"]\nmeasured_dampings = ["1 /s", "700 /s"]',
        ['string[A].measured_dampings = "700 /s"', "item 2", "mode 2 at fret 0", "allowed up to 690 /s"],
    ),
    (
        GEOMETRY,
        GEOMETRY + 'conductance_frequencies = ["0 Hz", "1 kHz"]\nconductance_values = ["3 m/s/N", "3 m/s/N"]\n',
        ['neck.conductance_values = "3 m/s/N"', "critical", "allowed up to 1.3"],
    ),
    (
        NOTE,
        'open_note = "A3"\nlinear_density = "23.88 g/m"',
        ["string[A].tension", "left out, and A3 needs 3448 N", "5 N to 1000 N"],
    ),
    (GEOMETRY, GEOMETRY + "frets = 33\n", ["neck.frets must be", "1 to 32"]),
    (GEOMETRY, GEOMETRY + 'frets = 32\ngrid_step = "10 mm"\n', ['neck.grid_step = "10 mm"', "allowed up to 7.279 mm"]),
    (
        GEOMETRY,
        GEOMETRY
        + f'fret_positions = {{unit = "mm", values = {[20 * k for k in range(1, 34)]}}}\n'
        + f'fret_heights = {{unit = "mm", values = {[-2] * 33}}}\n',
        ["neck.fret_positions", "33 frets; there must be at most 32"],
    ),
    ('name = "Test"', 'name = "Te\\tst"', ["name must be", "1 to 80 characters in one line"]),
    ('name = "Test"', 'name = """Te\nst"""', ["name must be", "1 to 80 characters in one line"]),
    ('name = "A"', 'name = "A\\u001b"', ["string[A\\x1b].name", "1 to 20 characters in one line"]),
    (PICKUP, PICKUP + 'strings = ["A", "B"]\n', ["pickup[1].strings", '"B"', "this bass has A, G"]),
    (PICKUP, PICKUP + 'strings = ["A"]\n', ["pickup", "0 of them sense string G", "1 to 4"]),
    ("[[pickup]]\n" + PICKUP, 5 * ("[[pickup]]\n" + PICKUP), ["5 of them sense string A", "1 to 4"]),
    (PICKUP, PICKUP + "strings = []\n", ["pickup[1].strings must be", '["E", "A"]']),
    (PICKUP, PICKUP + 'strings = "A"\n', ["pickup[1].strings", '["E", "A"]']),
    (PICKUP, PICKUP + 'strings = ["A", 3]\n', ["pickup[1].strings", "item 2", "1 to 20 characters"]),
]


@pytest.mark.parametrize(("old", "new", "says"), CHANGES, ids=[f"{i}-{c[2][0]}" for i, c in enumerate(CHANGES)])
def test_error(tmp_path: Path, old: str, new: str, says: list[str]) -> None:
    assert old in GOOD
    text = GOOD.replace(old, new, 1)
    if "fret_positions" in new:  # the G string needs geometry
        text = text.replace('neck.action = "1.8 mm"\n', "")
    said = message(tmp_path, text)
    assert [s for s in says if s not in said] == [], said


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    ("mark", "encoding"),
    [
        (b"", "utf-8"), (b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"),
        (b"", "utf-16-le"), (b"", "utf-16-be"),
    ],
)  # fmt: skip
def test_a_text_is_read_as_editors_and_powershell_write_it(
    tmp_path: Path, mark: bytes, encoding: str, end: str
) -> None:
    text = f"# {'一' * 30} für\n{GOOD}".replace("\n", end)
    assert load(tmp_path, mark + text.encode(encoding)) == load(tmp_path, GOOD)
    keys = f"# für\n[keys]{end}ghost = 22{end}"
    (tmp_path / "keys.toml").write_bytes(mark + keys.encode(encoding))
    assert load_key_map(str(tmp_path / "keys.toml")).keys == ((22, "ghost", 0),)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "empty"),
        (b"\n  \n", "empty"),
        (b"# only a comment\n", "name: missing"),
        (b'name = "x"\n[neck]\nscale_length = "34 in"\n', "at least one [[string]]"),
        (b'name = "\xff"\n', "not UTF-8 (byte 8: line 1, column 9); a preset is a TOML text file: save it as UTF-8"),
        ('name = "x"\r\n# für'.encode("latin-1"), "not UTF-8 (byte 15: line 2, column 4)"),
        ('name = "ü"\n# x'.encode("utf-16")[:-1], "not UTF-16 (byte 28: line 2, column 3)"),
        (b"MThd\0\0\0\6\0\0\0\1\1\xe0", "a MIDI file; a preset is a TOML text file"),
        (b"! a.scl\n!\nscale\n 12\n", "a Scala scale; a preset is a TOML text file"),
        (b'<?xml version="1.0"?><score-partwise/>', "a MusicXML file; a preset"),
        (b"name = \n", "line 1"),
        ('name = "x"\n[neck]\naction = \u201c2 mm\u201d\n'.encode(), "line 3, column 10); write straight quotes"),
        (b"[neck]\nscale_length = 0,86\n", "line 2, column 17); write a decimal point"),
        (b'like = "slap"\nname = "x"\n[neck]\nrelief = "0,3 mm"\n', "a length needs a decimal point, not a comma"),
        (b"[neck]\nscale_length = 34 in\n", "line 2, column 19); put a value and its unit in quotes"),
        (b'[effects]\nresponse = "C:\\Users\\me\\cab.wav"\n', "line 2, column 17); write / for each \\ of a path"),
        (b"name = Jazz\n", "line 1, column 8); put text in quotes"),
        (b"[neck\naction = 2\n", "line 1, column 6)"),
        (b'[a]\n[a."b c"]\n[a."b c"]\n', "Cannot declare a.b c twice"),
        (b"a = " + b"[" * 20000, "not TOML"),
        (b"name = 0x" + b"f" * 9000, "a huge number"),
        (b"name = 1979-05-27T07:32:00Z\n", "characters"),
        (b"#" * 1_000_001, "at most 1000000"),
        (b'string = 3\nname = "x"\n', "[[string]] tables"),
        (b'name = "x"\nneck = 3\n', "neck must be a table"),
        (b'name = "x"\nstring = [3]\n', "string[1] must be a table"),
        (b'name = "x"\nplayer = []\n[neck]\nscale_length = "1 m"\n', "string"),
        (b"\xef\xbb\xbfnmae = 1\n", "nearest: name"),
    ],
)
def test_file_error(tmp_path: Path, content: bytes, says: str) -> None:
    assert says in message(tmp_path, content)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("jaz-finger", "nearest: jazz-finger"),
        ("", "there is "),
        ("no/such/file", "no such file"),
        ("nothing.toml", "no such file"),
        ("./", "is a directory"),
        ("/dev/null", "not a regular file"),
        ("a\0/b", "not a file name"),
        ("a" * 5000 + ".toml", "cannot be read"),
        ("bad\nname", "unknown"),
        ("\ud800.toml", "not a file name"),
    ],
)
def test_name_error(name: str, says: str) -> None:
    with pytest.raises(PresetError) as caught:
        load_preset(name)
    assert says in str(caught.value) and str(caught.value).isprintable()


@pytest.mark.parametrize("number", [0, 1, 5, 74, 119])
def test_free_controllers(tmp_path: Path, number: int) -> None:
    bass = load(tmp_path, GOOD.replace('technique = "pluck"', f"position_controller = {number}"))
    assert bass.player.position_controller == number


def test_split_coil(tmp_path: Path) -> None:
    halves = 'position = "90 mm"\nstrings = ["g"]\n[[pickup]]\nposition = "110 mm"\nstrings = ["A"]\n'
    bass = load(tmp_path, GOOD.replace(PICKUP, halves))
    assert [p.strings for p in bass.output.pickups] == [("G",), ("A",)]


def test_limits_are_what_the_engine_has_room_for() -> None:
    from livebass.kernels.player.performer import MAX_STRINGS
    from livebass.kernels.string.records import MAX_NEAR, VOICE

    assert LARGEST_COUNTS["string"] == MAX_STRINGS
    assert VOICE["mix"].shape[0] == MAX_SENSING
    assert MAX_NEAR == MAX_FRETS == int(next(k.maximum for k in KEYS if k.name == "frets"))


@costly()
@given(
    mute=st.sampled_from([0.0, 100.0, 1000.0, 1500.0, 2000.0, 10000.0]),
    slope=st.sampled_from([0.0, 0.1, 0.5, 0.9, 0.98, 0.99, 1.0]),
    angle=st.sampled_from([0.0, 0.01, 0.5]),
    admittance=st.sampled_from([0.0, 0.01, 0.1, 1.0]),
    inharmonicity=st.sampled_from([0.0, 1e-4, 0.01]),
    law=st.sampled_from([0.0, 41.0]),
    softness=st.sampled_from([1.0, 0.1]),
    measured=st.sampled_from([(), (1.0, 0.0, 3.0)]),
)
def test_no_overdamped_mode_is_overlooked(
    mute: float, slope: float, angle: float, admittance: float, inharmonicity: float, law: float, softness: float,
    measured: tuple[float, ...],
) -> None:  # fmt: skip
    """Of u and of v, on a neck with every fifth fret. A value offered by the message is accepted too."""
    import numpy as np

    from livebass.model.modes import dampings, frequencies

    bass = shipped("jazz-finger")
    string = replace(
        bass.strings[0], extra_damping=mute, extra_damping_slope=slope, viscoelastic_angle=angle,
        inharmonicity=inharmonicity, law_fundamental=law, measured_dampings=measured,
        measured_frequencies=tuple(41.0 * j for j in range(1, len(measured) + 1)),
    )  # fmt: skip
    table = ((30.0, admittance, 0.0), (300.0, 0.0, 0.0), (2000.0, admittance, 0.0))
    full = bass.necks[0]
    neck = replace(
        full, admittance=Admittance(table=table), stiffness_across=softness,
        fret_positions=full.fret_positions[::5], fret_heights=full.fret_heights[::5],
    )  # fmt: skip
    worst = 0.0
    for fret in range(len(neck.fret_positions) + 1):
        s = speaking(string, neck, fret)
        count = s.grid_points - 1
        for v in (False, True):
            worst = max(worst, np.max(dampings(s, count, across=v) / (2 * np.pi * frequencies(s, count, across=v))))
    found = overdamped_mode(string, neck)
    assert (found is not None) == (worst > 0.999)
    if found and found.key in ("extra_damping", "extra_damping_slope", "viscoelastic_angle") and found.allowed > 0:
        assert overdamped_mode(replace(string, **{found.key: found.allowed}), neck) is None


def test_a_neck_gives_way(tmp_path: Path) -> None:
    """Resonances are as written, with default shapes by order; a string's own neck replaces the shared one."""
    shared = (
        'resonance_frequencies = ["150 Hz", "0.3 kHz"]\nresonance_qualities = [30, 12.5]\n'
        'resonance_masses = ["1 kg", "500 g"]\nfree_length = "510 mm"\n'
    )
    own = 'neck.conductance_frequencies = ["90 Hz"]\nneck.conductance_values = ["2 mm/s/N"]\n'
    text = GOOD.replace(GEOMETRY, GEOMETRY + shared)
    bass = load(tmp_path, text.replace('neck.action = "1.8 mm"\n', own))
    assert bass.necks[0].admittance == Admittance((Resonance(150.0, 30.0, 1.0, 1), Resonance(300.0, 12.5, 0.5, 2)))
    assert bass.necks[1].admittance == Admittance(table=((90.0, 2e-3, 0.0),))
    assert [n.free_length for n in bass.necks] == [0.51, 0.51]
    own = own + 'neck.susceptance_values = ["-1 mm/s/N"]\n'
    (_, moved) = load(tmp_path, text.replace('neck.action = "1.8 mm"\n', own)).necks
    assert moved.admittance.table == ((90.0, 2e-3, -1e-3),)
    own = 'neck.resonance_masses = ["2 kg", "1 kg"]\nneck.action'
    (_, heavy) = load(tmp_path, text.replace("neck.action", own)).necks
    assert [r.mass for r in heavy.admittance.resonances] == [2.0, 1.0]
    (_, other) = load(tmp_path, text.replace("neck.action", "neck.resonance_shapes = [3, 0]\nneck.action")).necks
    assert [r.shape for r in other.admittance.resonances] == [3, 0]


@pytest.mark.parametrize("mass", [0.02, 0.1, 0.3])
def test_what_is_said_to_be_heavy_enough_is(mass: float) -> None:
    bass = shipped("jazz-finger")
    resonance = Resonance(45.0, 20.0, mass)
    found = overdamped_mode(bass.strings[0], replace(bass.necks[0], admittance=Admittance((resonance,))))
    assert found and found.key == "resonance_masses" and found.item == 1 and found.allowed > found.value == mass
    heavier = Admittance((replace(resonance, mass=found.allowed),))
    assert overdamped_mode(bass.strings[0], replace(bass.necks[0], admittance=heavier)) is None


@pytest.mark.parametrize("measured", [(), (1.0, 1.0)], ids=["by the law", "measured"])
def test_a_v_that_cannot_ring_is_named(measured: tuple[float, ...]) -> None:
    """On a neck softer across, v may die where u rings, whatever was measured of u."""
    bass = shipped("jazz-finger")
    nu = tuple(98.0 * j for j in range(1, len(measured) + 1))
    string = replace(bass.strings[3], measured_frequencies=nu, measured_dampings=measured)
    table = ((240.0, 0.0, 0.0), (245.0, 3.0, 0.0), (320.0, 3.0, 0.0), (330.0, 0.0, 0.0))  # felt across about 90 Hz
    neck = replace(bass.necks[3], admittance=Admittance(table=table), stiffness_across=0.1, axes_turned=0.0)
    assert overdamped_mode(string, replace(neck, stiffness_across=1.0)) is None
    found = overdamped_mode(string, neck)
    assert found and found.across and (found.fret, found.mode, found.key) == (0, 1, "conductance_values")
    assert "damps mode 1 of the motion across at fret 0 beyond critical" in found.why("conductance")
    part = found.allowed / found.value
    weaker = Admittance(table=tuple((f, part * y, 0.0) for f, y, _ in table))
    assert 0.1 < part < 1 and overdamped_mode(string, replace(neck, admittance=weaker)) is None


def test_no_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    path = tmp_path / "my.toml"
    path.write_text(GOOD)
    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(PresetError, match=r"my\.toml: no permission"):
        load_preset(path)


def test_shipped_names() -> None:
    assert set(preset_names()) >= {"paper-g", "paper-bass", "jazz-finger", "precision-finger", "slap", "muted"}


@pytest.mark.parametrize("name", [*preset_names(), *laboratory_names()])
def test_a_preset_that_ships_passes_the_checks_that_loading_it_omits(name: str) -> None:
    label, tables = preset_tables(name)
    assert Builder(label).instrument(tables) == load_preset(name)


@pytest.mark.parametrize("name", preset_names())
def test_shipped_preset_sounds_at_every_fret(name: str) -> None:
    bass = shipped(name)
    assert bass.name and bass.description
    for string, neck in zip(bass.strings, bass.necks, strict=True):
        for fret in range(len(neck.fret_positions) + 1):
            note = speaking(string, neck, fret)
            assert note.stop == fret, f"{name}, string {string.name}: fret {fret} is choked by fret {note.stop}"


def test_paper_g_is_the_paper() -> None:
    bass = load_preset("paper-g")
    (g,), (neck,) = bass.strings, bass.necks
    figures = (g.length, g.tension, g.linear_density, g.diameter, g.inharmonicity, g.law_fundamental)
    assert figures == pytest.approx((0.863, 191.6, 6.69e-3, 1.14e-3, 3.5e-5, 97.976), rel=1e-9)
    assert len(g.measured_frequencies) == len(g.measured_dampings) == 34
    assert (g.measured_frequencies[0], g.measured_dampings[7]) == (97.97319798, 3.506936363)
    assert len(neck.fret_positions) == 20
    assert neck.fret_heights[5] == pytest.approx(-1.73e-3) and neck.fret_positions[5] == pytest.approx(0.253)
    assert bass.output.kind == "displacement" and bass.output.sensor == pytest.approx(0.009)
    assert bass.player.rounding == pytest.approx(5e-3)


@pytest.mark.parametrize("name", preset_names())
def test_text_is_the_same_preset(name: str, tmp_path: Path) -> None:
    assert load(tmp_path, preset_text(name)) == shipped(name)


def test_text_lists_defaults() -> None:
    assert 'player.out_of_range = "transpose"' in preset_text("paper-g")


def test_reference_has_each_key_once() -> None:
    rows = preset_reference().splitlines()[2:]
    assert len(rows) == len(KEYS)
    assert all(row.count("|") == 5 for row in rows)
    assert "| `string.tension` | from 5 N to 1000 N |" in preset_reference()


def limits() -> list[Any]:
    """Cases of every key with limits: both ends, and a value a little beyond each."""
    cases = []
    for key in KEYS:
        kind = key.kind.removesuffix("[]")
        if kind in DIMENSIONS or kind in ("number", "integer"):
            for end, beyond in ((key.minimum, -1.0), (key.maximum, 1.0)):
                number, _, unit = end.partition(" ")
                far = float(number) + beyond * (1 if kind == "integer" else 1e-6 * (abs(float(number)) or 1.0))
                cases.append(pytest.param(key, number, f"{far:.17g}", unit, id=f"{key.section}.{key.name}-{end}"))
    return cases


@pytest.mark.parametrize(("key", "end", "far", "unit"), limits())
def test_limits(key: Key, end: str, far: str, unit: str) -> None:
    number = int if key.kind.removesuffix("[]") == "integer" else float

    def written(text: str) -> Any:
        value = f"{text} {unit}" if unit else number(float(text))
        return [value] if key.kind.endswith("[]") else value

    check_value(key, written(end))
    with pytest.raises(ValueError, match=r" to |negative"):
        check_value(key, written(far))


@pytest.mark.parametrize("key", [k for k in KEYS if k.section in DATACLASSES], ids=lambda k: f"{k.section}.{k.name}")
def test_default_is_the_instruments_own(key: Key) -> None:
    own = {f.name: f.default for f in fields(DATACLASSES[key.section])}
    if key.default in (MISSING, None):
        assert own.get(key.name, MISSING) in (MISSING, (), 0.0, None)
    elif key.kind == "key map":
        assert load_key_map(check_value(key, key.default)) == own[key.name]
    elif own.get(key.name, MISSING) is not MISSING:
        near = {"rel": 1e-3} if key.kind == "angle" else {}  # degrees are written with three digits
        assert check_value(key, key.default) == pytest.approx(own[key.name], **near)


@pytest.mark.parametrize("section", ["output", "pickup", "coil", "player", "pick"])
def test_every_field_has_a_key(section: str) -> None:
    made_elsewhere = {"pickups", "coil", "pick"}
    of_fields = {name for name in key_names(section) if not name.startswith(HAND)}  # the hand's keys make a neck
    assert {f.name for f in fields(DATACLASSES[section])} - made_elsewhere == of_fields


# Few leaves: a fault shows in a small tree too, and hypothesis takes ten times as long to draw a large one.
scalars = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12)
values = st.recursive(
    scalars, lambda v: st.lists(v, max_size=3) | st.dictionaries(st.text(max_size=8), v, max_size=3), max_leaves=6
)
names = st.sampled_from([k.name for k in KEYS] + ["neck", "string", "pickup", "player", "coil", "output", "effects"])
trees = st.recursive(
    values,
    lambda v: st.dictionaries(names | st.text(max_size=6), v, max_size=6) | st.lists(v, max_size=2),
    max_leaves=8,
)


@costly()
@given(st.dictionaries(names | st.text(max_size=6), trees, max_size=8))
def test_garbage_tables_give_preset_errors(data: dict[str, Any]) -> None:
    with pytest.raises(PresetError) as caught:
        Builder("f").instrument(data)
    assert str(caught.value).isprintable()


@given(st.sampled_from(GOOD.splitlines()), st.sampled_from(KEYS), values)
def test_one_garbage_value_gives_a_preset_or_its_error(line: str, key: Key, value: Any) -> None:
    import tomllib

    data = tomllib.loads(GOOD.replace(line + "\n", "", 1)) if "[" not in line else tomllib.loads(GOOD)
    where = data if not key.section else data.setdefault(key.section, {})
    (where[0] if isinstance(where, list) else where)[key.name] = value
    try:
        Builder("f").instrument(data)
    except PresetError as error:
        assert str(error).isprintable()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=200))
def test_garbage_files_give_preset_errors(tmp_path: Path, content: bytes) -> None:
    message(tmp_path, content)


@given(st.text(max_size=40).filter(lambda s: s not in preset_names()))
def test_garbage_names_give_preset_errors(name: str) -> None:
    with pytest.raises(PresetError) as caught:
        load_preset(name)
    assert str(caught.value).isprintable()


def some(key: Key) -> st.SearchStrategy[Any]:
    """Allowed values of `key`, both ends included."""
    if "|" in key.kind:
        return st.sampled_from(key.kind.split("|"))
    if " " in key.minimum:
        low, high = quantity(key.minimum, key.kind), quantity(key.maximum, key.kind)
        scale = DIMENSIONS[key.kind].units[next(iter(DIMENSIONS[key.kind].units))]
        unit = next(iter(DIMENSIONS[key.kind].units))
        ends = st.sampled_from([key.minimum, key.maximum])
        return ends | spread(low / scale, high / scale).map(lambda v: f"{v:.15g} {unit}")
    if key.kind == "controller":
        return st.sampled_from([0, 1, 16, 119])
    if key.kind == "integer":
        return st.integers(int(key.minimum), int(key.maximum))
    return st.sampled_from([float(key.minimum), float(key.maximum)]) | spread(float(key.minimum), float(key.maximum))


def spread(low: float, high: float) -> st.SearchStrategy[float]:
    """Values between the ends, log-uniform over at most six decades, to make small values likely.

    Uniform if an end is not positive.
    """
    if high <= 0.0:
        return st.floats(low, high)
    minimum = max(low, high * 1e-6)
    return st.floats(0.001, 0.999).map(lambda part: minimum * (high / minimum) ** part)


APART = ("note", "text", "lift", "tuning", "key map", "curve", "sound file")  # kinds with their own values
PLAIN = [k for k in KEYS if k.section and k.kind not in APART and not k.kind.endswith("[]")]
TAKEN_CARE_OF = {"core_diameter", "law_fundamental", "linear_density", "tension", "scale_length"}


@st.composite
def presets(draw: st.DrawFn) -> dict[str, Any]:
    """A preset of one string with up to eight keys at random values; some cannot be loaded."""
    note, scale = draw(st.sampled_from([28, 43, 12, 60, 84])), draw(st.sampled_from([0.8636, 0.3, 1.5]))
    density = draw(spread(5.0, 1000.0)) / (2 * scale * note_frequency(note)) ** 2 * 1e3  # g/m
    string: dict[str, Any] = {"name": "E", "open_note": note, "diameter": "2 mm", "inharmonicity": 1e-4}
    string["linear_density"] = f"{min(max(density, 0.1), 200)} g/m"
    data: dict[str, Any] = {"name": "x", "neck": {"scale_length": f"{scale} m"}, "string": [string]}
    data["pickup"] = [{"position": "15 mm"}]
    free = [k for k in PLAIN if k.name not in TAKEN_CARE_OF]
    for key in draw(st.lists(st.sampled_from(free), max_size=8, unique_by=lambda k: (k.section, k.name))):
        where = data.setdefault(key.section, {})
        (where[0] if isinstance(where, list) else where)[key.name] = draw(some(key))
    if draw(st.booleans()):
        string["extra_damping"] = f"{draw(spread(1.0, 10000.0)):.6g} /s"
    if draw(st.booleans()):
        data["neck"]["frets"], data["neck"]["grid_step"] = draw(st.integers(20, 32)), f"{draw(spread(0.2, 10))} mm"
    return data


@costly(suppress_health_check=[HealthCheck.too_slow])
@given(presets())
def test_what_loads_can_be_rendered(data: dict[str, Any]) -> None:
    from livebass.engine.engine import Engine
    from livebass.model.quality import QUALITIES

    try:
        bass = Builder("f").instrument(data)
    except PresetError as error:
        assert str(error).isprintable()
        return
    Engine(bass, QUALITIES["live"], 48000, workers=1)


def test_a_bass_is_the_same_whatever_linear_algebra_the_processor_has() -> None:
    """OpenBLAS rounds differently on other processors; no instrument may depend on that."""
    code = (
        "import hashlib; from livebass import load_preset; from livebass.plugin.instrument import image_file\n"
        "for name in ('fretless', 'jazz-finger'):\n"
        "    print(hashlib.sha256(image_file(load_preset(name))).hexdigest())\n"
    )
    cores = ("Prescott", "Haswell", "SkylakeX")
    assert len({python_output("-c", code, env={"OPENBLAS_CORETYPE": core}) for core in cores}) == 1
