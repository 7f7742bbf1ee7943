"""`tools/mutate.py`: what it finds in the kernels, and that it changes a copy alone."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

from livebass.compiling import store

ROOT = Path(__file__).parent.parent


def mutate() -> Any:
    spec = importlib.util.spec_from_file_location("mutate", ROOT / "tools" / "mutate.py")
    assert spec and spec.loader
    made = importlib.util.module_from_spec(spec)
    sys.modules["mutate"] = made  # where its dataclass looks for its types
    spec.loader.exec_module(made)
    return made


def test_constants_signs_and_comparisons_of_a_copy_are_changed(tmp_path: Path) -> None:
    tool = mutate()
    before = [file.read_bytes() for file in store.sources()]
    found = tool.all_mutants()
    stop = {mutant.what: key for key, mutant in found.items() if mutant.file == "string/stop.py"}
    wanted = (
        "SETTLING = 0.001 -> 0.002", "slot.offset_speed + slot.offset / SETTLING: + turned",
        "finger <= 0.0: turned round", "10.0 -> 20.0",
    )  # fmt: skip
    tool.copy_of_the_tree(tmp_path / "tree", {stop[what]: number for number, what in enumerate(wanted, 1)})
    text = (tmp_path / "tree/livebass/kernels/string/stop.py").read_text()
    for made in (
        "exp(-1.0 / (either(1, SETTLING, 0.002) * rate))",
        "slot.offset_speed + signed(2, slot.offset / either(1, SETTLING, 0.002))",
        "if turned_round(3, finger <= 0.0):", "t * t * t * (either(4, 10.0, 20.0) - t * ",
    ):  # fmt: skip
        assert made in text, text
    changed = [
        file for file in store.sources()
        if file.read_bytes() != (tmp_path / "tree" / file.relative_to(ROOT)).read_bytes()
    ]  # fmt: skip
    assert [file.name for file in changed] == ["library.py", "stop.py"]
    assert [file.read_bytes() for file in store.sources()] == before
    assert not any(mutant.what.startswith("MOST_STRINGS") for mutant in found.values()), "a size of memory"
