"""This system's release wheel: its library of kernels, and livebass installed from it."""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from support.places import ROOT
from support.plugins import MAX_BYTES

from livebass.compiling import ENTRIES, emitter, store
from livebass.plugin.build import LIBRARY, name_of, object_name
from livebass.plugin.systems import SYSTEMS

SYSTEM = f"linux-{platform.machine()}"
KERNEL = "define i64 @lb_read_word(ptr %at) {\n  %x = load i64, ptr %at\n  ret i64 %x\n}\n"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="this system's wheel is built on Linux"),
]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, unpacked."""
    folder = tmp_path_factory.mktemp("wheel")
    built = subprocess.run(
        [sys.executable, ROOT / "tools" / "wheels.py", SYSTEM, "-o", folder], capture_output=True, text=True
    )
    assert built.returncode == 0, built.stderr
    (wheel,) = folder.glob("*.whl")
    assert "manylinux" in wheel.name and "-any" not in wheel.name
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(folder / "installed")
    return folder / "installed"


def build(installed: Path, kind: str) -> list[Path]:
    return sorted((installed / "livebass" / "built").glob(f"{kind}*"))


def test_what_it_needs_has_no_compiler(installed: Path) -> None:
    (metadata,) = installed.glob("*.dist-info/METADATA")
    needs = re.findall(r"^Requires-Dist: (numba.*|llvmlite.*)$", metadata.read_text("utf-8"), re.MULTILINE)
    assert len(needs) == 1 and "extra == 'reference'" in needs[0].replace('"', "'")


def test_a_library_for_each_level_and_the_plugins(installed: Path) -> None:
    levels = [level for level, kind in emitter.LEVELS.items() if kind.machine == platform.machine()]
    names = [path.name for path in build(installed, "kernels-")]
    libraries = [f"kernels-{store.digest()}-{level}.so" for level in levels]
    assert names == sorted([*libraries, f"kernels-{store.digest()}-wasm32.wasm"])
    assert [path.name for path in build(installed, "plugin-")] == [name_of(SYSTEMS[SYSTEM])]


def test_libraries_are_small_and_know_nothing_of_python(installed: Path) -> None:
    for path in build(installed, ""):
        code = store.whole(path)
        assert code is not None and len(code) < MAX_BYTES, path
        for word in (b"Py_", b"PyErr", b"NRT_", b"numba", b"libpython"):
            assert word not in code, word
        if path.name.startswith("kernels-") and path.suffix == ".so":
            exported = set(re.findall(rb"\blb_[a-z_0-9]+", code))
            assert {name.decode().removeprefix("lb_") for name in exported} >= set(ENTRIES)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_library_is_the_same_in_any_folder_and_names_none(name: str, tmp_path: Path) -> None:
    system = SYSTEMS[name]
    code = emitter.assemble(emitter.optimise(KERNEL, system.levels[0])[0], system.levels[0], system.triple)
    made = []
    for place in ("here", "other place"):
        folder = tmp_path / place
        folder.mkdir()
        (folder / object_name(LIBRARY, system.levels[0], system)).write_bytes(code)
        command = f"import wheels; from pathlib import Path; place = Path({str(folder)!r})\n"
        command += f"wheels.library(place, wheels.SYSTEMS[{name!r}], {system.levels[0]!r}, place)"
        subprocess.run([sys.executable, "-c", command], cwd=ROOT / "tools", check=True)
        (library,) = folder.glob(f"kernels-*.{system.ending}")
        made.append(library.read_bytes())
        assert not re.search(rb"here|other place|" + re.escape(tmp_path.name.encode()), made[-1])
    assert made[0] == made[1] and b"lb_read_word" in made[0]


PLAY = """
import sys, hashlib
import livebass
from livebass.live.synth import LiveBass, Synth
bass, live = livebass.load_preset("slap"), livebass.QUALITIES["live"]
score = livebass.single_note(28, 127, 0.3, 48000)
sound = livebass.render_to_array(bass, score, live, tail=0.0)
Synth(48000).switch_to(LiveBass(bass, live, 48000))
print(hashlib.sha256(sound.tobytes()).hexdigest())
print(sorted({"numba", "llvmlite"} & set(sys.modules)), livebass.__file__)
"""


def test_it_plays_without_compiling_and_sounds_the_same(installed: Path, tmp_path: Path) -> None:
    """Compared with a checkout's compiled object file: the same machine code, linked by another linker."""
    found = {}
    for name, place in (("wheel", installed), ("checkout", ROOT)):
        env = os.environ | {"PYTHONPATH": str(place)}
        if name == "wheel":
            env["NUMBA_CACHE_DIR"] = str(tmp_path)
        done = subprocess.run([sys.executable, "-P", "-c", PLAY], capture_output=True, text=True, env=env, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        found[name], loaded = done.stdout.splitlines()
        if name == "wheel":
            assert loaded.startswith("[] ") and str(installed) in loaded
    assert found["wheel"] == found["checkout"]
    assert not list(tmp_path.iterdir())


EXPORT = """
import sys
from livebass.cli.main import run
status = run(sys.argv[1:])
print(sorted({"numba", "llvmlite", "ziglang"} & set(sys.modules)))
sys.exit(status)
"""


@pytest.mark.parametrize("kind", ["lv2", "clap", "vst3", "instrument"])
def test_it_exports_without_a_compiler(installed: Path, tmp_path: Path, kind: str) -> None:
    """It also writes nothing but the plugin: no program is on the PATH, and the user's directory is empty."""
    (tmp_path / "home").mkdir()
    chosen = ["slap", "-o", "mine.lbass"] if kind == "instrument" else ["-p", "slap", "-p", "fretless"]
    done = subprocess.run(
        [sys.executable, "-P", "-c", EXPORT, "export", kind, *chosen], capture_output=True, text=True, cwd=tmp_path,
        env={"PYTHONPATH": str(installed), "HOME": str(tmp_path / "home"), "PATH": ""},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout == "[]\n" and "building" not in done.stderr
    assert not list((tmp_path / "home").iterdir())
    written = [entry for entry in tmp_path.iterdir() if entry.name != "home"]
    (made,) = written
    if made.is_dir():
        binary = store.whole(build(installed, "plugin-")[0])
        assert binary in [file.read_bytes() for file in made.rglob("livebass.*") if file.is_file()]
