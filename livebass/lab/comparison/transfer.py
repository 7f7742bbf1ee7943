"""The transfer AUC: can a preset be told by what all other presets share and no real bass has?

A classifier learns on the other shipped presets against all families of real basses but one. Then it orders the notes
of a preset and of that family; it has heard neither of them. AUC is the probability that it tells which of two notes
is the preset's, on average over the families, each left out in turn. Pitches are alike on both sides: real notes count
if the preset plays a pitch within a semitone, and every pitch weighs the same for rendered notes as for real ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from livebass.engine.engine import Engine
from livebass.lab.comparison.classifier import auc, standard, train
from livebass.lab.comparison.groups import FIGURES, WITHOUT, Group, families, note_row
from livebass.lab.comparison.notes import RATE, Note, own_technique, play_alone, spread_velocities, strings_of_key
from livebass.lab.experiment.workers import lasting
from livebass.model.instrument import note_frequency
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset, preset_names
from livebass.report.progress import Say
from livebass.rows.arrays import Floats, Ints
from livebass.system.cores import core_count

SAME_BASS = ("drop-d", "five-string", "six-string")  # jazz-finger with other strings
FAMILIES = 3  # of real basses: two to learn, and one to be asked
ALIKE = 2  # families with the technique of the preset, needed to ask beside them alone
NEAR = 1  # semitone between pitches that count as alike


@dataclass(frozen=True)
class Played:
    """One note of a shipped preset to be measured, as a task of a worker."""

    preset: str
    key: int  # MIDI
    velocity: int
    quality: str
    seed: int

    @property
    def name(self) -> str:
        """For messages."""
        return f"{self.preset} {self.key} v{self.velocity}"

    @property
    def work(self) -> Played:
        """Itself: a worker solves it."""
        return self

    @property
    def digest(self) -> str:
        """Of everything the note depends on, apart from the program."""
        return repr(self)

    def solve(self) -> dict[str, float]:
        """The FIGURES of the note."""
        engine = _engine(self.preset, self.quality)
        sound, _ = play_alone(engine.another(self.seed), self.key, self.velocity)
        return dict(zip(FIGURES, note_row(Note(self.name, sound, RATE, note_frequency(self.key))), strict=True))


@lru_cache(1)
def _engine(preset: str, quality: str) -> Engine:
    return Engine(load_preset(preset), QUALITIES[quality], RATE, workers=1)


def measure_played(work: Played) -> dict[str, float]:
    """The figures of a note, in any process."""
    return work.solve()


def other_presets() -> list[str]:
    """Returns the names of the shipped presets that a classifier learns: each bass once, as pickups hear it."""
    return [
        name for name in preset_names() if name not in SAME_BASS and load_preset(name).output.kind == "pickups"
    ]  # fmt: skip


def play_others(
    names: Sequence[str], keys: Sequence[int], dynamics: int, quality: str, say: Say, done: Callable[[], None]
) -> list[Group]:
    """Plays and measures notes of shipped presets in parallel, each note once; `done` is called for each preset."""
    tasks = []
    for name in names:
        bass = load_preset(name)
        for key in (k for k in keys if strings_of_key(bass, k)):
            tasks += [Played(name, key, v, quality, key) for v in spread_velocities(dynamics)]
    rows: dict[str, list[tuple[Played, Floats]]] = {name: [] for name in names}
    left = {name: sum(task.preset == name for task in tasks) for name in names}
    with lasting(core_count(), measure_played, say) as compute, closing(compute(tasks)) as results:
        for task, figures in results:
            rows[task.preset].append((task, np.array([figures[key] for key in FIGURES])))
            left[task.preset] -= 1
            if not left[task.preset]:
                done()
    return list(_groups(rows))


def _groups(rows: dict[str, list[tuple[Played, Floats]]]) -> Iterator[Group]:
    for name, found in rows.items():
        found.sort(key=lambda pair: (pair[0].key, pair[0].velocity))  # in whatever order they came
        if found:
            pitch = np.array([note_frequency(task.key) for task, _ in found])
            yield Group(name, name, own_technique(load_preset(name)), pitch, np.array([row for _, row in found]))


@dataclass(frozen=True)
class Transfer:
    """How well a preset is told by what other presets share."""

    auc: dict[str, float]  # by name of WITHOUT; {}: too few families
    presets: int  # learnt
    families: tuple[str, ...]  # asked
    technique: str  # of these; "" for all
    needed: str = ""  # why there is no AUC, or is none beside the technique alone

    def json(self) -> dict[str, Any]:
        """Returns it for JSON."""
        return {
            "auc": self.auc or None, "presets": self.presets, "families": self.families,
            "technique": self.technique or None, "needed": self.needed or None,
        }  # fmt: skip

    def lines(self) -> list[str]:
        """Returns lines that say it."""
        if not self.auc:
            return [f"  transfer AUC: {self.needed}"]
        played = f" played with {self.technique}" if self.technique else ", of all techniques"
        count = len(self.families)
        found = ", ".join(f"{name} {value:.2f}" for name, value in self.auc.items())
        first = f"  transfer AUC, learnt on {self.presets} other presets, beside {count} families{played}:"
        return [first, f"    {found}", *([f"    {self.needed}"] if self.needed else [])]


def transfer(bass: Group, others: Sequence[Group], real: Sequence[Group]) -> Transfer:
    """Returns the transfer AUC of a bass; `others` are rendered basses to learn, without `bass` itself."""
    pitches = np.unique(bass.keys)
    near = {name: cut for name, each in families(real).items() if (cut := _near(each, pitches))}
    alike = {name: cut for name, each in near.items() if (cut := [g for g in each if g.technique == bass.technique])}
    count = f"{len(alike)} famil{'y' if len(alike) == 1 else 'ies'} of real basses"
    if len(near) < FAMILIES:
        why = f"{FAMILIES} families of real basses with its pitches are needed, not {len(near)}: give a folder for each"
        return Transfer({}, len(others), (), "", why)
    if not others:
        return Transfer({}, 0, (), "", "no other preset has its pitches")
    asked = alike if len(alike) >= ALIKE else near
    needed = "" if asked is alike else (
        f"too few: {count} played with {bass.technique}, {ALIKE} are needed to ask beside them alone"
    )  # fmt: skip
    learnt = [cut[0] for each in others if (cut := _near([each], pitches))]
    found = {name: _auc_of(bass, learnt, near, asked, name) for name in WITHOUT}
    return Transfer(found, len(learnt), tuple(asked), bass.technique if asked is alike else "", needed)


def _near(groups: Sequence[Group], pitches: Ints) -> list[Group]:
    """Returns the notes of groups within NEAR of one of some pitches, without groups that have none."""
    found = []
    for each in groups:
        inside = np.abs(each.keys[:, None] - pitches).min(axis=1) <= NEAR
        if inside.any():
            found.append(Group(each.name, each.bass, each.technique, each.pitch[inside], each.figures[inside]))
    return found


def _auc_of(
    bass: Group, learnt: Sequence[Group], real: dict[str, list[Group]], asked: dict[str, list[Group]], without: str
) -> float:
    """Returns the mean AUC over the families asked."""
    groups = [bass, *learnt, *(g for each in real.values() for g in each)]
    rows = dict(zip((id(g) for g in groups), standard([g.figures for g in groups], without), strict=True))
    pitches = np.unique(bass.keys)
    found = []
    for left in asked:
        sides = [[[g] for g in learnt], [each for name, each in real.items() if name != left]]
        places = [[_places(each, pitches) for each in side] for side in sides]
        shares = np.mean([_share(at, pitches.size) for at in places[1]], axis=0)
        weights = [
            *(_matched(at, shares) / len(places[0]) for at in places[0]),
            *(np.full(at.size, 1 / at.size / len(places[1])) for at in places[1]),
        ]
        together = np.concatenate([rows[id(g)] for side in sides for each in side for g in each])
        mine = np.arange(len(together)) < sum(at.size for at in places[0])
        beta = train(together, mine, np.concatenate(weights) / 2)
        theirs = np.concatenate([rows[id(g)] for g in asked[left]])
        at = _places(asked[left], pitches)
        own = _matched(_places([bass], pitches), _share(at, pitches.size))
        found.append(auc(rows[id(bass)] @ beta, theirs @ beta, own))
    return float(np.mean(found))


def _places(groups: Sequence[Group], pitches: Ints) -> Ints:
    """Returns the index of the nearest pitch of each note of groups."""
    return np.concatenate([np.abs(g.keys[:, None] - pitches).argmin(axis=1) for g in groups])


def _share(places: Ints, count: int) -> Floats:
    """Returns the part of notes at each of `count` pitches."""
    return np.bincount(places, minlength=count) / places.size


def _matched(places: Ints, shares: Floats) -> Floats:
    """Returns weights of notes with which each pitch has its share of 1; pitches they lack go to the others."""
    own = np.bincount(places, minlength=shares.size)
    weight = (shares / np.maximum(own, 1))[places]
    total = float(weight.sum())
    return weight / total if total > 0 else np.full(places.size, 1 / places.size)
