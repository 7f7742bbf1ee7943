"""Builds every system's wheel and zip archive, with their compiled code, on one machine; for `tools/wheel`.

The kernels become raw IR once, optimised IR once per processor level and use, and machine code once per system
(emitter.py). ziglang links for Linux, macOS and Windows: a shared library of kernels for each level, and the plugins'
binary with all levels (plugin/build.py). All systems share the page's module (web/build.py). Archives, for users
without Python, hold the same plugins and page (zips.py); the page is also a file of its own.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import zips

from livebass import __version__
from livebass.cli.shelf import names_of
from livebass.compiling import store
from livebass.plugin import build as plugins
from livebass.plugin.bundle import instrument_files
from livebass.plugin.systems import SYSTEMS, System
from livebass.preset.load import load_preset
from livebass.rows.bounds import either
from livebass.system.cores import core_count
from livebass.system.extras import REFERENCE
from livebass.web import build as pages
from livebass.web.export import page_files, single_page

ROOT = Path(__file__).parents[1]
NUMBA = re.compile(r'^ +("numba[^"]*"),.*\n', re.MULTILINE)  # the line of pyproject.toml


def library(objects: Path, system: System, level: str, out: Path) -> None:
    """Links a shared library that exports only the entries and ends with its checksum."""
    made = out / f"kernels-{store.digest()}-{level}.{system.ending}"
    source = objects / plugins.object_name(plugins.LIBRARY, level, system)
    command = [*plugins.zig(system), "-shared", "-s", "-O2", str(source), "-o", str(made)]
    if system.ending == "so":
        command += ["-lm", "-Wl,-z,defs", "-Wl,-z,now"]
    elif system.ending == "dylib":
        command += plugins.NAMED  # else it names the folder in which it was built
    plugins.run([command], "no library of kernels was built")
    for leftover in out.glob("*.lib"), out.glob("*.pdb"):
        for file in leftover:
            file.unlink()
    made.write_bytes(store.seal(made.read_bytes()))


def wheel(system: System, objects: Path, binary: bytes, page: bytes, out: Path) -> Path:
    """Builds a system's wheel, with the plugins' `binary` and the module `page`; returns its file."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        for name in ("livebass", "presets"):
            shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__", "built"))
        for name in ("pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md"):
            shutil.copy(ROOT / name, tree / name)
        built = tree / "livebass" / store.BUILT.name
        built.mkdir()
        for level in system.levels:
            library(objects, system, level, built)
        (built / plugins.name_of(system)).write_bytes(store.seal(binary))
        (built / pages.BUILT.name).write_bytes(store.seal(page))
        with (tree / "pyproject.toml").open("w") as project:
            project.write(without_compiler((ROOT / "pyproject.toml").read_text()))
            project.write('\n[tool.hatch.build.targets.wheel.hooks.custom]\npath = "tag.py"\n')
        (tree / "tag.py").write_text(
            "from hatchling.builders.hooks.plugin.interface import BuildHookInterface\n"
            "class Tag(BuildHookInterface):\n"
            "    def initialize(self, version, build_data):\n"
            f"        build_data['tag'] = 'py3-none-{system.wheel}'\n"
            "        build_data['pure_python'] = False\n"
        )
        made = Path(folder) / "dist"
        command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(made)]
        done = subprocess.run(command, cwd=tree, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"tools/wheel: hatchling: {done.stderr.strip()}")
        (file,) = made.glob("*.whl")
        return Path(shutil.move(file, out / file.name))


def without_compiler(project: str) -> str:
    """The text of pyproject.toml with numba in an extra: kernels in a wheel are compiled.

    Raises ValueError if numba is not in a line of its own.
    """
    lines = NUMBA.findall(project)
    if len(lines) != 1:
        raise ValueError(f"pyproject.toml: numba must be in one line, not in {len(lines)}")
    head = "[project.optional-dependencies]\n"
    return NUMBA.sub("", project).replace(head, f"{head}{REFERENCE} = [{lines[0]}]\n")


def main() -> None:
    """Builds the wheels and archives that the command line asks for."""
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
        parser.error(f"system must be {either(SYSTEMS)}, not {unknown[0]}")
    basses = {name: load_preset(name) for name in names_of((), ())}
    systems = [SYSTEMS[name] for name in given.systems or SYSTEMS]
    given.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(core_count()) as pool:
        module = pool.submit(pages.module)  # compiles in its own process
        plugins.emit(Path(folder), systems, (plugins.LIBRARY, plugins.PLUGIN))

        def built(system: System) -> bytes:
            binary = plugins.link(Path(folder), system, plugins.zig(system))
            say_wheel(wheel(system, Path(folder), binary, module.result(), given.output))
            return binary

        binaries = dict(zip([system.name for system in systems], pool.map(built, systems), strict=True))
        files, html = instrument_files(basses), single_page(page_files(basses, "live"))

        def archived(name: str) -> Path:
            made = given.output / f"{zips.title(name)}.zip"
            made.write_bytes(zips.archive(name, archives[name], basses, files, html))
            return made

        archives = zips.archives(binaries)
        page = given.output / f"livebass-{__version__}.html"
        page.write_bytes(html)
        for made in [*pool.map(archived, archives), page]:
            print(f"{made} ({_size(made.stat().st_size)})")


def say_wheel(file: Path) -> None:
    """Prints a wheel's size, and the sizes of its compiled files."""
    lines = [f"{file} ({_size(file.stat().st_size)})"]
    with zipfile.ZipFile(file) as packed:
        for entry in packed.infolist():
            if entry.filename.startswith("livebass/built/"):
                lines.append(f"    {Path(entry.filename).name} ({_size(entry.file_size)})")
    print("\n".join(lines))


def _size(size: int) -> str:
    return f"{size / 1e3:.0f} kB"


if __name__ == "__main__":
    main()
