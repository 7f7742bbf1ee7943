"""Sweeps in processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil

from support.jack import wait_for
from support.needs import processes

PATIENCE = 120  # s until a test gives up
COUNT = 8
THREADS = "OPENBLAS_NUM_THREADS"
SWEEP = (
    "study", "sweep", "--vary", "pluck.apex=2mm:5mm:4", "--vary", "neck.contact_stiffness=1e9:1e13:2:log",
    "--modes", "60", "--contact-rate", "192kHz", "--duration", "1s", "--no-picture",
)  # fmt: skip


class Deadly:
    """Ends any process that unpickles it."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os._exit, (3,)


# The command, which stops its own process, as by Ctrl-Z, when it has kept as many points as its first argument says
PAUSING = """
import os, signal, sys
import livebass.lab.experiment.sweep as module
count, completed = int(sys.argv.pop(1)), module.compute_missing
def pausing(*arguments):
    for done in completed(*arguments):
        if done == count:
            os.kill(os.getpid(), signal.SIGSTOP)
        yield done
module.compute_missing = pausing
from livebass.__main__ import main
main()
"""


@contextmanager
def sweeping(directory: Path, *more: str, pause: int = 0) -> Iterator[subprocess.Popen[str]]:
    """The running command; its process and workers are gone in the end. Skips the test if processes share no memory.

    The sweep limits the threads of linear algebra itself, whatever tests/conftest.py sets.

    pause: The process stops when it has kept this many points, until SIGCONT; see `paused`.
    """
    processes()
    environment = {name: value for name, value in os.environ.items() if name != THREADS}
    command = ["-c", PAUSING, str(pause)] if pause else ["-m", "livebass"]
    line = [sys.executable, *command, *SWEEP, *more, "-o", str(directory)]
    process = subprocess.Popen(
        line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, env=environment
    )
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


def paused(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """Its workers, once it has stopped itself; the one that computes finishes its point and waits."""
    wait_for(lambda: psutil.Process(process.pid).status() == psutil.STATUS_STOPPED)
    return psutil.Process(process.pid).children()


def has_ended(process: psutil.Process) -> bool:
    """True once a process has ended, collected by its parent or not."""
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:  # ended between the two calls
        return True


def keep(directory: Path) -> dict[str, int]:
    """The existing points, and their write times, ns."""
    return {file.name: file.stat().st_mtime_ns for file in (directory / "points").glob("[!.]*.json")}


def finish(process: subprocess.Popen[str]) -> str:
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0 and not out, err
    return err


def swept(directory: Path) -> Path:
    """The whole table, in `directory`."""
    with sweeping(directory) as process:
        finish(process)
    assert len(keep(directory)) == COUNT
    return directory


def same(directory: Path, other: Path) -> None:
    assert (directory / "sweep.csv").read_bytes() == (other / "sweep.csv").read_bytes()
    assert keep(directory).keys() == keep(other).keys()
    assert not list(directory.rglob(".*"))
