"""Checks that every package that livebass can need has a wheel, for each Python and system that livebass supports.

    python tools/run.py available [EXTRA ...]       a table; exit status 1 if a wheel is missing

Asks pip which wheels it would install, with the requirements of pyproject.toml and, in turn, of these packages.
Conditions such as python_version < "3.13" are those of the other system: pip itself would take this one's.
"""

from __future__ import annotations

import itertools
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from oldest import wanted
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from run import project

ROOT = Path(__file__).resolve().parents[1]
VERSION = re.compile(r"Programming Language :: Python :: (3\.\d+)$")
# By name: pip's platforms, and the values of conditions
SYSTEMS: dict[str, tuple[list[str], dict[str, str]]] = {
    "Linux x86-64": (
        [f"manylinux_2_{minor}_x86_64" for minor in range(5, 37)] + ["manylinux1_x86_64", "manylinux2014_x86_64"],
        {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix", "platform_machine": "x86_64"},
    ),
    "Linux arm64": (
        [f"manylinux_2_{minor}_aarch64" for minor in range(17, 37)] + ["manylinux2014_aarch64"],
        {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix", "platform_machine": "aarch64"},
    ),
    "macOS arm64": (
        ["macosx_14_0_arm64"],
        {"sys_platform": "darwin", "platform_system": "Darwin", "os_name": "posix", "platform_machine": "arm64"},
    ),
    "Windows": (
        ["win_amd64"],
        {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt", "platform_machine": "AMD64"},
    ),
}
MISSING = "missing"


def main() -> None:
    """Prints the table of the extras that the command line names, by default of all."""
    stated = project()
    extras = stated["optional-dependencies"]
    if unknown := [name for name in sys.argv[1:] if name not in extras]:
        sys.exit(f"tools/available: EXTRA must be one of {', '.join(extras)}, not {unknown[0]}")
    needed = wanted(stated, sys.argv[1:] or extras)
    pythons = [given[1] for text in stated["classifiers"] if (given := VERSION.match(text))]
    columns = [(system, python) for system in SYSTEMS for python in pythons]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda column: wheels(needed, *column), columns))
    print(table(columns, found))
    if any(MISSING in each.values() for each in found):
        sys.exit(1)


def wheels(needed: Iterable[str], system: str, python: str) -> dict[str, str]:
    """Returns the versions with wheels of the packages that the requirements `needed` need, or `MISSING`, by name."""
    platforms, facts = SYSTEMS[system]
    facts = facts | {"python_version": python, "python_full_version": f"{python}.0", "implementation_name": "cpython"}
    facts["platform_python_implementation"] = "CPython"
    found: dict[str, str] = {}
    wanted: dict[str, set[str]] = {}  # by name: all that is required of a package ...
    extras: dict[str, set[str]] = {}  # ... and its extras
    new = [(text, "") for text in needed]  # with the package that has this requirement
    while new:
        changed = set()
        for one, of in ((Requirement(text), of) for text, of in new):
            name = str(canonicalize_name(one.name))
            holds = not one.marker or any(one.marker.evaluate(facts | {"extra": e}) for e in extras.get(of) or [""])
            text = f"{name}{one.specifier}"
            if holds and not (text in wanted.get(name, ()) and one.extras <= extras[name]):
                wanted.setdefault(name, set()).add(text)
                extras.setdefault(name, set()).update(one.extras)
                changed.add(name)
        new = []
        for name, version, further in chosen([sorted(wanted[name]) for name in sorted(changed)], platforms, python):
            found[name] = version
            new += [(text, name) for text in further]
    return found


def chosen(wanted: list[list[str]], platforms: list[str], python: str) -> list[tuple[str, str, list[str]]]:
    """Returns name, version and requirements of the wheels that pip chooses, or `MISSING`.

    wanted: the requirements of each package. If not all have a wheel, it asks for fewer at a time.
    """
    if not wanted:
        return []
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder, "report.json")
        command = [
            sys.executable, "-m", "pip", "install", "--dry-run", "--quiet", "--disable-pip-version-check", "--no-deps",
            "--ignore-installed", "--only-binary", ":all:", "--implementation", "cp", "--python-version", python,
            "--target", folder, "--report", str(report), *(f"--platform={platform}" for platform in platforms),
            *itertools.chain.from_iterable(wanted),
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            installs = json.loads(report.read_text("utf-8"))["install"]
            return [described(install["metadata"]) for install in installs]
    if len(wanted) == 1:
        return [(str(canonicalize_name(Requirement(wanted[0][0]).name)), MISSING, [])]
    half = len(wanted) // 2
    return [one for part in (wanted[:half], wanted[half:]) for one in chosen(part, platforms, python)]


def described(metadata: dict[str, object]) -> tuple[str, str, list[str]]:
    further = metadata.get("requires_dist")
    name, version = str(canonicalize_name(str(metadata["name"]))), str(metadata["version"])
    return name, version, list(further) if isinstance(further, list) else []


def table(columns: list[tuple[str, str]], found: list[dict[str, str]]) -> str:
    """Returns a line for each package: its version, and where it has no wheel or another version."""
    lines = []
    for name in sorted({name for each in found for name in each}):
        versions = [each.get(name, "") for each in found]
        common = max(set(versions) - {""}, key=versions.count)
        others = [f"{version} on {system} {python}" for (system, python), version in zip(columns, versions, strict=True)
                  if version not in ("", common)]  # fmt: skip
        lines.append(f"{name:24} {common:14} {', '.join(others)}".rstrip())
    return "\n".join(lines)


if __name__ == "__main__":
    main()
