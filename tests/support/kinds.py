"""A test's kind, from its folder, and the tests that one worker of pytest-xdist takes together."""

from __future__ import annotations

import pytest

from support.products import WITHOUT_KERNELS

KINDS = ("unit", "promises", "hosted", "real")
REAL = ("tests/real/browser/", "tests/real/")  # what one worker each takes whole
# The files that take longest go first, so that no worker is left with one at the end
LONGEST = (
    "unit/compiling/test_compiling.py", "unit/live/test_play.py", "unit/fitting/test_fit.py",
    "hosted/test_promises.py", "unit/preset/test_idle.py", "unit/bench/test_live.py",
    "unit/engine/hands/test_hands_by_force.py", "unit/live/test_live.py", "hosted/test_clap.py",
    "unit/export/test_sfz.py", "unit/engine/test_pinned.py", "unit/engine/player/test_playing.py",
    "hosted/test_lv2.py", "unit/engine/player/test_evenness.py", "unit/preset/test_preset.py",
    "unit/comparison/test_notes.py", "unit/engine/hands/test_touch.py", "unit/engine/string/test_turned.py",
    "promises/cli/test_streams.py", "unit/experiment/test_sweep.py",
)  # fmt: skip


def file_of(test: str) -> str:
    """The file of a test, by its node id."""
    return test.partition("::")[0]


def marks(test: str) -> list[str]:
    """The marks of a test: its kind, and of a real one the part that it needs. Raises UsageError elsewhere."""
    _, kind, *rest = file_of(test).split("/")
    if kind not in KINDS or (kind == "real" and len(rest) < 2):
        raise pytest.UsageError(f"{file_of(test)}: tests stand in a folder of tests: {', '.join(KINDS)}/PART")
    return [kind, rest[0]] if kind == "real" else [kind]


def group(test: str) -> str:
    """What one worker takes whole: the tests of a file, those in browsers, or all other real ones.

    So at most two workers have real tests, one of them those in real time, and only one has a JACK server.
    """
    return next((place for place in REAL if test.startswith(place)), file_of(test))


def turn(test: str) -> tuple[int, int]:
    """The place of a test's file in the overall order: real ones, others while kernels compile, the longest."""
    first = next(k for k, begins in enumerate((*REAL, WITHOUT_KERNELS, "")) if test.startswith(begins))
    file = file_of(test).removeprefix("tests/")
    return first, LONGEST.index(file) if file in LONGEST else len(LONGEST)
