"""The Python interface as a newcomer meets it: README's examples run, help is one screen, the package is typed."""

from __future__ import annotations

import contextlib
import doctest
import importlib.util
import inspect
import io
import pkgutil
import pydoc
import re
import shutil
import subprocess
import sys
import venv
import zipfile
from collections.abc import Callable
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import interface
from support.places import RECORDINGS, ROOT

import livebass
from livebass.model.instrument import speaking
from livebass.model.quality import modes_for, quality_with

RECORDING = RECORDINGS / "picked-g.flac"
SCREEN = 40  # lines
QUICK = quality_with("live", modes=40, contact_rate=409_600)
BASS = livebass.load_preset("paper-g")
PROGRAM = ROOT / "tests" / "program.py"
NO_EXAMPLE = {  # functions that take or write files, or take minutes: README shows them
    "bench_latency", "check_claims", "compare", "export_page", "export_plugin", "export_sfz", "fit", "fitted_preset",
    "identify", "read_score", "read_tab", "render_to_file",
}  # fmt: skip


def examples() -> list[str]:
    """The Python blocks of README, in order."""
    return re.findall(r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(), re.DOTALL | re.MULTILINE)


def test_the_examples_of_the_readme_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One after the other, with the files they name; each public call of the commands is among them."""
    track = bytes([0, 0xC0, 33, 0, 0x90, 40, 100, 60, 0x80, 40, 0, 0, 0xFF, 0x2F, 0])
    head = b"MThd" + bytes([0, 0, 0, 6, 0, 0, 0, 1, 0, 96])
    (tmp_path / "song.mid").write_bytes(head + b"MTrk" + len(track).to_bytes(4, "big") + track)
    recording = tmp_path / RECORDING.relative_to(ROOT)
    recording.parent.mkdir(parents=True)
    shutil.copy(RECORDING, recording)
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for code in examples():
            exec(compile(code, "README.md", "exec"), names)
    assert names["sound"].shape[0] == 4 and names["moved"].contacts.fret.size
    assert names["plucks"].values("contacts").shape == (3,)
    real = names["string"]  # of a real bass, from its recording
    assert real.law.fundamental == pytest.approx(98.0, rel=0.015) and 3.2e-5 < real.law.inharmonicity < 3.7e-5
    assert len(real.partials) >= 50
    assert np.nanmedian(names["pitch"].frequency_hz) > 50 and "nan" not in printed.getvalue()[-200:]
    for name in ("render_to_array", "simulate", "sweep", "identify", "fundamental"):
        assert f"livebass.{name}(" in "".join(examples())
    assert {p for p in tmp_path.rglob("*") if p.is_file()} == {tmp_path / "song.mid", recording}, "no call writes"


def test_help_begins_with_a_screen_that_names_everything() -> None:
    screen = pydoc.plain(pydoc.render_doc(livebass)).partition("\nPACKAGE CONTENTS")[0]
    assert len(screen.splitlines()) <= SCREEN
    assert max(map(len, screen.splitlines())) <= 120
    assert "import livebass" in screen and all(re.search(rf"\b{name}\b", screen) for name in livebass.__all__)


@pytest.mark.parametrize("name", livebass.__all__)
def test_no_module_hides_a_public_name(name: str) -> None:
    """A module of the same name would replace it once imported."""
    assert name not in {module.name for module in pkgutil.iter_modules(livebass.__path__)}


@pytest.mark.parametrize("name", [name for name in livebass.__all__ if name.islower()])
def test_public_functions_say_what_they_take_and_give(name: str) -> None:
    call = getattr(livebass, name)
    assert inspect.getdoc(call)
    signature = inspect.signature(call)
    for parameter in (*signature.parameters.values(), signature):
        assert getattr(parameter, "annotation", signature.return_annotation) is not inspect.Parameter.empty


def test_names_and_signatures_are_those_that_were_kept() -> None:
    """A change here is a change of what users rely on: docs/versions.md says what may change when."""
    kept = (ROOT / "tests" / "kept" / "api.txt").read_text("utf-8").splitlines()
    assert interface.public_lines().splitlines() == kept, "if it is meant: .venv/bin/python tools/keep.py --api"


def test_results_are_read_only() -> None:
    found = [kind for name in livebass.__all__ if is_dataclass(kind := getattr(livebass, name))]
    assert len(found) > 10 and all(kind.__dataclass_params__.frozen for kind in found)


@pytest.mark.parametrize("name", [name for name in livebass.__all__ if callable(getattr(livebass, name))])
def test_examples_in_docstrings_give_what_they_say(name: str) -> None:
    found = getattr(livebass, name)
    if inspect.isclass(found) and issubclass(found, BaseException):
        return
    module = inspect.getmodule(found)
    assert module
    runner = doctest.DocTestRunner(optionflags=doctest.REPORT_NDIFF)
    tests = doctest.DocTestFinder().find(found, name, module)
    reported = io.StringIO()
    for test in tests:
        runner.run(test, out=reported.write)
    assert runner.summarize(verbose=False).failed == 0, reported.getvalue()
    if inspect.isfunction(found):
        assert any(test.examples for test in tests) == (name not in NO_EXAMPLE), "an example, or README shows it"


def test_simulate_gives_what_the_command_writes(tmp_path: Path) -> None:
    from livebass.lab.experiment.simulate import simulate_to_directory
    from livebass.model.trial import PluckRequest

    moved = livebass.simulate(BASS, duration=0.05, quality=QUICK, modes=40, shape_at=[0.01])
    requested = PluckRequest(duration=0.05, quality=QUICK, modes=40)
    simulate_to_directory(BASS, requested, tmp_path / "a", analyse=True, shape_at=[0.01])
    with np.load(tmp_path / "a" / "result.npz") as kept:
        assert np.array_equal(kept["displacement_m"], moved.displacement())
        assert np.array_equal(kept["contact_time_s"], moved.contacts.time_s) and moved.contacts.fret.size
        assert np.array_equal(kept["energy_j"], moved.energies()[2])
        assert np.array_equal(kept["shapes_m"], moved.shapes([0.01])[2][0])
    brute = livebass.simulate(BASS, duration=0.02, quality=QUICK, modes=40, solver="reference")
    assert np.abs(brute.displacement() - moved.displacement()[: brute.motion.time_s.size]).max() < 1e-6


def test_the_quality_sets_the_modes_of_a_stopped_string() -> None:
    moved = livebass.simulate(BASS, fret=12, duration=0.001, quality=QUICK, at=0.2)
    assert moved.trial.modes == 20 and moved.trial.contact_rate == 409_600


def test_a_board_that_loses_nothing_gets_the_modes_and_contact_rate_that_it_needs() -> None:
    bass, live = livebass.load_preset("paper-fretless"), livebass.QUALITIES["live"]
    over_board = live.for_contact(0.0, board=True)
    assert over_board != live
    moved = livebass.simulate(bass, duration=0.001, quality=live)
    s = speaking(bass.strings[0], bass.necks[0], 0)
    assert moved.trial.modes == modes_for(over_board, s.length, s.length, s.grid_points)
    assert moved.trial.contact_rate == over_board.contact_rate


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_sweep_is_the_grid_of_single_plucks(workers: int) -> None:
    done: list[float] = []
    swept = livebass.sweep(
        "paper-g", ["pluck.apex=1mm:4mm:2", "pluck.fret=0:2:3"], duration=0.05, quality=QUICK, at=0.4,
        workers=workers, progress=done.append,
    )  # fmt: skip
    assert swept.values("contacts").shape == (2, 3) and done[-1] == 1
    for i, apex in enumerate((1e-3, 4e-3)):
        for fret in range(3):
            moved = livebass.simulate(BASS, apex=apex, fret=fret, at=0.4, duration=0.05, quality=QUICK, rate=51_200)
            assert swept.values("contacts")[i, fret] == pytest.approx(moved.contacts.fret.size, abs=3)
            assert swept.values("peak")[i, fret] == pytest.approx(np.abs(moved.displacement()).max(), rel=0.01)
    assert swept.table().splitlines()[0].startswith("pluck.apex [mm],pluck.fret,contacts")
    assert len(swept.table().splitlines()) == 7


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "string": (lambda: livebass.simulate(BASS, string="E"), "this bass has G"),
    "fret": (lambda: livebass.simulate(BASS, fret=99), "frets 0 to 20"),
    "apex": (lambda: livebass.simulate(BASS, apex=1.0), "apex must be from -30 mm to 30 mm, not 1 m"),
    "at": (lambda: livebass.simulate(BASS, at=float("nan")), "place of the pluck must be at least"),
    "rate": (lambda: livebass.simulate(BASS, rate=10), "rate must be a whole number of Hz from"),
    "solver": (lambda: livebass.simulate(BASS, solver="magic"), "engine or reference"),
    "shape": (lambda: livebass.simulate(BASS, duration=0.1, shape_at=[2.0]), "time of a shape must be from 0"),
    "shapes": (lambda: livebass.simulate(BASS, solver="reference", shape_at=[0.0]), "only the engine"),
    "nothing to vary": (lambda: livebass.sweep("paper-g", []), "vary: needs KEY=FROM:TO:N"),
    "key": (lambda: livebass.sweep("paper-g", "neck.magic=1:2:3"), "unknown key"),
    "value": (lambda: livebass.sweep("paper-g", "pluck.apex=1m:2m:3"), "must be from"),
    "preset": (lambda: livebass.sweep("nothing", "pluck.apex=1mm:2mm:3"), "unknown"),
    "workers": (lambda: livebass.sweep("paper-g", "pluck.apex=1mm:2mm:3", workers=0), "workers must be a whole number"),
    "recording": (lambda: livebass.identify("nowhere.wav", BASS), "no such file"),
    "no recording": (lambda: livebass.identify([], BASS), "no recording"),
    "its string": (lambda: livebass.identify(RECORDING, BASS, string="E"), "this bass has G"),
    "modes": (lambda: livebass.identify(RECORDING, BASS, modes=3), "modes must be a whole number from 4 to 200, not 3"),
    "channel": (lambda: livebass.identify(RECORDING, BASS, channel=0), "channel must be a whole number from 1 to 64"),
    "start": (lambda: livebass.identify(RECORDING, BASS, start=-1.0), "start must be from 0 to 10 s, not -1 s"),
    "duration": (lambda: livebass.identify(RECORDING, BASS, duration=float("nan")), "duration must be from 50 ms"),
    "note and f0": (lambda: livebass.identify(RECORDING, BASS, note=43, f0=98.0), "one of them"),
    "stereo": (lambda: livebass.spectrogram_db(np.ones((2, 9000)), 48000), "sound must be of one dimension"),
    "too short": (lambda: livebass.characteristic_frequencies(np.ones(99), 48000), "0.0427 s are needed"),
    "no rate": (lambda: livebass.spectrogram_db(np.ones(9000), 0), "rate must be above 0, not 0 Hz"),
    "silence": (lambda: livebass.spectrogram_db(np.zeros(9000), 48000), "nothing sounds"),
    "strings": (lambda: livebass.fundamental(np.ones((4, 9000)), 48000), "sound must be of one dimension"),
    "limits": (lambda: livebass.fundamental(np.ones(9000), 48000, 500.0, 100.0), "range of the pitch must be"),
    "lengths": (lambda: livebass.contactogram([0.0], [0, 1], [1, 2]), "1"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_values_are_one_line(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    """A ValueError that gives the allowed values; nothing is printed, nothing exits."""
    call, why = REFUSED[name]
    with pytest.raises(ValueError) as raised:
        call()
    assert why in str(raised.value) and len(str(raised.value).splitlines()) == 1
    assert capfd.readouterr() == ("", "")


def test_values_of_an_unknown_quantity() -> None:
    swept = livebass.sweep("paper-g", "pluck.apex=0.1mm:0.2mm:2", duration=0.01, quality=QUICK)
    assert np.isnan(swept.values("first_contact")).all()
    with pytest.raises(ValueError, match="quantity must be contacts, frets"):
        swept.values("magic")


def test_the_package_says_that_it_is_typed() -> None:
    assert (ROOT / "livebass" / "py.typed").is_file()


def test_the_program_of_a_user_has_every_public_name() -> None:
    """tools/check runs mypy on it."""
    assert set(re.findall(r"\blivebass\.(\w+)", PROGRAM.read_text("utf-8"))) == set(livebass.__all__)
    assert "tests/program.py" in (ROOT / "pyproject.toml").read_text("utf-8").partition("[tool.mypy]")[2]


@pytest.mark.slow
def test_a_consumer_of_the_installed_wheel_is_checked(tmp_path: Path) -> None:
    """mypy --strict trusts the installed package's types and finds a wrong one."""
    build = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(tmp_path), str(ROOT)]
    offline = ["--no-build-isolation"] if importlib.util.find_spec("hatchling") else []  # from the extra `test`
    subprocess.run([*build, *offline], check=True, timeout=300)
    venv.create(tmp_path / "env", with_pip=False)
    (site,) = (tmp_path / "env").glob("lib/python*/site-packages")
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        assert "livebass/py.typed" in packed.namelist()
        packed.extractall(site)
    (site / "numpy.pth").write_text(f"{Path(np.__file__).parents[1]}\n")
    consumer = tmp_path / "consumer.py"

    def checked(text: str) -> subprocess.CompletedProcess[str]:
        consumer.write_text(text)
        python = tmp_path / "env" / "bin" / "python"
        line = [sys.executable, "-m", "mypy", "--strict", "--python-executable", str(python), str(consumer)]
        return subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)

    right = checked(PROGRAM.read_text("utf-8"))
    assert right.returncode == 0, right.stdout
    wrong = checked(PROGRAM.read_text("utf-8") + '\nlivebass.simulate(bass, apex="1 mm")\n')
    assert wrong.returncode == 1 and "arg-type" in wrong.stdout and len(wrong.stdout.splitlines()) == 2, wrong.stdout
