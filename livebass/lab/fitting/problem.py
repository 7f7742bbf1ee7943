"""The problem of a fit: the recorded notes, the base preset and its free numbers. Its trials play and compare."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from livebass.engine.engine import Engine
from livebass.lab.comparison.notes import Note, spread_velocities
from livebass.lab.experiment.grid import program
from livebass.lab.fitting import target
from livebass.lab.fitting.bounds import HARDEST, STEP, Free, Tables, own_tables, round_digits
from livebass.lab.fitting.notes import Place, string_of
from livebass.lab.fitting.playing import DEFAULT_RATE, play_note, velocity_of
from livebass.model.instrument import Instrument, note_frequency
from livebass.model.keymap import velocity_parts
from livebass.model.quality import QUALITIES
from livebass.preset.build import Builder
from livebass.preset.like import whole

HOPELESS = 9.0  # the score of a bass that cannot be built or sounds nothing
OVER = 1.1  # force at velocity 127 over that of the hardest layer
PRIOR = 0.02  # weight of the priors in a score
DIGITS = 9  # of a score: what sums over several threads may round differently does not count
SEED = 11  # of the player


@dataclass(frozen=True, eq=False)
class Problem:
    """The notes of a fit and the bass to be changed."""

    label: str  # of the base preset
    base: Tables
    technique: str
    layers: int
    theirs: Mapping[Place, tuple[target.Heard, ...]]  # the notes to fit
    free: tuple[Free, ...] = ()
    fixed: Tables = field(default_factory=dict)  # more keys of the new preset
    normalized: bool = False

    @cached_property
    def bass(self) -> Instrument:
        """The base preset's bass. Raises PresetError."""
        return Builder(self.label).instrument(self.base)

    @cached_property
    def digest(self) -> str:
        """Of all that a score depends on, apart from the values and the program."""
        made = hashlib.sha256(repr((self.label, self.base, self.technique, self.layers, self.free, self.fixed,
                                    self.normalized)).encode())  # fmt: skip
        for place, takes in sorted(self.theirs.items()):
            made.update(repr((*place, [sorted(take.figures.items()) for take in takes])).encode())
            for take in takes:
                made.update(take.shape.tobytes())
        return made.hexdigest()

    @property
    def ranks(self) -> list[int]:
        """The layers that are fitted."""
        return sorted({p.rank for p in self.theirs})

    def start(self) -> list[float]:
        """The values of the base preset's own numbers on the scale from 0 to 1; steps of force: 0.3."""
        return [0.3 if f.section == STEP else f.on_scale(f.read(self.bass)) for f in self.free]

    def own(self, values: Sequence[float]) -> Tables:
        """The keys of the new preset for values of the free numbers in their units."""
        own = own_tables(self.bass, self.free, values, self.fixed)
        steps = self._steps(values)
        if steps and not self.normalized and "hardest" in own.get("player", {}):
            # the softest layer keeps its usual velocity: the preset has the dynamics of the recorded hand
            part = velocity_parts(self.bass.player.velocity_curve)[spread_velocities(self.layers)[self.ranks[0]]]
            span = (sum(steps) + 20 * math.log10(OVER)) / (1 - part)
            own["player"]["softest"] = round_digits(own["player"]["hardest"] * 10 ** (-span / 20))
        return own

    def _steps(self, values: Sequence[float]) -> list[float]:
        """The steps of force from each fitted layer to the next, dB."""
        return [v for f, v in zip(self.free, values, strict=True) if f.section == STEP]

    def tables(self, values: Sequence[float]) -> Tables:
        """The whole preset for `values`."""
        return whole(self.label, {**self.own(values), "like": "base"}, lambda _: (self.label, self.base))

    def velocities(self, bass: Instrument, values: Sequence[float]) -> list[int]:
        """The velocity of each layer, from soft to hard."""
        steps = self._steps(values)
        if not any(f.key == HARDEST.key for f in self.free):
            return spread_velocities(self.layers)
        hardest = bass.player.hardest / OVER
        if not steps:
            return [velocity_of(bass.player, hardest)] * self.layers
        levels = np.append(-np.cumsum(steps[::-1])[::-1], 0.0)  # dB of the fitted layers re the hardest of them
        all_levels = np.interp(range(self.layers), self.ranks, levels)
        return [velocity_of(bass.player, hardest * 10 ** (x / 20)) for x in all_levels]

    def forces(self, velocities: Sequence[int]) -> list[float]:
        """The force of each fitted layer of the base preset, dB, if its layers have these velocities."""
        player = self.bass.player
        parts = velocity_parts(player.velocity_curve)
        span = 20 * math.log10(player.hardest / max(player.softest, 1e-3))
        return [span * parts[velocities[rank]] for rank in self.ranks]

    def play(
        self, values: Sequence[float], places: Sequence[Place], quality: str = "live",
        seconds: float = target.LEAD + target.SECONDS, seed: int = SEED, even: bool = True,
    ) -> dict[Place, Note]:  # fmt: skip
        """Notes at places, in order, without the player's unevenness if `even`. Raises ValueError for a bad bass."""
        bass = Builder(self.label).instrument(self.tables(values))
        if even:
            bass = replace(bass, player=replace(bass.player, unevenness=0.0))
        velocities = self.velocities(bass, values)
        engine = Engine(bass, QUALITIES[quality], DEFAULT_RATE, seed, workers=1)
        made = {}
        for place in places:
            string = string_of(bass, place)
            if string is None:
                raise ValueError(f"{self.label}: has no string for {place}")
            velocity = velocities[place.rank]
            sound = play_note(engine.another(seed + place.key), string, place.key, velocity, seconds + 0.05)
            name = f"{bass.name} {place.key} v{velocity}"
            made[place] = Note(
                name, sound, DEFAULT_RATE, note_frequency(place.key), self.technique, dynamic=f"v{velocity}",
                rank=place.rank,
            )  # fmt: skip
        return made

    def compare(
        self, ours: Mapping[Place, target.Heard], theirs: Mapping[Place, Sequence[target.Heard]] | None = None
    ) -> tuple[target.Score, dict[tuple[str, int], target.Difference]]:
        """The score of played notes, without priors, and the difference of each row."""
        wanted = theirs or self.theirs
        rows = target.differences(wanted, ours, self.technique, self.layers)
        if not self.normalized and len({p.rank for p in ours}) > 1:
            rows |= target.level_differences(wanted, ours)
        return target.score(wanted, ours, rows), rows

    def solve(self, scaled: Sequence[float]) -> dict[str, float]:
        """The score and its parts at places on the scale from 0 to 1; HOPELESS for a bass that cannot be."""
        values = [f.value(u) for f, u in zip(self.free, scaled, strict=True)]
        try:
            notes = self.play(values, sorted(self.theirs))
            only = target.searched_figures(self.technique)
            found, _ = self.compare({p: target.measure_note(n.sound, n.rate, n.pitch, only) for p, n in notes.items()})
        except ValueError:  # beyond what a preset may be, or silent
            return {"score": HOPELESS, "rows": math.nan, "distance": math.nan, "equalized": math.nan}
        away = [
            ((u - begin) / f.prior) ** 2
            for f, u, begin in zip(self.free, scaled, self.start(), strict=True)
            if f.section != STEP
        ]
        total = found.total + PRIOR * sum(away)
        parts = {"score": total, "rows": found.rows, "distance": found.distance, "equalized": found.equalized}
        return {name: round(value, DIGITS) for name, value in parts.items()}


@dataclass(frozen=True, eq=False)
class Trial:
    """One evaluation of a problem, as a point of a sweep."""

    problem: Problem
    scaled: tuple[float, ...]
    name: str

    @property
    def work(self) -> Trial:
        """Itself: a worker solves it."""
        return self

    @cached_property
    def digest(self) -> str:
        """Of everything that the result depends on."""
        return digest_of(self.problem.digest, repr(self.scaled))

    def solve(self) -> dict[str, float]:
        """The score and its parts."""
        return self.problem.solve(self.scaled)


def digest_of(*inputs: str) -> str:
    """The name of the point of a task, which depends on the program and on all of `inputs`."""
    return hashlib.sha256("\n".join((program(), *inputs)).encode()).hexdigest()[:32]


def solve_task(work: Any) -> dict[str, float]:
    """The result of a task, in any process."""
    found: dict[str, float] = work.solve()
    return found
