"""Tells how well the notes of a bass can be told from those of real basses, and by which figures first.

A logistic regression over the figures of notes learns to tell the bass from all real basses but one, on every second
pitch of the bass; then it orders the remaining notes of the bass and the notes of that one real bass. AUC is the
probability that it tells which of two notes, one of the bass and one real, is the bass's: 0.5 for chance, 1 for
certainty, on average over the real basses, each left out in turn. Real basses among each other give the scale.

Real basses are those whose figures are shipped (groups.py) and the recordings that are given. A bass is compared with
real ones played with the same technique if there are at least four, otherwise with all. For rendered basses
transfer.py adds what a classifier that never heard them makes of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from livebass.lab.comparison.classifier import auc, standard, train_groups
from livebass.lab.comparison.groups import FIGURES, WITHOUT, Group, families, group, same_notes, with_given
from livebass.lab.comparison.notes import Note, key_of
from livebass.lab.comparison.rows import ROWS
from livebass.lab.comparison.summary import Bass
from livebass.lab.comparison.transfer import Transfer, other_presets, play_others, transfer
from livebass.preset.load import preset_names
from livebass.report.progress import Progress, Say, silent, steps
from livebass.report.text import json_text
from livebass.rows.arrays import Floats

ALIKE = 4  # real basses with the same technique, needed to be compared with them alone
SHOWN = 6  # figures
KEYS, DYNAMICS = (28, 31, 33, 36, 39, 42, 45, 48), 4  # of the notes that a preset plays


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
    own: str = ""  # its own technique
    alike: int = 0  # real basses played with it
    transfer: Transfer | None = None  # None: not rendered

    def text(self) -> str:
        """Returns lines that say it."""
        few = f", of all techniques ({self.alike} played with {self.own}: too few; {ALIKE} are needed)"
        played = f" played with {self.technique}" if self.technique else few
        lines = [f"{self.name}: beside {self.among} real basses{played}", f"  {'AUC':10s} it    a real bass"]
        for name, value in self.auc.items():
            real = sorted(self.real[name])
            lines.append(f"  {name:10s} {value:.2f}  {real[0]:.2f} to {real[-1]:.2f}, median {np.median(real):.2f}")
        lines += self.transfer.lines() if self.transfer else []
        return "\n".join([*lines, "  first by, each alone:", *(f"    {sign}" for sign in self.signs)])

    def json(self) -> dict[str, Any]:
        """Returns it for JSON."""
        return {
            "name": self.name, "technique": self.technique or None, "real_basses": self.among, "auc": self.auc,
            "real_auc": self.real, "transfer": self.transfer and self.transfer.json(),
            "signs": [vars(sign) for sign in self.signs],
        }  # fmt: skip


def tell(bass: Group, real: Sequence[Group] | None = None) -> Distinction:
    """Returns how well a bass can be told from the real ones; its own recordings are left out of these."""
    others = tuple(g for g in real or with_given(()) if not same_notes(bass, g))
    alike = tuple(g for g in others if g.technique == bass.technique)
    enough = len(families(alike)) >= ALIKE
    among = alike if enough else others
    found = {name: _auc_of(bass, among, name) for name in WITHOUT}
    scale = {name: _scale(among, name) for name in WITHOUT}
    return Distinction(bass.name, found, scale, _signs(bass, among), len(families(among)),
                bass.technique if enough else "", bass.technique, len(families(alike)))  # fmt: skip


@lru_cache(8 * len(WITHOUT))
def _scale(among: tuple[Group, ...], without: str) -> list[float]:
    """Returns the AUC of each of some real groups among the others of them."""
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


def telling(
    basses: Sequence[Bass], progress: Progress | None = None, quality: str = "studio", say: Say = silent,
    transferred: bool = True,
) -> Telling:  # fmt: skip
    """Returns how well each of some basses can be told from real ones, tracked by `progress`.

    The real ones among them count as such beside the shipped ones. If one is rendered, the shipped presets play the
    same pitches in `quality`, in parallel, for the transfer AUC, which takes minutes; not without `transferred`.
    """
    rendered = [bass for bass in basses if bass.rendered and transferred]
    names = [name for name in other_presets() if name not in {bass.name for bass in rendered}] if rendered else []
    step = steps(progress, 2 * len(basses) + len(names))
    groups = []
    for bass in basses:
        groups.append(group(bass))
        step()
    real = with_given([each for bass, each in zip(basses, groups, strict=True) if not bass.rendered])
    shipped = set(preset_names())
    others = [each for bass, each in zip(basses, groups, strict=True) if bass in rendered and bass.name in shipped]
    if rendered:
        keys = sorted({key_of(note) for bass in rendered for note in bass.notes})
        others += play_others(names, keys, max(len(bass.ranks) for bass in rendered), quality, say, step)
    found = []
    for bass, each in zip(basses, groups, strict=True):
        told = tell(each, real)
        if bass in rendered:
            told = replace(told, transfer=transfer(each, [o for o in others if o.bass != bass.name], real))
        found.append(told)
        step()
    return Telling(tuple(found))


def _auc_of(bass: Group, among: Sequence[Group], without: str) -> float:
    """Returns the AUC of a bass, each real one left out in turn."""
    own, *others = standard([g.figures for g in (bass, *among)], without)
    by_bass: dict[str, list[Floats]] = {}
    for each, rows in zip(among, others, strict=True):
        by_bass.setdefault(each.bass, []).append(rows)
    real = {name: np.concatenate(rows) for name, rows in by_bass.items()}
    half = np.unique(np.round(12 * np.log2(bass.pitch)), return_inverse=True)[1] % 2
    found = []
    for left in real:
        learnt = [rows for name, rows in real.items() if name != left]
        for k in (0, 1):
            beta = train_groups([own[half == k]], learnt)
            found.append(auc(own[half != k] @ beta, real[left] @ beta))
    return float(np.mean(found))


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
            row, mean = rows[key], float(np.mean([auc(own, x) for x in others]))
            middle, *medians = (float(np.median(x)) for x in (own, *others))
            title = row.title.strip().replace(" of stopped notes,", ",")
            values = (row.shown(value) for value in (middle, min(medians), max(medians)))
            found.append(Sign(title, row.unit, max(mean, 1 - mean), *values))
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
