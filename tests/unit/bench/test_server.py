"""`livebass bench latency`, with the tests' own JACK server and without one."""

from __future__ import annotations

import json
import os
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from support.child import die, fail, sleep
from support.command import Run
from support.needs import package

from livebass.lab.bench import latency, player
from livebass.lab.bench.jack import WRAP, Lost, in_child, since

FEW = latency.Extent(notes=4, queued=5)


@pytest.fixture
def no_server(monkeypatch: pytest.MonkeyPatch) -> None:
    package("jack")
    monkeypatch.setenv("JACK_DEFAULT_SERVER", "nobody")


def test_figures_of_made_up_latencies() -> None:
    figures = latency.latency_figures([48.0, 96.0, 96.0, 480.0], 48_000)
    each = figures.pop("each_ms")
    assert figures == pytest.approx(
        {"notes": 4, "least_ms": 1, "median_ms": 2, "most_ms": 10, "jitter_ms": np.std([1, 2, 2, 10])}
    )
    assert each == pytest.approx([1, 2, 2, 10])


def test_frame_times_wrap() -> None:
    assert since(5, WRAP - 3) == 8 and since(WRAP - 3, 5) == -8 and since(7, 7) == 0


def test_without_a_server_only_the_queue_is_measured(
    no_server: None, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(latency, "bench_latency", partial(latency.bench_latency, extent=FEW))
    status, out, err = run("bench", "latency", "--json", tmp_path / "x.json")
    result = json.loads((tmp_path / "x.json").read_text())
    assert status == 0 and not err and out == latency.table(result) + "\n"
    assert result["server"] is None and [row["way"] for row in result["rows"]] == ["queue"]
    first = out.splitlines()[0]
    assert "no JACK server 'nobody'" in first and "only the way from the queue into a block" in first
    row = result["rows"][0]
    assert row["notes"] == 5 and row["least_ms"] >= 1 / 48 and row["send_us"] > 0


def test_work_in_a_child_is_bounded(capfd: pytest.CaptureFixture[str]) -> None:
    assert in_child(60, sleep, 0.0) == "done"
    for work, why in ((die, "with it"), (fail, "no way")):
        with pytest.raises(Lost, match=why):
            in_child(60, work)
    began = time.monotonic()
    with pytest.raises(Lost):
        in_child(1, sleep, 60.0)
    assert time.monotonic() - began < 30 and capfd.readouterr().err == ""


def test_the_player_ends_in_one_line(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    def leave(status: int) -> None:
        raise SystemExit(status)

    monkeypatch.setattr(os, "_exit", leave)
    monkeypatch.setattr("sys.argv", ["player", "violin", "live", "48000", "128"])
    monkeypatch.setattr(player, "end_after", lambda _: None)
    monkeypatch.setattr(player, "_exit_with_parent", lambda: None)
    monkeypatch.setattr(player, "_play", lambda *_: (_ for _ in ()).throw(OSError("no\nserver")))
    with pytest.raises(SystemExit) as ended:
        player.main()
    assert ended.value.code == 1 and capfd.readouterr().err == "no server\n"
