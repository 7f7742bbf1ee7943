"""Checks livebass with the oldest packages that pyproject.toml allows, or with the newest.

    .venv/bin/python tools/oldest.py                        the oldest, for the Python that runs this
    .venv/bin/python tools/oldest.py --newest --python python3.13 --without pysfizz
    .venv/bin/python tools/oldest.py --no-tests             only the demo and every --help
    .venv/bin/python tools/oldest.py -- tests/promises/cli           these tests; what follows -- goes to pytest

It makes a virtual environment in build/oldest or build/newest by uv, with wheels only, and an empty cache there, so
that these packages compile the kernels. Then it renders the demo and compares it with the one that this Python
renders, bit for bit; prints every --help under several hash seeds, which must give one text; and runs the tests. The
exit status is 1 if anything differs or fails.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from run import name_of, project, requirements

ROOT = Path(__file__).parents[1]
TESTS = ("-n", "2", "-m", "not slow and not real and not hosted")
DEMOS = ("preset", "techniques")
HELPS = "from support.helps import main; main()"


def wanted(table: dict[str, Any], extras: Iterable[str], without: Iterable[str] = ()) -> list[str]:
    """The requirements of `table` (see `project`) and of its `extras`, sorted.

    `without`: names of packages to leave out.
    """
    left_out = {name.lower() for name in without}
    found = {*table["dependencies"], *requirements(table, extras)}
    return sorted(one for one in found if name_of(one) not in left_out)


def run(*line: object, **environment: object) -> None:
    """Runs a program in the checkout. Raises CalledProcessError if it fails."""
    subprocess.run([str(word) for word in line], cwd=ROOT, env=environ(**environment), check=True)


def environ(**more: object) -> dict[str, str]:
    """This environment, with `more`."""
    return os.environ | {name: str(value) for name, value in more.items()}


def program(venv: Path, name: str) -> Path:
    """A program of a virtual environment."""
    folder, ending = ("Scripts", ".exe") if os.name == "nt" else ("bin", "")
    return venv / folder / f"{name}{ending}"


def made_venv(place: Path, python: str, packages: list[str], oldest: bool) -> Path:
    """Makes a virtual environment below `place` with the checkout and `packages`; returns its Python."""
    tools, venv = place.parent / "uv", place / "venv"
    uv = program(tools, "uv")
    if not uv.exists():
        run(sys.executable, "-m", "venv", tools)
        run(program(tools, "python"), "-m", "pip", "install", "--quiet", "uv")
    stated, exact = place / "stated.txt", place / "exact.txt"
    stated.write_text("\n".join(packages) + "\n")
    wheels = ("--only-binary", ":all:")
    resolution = "lowest-direct" if oldest else "highest"
    run(uv, "venv", "--quiet", "--clear", "--seed", "--python", python, venv)
    inside = program(venv, "python")
    run(uv, "pip", "compile", "--quiet", *wheels, "--resolution", resolution, "--python", inside, stated, "-o", exact)
    run(uv, "pip", "install", "--quiet", *wheels, "--python", inside, "-r", exact)
    run(uv, "pip", "install", "--quiet", "--python", inside, "--no-deps", "--editable", ROOT)
    return inside


def same_demos(place: Path, python: Path, cache: Path) -> bool:
    """Renders the demos with both Pythons; returns whether the files are equal."""
    equal = True
    for demo in DEMOS:
        here, there = place / f"{demo}-here.wav", place / f"{demo}.wav"
        line = ("-m", "livebass", "render", "--demo", demo, "-p", "slap", "-o")
        run(sys.executable, *line, here)
        run(python, *line, there, NUMBA_CACHE_DIR=cache)
        same = here.read_bytes() == there.read_bytes()
        print(f"demo {demo}: {'the same, bit for bit' if same else 'DIFFERS'}", flush=True)
        equal &= same
    return equal


def one_help(python: Path, seeds: int) -> bool:
    """Prints every --help under hash seeds 0, 1 ...; returns whether they give one text without errors."""
    texts = set()
    for seed in range(seeds):
        env = environ(PYTHONHASHSEED=seed, PYTHONPATH=ROOT / "tests", COLUMNS=80)
        texts.add(subprocess.run([python, "-c", HELPS], cwd=ROOT, env=env, check=True, stdout=subprocess.PIPE).stdout)
    good = len(texts) == 1 and b"status 1" not in min(texts)
    print(f"every --help, {seeds} hash seeds: {'one text' if good else f'{len(texts)} TEXTS, OR ERRORS'}", flush=True)
    return good


def main() -> None:
    """Makes the environment and runs all checks; exits with 1 if one fails."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--newest", action="store_true", help="the newest packages instead")
    parser.add_argument("--python", default=sys.executable, metavar="PROGRAM", help="default: the one that runs this")
    parser.add_argument("--extra", action="append", metavar="NAME", help="extras to install; default: test")
    parser.add_argument("--without", action="append", default=[], metavar="NAME", help="leave this package out")
    parser.add_argument("--seeds", type=int, default=5, metavar="N", help="hash seeds for --help; default: 5")
    parser.add_argument("--no-tests", action="store_true", help="run no tests")
    parser.add_argument("tests", nargs="*", help="arguments of pytest")
    given = parser.parse_args()
    place = ROOT / "build" / ("newest" if given.newest else "oldest")
    place.mkdir(parents=True, exist_ok=True)
    cache = place / "cache"
    shutil.rmtree(cache, ignore_errors=True)
    try:
        packages = wanted(project(), given.extra or ["test"], given.without)
        python = made_venv(place, given.python, packages, not given.newest)
        good = same_demos(place, python, cache)
        good &= one_help(python, given.seeds)
        if not given.no_tests:
            own = {"NUMBA_CACHE_DIR": cache, "PYTHONPYCACHEPREFIX": place / "pycache", "MPLBACKEND": "Agg"}
            run(python, "-m", "pytest", *TESTS, *given.tests, **own)
    except subprocess.CalledProcessError as error:
        raise SystemExit(f"{place.name} packages: failed: {' '.join(map(str, error.cmd))[:200]}") from None
    if not good:
        raise SystemExit(f"{place.name} packages: failed, see above")
    print(f"{place.name} packages: all good")


if __name__ == "__main__":
    main()
