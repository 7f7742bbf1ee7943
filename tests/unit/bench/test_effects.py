"""`livebass bench effects`: its rows and table. No test knows the machine's speed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.command import Run

from livebass.lab.bench import effects as bench
from livebass.rows.techniques import EFFECTS

TINY = bench.Extent(blocks=20, runs=2)


def test_every_effect_has_a_row_and_all_of_them_have_one() -> None:
    said: list[str] = []
    result = bench.bench_effects(said.append, TINY)
    names = [row["name"] for row in result["rows"]]
    assert names == [*bench.KINDS, bench.AMP, bench.ALL] == said
    for row in result["rows"]:
        assert 0 < row["median"] <= row["p99"], row
    text = bench.table(result)
    assert all(name in text for name in names) and "64 frames at 48 kHz" in text
    assert result["wanted"]["met"] == (result["rows"][-2]["median"] <= bench.WANTED)


def test_every_knob_is_on_in_some_row() -> None:
    measured = {name for kind in bench.KINDS.values() for name in kind}
    assert measured | {"eq_low_mid_frequency", "eq_high_mid_frequency"} == set(EFFECTS)


def test_the_command_prints_the_table_and_writes_the_figures(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    measure = bench.bench_effects
    monkeypatch.setattr(bench, "bench_effects", lambda progress: measure(progress, TINY))
    status, out, _ = run("bench", "effects", "--json", tmp_path / "effects.json")
    assert status == 0 and bench.AMP in out
    assert len(json.loads((tmp_path / "effects.json").read_text())["rows"]) == len(bench.KINDS) + 2
