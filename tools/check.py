"""Checks the sources without running them; tools/check calls it.

Linter, format, import contracts and types of Python; C by clang-tidy; JavaScript by tsc and eslint if node is there.
All run at the same time. Prints what each one found, names the failed ones, and exits with 1.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "livebass/plugin/c"
CHECKED = ROOT / ".venv/checked-c"  # an empty file for each source that was found good
PAGE = ROOT / "tools/js"
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))


def program(*command: object, cwd: Path = ROOT) -> tuple[bool, str]:
    """Runs a program, of .venv if it is there; returns whether it found nothing, and its words."""
    name, *words = map(str, command)
    found = shutil.which(name, path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}")
    if not found:
        return False, f"{name} is missing\n"
    done = subprocess.run([found, *words], cwd=cwd, capture_output=True, text=True, encoding="utf-8", check=False)
    return done.returncode == 0, done.stdout + done.stderr


def check_c() -> tuple[bool, str]:
    """Checks the plugins' C code. A good source is checked again once it, a header, the checks or clang-tidy change."""
    from livebass.plugin.header import header
    from livebass.plugin.systems import this_system

    kernels = header(this_system().levels)
    shared = [program("clang-tidy", "--version")[1], kernels]
    shared += [file.read_text() for file in [SOURCES / ".clang-tidy", *sorted(SOURCES.rglob("*.h"))]]
    good = {file: CHECKED / digest(*shared, file.name, file.read_text()) for file in sorted(SOURCES.rglob("*.c"))}
    CHECKED.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        Path(folder, "kernels.h").write_text(kernels)

        def check(source: Path) -> tuple[bool, str]:
            found = program("clang-tidy", "--quiet", source, "--", "-std=gnu11", f"-I{folder}", f"-I{SOURCES}")
            if found[0]:
                good[source].touch()
            return found

        results = list(pool.map(check, [source for source, place in good.items() if not place.exists()]))
    return all(fine for fine, _ in results), "".join(words for fine, words in results if not fine)


def digest(*texts: str) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


def check_js() -> tuple[bool, str]:
    """Checks the page's scripts by tsc (types) and eslint."""
    modules = PAGE / "node_modules"
    made = modules / ".package-lock.json"
    if not made.exists() or made.stat().st_mtime < (PAGE / "package-lock.json").stat().st_mtime:
        fine, words = program("npm", "ci", "--prefix", PAGE, "--no-audit", "--no-fund", "--loglevel=error")
        if not fine:
            return fine, words
    kept, tools = modules / ".cache", modules / ".bin"
    types = program(tools / "tsc", "--project", PAGE, "--incremental", "--tsBuildInfoFile", kept / "types")
    rules = program(
        tools / "eslint", "--config", PAGE / "eslint.config.js", "--cache", "--cache-location", kept / "eslint",
        "--max-warnings", 0, "livebass/web/static",
    )  # fmt: skip
    return types[0] and rules[0], types[1] + rules[1]


CHECKS: dict[str, Callable[[], tuple[bool, str]]] = {
    "ruff check": lambda: program("ruff", "check", "."),
    "ruff format": lambda: program("ruff", "format", "--check", "."),
    "import contracts": lambda: program("lint-imports"),
    "mypy": lambda: program("mypy"),
    "actionlint": lambda: program("actionlint", "-shellcheck=", "-pyflakes=", *WORKFLOWS),
    "clang-tidy": check_c,
    "tsc and eslint": check_js,
}


def main() -> None:
    checks = dict(CHECKS)
    if not shutil.which("npm"):
        del checks["tsc and eslint"]
        print("== tsc and eslint: left out, they need node and npm", file=sys.stderr)
    failed = []
    with ThreadPoolExecutor(len(checks)) as pool:
        for name, found in {name: pool.submit(check) for name, check in checks.items()}.items():
            fine, words = found.result()
            print(f"== {name}", words, sep="\n", end="", file=sys.stderr, flush=True)
            failed += [] if fine else [name]
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
