"""`livebass bench render`: its rows, table and files. No test knows the machine's speed."""

from __future__ import annotations

import json
import os
import statistics
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import Run, assert_one_clear_line, cli_text

from livebass import __version__
from livebass.engine.engine import Engine
from livebass.lab.bench import limit
from livebass.lab.bench import render as bench
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.system.cores import core_count

TINY = bench.Extent(sound=0.02, brute=0.005, chords=0.04, line=0.3, runs=2, long_runs=2, pieces=2)
ROWS = {
    "brute_force", "engine_live_50k", "engine_live_48k", "engine_studio_50k", "engine_studio_48k",
    "engine_reference_50k", "engine_reference_48k", "strings_live_one_core", "strings_live_all_cores",
    "slap_live", "slap_studio", "fretless",
}  # fmt: skip
MACHINE = {"cpu", "cores", "system", "python", "numpy", "numba", "load_before", "peak_resident_bytes"}


@pytest.fixture(scope="module")
def measured() -> tuple[dict[str, Any], list[str]]:
    said: list[str] = []
    return bench.bench_render(said.append, TINY), said


def test_all_is_measured_and_named(measured: tuple[dict[str, Any], list[str]]) -> None:
    result, said = measured
    assert set(result) == {"livebass", "date", "machine", "case_b", "measurements", "agreement", "ratios", "limit"}
    assert set(result["measurements"]) == ROWS and set(result["machine"]) == MACHINE
    assert result["livebass"] == __version__ and result["machine"]["cores"] == core_count()
    assert result["machine"]["peak_resident_bytes"] > 50e6
    assert len(said) == len(set(said)) == 14
    for key, row in result["measurements"].items():
        runs = row["runs"]
        assert len(runs) == (1 if key == "brute_force" else 2), key
        assert 0 < min(runs) == row["seconds_per_second"] <= row["median"] == statistics.median(runs), key
        assert 0 < row["processor"] < 1.2 * max(runs) * row["cores"] + 0.02 / row["sound_s"], key  # one thread per core
        assert 1 <= row["cores"] <= core_count() and row["sound_s"] > 0, key


def test_rows_tell_what_was_measured(measured: tuple[dict[str, Any], list[str]]) -> None:
    rows = measured[0]["measurements"]
    for key in ("brute_force", "engine_reference_50k"):
        assert (rows[key]["modes"], rows[key]["contact_rate_hz"]) == (862, 8_000_000), key
    assert rows["brute_force"]["sound_s"] == 0.005 and rows["engine_live_48k"]["sound_s"] == 0.02
    assert rows["engine_live_48k"]["contact_rate_hz"] == 672_000
    for key, row in rows.items():
        assert row["contact_rate_hz"] % row["rate_hz"] == 0, key
    assert rows["strings_live_one_core"]["notes"] == 4 and rows["strings_live_one_core"]["cores"] == 1
    assert rows["slap_live"]["notes"] == int(0.3 / bench.SIXTEENTH)
    assert rows["slap_live"]["sound_s"] == pytest.approx(0.3, abs=bench.SIXTEENTH)


def test_the_limit_is_what_the_multiply_adds_of_a_held_string_take(measured: tuple[dict[str, Any], list[str]]) -> None:
    """At the rates of a product of matrices, between those of the two widths; each mode needs as many more."""
    found = measured[0]["limit"]
    least, most = (found["multiply_adds"] / found[f"{kind}_per_s"] * 1e9 for kind in ("float32", "float64"))
    assert 0 < 0.5 * least < found["limit_ns"] < 2 * most and found["part"] == found["limit_ns"] / found["frame_ns"]
    engine = Engine(load_preset("jazz-finger"), QUALITIES["live"], 48_000)
    engine.send(np.zeros(1, np.int64), np.array([(0x90, 28, 40)], np.uint8))
    engine.process(4800)
    slot, needed = engine.voices[0].slots[int(engine.voices[0].record["slot"][0])], []
    split = int(engine.pool.records[0][0]["split"])
    for modes in (split, split + 64, split + 128):
        slot["active"] = slot["v_active"] = modes
        needed.append(limit.multiply_adds(engine))
    none, some, more = (row["float32"] for row in needed)
    assert more - some == some - none > 0 and len({row["float64"] for row in needed}) == 1


def test_ratios_follow_from_the_times(measured: tuple[dict[str, Any], list[str]]) -> None:
    result = measured[0]
    cost = {key: row["seconds_per_second"] for key, row in result["measurements"].items()}
    used = {key: row["processor"] for key, row in result["measurements"].items()}
    expected = {
        "reference_to_real_time": 1 / cost["engine_reference_50k"],
        "reference_to_brute_force": used["brute_force"] / used["engine_reference_50k"],
        "fretless_to_fretted": used["fretless"] / used["engine_reference_50k"],
        "strings_one_core": 1 / cost["strings_live_one_core"],
        "strings_all_cores": 1 / cost["strings_live_all_cores"],
        "slap_live": 1 / cost["slap_live"],
        "slap_studio": 1 / cost["slap_studio"],
    }
    assert result["ratios"] == pytest.approx(expected, rel=1e-12)


def test_both_solvers_find_the_same_motion(measured: tuple[dict[str, Any], list[str]]) -> None:
    agreement = measured[0]["agreement"]
    assert agreement["until_s"] == 0.005 and agreement["contacts_equal"]
    assert agreement["contacts_brute_force"] == agreement["contacts_engine"] > 0
    assert agreement["displacement"] < 1e-6


def test_four_strings_sound_at_once() -> None:
    bass = load_preset("jazz-finger")
    engine = Engine(bass, QUALITIES["live"], 48_000)
    sound = np.concatenate(list(engine.play(bench._chords(bass, 0.1), tail=0.0)), axis=1)
    assert sound.shape[0] == 4 and (np.abs(sound).max(axis=1) > 1e-3).all()


def test_the_table_has_every_row_and_ratio(measured: tuple[dict[str, Any], list[str]]) -> None:
    lines = bench.table(measured[0]).splitlines()
    names = [row["name"] for row in measured[0]["measurements"].values()]
    assert sum(line.startswith(tuple(names)) for line in lines) == len(ROWS)
    columns = lines[1 : 2 + len(ROWS)]
    assert len({len(line) for line in columns}) == 1 and len(columns[0]) <= 100
    for _, label, wanted, _, _ in bench.RATIOS:
        assert any(line.startswith(label) and line.endswith(wanted) for line in lines), label


@pytest.mark.parametrize("x, text", [(26612.4, "26612"), (18.31, "18.3"), (0.0593, "0.0593"), (0.000634, "0.000634")])
def test_figures(x: float, text: str) -> None:
    assert bench._figure(x) == text


def test_json_from_the_command_line(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "bench_render", partial(bench.bench_render, extent=TINY))
    file = tmp_path / "bench.json"
    text = cli_text(run, "bench", "render", "--json", file)
    result = json.loads(file.read_text())
    assert text == bench.table(result) + "\n"
    assert set(result["measurements"]) == ROWS
    assert os.listdir(tmp_path) == ["bench.json"]


def test_a_full_disk_does_not_lose_the_figures(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError("bench.json: cannot be written: No space left on device")

    monkeypatch.setattr(bench, "bench_render", lambda _: {})
    monkeypatch.setattr(bench, "table", lambda result: "the table")
    monkeypatch.setattr("livebass.files.whole.Transaction.write", full)
    status, out, err = run("bench", "render", "--json", tmp_path / "bench.json")
    assert_one_clear_line(status, err, (1,))
    assert out == "the table\n"
