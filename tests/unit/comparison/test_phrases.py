"""`compare --phrase`: recordings of phrases beside presets."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import Run, cli_text, refusal
from support.phrases import RATE, phrase

from livebass.lab.comparison.phrase import measure_phrase
from livebass.lab.comparison.phrases import KINDS, play_phrase


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """Two real basses: one with fast ends and placed fingers in two files, the other with slow ends and neither."""
    for name, sounds in {
        "fast": [phrase(700.0, placed=-24.0), phrase(600.0, placed=-28.0)], "slow": [phrase(300.0)]
    }.items():  # fmt: skip
        (tmp_path / name).mkdir()
        for k, sound in enumerate(sounds):
            soundfile.write(tmp_path / name / f"groove{k}.wav", sound / np.abs(sound).max(), RATE, subtype="FLOAT")
    return tmp_path / "fast", tmp_path / "slow"


def test_real_phrases_make_ranges(run: Run, folders: tuple[Path, Path], tmp_path: Path) -> None:
    figures = tmp_path / "phrases.json"
    text = cli_text(run, "compare", *folders, "--beside", folders[1], "--phrase", "groove", "--json", figures)
    found = json.loads(figures.read_text())
    fast, slow, beside = found["basses"]
    assert [(b["name"], b["rendered"]) for b in (fast, slow)] == [("fast", False), ("slow", False)]
    assert beside["rendered"]
    assert fast["figures"]["notes"] == 16 and slow["figures"] == beside["figures"]
    assert fast["figures"]["end_rate"] == pytest.approx(650, rel=0.1)
    assert fast["figures"]["between"] == 100 and slow["figures"]["between"] == 0
    assert fast["figures"]["between_level"] == pytest.approx(-26, abs=1)
    rows = {row["key"]: row["real"] for row in found["rows"]}
    assert rows["end_rate"] == [slow["figures"]["end_rate"], fast["figures"]["end_rate"]]
    assert rows["ghost_level"] is None and rows["between_level"][0] == rows["between_level"][1]
    (line,) = [each for each in text.splitlines() if each.startswith("   fall")]
    assert f"{rows['end_rate'][0]:.0f} to {rows['end_rate'][1]:.0f}" in line


def test_a_preset_plays_a_line() -> None:
    """Its notes are heard as they are written; each ends, before a gap. The same seed gives the same phrase."""
    sound = play_phrase("jazz-finger", "line", "live")
    found = measure_phrase(sound, RATE)
    keys = {"E1": 28, "F#1": 30, "G1": 31, "A1": 33, "B1": 35, "C2": 36, "D2": 38, "E2": 40}
    assert [n.key for n in found.notes] == [keys[name] for _, _, name, _ in KINDS["line"]]
    assert len(found.ends) == len(found.notes) and found.gaps >= 15 and not found.ghosts
    assert np.array_equal(sound, play_phrase("jazz-finger", "line", "live"))


def test_wrong_usage(run: Run, tmp_path: Path) -> None:
    silence = tmp_path / "short.wav"
    soundfile.write(silence, 0.1 * np.ones(100) * np.arange(100), RATE)
    for arguments, why in (
        (["--phrase", "groove"], "--phrase: name recordings, or a preset with -p"),
        (["--phrase", "solo", "-p", "slap"], "groove"),
        (["--phrase", "line", "--tell", "-p", "slap"], "--phrase and --tell: choose one"),
        (["--phrase", "line", "-p", "slap", "--takes", 3], "--takes: it has no use with --phrase"),
        ([silence, "--phrase", "line"], "at least 0.3 s"),
        (["--phrase", "line", "-p", "slap", "-o", "a.html"], "-o: --phrase has no page"),
    ):
        err = refusal(run, "compare", *arguments)
        assert why in err, (arguments, err)
