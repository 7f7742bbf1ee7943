"""Fixtures of all tests: the command line in this process, a fake engine, a JACK server; profiles of hypothesis."""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import support.source

# isort: split
import support.examples  # noqa: F401, registers the profiles of hypothesis
from support.command import Run
from support.engine import FakeEngine
from support.jack import alone, leave_nothing, running_server

from livebass.cli import main as cli
from livebass.compiling import library, store
from livebass.engine import render as render_module

NEEDED = bool(os.environ.get("LIVEBASS_NEEDS_JACK"))
NUMBERS = itertools.count()
NICE = 10  # of a worker from its first test on that is not timed
COMPILE = "from livebass.compiling import library; library.library()"


def pytest_configure() -> None:
    """Restores signals that a shell's `&` or nohup made us ignore: children inherit that, and tests send them."""
    for number, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, usual)


def pytest_sessionfinish() -> None:
    leave_nothing()


# Files whose tests run with no compiled kernels, and those of them that go first, while one worker compiles the kernels
WITHOUT_KERNELS = ("tests/identification/", "tests/reference/", "tests/analysis/")
MEANWHILE = ("tests/reference/", "tests/analysis/", "tests/identification/test_fit.py")
# Then files that use all processors, while the timed tests wait most of their time; then those that take longest, so
# that no worker is left with one at the end. Browsers and processes that are interrupted leave a processor idle.
NEXT = (
    "tests/paper/test_claims.py",
    "tests/test_wheel.py",
    "tests/engine/bass/test_tiers.py",
    "tests/engine/player/test_playing.py",
    "tests/preset/test_idle.py",
    "tests/identification/test_identify.py",
    "tests/web/test_page.py",
    "tests/engine/test_fuzz.py",
    "tests/engine/bass/test_levels.py",
    "tests/engine/hands/test_techniques.py",
    "tests/identification/test_doubts.py",
    "tests/engine/test_engine.py",
    "tests/test_interrupts.py",
    "tests/engine/test_laws.py",
    "tests/plugin/test_lv2.py",
    "tests/test_compiling.py",
)


# Of the live path and of measurements, what asks a fake device for blocks, or renders: no clock tells these when
AT_ANY_PACE = (
    "tests/bench/test_decay.py", "tests/bench/test_render.py", "tests/live/test_desk.py",
    "tests/live/test_effects.py", "tests/live/test_events.py", "tests/live/test_live.py",
    "tests/live/test_parameters.py", "tests/live/test_takes.py", "tests/live/test_team.py",
)  # fmt: skip


def scope_of(nodeid: str) -> str:
    """The scope one worker takes whole: a file; or all tests that play in real time or measure time, in turn."""
    file = nodeid.split("::")[0]
    return "timed" if file.startswith(("tests/live/", "tests/bench/")) and file not in AT_ANY_PACE else file


def turn_of(scope: str) -> int:
    """Place of a scope in the order of all; equal ones keep theirs."""
    if scope == "timed":
        return 0
    if scope.startswith(MEANWHILE):
        return 1
    return 2 + (NEXT.index(scope) if scope in NEXT else len(NEXT))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Puts tests in order for several workers."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        items.sort(key=lambda item: turn_of(scope_of(item.nodeid)))


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_make_scheduler(config: Any, log: Any) -> Any:
    from xdist.scheduler import LoadScopeScheduling

    class ByScope(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return scope_of(nodeid)

    return ByScope(config, log)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Timed tests go before those of other workers; kernels are compiled by one worker, for all."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        return
    scope = scope_of(item.nodeid)
    if scope != "timed" and not os.nice(0):
        os.nice(NICE)
    if not scope.startswith(WITHOUT_KERNELS):
        have_kernels()


@cache
def have_kernels() -> None:
    """Compiles the kernels if need be, in a process of its own; those of workers that need them meanwhile wait."""
    if store.kept() and not library.cached():
        subprocess.run([sys.executable, "-c", COMPILE], check=False, stderr=subprocess.DEVNULL)


@pytest.fixture(autouse=True)
def nothing_remembered(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """`livebass play` neither reads nor writes the settings of the user."""
    monkeypatch.setenv(
        "LIVEBASS_SETTINGS", str(tmp_path_factory.getbasetemp() / "none" / str(next(NUMBERS)) / "a.toml")
    )


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> type[FakeEngine]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(render_module, "Engine", FakeEngine)
    monkeypatch.setattr("livebass.compiling.library.cached", lambda: True)
    monkeypatch.setattr(FakeEngine, "peak", 0.1)
    monkeypatch.setattr(FakeEngine, "weakened", 0)
    return FakeEngine


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    def run_(*arguments: object) -> tuple[int, str, str]:
        status = cli.run([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return status, out, err

    return run_


@pytest.fixture(scope="module")
def server() -> Iterator[SimpleNamespace]:
    """A JACK server for one module of tests, ended by its process id whatever happens."""
    if not shutil.which("jackd"):
        assert not NEEDED, "jackd is missing"
        pytest.skip("there is no jackd here")
    jack = pytest.importorskip("jack")
    with alone(), running_server() as process:
        yield SimpleNamespace(process=process, jack=jack)
