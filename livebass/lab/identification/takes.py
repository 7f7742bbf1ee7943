"""The takes of one pitch in recordings, with defects cut out and named."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from livebass.lab.identification.doubts import left_out, without_clipping
from livebass.lab.identification.limits import Search
from livebass.lab.identification.partials import RecordingError, Take, find_takes, pitch_of, read_recording
from livebass.lab.identification.treatment import cuts, without_loops
from livebass.rows.units import cents

PITCHES = (25.0, 500.0)  # Hz, if neither note nor string is given
SEMITONE = 2 ** (1 / 12)
PERIODS = 20  # of a take, at least


class Takes(NamedTuple):
    """The sufficiently long takes of one pitch."""

    takes: list[Take]
    pitch: float  # Hz
    all_takes: int  # number of takes in the recordings
    doubts: list[str]


def takes_of(paths: Sequence[Path], search: Search, hint: float | None) -> Takes:
    """Reads the recordings and keeps the takes of the commonest pitch, near the `hint` (Hz) if there is one.

    Raises RecordingError.
    """
    if not paths:
        raise RecordingError("no recording")
    takes: list[Take] = []
    count, doubts = 0, []
    cut: dict[int, list[str]] = {}
    for path in paths:
        recording = read_recording(path, search.channel)
        new = find_takes(recording, search.start, search.duration)
        if not new:
            raise RecordingError(f"{path}: {recording.sound.size / recording.rate:.3g} s, too short or without a note")
        count += len(new)
        new, clipping = without_clipping(recording, new)
        new, loops = without_loops(new)
        takes += new
        doubts += clipping + loops
        cut |= {id(take): cuts(recording, take, search.start) for take in new}
    if not takes:
        raise RecordingError(doubts[-1])
    low, high = (hint / SEMITONE, hint * SEMITONE) if hint else PITCHES
    pitches = [pitch_of(take, low, high) for take in takes]
    if not any(pitches):
        near = f" within a semitone of {hint:.2f} Hz" if hint else ""
        longest = max(t.duration_s for t in takes)
        if longest < max(3.0, PERIODS * 0.1) / low:
            raise RecordingError(f"{takes[0].name}: {longest:.3g} s of note, too short: {PERIODS} periods are needed")
        raise RecordingError(f"{takes[0].name}: no pitch{near}: noise, several notes at once, or not this string")
    heard = np.array([p for p in pitches if p])
    alike = np.abs(np.log(heard[:, None] / heard)) < math.log(SEMITONE)
    pitch = float(np.median(heard[alike[np.argmax(alike.sum(axis=0))]]))  # of most takes
    good = [t for t, p in zip(takes, pitches, strict=True) if p and abs(cents(p / pitch)) < 100]
    others = [t for t, p in zip(takes, pitches, strict=True) if not p or abs(cents(p / pitch)) >= 100]
    doubts += [left_out(take, pitch_of(take, *PITCHES), beside=False) for take in others]
    long = [t for t in good if t.duration_s * pitch >= PERIODS]
    if not long:
        longest = max(t.duration_s for t in good)
        why = f"too short: {PERIODS} periods, {PERIODS / pitch:.2g} s, are needed"
        raise RecordingError(f"{good[0].name}: {longest:.3g} s of note, {why}")
    return Takes(long, pitch, count, [*doubts, *(said for take in long for said in cut[id(take)])])
