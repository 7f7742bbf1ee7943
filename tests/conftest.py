"""Fixtures of all tests; each test's kind, from its folder, and its place among several workers of pytest-xdist."""

from __future__ import annotations

import gc
import itertools
import os
import signal
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing
from typing import Any

import pytest

from livebass.system.cores import ONE_THREAD

os.environ.update(ONE_THREAD)  # before numpy is imported, here and in processes that tests start

import support.needs  # stands in for modules that this system lacks
import support.source

# isort: split
import support.examples  # registers the profiles of hypothesis
import support.images  # noqa: F401, keeps the basses of engines
from support import kinds, products
from support.command import Run
from support.jack import leave_nothing
from support.needs import pytest_pyfunc_call, pytest_setup_without_compiler, pytest_terminal_summary  # noqa: F401, hooks

from livebass.cli import main as cli

WORKER = os.environ.get("PYTEST_XDIST_WORKER")
NUMBERS = itertools.count()
NICE = 10  # of a worker from its first test that is not real


def pytest_configure() -> None:
    """Restores signals that a shell's `&` or nohup made us ignore: children inherit that, and tests send them."""
    for name, default in (("SIGINT", signal.default_int_handler), ("SIGHUP", signal.SIG_DFL)):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number and signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, default)


def pytest_sessionfinish() -> None:
    leave_nothing()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leaves the thousands of tests and the modules, which live to the end, out of every search for garbage."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_itemcollected(item: pytest.Item) -> None:
    """Marks a test by its folder."""
    for mark in kinds.marks(item.nodeid):
        item.add_marker(mark)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if WORKER:
        items.sort(key=lambda item: kinds.turn(item.nodeid))


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Tells which tests one worker takes together: marks of groups are lost with pytest 9.2."""
    from xdist.scheduler import LoadScopeScheduling

    class Groups(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return kinds.group(nodeid)

    return Groups(config, log)


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_node_collection_finished(ids: list[str]) -> None:
    """Starts making the needed products, in a process beside the workers, once all tests are known."""
    products.begin_once(*products.needed(ids))


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Real tests go before other workers'; compiled code is ready before a test begins."""
    if not WORKER:
        return
    if not item.get_closest_marker("real") and not os.nice(0):
        os.nice(NICE)
    for product in products.needed([item.nodeid]):
        products.have(product)


@pytest.fixture(autouse=True)
def nothing_remembered(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """`livebass play` neither reads nor writes the user's settings."""
    monkeypatch.setenv(
        "LIVEBASS_SETTINGS", str(tmp_path_factory.getbasetemp() / "none" / str(next(NUMBERS)) / "a.toml")
    )


@pytest.fixture
def lend() -> Iterator[Callable[[Any], Any]]:
    """Passes on what has a `close`, and calls that after the test, for the last one first."""
    with ExitStack() as lent:
        yield lambda made: lent.enter_context(closing(made))


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    def run_(*arguments: object) -> tuple[int, str, str]:
        status = cli.run([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return status, out, err

    return run_
