"""`livebass compare`: the table, JSON and page of recordings beside a preset or other recordings; its errors."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import Run, cli_text, refusal
from support.places import GROWLY

from livebass.lab.comparison.rows import ROWS


@pytest.mark.slow
def test_shipped_notes_beside_a_preset(run: Run, tmp_path: Path) -> None:
    """Every row has a value, or a dash with a reason; the same command gives the same files."""
    page, figures = tmp_path / "compared.html", tmp_path / "compared.json"
    arguments = ("compare", GROWLY, "-p", "jazz-finger", "--takes", 1)
    text = cli_text(run, *arguments, "-o", page, "--json", figures)
    lines = text.splitlines()
    assert lines[0].split() == ["unit", "real", "growlybass,", "fingers", "jazz-finger", "as", "fingers"]
    found = json.loads(figures.read_text())
    real, ours = found["basses"]
    assert (real["name"], real["rendered"], ours["name"], ours["rendered"]) == (
        "growlybass",
        False,
        "jazz-finger",
        True,
    )
    assert len(real["rows"]) == len(ours["rows"]) == len(ROWS)
    assert [d["dynamic"] for d in ours["dynamics"]] == ["v30", "v78", "v127"]
    for row in (*real["rows"], *ours["rows"]):
        assert (row["value"] is None) == bool(row["reason"]), row
        assert row["verdict"] is None or re.fullmatch(r"inside|[\d.]+ (above|below)", row["verdict"])
    assert {row["key"][:5] for row in ours["rows"] if (row["reason"] or "").startswith("only for")} == {
        "fall_", "thump", "octav"
    }  # fmt: skip
    for bass in (real, ours):
        bass["rows"] = [row for row in bass["rows"] if not (row["reason"] or "").startswith("only for")]
    assert all(row["real_basses"] >= 2 <= row["real_notes"] for row in ours["rows"] if row["real"])
    dashes = {row["key"] for row in real["rows"] if row["value"] is None}
    assert dashes == {"t60_ratio", "nearest_1s", "nearest_2s", "nearest_equalized", "alike_1s"}
    assert {row["key"] for row in ours["rows"] if row["value"] is None} == {"take_level", "take_distance"}
    for reason in ("not told which strings are open", "no other real bass", "one take of each note"):
        assert sum(reason in line for line in lines) == 1
    assert 3 < ours["distances"]["growlybass, fingers"] < 15
    assert "jazz-finger as fingers to growlybass, fingers" in text
    html = page.read_text()
    assert html.count("data:image/png;base64,") == 6 and "://" not in html and len(html) < 5_000_000
    assert "level 1 s after the peak" in html and "not told which strings are open" in html
    before = page.read_bytes(), figures.read_bytes()
    assert cli_text(run, *arguments, "-o", page, "--json", figures) == text
    assert (page.read_bytes(), figures.read_bytes()) == before


def test_two_real_basses_and_renders_of_ones_own(run: Run, tmp_path: Path) -> None:
    """A copy, taken as another bass, is far from the others, and at distance zero from its original."""
    other, mine = tmp_path / "other", tmp_path / "mine"
    shutil.copytree(GROWLY, other, ignore=shutil.ignore_patterns("E1*", "C3*"))
    mine.mkdir()
    sound, rate = soundfile.read(GROWLY / "C2_ff_rr1.flac")
    soundfile.write(mine / "C2_slap.wav", 0.5 * sound, rate)
    figures = tmp_path / "compared.json"
    cli_text(
        run, "compare", GROWLY / "C2_pp_rr1.flac", GROWLY / "C2_f_rr1.flac", other, "--beside", mine, "--json", figures
    )
    first, second, ours = json.loads(figures.read_text())["basses"]
    assert [b["name"] for b in (first, second, ours)] == ["recordings", "other", "mine"]
    assert ours["technique"] == "slap" and ours["distances"]["other, fingers"] == pytest.approx(0, abs=0.01)
    assert ours["distances"]["recordings, fingers"] > 2 and first["distances"]["other, fingers"] < 0.01
    assert ours["rows"][0]["reason"] == "one dynamic, taken for hard"


def test_folders_of_one_name_are_two_basses(run: Run, tmp_path: Path) -> None:
    for owner in ("ann", "bob"):
        (tmp_path / owner / "bass").mkdir(parents=True)
        shutil.copy(GROWLY / "C2_ff_rr1.flac", tmp_path / owner / "bass")
    text = cli_text(run, "compare", tmp_path / "ann" / "bass", tmp_path / "bob" / "bass")
    assert f"{tmp_path}/ann/bass, fingers to {tmp_path}/bob/bass, fingers  0.0 dB" in text


def test_files_without_a_pitch_are_named(run: Run, tmp_path: Path) -> None:
    shutil.copy(GROWLY / "C2_ff_rr1.flac", tmp_path)
    soundfile.write(tmp_path / "hiss_ff.wav", 0.1 * np.random.default_rng(5).normal(size=44_100), 44_100)
    status, _, err = run("compare", tmp_path)
    assert status == 0 and err.splitlines() == [
        f"left out, as no note with a pitch is heard: {tmp_path / 'hiss_ff.wav'}", "1 note of 1 bass"
    ]  # fmt: skip


def bad(folder: Path) -> dict[str, Path]:
    """Unusable recordings, by their error."""
    (folder / "empty").mkdir()
    noises = folder / "noises"
    noises.mkdir()
    shutil.copy(GROWLY / "C2_rel_rr1.flac", noises)
    paths = {
        "no such file": folder / "nowhere.wav",
        "has no sound file, such as .aif": folder / "empty",
        "only noises of hands": noises,
        "cannot be read as sound": folder / "text.wav",
        "silent": folder / "silent.wav",
        "no note of 0.1 s with a pitch of 25 to 500 Hz": folder / "noise.wav",
    }
    paths["cannot be read as sound"].write_text("no sound at all")
    soundfile.write(paths["silent"], np.zeros(44_100), 44_100)
    noise = 0.1 * np.random.default_rng(5).normal(size=44_100)
    soundfile.write(folder / "noise.wav", noise, 44_100)
    return paths


@pytest.mark.parametrize("why", list(range(6)))
def test_recordings_that_cannot_be_used(run: Run, tmp_path: Path, why: int) -> None:
    said, path = list(bad(tmp_path).items())[why]
    err = refusal(run, "compare", path, "-p", "jazz-finger", "--json", tmp_path / "x.json")
    assert said in err and str(path) in err
    assert not (tmp_path / "x.json").exists()


def test_wrong_usage(run: Run, tmp_path: Path) -> None:
    for arguments, why in (
        ([], "Missing argument 'REAL...'"),
        ([GROWLY, "-o", tmp_path / "page.png"], "a page's name ends in .html"),
        ([GROWLY, "-o", tmp_path / "a.html", "--json", tmp_path / "a.html"], "the same file"),
        ([GROWLY / "C2_f_rr1.flac", "--json", GROWLY / "C2_f_rr1.flac"], "is a recording itself"),
        ([GROWLY, "--json", tmp_path], "is a directory"),
        ([GROWLY, "-p", "nothing"], "nothing"),
        ([GROWLY, "--velocities", "90,30"], "must be ascending velocities from 1 to 127"),
        ([GROWLY, "--velocities", "loud"], "must be ascending velocities from 1 to 127"),
        ([GROWLY, "--takes", "0"], "must be a whole number from 1 to 16, not 0"),
        ([GROWLY, "--technique", "teeth"], "fingers"),
        ([GROWLY, "--seed", "-1"], "must be a whole number from 0"),
    ):
        err = refusal(run, "compare", *arguments)
        assert why in err, (arguments, err)
    assert not list(tmp_path.iterdir())
