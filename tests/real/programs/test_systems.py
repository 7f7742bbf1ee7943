"""The C of the plugins compiles for every system, without a warning."""

from __future__ import annotations

import importlib.util
import subprocess
from pathlib import Path

import pytest
from support.costs import quick

from livebass.plugin import build
from livebass.plugin.header import header
from livebass.plugin.systems import SYSTEMS


@pytest.mark.skipif(not importlib.util.find_spec("ziglang"), reason="needs ziglang")
@pytest.mark.parametrize("name", quick(SYSTEMS, ["windows-x86_64", "macos-arm64"]))
def test_the_c_compiles(name: str, tmp_path: Path) -> None:
    system = SYSTEMS[name]
    (tmp_path / "kernels.h").write_text(header(system.levels))
    warnings = [flag for flag in build.FLAGS if flag.startswith(("-W", "-std"))]
    for source in sorted(build.C.rglob("*.c")):
        # zig keeps what it compiled by its words, which name no temporary folder
        command = [*build.zig(system), *warnings, "-O0", "-c", "-I.", f"-I{build.C}", source, "-o", "a.o"]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == 0, done.stderr[:2000]
