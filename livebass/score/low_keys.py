"""Keys of a file beyond a bass's range: notes of a low tuning, or key switches.

A livebass reads keys below its lowest note as key switches if its key map has them. In a foreign file they are notes if
they look like notes: each sounds alone, as long as the others. A key switch is brief, or held while notes begin. Notes
move up by octaves. Other keys beyond the range that look like switches are those of another instrument: they are left
out.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection
from dataclasses import replace
from typing import Protocol

import numpy as np

from livebass.score.score import NOTE_OFF, NOTE_ON, Score
from livebass.score.spread import OVERLAP

DEEPEST = 16  # E0: no bass is tuned lower
SHORT = 0.5  # of the usual length of a note: key switches are shorter
MOST = 0.6  # of the low keys must look like notes, or of the others beyond the range like switches
FAR = 12  # semitones from all notes to a key that is held as a switch


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
    score = without_foreign_switches(score, bass)
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


def without_foreign_switches(score: Score, bass: Bass) -> Score:
    """The score without the key switches of another instrument.

    These are keys beyond the range of `bass` that do not switch it: brief ones just before a longer note, or, far from
    all notes, keys that are held while notes begin.
    """
    if not score.foreign:
        return score
    lowest, highest = bass.note_range
    strokes = [s for s in _strokes(score) if s[2] not in bass.switches or s[2] >= lowest]
    notes = [s for s in strokes if lowest <= s[2] <= highest]
    beyond = [s for s in strokes if not lowest <= s[2] <= highest]
    if not notes or not beyond:
        return score
    usual = float(np.median([end - begin for begin, end, _ in notes]))
    keys, overlap = [key for *_, key in notes], OVERLAP * score.rate
    near = range(min(keys) - FAR, max(keys) + FAR + 1)
    begins = [begin for begin, *_ in notes]

    def looks_like_a_switch(stroke: tuple[int, int, int]) -> bool:
        begin, end, key = stroke
        brief = end - begin < SHORT * usual
        until = max(end - overlap, begin + overlap) if key not in near else begin + overlap
        following = notes[bisect_left(begins, begin) : bisect_left(begins, until)]
        return (brief or key not in near) and any(last > end + overlap or not brief for _, last, _ in following)

    found = {s for s in beyond if looks_like_a_switch(s)}
    if len(found) < MOST * len(beyond):
        return score
    pressed, released = ({(stroke[k], stroke[2]) for stroke in found} for k in (0, 1))
    left = [
        (kind == NOTE_ON and (frame, key) in pressed) or (kind == NOTE_OFF and (frame, key) in released)
        for frame, kind, key in zip(
            score.frames.tolist(), (score.messages[:, 0] & 0xF0).tolist(), score.messages[:, 1].tolist(), strict=True
        )
    ]
    kept = ~np.array(left)
    return replace(
        score, frames=score.frames[kept], messages=score.messages[kept], notes=score.notes - len(found),
        left_out=len(found),
    )  # fmt: skip


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
