"""A sweep's processes, real ones: killed and interrupted; the table is the same to the byte."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from support.command import assert_one_clear_line
from support.jack import wait_for
from support.needs import processes
from support.sweeps import COUNT, PATIENCE, THREADS, Deadly, finish, has_ended, keep, paused, same, sweeping, swept

from livebass.lab.experiment.grid import Settings, axis, grid
from livebass.lab.experiment.workers import compute_points
from livebass.model.quality import quality_with


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swept(tmp_path_factory.mktemp("sweep") / "undisturbed")


def test_killed_in_the_middle_it_computes_nothing_twice(undisturbed: Path, tmp_path: Path) -> None:
    directory = tmp_path / "d"
    with sweeping(directory, "--workers", "1", pause=3) as process:
        workers = paused(process)
        process.send_signal(signal.SIGKILL)
        process.wait(PATIENCE)
        wait_for(lambda: all(map(has_ended, workers)))
    before = keep(directory)
    assert len(before) == 3 and not (directory / "sweep.csv").exists()
    (directory / "points" / ".0.json.tmp-00000000").write_text("{")  # as left by a kill during a write
    for left in (directory / "points").glob(".*"):
        os.utime(left, (1, 1))  # some time ago
    with sweeping(directory) as process:
        assert f"{COUNT} points, {len(before)} found in" in finish(process)
    after = keep(directory)
    assert {name: after[name] for name in before} == before
    same(directory, undisturbed)


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_nothing(undisturbed: Path, tmp_path: Path) -> None:
    directory = tmp_path / "d"
    with sweeping(directory, "--workers", "2") as process:
        wait_for(lambda: len(keep(directory)) >= 2)
        workers = [c for c in psutil.Process(process.pid).children() if "spawn_main" in " ".join(c.cmdline())]
        assert len(workers) == 2
        workers[0].kill()
        assert "lost with a process that died" in finish(process)
    same(directory, undisturbed)


def test_interrupted_it_ends_at_once_and_keeps_what_is_done(tmp_path: Path) -> None:
    directory = tmp_path / "d"
    with sweeping(directory, "--workers", "1", pause=1) as process:
        workers = paused(process)
        os.killpg(process.pid, signal.SIGINT)
        process.send_signal(signal.SIGCONT)
        _, err = process.communicate(timeout=PATIENCE)
        wait_for(lambda: all(map(has_ended, workers)))
    said, *error = err.splitlines(keepends=True)
    assert f"{COUNT} to compute with 1 process" in said
    assert_one_clear_line(process.returncode, "".join(error), (130,))
    assert f"1 of {COUNT} points are kept" in err and len(keep(directory)) == 1
    assert not (directory / "sweep.csv").exists()


def test_a_point_that_kills_its_process_is_named_and_the_others_are_done(monkeypatch: pytest.MonkeyPatch) -> None:
    processes()
    monkeypatch.delenv(THREADS)
    quality = quality_with("live", 20, 192e3)
    settings = Settings(apex=3e-3, duration=0.01, quality=quality, modes=20)
    good = grid(settings, [axis("pluck.apex=1mm:2mm:3")])
    bad = replace(good[1], work=Deadly(), name="pluck.apex = 1.5 mm")  # type: ignore[arg-type]
    said: list[str] = []
    done = []
    with pytest.raises(ChildProcessError, match=r"^pluck\.apex = 1\.5 mm: .* died 3 times$"):
        for point, _ in compute_points([good[0], bad, good[2]], 2, said.append):
            done.append(point)
    assert good[0] in done and bad not in done and said
