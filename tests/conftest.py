"""Fixtures of all tests: the command line in this process, a fake engine, a JACK server; profiles of hypothesis."""

from __future__ import annotations

import itertools
import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import support.source

# isort: split
import support.examples  # noqa: F401, registers the profiles of hypothesis
from support.command import Run
from support.engine import FakeEngine
from support.jack import alone, running_server

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
