"""The choice of the bass: what comes out of thousands of made-up and damaged files, compiled and as plain Python."""

from __future__ import annotations

import json

from hypothesis import settings
from support.choices import digests
from support.plain import in_plain_python
from support.songs import damaged, make

from livebass.compiling import PLAIN

FILES, TOGETHER = 750 if settings().max_examples < 400 else 2500, 500  # of each kind; tools/test --all: 2500
FEW = range(12)  # files for plain Python, which is slow
PINNED = [
    "b8f2d272", "082a3a58", "1d6a58b8", "fe0e3210", "1b1cee17", "9f499d6c", "6758df36", "03182970", "e403592c",
    "dafb95e0",
]  # fmt: skip


def test_the_same_is_chosen_as_before() -> None:
    """The digests are of another rule, in Python, with which this one agreed; its faults are mended in them."""
    files = (file for seed in range(FILES) for file in (make(seed).data, damaged(seed)))
    assert digests(files, TOGETHER) == PINNED[: 2 * FILES // TOGETHER]


def test_plain_kernels_choose_the_same() -> None:
    assert in_plain_python(__file__) == few()


def few() -> list[str]:
    """Digests of what is chosen from some made-up and damaged files."""
    return digests([file for seed in FEW for file in (make(seed).data, damaged(seed))], 1)


if __name__ == "__main__":
    assert PLAIN
    print(json.dumps(few()))
