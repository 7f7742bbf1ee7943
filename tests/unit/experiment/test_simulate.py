"""`simulate_to_directory`: the files it writes, the values it refuses, and the remains of a broken run."""

from __future__ import annotations

import csv
import importlib
import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from support import strings
from support.command import small_files
from support.own_basses import load_preset

from livebass.files.whole import OutputError
from livebass.lab.analysis.motion import string_shape
from livebass.lab.experiment import simulate
from livebass.lab.experiment.simulate import simulate_to_directory
from livebass.lab.reference.solver import solve
from livebass.model import modes
from livebass.model.instrument import speaking
from livebass.model.quality import Quality
from livebass.model.trial import PluckRequest, Trial

CASE: dict[str, Any] = {
    "string": "G", "fret": 0, "apex": 3.6e-3, "at": 0.64, "duration": 0.03, "modes": 60,
    "contact_rate": 200e3, "rate": 44100, "solver": "reference",
}  # fmt: skip
FILES = ["contacts.csv", "displacement.wav", "result.npz"]
KEYS = """
    length_m linear_density_kg_per_m grid_points frequencies_hz dampings_per_s contact_positions_m
    contact_heights_m contact_stiffness contact_exponent contact_rate_hz initial_modal_amplitudes
    sensor_position_m output_rate_hz time_s displacement_m contact_time_s contact_index wall_s
    contact_frets contact_compliance wav_metres_per_unit modes contact_loss_s_per_m
""".split()  # noqa: SIM905


def run(directory: Path, **changed: Any) -> str:
    """Simulates `CASE` with some values changed."""
    requested = {**CASE, **changed}
    quality = Quality("of this test", None, requested.pop("contact_rate"))
    more = {name: requested.pop(name) for name in ("rate", "solver", "analyse", "shape_at") if name in requested}
    return simulate_to_directory(strings.paper_bass(), PluckRequest(**requested, quality=quality), directory, **more)


def test_files_tell_the_same_story(tmp_path: Path) -> None:
    summary = run(tmp_path / "a" / "out")
    out = tmp_path / "a" / "out"
    assert sorted(p.name for p in out.iterdir()) == FILES
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["out"]
    with np.load(out / "result.npz") as result:
        data = {key: result[key] for key in result.files}
    assert sorted(data) == sorted(KEYS)
    s = strings.paper_g()
    expected = solve(Trial(s, strings.pluck(), 60, 200e3, 44100.0, 0.03, s.length - 9e-3))
    np.testing.assert_array_equal(data["displacement_m"], expected.displacement_m)
    assert data["time_s"][0] == 0 and data["time_s"].size == 1324 == data["displacement_m"].size
    assert data["frequencies_hz"].shape == data["dampings_per_s"].shape == (60,)
    assert data["initial_modal_amplitudes"].shape == (60,) and data["contact_compliance"].shape == (20, 20)
    assert data["sensor_position_m"] == pytest.approx(0.854) and data["grid_points"] == 863
    with open(out / "contacts.csv", newline="") as table:
        rows = list(csv.DictReader(table))
    assert [float(r["time_s"]) for r in rows] == data["contact_time_s"].tolist()
    assert [int(r["fret"]) for r in rows] == data["contact_frets"][data["contact_index"]].tolist()
    assert len(rows) > 5 and f"{len(rows)} contacts" in summary and "\n" not in summary
    wav, rate = soundfile.read(out / "displacement.wav")
    assert rate == 44100 and soundfile.info(out / "displacement.wav").subtype == "FLOAT"
    assert 20 * math.log10(np.max(np.abs(wav))) == pytest.approx(-1, abs=1e-3)
    np.testing.assert_allclose(wav * data["wav_metres_per_unit"], data["displacement_m"], atol=1e-9)


def test_released_at_the_sensor_displacement_of_the_pluck(tmp_path: Path) -> None:
    run(tmp_path / "out", modes=None, duration=1e-3)
    with np.load(tmp_path / "out" / "result.npz") as result:
        assert result["modes"] == 862
        assert result["displacement_m"][0] == pytest.approx(3.6e-3 * 9 / (863 - 640), rel=1e-3)
        assert not result["contact_compliance"].any()


def test_same_run_same_wav_and_an_old_result_is_replaced(tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(out)
    first = (out / "displacement.wav").read_bytes()
    (out / "mine.txt").write_text("kept")
    (out / "contacts.csv").write_text("old")
    run(out)
    assert (out / "displacement.wav").read_bytes() == first
    assert sorted(p.name for p in out.iterdir()) == sorted([*FILES, "mine.txt"])
    assert (out / "contacts.csv").read_text().startswith("time_s,fret,position_m\n")
    at = first.find(b"PEAK")
    assert at < 0 or first[at + 12 : at + 16] == bytes(4)


@pytest.mark.parametrize(
    "changed, words",
    [
        ({"string": "B"}, "has G"),
        ({"fret": 21}, "0 to 20"),
        ({"fret": -1}, "0 to 20"),
        ({"apex": 0.0}, "apex must be at least 1 um either way, not 0 um"),
        ({"apex": 0.031}, "apex must be from -30 mm to 30 mm, not 0.031 m"),
        ({"apex": math.nan}, "-30 mm to 30 mm"),
        ({"at": 0.0}, "863 mm"),
        ({"at": 0.9}, "863 mm"),
        ({"at": math.nan}, "863 mm"),
        ({"at": 0.8, "fret": 12}, "431 mm"),
        ({"modes": 0}, "1 to 862"),
        ({"modes": 10**9}, "1 to 862"),
        ({"contact_rate": 22050.0}, "44.1 kHz to 64 MHz"),
        ({"contact_rate": 47e3, "rate": 48000}, "the output rate, 48000 Hz"),
        ({"contact_rate": 65e6}, "64 MHz"),
        ({"contact_rate": math.nan}, "64 MHz"),
        ({"contact_rate": 200000.1, "solver": "engine"}, "contact rate must be a whole number of Hz from"),
        ({"contact_rate": 2 * 97.97319798 * 5000, "rate": 48000, "modes": 0}, "1 to 862"),
        ({"duration": 0.0}, "100 us to 60 s"),
        ({"duration": 61.0}, "100 us to 60 s"),
        ({"duration": math.inf}, "100 us to 60 s"),
        ({"rate": 0}, "192 kHz"),
        ({"solver": "oracle"}, "reference"),
    ],
)
def test_bad_values_are_refused_in_a_line(tmp_path: Path, changed: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError) as caught:
        run(tmp_path / "a" / "out", **changed)
    assert words in str(caught.value) and "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_rate_that_hides_a_mode_is_refused(tmp_path: Path) -> None:
    s = strings.paper_g()
    nu = float(modes.frequencies(s, 862)[-1])
    with pytest.raises(ValueError, match="mode 862"):
        run(
            tmp_path / "out",
            modes=None,
            contact_rate=2 * math.sqrt(nu**2 - (modes.dampings(s, 862)[-1] / 2 / math.pi) ** 2),
        )
    run(tmp_path / "out", modes=None, contact_rate=2e6, duration=0.001)  # the paper's own, below 2 x 1.18 MHz


def test_what_is_found_in_the_motion_on_demand(tmp_path: Path) -> None:
    requested: dict[str, Any] = {"contact_rate": 2e6, "solver": "engine", "modes": 200, "duration": 0.06, "angle": 0.5}
    run(tmp_path / "out", **requested, analyse=True, shape_at=(0.0, 3.9e-3))
    with np.load(tmp_path / "out" / "result.npz") as result:
        data = {key: result[key] for key in result.files}
    s = strings.paper_g()
    q = np.cos(0.5) * modes.pluck_amplitudes(s, 200, strings.pluck())
    np.testing.assert_allclose(data["shapes_m"][0], string_shape(s, q, data["shape_x_m"]), atol=1e-12)
    np.testing.assert_allclose(data["shapes_across_m"][0], np.tan(0.5) * data["shapes_m"][0], atol=1e-12)
    assert data["shapes_m"].shape == (2, 864) and data["shape_time_s"] == pytest.approx([0, 3.9e-3], abs=1e-5)
    assert data["shapes_m"][1].min() < -2e-3  # the string is on the neck
    assert data["modal_energies_j"].shape == (data["energy_time_s"].size, 200)
    assert data["energy_j"][0] == pytest.approx(data["modal_energies_j"][0].sum())
    assert np.all(np.diff(data["energy_j"]) < 0)
    assert np.all(np.abs(data["pitch_hz"] / 98 - 1) < 0.5)
    assert data["pitch_hz"].shape == data["pitch_time_s"].shape == data["pitch_aperiodicity"].shape
    assert data["characteristic_frequency_hz"].min() > 98
    np.testing.assert_allclose(data["t60_s"] * data["dampings_per_s"], 3 * math.log(10))
    np.testing.assert_array_equal(data["frequencies_across_hz"], data["frequencies_hz"])
    np.testing.assert_array_equal(data["dampings_across_per_s"], data["dampings_per_s"])


def test_what_v_has_of_its_own_is_told(tmp_path: Path) -> None:
    bass = strings.yielding(load_preset("jazz-finger"))
    quality = Quality("of this test", None, CASE["contact_rate"])
    requested = PluckRequest(apex=3.6e-3, angle=0.5, duration=1e-3, modes=60, quality=quality)
    simulate_to_directory(bass, requested, tmp_path / "out", solver="reference")
    s = speaking(bass.strings[3], bass.necks[3], 0)
    with np.load(tmp_path / "out" / "result.npz") as result:
        assert float(result["contact_loss_s_per_m"]) == s.contact_loss > 0
        np.testing.assert_array_equal(result["frequencies_across_hz"], modes.frequencies(s, 60, across=True))
        np.testing.assert_array_equal(result["dampings_across_per_s"], modes.dampings(s, 60, across=True))
        assert np.all(result["frequencies_across_hz"] < result["frequencies_hz"])


def test_what_cannot_be_found_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.signal", None)
    run(tmp_path / "out", duration=0.06, analyse=True)
    with np.load(tmp_path / "out" / "result.npz") as result:
        found = set(result.files) - set(KEYS)
    assert found == {"t60_s", "pitch_time_s", "pitch_hz", "pitch_aperiodicity"}  # brute force gives no states
    run(tmp_path / "out", duration=0.005, analyse=True)
    with np.load(tmp_path / "out" / "result.npz") as result:
        assert set(result.files) - set(KEYS) == {"t60_s"}
    for changed, words in (
        ({"shape_at": (0.01,)}, "only the engine"),
        ({"shape_at": (0.0301,), "solver": "engine"}, "time of a shape must be from 0 to 30 ms, not 30.1 ms"),
    ):
        with pytest.raises(ValueError, match=words):
            run(tmp_path / "none", **changed)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError, MemoryError])
def test_nothing_is_left_of_a_broken_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: type[BaseException]
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(simulate.np, "savez", broken)
    with pytest.raises(error):
        run(tmp_path / "a" / "b" / "out")
    assert not list(tmp_path.iterdir())
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "contacts.csv").write_text("old")
    with pytest.raises(error):
        run(tmp_path / "out")
    assert [p.name for p in tmp_path.rglob("*")] == ["out", "contacts.csv"]
    assert (tmp_path / "out" / "contacts.csv").read_text() == "old"


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    with pytest.raises(OutputError, match="out: is not a directory"):
        run(tmp_path / "out")
    with pytest.raises(OutputError, match="below: cannot be written: Not a directory"):
        run(tmp_path / "out" / "below")
    assert (tmp_path / "out").read_text() == "mine"


def test_a_directory_in_the_place_of_a_file_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "sd" / "result.npz").mkdir(parents=True)
    with pytest.raises(OutputError, match=r"sd/result\.npz: is a directory"):
        run(tmp_path / "sd")
    assert [p.name for p in tmp_path.rglob("*")] == ["sd", "result.npz"]


def test_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    for size, file in ((4096, "displacement.wav"), (9000, "result.npz")):
        error = f"^{tmp_path}/a/b/{file}: cannot be written: File too large$"
        with small_files(size), pytest.raises(OutputError, match=error):
            run(tmp_path / "a" / "b")
        assert not list(tmp_path.iterdir())


def test_nothing_is_made_beside_the_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The directory may be another disk, or its parent closed: only its contents are touched."""
    made: list[Path] = []
    opened = os.open

    def open_(path: Any, flags: int, *rest: Any) -> int:
        nameless = flags & getattr(os, "O_TMPFILE", 0) == getattr(os, "O_TMPFILE", None)
        made.append(Path(path) / "nameless" if nameless else Path(path))
        return opened(path, flags, *rest)

    monkeypatch.setattr(os, "open", open_)
    (tmp_path / "out").mkdir()
    run(tmp_path / "out")
    assert len(made) >= 3 and {p.parent for p in made} == {tmp_path / "out"}
    assert len(list((tmp_path / "out").iterdir())) == 3


@pytest.mark.parametrize("solver", ["engine", "reference"])
def test_wall_time_is_without_compilation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solver: str) -> None:
    """A solver compiles or loads its code in a first, untimed run."""
    module = importlib.import_module(
        {"engine": "livebass.engine.solve", "reference": "livebass.lab.reference.solver"}[solver]
    )
    name = "solve" if solver == "reference" else "solve_trial"
    trials: list[Trial] = []
    real = getattr(module, name)
    monkeypatch.setattr(module, name, lambda trial: trials.append(trial) or real(trial))
    run(tmp_path / "out", solver=solver)
    first, second = trials
    assert (first.modes, first.samples) == (60, 2) and (second.modes, second.samples) == (60, 1324)
