"""Notes found in files: pitch from the sound, the rest from the names; notes rendered to match."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from support.places import GROWLY, ROOT
from support.ringing import NOTE_RATE as RATE
from support.ringing import save_tones as save
from support.ringing import tone, uneven

from livebass.lab import comparison
from livebass.lab.comparison import measure_notes, outside, render_notes, summary
from livebass.lab.comparison.notes import spread_velocities
from livebass.lab.comparison.rows import ROWS, ranges
from livebass.lab.comparison.summary import Bass, Figure, basses, figures
from livebass.preset.source import PresetError
from livebass.rows.units import cents


def test_names_tell_dynamic_technique_and_kind(tmp_path: Path) -> None:
    save(tmp_path, a_mf_rr1=tone(), a_pp_open=tone(level_db=-30), pick__E_ff_stopped=tone(82.4),
         SLAP_e_f_take2=tone(41.2), a_rel_rr1=tone(seconds=0.2), scrape_1=tone(seconds=0.3))  # fmt: skip
    found = {Path(n.name).stem: n for n in measure_notes([tmp_path])}
    assert {name: (n.dynamic, n.rank) for name, n in found.items() if n.kind == "note"} == {
        "a_pp_open": ("pp", 0), "a_mf_rr1": ("mf", 1), "SLAP_e_f_take2": ("f", 2), "E_ff_stopped": ("ff", 3)
    }  # fmt: skip
    assert [found[name].technique for name in ("a_mf_rr1", "E_ff_stopped", "SLAP_e_f_take2")] == [
        "fingers", "pick", "slap"
    ]  # fmt: skip
    assert found["a_rel_rr1"].kind == "release" and found["scrape_1"].kind == "scrape"
    assert found["a_rel_rr1"].place == found["a_mf_rr1"].place == "a"
    assert [found[n].open for n in ("a_pp_open", "E_ff_stopped", "a_mf_rr1")] == [True, False, None]
    assert {n.technique for n in measure_notes([tmp_path], "pop") if n.kind == "note"} == {"pop"}
    assert [b.technique for b in basses("mine", list(found.values()))] == ["fingers", "pick", "slap"]
    save(tmp_path / "palm", pick_e_f_muted=tone(41.2))
    assert [n.technique for n in measure_notes([tmp_path / "palm"])] == ["mute"]


@pytest.mark.parametrize(
    ("names", "dynamics"),
    [
        (("g_v20", "g_v100", "g_v127"), ["v20", "v100", "v127"]),  # by number, not by letter
        (("12_43_a", "34_43_b", "99_43_c"), ["12", "34", "99"]),  # the parts that grow with the level, not the key
        (("one", "two", "three"), ["soft", "medium", "hard"]),  # by level alone
    ],
)
def test_dynamics_by_number_or_level(tmp_path: Path, names: tuple[str, ...], dynamics: list[str]) -> None:
    save(tmp_path, **{name: tone(level_db=level) for name, level in zip(names, (-30, -18, -6), strict=True)})
    notes = {Path(n.name).stem: n for n in measure_notes([tmp_path])}
    assert [notes[name].dynamic for name in names] == dynamics
    assert [notes[name].rank for name in names] == [0, 1, 2]


def test_takes_of_one_level_are_one_dynamic(tmp_path: Path) -> None:
    save(tmp_path, **{f"take{k}": tone(level_db=-10 - 0.5 * k) for k in range(3)})
    notes = measure_notes([tmp_path])
    assert {n.rank for n in notes} == {0}
    own = figures(Bass("mine", "fingers", False, tuple(notes)))
    assert own["take_level", "all"].value == pytest.approx(0.5 / math.sqrt(2), abs=0.02)
    assert own["take_distance", "all"].value == pytest.approx(0, abs=0.01)
    assert own["growth", "all"].reason == "one dynamic"


def test_hard_notes_are_louder_than_soft_ones(tmp_path: Path) -> None:
    """By level, and between partials, where white noise grows by 15 dB."""
    rng = np.random.default_rng(1)
    save(tmp_path, **{
        name: tone(level_db=level) + 10 ** (noise / 20) * rng.normal(size=round(1.2 * RATE))
        for name, level, noise in (("g_pp", -30, -75), ("g_mf", -20, -70), ("g_ff", -12, -60))
    })  # fmt: skip
    own = figures(basses("mine", measure_notes([tmp_path]))[0])
    assert own["level_span", "all"].value == pytest.approx(18, abs=0.2)
    assert own["level_growth", "all"].value == pytest.approx(10, abs=0.2)
    assert own["between_rise", "all"].value == pytest.approx(15, abs=2)


def test_several_notes_in_a_file(tmp_path: Path) -> None:
    gap = np.zeros(RATE // 2)
    save(tmp_path, f=np.concatenate([gap, tone(55.0), gap, tone(98.0), gap]))
    a, b = measure_notes([tmp_path / "f.wav"])
    assert abs(cents(a.pitch / 55)) < 5 and abs(cents(b.pitch / 98)) < 5
    assert a.measures["level_1s"] == pytest.approx(-10, abs=0.5)


def test_a_strong_second_partial_is_no_octave(tmp_path: Path) -> None:
    save(tmp_path, e=uneven(41.2, {2: 18}, rate=RATE), g=uneven(98.0, {2: 18}, rate=RATE))
    assert [round(69 + cents(n.pitch / 440) / 100) for n in measure_notes([tmp_path])] == [28, 43]


def test_a_note_that_is_stopped_tells_no_more_than_it_has(tmp_path: Path) -> None:
    """A hand ends it after 1.5 s: there are no figures at 2 s, and the decay is measured before the hand."""
    sound = tone(seconds=4.0)
    sound[round(1.5 * RATE) :] *= 10 ** (-3 * np.arange(sound.size - round(1.5 * RATE)) / RATE / 0.1)
    (found,) = measure_notes([save(tmp_path, f=sound)])
    assert math.isnan(found.measures["level_2s"]) and "are needed" in found.measures.missing["level_2s"]
    assert found.measures["t60_200"] == pytest.approx(6, rel=0.05)


def test_release_over_the_note(tmp_path: Path) -> None:
    """A knock of -12 dBFS over notes of known peak after 1 s; it falls by 20 dB in 46 ms."""
    knock = np.sin(2 * math.pi * 500 * np.arange(RATE // 5) / RATE) * np.exp(-np.arange(RATE // 5) / RATE / 0.02)
    save(tmp_path, g_f=tone(seconds=2.0), g_rel=10 ** (-12 / 20) * knock / np.abs(knock).max())
    own = figures(basses("mine", measure_notes([tmp_path]))[0])
    assert own["knock", "all"].value == pytest.approx(-12 - (-12 - 10), abs=0.8)
    assert own["release_time", "all"].value == pytest.approx(20 * math.log(10), abs=10)
    assert own["knock_centroid", "all"].value == pytest.approx(500, rel=0.1)


def test_the_notes_that_are_shipped() -> None:
    """Pitches in the octaves of their names; figures near another program's for the whole library."""
    notes = measure_notes([GROWLY])
    pitches = {"E1": 41.2, "C2": 65.4, "C3": 130.8}
    for note in notes:
        if note.kind == "note":
            assert abs(cents(note.pitch / pitches[Path(note.name).name[:2]])) < 40
    (bass,) = basses("growlybass", notes)
    own, reported = figures(bass), summary(notes)
    hard = reported["ff"]
    assert reported["hard"] is hard and list(reported) == ["pp", "f", "ff", "soft", "hard"]
    assert hard["centroid_20"] == pytest.approx(1256, rel=0.15) and hard["centroid_100"] == pytest.approx(772, rel=0.15)
    assert hard["high_100"] == pytest.approx(-16, abs=3) and hard["high_200"] == pytest.approx(-23, abs=3)
    assert 7 < own["t60_200", "all"].value < 11.5  # 7.5 s of stopped notes, 11 of the open E
    assert own["t60_800", "all"].value == pytest.approx(2.4, rel=0.15)
    assert own["dip_90", "hard"].value < own["dip", "hard"].value < 0
    assert own["returns_90", "hard"].value > own["returns", "hard"].value > 0
    inside = [row.verdict(own[row.key, row.when].value, "fingers") for row in ROWS if row.range_of("fingers")
              and not math.isnan(own.get((row.key, row.when), own["t60_ratio", "all"]).value)]  # fmt: skip
    assert inside.count("inside") > 0.6 * len(inside), inside


def test_rendered_notes_are_like_the_recorded_ones() -> None:
    real = measure_notes([GROWLY / "C2_pp_rr1.flac", GROWLY / "C2_ff_rr1.flac"])
    notes = render_notes("jazz-finger", real, takes=2)
    plucked = [n for n in notes if n.kind == "note"]
    assert [(n.dynamic, n.rank) for n in plucked] == [("v30", 0)] * 2 + [("v127", 1)] * 2
    assert all(n.pitch == pytest.approx(65.41, abs=0.01) and n.open is False for n in plucked)
    assert [n.kind for n in notes].count("release") == 1
    assert not np.array_equal(plucked[0].sound, plucked[1].sound), "takes differ"
    again = render_notes("jazz-finger", real, takes=2)
    assert all(np.array_equal(a.sound, b.sound) for a, b in zip(notes, again, strict=True))
    assert summary(notes)["hard"]["level"] > summary(notes)["soft"]["level"] + 6
    assert not render_notes("six-string", [n for n in real if n.pitch > 500])


@pytest.mark.parametrize(
    ("values", "why"),
    [({"velocities": [90, 30]}, "from soft to hard"), ({"velocities": [0]}, "1 to 127"), ({"takes": 0}, "1 to 16"),
     ({"quality": "best"}, "quality must be live, studio or reference, not 'best'")],
)  # fmt: skip
def test_values_that_are_not_allowed(values: dict[str, object], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        render_notes("jazz-finger", [], **values)  # type: ignore[arg-type]
    with pytest.raises(PresetError):
        render_notes("no-such-bass", [])


def test_velocities_are_spread_over_the_dynamics() -> None:
    assert (
        spread_velocities(1) == [100]
        and spread_velocities(2) == [30, 127]
        and spread_velocities(4) == [30, 62, 95, 127]
    )


def test_verdicts() -> None:
    """Inside, to the digits shown; else the distance; a technique has its own range or none."""
    rows = {(row.key, row.when): row for row in ROWS}
    assert len(rows) == len(ROWS)
    dip = rows["dip", "hard"]
    low, high = (round(v, 1) for v in (dip.range_of("fingers") or ())[:2])
    assert [dip.verdict(v, "fingers") for v in (low - 0.04, high, low - 20, high + 0.2)] == [
        "inside", "inside", "20.0 below", "0.2 above"
    ]  # fmt: skip
    assert dip.range_of("pick") != dip.range_of("fingers") and dip.verdict(-30.0, "slap") == ""
    assert rows["thump", "hard"].of("slap") and not rows["thump", "hard"].of("fingers")


def test_no_range_comes_from_one_bass() -> None:
    """Every range belongs to a row, and is that of two basses at least; fingers have nearly all."""
    rows = {(row.key, row.when) for row in ROWS}
    assert {(key, when) for key, when, _ in ranges()} <= rows
    assert all(r.low <= r.high and 2 <= r.basses <= r.notes for r in ranges().values())
    assert len([key for key in ranges() if key[2] == "fingers"]) > 80


def test_how_far_outside() -> None:
    """In units of the row, positive above; None without a range or a value."""
    known = ranges()["wobble", "soft", "fingers"]
    values = {("wobble", "soft"): known.low - 0.2, ("drift", "soft"): 99.0, ("snap", "hard"): 20.0}
    found = {key: Figure(value) for key, value in values.items()} | {("level_2s", "soft"): Figure(math.nan, "short")}
    off = outside(found, "fingers")
    assert off["wobble", "soft"] == pytest.approx(-0.2) and off["snap", "hard"] == 0 and len(off) == 3
    assert off["drift", "soft"] == pytest.approx(99.0 - ranges()["drift", "soft", "fingers"].high)
    assert set(outside(found, "slap")) == {("snap", "hard")}


def test_the_example_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """The example of the room's docstring, from the source tree."""
    monkeypatch.chdir(ROOT)
    lines = [line[4:] for line in (comparison.__doc__ or "").splitlines() if line.startswith("    ")]
    names: dict[str, object] = {}
    exec(compile("\n".join(lines), "comparison", "exec"), names)
    assert len(names["ours"]) == 3 * 3 + 3  # type: ignore[arg-type]


def test_what_has_no_pitch_is_left_out_of_a_folder(tmp_path: Path) -> None:
    """Noise among notes is named, and the notes are found; dead notes and harmonics are not plucked notes."""
    noise = 0.1 * np.random.default_rng(4).normal(size=RATE)
    save(tmp_path, g_f=tone(), hiss_f=noise, g_f_dead=tone(t60=0.2), g_f_harmonic=tone(196.0))
    left_out: list[str] = []
    notes = measure_notes([tmp_path], left_out=left_out)
    assert left_out == [str(tmp_path / "hiss_f.wav")]
    assert sorted((Path(n.name).stem, n.kind) for n in notes) == [
        ("g_f", "note"), ("g_f_dead", "other"), ("g_f_harmonic", "other")
    ]  # fmt: skip
