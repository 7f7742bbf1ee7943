"""Judges presets on notes that no search heard: distances to them, and rows, beside the scale of the bass itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from livebass.comparison.notes import Note
from livebass.fitting.notes import Place, key_of
from livebass.fitting.problem import Problem
from livebass.fitting.target import Difference, Heard, apart, heard, when

QUALITY = "studio"
SEEDS = (11, 77)  # of the player
SECONDS = 3.0  # s of a note, for ears
SPANS = (0.5, 1.0)  # s of distances


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


def hear(takes: Mapping[Place, Sequence[Note]], places: Sequence[Place]) -> dict[Place, tuple[Heard, ...]]:
    """Measures all takes of some places."""
    return {p: tuple(heard(n.sound, n.rate, n.pitch) for n in takes[p]) for p in places}


def judged(
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
        found.append({p: heard(n.sound, n.rate, n.pitch) for p, n in played.items()})
    (one, rows), *_ = [problem.compared(ours, theirs) for ours in found]
    off = sorted(((key, rank, d) for (key, rank), d in rows.items()), key=lambda x: -abs(x[2].spreads))
    all_distances = [[apart(theirs[p], ours[p]) for ours in found] for p in places]
    return _summed(
        name, [[apart(theirs[p], ours[p], SPANS[0]) for ours in found] for p in places], all_distances,
        [[apart(theirs[p], ours[p], equalized=True) for ours in found] for p in places],
        rows=one.rows, inside=float(np.mean([abs(d.spreads) < 1 for _, _, d in off])), off=tuple(off),
        notes=tuple(notes.values()),
    )  # fmt: skip


def own_takes(theirs: Mapping[Place, tuple[Heard, ...]]) -> Judged | None:
    """How far two takes of the recorded bass are from each other; None if each note has one take."""
    pairs = {p: takes[:2] for p, takes in theirs.items() if len(takes) > 1}
    return _nearest("your own second take", pairs, {p: [takes[1]] for p, takes in pairs.items()}) if pairs else None


def other_bass(name: str, notes: Sequence[Note], layers: int, theirs: Mapping[Place, tuple[Heard, ...]]) -> Judged:
    """How far another recorded bass is: the nearest of its notes as hard, within a semitone."""
    count = 1 + max(n.rank for n in notes)
    near: dict[Place, list[Heard]] = {}
    for note in notes:
        alike = [p for p in theirs if abs(p.key - key_of(note)) <= 1 and when(p.rank, layers) == when(note.rank, count)]
        if alike and note.sound.size > 1.2 * note.rate:
            measured = heard(note.sound, note.rate, note.pitch, frozenset({"level"}))
            for place in alike:
                near.setdefault(place, []).append(measured)
    return _nearest(name, theirs, near)


def _nearest(name: str, theirs: Mapping[Place, tuple[Heard, ...]], others: Mapping[Place, Sequence[Heard]]) -> Judged:
    def least(place: Place, seconds: float = 1.0, equalized: bool = False) -> list[float]:
        takes = theirs[place][:1] if name.startswith("your own") else theirs[place]
        found = [apart(takes, other, seconds, equalized) for other in others.get(place, [])]
        return [min((x for x in found if not math.isnan(x)), default=math.nan)]

    places = sorted(theirs)
    return _summed(
        name, [least(p, SPANS[0]) for p in places], [least(p) for p in places],
        [least(p, equalized=True) for p in places],
    )  # fmt: skip


def _summed(
    name: str, half: list[list[float]], distance: list[list[float]], equalized: list[list[float]],
    **more: object,
) -> Judged:  # fmt: skip
    each = tuple(float(np.mean(x)) for x in distance)
    made = Judged(name, _middle(half), _middle(distance), _middle(equalized), each)
    return replace(made, **more)  # type: ignore[arg-type]


def _middle(values: list[list[float]]) -> float:
    means = [float(np.mean(x)) for x in values]
    told = [x for x in means if not math.isnan(x)]
    return float(np.median(told)) if told else math.nan
