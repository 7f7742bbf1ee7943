"""The search: a step down the slope of the score, then CMA-ES, which gets the scores of a dozen trials at a time.

The slope is that of the score itself: each number is moved alone. Gauss-Newton steps on its rows and levels do worse:
contacts make single rows jump.

Every trial is a point file, as in a sweep: after an interruption the same command goes on where it was. Scores are told
in the order of asking, so any number of workers gives the same result. The same seed gives the same trials.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from livebass.lab.experiment import sweep
from livebass.lab.experiment.sweep import Results, compute_missing
from livebass.lab.experiment.workers import Compute, Task
from livebass.lab.fitting.bounds import STEP
from livebass.lab.fitting.problem import Problem, Trial
from livebass.rows.arrays import Floats

POPULATION = 12  # trials between two tells
SIGMA = 0.06  # of the scale, at the beginning
NUDGE = 0.06  # of the scale, to see the slope
STRIDES = (0.05, 0.1, 0.15)  # of the scale, of the steepest number down the slope
MARGIN = 0.03  # of the scale, from a bound to the beginning
LAST = 4  # generations that tell the deviations
ALIKE = 0.05  # scores that differ by less are alike
TELLING = 0.03  # of the score, twice its chance: a number that moves it by less is not told by the notes
MOVED = 0.12  # of the scale, to see whether a number is told
PARTS = ("score", "rows", "distance", "equalized")


@dataclass
class Points:
    """Computes tasks of one kind, or finds their results in point files in a directory."""

    directory: Path
    compute: Compute
    results: Results = field(default_factory=dict)
    step: Callable[[int], None] = lambda _: None  # gets the number of tasks done

    def solve(self, tasks: Sequence[Task], names: Sequence[str] = PARTS) -> list[dict[str, float]]:
        """The results of tasks, in order."""
        self.results |= sweep.read_points(self.directory, [t for t in tasks if t.digest not in self.results], names)
        done = sum(t.digest in self.results for t in tasks)
        self.step(done)
        for _ in compute_missing(self.directory, tasks, self.results, self.compute):
            self.step(1)
        return [self.results[t.digest] for t in tasks]


@dataclass(frozen=True)
class Best:
    """The result of a search, on the scale from 0 to 1."""

    scaled: tuple[float, ...]
    score: dict[str, float]
    begin: dict[str, float]  # the score where the search began
    deviations: tuple[float, ...]  # of the last trials
    known: tuple[bool, ...]  # whether the notes tell a number
    curve: tuple[tuple[int, float], ...]  # the number of trials so far, and the best score

    @property
    def trials(self) -> int:
        """The number of trials."""
        return self.curve[-1][0]


def search(
    problem: Problem, begins: Sequence[Sequence[float]], points: Points, seed: int, trials: int,
    minutes: float = math.inf,
) -> Best:  # fmt: skip
    """Searches from the best of some places on the scale, for a number of trials or minutes, at least one dozen."""
    from cmaes import CMA

    def tried(scaled: Sequence[Any], name: str) -> list[dict[str, float]]:
        places = [tuple(round(float(u), 6) for u in each) for each in scaled]
        return points.solve([Trial(problem, each, f"{name} {k}") for k, each in enumerate(places, 1)])

    end = time.monotonic() + 60 * minutes
    starts = np.clip(np.array(begins), MARGIN, 1 - MARGIN)
    found = tried(starts, "beginning")
    k = min(range(len(starts)), key=lambda k: found[k]["score"])
    best, first = starts[k], found[k]
    score, count, curve = first, 0, [(0, first["score"])]
    if len(best) + len(STRIDES) + POPULATION <= trials:
        best, score = _downhill(best, score, tried)
        count = len(best) + len(STRIDES)
        curve.append((count, score["score"]))
    bounds = np.array([[0.0, 1.0]] * len(best))
    optimizer = CMA(best, SIGMA, bounds=bounds, seed=seed, population_size=POPULATION)
    last: list[Floats] = []
    for generation in range(1, max(1, (trials - count) // POPULATION) + 1):
        requested = [optimizer.ask() for _ in range(POPULATION)]
        scores = tried(requested, f"generation {generation}, trial")
        optimizer.tell([(x, s["score"]) for x, s in zip(requested, scores, strict=True)])
        minimum = min(range(POPULATION), key=lambda k: scores[k]["score"])
        if scores[minimum]["score"] < score["score"]:
            best, score = requested[minimum], scores[minimum]
        count += POPULATION
        curve.append((count, score["score"]))
        last = [*last, np.array(requested)][-LAST:]
        if time.monotonic() > end:
            break
    mean = np.clip(optimizer.mean, 0.0, 1.0)
    of_mean = tried([mean], "mean of the distribution")[0]
    if of_mean["score"] < score["score"] + ALIKE:  # less chance, fewer numbers at bounds
        best, score = mean, of_mean
    forces = np.array([f.section == STEP for f in problem.free])
    known = _find_known(best, score, tried) | forces
    plain = np.where(known, best, problem.start())
    of_plain = tried([plain], "base preset where not told")[0]
    if of_plain["score"] < score["score"] + TELLING:
        best, score = plain, of_plain
    else:
        known = np.ones(len(best), bool)
    spread = np.std(np.concatenate(last), axis=0)
    return Best(
        tuple(round(float(u), 6) for u in best), score, first, tuple(map(float, spread)), tuple(map(bool, known)),
        tuple(curve),
    )  # fmt: skip


def _downhill(
    best: Floats, score: dict[str, float], tried: Callable[..., list[dict[str, float]]]
) -> tuple[Floats, dict[str, float]]:
    """The best of some steps down the slope at `best`, or `best` itself, and its score.

    The root of each number's slope counts: the steepest number, perhaps by chance, does not go alone.
    """
    nudges = np.where(best < 0.5, NUDGE, -NUDGE)
    scores = tried(list(best + np.diag(nudges)), "slope,")
    slope = np.array([s["score"] - score["score"] for s in scores]) / nudges
    way = -np.sign(slope) * np.sqrt(np.abs(slope) / max(float(np.abs(slope).max()), 1e-9))
    steps = [np.clip(best + stride * way, MARGIN, 1 - MARGIN) for stride in STRIDES]
    found = [(best, score), *zip(steps, tried(steps, "step"), strict=True)]
    return min(found, key=lambda pair: pair[1]["score"])


def _find_known(best: Floats, score: dict[str, float], tried: Callable[..., list[dict[str, float]]]) -> Any:
    """True for each number that moves the score by itself: (numbers,)."""
    one = np.eye(len(best))
    moved = [np.clip(best + by * one[k], 0.0, 1.0) for k in range(len(best)) for by in (-MOVED, MOVED)]
    scores = tried(moved, "one number moved,")
    minimum = np.array([s["score"] - score["score"] for s in scores]).reshape(-1, 2)
    return np.abs(minimum).max(axis=1) >= TELLING
