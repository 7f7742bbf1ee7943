"""Which commands need which extras, and how to install their packages."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import re
import shlex
import sys
from pathlib import Path

REFERENCE = "reference"  # an extra of wheels, with the compiler that livebass needs elsewhere (tools/wheels.py)
USES = (  # what needs packages beside those of livebass itself: the extras, all of which it needs
    ("`play`, `devices`, `bench latency`, `fit --guide --record`", "live"),
    ("`play --osc`", "live,osc"),
    ("Guitar Pro and MusicXML files, in all commands", "tab"),
    ("`identify`, `study claims`, the characteristic frequency of `simulate --analyse`", "analysis"),
    ("`compare --hear`, `bench fidelity --hear`", "hear"),
    ("`compare -o`, `map -o`, pictures of `study sweep` and `bench --plot`", "plots"),
    ("`study` with the names of studies", "analysis,plots"),
    ("`fit`", "analysis,fit,plots"),
    ("`fit --no-page`", "analysis,fit"),
    ("`study sweep --scheduler`, `map --scheduler`, and `fit --scheduler` besides", "cluster"),
    ("`export vst3`, `clap`, `lv2` without a C compiler, or for other systems", "export"),
    ("`simulate --solver reference`, `study claims`, `bench render`, from a wheel", REFERENCE),
)


def installed_version(package: str) -> str:
    """The version of an installed package; "none" without it."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "none"


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
