"""Tells how well the notes of a bass can be told from those of real basses, and by which figures first.

A logistic regression over the figures of notes learns to tell the bass from all real basses but one, on every second
pitch of the bass; then it orders the remaining notes of the bass and the notes of that one real bass. AUC is the
probability that it tells which of two notes, one of the bass and one real, is the bass's: 0.5 for chance, 1 for
certainty, on average over the real basses, each left out in turn. Real basses among each other give the scale.

The figures of real notes stand in notes.csv, which tools/real_notes.py makes from recordings in the public domain. A
bass is compared with real ones played with the same technique if there are at least four, otherwise with all.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.lab.comparison.measures import (
    BAND_KEYS,
    FLOOR_KEYS,
    GLIDE_EACH,
    HIGH_KEYS,
    NOISE_KEYS,
    ORDER,
    SHARE_KEYS,
    T60_KEYS,
    measure,
)
from livebass.lab.comparison.notes import Note
from livebass.lab.comparison.rows import ROWS
from livebass.lab.comparison.summary import Bass
from livebass.report.progress import Progress, steps
from livebass.report.text import json_text
from livebass.rows.arrays import Floats
from livebass.rows.units import cents

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
WITHOUT = {"all": set[str](), "no timbre": TIMBRE, "no noise": NOISE}
RATIOS = {"drift", "wobble", "t60_scatter", "centroid_20", "centroid_100", "centroid_fall", *T60_KEYS}  # as logarithms
RIDGE = 0.1  # weight of the squared coefficients against the mean loss
CLIPPED = 4.0  # standard deviations
FEWEST, PITCHES = 8, 2  # notes, and pitches, needed
ALIKE = 4  # real basses with the same technique, needed to be compared with them alone
SHOWN = 6  # figures
KEYS, DYNAMICS = (28, 31, 33, 36, 39, 42, 45, 48), 4  # of the notes that a preset plays
EQUAL = 0.9  # of the figures of a note: it is the same recording


@dataclass(frozen=True)
class Group:
    """The figures of notes of one bass."""

    name: str  # of the set of recordings
    bass: str  # the instrument, without its strings
    technique: str
    pitch: Floats  # Hz, (n,)
    figures: Floats  # (n, FIGURES), NaN where a note does not show one


@dataclass(frozen=True)
class Sign:
    """A figure by which a bass can be told."""

    title: str
    unit: str
    auc: float  # by this figure alone
    value: str  # median of the bass
    low: str  # lowest median of a real bass
    high: str

    def __str__(self) -> str:
        return f"{self.auc:.2f}  {self.title}: {self.value} {self.unit}".rstrip() + f"; real {self.low} to {self.high}"


@dataclass(frozen=True)
class Distinction:
    """How well a bass can be told from real ones."""

    name: str
    auc: dict[str, float]  # by name of WITHOUT
    real: dict[str, list[float]]  # the same of each real bass among the others
    signs: list[Sign]  # the clearest first
    among: int  # real basses
    technique: str  # of these; "" for all

    def text(self) -> str:
        """Returns lines that say it."""
        played = f" played with {self.technique}" if self.technique else ", of all techniques"
        lines = [f"{self.name}: beside {self.among} real basses{played}", f"  {'AUC':10s} it    a real bass"]
        for name, auc in self.auc.items():
            real = sorted(self.real[name])
            lines.append(f"  {name:10s} {auc:.2f}  {real[0]:.2f} to {real[-1]:.2f}, median {np.median(real):.2f}")
        return "\n".join([*lines, "  first by, each alone:", *(f"    {sign}" for sign in self.signs)])

    def json(self) -> dict[str, Any]:
        """Returns it for JSON."""
        return {
            "name": self.name, "technique": self.technique or None, "real_basses": self.among, "auc": self.auc,
            "real_auc": self.real, "signs": [vars(sign) for sign in self.signs],
        }  # fmt: skip


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


def group(name: str, notes: Sequence[Note]) -> Group:
    """Returns the figures of notes of one technique; ValueError if they are too few."""
    pitches = {round(cents(n.pitch / 440) / 100) for n in notes}
    if len(notes) < FEWEST or len(pitches) < PITCHES:
        has = f"{len(notes)} note{'s' * (len(notes) != 1)} of {len(pitches)} pitch{'es' * (len(pitches) != 1)}"
        raise ValueError(f"--tell: {name} has {has}; at least {FEWEST} notes of {PITCHES} pitches are needed")
    rows = np.array([note_row(n) for n in notes])
    return Group(name, name, notes[0].technique, np.array([n.pitch for n in notes]), rows)


def tell(bass: Group) -> Distinction:
    """Returns how well a bass can be told from the real ones; its own recordings are left out of these."""
    others = tuple(g for g in real() if not _same(bass, g))
    alike = tuple(g for g in others if g.technique == bass.technique)
    enough = len({g.bass for g in alike}) >= ALIKE
    among = alike if enough else others
    found = {name: _auc_of(bass, among, name) for name in WITHOUT}
    scale = {name: _scale(tuple(g.name for g in among), name) for name in WITHOUT}
    return Distinction(bass.name, found, scale, _signs(bass, among), len({g.bass for g in among}),
                bass.technique if enough else "")  # fmt: skip


@cache
def _scale(names: tuple[str, ...], without: str) -> list[float]:
    """Returns the AUC of each of some real groups among the others of them."""
    among = [g for g in real() if g.name in names]
    return [_auc_of(each, [g for g in among if g.bass != each.bass], without) for each in among]


@dataclass(frozen=True)
class Telling:
    """How well basses can be told from real ones."""

    basses: tuple[Distinction, ...]

    def table(self) -> str:
        """Returns it as text."""
        return "\n\n".join(distinction.text() for distinction in self.basses)

    def json(self) -> str:
        """Returns it as JSON."""
        return json_text({"basses": [distinction.json() for distinction in self.basses]})


def telling(basses: Sequence[Bass], progress: Progress | None = None) -> Telling:
    """Returns how well each of some basses can be told from real ones, tracked by `progress`."""
    step = steps(progress, 2 * len(basses))
    groups = []
    for bass in basses:
        groups.append(group(bass.title, bass.notes))
        step()
    found = []
    for each in groups:
        found.append(tell(each))
        step()
    return Telling(tuple(found))


def _same(bass: Group, other: Group) -> bool:
    """Returns whether one of the notes of a bass is a note of another."""
    with np.errstate(invalid="ignore"):
        close = np.isclose(bass.figures[:, None], other.figures, rtol=2e-3, atol=2e-3)
    known = np.isfinite(bass.figures[:, None] + other.figures).sum(axis=2)
    return bool((close.sum(axis=2) > EQUAL * np.maximum(known, 10)).any())


def _auc_of(bass: Group, among: Sequence[Group], without: str) -> float:
    """Returns the AUC of a bass, each real one left out in turn."""
    columns = np.array([key not in WITHOUT[without] for key in FIGURES])
    own, *others = _standard([g.figures for g in (bass, *among)], columns)
    by_bass: dict[str, list[Floats]] = {}
    for each, rows in zip(among, others, strict=True):
        by_bass.setdefault(each.bass, []).append(rows)
    real = {name: np.concatenate(rows) for name, rows in by_bass.items()}
    half = np.unique(np.round(12 * np.log2(bass.pitch)), return_inverse=True)[1] % 2
    found = []
    for left in real:
        train = [rows for name, rows in real.items() if name != left]
        for k in (0, 1):
            beta = _train(own[half == k], train)
            found.append(_auc(own[half != k] @ beta, real[left] @ beta))
    return float(np.mean(found))


def _standard(groups: Sequence[Floats], columns: NDArray[np.bool_]) -> list[Floats]:
    """Returns figures of groups relative to their median and spread over all; a missing one counts as the median."""
    ratio = np.array([key in RATIOS for key in FIGURES])
    logs = [np.where(ratio, np.log(np.where(ratio, np.maximum(x, 1e-3), 1.0)), x)[:, columns] for x in groups]
    together = np.concatenate(logs)
    together[:, ~np.isfinite(together).any(axis=0)] = 0.0
    low, middle, high = np.nanpercentile(together, [16, 50, 84], axis=0)
    spread = np.where(high - low > 1e-9, (high - low) / 2, 1.0)
    return [np.clip(np.nan_to_num((x - middle) / spread), -CLIPPED, CLIPPED) for x in logs]


def _train(own: Floats, others: Sequence[Floats]) -> Floats:
    """Returns weights of figures whose sum is higher for notes like `own`, by logistic regression.

    Each real bass weighs the same, and all of them together as much as `own`.
    """
    together = np.concatenate([own, *others])
    mine = np.arange(len(together)) < len(own)
    shares = [(len(own), 1), *((len(x), len(others)) for x in others)]
    weight = np.concatenate([np.full(notes, 0.5 / notes / basses) for notes, basses in shares])
    x = np.column_stack([together, np.ones(len(together))])
    ridge = np.append(np.full(x.shape[1] - 1, RIDGE), 1e-9)
    beta = np.zeros(x.shape[1])
    for _ in range(50):  # Newton's method
        p = 1 / (1 + np.exp(-(x @ beta)))
        slope = x.T @ (weight * (p - mine)) + ridge * beta
        step = np.linalg.solve((x.T * (weight * p * (1 - p))) @ x + np.diag(ridge), slope)
        beta -= step
        if np.abs(step).max() < 1e-6:
            break
    return np.asarray(beta[:-1])


def _auc(a: Floats, b: Floats) -> float:
    """Returns the probability that one of `a` is above one of `b`; equal ones count half."""
    return float(np.mean((a[:, None] > b) + 0.5 * (a[:, None] == b)))


def _known_values(bass: Group, column: int) -> Floats:
    """Returns the values of a figure that notes show."""
    values = bass.figures[:, column]
    return values[np.isfinite(values)]


def _signs(bass: Group, among: Sequence[Group]) -> list[Sign]:
    """Returns the figures that tell a bass most clearly, one for each kind of row."""
    rows = {row.key: row for row in reversed(ROWS)}
    found = []
    for column, key in enumerate(FIGURES):
        own = _known_values(bass, column)
        others = [x for g in among if (x := _known_values(g, column)).size]
        if key in rows and 2 * own.size >= len(bass.figures) and len(others) > 1:
            row, auc = rows[key], float(np.mean([_auc(own, x) for x in others]))
            middle, *medians = (float(np.median(x)) for x in (own, *others))
            title = row.title.strip().replace(" of stopped notes,", ",")
            values = (row.shown(value) for value in (middle, min(medians), max(medians)))
            found.append(Sign(title, row.unit, max(auc, 1 - auc), *values))
    found.sort(key=lambda sign: -sign.auc)
    kinds: dict[str, Sign] = {}
    for sign in found:
        kinds.setdefault(sign.title.partition(",")[0], sign)
    return list(kinds.values())[:SHOWN]


def example() -> list[Note]:
    """Returns silent notes with the pitches and dynamics that a preset plays to be told."""
    return [
        Note("", np.zeros(1), 1, 440 * 2 ** ((key - 69) / 12), dynamic=str(rank), rank=rank)
        for key in KEYS for rank in range(DYNAMICS)
    ]  # fmt: skip
