"""Windows programs: compiled by ziglang, run by Wine in their own prefix."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from livebass.plugin import build
from livebass.plugin.systems import SYSTEMS
from support.needs import package, tool

WINDOWS = SYSTEMS["windows-x86_64"]
PATIENCE = 60.0  # s


def needs_wine() -> None:
    """Skips a test if Wine or ziglang is not installed; fails where CI promises them."""
    tool("wine", "WINE")
    package("ziglang", "WINE")


def program(name: str, folder: Path) -> Path:
    """Compiles the host NAME.c beside this file for Windows, into `folder`."""
    made, source = folder / f"{name}.exe", Path(__file__).parent / f"{name}.c"
    # As the plugins: by one C library
    flags = ("-std=gnu11", "-Os", "-s", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Werror", f"-I{build.C}")
    subprocess.run([*build.zig(WINDOWS), *flags, source, *build.LINKING["dll"], "-o", made], check=True)
    return made


@contextmanager
def running_wine(folder: Path) -> Iterator[None]:
    """A prefix in `folder`; everything that runs in it ends with the block."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("WINEPREFIX", str(folder))
        patch.setenv("WINEARCH", "win64")
        patch.setenv("WINEDLLOVERRIDES", "mscoree,mshtml,winemenubuilder.exe=")  # no .NET, no browser, no menus
        patch.setenv("WINEDEBUG", "-all")
        folder.mkdir(parents=True, exist_ok=True)
        prefix = folder.stat()
        try:
            run("wine", "wineboot", "--init")
            run("wineserver", "--wait")
            yield
        finally:
            subprocess.run(["wineserver", "--kill"], timeout=PATIENCE, check=False)
            subprocess.run(["wineserver", "--wait"], timeout=PATIENCE, check=False)
            for left in Path("/tmp").glob(f"wine-*/server-{prefix.st_dev:x}-{prefix.st_ino:x}"):
                shutil.rmtree(left.parent)  # the socket of the ended server
            shutil.rmtree(folder)  # 0.7 GB


def run(*command: object) -> str:
    """Runs a program; returns what it printed."""
    done = subprocess.run(
        [*map(str, command)], capture_output=True, text=True, timeout=PATIENCE, stdin=subprocess.DEVNULL
    )
    assert done.returncode == 0, f"{command}: {done.returncode}: {done.stderr[-2000:]}"
    return done.stdout


def place(path: Path) -> str:
    """The Windows name of a file of this system."""
    return f"Z:{path}"
