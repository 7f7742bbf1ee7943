"""Fixtures of all tests: the command line in this process, a fake engine, a JACK server; profiles of hypothesis."""

from __future__ import annotations

import ctypes
import itertools
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import support.examples  # noqa: F401, registers the profiles of hypothesis
from support.command import Run
from support.engine import FakeEngine
from support.jack import JACK_PERIOD, JACK_RATE

from livebass.cli import main as cli
from livebass.engine import render as render_module

NEEDED = bool(os.environ.get("LIVEBASS_NEEDS_JACK"))
NUMBERS = itertools.count()
BEGAN: list[str] = []  # the scope of this worker's first test


def pytest_configure() -> None:
    """Restores signals that a shell's `&` or nohup made us ignore: children inherit that, and tests send them."""
    for number, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, usual)


def scope_of(nodeid: str) -> str:
    """The scope one worker takes whole: a file; or all tests that play in real time or measure time, in turn."""
    file = nodeid.split("::")[0]
    return "timed" if file.startswith(("tests/live/", "tests/bench/")) else file


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_make_scheduler(config: Any, log: Any) -> Any:
    from xdist.scheduler import LoadScopeScheduling

    class ByScope(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return scope_of(nodeid)

    return ByScope(config, log)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A worker that does not begin with the timed tests lets the one that does go first."""
    if "PYTEST_XDIST_WORKER" in os.environ and not BEGAN:
        BEGAN.append(scope_of(item.nodeid))
        if BEGAN != ["timed"]:
            os.nice(5)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> type[FakeEngine]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(render_module, "Engine", FakeEngine)
    monkeypatch.setattr("livebass.compiling.cached", lambda: True)
    monkeypatch.setattr(FakeEngine, "peak", 0.1)
    return FakeEngine


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    def run_(*arguments: object) -> tuple[int, str, str]:
        status = cli.run([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return status, out, err

    return run_


def _end_with_parent() -> None:
    """Has Linux end this process with its parent, also if that is killed; a machine has room for a few servers only."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG; it may be stopped


@pytest.fixture(scope="module")
def server() -> Iterator[SimpleNamespace]:
    """A JACK server for one module of tests, ended by its process id whatever happens."""
    if not shutil.which("jackd"):
        assert not NEEDED, "jackd is missing"
        pytest.skip("there is no jackd here")
    name = f"livebass-test-{os.getpid()}-{next(NUMBERS)}"
    before = {key: os.environ.get(key) for key in ("JACK_DEFAULT_SERVER", "JACK_NO_AUDIO_RESERVATION")}
    os.environ["JACK_DEFAULT_SERVER"], os.environ["JACK_NO_AUDIO_RESERVATION"] = name, "1"
    command = ["jackd", "--no-realtime", "-n", name, "-d", "dummy", "-r", str(JACK_RATE), "-p", str(JACK_PERIOD)]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=_end_with_parent
    )  # fmt: skip
    try:
        jack = pytest.importorskip("jack")
        end = time.monotonic() + 10
        while True:
            try:
                jack.Client("probe", no_start_server=True).close()
                break
            except jack.JackError:
                assert time.monotonic() < end and process.poll() is None, "jackd did not start"
                time.sleep(0.1)
        yield SimpleNamespace(process=process, jack=jack)
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
        for key, value in before.items():
            if value is None:
                os.environ.pop(key, None)
            else:
                os.environ[key] = value
