"""The cache of compiled kernels: damaged, full, read-only, copied, or where others can write. Small kernels serve."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from support.command import command

import livebass

try:
    import resource
except ImportError:  # no POSIX
    pytest.skip("needs limits of file sizes", allow_module_level=True)

SMALL = """
from livebass.compiling import cached, callback, jit

@jit
def twice(x):
    return 2 * x

@jit
def thrice(x):
    return twice(x) + x

@callback("float64(float64)")
def called(x):
    return twice(x)

if __name__ == "__main__":
    from ctypes import CFUNCTYPE, c_double
    there = cached("small.thrice") and cached("small.called")
    values = thrice(14.0), CFUNCTYPE(c_double, c_double)(called())(21.0)
    print(values, "there" if there else "not there", "loaded" if thrice.stats.cache_hits else "compiled")
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    (tmp_path / "small.py").write_text(SMALL)
    return tmp_path


@pytest.fixture(scope="module")
def compiled_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("warm")
    (folder / "small.py").write_text(SMALL)
    assert run(folder) == ("not there compiled", "")
    assert run(folder) == ("there loaded", "")
    return folder / "cache"


@pytest.fixture
def warm(small: Path, compiled_once: Path) -> Path:
    shutil.copytree(compiled_once, small / "cache")
    return small


def run(folder: Path, *, limit: int | None = None, **environment: object) -> tuple[str, str]:
    """Returns the output of the small kernels and their line on stderr; no file may grow beyond `limit` bytes."""
    places = {"NUMBA_CACHE_DIR": folder / "cache", "TMPDIR": folder, **environment}
    done = subprocess.run(
        [sys.executable, "-B", folder / "small.py"], capture_output=True, text=True, timeout=120,
        env=os.environ | {name: str(value) for name, value in places.items()},
        preexec_fn=(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))) if limit else None,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    values, _, state = done.stdout.strip().partition(") ")
    assert values == "(42.0, 42.0"
    return state, done.stderr


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def garbage(data: bytes) -> bytes:
    return random.Random(7).randbytes(len(data))


def one_bit(data: bytes) -> bytes:
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 16]) + data[middle + 1 :]


@pytest.mark.parametrize("damage", [lambda _: b"", cut, garbage, one_bit], ids=["emptied", "cut", "garbage", "one bit"])
@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_a_damaged_cache_is_compiled_anew(warm: Path, ending: str, damage: Callable[[bytes], bytes]) -> None:
    files = list((warm / "cache").rglob(f"*.{ending}"))
    assert len(files) >= 3
    for file in files:
        file.write_bytes(damage(file.read_bytes()))
    state, err = run(warm)
    assert state == "not there compiled" and err.count("\n") <= 1 and "Traceback" not in err
    assert run(warm) == ("there loaded", "")


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_a_file_that_nobody_asked_about_may_be_damaged(warm: Path, ending: str) -> None:
    """`cached` reads the files of one function; others are found when they are loaded, and one line says so."""
    text = (warm / "small.py").read_text()
    (warm / "small.py").write_text(text.replace('cached("small.thrice") and cached("small.called")', "True"))
    for file in (warm / "cache").rglob(f"*.{ending}"):
        file.write_bytes(cut(file.read_bytes()))
    state, err = run(warm)
    assert state == "there compiled"
    assert err.count("\n") == 1 and "damaged" in err and str(warm / "cache") in err
    assert run(warm) == ("there loaded", "")


@pytest.mark.parametrize("limit", [100, 5000])
def test_a_full_disk_is_done_without(small: Path, limit: int) -> None:
    """The smaller limit stops every file, the greater one lets the indices through."""
    assert run(small, limit=limit) == ("not there compiled", "")
    assert not list((small / "cache").rglob("*.nbc*"))


def test_a_cache_that_cannot_be_written_to_is_in_the_temporary_directory(small: Path) -> None:
    (small / "file").touch()
    for expected in ("not there compiled", "there loaded"):
        assert run(small, NUMBA_CACHE_DIR=small / "file" / "cache") == (expected, "")
    (place,) = small.glob("livebass-*")
    assert place.stat().st_mode & 0o777 == 0o700


def open_to_all(place: Path) -> None:
    place.chmod(0o777)


def elsewhere(place: Path) -> None:
    place.rename(place.with_name("moved"))
    place.symlink_to("moved")


def open_inside(place: Path) -> None:
    (kernels,) = place.iterdir()
    kernels.chmod(0o770)


def of_another(place: Path) -> None:
    if os.getuid():
        pytest.skip("only root can give files away")
    os.chown(place, 65534, -1)


@pytest.mark.parametrize("change", [open_to_all, open_inside, elsewhere, of_another])
def test_nothing_is_loaded_from_a_temporary_directory_of_others(warm: Path, change: Callable[[Path], None]) -> None:
    """The test above loads from the same place, as it is before the change."""
    place = (warm / "cache").rename(warm / f"livebass-{os.getuid()}")
    place.chmod(0o700)
    change(place)
    (warm / "file").touch()
    before = {file: file.stat().st_mtime_ns for file in warm.rglob("*.nb?")}
    assert len(before) >= 6
    assert run(warm, NUMBA_CACHE_DIR=warm / "file") == ("not there compiled", "")
    assert {file: file.stat().st_mtime_ns for file in warm.rglob("*.nb?")} == before


def test_the_cache_goes_by_contents(warm: Path) -> None:
    """A copy elsewhere, or one that was installed again, has the same kernels; a changed one has not."""
    copy = warm / "copy" / "livebass"
    shutil.copytree(Path(livebass.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    for file in copy.rglob("*.py"):
        os.utime(file)
    assert run(warm, PYTHONPATH=copy.parent) == ("there loaded", "")
    with (copy / "kernels" / "voice.py").open("a") as file:
        file.write("# changed\n")
    assert run(warm, PYTHONPATH=copy.parent) == ("not there compiled", "")


@pytest.mark.slow
def test_the_real_kernels_survive_damage(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    note = ("render", "--note", "G2", "--duration", "0.1", "--tail", "0", "-q", "live", "-o")
    lines = {}
    for name in ("cold", "damaged", "warm"):
        done = command(*note, tmp_path / f"{name}.wav", env=environment)
        assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
        lines[name] = done.stderr.splitlines()
        if name == "cold":
            for file in (tmp_path / "cache").rglob("*.nb?"):
                file.write_bytes(cut(file.read_bytes()))
    assert [len(lines[name]) for name in ("cold", "damaged", "warm")] == [2, 2, 1]
    assert lines["damaged"][0].startswith("compiling the kernels")
    sounds = {(tmp_path / f"{name}.wav").read_bytes() for name in lines}
    assert len(sounds) == 1
