"""Tuning: a string's physics under another tension, a capo is a permanent stop, defaults change nothing."""

from __future__ import annotations

import itertools
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.command import Run, refusal
from support.costs import quick
from support.own_basses import load_preset

from livebass.model import modes
from livebass.model.bench import change_bass
from livebass.model.instrument import Instrument, note_frequency, speaking, tension_string
from livebass.model.tuning import tune_string
from livebass.preset.build import Builder, PresetError
from livebass.preset.load import preset_names, preset_tables
from livebass.preset.tuning import TEMPERAMENTS, open_strings, temperament_of_file, tuning_of
from livebass.rows.techniques import TUNINGS
from livebass.rows.units import cents, note_number

load = cache(load_preset)  # checking a preset at every fret takes 0.1 s; frozen, it can be shared


def notes(text: str) -> list[int]:
    return [note_number(name) for name in text.split()]


def opens(bass: Instrument) -> list[int]:
    return [string.open_note for string in bass.strings]


@pytest.mark.parametrize("preset", ["five-string", "six-string"])
def test_a_low_b_is_as_stiff_as_real_ones(preset: str) -> None:
    """Partial 10 lies 26 cents above the law of an ideal string, and 100 at fret 12."""
    bass = load(preset)
    for fret, stretched in ((0, 26), (12, 100)):
        s = speaking(bass.strings[0], bass.necks[0], fret)
        nu = modes.frequencies(s, 10)
        assert cents(nu[9] / (10 * nu[0])) == pytest.approx(stretched, abs=2), fret
    low = bass.strings[0]
    assert low.nominal_fundamental == pytest.approx(note_frequency(23), rel=1e-3)


def test_the_high_c_goes_on_with_the_other_strings() -> None:
    *_, g, c = load("six-string").strings
    assert c.nominal_fundamental == pytest.approx(note_frequency(48), rel=1e-3)
    stiffness = [s.inharmonicity * s.tension * s.length**2 for s in (g, c)]
    assert stiffness[1] / stiffness[0] == pytest.approx((c.diameter / g.diameter) ** 1.8, rel=0.03)
    assert c.linear_density / g.linear_density == pytest.approx((c.diameter / g.diameter) ** 2, rel=0.03)


@pytest.mark.parametrize("preset", preset_names())
def test_the_usual_tuning_changes_nothing(preset: str) -> None:
    assert load_preset(preset, tuning="standard", capo=0, a4=440, temperament=[0.0] * 12) == load(preset)


@pytest.mark.parametrize(
    ("preset", "tuning", "expected"),
    [
        ("jazz-finger", "drop-d", "D1 A1 D2 G2"), ("jazz-finger", "Drop D", "D1 A1 D2 G2"),
        ("jazz-finger", "half-step-down", "D#1 G#1 C#2 F#2"), ("jazz-finger", "whole_step_down", "D1 G1 C2 F2"),
        ("jazz-finger", "drop-db", "C#1 G#1 C#2 F#2"), ("jazz-finger", "drop-c", "C1 G1 C2 F2"),
        ("jazz-finger", "bead", "B0 E1 A1 D2"), ("jazz-finger", "tenor", "A1 D2 G2 C3"),
        ("jazz-finger", "d1, a1, 38, 97.5 Hz", "D1 A1 D2 G2"), ("five-string", "drop-d", "B0 D1 A1 D2 G2"),
        ("six-string", "drop-a", "A0 E1 A1 D2 G2 C3"),
    ],
)  # fmt: skip
def test_tunings(preset: str, tuning: str, expected: str) -> None:
    assert opens(load_preset(preset, tuning=tuning)) == notes(expected)


WRITTEN = {
    "EADG": "E1 A1 D2 G2", "eadg": "E1 A1 D2 G2", "E A D G": "E1 A1 D2 G2", "D G C F": "D1 G1 C2 F2",
    "D'G'C'F'": "D1 G1 C2 F2", "d, g, c, f": "D1 G1 C2 F2", "D-G-C-F": "D1 G1 C2 F2", "DGCF": "D1 G1 C2 F2",
    "DADG": "D1 A1 D2 G2", "D1-A1-D2-G2": "D1 A1 D2 G2", "d1a1d2g2": "D1 A1 D2 G2", "D A D2 G": "D1 A1 D2 G2",
    "eb": "D#1 G#1 C#2 F#2", "Eb standard": "D#1 G#1 C#2 F#2", "E\u266d Standard": "D#1 G#1 C#2 F#2",
    "e flat": "D#1 G#1 C#2 F#2", "D#": "D#1 G#1 C#2 F#2", "E\u266d A\u266d D\u266d G\u266d": "D#1 G#1 C#2 F#2",
    "EbAbDbGb": "D#1 G#1 C#2 F#2", "ebabdbgb": "D#1 G#1 C#2 F#2", "EBABDBGB": "D#1 G#1 C#2 F#2",
    "D\u266fG\u266fC\u266fF\u266f": "D#1 G#1 C#2 F#2", "d#-g#-c#-f#": "D#1 G#1 C#2 F#2",
    "D standard": "D1 G1 C2 F2", "c#": "C#1 F#1 B1 E2", "C standard": "C1 F1 A#1 D#2", "B": "B0 E1 A1 D2",
    "F": "F1 A#1 D#2 G#2", "drop d": "D1 A1 D2 G2", "dropD": "D1 A1 D2 G2", "DROP-D": "D1 A1 D2 G2",
    "Drop D tuning": "D1 A1 D2 G2", "drop c#": "C#1 G#1 C#2 F#2", "dropC": "C1 G1 C2 F2", "Drop B": "B0 F#1 B1 E2",
    "Half Step Down": "D#1 G#1 C#2 F#2", "1/2 step down": "D#1 G#1 C#2 F#2", "BEAD": "B0 E1 A1 D2",
    "B E A D": "B0 E1 A1 D2", "A D G C": "A1 D2 G2 C3",
}  # fmt: skip


@pytest.mark.parametrize("written", WRITTEN)
def test_a_tuning_as_players_write_it(written: str) -> None:
    bass = load("jazz-finger")
    wanted = notes(WRITTEN[written])
    assert [s.note for s in open_strings(opens(bass), tuning_of(written), 440, ())] == wanted
    if " " in written:
        assert [s.note for s in open_strings(opens(bass), tuning_of(written.swapcase()), 440, ())] == wanted


@pytest.mark.parametrize(
    ("own", "written", "wanted"),
    [
        ("B0 E1 A1 D2 G2", "BEADG", "B0 E1 A1 D2 G2"), ("B0 E1 A1 D2 G2", "beadg", "B0 E1 A1 D2 G2"),
        ("B0 E1 A1 D2 G2", "Bb Eb Ab Db Gb", "A#0 D#1 G#1 C#2 F#2"), ("B0 E1 A1 D2 G2", "eb", "A#0 D#1 G#1 C#2 F#2"),
        ("E1 A1 D2 G2 B2 E3", "eadgbe", "E1 A1 D2 G2 B2 E3"), ("E1 A1 D2 G2 B2 E3", "EADGBE", "E1 A1 D2 G2 B2 E3"),
        ("G2", "F", "F2"), ("G2", "Gb", "F#2"), ("E1 A1", "E E", "E1 E2"), ("E1 A1", ["E", "d"], "E1 D2"),
        ("E1 A1", [28, "B"], "E1 B1"), ("E1 A1", "41.2 Hz A", "E1 A1"), ("E1 A1", "D\u266f 58.27Hz", "D#1 A#1"),
    ],
)  # fmt: skip
def test_octaves_are_those_nearest_to_the_strings_of_the_bass(own: str, written: object, wanted: str) -> None:
    assert [s.note for s in open_strings(notes(own), tuning_of(written), 440, ())] == notes(wanted)


@pytest.mark.parametrize(
    "text", ["E1 A1 D2 G2", "e1,a1,d2,g2", "28 33 38 43", "C-1 D1 Bb0 G\u266d2", "41.2 Hz, A1, 38 97.5Hz"]
)
def test_a_tuning_with_octaves_is_what_it_says_whatever_the_bass(text: str) -> None:
    found = tuning_of(text)
    names = text.replace(" Hz", "Hz").replace(",", " ").split()
    assert found == tuple(float(name[:-2]) if name.endswith("Hz") else note_number(name) for name in names)


def test_every_named_tuning_fits_some_bass() -> None:
    for name in TUNINGS:
        assert load_preset("six-string", tuning=name).strings
        assert tuning_of(name) == name


def test_tension_stiffness_and_pull_follow_the_pitch() -> None:
    default, dropped = load("jazz-finger"), load_preset("jazz-finger", tuning="drop-d")
    before, after = default.strings[0], dropped.strings[0]
    ratio = 2 ** (-2 / 12)
    assert after.tension == pytest.approx(before.tension * ratio**2)
    assert after.inharmonicity == pytest.approx(before.inharmonicity / ratio**2)
    assert after.slack == pytest.approx(1.26, abs=0.001)  # the factor by which the same force pulls it farther
    assert after.linear_density == before.linear_density and after.length == before.length
    assert dropped.strings[1:] == default.strings[1:] and dropped.necks == default.necks
    s, t = (speaking(bass.strings[0], bass.necks[0], 7) for bass in (default, dropped))
    assert t.bending == pytest.approx(s.bending)
    assert cents(modes.frequencies(t, 1)[0] / modes.frequencies(s, 1)[0]) == pytest.approx(-200, abs=0.01)
    assert load("drop-d").strings[0].tension == pytest.approx(after.tension, rel=1e-4)


@pytest.mark.parametrize("preset", ["jazz-finger", "paper-g", "fretless"])
def test_another_a_moves_every_note_alike(preset: str) -> None:
    default, lower = load(preset), load_preset(preset, a4=432)
    assert lower.a4 == 432 and default.a4 == 440
    for string, other, neck in zip(default.strings, lower.strings, default.necks, strict=True):
        for fret in (0, 1, 12):
            nu = [modes.frequencies(speaking(each, neck, fret), 1)[0] for each in (string, other)]
            assert cents(nu[1] / nu[0]) == pytest.approx(cents(432 / 440), abs=0.5)  # the neck moves measured modes


def test_measured_modes_follow_the_tension() -> None:
    """The law's modes, under another tension, are the string's modes there."""
    string = replace(load("jazz-finger").strings[0], measured_dampings=(1.0,) * 8)
    j = np.arange(1, 9)

    def law(f0: float, inharmonicity: float) -> tuple[float, ...]:
        return tuple((j * f0 * np.sqrt(1 + inharmonicity * j**2)).tolist())

    f0 = string.nominal_fundamental
    string = replace(string, law_fundamental=f0, measured_frequencies=law(f0, string.inharmonicity))
    other = tension_string(string, 0.8)
    assert other.measured_frequencies == pytest.approx(law(0.8 * f0, other.inharmonicity), rel=1e-12)
    assert other.nominal_fundamental == pytest.approx(0.8 * f0) == pytest.approx(other.law_fundamental)


def test_a_temperament_bends_each_pitch_class_by_its_tension() -> None:
    offsets = [3.0 * k - 20 for k in range(12)]
    default, other = load("jazz-finger"), load_preset("jazz-finger", temperament=offsets)
    for string, bent, neck in zip(default.strings, other.strings, default.necks, strict=True):
        for fret in range(len(neck.fret_positions) + 1):
            s, t = speaking(string, neck, fret), speaking(bent, neck, fret)
            wanted = offsets[(string.open_note + fret) % 12]
            nu = [modes.frequencies(each, 1)[0] for each in (s, t)]
            assert cents(nu[1] / nu[0]) == pytest.approx(wanted, abs=0.01)
            assert t.string.tension / s.string.tension == pytest.approx(2 ** (2 * wanted / 1200))
            assert t.bending == pytest.approx(s.bending)
            assert (t.length, t.contact_position, t.contact_height) == (s.length, s.contact_position, s.contact_height)


def test_a_temperament_of_one_value_a_string() -> None:
    bass = load_preset("jazz-finger", temperament=[-7, 0, 0, 12], a4=442)
    for string, own in zip(bass.strings, (-7, 0, 0, 12), strict=True):
        for note in (string.open_note, string.open_note + 3):
            assert cents(string.frequency(note) / note_frequency(note)) == pytest.approx(cents(442 / 440) + own)


@pytest.mark.parametrize("name", TEMPERAMENTS)
def test_temperaments_by_name_keep_the_a_and_have_the_fifths_they_are_known_for(name: str) -> None:
    offsets = TEMPERAMENTS[name]
    pure, comma = cents(1.5) - 700, 23.46
    fifths = [offsets[(k + 7) % 12] - offsets[k] - pure for k in range(12)]
    narrow = {
        "equal": 12 * [-comma / 12],
        "pythagorean": 11 * [0.0] + [-comma],
        "meantone": 11 * [-21.506 / 4] + [11 * 21.506 / 4 - comma],
        "werckmeister": 8 * [0.0] + 4 * [-comma / 4],
        "kirnberger": 7 * [0.0] + 4 * [-21.506 / 4] + [21.506 - comma],
        "vallotti": 6 * [0.0] + 6 * [-comma / 6],
        "just": 9 * [0.0] + [-21.506, -21.506, 2 * 21.506 - comma],
    }
    assert offsets[9] == 0 and sorted(fifths) == pytest.approx(sorted(narrow[name]), abs=0.03)
    bass = load_preset("jazz-finger", temperament=name)
    assert bass == load_preset("jazz-finger", temperament=offsets)
    assert bass.strings[1].frequency(45) == pytest.approx(110)


SCALA = "! a comment\nWerckmeister III\n 12\n!\n 256/243\n 192.18 E\n 32/27\n 390.225\n 4/3\n 1024/729\n"
SCALA += " 696.09\n 128/81\n 888.27\n 16/9\n 1092.18\n 2/1\n"


def test_a_temperament_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "w.scl").write_text(SCALA)
    (tmp_path / "w.txt").write_text(" 1, 2\n3.5 " + 9 * " 0")
    assert temperament_of_file(str(tmp_path / "w.scl")) == pytest.approx(TEMPERAMENTS["werckmeister"], abs=0.02)
    assert temperament_of_file(str(tmp_path / "w.txt")) == (1, 2, 3.5, *(9 * [0]))


def kbm(*keys: object, middle: int = 60, reference: int = 69, hertz: float = 440.0, octave: int = 12) -> str:
    head = [len(keys), 0, 127, middle, reference, hertz, octave]
    return "! a mapping\n" + "\n".join(map(str, [*head, *keys])) + "\n"


def test_a_scale_with_a_keyboard_mapping(tmp_path: Path) -> None:
    """Pitches by hand: the reference key has its frequency, the others stand above it as in the scale."""

    def offsets(scale: str, mapping: str) -> tuple[float, ...]:
        (tmp_path / "w.scl").write_text(scale)
        (tmp_path / "w.kbm").write_text(mapping)
        return temperament_of_file(f"{tmp_path / 'w.scl'},{tmp_path / 'w.kbm'}")

    plain = TEMPERAMENTS["werckmeister"]
    for mapping in (kbm(), kbm(*range(12)), kbm(*range(12), middle=24, reference=45, hertz=110)):
        assert offsets(SCALA, mapping) == pytest.approx(plain, abs=0.02)
    lower = 1200 * np.log2(432 / 440)
    assert offsets(SCALA, kbm(hertz=432)) == pytest.approx(np.array(plain) + lower, abs=0.02)
    on_c = 1200 * np.log2(256 / 261.6255653)  # C is the reference: it has 256 Hz
    assert offsets(SCALA, kbm(reference=60, hertz=256)) == pytest.approx(np.array(plain) - plain[0] + on_c, abs=0.02)
    from_d = [plain[(k - 2) % 12] - plain[7] for k in range(12)]  # the scale begins at D: A is its 7th step
    assert offsets(SCALA, kbm(middle=62)) == pytest.approx(from_d, abs=0.02)
    just = "five\n5\n9/8\n5/4\n3/2\n5/3\n2/1\n"  # on C D E G A, with A as reference; the others stay
    wanted = [15.64, 0, 19.55, 0, 1.96, 0, 0, 17.6, 0, 0, 0, 0]
    keys = [0, "x", 1, "x", 2, "x", "x", 3, "x", 4]  # the last two are left out
    text = kbm(*keys, octave=5).replace("\n10\n", "\n12\n", 1)
    assert offsets(just, text) == pytest.approx(wanted, abs=0.02)


@pytest.mark.parametrize(
    ("mapping", "says"),
    [
        ("", "not a keyboard mapping"),
        (kbm(*range(11), "y"), "not a keyboard mapping"),
        (kbm().replace("127", "128"), "keys from 0 to 127"),
        (kbm(hertz=0), "frequency above 0 Hz"),
        (kbm(hertz=np.nan), "frequency above 0 Hz"),
        (kbm(*range(7)), "must map 12 keys"),
        (kbm(*range(12), octave=11), "octave of 1200 cents"),
        (kbm(*range(9), "x", 10, 11), "must map its reference key, 69"),
        (kbm(hertz=400), "within 100 cents"),
        (kbm(hertz=1e-323), "frequency above 0 Hz"),
        (kbm(*range(11), 10**400), "not a keyboard mapping"),
        (kbm(*range(11), "9" * 5000), "not a keyboard mapping"),
        (kbm(octave=10**400), "not a keyboard mapping"),
        (kbm().replace("! a mapping\n0", f"! a mapping\n{10**8}"), "must map 12 keys"),
        (None, "no such file"),
    ],
)
def test_a_mapping_that_is_none_is_one_clear_line(tmp_path: Path, run: Run, mapping: str | None, says: str) -> None:
    (tmp_path / "a.scl").write_text(SCALA)
    if mapping is not None:
        (tmp_path / "a.kbm").write_text(mapping)
    err = refusal(run, "render", "--note", "A1", "--temperament", f"{tmp_path / 'a.scl'},{tmp_path / 'a.kbm'}")
    assert "a.kbm" in err and says in err and "a.scl:" not in err


@pytest.mark.parametrize("ratio", ["1e99999999", "9" * 5000, f"1/{10**400}", "-3/2", "1/0", "1e400.", "nan", "3/2/1"])
def test_a_ratio_without_end_is_refused_at_once(tmp_path: Path, ratio: str) -> None:
    (tmp_path / "w.scl").write_text(SCALA.replace("4/3", ratio))
    began = time.process_time()
    with pytest.raises(ValueError, match="not a scale of Scala"):
        temperament_of_file(str(tmp_path / "w.scl"))
    assert time.process_time() - began < 1


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.kbm", kbm(), "needs its scale before it"),
        ("a.scl", "", "not a scale of Scala"),
        ("a.scl", "x\n12\n3/0\n", "not a scale of Scala"),
        ("a.scl", SCALA.replace("2/1", "1300."), "an octave of 1200 cents"),
        ("a.scl", SCALA.replace("2/1", "nan."), "not a scale of Scala"),
        ("a.scl", SCALA.replace(" 12\n", " 5\n"), "a scale of 12 notes"),
        ("a.scl", SCALA.replace("192.18", "1000.0"), "within 100 cents"),
        ("a.txt", "1 2 x", "must be equal, just"),
        ("a.txt", "1 nan", "must be equal, just"),
        ("a.txt", None, "no such file"),
    ],
)
def test_a_temperament_file_that_is_none_is_one_clear_line(
    tmp_path: Path, run: Run, name: str, text: str | None, says: str
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    err = refusal(run, "render", "--note", "A1", "--temperament", tmp_path / name, status=2)
    assert f"'--temperament': {tmp_path / name}: " in err and says in err


def test_a_pitch_in_hz_holds_whatever_the_a() -> None:
    for a4 in (440, 432):
        string = load_preset("jazz-finger", tuning=["41.2 Hz", "A1", "D2", "G2"], a4=a4).strings[0]
        assert string.frequency(string.open_note) == pytest.approx(41.2)


@pytest.mark.parametrize(
    ("preset", "capo"),
    quick(
        itertools.product(("jazz-finger", "fretless", "paper-fretless", "paper-g", "six-string"), (1, 5, 14)),
        always=[("jazz-finger", 5), ("fretless", 14), ("paper-fretless", 1), ("paper-g", 5), ("six-string", 1)],
    ),
)
def test_a_capo_is_a_stop_that_stays(preset: str, capo: int) -> None:
    """Fret k with the capo equals fret k + capo without it: pitch, losses and possible contacts."""
    bare, bass = load(preset), load_preset(preset, capo=capo)
    assert opens(bass) == [note + capo for note in opens(bare)]
    assert bass.note_range == (bare.note_range[0] + capo, bare.note_range[1])
    for i, (string, neck) in enumerate(zip(bass.strings, bass.necks, strict=True)):
        assert len(neck.fret_positions) == len(bare.necks[i].fret_positions) - capo
        for fret in range(0, len(neck.fret_positions) + 1, 3):
            s, t = speaking(bare.strings[i], bare.necks[i], fret + capo), speaking(string, neck, fret)
            assert t.length == pytest.approx(s.length, rel=1e-12)
            assert len(t.contact_position) == len(s.contact_position)
            # A fret half way between two grid points may go to either.
            assert np.allclose(t.contact_position, s.contact_position, rtol=0, atol=1.001 * s.step)
            assert np.allclose(t.contact_height, s.contact_height, rtol=0, atol=1e-9)
            assert np.allclose(modes.frequencies(t, 60), modes.frequencies(s, 60), rtol=1e-9)
            assert np.allclose(modes.dampings(t, 60), modes.dampings(s, 60), rtol=1e-6)
    for name in ("pluck_position", "strike_position"):  # the hand stays over the body
        away = [(1 - getattr(each.player, name)) * each.strings[0].length for each in (bare, bass)]
        assert away[1] == pytest.approx(away[0])


def test_a_capo_on_a_tuned_bass() -> None:
    offsets = [1.0 * k for k in range(12)]
    bass = load_preset("jazz-finger", tuning="half-step-down", capo=1, temperament=offsets)
    assert opens(bass) == opens(load("jazz-finger"))
    for string, neck in zip(bass.strings, bass.necks, strict=True):
        for fret in (0, 4):
            note = string.open_note + fret
            nu = modes.frequencies(speaking(string, neck, fret), 1)[0]
            assert cents(nu / note_frequency(note)) == pytest.approx(offsets[note % 12], abs=0.5)


def test_keys_still_call_the_strings_by_their_own_notes() -> None:
    bass = load_preset("jazz-finger", tuning="half-step-down", capo=3)
    assert [string.own_note for string in bass.strings] == opens(load("jazz-finger"))
    assert [string.called for string in bass.strings] == [note % 12 for note in opens(load("jazz-finger"))]


def test_nobody_pulls_more_than_twice_as_far() -> None:
    assert load_preset("jazz-finger", tuning="bead", a4=380).strings[0].slack == 2


def test_tuning_twice_is_tuning_once() -> None:
    string = load("jazz-finger").strings[0]
    once, twice = tune_string(string, 24), tune_string(tune_string(string, 26), 24)
    assert twice.tension == pytest.approx(once.tension) and twice.slack == pytest.approx(once.slack)


BAD = [
    ({"tuning": "drop-x"}, ["tuning must be", "drop-d", "D1 A1 D2 G2"]),
    ({"tuning": ""}, ["tuning", "must be"]),
    ({"tuning": 5}, ["tuning", "must be"]),
    ({"tuning": ["E1", True, "D2", "G2"]}, ["tuning", "must be"]),
    ({"tuning": "E1 A1 D2 H2"}, ["tuning", "must be"]),
    ({"tuning": "E1 A1 D2"}, ["tuning", "3 notes for 4 strings, E1 A1 D2 G2"]),
    ({"tuning": "BEADG"}, ['tuning = "BEADG"', "5 notes for 4 strings"]),
    ({"tuning": "E A D H"}, ["tuning", "must be"]),
    ({"tuning": "EADX"}, ["tuning", "must be"]),
    ({"tuning": "drop-g"}, ["tuning", "must be"]),
    ({"tuning": "E A G G"}, ["tuning", "G3 on the G2 string"]),
    ({"tuning": "Bb standard"}, ["tuning", "A#0 on the E1 string", "B0 to B1"]),
    ({"tuning": "Bb A D G"}, ["tuning", "A#0 on the E1 string"]),
    ({"tuning": "my scale.SCL"}, ["tuning", "a scale (.scl) is a temperament: give it to --temperament"]),
    ({"temperament": "a.scl"}, ["temperament", "a file goes to --temperament"]),
    ({"tuning": "E1 A1 G2 D2"}, ["tuning", "from the lowest to the highest", "G2, D2"]),
    ({"tuning": "D#0 A1 D2 G2"}, ["tuning", "D#0 on the E1 string", "B0 to B1"]),
    ({"tuning": "E1 A1 D2 E3"}, ["tuning", "E3 on the G2 string", "D2 to D3"]),
    ({"tuning": ["E1", "A1", "D2", "1e9 Hz"]}, ["tuning", "must be"]),
    ({"tuning": "drop-a"}, ["tuning", "no B0 string"]),
    ({"capo": 20}, ["capo must be", "0 to 19", "20 frets"]),
    ({"capo": -1}, ["capo must be", "0 to 31"]),
    ({"capo": 2.5}, ["capo must be", "whole number"]),
    ({"a4": 300}, ["a4 must be", "380 to 480 Hz"]),
    ({"a4": "432 kg"}, ["a4", "380 to 480 Hz"]),
    ({"a4": float("nan")}, ["a4", "380 to 480 Hz"]),
    ({"a4": 10**400}, ["a4", "380 to 480 Hz"]),
    ({"a4": True}, ["a4", "380 to 480 Hz"]),
    ({"temperament": [1, 2, 3]}, ["temperament", "3 values", "12, C first"]),
    ({"temperament": [101] + 11 * [0]}, ["temperament", "-100 to 100"]),
    ({"temperament": []}, ["temperament", "list"]),
    ({"temperament": "jsut"}, ["temperament must be", "just", "cents from -100 to 100"]),
]


@pytest.mark.parametrize(("keys", "says"), BAD)
def test_bad_values_are_one_clear_line(keys: dict[str, object], says: list[str]) -> None:
    with pytest.raises(PresetError) as caught:
        load_preset("jazz-finger", **keys)  # type: ignore[arg-type]
    line = str(caught.value)
    assert "jazz-finger.toml: " in line and line.isprintable() and len(line) < 400
    assert all(part in line for part in says), line


def test_a_capo_under_a_fret_that_stands_proud_is_one_clear_line() -> None:
    label, data = preset_tables("jazz-finger")
    with pytest.raises(PresetError, match=r"fret 1 stands .* string E at rest \(counted from the capo\)"):
        Builder(label).instrument(data | {"neck": data["neck"] | {"lift": {"6": "2 mm"}}, "capo": 5})


@pytest.mark.parametrize(
    ("preset", "number"),
    [*((("five-string", "jazz-finger")[k % 2], k) for k in range(len(TUNINGS))), ("paper-bass", 1), ("fretless", 2)],
)
def test_a_tuning_on_the_bench_is_the_one_of_the_preset(preset: str, number: int) -> None:
    """Also with another A, and on strings with measured modes; a drop without its string moves the others alone."""
    bass, name = load_preset(preset), list(TUNINGS)[number]
    made = change_bass(bass, {"named_tuning": number, "concert_pitch": 2.0})
    dropped = TUNINGS[name].dropped
    if dropped is not None and dropped not in [string.open_note for string in bass.strings]:
        assert [a.open_note - b.open_note for a, b in zip(made.strings, bass.strings, strict=True)] == [
            TUNINGS[name].by
        ] * len(bass.strings)
        return
    wanted = load_preset(preset, tuning=name, a4=442.0)
    assert made.a4 == 442.0 and made.note_range == wanted.note_range
    for one, other in zip(made.strings, wanted.strings, strict=True):
        assert (one.open_note, one.called) == (other.open_note, other.called)
        for field in ("tension", "inharmonicity", "slack", "law_fundamental"):
            assert getattr(one, field) == pytest.approx(getattr(other, field), rel=1e-12), field
        for note in range(one.open_note, one.open_note + 20):
            assert one.frequency(note) == pytest.approx(other.frequency(note), rel=1e-12)
        assert one.measured_frequencies == pytest.approx(other.measured_frequencies, rel=1e-12)
