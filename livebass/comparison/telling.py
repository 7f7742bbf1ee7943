"""Tells notes of a preset from those of real basses."""

from __future__ import annotations

import math

from livebass.comparison.measures import ORDER
from livebass.comparison.notes import Note

FIGURES = tuple(key for key in ORDER if key not in ("peak", "level", "between_level"))


def note_row(note: Note) -> list[float]:
    """Returns the figures of a note, NaN where it does not show one."""
    return [note.measures.get(key, math.nan) for key in FIGURES]
