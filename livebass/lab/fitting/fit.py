"""A fit from notes to preset: base, estimates, search, judgement."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from livebass.engine.engine import Engine
from livebass.lab.comparison.measures import attack
from livebass.lab.comparison.notes import Note, spread_velocities
from livebass.lab.comparison.rows import STRUCK
from livebass.lab.comparison.transfer import SAME_BASS
from livebass.lab.experiment.workers import Compute
from livebass.lab.fitting import estimates
from livebass.lab.fitting.bounds import STEP, Free, Tables, free_numbers, round_digits, step, string_table
from livebass.lab.fitting.judge import SEEDS, Judged, hear, judge_preset, other_bass, own_takes
from livebass.lab.fitting.notes import Place, Recorded
from livebass.lab.fitting.plan import Plan, plan
from livebass.lab.fitting.playing import DEFAULT_RATE, play_note
from livebass.lab.fitting.problem import Problem, Trial, digest_of
from livebass.lab.fitting.search import Best, Points, search
from livebass.lab.fitting.strings import with_strings
from livebass.lab.fitting.target import searched_figures
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES
from livebass.preset.build import Builder
from livebass.preset.load import preset_names, preset_tables
from livebass.preset.programs import DEFAULT
from livebass.preset.source import PresetError
from livebass.report.progress import Say, silent
from livebass.rows.units import note_name

LABORATORY = "paper"  # presets whose names begin so are heard by a sensor
VELOCITY = 90  # at which presets are equally loud
ENOUGH = 0.8  # of the notes that any preset plays
MAX_FORCE = 8.0  # dB, a step of force to begin with


@dataclass(frozen=True)
class Fit:
    """Says what to fit, and how long to search."""

    like: str | None = None  # preset to begin with, a name or path; None: the nearest shipped one
    tuning: str | None = None  # of the open strings, as for `load_preset`
    technique: str | None = None  # of all notes: "fingers", "pick" ...; None: by the file names
    beside: tuple[str | os.PathLike[str], ...] = ()  # notes of other real basses, to judge by
    seed: int = 0  # of the search
    trials: int = 600
    minutes: float = math.inf
    workers: int | None = None  # processes; None: one per core
    scheduler: str | None = None  # of a Dask cluster, instead


@dataclass(frozen=True)
class Fitted:
    """A fitted preset and what is known about it."""

    recorded: Recorded
    problem: Problem
    best: Best
    own: Tables  # the keys of the new preset
    plan: Plan
    before: Judged
    after: Judged
    own_take: Judged | None
    others: tuple[Judged, ...]
    doubts: tuple[str, ...]  # the recording's first

    @property
    def values(self) -> list[float]:
        """The free numbers, in their units."""
        return [f.value(u) for f, u in zip(self.problem.free, self.best.scaled, strict=True)]

    @property
    def sentence(self) -> str:
        """The result in one sentence."""
        said = [
            f"on {len(self.after.each)} notes that the fit never heard, the new preset is {self.after.distance:.1f} dB "
            f"from your bass",
            f"{self.problem.label} is {self.before.distance:.1f} dB from it",
        ]
        if self.own_take is not None:
            said.append(f"your own second take {self.own_take.distance:.1f} dB")
        known = [other for other in self.others if not math.isnan(other.distance)]
        if known:
            nearest = min(known, key=lambda other: other.distance)
            said.append(f"{nearest.name} {nearest.distance:.1f} dB")
        return f"{said[0][0].upper()}{said[0][1:]}; {', '.join(said[1:])} (median over 1 s)."


def fit_recorded(
    recorded: Recorded, request: Fit, others: Sequence[tuple[str, Sequence[Note]]], compute: Compute, directory: Path,
    say: Say = silent, step: Callable[[int], None] = lambda _: None,
) -> Fitted:  # fmt: skip
    """Fits a preset to recorded notes. Each trial is kept in `directory`; `compute` computes tasks by `problem.solved`.

    `others` are more real basses, by name, to judge by. `say` gets a line for each part of the work, `step` the number
    of trials done. Raises ValueError, one line.
    """
    points = Points(directory, compute, step=step)
    recorded = _on_strings(recorded, request)
    label, tables, chosen = _base(recorded, request, points, say)
    bass = Builder(label).instrument(tables)
    theirs = hear(recorded.takes, chosen.fitted, searched_figures(recorded.technique))
    first = Problem(label, tables, recorded.technique, len(recorded.layers), theirs, normalized=recorded.normalized)
    say(f"like {label}: {len(chosen.fitted)} notes are fitted, {len(chosen.judges)} judge")
    free = _free(bass, recorded, first.ranks)
    fixed, known, doubts = _estimates(recorded, first, free, points, say)
    problem = replace(first, free=tuple(free), fixed=fixed)
    best = search(problem, _begins(problem, recorded, known), points, request.seed, request.trials, request.minutes)
    values = [f.value(u) for f, u in zip(free, best.scaled, strict=True)]
    say(f"{best.trials} trials: score {best.begin['score']:.2f} -> {best.score['score']:.2f}; judging")
    held = hear(recorded.takes, chosen.judges)
    missing = len(recorded.takes) - len(estimates.places_of(recorded, bass))
    if missing:
        doubts.append(f"{missing} of {len(recorded.takes)} notes are not used: {label} has none such on its strings")
    judged = tuple(other_bass(name, notes, len(recorded.layers), held) for name, notes in others)
    before, after = judge_preset(label, first, (), held), judge_preset("the new preset", problem, values, held)
    own = problem.own(values)
    own.setdefault("output", {})["gain"] = round_digits(bass.output.gain * _softer(problem, values))
    return Fitted(
        recorded, problem, best, own, chosen, before, after, own_takes(held), judged, (*recorded.doubts, *doubts)
    )


def _on_strings(recorded: Recorded, request: Fit) -> Recorded:
    """The notes with strings, told by the base preset that is given, or by the usual one if it can be tuned so."""
    name = request.like or DEFAULT
    try:
        return with_strings(recorded, Builder(name).instrument(_tables(name, request.tuning)))
    except PresetError:
        if request.like is not None:
            raise
        return recorded


def _tables(name: str, tuning: Any) -> Tables:
    """The tables of a preset, tuned otherwise if `tuning` is given."""
    _, tables = preset_tables(name)
    return tables if tuning is None else tables | {"tuning": tuning}


def _base(recorded: Recorded, request: Fit, points: Points, say: Say) -> tuple[str, Tables, Plan]:
    """The name and tables of the base preset, and the plan of the notes that it can play."""
    if request.like is not None:
        tables = _tables(request.like, request.tuning)
        able = estimates.places_of(recorded, Builder(request.like).instrument(tables))
        return request.like, tables, _plan_places(recorded, able, request.like)
    bases = _candidates(recorded, request.tuning)
    able = sorted(set.intersection(*(set(places) for _, _, places in bases)))
    chosen = _plan_places(recorded, able, bases[0][0])
    theirs = hear(recorded.takes, chosen.fitted, searched_figures(recorded.technique))
    tasks = [
        Trial(Problem(name, tables, recorded.technique, len(recorded.layers), theirs, normalized=recorded.normalized),
              (), f"preset {name}")
        for name, tables, _ in bases
    ]  # fmt: skip
    say(f"looking for the nearest of {len(tasks)} presets")
    scores = points.solve(tasks)
    k = min(range(len(tasks)), key=lambda i: scores[i]["score"])
    return bases[k][0], bases[k][1], chosen


def _candidates(recorded: Recorded, tuning: Any) -> list[tuple[str, Tables, list[Place]]]:
    """The shipped presets that play nearly all of the notes, and are played alike: slapped, or plucked."""
    found = []
    for name in preset_names():
        if name in SAME_BASS or name.startswith(LABORATORY):
            continue
        tables = _tables(name, tuning)
        try:
            bass = Builder(name).instrument(tables)
        except PresetError:  # cannot be tuned so
            continue
        if (bass.player.technique == "slap") == (recorded.technique in STRUCK):
            found.append((name, tables, estimates.places_of(recorded, bass)))
    if not found:
        raise ValueError("--tuning: no shipped preset can have this tuning; name one with --like")
    maximum = max(len(places) for _, _, places in found)
    return [each for each in found if len(each[2]) >= ENOUGH * maximum]


def _plan_places(recorded: Recorded, able: Sequence[Place], label: str) -> Plan:
    strings = {p.string for p in recorded.takes if p.string}
    if len(able) < 2 or len({p.key for p in able}) < 2:
        wanted = ", ".join(map(note_name, sorted({p.key for p in recorded.takes})[:6]))
        named = f" on strings {', '.join(sorted(strings))}" if strings else ""
        raise ValueError(f"{label}: has hardly any of the notes, {wanted} ...{named}; --tuning or --like may help")
    return plan(able)


def _free(bass: Instrument, recorded: Recorded, ranks: Sequence[int]) -> list[Free]:
    """The free numbers of a bass, and the force of each fitted layer over the one below it."""
    layers = recorded.layers
    return [*free_numbers(bass), *(step(layers[a], layers[b]) for a, b in pairwise(ranks))]


def _begins(problem: Problem, recorded: Recorded, known: dict[str, float]) -> list[list[float]]:
    """Places where a search may begin: with losses of the base preset or by T60, forces by velocity or by level."""
    start = problem.start()
    by_decay = [f.on_scale(known[f.key]) if f.key in known else u for f, u in zip(problem.free, start, strict=True)]
    forces = [_growth(problem.forces(spread_velocities(problem.layers)))]
    if not recorded.normalized:
        theirs = problem.theirs.items()
        forces.append(_growth([
            float(np.median([h.figures["level"] for p, takes in theirs if p.rank == rank for h in takes]))
            for rank in problem.ranks
        ]))  # fmt: skip
    made = []
    for losses in (by_decay, start):
        for growth in forces:
            steps = iter(growth)
            made.append([
                f.on_scale(next(steps)) if f.section == STEP else u for f, u in zip(problem.free, losses, strict=True)
            ])  # fmt: skip
    return made


def _growth(levels: Sequence[float]) -> list[float]:
    """The steps (dB) from one layer to the next, at most MAX_FORCE."""
    return [min(float(step), MAX_FORCE) for step in np.diff(levels)]


def _estimates(
    recorded: Recorded, first: Problem, free: Sequence[Free], points: Points, say: Say
) -> tuple[Tables, dict[str, float], list[str]]:
    """Keys of the preset that are read off the notes, where the losses begin, and doubts."""
    own: Tables = {}
    doubts: list[str] = []
    bass = first.bass
    opened = estimates.open_notes(recorded, bass)
    tasks = [
        estimates.Open(bass, name, notes, digest_of(recorded.digest, name, repr(bass)))
        for name, notes in opened.items()
    ]
    if tasks:
        say(f"identifying string{'s' * (len(tasks) > 1)} {', '.join(opened)}")
    for task, found in zip(tasks, points.solve(tasks, ["inharmonicity"]) if tasks else [], strict=True):
        if math.isnan(found["inharmonicity"]):
            doubts.append(
                f"the open notes of string {task.string} do not tell its inharmonicity: as in the base preset"
            )
        else:
            string_table(own, bass, task.string)["inharmonicity"] = round_digits(found["inharmonicity"])
    floor, knock = estimates.floor(recorded, first), estimates.knock(recorded, bass)
    if floor is None:
        doubts.append("nothing tells the noise of the electronics: as in the base preset")
    else:
        own.setdefault("player", {}).update(estimates.floor_keys(floor))
    if (corner := estimates.corner(recorded, bass)) is not None:
        own.setdefault("player", {})["floor_corner"] = f"{corner:.0f} Hz"
    if knock is not None:
        own.setdefault("player", {})["release_noise"] = f"{knock:.1f} dB"
    if hum := estimates.hum(recorded, bass):
        own.setdefault("player", {}).update(hum=f"{hum[0]:.1f} dB", mains=f"{hum[1]:g} Hz")
    return own, estimates.losses(bass, recorded, free), doubts


def _softer(problem: Problem, values: Sequence[float]) -> float:
    """The gain that makes the new bass as loud as its base at a medium velocity."""

    def level(bass: Instrument) -> float:
        engine = Engine(bass, QUALITIES["live"], DEFAULT_RATE, workers=1)
        found = []
        for i, s in enumerate(bass.strings):
            sound = play_note(engine.another(SEEDS[0]), i, s.open_note, VELOCITY, 0.5)
            found.append(np.mean(sound[attack(sound, DEFAULT_RATE) :][: round(0.3 * DEFAULT_RATE)] ** 2))
        return float(np.sqrt(np.median(found)))

    after = Builder(problem.label).instrument(problem.tables(values))
    return level(problem.bass) / max(level(after), 1e-12)
