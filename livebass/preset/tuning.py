"""The keys of a preset that say how its bass is tuned: the strings' notes, the A, a temperament, a capo."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from livebass.model.instrument import A4_HZ, A4_NOTE
from livebass.units import cents, note_name, note_number, quantity

TUNING_KEYS = ("tuning", "capo", "a4", "temperament")
LOWEST_A4, HIGHEST_A4 = 380.0, 480.0  # Hz
MOST_DOWN, MOST_UP = 5, 7  # semitones from the note of a string's file: beyond, it flaps or breaks
NOTES = 12  # of a temperament
_B0, _E1 = 23, 28

# Semitones by which every string is tuned higher; the open note of one that is tuned lower still, and by how many
NAMED: dict[str, tuple[int, int | None, int]] = {
    "standard": (0, None, 0),
    "half-step-down": (-1, None, 0),
    "whole-step-down": (-2, None, 0),
    "drop-d": (0, _E1, 2),
    "drop-db": (-1, _E1, 2),
    "drop-c": (-2, _E1, 2),
    "drop-a": (0, _B0, 2),
    "bead": (-5, None, 0),
    "tenor": (5, None, 0),
}
EXAMPLE = 'notes from the lowest string on, such as "D1 A1 D2 G2"'
ALLOWED = f'{EXAMPLE}, MIDI numbers or "41.2 Hz"; or {", ".join(NAMED)}'

Tuning = (
    str | tuple[int | float, ...]
)  # a name of NAMED, or of each string a MIDI number (int) or a pitch in Hz (float)


def tuning_of(raw: Any) -> Tuning:
    """The value of `tuning` in a file or on the command line. Raises ValueError, which says what is allowed."""
    if isinstance(raw, str):
        name = re.sub(r"[\s_]+", "-", raw.strip().lower())
        if name in NAMED:
            return name
        raw = re.sub(r"\s+(?=k?Hz\b)", "", raw, flags=re.IGNORECASE).replace(",", " ").split()
    if not isinstance(raw, list | tuple) or not raw:
        raise ValueError(f"allowed: {ALLOWED}")
    try:
        return tuple(_pitch(item) for item in raw)
    except ValueError:
        raise ValueError(f"allowed: {ALLOWED}") from None


def _pitch(item: Any) -> int | float:
    if isinstance(item, str) and item.lower().endswith("hz"):
        hertz = quantity(re.sub("hz$", "Hz", item, flags=re.IGNORECASE), "frequency")
        if not 5 <= hertz <= 5000:
            raise ValueError(f"{hertz} Hz")
        return hertz
    return note_number(item)


def reference_of(raw: Any) -> float:
    """The value of `a4`, Hz: 432 or "432 Hz". Raises ValueError, which says what is allowed."""
    try:
        hertz = quantity(raw, "frequency") if isinstance(raw, str) and "z" in raw else float(raw)
    except (TypeError, ValueError, OverflowError):
        hertz = math.nan
    if isinstance(raw, bool) or not LOWEST_A4 <= hertz <= HIGHEST_A4:
        raise ValueError(f"allowed: {LOWEST_A4:g} to {HIGHEST_A4:g} Hz")
    return hertz


@dataclass(frozen=True)
class OpenString:
    """How one string is tuned: its open note, and by how many cents each note is off equal temperament at A4_HZ."""

    note: int  # MIDI
    offsets: tuple[float, ...]  # (12,), C first


def open_strings(opens: Sequence[int], tuning: Tuning, a4: float, temperament: Sequence[float]) -> list[OpenString]:
    """How each string is tuned whose file has the notes `opens`.

    a4: Hz; temperament: cents, 12 from C on, one for each string, or none. Raises ValueError: the message says what
    does not fit, and begins with the key.
    """
    if len(temperament) not in (0, NOTES, len(opens)):
        why = f"{len(temperament)} values; allowed: {NOTES}, C first, or one for each of {len(opens)} strings"
        raise ValueError(f"temperament: {why}")
    if isinstance(tuning, str):
        by, dropped, further = NAMED[tuning]
        if dropped is not None and dropped not in opens:
            raise ValueError(f"tuning: this bass has no {note_name(dropped)} string")
        pitches: list[int | float] = [note + by - further * (note == dropped) for note in opens]
    else:
        pitches = list(tuning)
    if len(pitches) != len(opens):
        raise ValueError(f"tuning: {len(pitches)} notes for {len(opens)} strings")
    standard, found = cents(a4 / A4_HZ), []
    for i, pitch in enumerate(pitches):
        note, off = (pitch, 0.0) if isinstance(pitch, int) else _nearest(pitch, a4)
        if not -MOST_DOWN <= note - opens[i] <= MOST_UP:
            least, most = note_name(max(opens[i] - MOST_DOWN, 0)), note_name(min(opens[i] + MOST_UP, 127))
            name = note_name(min(max(note, 0), 127))
            raise ValueError(f"tuning: {name} on the {note_name(opens[i])} string; allowed there: {least} to {most}")
        own = tuple(temperament) if len(temperament) == NOTES else (temperament[i] if temperament else 0.0,) * NOTES
        found.append(OpenString(note, tuple(standard + off + each for each in own)))
    for low, high in pairwise(found):
        if high.note <= low.note:
            both = f"{note_name(low.note)}, {note_name(high.note)}"
            raise ValueError(f"tuning: strings go from the lowest to the highest, not {both}")
    return found


def _nearest(hertz: float, a4: float) -> tuple[int, float]:
    """The note nearest to a pitch (Hz), and by how many cents the pitch is above it."""
    number = A4_NOTE + 12 * math.log2(hertz / a4)
    return round(number), 100 * (number - round(number))
