"""A sweep on a Dask cluster, one of whose workers is killed."""

from __future__ import annotations

import os
import signal
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest
from support.jack import wait_for
from support.sweeps import COUNT, finish, has_ended, keep, paused, same, sweeping, swept


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swept(tmp_path_factory.mktemp("sweep") / "undisturbed")


def test_on_a_cluster_whose_worker_is_killed_the_table_is_the_same(undisturbed: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    directory = tmp_path / "d"
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(tmp_path), silence_logs=60
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
        ExitStack() as running,
    ):
        victim = psutil.Process(min(client.run(os.getpid).values()))
        process = running.enter_context(sweeping(directory, "--scheduler", cluster.scheduler_address, pause=2))
        paused(process)
        victim.kill()
        wait_for(lambda: has_ended(victim))
        assert len(keep(directory)) == 2 < COUNT
        process.send_signal(signal.SIGCONT)
        assert f"to compute on {cluster.scheduler_address}" in finish(process)
    same(directory, undisturbed)
