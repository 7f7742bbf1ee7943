"""The C of the plugins compiles for every system, without a warning; tools/wheels.py builds the binaries."""

from __future__ import annotations

import importlib.util
import subprocess
from pathlib import Path

import pytest
from support.costs import quick
from support.plugins import MOST_BYTES

from livebass.plugin import build
from livebass.plugin.header import header
from livebass.plugin.systems import SYSTEMS


@pytest.mark.skipif(not importlib.util.find_spec("ziglang"), reason="needs ziglang")
@pytest.mark.real  # a compiler runs 60 times
@pytest.mark.parametrize("name", quick(SYSTEMS, ["windows-x86_64", "macos-arm64"]))
def test_the_c_compiles(name: str, tmp_path: Path) -> None:
    system = SYSTEMS[name]
    (tmp_path / "kernels.h").write_text(header(system.levels))
    warnings = [flag for flag in build.FLAGS if flag.startswith(("-W", "-std"))]
    for source in sorted(build.C.glob("*.c")):
        # zig keeps what it compiled by its words, which name no temporary folder
        command = [*build.zig(system), *warnings, "-O0", "-c", "-I.", source, "-o", "a.o"]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.skipif(not importlib.util.find_spec("ziglang"), reason="needs ziglang")
@pytest.mark.parametrize(
    "name", quick([name for name, system in SYSTEMS.items() if system.ending == "dylib"], ["macos-arm64"])
)
def test_a_binary_does_not_tell_where_it_was_built(name: str, tmp_path: Path) -> None:
    made = []
    for place in ("one", "two"):
        (tmp_path / place).mkdir()
        (tmp_path / place / "a.c").write_text('__attribute__((visibility("default"))) int a(void) { return 1; }\n')
        command = [*build.zig(SYSTEMS[name]), *build.FLAGS, "a.c", *build.LINKING["dylib"]]
        subprocess.run([*command, "-o", tmp_path / place / "a.dylib"], check=True, cwd=tmp_path / place)
        made.append((tmp_path / place / "a.dylib").read_bytes())
    assert made[0] == made[1] and str(tmp_path).encode() not in made[0]


@pytest.mark.skipif(not importlib.util.find_spec("ziglang"), reason="needs ziglang")
@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_the_binary_of_a_release_is_small(name: str, tmp_path: Path) -> None:
    system = SYSTEMS[name]
    build.emit(tmp_path, [system], [build.PLUGIN])
    assert len(build.link(tmp_path, system, build.zig(system))) < MOST_BYTES
