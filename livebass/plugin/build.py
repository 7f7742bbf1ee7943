"""Builds the plugins' binary: one shared library for all formats, with kernels for each processor level and the C code.

It depends on no preset. Each release wheel brings the binary of its system (tools/wheels.py). Otherwise numba and a C
compiler, the system's or ziglang's, build it once from the sources. It is kept in the user's directory under a digest
of its sources. Like compiled kernels, it always ends with a checksum.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from livebass.compiling import emitter, store
from livebass.plugin.header import entries_of, header
from livebass.plugin.systems import System, this_system
from livebass.system.cores import core_count
from livebass.system.extras import install

BUILD_TIME = 45  # s, about
MAX_PROCESSES = 4  # that compile at once; each takes 0.5 GB
C = Path(__file__).parent / "c"
FLAGS = (
    "-std=gnu11", "-Os", "-shared", "-s", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno",
    "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wformat=2", "-Wvla", "-Wundef", "-Werror",
    "-Wno-unused-parameter",  # hosts' interfaces pass arguments that we may not need
    "-Wno-enum-float-conversion",  # enums are our constants
)  # fmt: skip
NAMED = ("-Wl,-x", "-Wl,-install_name,livebass")  # of a macOS library: no local names; not those of its build folder
LINKING = {
    "so": (
        "-fPIC",
        "-fno-asynchronous-unwind-tables",
        "-fno-unwind-tables",
        "-Wl,-z,now",
        "-Wl,-z,defs",
        "-lm",
        "-lpthread",
    ),
    "dylib": ("-fPIC", *NAMED),
    # The system's library formats numbers, not MinGW's own
    "dll": ("-lgdi32", "-lshell32", "-D__USE_MINGW_ANSI_STDIO=0"),
}
CLOSER = (
    "-Wl,-z,noseparate-code",  # sections share pages, which saves 8 kB; ziglang does so by itself
    "-Wl,-z,pack-relative-relocs",  # saves 12 kB; a release must run on older systems, which do not know it
)
# Taken from Windows instead of the compiler's own library, 47 kB in one piece; library_win32.c replaces the rest
OF_WINDOWS = {
    "api-ms-win-crt-private-l1-1-0": ("memcmp", "memcpy", "memmove"),
    "api-ms-win-crt-string-l1-1-0": ("memset", "strlen", "strncmp"),
    "api-ms-win-crt-math-l1-1-0": ("ceil", "exp", "floor", "floorf", "log10", "log2", "sin"),
}
LIBRARY, PLUGIN = "library", "plugin"  # uses of object files: a library that exports the entries; the plugins
EMIT = """
import re, sys
from pathlib import Path
from livebass.compiling import emitter
from livebass.plugin.header import entries_of, suffix
text = emitter.program()
use, level, *objects = sys.argv[1:]  # of an object: the system, the file
if use == "plugin":  # several levels in one binary, which exports none of them, and has no others than it calls
    called = {entry.name for entry in entries_of(level)}
    text = re.sub(r"@lb_(\\w+)", lambda m: f"@lb_{m[1]}{suffix(level)}" if m[1] in called else f"@{m[1]}", text)
    text = re.sub(r"^define (\\w+ @lb_)", r"define hidden \\1", text, flags=re.MULTILINE)
final, _ = emitter.optimise(text, level)
for triple, place in zip(objects[::2], objects[1::2], strict=True):
    Path(place).write_bytes(emitter.assemble(final, level, triple))
"""


class BuildError(OSError):
    """The plugins' binary for a system is missing; the message is one line."""


@functools.cache
def digest() -> str:
    """Returns a digest of the binaries' present sources."""
    found = hashlib.sha256(store.digest().encode() + header(emitter.LEVELS).encode())
    for source in (Path(__file__), *sorted(C.rglob("*.[ch]"))):
        found.update(source.relative_to(Path(__file__).parent).as_posix().encode() + b"\0" + source.read_bytes())
    return found.hexdigest()[:16]


def name_of(system: System) -> str:
    """Names the file of a system's binary."""
    return f"plugin-{digest()}-{system.name}.{system.ending}"


def is_built(system: System) -> bool:
    """True if a system's binary already exists. Raises BuildError as `binary` does."""
    if _from_package(system) is not None:
        return True
    kept = _kept_file(system)
    return kept is not None and store.whole(kept) is not None


def binary(system: System) -> bytes:
    """Returns the plugins' binary for a system; builds it first if necessary.

    Raises BuildError, with one line, if the packaged binary is damaged or from another version, or the build fails.
    """

    def made() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            return _built_here(system, Path(folder))

    found = _from_package(system)
    if found is not None:
        return found
    kept = _kept_file(system)
    return store.kept_or_made(kept, made, f"{kept}: is damaged: building it again")


def _from_package(system: System) -> bytes | None:
    """Returns the binary that came with the package, or None. Raises BuildError."""
    place = store.BUILT / name_of(system)
    if place.exists():
        found = store.whole(place)
        if found is None:
            raise BuildError(f"{place}: is damaged: install livebass again")
        return found
    other = next(iter(sorted(store.BUILT.glob(f"plugin-*-{system.name}.*"))), None)
    if other is not None:
        raise BuildError(f"{other}: belongs to another version of livebass: install livebass again")
    return None


def _kept_file(system: System) -> Path | None:
    """Names the file that keeps a locally built binary; None: it is not kept."""
    place = store.directory(f"plugin-{digest()}")
    return place / name_of(system) if place else None


def compiler(system: System) -> list[str]:
    """Finds the C compiler for a system. Raises BuildError if there is none."""
    found = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if found and system == this_system():
        return [found, *CLOSER] if system.ending == "so" else [found]
    if importlib.util.find_spec("ziglang"):
        return zig(system)
    needed = "a C compiler, such as cc, or ziglang" if system == this_system() else "ziglang"
    raise BuildError(f"building plugins for {system.name} needs {needed} (410 MB): {install('export')}")


def zig(system: System) -> list[str]:
    """Returns the command of ziglang's C compiler for a system."""
    return [sys.executable, "-m", "ziglang", "cc", "-target", system.zig]


def _built_here(system: System, folder: Path) -> bytes:
    """Builds the binary for a system; intermediate files go into `folder`. Raises BuildError."""
    using = compiler(system)  # fails before the long work
    emit(folder, [system], [PLUGIN])
    return link(folder, system, using)


def object_name(use: str, level: str, system: System) -> str:
    """Names a level's object file, for a library or for the plugins."""
    return f"{use}-{level}-{system.triple}.o"


def emit(folder: Path, systems: Sequence[System], uses: Sequence[str]) -> None:
    """Writes the kernels' object files for `systems` and `uses` into `folder`. Raises BuildError.

    They are kept in the user's directory; rebuilding after a change in C then takes a second. This system's library
    objects are the kernels' own object files and are kept with them.
    """
    from llvmlite import binding

    names = [f"{level} {entry.name}" for level in emitter.LEVELS for entry in entries_of(level)]
    made_of = "\n".join([store.digest(), EMIT, *names])
    place = store.directory(f"objects-{hashlib.sha256(made_of.encode()).hexdigest()[:16]}")
    kernels = store.directory(f"kernels-{store.digest()}")

    def kept(use: str, level: str, system: System) -> Path | None:
        if use == LIBRARY and system.triple == binding.get_process_triple():
            return kernels / f"{level}.o" if kernels else None
        return place / object_name(use, level, system) if place else None

    missing: dict[str, Path | None] = {}
    requested: dict[tuple[str, str], list[str]] = {}  # by use and level: the systems and files of its objects
    for use, system in itertools.product(uses, systems):
        for level in system.levels:
            name, file = object_name(use, level, system), kept(use, level, system)
            if file and (data := store.whole(file)) is not None:
                (folder / name).write_bytes(data)
            else:
                missing[name] = file
                requested.setdefault((use, level), []).extend([system.triple, str(folder / name)])
    emitting = [[sys.executable, "-P", "-c", EMIT, *which, *objects] for which, objects in requested.items()]
    run(emitting, "the kernels do not compile")
    for name, file in missing.items():
        if file:
            with suppress(OSError):
                store.write(file, (folder / name).read_bytes())


def link(folder: Path, system: System, using: list[str], more: Sequence[str] = ()) -> bytes:
    """Links a system's binary from the object files in `folder`, with the compiler `using` and `more` flags.

    Other files go into a folder of that system in it. Raises BuildError.
    """
    within = folder / system.name
    within.mkdir(exist_ok=True)
    (within / "kernels.h").write_text(header(system.levels))
    objects = [str(folder / object_name(PLUGIN, level, system)) for level in system.levels]
    sources = [str(source) for source in sorted(C.rglob("*.c"))]
    made = within / f"plugin.{system.ending}"
    if system.ending == "dll":
        objects += [str(imports(within, library, names)) for library, names in OF_WINDOWS.items()]
    command = [
        *using,
        *FLAGS,
        *more,
        f"-I{within}",
        f"-I{C}",
        *sources,
        *objects,
        *LINKING[system.ending],
        "-o",
        str(made),
    ]
    run([command], "the plugins do not compile")
    return made.read_bytes()


def imports(folder: Path, library: str, names: Sequence[str]) -> Path:
    """Writes an import library for functions of a Windows DLL into `folder`. Raises BuildError."""
    listed, made = folder / f"{library}.def", folder / f"{library}.lib"
    listed.write_text("\n".join([f"LIBRARY {library}.dll", "EXPORTS", *names]) + "\n")
    tool = [sys.executable, "-m", "ziglang", "dlltool", "-m", "i386:x86-64"]
    run([[*tool, "-d", str(listed), "-l", str(made)]], "an import library for Windows cannot be made")
    return made


def run(commands: Sequence[list[str]], failed: str) -> None:
    """Runs commands, several at once. If one fails, raises BuildError with its first error line, or else its last line.

    None runs on after an error or an interrupt.
    """
    paths = [str(store.PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    waiting, running = list(commands), list[subprocess.Popen[str]]()
    try:
        while waiting or running:
            while waiting and len(running) < min(core_count(), MAX_PROCESSES):
                pipe = subprocess.PIPE
                running.append(subprocess.Popen(
                    waiting.pop(0), env=environment, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, text=True
                ))  # fmt: skip
            out, err = running[0].communicate()
            status = running.pop(0).returncode
            if status:
                said = (err or out).strip().splitlines() or [f"exit status {status}"]
                raise BuildError(f"{failed}: {next((line for line in said if 'error:' in line), said[-1])}")
    finally:
        for process in running:
            process.kill()
            process.communicate()
