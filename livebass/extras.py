"""Tells how to install the packages of a livebass extra."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import re
import shlex
import sys
from pathlib import Path


def install(extras: str) -> str:
    """The command that installs the packages of `extras`, such as "live" or "analysis,plots", beside livebass.

    It names the packages themselves: that works for a checkout, a wheel and any working directory. It runs the program
    that made the environment: pip, pipx or uv.
    """
    packages = shlex.join(requirements(extras.split(",")))
    python, home = sys.executable or "python", Path(sys.prefix)
    if home.parent.name == "venvs" and home.parent.parent.name == "pipx":
        return f"pipx inject {home.name} {packages}"
    if (home.parent.name == "tools" and home.parent.parent.name == "uv") or not importlib.util.find_spec("pip"):
        return f"uv pip install --python {shlex.quote(python)} {packages}"
    return f"{shlex.quote(python)} -m pip install {packages}"


def requirements(extras: list[str]) -> list[str]:
    """The packages that `extras` add, with versions; "livebass[extras]" if livebass' metadata is missing."""
    try:
        stated = importlib.metadata.requires("livebass") or []
    except importlib.metadata.PackageNotFoundError:
        stated = []
    pairs = [(one.partition(";")[0].strip(), re.search(r"extra == ['\"]([^'\"]+)['\"]", one)) for one in stated]
    found = dict.fromkeys(package for package, extra in pairs if extra and extra[1] in extras)
    return list(found) or [f"livebass[{','.join(extras)}]"]
