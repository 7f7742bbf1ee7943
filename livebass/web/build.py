"""The kernels as a WebAssembly module: from the wheel, from the user's directory, or compiled once with ziglang.

The module imports nothing. It exports its memory, the table of functions, and the entries that a page calls or whose
addresses kernels take.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

from livebass.compiling import store
from livebass.compiling.library import compiled_for
from livebass.extras import install
from livebass.plugin.build import BuildError
from livebass.web.layout import ENTRIES

LEVEL = "wasm32"
BUILD_TIME = 30  # s, about
STACK = 1 << 20  # bytes
BUILT = store.BUILT / f"kernels-{store.digest()}-{LEVEL}.wasm"


def kept() -> Path | None:
    """The module that may be in the user's directory; None if there can be none."""
    place = store.directory(f"kernels-{store.digest()}")
    return place / f"{LEVEL}.wasm" if place else None


def cached() -> bool:
    """True if the module need not be compiled first."""
    there = kept()
    return store.whole(BUILT) is not None or (there is not None and store.whole(there) is not None)


def module() -> bytes:
    """Returns the module; compiles it first if need be. Raises BuildError without a linker, OSError."""

    def made() -> bytes:
        if not importlib.util.find_spec("ziglang"):
            raise BuildError(f"building the page needs ziglang: {install('export')}")
        return linked(compiled_for(LEVEL))

    built = store.whole(BUILT)
    return store.kept_or_made(kept(), made) if built is None else built


def linked(kernels: bytes) -> bytes:
    """Returns the module of an object file of kernels. Raises BuildError, with what the linker said last."""
    with tempfile.TemporaryDirectory() as folder:
        source, made = Path(folder, "kernels.o"), Path(folder, "kernels.wasm")
        source.write_bytes(kernels)
        command = [
            sys.executable, "-m", "ziglang", "wasm-ld", "--no-entry", "--strip-all", "-O2", f"-zstack-size={STACK}",
            "--export-memory", "--export-table", "--growable-table", "--export=__heap_base",
            *(f"--export=lb_{entry.name}" for entry in ENTRIES), str(source), "-o", str(made),
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            said = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
            raise BuildError(f"the kernels cannot be linked: {said[-1]}")
        return made.read_bytes()
