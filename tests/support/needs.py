"""Skips tests whose system parts are missing, and names the parts: `python tests/support/needs.py` lists them.

A Python package may be installed and yet fail to load, as its wheel does not carry the system's library.
"""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import shutil
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

LIBRARIES = {  # of packages: what each loads, and the Debian package that has it
    "sounddevice": ("PortAudio", "libportaudio2"),
    "jack": ("JACK's library", "libjack-jackd2-0"),
    "pysfizz": ("libatomic", "libatomic1"),
    "pedalboard": ("libatomic", "libatomic1"),
}
COMPILERS = ("cc", "gcc", "clang")
COMPILER = ("a C compiler", "gcc libc6-dev")
PROGRAMS = {
    "cc": COMPILER, "nm": ("nm", "binutils"), "node": ("node", "nodejs"), "jackd": ("JACK", "jackd2"),
    "mscore3": ("MuseScore 3", "musescore3"), "fluidsynth": ("FluidSynth", "fluidsynth"),
    "javac": ("a Java compiler", "default-jdk-headless"),
}  # fmt: skip
OFFERED = ("sounddevice", "jack", "pysfizz", "cc")  # of all these: what tests without real parts can use
# Where nobody may write, not even root
CLOSED = Path("/proc" if sys.platform == "linux" else "/System")
HANGUP = getattr(signal, "SIGHUP", signal.SIGTERM)  # of a closed terminal; Windows has none
UNIX = ("fcntl", "pty", "resource", "termios", "tty")  # modules that Windows lacks
CI = "LIVEBASS_NEEDS_"  # begins variables that CI sets: the part is there, and tests that need it may not skip


class Lacking(ModuleType):
    """A module that this system lacks: whatever uses it is skipped."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return missing(f"Python's module {self.__name__}")


for unix in UNIX:
    if not importlib.util.find_spec(unix):
        sys.modules[unix] = Lacking(unix)


def package(name: str, part: str = "JACK") -> Any:
    """Imports the package `name`; skips the test if it is missing or its library is. Fails if LIVEBASS_NEEDS_part."""
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as error:
        needed, package = LIBRARIES.get(name, (f"the package {name}", ""))
        return missing(needed, package, part, error)


def tool(name: str, part: str = "") -> str:
    """Returns the path of the program `name`; skips the test without it. Fails if LIVEBASS_NEEDS_part."""
    needed, package = PROGRAMS.get(name, (name, ""))
    return shutil.which(name) or missing(needed, package, part)


def processes() -> None:
    """Skips the test if processes cannot share memory, as without /dev/shm."""
    try:
        multiprocessing.get_context("spawn").Lock()
    except OSError as error:
        missing("memory that processes share (/dev/shm)", error=error)


def missing(needed: str, package: str = "", part: str = "", error: Exception | None = None) -> Any:
    """Skips the test, which needs a part of the system. Fails if LIVEBASS_NEEDS_part is set."""
    assert not (part and os.environ.get(CI + part)), f"{needed} is missing: {error or ''}"
    hint = f" (Debian: {package})" if package else ""
    pytest.skip(f"needs {needed}{hint}", allow_module_level=True)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Lists the tests that .ci/run runs again: elsewhere if skipped for want of a part, alone if they failed."""
    if os.environ.get("LIVEBASS_LIST_TESTS"):
        found = terminalreporter.stats
        for report in found.get("skipped", []):
            if report.longrepr[2].startswith("Skipped: needs "):
                terminalreporter.write_line(f"skipped without a part of the system: {report.nodeid}")
        for node in dict.fromkeys(report.nodeid for kind in ("failed", "error") for report in found.get(kind, [])):
            terminalreporter.write_line(f"failed beside others: {node}")


@pytest.hookimpl(wrapper=True, specname="pytest_runtest_setup")  # pytest raises a fixture's error for each of its tests
def pytest_setup_without_compiler() -> Iterator[None]:
    return (yield from skip_without_compiler())


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call() -> Iterator[None]:
    return (yield from skip_without_compiler())


def skip_without_compiler() -> Iterator[None]:
    """Skips a test whose plugin or host cannot be built because there is no C compiler."""
    try:
        return (yield)
    except Exception as error:
        if type(error).__name__ == "BuildError" and not any(map(shutil.which, COMPILERS)):
            missing(*COMPILER)
        raise


def absent() -> list[tuple[str, str]]:
    """Returns the parts that tests can use and that are missing here, as (name, Debian package)."""
    found = []
    for name in OFFERED:
        if name in PROGRAMS:
            if not shutil.which(name):
                found.append(PROGRAMS[name])
            continue
        try:
            importlib.import_module(name)
        except ImportError as error:
            if "No module" not in str(error):
                found.append(LIBRARIES[name])
        except OSError:
            found.append(LIBRARIES[name])
    return found


if __name__ == "__main__":
    if lacking := absent():
        parts = ", ".join(name for name, _ in lacking)
        print(f"Tests that need {parts} will be skipped. Debian: sudo apt install {' '.join(p for _, p in lacking)}")
