"""Keys of a file beyond a bass's range: notes of a low tuning, or key switches.

The rule is in kernels/score/low_keys.py.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from livebass.compiling import Entry
from livebass.kernels.score.low_keys import FITTING, FITTING_WORDS, leave_switches, raise_notes
from livebass.kernels.score.memory import PLAYED
from livebass.score.found import switch_table
from livebass.score.score import Score, messages_of


class Bass(Protocol):
    """The part of an `Instrument` that this module needs."""

    @property
    def note_range(self) -> tuple[int, int]: ...

    @property
    def switches(self) -> Collection[int]: ...


def with_low_notes(score: Score, bass: Bass) -> Score:
    """The score; low keys that would switch on `bass` move up by octaves if they are notes.

    Key switches of another instrument are left out.
    """
    return _fitted(score, bass, leave_switches, raise_notes)


def without_foreign_switches(score: Score, bass: Bass) -> Score:
    """The score without the key switches of another instrument.

    These are keys beyond the range of `bass` that do not switch it: brief ones just before a longer note, or, far from
    all notes, keys that are held while notes begin.
    """
    return _fitted(score, bass, leave_switches)


def _fitted(score: Score, bass: Bass, *kernels: Entry) -> Score:
    """A score of another instrument, fitted to `bass` by these kernels in turn; a take stays as it is."""
    if not score.foreign:
        return score
    fitting = _Fitting(score, bass)
    for kernel in kernels:
        kernel(fitting.address)
    return fitting.score()


class _Fitting:
    """The rows of a score, while kernels fit them to a bass."""

    def __init__(self, score: Score, bass: Bass) -> None:
        self._given = score
        self._rows: NDArray[Any] = np.zeros(len(score.frames), PLAYED)
        self._rows["frame"] = score.frames
        for k, name in enumerate(("status", "first", "second")):
            self._rows[name] = score.messages[:, k]
        self._switches = switch_table(bass.switches)
        self._memory = np.zeros(FITTING_WORDS * score.notes, np.int64)
        self._row = np.zeros(1, FITTING)
        self._row["count"], self._row["end"], self._row["rate"] = len(score.frames), score.end_frame, score.rate
        self._row["lowest"], self._row["highest"] = bass.note_range
        self._row["rows"], self._row["switches"] = self._rows.ctypes.data, self._switches.ctypes.data
        self._row["memory"] = self._memory.ctypes.data

    @property
    def address(self) -> int:
        """The address of the FITTING."""
        return int(self._row.ctypes.data)

    def score(self) -> Score:
        """The score as it fits."""
        row, given = self._row[0], self._given
        rows, left_out, raised = self._rows[: row["count"]], int(row["left_out"]), int(row["raised"])
        if not left_out and not raised:
            return given
        return replace(
            given, frames=rows["frame"].copy(), messages=messages_of(rows), notes=given.notes - left_out,
            left_out=given.left_out + left_out, raised=raised,
        )  # fmt: skip
