"""Notes of a folder: strings, layers, doubts, and refusals in one line; which are fitted and which judge."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support import ringing
from support.ringing import NOTE_RATE as RATE
from support.ringing import save_tones as save

from livebass.lab.fitting.guide import steps
from livebass.lab.fitting.notes import Place, read_notes, string_of
from livebass.lab.fitting.plan import FITTED, plan
from livebass.lab.identification.partials import RecordingError
from livebass.model.instrument import note_frequency
from livebass.preset.load import load_preset
from livebass.rows.arrays import Floats
from livebass.rows.units import note_name

BASS = load_preset("jazz-finger")
LEVELS = {"pp": -30.0, "mf": -18.0, "ff": -8.0}


def tone(key: int, level_db: float = -12.0, seconds: float = 1.5) -> Floats:
    """A note of eight partials that decays, after 50 ms without sound."""
    sound = ringing.tone(note_frequency(key), level_db, seconds, partials=8)
    return np.concatenate([np.zeros(round(0.05 * RATE)), sound])


def chromatic(folder: Path, keys: range = range(40, 43), **levels: float) -> Path:
    return save(folder, **{f"n{key}_{name}": tone(key, level) for key in keys for name, level in levels.items()})


def test_layers_and_strings_as_names_tell_them(tmp_path: Path) -> None:
    names = {f"string{string}_{name}": tone(key, level)
             for string, key in (("E", 33), ("A", 33), ("d", 43)) for name, level in LEVELS.items()}  # fmt: skip
    found = read_notes([save(tmp_path, **names, silence=1e-4 * np.random.default_rng(0).standard_normal(RATE))])
    assert found.layers == ("pp", "mf", "ff") and not found.normalized and found.doubts == ()
    assert set(found.takes) == {Place(key, string, rank) for key, string in ((33, "E"), (33, "A"), (43, "D"))
                                for rank in range(3)}  # fmt: skip
    assert [string_of(BASS, Place(33, s, 0)) for s in ("E", "a", "", "G", "X")] == [0, 1, 1, None, None]
    assert [string_of(BASS, Place(33, s, 0)) for s in ("4", "3", "2", "0", "5")] == [0, 1, None, None, None]
    assert len(found.quiet) == 1


def test_files_without_sound_do_not_stop_a_fit(tmp_path: Path) -> None:
    """A gate or a muted input leaves zeros."""
    nothing = np.full(2 * RATE, 0.1)  # only an offset
    chromatic(tmp_path, pp=-30, ff=-8)
    found = read_notes([save(tmp_path, n46_ff=nothing, silence=nothing, room_quiet=nothing)])
    assert len(found.takes) == 6 and len(found.quiet) == 2
    assert any("no note with a pitch is heard in n46_ff.wav" in doubt for doubt in found.doubts)


def test_a_silence_with_hum_is_no_note(tmp_path: Path) -> None:
    chromatic(tmp_path, pp=-30, ff=-8)
    found = read_notes([save(tmp_path, Silence2=0.01 * np.sin(2 * np.pi * 50 * np.arange(2 * RATE) / RATE))])
    assert [Path(n.name).stem for n in found.quiet] == ["Silence2"] and min(p.key for p in found.takes) == 40


def test_without_names_the_strings_are_a_doubt(tmp_path: Path) -> None:
    found = read_notes([chromatic(tmp_path, pp=-30, ff=-8)])
    assert {p.string for p in found.takes} == {""}
    assert len(found.doubts) == 1 and "the strings of all notes are found by their inharmonicity" in found.doubts[0]


def test_one_recording_in_the_order_of_the_guide_tells_strings_frets_and_forces(tmp_path: Path) -> None:
    guide = [s for s in steps(BASS) if (s.string, s.fret) in (("E", 0), ("E", 5), ("A", 0))]  # two are alike
    rest = np.zeros(round(0.4 * RATE))
    sounds = [np.concatenate([tone(s.key, LEVELS["mf"], 1.6), rest]) for s in guide]
    path = save(tmp_path, all=np.concatenate(sounds)) / "all.wav"
    found = read_notes([path], guide=guide)
    assert set(found.takes) == {Place(s.key, s.string, s.rank) for s in guide}
    assert found.layers == ("soft", "medium", "hard") and {len(t) for t in found.takes.values()} == {2}
    assert {n.open for place, takes in found.takes.items() for n in takes if place.key == 28} == {True}
    with pytest.raises(RecordingError, match="different notes"):  # in another order: one level is one layer
        read_notes([path], guide=guide[::-1])


@pytest.mark.parametrize(
    ("keys", "levels", "doubt"),
    [
        (2, {"v1": -12.0, "v2": -12.2, "v3": -11.5}, "normalised or compressed"),
        (6, {"v1": -9.0}, "all notes have one force"),
    ],
)
def test_layers_whose_levels_tell_nothing(tmp_path: Path, keys: int, levels: dict[str, float], doubt: str) -> None:
    found = read_notes([chromatic(tmp_path, range(40, 40 + keys), **levels)])
    assert found.normalized and any(doubt in each for each in found.doubts)


def test_defects_are_doubts(tmp_path: Path) -> None:
    chromatic(tmp_path, pp=-30, ff=-8)
    loud = np.clip(3 * tone(46, 0.0), -1, 1)
    whole = tone(47, -8)
    save(
        tmp_path,
        n46_ff=loud,
        n47_ff=whole[np.argmax(np.abs(whole)) :],
        n48_ff=tone(48, -8, 1.0),
        pick_n49_ff=tone(49, -8),
    )
    found = read_notes([tmp_path])
    for doubt in ("clip, such as n46_ff", "within the attack, such as n47_ff", "shorter than 1.3 s", "--technique"):
        assert any(doubt in each for each in found.doubts), doubt
    assert not {48, 49} & {place.key for place in found.takes}


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="has no sound file"):
        read_notes([tmp_path])
    few = chromatic(tmp_path / "few", pp=-30.0)
    with pytest.raises(RecordingError, match=r"few: 3 different notes of 1.3 s: at least 6 .* --guide"):
        read_notes([few])
    one = save(tmp_path / "one", **{f"n_v{k}": tone(40, -30 + 3 * k) for k in range(1, 7)})
    with pytest.raises(RecordingError, match=f"one: all notes are {note_name(40)}; at least two pitches"):
        read_notes([one])


@pytest.mark.parametrize(("keys", "layers"), [(14, 4), (12, 3), (3, 2), (7, 1), (2, 16)])
def test_every_fourth_note_is_held_out_and_the_fitted_ones_spread(keys: int, layers: int) -> None:
    places = [Place(30 + key, "", rank) for key in range(keys) for rank in range(layers)]
    made = plan(places)
    assert 0 < len(made.fitted) <= FITTED and made.judges and not set(made.fitted) & set(made.judges)
    assert len({p.rank for p in made.fitted}) == min(layers, 4)
    held = [p for p in places if (p.key - 30 + p.rank) % 4 == 3]
    pitches = {p.key for p in places if p not in held}
    assert len({p.key for p in made.fitted}) == min(len(pitches), FITTED)
    assert not set(held) & set(made.fitted)
    assert plan(reversed(places)) == made
