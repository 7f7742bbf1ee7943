"""`livebass map` on a Dask cluster."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.command import Run, cli_text


def test_a_cluster_gives_the_same_maps(run: Run, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    here, there = tmp_path / "here.csv", tmp_path / "there.csv"
    wanted = "map", "--vary", "neck.action=0.7mm:2mm:2", "--duration", "50ms"
    table = cli_text(run, *wanted, "--csv", here)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, dashboard_address=None, local_directory=str(tmp_path), silence_logs=60
    ) as cluster:
        address = cluster.scheduler_address
        status, out, said = run(*wanted, "--csv", there, "--scheduler", address)
    assert status == 0 and out == table and f"168 notes to compute on {address}" in said
    assert here.read_bytes() == there.read_bytes()
