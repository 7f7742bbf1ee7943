"""A sweep's processes, real ones: killed, interrupted, on a Dask cluster; the table is the same to the byte."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from support.command import assert_one_clear_line
from support.needs import processes

from livebass.experiment.grid import Settings, axis, grid
from livebass.experiment.workers import computed
from livebass.model.quality import quality_with

PATIENCE = 120  # s until a test gives up
COUNT = 8
SWEEP = (
    "study", "sweep", "--vary", "pluck.apex=2mm:5mm:4", "--vary", "neck.contact_stiffness=1e9:1e13:2:log",
    "--modes", "60", "--contact-rate", "192kHz", "--duration", "1s", "--no-picture",
)  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def processes_of_their_own() -> None:
    processes()


@pytest.fixture(scope="module", autouse=True)
def threads_of_their_own() -> Iterator[None]:
    """The sweep limits the threads of linear algebra itself, whatever tests/conftest.py sets."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("OPENBLAS_NUM_THREADS")
        yield


@contextmanager
def sweeping(directory: Path, *more: str) -> Iterator[subprocess.Popen[str]]:
    """The running command; its process and workers are gone in the end."""
    line = [sys.executable, "-m", "livebass", *SWEEP, *more, "-o", str(directory)]
    process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    children: list[psutil.Process] = []
    try:
        yield process
    finally:
        if process.poll() is None:
            children = psutil.Process(process.pid).children(recursive=True)
            process.kill()
        process.communicate(timeout=PATIENCE)
        for child in psutil.wait_procs(children, timeout=10)[1]:
            child.kill()


def until(what: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not what():
        assert time.monotonic() < end, "never came"
        time.sleep(0.005)


def gone(process: psutil.Process) -> bool:
    """True once a process has ended, collected by its parent or not."""
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:  # ended between the two calls
        return True


def kept(directory: Path) -> dict[str, int]:
    """The existing points, and their write times, ns."""
    return {file.name: file.stat().st_mtime_ns for file in (directory / "points").glob("[!.]*.json")}


def finished(process: subprocess.Popen[str]) -> str:
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0 and not out, err
    return err


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("sweep") / "undisturbed"
    with sweeping(directory) as process:
        finished(process)
    assert len(kept(directory)) == COUNT
    return directory


def same(directory: Path, other: Path) -> None:
    assert (directory / "sweep.csv").read_bytes() == (other / "sweep.csv").read_bytes()
    assert kept(directory).keys() == kept(other).keys()
    assert not list(directory.rglob(".*"))


def test_killed_in_the_middle_it_computes_nothing_twice(undisturbed: Path, tmp_path: Path) -> None:
    directory = tmp_path / "d"
    with sweeping(directory, "--workers", "1") as process:
        until(lambda: len(kept(directory)) >= 3)
        workers = psutil.Process(process.pid).children()
        process.send_signal(signal.SIGKILL)
        process.wait(PATIENCE)
        until(lambda: all(map(gone, workers)))
    before = kept(directory)
    assert 3 <= len(before) < COUNT and not (directory / "sweep.csv").exists()
    (directory / "points" / ".0.json.tmp-00000000").write_text("{")  # as left by a kill during a write
    for left in (directory / "points").glob(".*"):
        os.utime(left, (1, 1))  # some time ago
    with sweeping(directory) as process:
        assert f"{COUNT} points, {len(before)} found in" in finished(process)
    after = kept(directory)
    assert {name: after[name] for name in before} == before
    same(directory, undisturbed)


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_nothing(undisturbed: Path, tmp_path: Path) -> None:
    directory = tmp_path / "d"
    with sweeping(directory, "--workers", "2") as process:
        until(lambda: len(kept(directory)) >= 2)
        workers = [c for c in psutil.Process(process.pid).children() if "spawn_main" in " ".join(c.cmdline())]
        assert len(workers) == 2
        workers[0].kill()
        assert "lost with a process that died" in finished(process)
    same(directory, undisturbed)


def test_interrupted_it_ends_at_once_and_keeps_what_is_done(tmp_path: Path) -> None:
    directory = tmp_path / "d"
    with sweeping(directory, "--workers", "1") as process:
        until(lambda: len(kept(directory)) >= 1)
        workers = psutil.Process(process.pid).children()
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
        until(lambda: all(map(gone, workers)))
    said, *error = err.splitlines(keepends=True)
    assert f"{COUNT} to compute with 1 process" in said
    assert_one_clear_line(process.returncode, "".join(error), (130,))
    assert f"{len(kept(directory))} of {COUNT} points are kept" in err
    assert not (directory / "sweep.csv").exists()


@pytest.mark.real
def test_on_a_cluster_whose_worker_is_killed_the_table_is_the_same(undisturbed: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    directory = tmp_path / "d"
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(tmp_path), silence_logs=60
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
        ExitStack() as running,
    ):
        victim = psutil.Process(min(client.run(os.getpid).values()))
        process = running.enter_context(sweeping(directory, "--scheduler", cluster.scheduler_address))
        until(lambda: len(kept(directory)) >= 2)
        victim.kill()
        until(lambda: gone(victim))
        assert len(kept(directory)) < COUNT
        assert f"to compute on {cluster.scheduler_address}" in finished(process)
    same(directory, undisturbed)


class Deadly:
    """Ends any process that unpickles it."""

    def __reduce__(self) -> object:
        return os._exit, (3,)


def test_a_point_that_kills_its_process_is_named_and_the_others_are_done() -> None:
    quality = quality_with("live", 20, 192e3)
    settings = Settings(apex=3e-3, duration=0.01, quality=quality, modes=20)
    good = grid(settings, [axis("pluck.apex=1mm:2mm:3")])
    bad = replace(good[1], work=Deadly(), name="pluck.apex = 1.5 mm")  # type: ignore[arg-type]
    said: list[str] = []
    done = []
    with pytest.raises(ChildProcessError, match=r"^pluck\.apex = 1\.5 mm: .* died 3 times$"):
        for point, _ in computed([good[0], bad, good[2]], 2, said.append):
            done.append(point)
    assert good[0] in done and bad not in done and said
