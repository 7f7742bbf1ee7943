"""Builds all files of a release into a folder, from the sources that git tracks; for `tools/release`.

The folder gets the wheels and zip archives of all systems, the page in one file (wheels.py), the source distribution,
the sounds of docs/sounds, the changes of this version, BUILD.txt with the tools that built them, and SHA256SUMS.
All is built twice, from two places, with nothing compiled before and under different settings: the files must be the
same, byte for byte. None may name a path, user or host of this machine. The folder appears only if all is well.
"""

from __future__ import annotations

import argparse
import datetime
import hashlib
import importlib.metadata
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from inside import Machine, differences, leaks
from where import PLACEHOLDER, urls

from livebass.plugin.systems import SYSTEMS
from livebass.rows.bounds import either

ROOT = Path(__file__).resolve().parents[1]
SUMS, CHANGES, BUILD = "SHA256SUMS", "CHANGES.md", "BUILD.txt"
SOUNDS = "docs/sounds"
TOOLS = ("numba", "llvmlite", "numpy", "ziglang", "hatchling")  # what decides the bytes, beside Python and zlib
VERSION = re.compile(r'^__version__ = "([^"]+)"$', re.MULTILINE)
HEADING = re.compile(r"^## \[([^\]]+)\] - (.+)$", re.MULTILINE)
CITED = re.compile(r'^(version|date-released): *"?([^"\n]+?)"? *$', re.MULTILINE)
# Settings that no build takes over
OURS = ("LIVEBASS_", "NUMBA_", "ZIG_", "XDG_", "PYTHON", "SOURCE_DATE_EPOCH")
PROGRAM = "100755"  # git's mode of a program
# Of each build: what must make no difference
SETTINGS = (
    {"PYTHONHASHSEED": "1", "TZ": "UTC", "LC_ALL": "C.UTF-8"},
    {"PYTHONHASHSEED": "2", "TZ": "Pacific/Chatham", "LC_ALL": "C"},
)
UMASKS = (0o022, 0o077)
FOLDERS = ("a", "second build's")


class Refused(Exception):
    """The release cannot be made; the text has a line for each reason."""


def main() -> None:
    """Builds the release that the command line asks for."""
    parser = argparse.ArgumentParser(prog="tools/release", description=__doc__.splitlines()[0])
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help="with --trial: only for these; default: all")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="default: dist/VERSION")
    parser.add_argument("--trial", action="store_true", help="allow changes in the tree and an unreleased version")
    parser.add_argument("--tag", metavar="NAME", help="the tag of the release, such as v0.1.0; another one is refused")
    parser.add_argument("--no-tests", action="store_true", help="leave out tools/check and tools/test")
    parser.add_argument("--once", action="store_true", help="build once: half the time, nothing to compare with")
    given = parser.parse_args()
    if given.systems and not given.trial:
        parser.error("SYSTEM needs --trial: a release is for all systems")
    if unknown := [name for name in given.systems if name not in SYSTEMS]:
        parser.error(f"SYSTEM must be {either(SYSTEMS)}, not {unknown[0]}")
    try:
        release(given)
    except Refused as refused:
        sys.exit("\n".join(f"tools/release: {line}" for line in str(refused).splitlines()))
    except KeyboardInterrupt:
        sys.exit(130)


def release(given: argparse.Namespace) -> None:
    """Checks, tests, builds, compares, and puts the files in place. Raises Refused."""
    if wrong := problems(ROOT, given.tag, given.trial):
        raise Refused("\n".join(wrong))
    version = version_of(ROOT)
    output = (given.output or ROOT / "dist" / version).absolute()
    if not replaceable(output):
        raise Refused(f"{output}: holds other files: name another folder or delete it")
    if not given.no_tests:
        for name in ("check", "test"):
            run([sys.executable, "tools/run.py", name], ROOT, f"tools/{name} failed")
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="livebass-release-") as place:
        sources, builds = tracked(ROOT), []
        for name, settings, umask in list(zip(FOLDERS, SETTINGS, UMASKS, strict=True))[: 1 if given.once else 2]:
            started = time.monotonic()
            builds.append(built(sources, Path(place, name), settings, umask, given.systems))
            say(f"Built {len(list(builds[-1].iterdir()))} files in {(time.monotonic() - started) / 60:.1f} minutes")
        if wrong := [line for second in builds[1:] for line in differences(builds[0], second)]:
            raise Refused("\n".join(wrong))
        made = builds[0]
        (made / CHANGES).write_text(changes(ROOT, version), encoding="utf-8", newline="\n")
        (made / BUILD).write_text(tools(), encoding="utf-8", newline="\n")
        machine = Machine.this(place, str(ROOT))
        if wrong := leaks(made, machine, [data for data, _ in sources.values()]):
            raise Refused("\n".join(wrong))
        (made / SUMS).write_text(sums(made), encoding="utf-8", newline="\n")
        put(made, output)
    for file in sorted(output.iterdir()):
        print(f"{file} ({file.stat().st_size / 1e3:.0f} kB)")


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def run(command: Sequence[str], place: Path, failed: str, env: Mapping[str, str] | None = None) -> None:
    """Runs a command in the folder `place`, with its output on stderr. Raises Refused."""
    done = subprocess.run(command, cwd=place, env=env, stdout=2, check=False)
    if done.returncode:
        raise Refused(failed)


# What must be true before


def problems(root: Path, tag: str | None = None, trial: bool = False) -> list[str]:
    """Returns a line for each reason not to release the tree `root`."""
    found = []
    changed = git(root, "status", "--porcelain", "--untracked-files=all").splitlines()
    if changed and not trial:
        more = f" and {len(changed) - 1} more" if changed[1:] else ""
        found.append(f"the tree has changes that are not committed: {changed[0].strip()}{more}")
    version = version_of(root)
    number, when = first_heading(root)
    if number != version:
        found.append(f"CHANGELOG.md begins with {number}, but livebass/__init__.py has {version}")
    date = is_date(when)
    if not date and not (trial and when == "unreleased"):
        found.append(f"CHANGELOG.md: the date of {number} must be like 2026-11-28, not {when}")
    cited = root / "CITATION.cff"
    if cited.exists():
        stated = dict(CITED.findall(cited.read_text("utf-8")))
        if stated.get("version") != version:
            found.append(f"CITATION.cff has version {stated.get('version')}, but livebass/__init__.py has {version}")
        if date and stated.get("date-released") != when:
            found.append(f"CITATION.cff must have date-released: {when}, as CHANGELOG.md")
    if not trial and any(PLACEHOLDER.match(address) for address in urls(root).values()):
        found.append("pyproject.toml: [project.urls] has placeholders; write Source, then run tools/where.py")
    if tag is not None and tag != f"v{version}":
        found.append(f"the tag must be v{version}, not {tag}")
    return found


def version_of(root: Path) -> str:
    """Returns the version in livebass/__init__.py. Raises Refused."""
    found = VERSION.search((root / "livebass" / "__init__.py").read_text("utf-8"))
    if not found:
        raise Refused("livebass/__init__.py has no __version__")
    return found[1]


def first_heading(root: Path) -> tuple[str, str]:
    """Returns version and date of the changelog's first version. Raises Refused."""
    found = HEADING.search((root / "CHANGELOG.md").read_text("utf-8"))
    if not found:
        raise Refused("CHANGELOG.md has no heading like ## [0.1.0] - 2026-11-28")
    return found[1], found[2].strip()


def is_date(text: str) -> bool:
    try:
        return datetime.date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False


def changes(root: Path, version: str) -> str:
    """Returns the changelog's section of `version`, without its heading."""
    sections = HEADING.split((root / "CHANGELOG.md").read_text("utf-8"))[1:]
    return dict(zip(sections[::3], sections[2::3], strict=True))[version].strip() + "\n"


def git(root: Path, *arguments: str) -> str:
    """Returns what git prints about the tree `root`. Raises Refused."""
    try:
        done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True, encoding="utf-8")
    except OSError:
        raise Refused("needs git") from None
    if done.returncode:
        raise Refused(f"git {arguments[0]}: {done.stderr.strip()}")
    return done.stdout


def replaceable(folder: Path) -> bool:
    """Returns whether `folder` is missing, empty, or holds a release and nothing else."""
    if not folder.exists():
        return True
    if not folder.is_dir():
        return False
    entries = {entry.name for entry in folder.iterdir()}
    if SUMS not in entries:
        return not entries
    listed = re.findall(r"^[0-9a-f]{64}  (.+)$", (folder / SUMS).read_text("utf-8"), re.MULTILINE)
    return entries == {*listed, SUMS}


# Building


def tracked(root: Path) -> dict[str, tuple[bytes, bool]]:
    """Returns the files that git tracks in the tree `root`: what each holds, and whether it is a program, by path."""
    entries = git(root, "ls-files", "--stage", "-z").split("\0")[:-1]
    modes = {name: facts.split()[0] for facts, name in (entry.split("\t", 1) for entry in entries)}
    return {
        name: ((root / name).read_bytes(), mode == PROGRAM) for name, mode in modes.items() if (root / name).is_file()
    }


def write(sources: Mapping[str, tuple[bytes, bool]], tree: Path) -> None:
    """Writes the files of `tracked` into the new folder `tree`."""
    for name, (data, program) in sources.items():
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        (tree / name).write_bytes(data)
        if program:
            (tree / name).chmod(0o700)


def built(
    sources: Mapping[str, tuple[bytes, bool]],
    place: Path,
    settings: Mapping[str, str],
    umask: int,
    systems: Sequence[str],
) -> Path:
    """Builds `sources` in the new folder `place`, with nothing compiled before; returns the files' folder.

    Raises Refused.
    """
    before = os.umask(umask)
    try:
        for name in ("home", "temporary", "files"):
            (place / name).mkdir(parents=True)
        tree, files = place / "livebass", place / "files"
        write(sources, tree)
        env = {name: value for name, value in os.environ.items() if not name.startswith(OURS)}
        env.update(settings)
        env |= {name: str(place / "temporary") for name in ("TMPDIR", "TEMP", "TMP")}
        env |= {"HOME": str(place / "home"), "PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": str(place / "compiled")}
        env |= {"ZIG_GLOBAL_CACHE_DIR": str(place / "zig"), "ZIG_LOCAL_CACHE_DIR": str(place / "zig")}
        output = ["-o", str(files)]
        run([sys.executable, "tools/wheels.py", *systems, *output], tree, "the wheels cannot be built", env)
        hatch = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(files)]
        run(hatch, tree, "the source distribution cannot be built", env)
        for sound in sorted((tree / SOUNDS).glob("*.ogg")):
            shutil.copyfile(sound, files / sound.name)
    finally:
        os.umask(before)
    return files


def tools() -> str:
    """Returns what the bytes depend on: the commit, and the versions of the tools."""
    commit = git(ROOT, "rev-parse", "HEAD").strip()
    commit += " with changes" if git(ROOT, "status", "--porcelain") else ""
    versions = [f"{name} {importlib.metadata.version(name)}" for name in TOOLS]
    python = f"Python {platform.python_version()} with zlib {zlib.ZLIB_RUNTIME_VERSION}"
    return "\n".join([f"livebass at commit {commit}", "built with", f"  {python}", *(f"  {v}" for v in versions), ""])


def sums(folder: Path) -> str:
    """Returns the checksums of a folder's files, as sha256sum writes them."""
    files = sorted(file for file in folder.iterdir() if file.name != SUMS)
    return "".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files)


def put(made: Path, output: Path) -> None:
    """Moves the folder `made` to `output`, in place of an older release."""
    with tempfile.TemporaryDirectory(prefix=".release-", dir=output.parent) as beside:
        new, old = Path(beside, "new"), Path(beside, "old")
        shutil.copytree(made, new, copy_function=shutil.copyfile)
        with suppress(FileNotFoundError):
            output.rename(old)
        new.rename(output)


if __name__ == "__main__":
    main()
