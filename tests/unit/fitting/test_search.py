"""The search: nearer by every generation, the same from the same seed, resumed to the same result, within bounds."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.needs import processes
from support.sweeps import Deadly

pytest.importorskip("cmaes")
from livebass.files.whole import Transaction
from livebass.lab.experiment.workers import lasting
from livebass.lab.fitting.bounds import Free
from livebass.lab.fitting.search import POPULATION, Best, Points, search
from livebass.report.text import plain

WANTED = np.array([0.8, 0.3])  # the third number tells nothing
FREE = tuple(Free("player", name, name, 0.0, 1.0) for name in "abc")


class Fake:
    """A problem with a parabola for a score."""

    digest, free = "fake", FREE

    def start(self) -> list[float]:
        return [0.5, 0.5, 0.5]


class Computer:
    """Computes tasks in any order; interrupts after `maximum`."""

    def __init__(self, maximum: int = 10**9) -> None:
        self.requested: list[tuple[float, ...]] = []
        self.maximum = maximum

    def __call__(self, tasks: Sequence[Any]) -> Iterator[tuple[Any, dict[str, float]]]:
        for task in random.sample(list(tasks), len(tasks)):
            if len(self.requested) == self.maximum:
                raise KeyboardInterrupt
            self.requested.append(task.scaled)
            score = float(np.sum((np.array(task.scaled[:2]) - WANTED) ** 2)) * 10
            yield task, {"score": score, "rows": score, "distance": 0.0, "equalized": float("nan")}


def searched(directory: Path, computer: Computer, seed: int = 1, trials: int = 96) -> Best:
    with Transaction() as made:
        made.directory(directory)
        made.directory(directory / "points")
        return search(Fake(), [[0.5, 0.5, 0.5], [0.1, 0.9, 0.5]], Points(directory, computer), seed, trials)  # type: ignore[arg-type]


def test_it_comes_nearer_and_leaves_what_the_notes_do_not_tell(tmp_path: Path) -> None:
    computer = Computer()
    found = searched(tmp_path / "a", computer)
    assert found.begin["score"] == pytest.approx(1.3)  # of the better beginning
    assert found.score["score"] < 0.2 * found.begin["score"] and found.trials == 6 + 7 * POPULATION
    assert np.allclose(found.scaled[:2], WANTED, atol=0.15)
    assert found.known == (True, True, False) and found.scaled[2] == 0.5
    counts, scores = zip(*found.curve, strict=True)
    assert counts == (0, 6, *(6 + POPULATION * k for k in range(1, 8)))
    assert scores[1] < 0.7 * scores[0] and list(scores) == sorted(scores, reverse=True)  # down the slope first
    assert all(0 <= u <= 1 for each in computer.requested for u in each)
    assert not list(tmp_path.rglob(".*"))


def test_a_seed_gives_the_same_trials_and_another_one_others(tmp_path: Path) -> None:
    a, b, c = Computer(), Computer(), Computer()
    first, again = searched(tmp_path / "a", a, trials=24), searched(tmp_path / "b", b, trials=24)
    other = searched(tmp_path / "c", c, seed=2, trials=24)
    assert first == again and sorted(a.requested) == sorted(b.requested)
    assert other != first and len(set(a.requested) & set(c.requested)) == 2 + 6  # the beginnings, and the slope


def test_interrupted_it_goes_on_to_the_same_result(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        searched(tmp_path / "a", stopped := Computer(20), trials=24)
    kept = len(list((tmp_path / "a" / "points").glob("*.json")))
    assert kept == len(stopped.requested) == 20
    rest = searched(tmp_path / "a", goes_on := Computer(), trials=24)
    assert rest == searched(tmp_path / "b", whole := Computer(), trials=24)
    assert len(goes_on.requested) + 20 == len(whole.requested)
    longer = searched(tmp_path / "a", more := Computer(), trials=36)
    assert longer.trials == 30 and 12 <= len(more.requested) < 24


def test_a_few_trials_are_one_generation(tmp_path: Path) -> None:
    """None are left for the slope."""
    found = searched(tmp_path / "a", Computer(), trials=POPULATION + 5)
    assert [count for count, _ in found.curve] == [0, POPULATION]


def test_processes_last_from_one_call_to_the_next() -> None:
    processes()
    tasks = [SimpleNamespace(name=f"task {k}", work={"score": k}, digest=str(k)) for k in range(5)]
    with lasting(1, plain, pytest.fail) as compute:
        for part in (tasks[:2], tasks[2:]):
            assert sorted((t.name, r["score"]) for t, r in compute(part)) == [(t.name, t.work["score"]) for t in part]
        with pytest.raises(ChildProcessError, match="task x"):
            list(compute([SimpleNamespace(name="task x", work=Deadly(), digest="x")]))
