"""`compare --hear`: the nearest real note by a model of hearing."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from support.command import Run, cli_text, refusal
from support.ringing import save_tones as save
from support.ringing import tone


def folders(place: Path) -> tuple[Path, Path, Path]:
    """A real bass with a clear and a noisy note, another a semitone off, and notes like the clear one, but softer."""
    clear = tone(98.0)
    noise = np.random.default_rng(1).normal(size=clear.size)
    noisy = clear + 0.1 * np.abs(clear).max() * noise
    real, other, ours = (place / name for name in ("real", "other", "ours"))
    for folder in (real, other, ours):
        folder.mkdir()
    save(real, clear_f=clear, noisy_f=noisy)
    save(other, off_f=tone(103.8))
    save(ours, like_f=0.3 * clear + 1e-5 * noise, hissing_f=clear + 0.02 * np.abs(clear).max() * noise)
    return real, other, ours


def test_the_nearest_note_by_ear(run: Run, tmp_path: Path) -> None:
    """A note is heard as the same note, however loud; a hissing one is worse, and one of another pitch no neighbour."""
    pytest.importorskip("zimtohrli")
    real, other, ours = folders(tmp_path)
    figures = tmp_path / "heard.json"
    text = cli_text(run, "compare", real, other, "--beside", ours, "--hear", "--json", figures)
    found = {bass["name"]: bass for bass in json.loads(figures.read_text())["basses"]}
    notes = {n["note"]: n for n in found["ours as fingers"]["notes"]}
    assert notes["like_f"]["real_note"] == "clear_f" and notes["like_f"]["mos"] > 4.9
    assert notes["hissing_f"]["mos"] < notes["like_f"]["mos"] - 0.2
    assert found["other, fingers"]["notes"] == [] and "other, fingers: no other real bass has its pitches" in text
    assert "ours as fingers: MOS" in text and "G2" in text


def test_without_the_model_one_line_says_how_to_get_it(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "zimtohrli", None)
    note = save(tmp_path, g_f=tone())
    err = refusal(run, "compare", note, "-p", "jazz-finger", "--hear")
    assert "--hear needs zimtohrli: " in err and "install" in err and len(err.splitlines()) == 1


def test_wrong_usage(run: Run, tmp_path: Path) -> None:
    note = save(tmp_path, g_f=tone())
    assert "--hear and --tell: choose one" in refusal(run, "compare", note, "--hear", "--tell")
    assert "-o: --hear has no page" in refusal(run, "compare", note, "--hear", "-o", tmp_path / "a.html")
