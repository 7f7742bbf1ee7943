"""The figures of notes, by bass: those of real basses that are shipped, and of notes that are measured.

The figures of real notes stand in notes.csv, which tools/real_notes.py makes from recordings in the public domain.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from livebass.lab.comparison.measures import (
    BAND_KEYS,
    FLOOR_KEYS,
    GLIDE_EACH,
    HIGH_KEYS,
    NOISE_KEYS,
    ORDER,
    SHARE_KEYS,
    measure,
)
from livebass.lab.comparison.notes import Note, key_of
from livebass.lab.comparison.summary import Bass
from livebass.rows.arrays import Floats, Ints

LONGEST = 3.2  # s of a note, as the recordings
# They depend on the recording, or follow from other figures
LEFT_OUT = {"peak", "level", "between_level", "fall_time", "growth", *GLIDE_EACH, *FLOOR_KEYS}
FIGURES = tuple(key for key in ORDER if key not in LEFT_OUT)
TIMBRE = {
    "centroid_20",
    "centroid_100",
    "centroid_fall",
    "snap",
    "thump",
    *BAND_KEYS,
    *HIGH_KEYS,
    *SHARE_KEYS,
}
NOISE = {"between_50ms", "lines", "hiss", *NOISE_KEYS}
WITHOUT: dict[str, set[str]] = {"all": set(), "no timbre": TIMBRE, "no noise": NOISE}
FEWEST, PITCHES = 8, 2  # notes, and pitches, needed
EQUAL = 0.9  # of the figures of a note: it is the same recording


@dataclass(frozen=True, eq=False)
class Group:
    """The figures of notes of one bass."""

    name: str  # of the set of recordings
    bass: str  # the instrument, without its strings
    technique: str
    pitch: Floats  # Hz, (n,)
    figures: Floats  # (n, FIGURES), NaN where a note does not show one

    @property
    def keys(self) -> Ints:
        """The MIDI number of the nearest key of each note, (n,)."""
        return np.round(69 + 12 * np.log2(self.pitch / 440)).astype(np.int64)


@cache
def real() -> tuple[Group, ...]:
    """Returns the shipped figures of real notes, a group for each set of recordings."""
    lines = list(csv.DictReader(files("livebass.lab.comparison").joinpath("notes.csv").read_text("utf-8").splitlines()))
    groups = []
    for name in dict.fromkeys(line["set"] for line in lines):
        own = [line for line in lines if line["set"] == name]
        values = np.array([[float(line[key] or "nan") for key in FIGURES] for line in own])
        pitch = np.array([float(line["pitch"]) for line in own])
        groups.append(Group(name, own[0]["bass"].partition(",")[0], own[0]["technique"], pitch, values))
    return tuple(groups)


def note_row(note: Note) -> list[float]:
    """Returns the FIGURES of a note, NaN where it does not show one."""
    length = round(LONGEST * note.rate)
    found = note.measures if note.sound.size <= length else measure(note.sound[:length], note.rate, note.pitch, FIGURES)
    return [found[key] for key in FIGURES]


def group(bass: Bass) -> Group:
    """Returns the figures of the notes of a bass; ValueError if they are too few."""
    notes, pitches = bass.notes, {key_of(n) for n in bass.notes}
    if len(notes) < FEWEST or len(pitches) < PITCHES:
        has = f"{len(notes)} note{'s' * (len(notes) != 1)} of {len(pitches)} pitch{'es' * (len(pitches) != 1)}"
        raise ValueError(f"--tell: {bass.title} has {has}; at least {FEWEST} notes of {PITCHES} pitches are needed")
    rows = np.array([note_row(n) for n in notes])
    return Group(bass.title, bass.name, bass.technique, np.array([n.pitch for n in notes]), rows)


def with_given(given: Sequence[Group]) -> tuple[Group, ...]:
    """Returns the shipped real groups and those given; a shipped one whose notes are given, too, counts once."""
    return (*(each for each in real() if not any(same_notes(each, other) for other in given)), *given)


def families(groups: Sequence[Group]) -> dict[str, list[Group]]:
    """Returns groups by their instrument."""
    found: dict[str, list[Group]] = {}
    for each in groups:
        found.setdefault(each.bass, []).append(each)
    return found


def same_notes(bass: Group, other: Group) -> bool:
    """Returns whether one of the notes of a bass is a note of another."""
    with np.errstate(invalid="ignore"):
        close = np.isclose(bass.figures[:, None], other.figures, rtol=2e-3, atol=2e-3)
    known = np.isfinite(bass.figures[:, None] + other.figures).sum(axis=2)
    return bool((close.sum(axis=2) > EQUAL * np.maximum(known, 10)).any())
