"""What is chosen from MIDI files, and what a bass plays of it, as plain values to compare."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from livebass.score.low_keys import with_low_notes
from livebass.score.reading import ScoreError, parts_in, score_in
from support.songs import digests_of

RATES = 8000, 44100, 48000, 192_000  # Hz
CHANNELS = "auto", "auto", "auto", "all", 1, 10


class Bass(NamedTuple):
    """As much of an `Instrument` as low keys need."""

    note_range: tuple[int, int]
    switches: frozenset[int]


BASSES = Bass((28, 67), frozenset(range(25))), Bass((40, 60), frozenset({19, 24, 28, 33})), Bass((23, 72), frozenset())


def chosen(data: bytes, rate: int, channel: str | int, bass: Bass) -> list[Any]:
    """The score of a file, what `bass` plays of it, and its parts; or an error."""
    path = Path("song.mid")
    try:
        score = score_in(data, path, rate, channel)
    except ScoreError as error:
        return [str(error)]
    played = with_low_notes(score, bass)
    return [
        score.frames.tolist(), score.messages.tolist(), score.end_frame, score.notes, score.program, score.remarks,
        score.file_end, [(b.frame, b.program, b.preset) for b in score.basses],
        played.frames.tolist(), played.messages.tolist(), played.notes, played.raised, played.left_out,
        [list(vars(part).values()) for part in parts_in(data, path, channel, bass.switches)],
    ]  # fmt: skip


def digests(files: Iterable[bytes], size: int) -> list[str]:
    """A digest of what is chosen from each `size` files, at various rates, of various channels, on various basses."""
    found = [
        json.dumps(chosen(data, RATES[k % len(RATES)], CHANNELS[k % len(CHANNELS)], BASSES[k % len(BASSES)]))
        for k, data in enumerate(files)
    ]
    return digests_of(found, size)
