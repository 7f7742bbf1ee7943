"""Divides the notes: every fourth is held out, up to nine of the rest are fitted, and the others judge."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from livebass.lab.fitting.notes import Place

FITTED = 9  # notes
LAYERS = 4  # of them, at most
EVERY = 4  # a note is held out
JUDGES = 24  # notes


class Plan(NamedTuple):
    """Places to fit and places that judge: no place is in both."""

    fitted: tuple[Place, ...]
    judges: tuple[Place, ...]


def plan(places: Iterable[Place]) -> Plan:
    """Chooses up to FITTED places and the judges among all others.

    As pitches rise, the layers take turns: few notes tell many pitches and strings.
    """
    every = sorted(places)
    kinds = sorted({(p.key, p.string) for p in every})
    held = {p for p in every if (kinds.index((p.key, p.string)) + p.rank) % EVERY == EVERY - 1} or {every[-2]}
    free = [p for p in every if p not in held]
    ranks = sorted({p.rank for p in free})
    chosen = [ranks[k] for k in sorted({round(x) for x in np.linspace(0, len(ranks) - 1, min(LAYERS, len(ranks)))})]
    able = [p for p in free if p.rank in chosen]
    fitted: list[Place] = []
    for k in range(min(FITTED, len(able))):
        left = [p for p in able if p not in fitted]
        alike = [p for p in left if p.rank == chosen[k % len(chosen)]]
        at = (k + 0.5) * len(kinds) / FITTED - 0.5
        heard = Counter((p.key, p.string) for p in fitted)
        found = [(heard[p.key, p.string], abs(kinds.index((p.key, p.string)) - at), p) for p in alike or left]
        fitted.append(min(found)[2])
    rest = [p for p in every if p not in fitted]
    return Plan(tuple(sorted(fitted, key=lambda p: (p.rank, p))), tuple(_spread_out(rest, JUDGES)))


def _spread_out(places: list[Place], count: int) -> list[Place]:
    """Up to `count` places, spread over all."""
    if len(places) <= count:
        return places
    return [places[int((k + 0.5) * len(places) / count)] for k in range(count)]
