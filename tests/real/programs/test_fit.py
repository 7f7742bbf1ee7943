"""The trials of a fit in processes and on a Dask cluster."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.fits import problem_of, real_notes

pytest.importorskip("cmaes")
pytest.importorskip("scipy")
from livebass.lab.experiment.workers import connect, lasting
from livebass.lab.fitting.problem import Trial, solve_task


def test_processes_and_a_cluster_give_the_same_scores(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    problem = problem_of(real_notes())
    tasks = [Trial(problem, (0.2, u), f"trial {u}") for u in (0.3, 0.6)]
    here = {task.name: solve_task(task.work) for task in tasks}
    with lasting(2, solve_task, print) as compute:
        assert {task.name: found for task, found in compute(tasks)} == here
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, local_directory=str(tmp_path), silence_logs=60
    ) as cluster, connect(cluster.scheduler_address, solve_task) as compute:  # fmt: skip
        assert {task.name: found for task, found in compute(tasks)} == here
