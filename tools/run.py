"""Runs a command of the project in .venv, which it makes: python tools/run.py COMMAND [ARGUMENTS]

demo [PRESET]   installs livebass for playing, renders demo.wav and techniques.wav
test            runs the tests that need no sound card, JACK, display or C compiler; other arguments go to pytest
  --real        ... also browsers, JACK servers, plugin hosts, windows and wheels, if installed
  --all         ... also the slow tests, and more random examples
check           runs the linters and type checkers
wheel           builds a wheel per system, and the plugins' zip archives
release         checks, tests and builds all files of a release
available       looks up whether all packages have wheels, for every Python and system
oldest, newest  runs the tests with the oldest or newest packages that pyproject.toml allows
site            builds the site
install EXTRA   installs extras of pyproject.toml

It needs Python 3.11 or later and its standard library. On Linux and macOS tools/demo, tools/test and so on call it.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse
from urllib.request import url2pathname

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
PROGRAMS = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = PROGRAMS / ("python.exe" if os.name == "nt" else "python")
INSTALLED = VENV / "installed.json"  # this folder, the digest of pyproject.toml, the extras and what is missing
LOG = VENV / "install.log"
OLDEST = (3, 11)
SIZE = "about 300 MB, of which numba's compiler (LLVM) takes 170 MB; 80 MB to download"
LIVE = {  # what a package of the extra `live` is for
    "sounddevice": "no sound through PortAudio",
    "jack-client": "no JACK",
}
USABLE = "import sys, pip; sys.exit(sys.version_info < (3, 11))"


class Failed(Exception):
    """A command cannot go on; the text says why."""


def say(*lines: str) -> None:
    print(*lines, sep="\n", file=sys.stderr, flush=True)


def succeeds(*command: object) -> bool:
    """Returns whether a command can be run and ends with status 0; prints nothing."""
    try:
        return subprocess.run([str(word) for word in command], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def record() -> dict[str, object]:
    """Returns what was installed into .venv; empty if that is unknown."""
    try:
        found = json.loads(INSTALLED.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def make_venv() -> None:
    """Makes .venv. Replaces one that was moved, is incomplete, or has an older Python, but not another folder's."""
    moved = record().get("folder", str(ROOT)) != str(ROOT)
    if moved and VENV.is_symlink():
        raise Failed(
            f"{VENV} is a link to the environment of {record()['folder']}: remove it, or run its programs there"
        )
    if not moved and succeeds(PYTHON, "-c", USABLE):
        return
    if not succeeds(sys.executable, "-c", "import ensurepip, venv"):
        version = "{}.{}".format(*sys.version_info)
        raise Failed(
            f"{sys.executable} cannot make virtual environments: its venv module is incomplete.\n"
            f"  Debian, Ubuntu:  sudo apt install python3-venv   (or python{version}-venv)"
        )
    say(f"Making .venv with Python {sys.version.split()[0]} ...")
    done = subprocess.run([sys.executable, "-m", "venv", "--clear", VENV], capture_output=True, text=True, check=False)
    if done.returncode:
        raise Failed(f"Making .venv failed: {(done.stderr or done.stdout).strip()}")


def is_editable() -> bool:
    """Returns whether .venv runs livebass from this folder, not from a copy that pip made of it."""
    for file in VENV.glob("**/livebass-*.dist-info/direct_url.json"):
        stated = json.loads(file.read_text(encoding="utf-8"))
        place = Path(url2pathname(unquote(urlparse(stated["url"]).path)))
        return bool(stated.get("dir_info", {}).get("editable")) and place == ROOT
    return False


def project() -> dict[str, Any]:
    """Returns the table `project` of pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def requirements(table: dict[str, Any], extras: Iterable[str]) -> list[str]:
    """Returns the packages of `extras` in `table` (see `project`), with those of the extras that they name, sorted."""
    found: set[str] = set()
    for one in (package for extra in extras for package in table["optional-dependencies"][extra]):
        inner = re.fullmatch(r"livebass\[(.+)\]", one)
        found |= set(requirements(table, inner[1].split(","))) if inner else {one}
    return sorted(found)


def pip(*arguments: str) -> bool:
    """Installs, with pip's words in LOG; returns whether that succeeded."""
    # Python compiles the modules that it imports; pip would compile all of them, which takes space and time
    command = [str(PYTHON), "-m", "pip", "install", "--disable-pip-version-check", "--no-compile", *arguments]
    with LOG.open("a", encoding="utf-8") as log:
        print("$", *command, file=log, flush=True)
        return subprocess.run(command, stdout=log, stderr=subprocess.STDOUT, check=False).returncode == 0


def install(*extras: str) -> list[str]:
    """Installs livebass from this folder with `extras`; returns the packages that cannot be installed.

    If not all can be, it installs them one by one: a missing package takes no other away. Raises Failed without those
    that livebass needs itself.
    """
    digest = hashlib.sha256((ROOT / "pyproject.toml").read_bytes()).hexdigest()
    before = record()
    same = before.get("digest") == digest and is_editable()
    have = set(before["extras"]) if same else set()  # type: ignore[call-overload]
    missing = list(before["missing"]) if same else []  # type: ignore[call-overload]
    new = [extra for extra in extras if extra not in have]
    if not same or new:
        INSTALLED.unlink(missing_ok=True)
        LOG.unlink(missing_ok=True)
        if not pip("--editable", f".[{','.join(new)}]" if new else "."):
            if not pip("--editable", "."):
                errors = re.findall(r"^ERROR: (.+)", LOG.read_text(encoding="utf-8"), re.MULTILINE)
                why = errors[-1] if errors else "pip failed"
                raise Failed(f"Installing failed: {why}\n  It needs the network the first time. Log: {LOG}")
            packages = requirements(project(), new)
            missing = list(dict.fromkeys([*missing, *(package for package in packages if not pip(package))]))
        name_folder_relatively()
        kept = {"folder": str(ROOT), "digest": digest, "extras": sorted(have | set(extras)), "missing": missing}
        INSTALLED.write_text(json.dumps(kept, indent=1), encoding="utf-8")
    return missing


def name_folder_relatively() -> None:
    """Makes .venv find this folder by a relative path.

    Under the POSIX locale, Python before 3.13 cannot start if a .pth file has other letters than those of ASCII.
    """
    for file in VENV.glob("**/site-packages/*livebass*.pth"):
        file.write_text(f"{Path(os.path.relpath(ROOT, file.parent)).as_posix()}\n", encoding="ascii")


def name_of(requirement: str) -> str:
    """Returns the package that a requirement names, in small letters."""
    return re.match(r"[\w.-]+", requirement)[0].lower()  # type: ignore[index]


def run(*command: object, **more: str) -> None:
    """Runs a command; a status other than 0 ends this program with it."""
    done = subprocess.run([str(word) for word in command], env={**os.environ, **more}, check=False)
    if done.returncode:
        sys.exit(done.returncode)


def become(*command: object, **more: str) -> None:
    """Ends this program with a command and its status."""
    words = [str(word) for word in command]
    if os.name == "posix":
        os.execve(words[0], words, {**os.environ, **more})
    run(*words, **more)


def demo(arguments: list[str]) -> None:
    make_venv()
    say(f"Installing livebass and what it needs into .venv: {SIZE} ...")
    missing = install("live")
    preset = arguments[0] if arguments else "slap"
    livebass = PROGRAMS / "livebass"
    say(f"Rendering the demo phrase with the preset {preset} ...")
    run(livebass, "render", "--demo", "--preset", preset, "-o", "demo.wav")
    say("Rendering a phrase for each technique ...")
    run(livebass, "render", "--demo", "techniques", "-o", "techniques.wav")
    run(PYTHON, "tools/examples.py")
    shown = livebass.relative_to(ROOT)
    print(
        f"""
  sound     {ROOT / "demo.wav"}
  hands     {ROOT / "techniques.wav"}: livebass help playing says how to play each

Next:
  {shown} play --demo                 the phrase through your loudspeakers, then play: Ctrl-C ends
  {shown} page                        the page, in a browser: play it and see what the strings do
  {shown} presets list                the basses
  {shown} render song.mid -o song.wav the bass part of a MIDI file; song.mid is a short one
  tools/demo precision-finger                    the other phrase; any preset will do""",
        flush=True,
    )
    lacks = [LIVE.get(name_of(package), "no MIDI ports") for package in missing]
    if lacks:
        names = ", ".join(map(name_of, missing))
        say("", f"play: {', '.join(lacks)}, as pip cannot install {names} here (log: {LOG}).")
    elif not succeeds(PYTHON, "-c", "import sounddevice"):
        say("", "play needs PortAudio. Debian, Ubuntu: sudo apt install libportaudio2")


def test(arguments: list[str]) -> None:
    extras, which, workers = ["test"], ["-m", "not slow and not real and not hosted"], 3
    if arguments[:1] == ["--real"]:
        extras, which, workers = ["test", "real"], ["-m", "not slow"], 4
    elif arguments[:1] == ["--all"]:
        extras, which, workers = ["test", "real"], ["--hypothesis-profile=all"], 4
    rest = arguments[len(extras) - 1 :]
    if any(word == "-k" or word.startswith("tests/") for word in rest):
        workers = 0  # a few tests are found soonest, and debugged best, by one process
    make_venv()
    say("Installing what the tests need into .venv, unless it is there ...")
    for package in install(*extras):
        say(f"pip cannot install {package} here: tests that need it are skipped (log: {LOG})")
    run(PYTHON, "tests/support/needs.py")
    # Two workers compute and one waits for processes that tests start; real tests have two of their own
    command = [PYTHON, "-m", "pytest", "-n", workers, *which, *rest]
    say("== pytest " + " ".join(map(str, command[3:])))
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each process that a test starts would compile the package
    become(*command, MPLBACKEND="Agg")


def program(name: str, *extras: str, first: Sequence[str] = ()) -> None:
    """Runs a program of tools in .venv with `extras`, all of which it needs."""
    make_venv()
    say(f"Installing what tools/{name} needs into .venv, unless it is there ...")
    if missing := install(*extras):
        raise Failed(f"tools/{name} needs {', '.join(missing)}, which pip cannot install here. Log: {LOG}")
    become(PYTHON, f"tools/{name}.py", *first, *sys.argv[2:])


def install_extras(extras: list[str]) -> None:
    make_venv()
    if missing := install(*extras):
        raise Failed(f"pip cannot install {', '.join(missing)} here. Log: {LOG}")


COMMANDS = {
    "demo": demo,
    "test": test,
    "check": lambda _: program("check", "test", "check"),
    "wheel": lambda _: program("wheels", "wheel"),
    "release": lambda _: program("release", "wheel"),
    "available": lambda _: program("available"),
    "oldest": lambda _: program("oldest", "test"),
    "newest": lambda _: program("oldest", "test", first=["--newest"]),
    "site": lambda _: program("site", "site"),
    "install": install_extras,
}


def main() -> None:
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(f"tools/run.py: COMMAND must be {', '.join(COMMANDS)}; python tools/run.py COMMAND [ARGUMENTS]")
    if sys.version_info < OLDEST:
        sys.exit("livebass needs Python 3.11 or later, this is " + sys.version.split()[0])
    os.chdir(ROOT)
    try:
        COMMANDS[sys.argv[1]](sys.argv[2:])
    except Failed as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
