"""The search: asks CMA-ES for a dozen trials, computes them, tells it their scores, and so on.

Every trial is a point file, as in a sweep: after an interruption the same command goes on where it was. Scores are told
in the order of asking, so any number of workers gives the same result. The same seed gives the same trials.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from livebass.arrays import Floats
from livebass.experiment import sweep
from livebass.experiment.sweep import Results, completed
from livebass.experiment.workers import Compute, Task
from livebass.fitting.bounds import STEP
from livebass.fitting.problem import Problem, Trial

POPULATION = 12  # trials between two tells
SIGMA = 0.12  # of the scale, at the beginning
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
        self.results |= sweep.found(self.directory, [t for t in tasks if t.digest not in self.results], names)
        done = sum(t.digest in self.results for t in tasks)
        self.step(done)
        for _ in completed(self.directory, tasks, self.results, self.compute):
            self.step(1)
        return [self.results[t.digest] for t in tasks]


@dataclass(frozen=True)
class Best:
    """The result of a search, on the scale from 0 to 1."""

    scaled: tuple[float, ...]
    score: dict[str, float]
    begin: dict[str, float]  # the score where the search began
    deviations: tuple[float, ...]  # of the last trials
    told: tuple[bool, ...]  # whether the notes tell a number
    curve: tuple[float, ...]  # the best score after each generation
    trials: int


def search(
    problem: Problem, begins: Sequence[Sequence[float]], points: Points, seed: int, trials: int,
    minutes: float = math.inf,
) -> Best:  # fmt: skip
    """Searches from the best of some places on the scale, for a number of trials or minutes, at least one dozen."""
    from cmaes import CMA

    generations = max(1, trials // POPULATION)

    def tried(scaled: Sequence[Any], name: str) -> list[dict[str, float]]:
        places = [tuple(round(float(u), 6) for u in each) for each in scaled]
        return points.solve([Trial(problem, each, f"{name} {k}") for k, each in enumerate(places, 1)])

    starts = np.clip(np.array(begins), MARGIN, 1 - MARGIN)
    found = tried(starts, "beginning")
    k = min(range(len(starts)), key=lambda k: found[k]["score"])
    best, first = starts[k], found[k]
    bounds = np.array([[0.0, 1.0]] * len(best))
    optimizer = CMA(best, SIGMA, bounds=bounds, seed=seed, population_size=POPULATION)
    score, curve = first, [first["score"]]
    last: list[Floats] = []
    end = time.monotonic() + 60 * minutes
    for generation in range(generations):
        asked = [optimizer.ask() for _ in range(POPULATION)]
        scores = tried(asked, f"generation {generation + 1}, trial")
        optimizer.tell([(x, s["score"]) for x, s in zip(asked, scores, strict=True)])
        least = min(range(POPULATION), key=lambda k: scores[k]["score"])
        if scores[least]["score"] < score["score"]:
            best, score = asked[least], scores[least]
        curve.append(score["score"])
        last = [*last, np.array(asked)][-LAST:]
        if time.monotonic() > end:
            break
    mean = np.clip(optimizer.mean, 0.0, 1.0)
    of_mean = tried([mean], "mean of the distribution")[0]
    if of_mean["score"] < score["score"] + ALIKE:  # less chance, fewer numbers at bounds
        best, score = mean, of_mean
    forces = np.array([f.section == STEP for f in problem.free])
    told = _told(best, score, tried) | forces
    plain = np.where(told, best, problem.start())
    of_plain = tried([plain], "base preset where not told")[0]
    if of_plain["score"] < score["score"] + TELLING:
        best, score = plain, of_plain
    else:
        told = np.ones(len(best), bool)
    spread = np.std(np.concatenate(last), axis=0)
    return Best(
        tuple(round(float(u), 6) for u in best), score, first, tuple(map(float, spread)), tuple(map(bool, told)),
        tuple(curve), POPULATION * (len(curve) - 1),
    )  # fmt: skip


def _told(best: Floats, score: dict[str, float], tried: Callable[..., list[dict[str, float]]]) -> Any:
    """True for each number that moves the score by itself: (numbers,)."""
    moved = list(_moved(best))
    scores = tried(moved, "one number moved,")
    least = np.array([s["score"] - score["score"] for s in scores]).reshape(-1, 2)
    return np.abs(least).max(axis=1) >= TELLING


def _moved(best: Floats) -> Iterator[Floats]:
    for k in range(len(best)):
        for by in (-MOVED, MOVED):
            yield np.clip(best + by * (np.arange(len(best)) == k), 0.0, 1.0)
