"""The bench: compiled, it makes the same notes as its Python source, and refuses the same basses."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from support.costs import KINDS

from livebass.engine.image import image
from livebass.kernels.bass.bench import BENCH
from livebass.kernels.string.note import hypotenuse
from livebass.model.bench import bench_of
from livebass.model.instrument import Instrument, Neck, speaking
from livebass.model.neck import Surface, fretted_surface
from livebass.model.quality import QUALITIES, modes_for
from livebass.preset.load import load_preset, preset_names
from livebass.rows.parts import NoteNumbers
from livebass.rows.row import rows

TUNED = {"tuning": "half-step-down", "capo": 2, "temperament": "just"}


@pytest.mark.parametrize(
    ("preset", "how"),
    [
        *(pytest.param(name, {}, id=name) for name in preset_names()),
        *(
            pytest.param(name, TUNED, id=f"{name} tuned", marks=() if name in KINDS else pytest.mark.slow)
            for name in preset_names()
        ),
    ],
)
def test_notes_are_those_that_python_makes(preset: str, how: dict[str, str | int]) -> None:
    """All numbers of a note and its obstacles agree bit for bit; the count of modes follows the quality."""
    if how and preset in ("paper-fretless", "paper-g"):
        how = {"capo": 2}
    bass = load_preset(preset, **how)  # type: ignore[arg-type]
    qualities = [QUALITIES[name].for_contact(bass.loss, bass.over_board) for name in ("live", "studio", "reference")]
    notes, modes, lists = bench_of(bass, qualities).notes()
    for i, (string, neck) in enumerate(zip(bass.strings, bass.necks, strict=True)):
        for fret in range(bass.frets + 1):
            s, note = speaking(string, neck, fret), notes[i, fret]
            law = {name: getattr(s, name) for name in rows(NoteNumbers)}
            assert {name: note[name] for name in law} == law, (string.name, fret)
            assert (note["stop"], note["stop_across"]) == (s.admittance.stop, s.admittance_across.stop)
            obstacles = lists[note["obstacles"] :][: 2 * note["obstacles_count"]].reshape(-1, 2)
            surface = lists[note["surface"] :][: 2 * note["surface_count"]].reshape(-1, 2)
            assert surface.tolist() == [list(row) for row in s.surface]
            if not neck.surface:
                assert obstacles.T.tolist() == [list(s.contact_position), list(s.contact_height)]
            taps = lists[note["taps"] :][: int(note["taps_count"])]
            assert ((taps > 0) & (taps < s.length)).all() and note["taps_count"] > 0
            for quality, count in zip(qualities, modes[:, i, fret].tolist(), strict=True):
                assert count == modes_for(quality, s.length, string.length, s.grid_points)


def test_a_number_of_a_neck_reaches_every_note(tmp_path: Path) -> None:
    """A preset inherits it; a string may set its own; each note has it."""
    (tmp_path / "a.toml").write_text('like = "jazz-finger"\nname = "A"\n[neck]\naxes_turned = "20 deg"\n')
    own = '[[string]]\nname = "A"\nneck.axes_turned = "-55 deg"\n'
    (tmp_path / "b.toml").write_text(f'like = "a.toml"\nname = "B"\n{own}')
    bass = load_preset(tmp_path / "b.toml")
    notes, *_ = bench_of(bass, [QUALITIES["live"]] * 3).notes()
    wanted = np.radians([20.0, -55.0, 20.0, 20.0])
    assert np.allclose([neck.axes_turned for neck in bass.necks], wanted, rtol=1e-15)
    assert np.allclose(notes["axes_turned"], wanted[:, None], rtol=1e-15)


def raise_fret(neck: Neck, by: float, fret: int) -> Neck:
    """A neck with one fret, and the board with it, raised `by` m."""
    heights = [h + by * (k == fret) for k, h in enumerate(neck.fret_heights, 1)]
    surface: Surface = tuple((x, h + by * (abs(x - neck.fret_positions[fret - 1]) < 2e-3)) for x, h in neck.surface)
    return replace(neck, fret_heights=tuple(heights), surface=surface)


def add_profile(neck: Neck) -> Neck:
    """A neck with wood between its frets."""
    x, h = neck.fret_positions, neck.fret_heights
    return replace(neck, surface=fretted_surface(x, h, 0.9e-3, x[-1] + 0.02))


def why(bass: Instrument, how: str) -> str:
    """The message that refuses a bass, from Python's notes or the kernel; "" if it is accepted."""
    try:
        if how == "kernel":
            image(bass, QUALITIES["live"])
        else:
            for string, neck in zip(bass.strings, bass.necks, strict=True):
                for fret in range(bass.frets + 1):
                    speaking(string, neck, fret)
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    "preset, by, wanted",
    [("jazz-finger", 4e-3, "fret 9 stands"), ("profile", 4e-3, "9 stands"),
     ("fretless", 4e-3, "the board 350 mm from the nut stands"),
     ("fretless", 0.0, ""), ("profile", 0.0, ""), ("board", 4e-3, "the board stands")],
)  # fmt: skip
def test_what_stands_above_a_string_is_named(preset: str, by: float, wanted: str) -> None:
    bass = load_preset({"profile": "precision-finger", "board": "fretless"}.get(preset, preset))
    necks = [add_profile(neck) if preset == "profile" else neck for neck in bass.necks]
    high = [raise_fret(neck, by if i == 2 else 0.0, 9) for i, neck in enumerate(necks)]
    if preset == "board":  # the stopping points are below it
        high = [replace(neck, fret_heights=old.fret_heights) for neck, old in zip(high, necks, strict=True)]
    bass = replace(bass, necks=tuple(high))
    found = why(bass, "kernel")
    assert found == why(bass, "python") and wanted in found and bool(found) == bool(wanted)
    assert not wanted or f"above string {bass.strings[2].name} at rest" in found


def test_a_hypotenuse_is_rounded_once() -> None:
    rng = np.random.default_rng(4)
    for a, b in zip(rng.uniform(20, 500, 300).tolist(), (10 ** rng.uniform(-9, 1, 300)).tolist(), strict=True):
        found = Fraction(float(hypotenuse(a, b)))
        exact = Fraction(a) ** 2 + Fraction(b) ** 2
        half = Fraction(math.ulp(a)) / 2
        assert (found - half * Fraction(100001, 100000)) ** 2 <= exact <= (found + half * Fraction(100001, 100000)) ** 2
    assert hypotenuse(55.0, 0.0) == 55.0


def test_a_bass_on_the_bench_is_small() -> None:
    """It fits into a page or a plugin state."""
    assert BENCH.itemsize < 8192
