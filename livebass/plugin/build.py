"""Builds the binary of the plugins from a checkout: kernels for each level of processor, and the C that hosts load.

The binary does not depend on presets. It needs a C compiler, `cc` or ziglang's, and numba; it is kept in the user's
directory, by the digest of all its sources.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from livebass.compiling import ARM, emitter, store
from livebass.plugin.header import header

C = Path(__file__).parent / "c"
EXPORTED = {"lv2": "lv2_descriptor"}  # the one symbol of each format's binary
FLAGS = (
    "-std=gnu11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno",
    "-Wall", "-Wextra", "-Werror",
)  # fmt: skip
EMIT = """
import re, sys
from pathlib import Path
from livebass.compiling import emitter
from livebass.plugin.header import suffix
emitter.prepare_numba()
text = emitter.program()
for level in sys.argv[2:]:
    named = re.sub(r"@lb_(\\w+)", rf"@lb_\\1{suffix(level)}", text)
    Path(sys.argv[1], f"{level}.o").write_bytes(emitter.emit(named, level)[0])
"""


def levels() -> list[str]:
    """The levels of this kind of processor, the lowest first."""
    machine = "aarch64" if platform.machine().lower() in ARM else "x86_64"
    return [name for name, level in emitter.LEVELS.items() if level.machine == machine]


@functools.cache
def digest() -> str:
    """A name for the sources of the binaries as they are."""
    found = hashlib.sha256(store.digest().encode() + header(levels()).encode() + " ".join(FLAGS).encode())
    for source in (Path(__file__), *sorted(C.iterdir())):
        found.update(source.name.encode() + b"\0" + source.read_bytes())
    return found.hexdigest()[:16]


def compiler() -> list[str]:
    """The C compiler. Raises RuntimeError if there is none."""
    if found := shutil.which("cc"):
        return [found]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise RuntimeError("there is no C compiler: install one, or ziglang with pip")


def binary(kind: str) -> Path:
    """The binary of the plugin format `kind`; builds it first if need be. Raises RuntimeError, OSError."""
    kept = store.directory(f"plugin-{digest()}")
    place = (kept or Path(tempfile.mkdtemp())) / f"livebass-{kind}.so"
    if not place.exists():
        with tempfile.TemporaryDirectory(dir=place.parent) as folder:
            os.replace(link(kind, Path(folder)), place)
    return place


def link(kind: str, folder: Path) -> Path:
    """Builds the binary of a format with everything in between in `folder`. Raises RuntimeError."""
    run([sys.executable, "-c", EMIT, str(folder), *levels()], "the kernels do not compile", emitter.SETTINGS)
    (folder / "kernels.h").write_text(header(levels()))
    (folder / "exported").write_text(f"{{ global: {EXPORTED[kind]}; local: *; }};\n")
    sources = [str(C / "core.c"), str(C / f"{kind}.c")]
    objects = [str(folder / f"{level}.o") for level in levels()]
    linking = [f"-Wl,--version-script={folder / 'exported'}", "-Wl,-z,now", "-Wl,-z,defs", "-s", "-lm", "-lpthread"]
    made = folder / f"{kind}.so"
    run([*compiler(), *FLAGS, f"-I{folder}", *sources, *objects, *linking, "-o", str(made)], "no plugin was built")
    return made


def run(command: list[str], failed: str, settings: dict[str, str] | None = None) -> None:
    """Runs a command. Raises RuntimeError with the last line it said if it fails."""
    paths = [str(store.PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | (settings or {}) | {"PYTHONPATH": os.pathsep.join(paths)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or [f"exit status {done.returncode}"]
        raise RuntimeError(f"{failed}: {said[-1]}")
