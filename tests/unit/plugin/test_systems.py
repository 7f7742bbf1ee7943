"""The C of the plugins compiles for every system, without a warning; tools/wheels.py builds the binaries."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from support.costs import quick
from support.plugins import MAX_BYTES

from livebass.plugin import build
from livebass.plugin.systems import SYSTEMS


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


def test_commands_of_a_build_run_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of two waits for the other's file."""
    monkeypatch.setattr(build, "core_count", lambda: 2)
    code = (
        "import sys, time; from pathlib import Path; own, other = map(Path, sys.argv[1:]); own.touch()\n"
        "end = time.monotonic() + 60\n"
        "while not other.exists(): time.sleep(0.01); time.monotonic() < end or sys.exit('nothing comes')"
    )
    a, b = str(tmp_path / "a"), str(tmp_path / "b")
    build.run([[sys.executable, "-c", code, *places] for places in ((a, b), (b, a))], "no")


def test_a_command_that_fails_ends_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "core_count", lambda: 2)
    started = tmp_path / "started"
    head = f"import os, sys, time; from pathlib import Path; place = Path({str(started)!r})\n"
    failing = f"{head}while not place.exists(): time.sleep(0.01)\nsys.exit('error: x')"
    lasting = f"{head}Path('new').write_text(str(os.getpid())); Path('new').rename(place); time.sleep(600)"
    monkeypatch.chdir(tmp_path)
    with pytest.raises(build.BuildError, match=r"^made badly: error: x$"):
        build.run([[sys.executable, "-c", code] for code in (failing, lasting)], "made badly")
    assert not psutil.pid_exists(int(started.read_text()))


@pytest.mark.skipif(not importlib.util.find_spec("ziglang"), reason="needs ziglang")
@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_the_binary_of_a_release_is_small(name: str, tmp_path: Path) -> None:
    system = SYSTEMS[name]
    build.emit(tmp_path, [system], [build.PLUGIN])
    assert len(build.link(tmp_path, system, build.zig(system))) < MAX_BYTES
