"""Builds wheels that hold the compiled kernels of a system, for all systems on one machine; `tools/wheel` runs it.

The kernels become raw IR once for each kind of processor, machine code once for each level of it (emitter.py), and a
shared library once for each level and system: ziglang links for Linux, macOS and Windows alike.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from livebass.compiling import emitter, store

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class System:
    """A system that a wheel is for."""

    triple: str  # LLVM's name
    zig: str  # ziglang's
    wheel: str  # platform tag of the wheel
    machine: str  # platform.machine()
    levels: tuple[str, ...]
    ending: str


X86_LEVELS = ("x86-64-v2", "x86-64-v3")
SYSTEMS = {
    "linux-x86_64": System(
        "x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", "manylinux_2_17_x86_64", "x86_64", X86_LEVELS, "so"
    ),
    "linux-aarch64": System(
        "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", "manylinux_2_17_aarch64", "aarch64", ("arm64",), "so"
    ),
    "macos-x86_64": System(
        "x86_64-apple-macosx11.0.0", "x86_64-macos.11.0", "macosx_11_0_x86_64", "x86_64", X86_LEVELS, "dylib"
    ),
    "macos-arm64": System(
        "arm64-apple-macosx11.0.0", "aarch64-macos.11.0", "macosx_11_0_arm64", "aarch64", ("arm64",), "dylib"
    ),
    "windows-x86_64": System("x86_64-w64-windows-gnu", "x86_64-windows-gnu", "win_amd64", "x86_64", X86_LEVELS, "dll"),
}
EMIT = """
import sys
from pathlib import Path
from livebass.compiling import emitter
emitter.prepare_numba()
text = emitter.program()
for asked in sys.argv[2:]:
    level, triple = asked.split(",")
    Path(sys.argv[1], f"{level}-{triple}.o").write_bytes(emitter.emit(text, level, triple)[0])
"""


def emit(folder: Path, systems: list[System]) -> None:
    """Writes the object files `LEVEL-TRIPLE.o` of `systems` into `folder`."""
    for machine in sorted({system.machine for system in systems}):
        asked = [
            f"{level},{system.triple}" for system in systems if system.machine == machine for level in system.levels
        ]
        environment = os.environ | emitter.SETTINGS | {"LIVEBASS_MACHINE": machine}
        subprocess.run([sys.executable, "-c", EMIT, str(folder), *asked], env=environment, check=True)


def link(objects: Path, system: System, level: str, out: Path) -> None:
    """Links a shared library that exports the entries alone, with its checksum at the end."""
    library = out / f"kernels-{store.digest()}-{level}.{system.ending}"
    command = [
        sys.executable, "-m", "ziglang", "cc", "-target", system.zig, "-shared", "-s", "-O2",
        str(objects / f"{level}-{system.triple}.o"), "-o", str(library),
    ]  # fmt: skip
    if system.ending == "so":
        command += ["-lm", "-Wl,-z,defs", "-Wl,-z,now"]
    subprocess.run(command, check=True)
    for leftover in out.glob("*.lib"), out.glob("*.pdb"):
        for file in leftover:
            file.unlink()
    library.write_bytes(store.sealed(library.read_bytes()))


def build(system: System, objects: Path, out: Path) -> Path:
    """Builds the wheel of a system from a copy of the sources; returns its file."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        for name in ("livebass", "presets"):
            shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__", "built"))
        for name in ("pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md"):
            shutil.copy(ROOT / name, tree / name)
        built = tree / "livebass" / store.BUILT.name
        built.mkdir()
        for level in system.levels:
            link(objects, system, level, built)
        with (tree / "pyproject.toml").open("a") as project:
            project.write('\n[tool.hatch.build.targets.wheel.hooks.custom]\npath = "tag.py"\n')
        (tree / "tag.py").write_text(
            "from hatchling.builders.hooks.plugin.interface import BuildHookInterface\n"
            "class Tag(BuildHookInterface):\n"
            "    def initialize(self, version, build_data):\n"
            f"        build_data['tag'] = 'py3-none-{system.wheel}'\n"
            "        build_data['pure_python'] = False\n"
        )
        made = Path(folder) / "dist"
        subprocess.run(
            [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(made)], cwd=tree, check=True,
            stdout=subprocess.DEVNULL,
        )  # fmt: skip
        (wheel,) = made.glob("*.whl")
        out.mkdir(parents=True, exist_ok=True)
        return Path(shutil.move(wheel, out / wheel.name))


def main() -> None:
    """Builds the wheels that the command line asks for."""
    parser = argparse.ArgumentParser(description="Builds wheels with compiled kernels into a directory.")
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help="as --list names them; default: all")
    parser.add_argument("--list", action="store_true", help="names the systems and ends")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "dist", metavar="DIR", help="default: dist")
    given = parser.parse_args()
    if given.list:
        print("\n".join(SYSTEMS))
        return
    unknown = [name for name in given.systems if name not in SYSTEMS]
    if unknown:
        parser.error(f"system {unknown[0]}: allowed are {', '.join(SYSTEMS)}")
    systems = [SYSTEMS[name] for name in given.systems or SYSTEMS]
    with tempfile.TemporaryDirectory() as folder:
        emit(Path(folder), systems)
        for system in systems:
            wheel = build(system, Path(folder), given.output)
            print(f"{wheel} ({wheel.stat().st_size / 1e6:.2f} MB)")


if __name__ == "__main__":
    main()
