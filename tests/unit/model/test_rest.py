"""Where a pressed string lies at rest: against statics by brute force, and the engine's pitch against both."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from support.command import Run, cli_text
from support.pitch import pitch

from livebass import QUALITIES, Instrument, load_preset, preset_names, render_to_array, score_of
from livebass.cli.messages import fretting_out
from livebass.model.bench import change_bass
from livebass.model.instrument import frets_from_geometry, speaking
from livebass.model.rest import choked, lies_on
from livebass.preset.checks import overdamped_mode
from livebass.rows.arrays import Floats

RATE, ACTIONS = 48_000, (0.70, 0.55, 0.50)  # Hz; mm under the lowest string
FINE = 400  # steps of a string by brute force
PUSHES = 1e-4  # N, of a crown that carries the string


def lowered(folder: Path, action: float, more: str = "") -> Path:
    """A preset: jazz-finger with so many mm of action."""
    have = -1e3 * load_preset("jazz-finger").necks[0].fret_heights[11]
    file = folder / "low.toml"
    file.write_text(f'like = "jazz-finger"\nname = "Low"\n[bench]\naction = {action - have:.2f}\n{more}')
    return file


def carried(bass: Instrument, i: int, fret: int) -> list[int]:
    """The frets that push string `i`, pressed at `fret`, up at rest: by the least energy of a stiff string over crowns.

    A string on hinges, of tension T and stiffness E I, over rigid crowns: their forces are the multipliers of the least
    energy, found as the least squares of its dual, with forces that only push.
    """
    s, neck = bass.strings[i], bass.necks[i]
    x, h = (np.array([0.0, *each]) for each in (neck.fret_positions, neck.fret_heights))
    length = s.length - x[fret]
    beyond = np.arange(fret + 1, len(x))
    line = h[fret] * (s.length - x[beyond]) / length
    mode = np.arange(1, FINE)
    k = mode * np.pi / length
    stiffness = s.tension * k**2 * (1 + s.inharmonicity * (s.length / length * mode) ** 2)
    shapes = np.sqrt(2 / length) * np.sin(np.outer(x[beyond] - x[fret], k))  # (crowns, modes)
    root = shapes / np.sqrt(stiffness)
    # least 1/2 |root' f|^2 - (h - line) f over f >= 0
    gives = root @ root.T
    factor = np.linalg.cholesky(gives + 1e-12 * np.trace(gives) * np.eye(len(beyond)))
    force = lsq_linear(factor.T, np.linalg.solve(factor, h[beyond] - line), (0, np.inf), tol=1e-14).x
    return [int(n) for n, f in zip(beyond, force, strict=True) if f > PUSHES]


def with_heights(bass: Instrument, lift: dict[int, float], action: float) -> Instrument:
    """The bass with one set of crowns under all strings."""
    necks = []
    for s, neck in zip(bass.strings, bass.necks, strict=True):
        x, h = frets_from_geometry(s.length, 20, action, 0.2e-3, 0.4e-3, lift)
        necks.append(replace(neck, fret_positions=x, fret_heights=h))
    return replace(bass, necks=tuple(necks))


def test_no_shipped_preset_frets_out() -> None:
    assert not any(choked(load_preset(name)) for name in preset_names())


@pytest.mark.parametrize("action", ACTIONS)
def test_the_highest_fret_that_carries_the_string_is_where_statics_by_force_puts_it(
    action: float, tmp_path: Path
) -> None:
    bass = load_preset(lowered(tmp_path, action))
    found = {(note.string, note.fret): note.on for note in choked(bass)}
    assert ("G", 9) in found
    for i, string in enumerate(bass.strings):
        for fret in range(1, 20):
            pushing = carried(bass, i, fret)
            assert found.get((string.name, fret), fret) == max(pushing, default=fret), (string.name, fret, pushing)


@pytest.mark.parametrize("lift", [{10: 0.3e-3}, {8: 0.2e-3, 14: 0.15e-3}, {15: 0.4e-3}])
def test_so_it_is_over_single_high_frets(lift: dict[int, float]) -> None:
    bass = with_heights(load_preset("jazz-finger"), lift, 1.5e-3)
    assert choked(bass)
    for fret in range(1, 20):
        on = lies_on(bass.strings[2], bass.necks[2], fret)
        assert on == max(carried(bass, 2, fret), default=fret), fret
        heights = speaking(bass.strings[2], bass.necks[2], fret).contact_height
        assert (max(heights, default=0.0) > 0.0) == (on > fret)


@pytest.mark.parametrize("action", ACTIONS)
def test_a_choked_note_dies_away_at_the_pitch_of_the_fret_it_lies_on(action: float, tmp_path: Path) -> None:
    bass = load_preset(lowered(tmp_path, action))
    [note] = [note for note in choked(bass) if (note.string, note.fret) == ("G", 9)]
    assert note.on == 20 and note.frequency == pytest.approx(311.13, abs=0.01)
    key = bass.strings[3].open_note + 9
    quiet = score_of([(0.0, 1.0, key, 15)], RATE)
    strings: Floats = render_to_array(bass, quiet, QUALITIES["live"], tail=0.0)
    sound = strings[3]
    assert np.ptp(sound) > 10 * np.ptp(strings[:3], axis=1).max(), "the note is on the G string"
    assert pitch(sound[RATE // 5 : RATE], RATE, note.frequency) == pytest.approx(note.frequency, rel=2e-3)
    free: Floats = render_to_array(load_preset("jazz-finger"), quiet, QUALITIES["live"], tail=0.0)[3]
    fell, falls = (np.std(s[: RATE // 20]) / np.std(s[RATE // 10 : RATE // 5]) for s in (sound, free))
    assert fell > 2.5 > 1.3 > falls


def test_render_and_check_say_it(run: Run, tmp_path: Path) -> None:
    file = lowered(tmp_path, 0.8)
    says = "on fret 20 lies A at frets 14 to 19; D at frets 11 to 19; G at frets 9 to 19"
    assert says in cli_text(run, "presets", "check", str(file))
    out = tmp_path / "c.wav"
    status, _, said = run("render", "--note", "C3", "--duration", "10ms", "-p", str(file), "-o", str(out))
    assert status == 0 and "Low: notes fret out" in said and says in said
    assert "fret out" not in cli_text(run, "presets", "check", "jazz-finger")


def test_frets_have_names_and_bare_boards_have_places() -> None:
    neck, bare = (load_preset(name).necks[0] for name in ("jazz-finger", "fretless"))
    assert neck.fret_text(9) == "fret 9" and neck.fret_text(5, 6, 7, 9, board="at") == "frets 5 to 7, 9"
    assert bare.fret_text(9) == f"the board {1e3 * bare.fret_positions[8]:.0f} mm from the nut"
    assert bare.fret_text(3, 4, 5, 9, board="") == "137 to 217, 350 mm from the nut"
    capo = load_preset("fretless", capo=2).necks[0]
    assert capo.fret_text(7, board="at") == f"at {1e3 * capo.fret_positions[6]:.0f} mm from the capo"


NAMED = re.compile(r"frets? \d")


def test_no_message_names_a_fret_of_a_bare_board(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "low.toml"
    file.write_text('like = "fretless"\nname = "Low"\n[bench]\naction = -1.15\n')
    lies = "on the board 592 mm from the nut lies E at 432 to 575 mm from the nut; A at"
    assert lies in fretting_out(change_bass(load_preset("fretless"), {"action": -1.15}))
    said = [cli_text(run, "presets", "check", str(file))]
    assert lies in said[0]
    of = ["--string", "G", "--fret", "15", "--at", "0.2", "--duration", "0.02s", "-o", str(tmp_path / "g")]
    for preset in (str(file), "fretless"):
        status, _, err = run("simulate", "-p", preset, *of)
        assert status == 0, err
        said.append(err)
    assert "string G at 501 mm from the nut (frets out: it lies on the board 592 mm from the nut)" in said[1]
    assert "contacts, the first at" in said[2] and "mm from the stop" in said[2]
    said.append(cli_text(run, "fit", "--guide", "--like", "fretless"))
    file.write_text('like = "fretless"\nname = "Low"\n[bench]\naction = -1.7\n')
    status, _, err = run("presets", "check", str(file))
    assert status == 1 and "mm from the nut" in err, err
    bare = load_preset("fretless")
    dull = overdamped_mode(replace(bare.strings[3], extra_damping=1e4), bare.necks[3])
    assert dull and "mode 1 at 0 mm from the nut" in dull.why("damping")
    said += [err, dull.why("damping")]
    assert not [line for line in said if NAMED.search(line)]
