"""The library of kernels: damaged, uncached, out of date; and functions compiled by numba."""

from __future__ import annotations

import ast
import ctypes
import gzip
import itertools
import json
import os
import random
import shutil
import subprocess
import sys
import tarfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numba
import pytest
from support.command import assert_one_clear_line, command, python_output, run_python
from support.costs import slow

import livebass
from livebass.compiling import ENTRIES, Entry, emitter, library, lowering, store
from livebass.live.thread import block, ring  # noqa: F401, have entries

try:
    import resource
except ImportError:  # no POSIX
    pytest.skip("needs limits of file sizes", allow_module_level=True)


@pytest.fixture(scope="module")
def machine_code() -> bytes:
    """The kernels for this processor, in their stored form."""
    library.library()
    kept = store.kept_library()
    data = store.whole(kept) if kept else None
    return data if data is not None else library.compiled_here()


# Programs of kernels in LLVM's form: with one function, and with a call of the system's square root
TOY = "define i64 @lb_read_word(ptr %at) {\n  %x = load i64, ptr %at\n  ret i64 %x\n}\n"
ROOT = b"define i64 @lb_read_word(i64 %x) {\n  %y = call double @sqrt(double 4.0)\n  ret i64 %x\n}\n"
ROOT += b"declare double @sqrt(double)\n"


@pytest.fixture(scope="module")
def toy() -> bytes:
    """A tiny kernel in place of all: it loads a hundred times as fast."""
    return emitter.emit(TOY, store.level())[0]


@pytest.fixture
def compiled(toy: bytes, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[list[str]]:
    """An empty cache in `tmp_path`. Has an item for each compilation of kernels, a toy here."""
    times: list[str] = []

    def at_once(progress: object = None) -> bytes:
        times.append("compiled")
        return toy

    for name in ("NUMBA_CACHE_DIR", "TMPDIR"):
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setattr(library, "compiled_here", at_once)
    monkeypatch.setattr(library, "_loaded", [])
    monkeypatch.setattr("tempfile.tempdir", None)
    store.directory.cache_clear()
    yield times
    store.directory.cache_clear()


def loads() -> None:
    """Loads the library as a new process would, and calls a function of it."""
    library._loaded.clear()
    word = ctypes.c_int64(42)
    entry = ENTRIES["read_word"]
    assert Entry(entry.function, entry.signature)(ctypes.addressof(word)) == 42


def empty(data: bytes) -> bytes:
    return b""


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def garbage(data: bytes) -> bytes:
    return random.Random(7).randbytes(len(data))


def one_bit(data: bytes) -> bytes:
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 16]) + data[middle + 1 :]


def test_kernels_are_compiled_once(compiled: list[str]) -> None:
    assert not library.is_cached()
    for _ in range(2):
        loads()
        assert library.is_cached() and compiled == ["compiled"]


@pytest.mark.parametrize("damage", [empty, cut, garbage, one_bit])
def test_a_damaged_file_is_compiled_again(
    compiled: list[str], damage: Callable[[bytes], bytes], caplog: pytest.LogCaptureFixture
) -> None:
    loads()
    kept = store.kept_library()
    assert kept and not caplog.messages
    kept.write_bytes(damage(kept.read_bytes()))
    library._loaded.clear()
    assert not library.is_cached()
    loads()
    assert compiled == ["compiled"] * 2 and library.is_cached()
    (message,) = caplog.messages
    assert "damaged" in message and str(kept.parent) in message


def test_all_kernels_load_after_damage(
    compiled: list[str], machine_code: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole program once; the other tests of a damaged cache load a toy."""
    monkeypatch.setattr(library, "compiled_here", lambda progress=None: machine_code)
    loads()
    kept = store.kept_library()
    assert kept and store.whole(kept) == machine_code
    kept.write_bytes(cut(kept.read_bytes()))
    loads()
    assert store.whole(kept) == machine_code


def test_what_is_kept_is_made_once_and_again_if_damaged(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    made: list[bytes] = []

    def make() -> bytes:
        made.append(b"%d" % len(made))
        return made[-1]

    kept = tmp_path / "kept"
    assert [store.kept_or_made(kept, make, "damaged") for _ in range(2)] == [b"0", b"0"] and not caplog.messages
    kept.write_bytes(one_bit(kept.read_bytes()))
    assert [store.kept_or_made(kept, make, "100 % damaged") for _ in range(2)] == [b"1", b"1"]
    assert caplog.messages == ["100 % damaged"]
    assert [store.kept_or_made(place, make) for place in (None, tmp_path / "none/kept", None)] == [b"2", b"3", b"4"]


def test_a_full_disk_is_done_without(compiled: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    for times in (1, 2):
        loads()
        assert compiled == ["compiled"] * times
    assert not [file for file in tmp_path.rglob("*") if file.is_file()]


def test_a_cache_that_cannot_be_written_to_is_in_the_temporary_directory(
    compiled: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "cache"))
    for _ in range(2):
        loads()
    assert compiled == ["compiled"]
    (place,) = tmp_path.glob("livebass-*")
    assert place.stat().st_mode & 0o777 == 0o700


def test_what_no_version_has_used_for_months_is_deleted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """At the first use of a new version; recently used files, others' files and link targets stay."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    kinds = ("kernels", "objects", "plugin", "reference")
    old, used, others = ([f"{kind}-{digit * 16}" for kind in kinds] for digit in ("a", "b", "c"))
    linked, foreign = "kernels-" + 16 * "d", ["kernels", "my-kernels-" + 16 * "a"]
    elsewhere = tmp_path / "elsewhere"
    for place in (elsewhere, *(tmp_path / "cache" / name for name in (*old, *used, *foreign))):
        (place / "deeper").mkdir(parents=True)
        (place / "deeper" / "file").touch()
        os.utime(place, (0, time.time() - store.UNUSED - 1000))
    (tmp_path / "cache" / linked).symlink_to(elsewhere)
    os.utime(tmp_path / "cache" / linked, (0, 0), follow_symlinks=False)
    kept = {linked, *foreign, *used}
    store.directory.cache_clear()
    try:
        for name in used:
            assert store.directory(name)
        assert {place.name for place in (tmp_path / "cache").iterdir()} == kept | set(old), "nothing new was used"
        for name in others:
            assert store.directory(name)
    finally:
        store.directory.cache_clear()
    assert {place.name for place in (tmp_path / "cache").iterdir()} == kept | set(others)
    assert (elsewhere / "deeper" / "file").exists()


def open_to_all(place: Path) -> None:
    place.chmod(0o777)


def elsewhere(place: Path) -> None:
    place.rename(place.with_name("moved"))
    place.symlink_to("moved")


def open_inside(place: Path) -> None:
    (kernels,) = place.glob("kernels-*")
    kernels.chmod(0o770)


def of_another(place: Path) -> None:
    if os.getuid():
        pytest.skip("only root can give files away")
    os.chown(place, 65534, -1)


@pytest.mark.parametrize(
    "change, why",
    [
        (open_to_all, "can be written to by others"), (open_inside, "can be written to by others"),
        (elsewhere, "is a link"), (of_another, "belongs to another user"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["named", "default", "temporary"])
def test_nothing_is_loaded_from_a_directory_of_others(
    compiled: list[str],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    tmp_path: Path,
    kind: str,
    change: Callable[[Path], None],
    why: str,
) -> None:
    """Wherever it lies; another one, owned by the user alone, is used instead. A line says so."""
    if kind == "temporary":
        (tmp_path / "file").touch()
        place = tmp_path / f"livebass-{os.getuid()}"
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file"))
    else:
        place = tmp_path / "deep" / "er"
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(place))
        if kind == "default":
            monkeypatch.delenv("NUMBA_CACHE_DIR")
            monkeypatch.setattr(store.platformdirs, "user_cache_path", lambda name, place=place: place)
    for _ in range(2):
        loads()
    assert compiled == ["compiled"] and not caplog.messages and place.stat().st_mode & 0o777 == 0o700
    if change is elsewhere and kind != "temporary":
        place, inside = place / f"kernels-{store.digest()}", place  # a link to the directory itself is the user's own
        why = f"{inside.name}/{place.name}: {why}"
    change(place)
    store.directory.cache_clear()
    before = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*.code")}
    assert len(before) == 1
    loads()
    loads()
    assert compiled == ["compiled"] * (2 if kind != "temporary" else 3)
    assert len(caplog.messages) == 1 and why in caplog.text and str(place) in caplog.text
    assert before.items() <= {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*.code")}.items()


def test_a_cache_may_be_a_link_of_the_user(
    compiled: list[str], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    (tmp_path / "large").mkdir()
    (tmp_path / "link").symlink_to("large")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "link"))
    for _ in range(2):
        loads()
    assert compiled == ["compiled"] and not caplog.messages and len([*(tmp_path / "large").rglob("*.code")]) == 1


MAKING = """
import logging, sys
from pathlib import Path
from livebass.compiling import store

def make():
    print("making", flush=True)
    return sys.stdin.buffer.readline() or sys.exit("nothing came")

logging.basicConfig(format="%(message)s")
print(store.kept_or_made(Path(sys.argv[1]), make).decode())
"""


def making(place: Path) -> subprocess.Popen[str]:
    """A process that needs the product at `place`, and makes it from the line it is given."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([sys.executable, "-c", MAKING, str(place)], text=True, **pipes)  # type: ignore[call-overload, no-any-return]


@pytest.mark.parametrize("killed", [False, True])
def test_of_two_processes_one_waits_for_the_other(tmp_path: Path, killed: bool) -> None:
    """Unless that one is killed: then it makes the file itself."""
    first, second = making(tmp_path / "kept"), None
    try:
        assert first.stdout and first.stdout.readline() == "making\n"
        second = making(tmp_path / "kept")
        assert second.stderr and second.stdin
        second.stdin.write("by the second\n")
        second.stdin.flush()
        assert second.stderr.readline() == f"{store.WAITING}\n"
        if killed:
            first.kill()
            assert second.communicate()[0] == "making\nby the second\n\n"
        else:
            assert first.communicate("by the first\n")[0] == "by the first\n\n"
            assert second.communicate()[0] == "by the first\n\n", "not made again"
        assert os.listdir(tmp_path) == ["kept"]
    finally:
        for process in filter(None, (first, second)):
            process.kill()
            process.wait()


def test_a_compiler_tells_how_far_it_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    program = tmp_path / "python"
    reported: list[float] = []
    for text, data in ((r"0.25\n0.500\n\n\nDA\nTA", b"\nDA\nTA"), (r"\nDATA", b"DATA")):
        program.write_text(f"#!/bin/sh\nprintf '{text}'\n")
        program.chmod(0o700)
        monkeypatch.setattr(sys, "executable", str(program))
        assert library.compiled_for(store.level(), reported.append) == data
    assert reported == [0.25, 0.5]
    program.write_text("#!/bin/sh\nprintf '0.25\\n'; exit 9\n")
    with pytest.raises(OSError, match="exit status 9"):
        library.compiled_for(store.level())


THRICE = """
@{0}
def twice(x):
    return 2 * x

@{0}
def thrice(x):
    return twice(x) + x
"""
PARTS = f"""
from livebass.compiling import Entry, by_numba, jit, lowering
{THRICE.format("jit")}
@jit
def never(x):
    return x

def begin(x):
    return thrice(x)

told, entry = [], Entry(begin, "int64(int64)")
by_numba.tell_progress(told.append, lowering.reachable(begin))
by_numba.kernel()(entry.function)(14)
print([round(part, 3) for part in told])
"""


def test_the_part_that_is_compiled_is_counted_in_functions(tmp_path: Path) -> None:
    """Callees come before callers; an uncalled function is never compiled."""
    (tmp_path / "parts.py").write_text(PARTS)
    assert python_output(tmp_path / "parts.py", env={"LIVEBASS_FROM_SOURCE": "1"}) == "[0.333, 0.667, 1.0]\n"


@pytest.mark.parametrize("terminal", [False, True])
def test_compiling_is_said_shown_and_no_part_of_the_time(
    machine_code: bytes, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, terminal: bool
) -> None:
    """One line; in a terminal also a bar, from the first sign of progress."""
    from click import progressbar

    from livebass.cli import main, render
    from livebass.cli import progress as progress_module
    from livebass.engine import render as rendering

    order: list[object] = []
    load = library.library
    real = rendering.time.perf_counter

    def compiles(progress: Callable[[float], None] | None = None) -> library.Library:
        if progress:
            order.append("waits")
            progress(0.5)
            order.append("compiled")
        return load()

    def bar(*arguments: object, label: str, **more: object) -> object:
        order.append(label)
        return progressbar(*arguments, label=label, **more)  # type: ignore[arg-type]

    def clock() -> float:
        order.append("clock")
        return real()

    monkeypatch.setattr(library, "is_cached", lambda: "compiled" in order)
    monkeypatch.setattr(library, "library", compiles)
    monkeypatch.setattr(rendering.time, "perf_counter", clock)
    monkeypatch.setattr(progress_module, "say", lambda line: order.append(line) if "compiling" in line else None)
    monkeypatch.setattr(render.sys.stderr, "isatty", lambda: terminal, raising=False)
    monkeypatch.setattr(render.click, "progressbar", bar)
    output = tmp_path / "a.wav"
    assert (
        main.run(["render", "--note", "G2", "--duration", "0.1", "--tail", "0", "-q", "live", "-o", str(output)]) == 0
    )
    said = f"compiling the kernels, once, in about {library.duration()} ..."
    shown = ["compiling the kernels"] * terminal
    assert order[: order.index("clock")] == [said, "waits", *shown, "compiled", *["a.wav"] * terminal]


DIGEST = "from livebass.compiling import store; print(store.digest())"


def digest_of(package: Path) -> str:
    return python_output("-P", "-c", DIGEST, env={"PYTHONPATH": package.parent})


def test_the_name_goes_by_contents(tmp_path: Path) -> None:
    """A copy elsewhere, or a reinstalled one, has the same kernels; a changed one does not."""
    copy = tmp_path / "livebass"
    shutil.copytree(Path(livebass.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    for file in copy.rglob("*.py"):
        os.utime(file)
    assert digest_of(copy).strip() == store.digest()
    for file in ("kernels/voice.py", "live/thread/ring.py", "compiling/emitter.py"):
        before = digest_of(copy)
        with (copy / file).open("a") as out:
            out.write("# changed\n")
        assert digest_of(copy) != before


def imports(source: Path) -> set[Path]:
    """The files of livebass that the file `source` imports."""
    names = []
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    places = [store.PACKAGE.parent.joinpath(*name.split(".")) for name in names if name.startswith("livebass.")]
    return {file for place in places for file in (place.with_suffix(".py"), place / "__init__.py") if file.exists()}


def test_the_name_goes_by_all_that_kernels_import() -> None:
    """Also by the ground-floor files from which they take numbers."""
    for source in store.sources():
        if store.PACKAGE / "compiling" not in source.parents:
            assert imports(source) <= set(store.sources()), source
    assert store.PACKAGE / "rows/techniques.py" in imports(store.PACKAGE / "kernels" / "player" / "performer.py")


SHARED = """
import sys
from livebass.compiling import entry, inlined, jit, lowering
import numpy as np

@jit
def square(x):
    return x * x

@jit
def root(x):
    return np.sqrt(square(x) + 1.0)

@inlined
def halved(x):
    half = 0.5 * x
    while half > 1.0:
        half *= 0.5
    return half

@entry("float64(float64)")
def first(x):
    return root(x)

@entry("int64(float64)")
def second(x):
    return np.int64(2.0 * root(x) + square(x) + halved(x))

@entry("float64(int64)")
def third(x):
    return halved(1.0 * square(x)) + halved(2.0)

import json
print(json.dumps(lowering.compile_entries([globals()[name] for name in sys.argv[1:]])))
"""


def lower(folder: Path, *names: str) -> dict[str, dict[str, str]]:
    """The output of a process that compiles entries of SHARED, in this order."""
    (folder / "shared.py").write_text(SHARED)
    return json.loads(python_output(folder / "shared.py", *names, env=lowering.SETTINGS))


def test_the_program_is_the_same_whoever_compiles_what(tmp_path: Path) -> None:
    """In one or two processes, in any order; a function compiled by both is in it once, and LLVM accepts it."""
    one = lower(tmp_path, "first", "second", "third")
    two = [lower(tmp_path, "third", "second"), lower(tmp_path, "first")]
    program = lowering.link_modules([one])
    assert program == lowering.link_modules(two) == lowering.link_modules(reversed(two))
    assert program.count("define internal i32") == 3 + 3, "root, and square of two types; a function for each entry"
    data, needs = emitter.emit(program, store.level())
    assert not needs and all(f"lb_{name}".encode() in data for name in ("first", "second", "third"))


FLAGS = """
from llvmlite import ir
from livebass.compiling import lowering
lowering.only_text()
from numba.core.fastmathpass import FastFloatBinOpVisitor
double, texts = ir.DoubleType(), set()
for flags in (["reassoc", "arcp", "nsz"], ["nsz", "reassoc", "arcp"]):
    module = ir.Module()
    function = ir.Function(module, ir.FunctionType(double, [double, double]), "f")
    builder = ir.IRBuilder(function.append_basic_block())
    builder.ret(builder.fadd(*function.args))
    FastFloatBinOpVisitor(flags).visit(module)
    texts.add(str(module))
(text,) = texts
print(text)
"""


def test_flags_of_operations_have_one_order() -> None:
    """numba takes them from a set; the order of a set of constants depends on the process that wrote the bytecode."""
    assert "fadd arcp nsz reassoc double" in python_output("-c", FLAGS)


def test_naming_records_once_changes_no_text() -> None:
    code = (
        "import sys; from livebass.compiling import lowering; from livebass.kernels.pickup.coil import fit_coil\n"
        "if sys.argv[1:]: lowering.name_records_once = lambda: None\n"
        "import json; print(json.dumps(lowering.compile_entries([fit_coil])))"
    )
    assert len({python_output("-c", code, *plain, env=lowering.SETTINGS) for plain in ([], ["plain"])}) == 1


def test_the_program_names_no_place() -> None:
    """It is the same wherever numba and livebass are installed: a Python error would name its file."""
    text = emitter.program()
    assert str(Path(numba.__file__).parent) not in text and "site-packages" not in text
    assert str(store.PACKAGE) not in text


def test_at_signs_in_data_are_no_names() -> None:
    text = '@".const.1" = internal constant [4 x i8] c"@b@\\22", !dbg @other, @"a name"'
    assert list(lowering.names_in(text)) == [".const.1", "other", "a name"]


@pytest.mark.slow
def test_one_process_makes_the_same_kernels_as_two() -> None:
    assert lowering.program(parts=1) == emitter.program()


def test_what_shares_most_is_compiled_by_one_process() -> None:
    reaches = {
        "large": {"a": 60, "b": 30, "c": 10}, "part": {"b": 30, "c": 10}, "other": {"c": 10, "d": 40},
        "alike": {"a": 60, "e": 1}, "small": {"f": 5},
    }  # fmt: skip
    assert lowering.shared_out(reaches, 1) == [["alike", "large", "other", "part", "small"]]
    one, other = lowering.shared_out(reaches, 2)
    assert sorted(one) == ["alike", "large", "part"] and sorted(other) == ["other", "small"]


def test_what_an_entry_reaches_is_found_in_its_code() -> None:
    found = lowering.reachable(ENTRIES["read_word"].function)
    assert "livebass.live.thread.ring.read_word" in found and all(found.values())
    assert set(found) < set(lowering.reachable(ENTRIES["process"].function)) | {"livebass.live.thread.ring.read_word"}
    assert len(lowering.reachable(ENTRIES["process"].function)) > 200


def test_a_program_is_kept_and_made_again_if_damaged(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    made: list[str] = []

    def program(_: object) -> str:
        made.append("; a program")
        return made[-1]

    monkeypatch.setattr(lowering, "program", program)
    monkeypatch.setattr(store, "program_kept", lambda: tmp_path / "kept")
    monkeypatch.setattr(store, "program_built", lambda: tmp_path / "built")
    for damage, times in ((one_bit, 1), (cut, 2), (empty, 3)):
        for _ in range(2):
            assert emitter.program() == made[-1] and len(made) == times
        (tmp_path / "kept").write_bytes(damage((tmp_path / "kept").read_bytes()))
    (tmp_path / "built").write_bytes(store.seal(gzip.compress(b"; came")))
    assert emitter.program() == "; came" and len(made) == 3
    (tmp_path / "built").write_bytes(one_bit((tmp_path / "built").read_bytes()))
    assert emitter.program() == made[-1] and len(made) == 4


FROM_PROGRAM = """
import sys
from livebass.compiling import library, store
assert "built" in str(store.program_built()) and store.program_built().exists()
print(b"lb_read_word" in library.compiled_for(store.level()), library.duration())
"""


def test_an_sdist_holds_the_program_and_compiles_without_numba(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The program could come from nowhere else here; an installation from the sdist takes it from there."""
    if store.program_built().exists():
        pytest.skip("this is an sdist itself")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    store.directory.cache_clear()
    kept = store.program_kept()
    store.directory.cache_clear()
    assert kept
    store.write(kept, gzip.compress(ROOT, mtime=0))
    root = store.PACKAGE.parent
    python_output("-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path, cwd=root)
    (packed,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(packed) as archive:
        safely = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}  # from Python 3.11.4 on
        archive.extractall(tmp_path, **safely)
    (unpacked,) = tmp_path.glob("livebass-*/")
    ours = [line[1:].strip("/") for line in (root / ".gitignore").read_text().splitlines() if line.startswith("!")]
    expected = {path.name for pattern in ours for path in root.glob(pattern)} | {"PKG-INFO"}
    assert {path.name for path in unpacked.iterdir()} == expected, "the sdist has what belongs to the project, no more"
    assert not list(unpacked.rglob("node_modules"))
    assert store.whole(unpacked / "livebass" / "built" / store.program_built().name) == gzip.compress(ROOT, mtime=0)
    blocked = tmp_path / "blocked"
    blocked.mkdir()
    (blocked / "numba.py").write_text("raise ImportError('numba')")
    shutil.rmtree(tmp_path / "cache")
    places = {"PYTHONPATH": os.pathsep.join([str(blocked), str(unpacked)])}
    assert python_output("-P", "-c", FROM_PROGRAM, cwd=tmp_path, env=places) == "True a quarter of a minute\n"


def test_a_playing_process_has_no_numba(machine_code: bytes, tmp_path: Path) -> None:
    code = (
        "import sys, livebass\n"
        "from livebass.live import session\n"
        "bass = livebass.load_preset('paper-g')\n"
        "score = livebass.single_note(43, 100, 0.05, 48000)\n"
        "livebass.render_to_array(bass, score, livebass.QUALITIES['live'], tail=0.0)\n"
        "assert 'numba' not in sys.modules and 'scipy' not in sys.modules\n"
    )
    python_output("-c", code)


PREPARED = "import os, platform, sys; {}; from livebass.__main__ import main; main()"
NOTE = ("render", "--note", "G2", "--duration", "0.1", "--tail", "0", "-q", "live", "-o")


@pytest.mark.parametrize(
    "change, named",
    [
        ("os.environ['LIVEBASS_LEVEL'] = 'pentium'", "LIVEBASS_LEVEL must be x86-64-v"),
        ("import soundfile; platform.machine = lambda: 'riscv64'", "processor riscv64"),
        ("sys.executable = None", "sys.executable"),
        ("sys.executable = '/nowhere/python'", "/nowhere/python"),
    ],
)
def test_what_has_no_kernels_is_said_in_a_line(tmp_path: Path, change: str, named: str) -> None:
    done = run_python("-c", PREPARED.format(change), *NOTE, tmp_path / "a.wav", env={"NUMBA_CACHE_DIR": tmp_path})
    assert_one_clear_line(done.returncode, done.stderr, (1,))
    assert named in done.stderr and not (tmp_path / "a.wav").exists()


def test_a_compiler_that_does_not_load_says_why(tmp_path: Path) -> None:
    """It loads nothing from the working directory, whose files may have names of Python modules."""
    (tmp_path / "numba.py").write_text("raise ImportError('numba needs an older numpy')")
    here = tmp_path / "here"
    here.mkdir()
    (here / "random.py").write_text("raise ImportError('the working directory')")
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {"NUMBA_CACHE_DIR": tmp_path, "PYTHONPATH": path}
    done = run_python("-P", "-m", "livebass", *NOTE, tmp_path / "a.wav", cwd=here, env=environment)
    assert_one_clear_line(done.returncode, done.stderr, (1,))
    assert "ImportError: numba needs an older numpy" in done.stderr


def test_code_that_needs_what_it_must_not_is_refused() -> None:
    program = "define i64 @lb_f(i64 %x) {{\n{}\n}}\n{}"
    bad = program.format("  %y = call i64 @PyErr_Occurred()\n  ret i64 %y", "declare i64 @PyErr_Occurred()")
    with pytest.raises(ValueError, match="needs PyErr_Occurred"):
        emitter.emit(bad, store.level())
    place = "  %y = load i64, ptr inttoptr (i64 140737488 to ptr)\n  ret i64 %y"
    with pytest.raises(ValueError, match="address"):
        emitter.emit(program.format(place, ""), store.level())
    data, needs = emitter.emit(program.format("  ret i64 %x", ""), store.level())
    assert b"lb_f" in data and not needs and b"flush_bits" not in data, "all but the entries is internal"


BY_NUMBA = f"""
from livebass.compiling.by_numba import counted
{THRICE.format("counted")}
if __name__ == "__main__":
    print(thrice(14.0), "loaded" if thrice.stats.cache_hits else "compiled")
"""


def run(folder: Path, *, limit: int | None = None, **environment: object) -> tuple[str, str]:
    """Returns the output of numba functions and their line on stderr; no file may grow beyond `limit` bytes."""
    (folder / "small.py").write_text(BY_NUMBA)
    places = {"NUMBA_CACHE_DIR": folder / "cache", "TMPDIR": folder, **environment}
    bounds = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))) if limit else None
    done = run_python("-B", folder / "small.py", env=places, preexec_fn=bounds)
    assert done.returncode == 0, done.stderr
    value, _, state = done.stdout.strip().partition(" ")
    assert value == "42.0"
    return state, done.stderr


@pytest.fixture(scope="module")
def by_numba(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of functions compiled by numba."""
    folder = tmp_path_factory.mktemp("by_numba")
    assert run(folder) == ("compiled", "")
    return folder


@pytest.mark.parametrize(
    "ending, damage",
    [
        pytest.param(ending, damage, id=f"{damage.__name__}, {ending}", marks=[pytest.mark.slow] * (k > 0))
        for k, (ending, damage) in enumerate(itertools.product(("nbc", "nbi"), (one_bit, cut, garbage, empty)))
    ],
)
def test_what_numba_kept_may_be_damaged(by_numba: Path, ending: str, damage: Callable[[bytes], bytes]) -> None:
    files = list((by_numba / "cache").rglob(f"*.{ending}"))
    assert len(files) >= 2
    for file in files:
        file.write_bytes(damage(file.read_bytes()))
    state, err = run(by_numba)
    assert state == "compiled" and err.count("\n") == 1 and "damaged" in err and str(by_numba / "cache") in err
    assert run(by_numba) == ("loaded", "")


@pytest.mark.parametrize("limit", [slow(100), 5000])
def test_numba_does_without_a_full_disk(tmp_path: Path, limit: int) -> None:
    """The smaller limit stops every file, the greater one lets the indices through."""
    assert run(tmp_path, limit=limit) == ("compiled", "")
    assert not list((tmp_path / "cache").rglob("*.nbc*"))


@pytest.mark.slow
def test_the_real_kernels_survive_damage(machine_code: bytes, tmp_path: Path) -> None:
    """The machine code is damaged, but not the program it is made from."""
    program = store.directory(f"kernels-{store.digest()}")
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    kept = tmp_path / f"kernels-{store.digest()}" / f"{store.level()}.code"
    kept.parent.mkdir()
    kept.write_bytes(cut(store.seal(machine_code)))
    for file in program.glob("*.ll.gz") if program else ():
        shutil.copy(file, kept.parent)
    lines = {}
    for name in ("damaged", "warm"):
        done = command(*NOTE, tmp_path / f"{name}.wav", env=environment)
        assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
        lines[name] = done.stderr.splitlines()
    assert [len(lines[name]) for name in ("damaged", "warm")] == [3, 1]
    assert lines["damaged"][0].startswith("compiling the kernels")
    sounds = {(tmp_path / f"{name}.wav").read_bytes() for name in lines}
    assert len(sounds) == 1
