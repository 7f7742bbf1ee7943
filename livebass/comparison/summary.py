"""Brings the figures of many notes together: medians by dynamic."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from livebass.comparison.notes import Note


def summary(notes: Sequence[Note]) -> dict[str, dict[str, float]]:
    """Returns the median of every figure by dynamic, over the plucked notes of one technique of one bass.

    Keys are the names of the dynamics, and besides "soft" for the softest and "hard" for the hardest, which are the
    same where there is one. A figure that no note tells is NaN.
    """
    by_rank: dict[int, list[Note]] = defaultdict(list)
    for note in notes:
        if note.kind == "note":
            by_rank[note.rank].append(note)
    found: dict[str, dict[str, float]] = {}
    for rank in sorted(by_rank):
        found[by_rank[rank][0].dynamic] = medians(by_rank[rank])
    if found:
        names = list(found)
        found.setdefault("soft", found[names[0]])
        found.setdefault("hard", found[names[-1]])
    return found


def medians(notes: Sequence[Note]) -> dict[str, float]:
    """Returns the median of every figure over notes that tell it; NaN for one that none tells."""
    found = {}
    for key in notes[0].measures:
        values = [value for note in notes if not math.isnan(value := note.measures[key])]
        found[key] = float(np.median(values)) if values else math.nan
    return found
