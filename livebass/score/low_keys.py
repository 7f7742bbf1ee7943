"""Low keys of a file: notes of a low tuning, or key switches.

A livebass reads keys below its lowest note as key switches if its key map has them. In a foreign file they are notes if
they look like notes: each sounds alone, as long as the others. A key switch is brief, or held while notes begin. Notes
move up by octaves.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Protocol

import numpy as np

from livebass.score.score import NOTE_OFF, NOTE_ON, Score
from livebass.score.spread import OVERLAP

DEEPEST = 16  # E0: no bass is tuned lower
SHORT = 0.5  # of the usual length of a note: key switches are shorter
MOST = 0.6  # of the low keys must look like notes


class Bass(Protocol):
    """The part of an `Instrument` that this module needs."""

    @property
    def note_range(self) -> tuple[int, int]: ...

    @property
    def switches(self) -> Collection[int]: ...


def with_low_notes(score: Score, bass: Bass) -> Score:
    """The score; low keys that would switch on `bass` move up by octaves if they are notes."""
    lowest, switches = bass.note_range[0], bass.switches
    if not score.foreign or not _are_notes(score, lowest, switches):
        return score
    messages = score.messages.copy()
    kind, key = messages[:, 0] & 0xF0, messages[:, 1].astype(np.int64)
    low = np.isin(kind, (NOTE_ON, NOTE_OFF)) & (key >= DEEPEST) & (key < lowest)
    raised = key - 12 * ((key - lowest) // 12)
    low &= np.array([k in switches and r not in switches for k, r in zip(key.tolist(), raised.tolist(), strict=True)])
    messages[low, 1] = raised[low]
    return replace(score, messages=messages, raised=int(np.count_nonzero(low & (kind == NOTE_ON))))


def _are_notes(score: Score, lowest: int, switches: Collection[int]) -> bool:
    """True if most low keys in a score that would switch look like notes."""
    strokes = _strokes(score)
    low = [s for s in strokes if DEEPEST <= s[2] < lowest and s[2] in switches]
    others = [s for s in strokes if s[2] not in switches or s[2] >= lowest]
    if not low:
        return False
    if not others:
        return True
    if len(low) == 1 and low[0][0] < others[0][0]:  # a switch before the first note
        return False
    usual = float(np.median([end - begin for begin, end, _ in others]))
    overlap = OVERLAP * score.rate
    long = [s for s in strokes if s[1] - s[0] > overlap]  # the others are too short to overlap
    begins, ends = (np.sort([s[k] for s in long]) for k in (0, 1))

    def looks_like_a_note(stroke: tuple[int, int, int]) -> bool:
        begin, end, _ = stroke
        at_once = np.searchsorted(begins, end - overlap) - np.searchsorted(ends, begin + overlap, "right")
        return end - begin >= SHORT * usual and (end - begin <= overlap or bool(at_once <= 1))

    return sum(map(looks_like_a_note, low)) >= MOST * len(low)


def _strokes(score: Score) -> list[tuple[int, int, int]]:
    """(first frame, last frame, key) of each note, by first frame."""
    begun: dict[tuple[int, int], list[int]] = {}
    found = []
    for frame, (status, key, _) in zip(score.frames.tolist(), score.messages.tolist(), strict=True):
        line = begun.setdefault((status & 0x0F, key), [])
        if status & 0xF0 == NOTE_ON:
            line.append(frame)
        elif status & 0xF0 == NOTE_OFF:
            found += [(begin, frame, key) for begin in line]
            line.clear()
    found += [(begin, score.end_frame, key) for (_, key), line in begun.items() for begin in line]
    return sorted(found)
