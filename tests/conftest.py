"""Fixtures of all tests: the command line in this process, a fake engine, a JACK server; profiles of hypothesis."""

from __future__ import annotations

import gc
import inspect
import itertools
import os
import signal
import tempfile
from collections.abc import Generator, Iterator
from contextlib import suppress
from functools import cache, cached_property, lru_cache
from pathlib import Path
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any

import pytest

from livebass.cores import ONE_THREAD

os.environ.update(ONE_THREAD)  # before numpy is imported, here and in processes that tests start

import support.needs  # stands in for modules that this system lacks
import support.source

# isort: split
import support.examples  # noqa: F401, registers the profiles of hypothesis
from support import products
from support.command import Run
from support.engine import FakeEngine
from support.jack import lasting_server, leave_nothing
from support.needs import (  # noqa: F401, hooks among them
    package,
    pytest_pyfunc_call,
    pytest_setup_without_compiler,
    pytest_terminal_summary,
    tool,
)

from livebass.cli import main as cli
from livebass.compiling import library, store
from livebass.engine import engine as engine_module
from livebass.engine import render as render_module
from livebass.engine.image import Image, Pool, image

WORKER = os.environ.get("PYTEST_XDIST_WORKER")
REAL = "LIVEBASS_REAL_TESTS"  # names the file in which pytest-xdist's workers list the real tests for the controller
NUMBERS = itertools.count()
NICE = 10  # of a worker from its first test that is not real


class Kept(Image):
    """An image that computes the operators of a tier and a rate once. Nothing that plays changes them."""

    @cached_property
    def pools(self) -> dict[tuple[int, int], Pool]:
        return {}

    def pool(self, tier: int, rate: int) -> Pool:
        if (tier, rate) not in self.pools:
            self.pools[tier, rate] = super().pool(tier, rate)
            self.pools[tier, rate].memory.flags.writeable = False
        return self.pools[tier, rate]


@lru_cache(maxsize=12)
def kept(*asked: Any) -> Kept:
    made = image(*asked)
    return Kept(made.words, made.exact)


# Tests make the same few basses thousands of times
engine_module.image = kept


def pytest_configure() -> None:
    """Restores signals that a shell's `&` or nohup made us ignore: children inherit that, and tests send them."""
    for name, usual in (("SIGINT", signal.default_int_handler), ("SIGHUP", signal.SIG_DFL)):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number and signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, usual)

    if not WORKER:
        handle, os.environ[REAL] = tempfile.mkstemp(prefix="livebass-tests-")
        os.close(handle)


def pytest_sessionfinish() -> None:
    leave_nothing()
    if not WORKER:
        Path(os.environ[REAL]).unlink(missing_ok=True)


# Names used by a test, its fixtures or its file's functions if it has a browser, a server, a host or a screen
REAL_PARTS = {"chromium", "firefox", "running_screen", "lasting_server", "needs_ardour", "needs_wine"}
REAL_FILES = ("tests/real/jack/test_desktop.py", "tests/real/programs/test_wheel.py")
# Names, and modules they come from, used by a test that runs the plugin in a host within its own process
HOSTED_PARTS = {"HOSTS", "pedalboard", "support.clap", "support.lv2", "support.picture", "support.vst3"}
TIMED, WAITS = "timed", "waits in "  # the scope of real tests in real time; begins those of the other real tests
REAL_AT_ONCE = 2  # scopes of real tests, so that browsers and servers do not wait for each other
# Only one worker of a session has a JACK server
IN_REAL_TIME = ("tests/real/jack/", "tests/unit/live/", "tests/unit/bench/", "tests/unit/web/test_watch.py")
# Products that tests need, by folder or file; a process makes them while other tests run
WITHOUT_KERNELS = ("tests/unit/identification/", "tests/unit/reference/", "tests/unit/analysis/")
NEEDED_PRODUCTS = {
    "plugin": (
        "tests/unit/plugin/", "tests/hosted/", "tests/real/host/", "tests/real/window/",
        "tests/promises/cli/test_export.py",
    ),
    "module": ("tests/unit/web/", "tests/real/browser/"),
}  # fmt: skip
# The order of files: those without kernels, then the longest, so no worker is left with one at the end
NEXT = (
    "tests/unit/compiling/test_compiling.py",
    "tests/unit/live/test_play.py",
    "tests/unit/fitting/test_fit.py",
    "tests/hosted/test_promises.py",
    "tests/unit/preset/test_idle.py",
    "tests/unit/bench/test_live.py",
    "tests/unit/engine/hands/test_hands_by_force.py",
    "tests/unit/live/test_live.py",
    "tests/hosted/test_clap.py",
    "tests/unit/export/test_sfz.py",
    "tests/unit/engine/test_pinned.py",
    "tests/unit/engine/player/test_playing.py",
    "tests/hosted/test_lv2.py",
    "tests/unit/engine/player/test_evenness.py",
    "tests/unit/preset/test_preset.py",
    "tests/unit/comparison/test_notes.py",
    "tests/unit/engine/hands/test_touch.py",
    "tests/unit/engine/string/test_turned.py",
    "tests/promises/cli/test_streams.py",
    "tests/unit/experiment/test_sweep.py",
)  # fmt: skip
# The same of real tests
LONGEST_REAL = (
    "tests/real/browser/test_page.py",
    "tests/real/browser/test_bench.py",
    "tests/real/browser/test_controls.py",
    "tests/real/window/test_window.py",
    "tests/real/host/test_ardour.py",
    "tests/real/browser/test_replay.py",
    "tests/real/browser/test_seen.py",
    "tests/real/browser/test_tab.py",
)  # fmt: skip


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leaves the thousands of tests and the modules, which live to the end, out of every search for garbage."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@cache
def names_in(code: CodeType) -> frozenset[str]:
    """The names that a function calls by, and those of functions inside it."""
    inside = [names_in(constant) for constant in code.co_consts if isinstance(constant, CodeType)]
    return frozenset(code.co_names).union(*inside)


@cache
def names_and_functions(function: FunctionType) -> tuple[frozenset[str], list[FunctionType]]:
    """The names that a function calls by, with the modules they come from, and the functions of its file among them."""
    names = names_in(function.__code__)
    found = [function.__globals__[name] for name in names if name in function.__globals__]
    names |= {getattr(f, "__module__", None) or getattr(f, "__name__", "") for f in found}
    used = (inspect.unwrap(f.__init__ if isinstance(f, type) else f) for f in found if callable(f))
    return names, [f for f in used if isinstance(f, FunctionType) and f.__module__ == function.__module__]


def uses(item: pytest.Item, parts: set[str]) -> bool:
    """True if a test, its fixtures or functions they call in their files name one of `parts`."""
    fixtures = [found[-1] for found in item._fixtureinfo.name2fixturedefs.values()]  # type: ignore[attr-defined]
    functions = [item.function, *(fixture.func for fixture in fixtures)]  # type: ignore[attr-defined]
    seen = set()
    while functions:
        function = inspect.unwrap(functions.pop())
        if function not in seen:
            seen.add(function)
            names, more = names_and_functions(function)
            if names & parts:
                return True
            functions += more
    return False


def is_real(item: pytest.Item) -> bool:
    """True if a test has a browser, a server, a host of its own process, or a screen."""
    marked = item.nodeid.startswith(REAL_FILES) or item.get_closest_marker("real") is not None
    return marked or uses(item, REAL_PARTS)


def scope_of(nodeid: str, real: bool) -> str:
    """The scope that one worker takes whole: all timed tests, or the real tests of a file, or its others."""
    file = nodeid.split("::")[0]
    if real:
        return TIMED if nodeid.startswith(IN_REAL_TIME) else WAITS + file
    return file


def has_real(scope: str) -> bool:
    """True if a scope is one of real tests."""
    return scope.startswith((TIMED, WAITS))


def turn_of(scope: str) -> tuple[int, int]:
    """A scope's place in the overall order; equal ones keep theirs."""
    file = scope.removeprefix(WAITS)
    kind = (scope == TIMED, file != scope, file.startswith(WITHOUT_KERNELS), True).index(True)
    longest = LONGEST_REAL if kind == 1 else NEXT
    return kind, longest.index(file) if file in longest else len(longest)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests with real parts or hosts, before marks select any, and orders all tests for several workers."""
    one_of_each = {item.function: item for item in items}  # type: ignore[attr-defined]
    functions = {function for function, item in one_of_each.items() if is_real(item)}
    hosted = {function for function, item in one_of_each.items() if uses(item, HOSTED_PARTS)}
    real = {item.nodeid for item in items if item.function in functions}  # type: ignore[attr-defined]
    for item in items:
        if item.nodeid in real:
            item.add_marker("real")
        if item.function in hosted:  # type: ignore[attr-defined]
            item.add_marker("hosted")
    if WORKER:
        items.sort(key=lambda item: turn_of(scope_of(item.nodeid, item.nodeid in real)))
        Path(os.environ[REAL]).write_text("\n".join(sorted(real)))


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_make_scheduler(config: Any, log: Any) -> Any:
    from xdist.scheduler import LoadScopeScheduling

    class ByScope(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return scope_of(nodeid, nodeid in real_tests())

        def _assign_work_unit(self, node: Any) -> None:
            """Assigns a scope of real tests, unless other workers have as many as go at once; then another one."""
            begun = (units for other, units in self.assigned_work.items() if other is not node)
            busy = sum(any(has_real(scope) and not all(units[scope].values()) for scope in units) for units in begun)
            wanted = busy < REAL_AT_ONCE
            scope = next((scope for scope in self.workqueue if has_real(scope) == wanted), None)
            if scope:
                self.workqueue.move_to_end(scope, last=False)
            super()._assign_work_unit(node)

    return ByScope(config, log)


@cache
def real_tests() -> frozenset[str]:
    """The names of the tests with real parts, as the workers found them."""
    return frozenset(Path(os.environ[REAL]).read_text().splitlines())


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_node_collection_finished(ids: list[str]) -> None:
    """Starts making the needed products, in a process beside the workers, once all tests are known."""
    begin_to_make(*(name for name, places in NEEDED_PRODUCTS.items() if any(i.startswith(places) for i in ids)))


begin_to_make = cache(products.begin)


@cache
def have(product: str) -> None:
    """Makes a product if needed: one of several processes makes it, and the others wait."""
    with suppress(OSError):
        if product != "kernels":
            products.make(product)
        elif store.kept() and not library.cached():  # in a process of its own, which imports numba
            products.begin().wait()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Real tests go before other workers'; compiled code is ready before a test begins."""
    if not WORKER:
        return
    if not item.get_closest_marker("real") and not os.nice(0):
        os.nice(NICE)
    if not item.nodeid.startswith(WITHOUT_KERNELS):
        have("kernels")
    for product, places in NEEDED_PRODUCTS.items():
        if item.nodeid.startswith(places):
            have(product)


@pytest.fixture(autouse=True)
def nothing_remembered(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """`livebass play` neither reads nor writes the user's settings."""
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
    """A JACK server, always ended by its process id."""
    tool("jackd", "JACK")
    jack = package("jack")
    with lasting_server() as process:
        yield SimpleNamespace(process=process, jack=jack)
