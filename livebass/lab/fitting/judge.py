"""Judges presets on notes that no search heard: distances to them, and rows, beside the scale of the bass itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from livebass.lab.comparison.notes import Note, key_of
from livebass.lab.fitting.notes import Place
from livebass.lab.fitting.problem import Problem
from livebass.lab.fitting.target import Difference, Heard, apart, measure_note, when

QUALITY = "studio"
SEEDS = (11, 77)  # of the player
SECONDS = 3.0  # s of a note, for ears
DISTANCES = ((0.5, False), (1.0, False), (1.0, True))  # s; True: with the level of each band free


@dataclass(frozen=True)
class Judged:
    """One bass against the recorded notes; distances in dB, medians over the notes."""

    name: str
    half: float  # over 0.5 s
    distance: float  # over 1 s
    equalized: float  # over 1 s, with the level of each band free
    each: tuple[float, ...]  # over 1 s, for each place; NaN without
    rows: float = math.nan  # mean difference of the rows, in spreads
    inside: float = math.nan  # part of the rows within one spread
    off: tuple[tuple[str, int, Difference], ...] = ()  # the rows, by key and layer, the farthest first
    notes: tuple[Note, ...] = ()  # to hear, one for each place


def hear(
    takes: Mapping[Place, Sequence[Note]], places: Sequence[Place], only: frozenset[str] = frozenset()
) -> dict[Place, tuple[Heard, ...]]:
    """Measures all takes of some places; `only` some figures."""
    return {p: tuple(measure_note(n.sound, n.rate, n.pitch, only) for n in takes[p]) for p in places}


def judge_preset(
    name: str, problem: Problem, values: Sequence[float], theirs: Mapping[Place, tuple[Heard, ...]],
    step: Callable[[], None] = lambda: None,
) -> Judged:  # fmt: skip
    """Judges the preset with these values, played by two uneven players in `studio`."""
    places = sorted(theirs)
    found: list[dict[Place, Heard]] = []
    notes: dict[Place, Note] = {}
    for seed in SEEDS:
        played = {}
        for place in places:
            notes_of = problem.play(values, [place], QUALITY, SECONDS, seed, even=False)
            played[place] = notes_of[place]
            step()
        notes = notes or played
        found.append({p: measure_note(n.sound, n.rate, n.pitch) for p, n in played.items()})
    (one, rows), *_ = [problem.compare(ours, theirs) for ours in found]
    off = sorted(((key, rank, d) for (key, rank), d in rows.items()), key=lambda x: -abs(x[2].spreads))
    return replace(
        _sum_up(name, theirs, {p: [ours[p] for ours in found] for p in places}, np.mean),
        rows=one.rows, inside=float(np.mean([abs(d.spreads) < 1 for _, _, d in off])), off=tuple(off),
        notes=tuple(notes.values()),
    )  # fmt: skip


def own_takes(theirs: Mapping[Place, tuple[Heard, ...]]) -> Judged | None:
    """The distance of two takes of the recorded bass; None if each note has a single take."""
    twice = {p: takes for p, takes in theirs.items() if len(takes) > 1}
    first, second = ({p: takes[k : k + 1] for p, takes in twice.items()} for k in (0, 1))
    return _sum_up("your own second take", first, second, np.mean) if twice else None


def other_bass(name: str, notes: Sequence[Note], layers: int, theirs: Mapping[Place, tuple[Heard, ...]]) -> Judged:
    """The distance of another recorded bass: of its nearest notes as hard, within a semitone."""
    count = 1 + max((n.rank for n in notes), default=0)
    near: dict[Place, list[Heard]] = {}
    for note in notes:
        alike = [p for p in theirs if abs(p.key - key_of(note)) <= 1 and when(p.rank, layers) == when(note.rank, count)]
        if alike and note.sound.size > 1.2 * note.rate:
            measured = measure_note(note.sound, note.rate, note.pitch, frozenset({"level"}))
            for place in alike:
                near.setdefault(place, []).append(measured)
    return _sum_up(name, theirs, near, np.min)


def _sum_up(
    name: str, theirs: Mapping[Place, Sequence[Heard]], others: Mapping[Place, Sequence[Heard]],
    joined: Callable[[list[float]], Any],
) -> Judged:  # fmt: skip
    """Medians of the distances, each `joined` over the other notes of a place."""
    each = [
        [
            float(joined([apart(theirs[p], o, seconds, equalized) for o in others[p]])) if others.get(p) else math.nan
            for seconds, equalized in DISTANCES
        ]
        for p in sorted(theirs)
    ]
    valid = np.array([row for row in each if not any(map(math.isnan, row))]).reshape(-1, len(DISTANCES))
    half, distance, equalized = np.median(valid, axis=0) if valid.size else [math.nan] * len(DISTANCES)
    return Judged(name, float(half), float(distance), float(equalized), tuple(row[1] for row in each))
