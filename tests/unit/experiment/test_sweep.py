"""`livebass study sweep` without its processes: grids, refusals, measurements, kept results and plots."""

from __future__ import annotations

import csv
import json
import math
import socket
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import Run, assert_one_clear_line, refusal

from livebass.engine.solve import output_signal, solve_trial
from livebass.files.whole import Transaction
from livebass.kernels.string.records import MAX_NEAR
from livebass.lab.experiment import sweep
from livebass.lab.experiment.grid import Point, Settings, axis, grid, names, target
from livebass.lab.experiment.point import measure_point
from livebass.lab.experiment.quantities import DEFAULT_QUANTITIES, QUANTITIES
from livebass.lab.experiment.sweep import drawable, edges, pictures
from livebass.lab.experiment.workers import compute_points
from livebass.model.instrument import Neck
from livebass.model.modes import pluck_amplitudes
from livebass.model.quality import quality_with
from livebass.preset.load import preset_source

SMALL = ("--modes", 40, "--contact-rate", "192kHz", "--duration", "50ms")


def settings(preset: str = "paper-g", duration: float = 0.05, **changed: Any) -> Settings:
    values = {"string": "G", "fret": 0, "apex": 3.6e-3, "at": 0.64, "angle": 0.0} | changed
    return Settings(preset=preset, duration=duration, quality=quality_with("live", 40, 192e3), modes=40, **values)


def points(*vary: str, **changed: Any) -> list[Point]:
    return grid(settings(**changed), [axis(text) for text in vary])


@pytest.mark.parametrize(
    "text, unit, numbers",
    [
        ("neck.action=1.5mm:3mm:4", "mm", (1.5, 2.0, 2.5, 3.0)),
        ("neck.action = 1.5 mm : 0.3 cm : 4", "mm", (1.5, 2.0, 2.5, 3.0)),
        ("neck.contact_stiffness=1e9:1e13:5:log", "", (1e9, 1e10, 1e11, 1e12, 1e13)),
        ("pluck.apex=1mm:2mm:11", "mm", (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0)),
        ("pluck.angle=-30deg:30deg:3", "deg", (-30.0, 0.0, 30.0)),
        ("pluck.fret=0:12:4", "", (0.0, 4.0, 8.0, 12.0)),
        ("string.G.open_note=G2:A2:3", "", (43.0, 44.0, 45.0)),
        ("neck.lift.6=0mm:0.5mm:2", "mm", (0.0, 0.5)),
        ("neck.relief=1mm:1mm:1", "mm", (1.0,)),
    ],
)
def test_an_axis(text: str, unit: str, numbers: tuple[float, ...]) -> None:
    made = axis(text)
    assert (made.unit, made.numbers) == (unit, numbers)


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--vary", "neck.action"], "neck.action: needs KEY=FROM:TO:N"),
        (["--vary", "neck.action=1mm:3mm"], "needs KEY=FROM:TO:N"),
        (["--vary", "=1mm:3mm:3"], "needs KEY=FROM:TO:N"),
        ([], "--vary needs KEY=FROM:TO:N"),
        (["--vary", "neck.acton=1mm:2mm:3"], "neck.acton: unknown key; nearest: neck.action"),
        (["--vary", "string.G.tensio=1N:2N:3"], "unknown key; nearest: string.tension"),
        (["--vary", "neck.lift=1mm:2mm:3"], "needs the number of a fret, such as neck.lift.6"),
        (["--vary", "neck.fret_heights=1mm:2mm:3"], "is a list; a sweep varies one number"),
        (["--vary", "player.technique=1:2:3"], "is a choice; a sweep varies one number"),
        (["--vary", "neck.relief=0mm:1mm:0"], "neck.relief: N must be a whole number from 1 to"),
        (["--vary", "neck.relief=0mm:1mm:-2"], "N must be a whole number from 1 to 100000, not '-2'"),
        (["--vary", "neck.relief=0mm:1mm:2.5"], "N must be a whole number from 1 to 100000, not '2.5'"),
        (["--vary", "neck.relief=0mm:1mm:3:lin"], "only log may come after N, not 'lin'"),
        (["--vary", "neck.relief=0mm:1mm:3:log"], "log needs FROM and TO above 0"),
        (["--vary", "neck.relief=1mm:1mm:3"], "FROM and TO are the same"),
        (["--vary", "pluck.apex=1:2:3"], "pluck.apex = '1': a length has no unit; units: mm"),
        (["--vary", "pluck.apex=1mm:2N:3"], "pluck.apex = '2N': a length has the unit 'N'"),
        (["--vary", "pluck.apex=1mm:50mm:3"], "pluck.apex must be from -30 mm to 30 mm, not 50 mm"),
        (["--vary", "pluck.fret=0:12:6"], "pluck.fret must be a whole number, not 2.4"),
        (["--vary", "neck.contact_exponent=1:nan:3"], "must be a number from 1 to 3, not nan"),
        (["--vary", "neck.contact_exponent=one:3:3"], "neck.contact_exponent = 'one': not a number"),
        (["--vary", "pluck.fret=0:21:2"], "pluck.fret = 21: fret 21: this neck has frets 0 to 20"),
        (["--vary", "pluck.fret=0:4:2", "--vary", "pluck.fret=0:4:3"], "pluck.fret: given twice"),
        (["--vary", "pluck.apex=1mm:2mm:400", "--vary", "pluck.at=0.1m:0.5m:400"], "number of points must be from"),
        (["--vary", "neck.action=1.5mm:3mm:7"], "neck.action changes nothing in preset paper-g: its frets"),
        (["--vary", "neck.friction=1N/m:900N/m:3"], "neck.friction changes nothing in preset paper-g"),
        (["--vary", "pickup.2.position=3mm:9mm:3"], "pickup.2.position: this bass has 0 pickups"),
        (["-p", "own.toml", "--vary", "neck.action=1mm:3mm:7"], "action of its own; vary string.G.neck.action"),
        (["-p", "jazz-finger", "--vary", "neck.height_scale=1:2:7"], "its frets are not measured"),
        (["-p", "jazz-finger", "--vary", "string.E.tension=179N:180N:3"], "nothing of this pluck of string G"),
        (["-p", "jazz-finger", "--vary", "player.pluck_position=0.6:0.7:3"], "jazz-finger: vary pluck.at"),
        (["-p", "jazz-finger", "--vary", "string.Q.tension=179N:180N:3"], "this bass has strings E, A, D, G"),
        (["-p", "jazz-finger", "--vary", "string.G.tension=100N:191N:3"], "G.tension = 100 N: jazz-finger.toml:"),
        (["-p", "nobody", "--vary", "pluck.apex=1mm:2mm:3"], "nobody"),
        (["--string", "B", "--vary", "pluck.apex=1mm:2mm:3"], "this bass has G"),
        (["--vary", "pluck.apex=1mm:2mm:3", "--workers", 0], "--workers"),
        (["--vary", "pluck.apex=1mm:2mm:3", "--workers", 2, "--scheduler", "tcp://a:1"], "give one"),
        (["--vary", "pluck.apex=1mm:2mm:3", "--scheduler", "nonsense"], "nonsense: must be an address such as tcp://host"),
        (["--vary", "pluck.apex=1mm:2mm:3", "--quantity", "loudness"], "--quantity"),
        (["--vary", "pluck.apex=1mm:2mm:3", "--json", "."], "is a directory"),
        (["--vary", "pluck.apex=1mm:2mm:3", "--json", "d/sweep.csv"], "is one of the files a sweep writes"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[object], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    own = preset_source("jazz-finger")[1].replace('name = "G"', 'name = "G"\nneck.action = "2 mm"')
    (tmp_path / "own.toml").write_text(own)
    assert words in refusal(run, "study", "sweep", *SMALL, *arguments, "-o", "d")
    assert [path.name for path in tmp_path.iterdir()] == ["own.toml"]


def test_interrupted_before_the_first_point_it_leaves_no_folder(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        assert (tmp_path / "new" / "d" / "points").is_dir()
        raise KeyboardInterrupt

    monkeypatch.setattr("livebass.cli.study._complete", interrupted)
    line = "study", "sweep", "--vary", "pluck.apex=1mm:2mm:3", *SMALL, "-o", tmp_path / "new" / "d"
    err = refusal(run, *line, status=130)
    assert "interrupted, nothing written" in err and not list(tmp_path.iterdir())
    (tmp_path / "new" / "d").mkdir(parents=True)
    (tmp_path / "new" / "mine").touch()
    run(*line)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["d", "mine", "new"], "what was there stays"


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests with this get no answers, so less patience will do."""
    monkeypatch.setattr("livebass.lab.experiment.workers.CONNECT", 2.0)


@pytest.mark.usefixtures("impatient")
def test_a_directory_that_cannot_be_and_a_scheduler_that_is_not_there(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    vary = "--vary", "pluck.apex=1mm:2mm:3"
    err = refusal(run, "study", "sweep", *vary, *SMALL, "-o", tmp_path / "file", status=1)
    assert "is not a directory" in err and (tmp_path / "file").read_text() == "mine"
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    away = "--scheduler", f"tcp://127.0.0.1:{port}"
    err = refusal(run, "study", "sweep", *vary, *SMALL, "-o", tmp_path / "d", *away, status=1)
    assert f"scheduler tcp://127.0.0.1:{port}: does not answer" in err and not (tmp_path / "d").exists()


@pytest.mark.usefixtures("impatient")
def test_an_address_where_something_else_than_dask_answers_or_nobody_says_a_word(run: Run, tmp_path: Path) -> None:
    kept = []  # open: an end, too, would be an answer

    def answer(server: socket.socket) -> None:
        with suppress(OSError):
            while True:
                kept.append(server.accept()[0])
                kept[-1].sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")

    vary = "--vary", "pluck.apex=1mm:2mm:3"
    for serves, words in ((True, "is not a Dask scheduler"), (False, "does not answer")):
        with socket.create_server(("127.0.0.1", 0)) as server:
            if serves:
                threading.Thread(target=answer, args=(server,), daemon=True).start()
            address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
            status, _, err = run("study", "sweep", *vary, *SMALL, "-o", tmp_path / "d", "--scheduler", address)
        assert_one_clear_line(status, err, (1,))
        assert f"scheduler {address}: {words}" in err


def test_keys_reach_what_they_name() -> None:
    low, high = points("neck.lift.6=0mm:0.5mm:2")
    raised = np.subtract(high.work.trial.speaking.contact_height, low.work.trial.speaking.contact_height)
    assert raised[5] == pytest.approx(0.5e-3) and np.count_nonzero(raised) == 1
    changed = points("string.G.neck.action=2mm:3mm:2", "pluck.fret=0:5:2", preset="jazz-finger")
    assert [p.name for p in changed][1] == "string.G.neck.action = 2 mm, pluck.fret = 5"
    assert [p.work.trial.speaking.fret for p in changed] == [0, 5, 0, 5]
    heights = [p.work.trial.speaking.contact_height[11] for p in changed[::2]]
    assert heights == pytest.approx([-2e-3, -3e-3])
    shared = points("neck.action=2mm:3mm:2", preset="jazz-finger")
    assert [p.work.trial.speaking.contact_height[11] for p in shared] == pytest.approx([-2e-3, -3e-3])
    soft = points("neck.contact_stiffness=1e9:1e13:2", "player.rounding=3mm:5mm:2", "pluck.angle=0deg:30deg:2")
    assert {p.work.trial.speaking.contact_stiffness for p in soft} == {1e9, 1e13}
    assert {p.work.trial.pluck.rounding for p in soft} == {3e-3, 5e-3}
    assert len({p.digest for p in soft}) == 8
    assert soft[1].work.trial.speaking.friction == Neck.friction
    one, other = points("pickup.1.position=140mm:160mm:2", preset="jazz-finger")
    assert one.work.trial == other.work.trial and one.work.output != other.work.output
    for name in names():
        assert target(name).key.name in name


def test_same_work_same_digest_whatever_else_the_preset_says(tmp_path: Path) -> None:
    text = preset_source("paper-g")[1]
    (tmp_path / "mine.toml").write_text(text.replace('name = "Paper, G string"', 'name = "Mine"'))
    mine, its = points("pluck.apex=1mm:2mm:2", preset=str(tmp_path / "mine.toml")), points("pluck.apex=1mm:2mm:2")
    assert [p.digest for p in mine] == [p.digest for p in its]
    longer = points("pluck.apex=1mm:2mm:2", duration=0.06)
    assert not {p.digest for p in longer} & {p.digest for p in its}


def test_quantities_are_those_of_the_motion() -> None:
    clean, hard = (p.work for p in points("pluck.apex=0.5mm:5mm:2", duration=0.15))
    motion, result = solve_trial(hard.trial), measure_point(hard)
    assert set(result) == set(QUANTITIES) and set(DEFAULT_QUANTITIES) <= set(QUANTITIES)
    times, frets = motion.contact_time_s, np.array(hard.trial.speaking.contact_fret)[motion.contact_index]
    assert result["contacts"] == times.size > 20
    assert (result["first_contact"], result["last_contact"]) == (times[0], times[-1])
    assert (result["first_fret"], result["frets"]) == (frets[0], len(set(frets)))
    assert times[0] < result["contact_phase"] <= times[-1]
    assert result["peak"] == np.abs(motion.displacement_m).max()
    q = pluck_amplitudes(hard.trial.speaking, 40, hard.trial.pluck)
    nu = 97.976 * np.arange(1, 41) * (1 + 3.5e-5 * np.arange(1, 41) ** 2 / 2)
    assert result["energy"] == pytest.approx(6.69e-3 / 2 * np.sum((2 * math.pi * nu * q) ** 2), rel=5e-3)
    assert 0 < result["energy_left"] < 0.9
    soft = measure_point(clean)
    assert soft["contacts"] == 0 and math.isnan(soft["first_contact"]) and math.isnan(soft["contact_phase"])
    assert soft["hardness"] < 1 < result["hardness"] == pytest.approx(10 * soft["hardness"])
    assert soft["energy_left"] > 0.9
    assert soft["glide"] == pytest.approx(0, abs=1e-2)
    assert result["characteristic_frequency"] > 1.3 * soft["characteristic_frequency"] > 97
    assert soft["t60"] == pytest.approx(3 * math.log(10) / 0.1964190303)


def test_what_is_heard_is_the_sensor_or_the_pickups() -> None:
    (work,) = (p.work for p in points("pluck.apex=2mm:2mm:1"))
    u, out = solve_trial(work.trial).displacement_m, output_signal(work.trial, work.output)
    change = np.diff(u) * work.output.gain
    np.testing.assert_allclose(np.diff(out), change, atol=0.02 * np.abs(change).max())  # up to a DC blocker
    near, far = (measure_point(p.work) for p in points("pickup.1.position=140mm:160mm:2", preset="jazz-finger"))
    differ = {name for name in QUANTITIES if near[name] != far[name] and not math.isnan(near[name])}
    assert differ == {"heard_peak", "heard_characteristic_frequency"}
    assert 0.01 < near["heard_peak"] < 1


def test_a_point_over_a_board() -> None:
    (point,) = grid(replace(settings("paper-fretless"), modes=90), [axis("pluck.apex=4mm:4mm:1")])
    assert len(point.work.trial.speaking.contact_position) > MAX_NEAR
    result = measure_point(point.work)
    assert result["contacts"] > 20 and result["heard_peak"] > 0


def fake(points: list[Point]) -> Iterator[tuple[Point, dict[str, float]]]:
    """Results without strings."""
    for point in points:
        yield point, dict.fromkeys(QUANTITIES, point.numbers[0] / 3) | {"t60": math.inf, "contacts": 3.0}


def test_points_are_kept_and_only_missing_ones_computed(tmp_path: Path) -> None:
    made, results = points("pluck.apex=1mm:2mm:5"), {}
    with Transaction() as files:
        sweep.prepare(files, tmp_path)
    assert list(sweep.compute_missing(tmp_path, made, results, fake)) == [1, 2, 3, 4, 5]
    axes = [axis("pluck.apex=1mm:2mm:5")]
    before = sweep.Sweep(tuple(axes), tuple(made), results).table()
    files = sorted((tmp_path / "points").iterdir())
    assert [f.stem for f in files] == sorted(p.digest for p in made)
    again = sweep.read_points(tmp_path, made)
    assert sweep.Sweep(tuple(axes), tuple(made), again).table() == before
    assert list(sweep.compute_missing(tmp_path, made, again, fake)) == []
    files[0].write_bytes(files[0].read_bytes()[:40])
    files[1].write_text("{}")
    files[2].write_text(files[3].read_text())
    assert len(sweep.read_points(tmp_path, made)) == 2
    finer = points("pluck.apex=1mm:2mm:9")
    assert len(sweep.read_points(tmp_path, finer)) == 2
    rows = list(csv.reader(before.splitlines()))
    assert rows[0][:2] == ["pluck.apex [mm]", "contacts"] and len(rows) == 6
    assert rows[2][:2] == ["1.25", "3"] and float(rows[2][2]) == 1.25 / 3 and rows[2][13] == "nan"


def test_all_of_it_in_process_one(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command, with its processes replaced by this one."""
    monkeypatch.setattr("livebass.lab.experiment.workers.compute_points", lambda points, workers, say: fake(points))
    vary = "--vary", "pluck.apex=1mm:2mm:3", "--vary", "neck.contact_stiffness=1e9:1e13:2:log"
    status, out, err = run("study", "sweep", *vary, *SMALL, "-o", tmp_path / "d", "--json", tmp_path / "s.json")
    assert status == 0 and not out, err
    assert f"6 points, 0 found in {tmp_path / 'd'}, 6 to compute with" in err
    assert sorted(p.name for p in (tmp_path / "d").iterdir()) == ["points", "sweep.csv", "sweep.png", "sweep.svg"]
    described = json.loads((tmp_path / "s.json").read_text())
    assert [p["at"]["pluck.apex"] for p in described["points"]] == [1, 1, 1.5, 1.5, 2, 2]
    assert described["points"][0]["t60"] is None and described["quantities"]["t60"]["unit"] == "s"
    before = {p.name: p.read_bytes() for p in (tmp_path / "d").iterdir() if p.is_file()}
    status, _, err = run("study", "sweep", *vary, *SMALL, "-o", tmp_path / "d")
    assert status == 0 and "6 found" in err and "nothing to compute" in err
    assert before == {p.name: p.read_bytes() for p in (tmp_path / "d").iterdir() if p.is_file()}
    more = "--vary", "pluck.at=0.5m:0.6m:2", "--vary", "player.rounding=4mm:5mm:2"
    status, _, err = run("study", "sweep", *vary, *more, *SMALL, "-o", tmp_path / "d")
    assert status == 0 and "no picture" in err and not (tmp_path / "d" / "sweep.png").exists()


def test_without_memory_that_processes_share_one_computes_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    """A system without /dev/shm gives processes no semaphores."""

    def refuse(*_: Any) -> None:
        raise FileNotFoundError(2, "No such file or directory")

    said: list[str] = []
    monkeypatch.setattr("livebass.lab.experiment.workers.ProcessPoolExecutor", refuse)
    wanted = points("pluck.apex=1mm:2mm:3")
    found = dict(compute_points(wanted, 2, said.append))
    assert found == {point: measure_point(point.work) for point in wanted}
    assert said == ["this system lets processes share no memory (No such file or directory): one computes everything"]


@pytest.mark.parametrize(
    "vary",
    [
        ["pluck.apex=1mm:2mm:4"],
        ["pluck.apex=1mm:2mm:4", "neck.contact_stiffness=1e9:1e13:3:log"],
        ["pluck.fret=0:1:2", "pluck.apex=1mm:2mm:4", "pluck.at=0.1m:0.5m:3"],
    ],
)
def test_pictures(vary: list[str]) -> None:
    axes = [axis(text) for text in vary]
    count = math.prod(len(a.numbers) for a in axes)
    holes = np.where(np.arange(count) % 3, np.arange(count) / 3, np.nan)
    assert drawable(axes)
    values = {"last_contact": holes, "peak": np.full(count, np.nan)}
    png, svg = pictures(axes, values, "a title")
    assert png.startswith(b"\x89PNG") and b"</svg>" in svg
    assert len(axes) > 1 or pictures(axes, values, "a title") == (png, svg)
    assert not drawable([axis("pluck.apex=1mm:2mm:1")])


def test_each_value_is_in_the_middle_of_its_cell_as_the_axis_is_drawn() -> None:
    np.testing.assert_allclose(edges(axis("pluck.apex=1mm:3mm:3")), [0.5, 1.5, 2.5, 3.5])
    stiffness = edges(axis("neck.contact_stiffness=1e9:1e13:5:log"))
    np.testing.assert_allclose(stiffness, 10.0 ** np.arange(8.5, 14))
