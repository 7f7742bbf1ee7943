"""`tools/mutate.py`: its finds in the kernels, its copy as the only thing it changes, and one switch for all."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from support.places import ROOT
from support.programs import load

from livebass.compiling import store

KERNELS = '''"""Two entries with mutants."""

from livebass.compiling import entry, jit
from livebass.kernels.machine.mutant import either, signed, turned_round


@jit
def share(x):
    return x + signed(1, 1.0)


@entry("float64(float64)")
def first(x):
    return share(x) * either(2, 3.0, 5.0)


@entry("float64(float64)")
def second(x):
    return share(x) if turned_round(3, x > 10.0) else x
'''
PLAYED = """
from ctypes import CFUNCTYPE, c_double, c_int64
import livebass.kernels.machine.sample
from livebass.compiling import ENTRIES, emitter, library, lowering, store
names = "choose_mutant", "first", "second"
text = lowering.link_modules([lowering.compile_entries([ENTRIES[name] for name in names])])
made = library.object_file(emitter.emit(text, store.level())[0])
choose = CFUNCTYPE(None, c_int64)(made("choose_mutant"))
first, second = (CFUNCTYPE(c_double, c_double)(made(name)) for name in names[1:])
for k in (0, 1, 2, 3, 4, 0):
    choose(k)
    print(first(7.0), second(7.0), second(11.0))
"""

KEPT = """
import support.source
from livebass.kernels.machine import mutant, sample
print(sample.share(7.0), end=" ")
mutant.NUMBER.value = 0
print(sample.share(7.0), sum(sample.share.stats.cache_hits.values()))
"""


def test_constants_signs_and_comparisons_of_a_copy_are_changed(tmp_path: Path) -> None:
    tool = load("mutate")
    before = [file.read_bytes() for file in store.sources()]
    found = tool.all_mutants()
    stop = {mutant.what: key for key, mutant in found.items() if mutant.file == "string/stop.py"}
    wanted = (
        "SETTLING = 0.001 -> 0.002", "slot.offset_speed + slot.offset / SETTLING: + turned",
        "abs(speed) * OVERSHOOT * seconds > FARTHEST: turned round", "10.0 -> 20.0 in 10.0 - t * (15.0 - 6.0 * t)",
    )  # fmt: skip
    tool.copy_of_the_tree(tmp_path / "tree", {stop[what]: number for number, what in enumerate(wanted, 1)})
    text = (tmp_path / "tree/livebass/kernels/string/stop.py").read_text()
    for made in (
        "exp(-1.0 / (either(1, SETTLING, 0.002) * rate))",
        "slot.offset_speed + signed(2, slot.offset / either(1, SETTLING, 0.002))",
        "if turned_round(3, abs(speed) * OVERSHOOT * seconds > FARTHEST):", "t * t * t * (either(4, 10.0, 20.0) - t * ",
    ):  # fmt: skip
        assert made in text, text
    changed = [
        file for file in store.sources()
        if file.read_bytes() != (tmp_path / "tree" / file.relative_to(ROOT)).read_bytes()
    ]  # fmt: skip
    assert [file.name for file in changed] == ["library.py", "stop.py"]
    assert [file.read_bytes() for file in store.sources()] == before
    assert {(mutant.file, mutant.what) for mutant in found.values()} >= {*tool.HARMLESS}
    assert not any(mutant.what.startswith("MAX_STRINGS") for mutant in found.values()), "a size of memory"


def test_one_switch_is_for_all_that_is_compiled(tmp_path: Path) -> None:
    """The program made from text, with digests for names, has one word for the mutant's number."""
    tool, tree = load("mutate"), tmp_path / "tree"
    tool.copy_of_the_tree(tree, {})
    (tree / "livebass/kernels/machine/sample.py").write_text(KERNELS)
    ran = subprocess.run(
        [sys.executable, "-c", PLAYED], env=tool.environment(tree) | {"LIVEBASS_FROM_SOURCE": "1"},
        cwd=tree, capture_output=True, text=True, check=False,
    )  # fmt: skip
    default = "24.0 7.0 12.0"
    assert ran.stdout.splitlines() == [
        default, "18.0 7.0 10.0", "40.0 7.0 12.0", "24.0 8.0 11.0", default, default
    ], ran.stderr  # fmt: skip


@pytest.mark.slow  # compiles three times
def test_a_kernel_that_numba_keeps_on_disk_takes_the_mutant_of_the_process_that_loads_it(tmp_path: Path) -> None:
    tool, tree = load("mutate"), tmp_path / "tree"
    tool.copy_of_the_tree(tree, {})
    (tree / "livebass/kernels/machine/sample.py").write_text(KERNELS)
    said = []
    for mutant in ("0", "1", "2"):
        ran = subprocess.run(
            [sys.executable, "-c", KEPT], env=tool.environment(tree) | {"LIVEBASS_MUTANT": mutant},
            cwd=tree, capture_output=True, text=True, check=False,
        )  # fmt: skip
        said.append((ran.stdout.split(), ran.stderr))
    assert [words[:2] for words, _ in said] == [["8.0", "8.0"], ["6.0", "8.0"], ["8.0", "8.0"]], said
    assert [words[2] for words, _ in said] == ["0", "1", "1"], "compiled once"
