"""`compare --tell`: how well a bass is told from real ones, and by what."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import Run, cli_text, refusal
from support.places import GROWLY

from livebass.lab.comparison.groups import FIGURES, NOISE, Group, group, real
from livebass.lab.comparison.summary import Bass
from livebass.lab.comparison.telling import tell


def mix(change: float = 0.05) -> Group:
    """Every third note of all real basses played with fingers, slightly changed, so that none is a known recording."""
    fingers = [g for g in real() if g.technique == "fingers"]
    rng = np.random.default_rng(3)
    figures = np.concatenate([g.figures[::3] for g in fingers])
    figures = figures * (1 + change * rng.normal(size=figures.shape))
    return Group("mixed", "mixed", "fingers", np.concatenate([g.pitch[::3] for g in fingers]), figures)


def move(key: str, by: float) -> Group:
    """The mixed notes with one figure moved."""
    notes = mix()
    figures = notes.figures.copy()
    figures[:, FIGURES.index(key)] += by
    return replace(notes, figures=figures)


def test_a_bass_like_all_real_ones_cannot_be_told() -> None:
    found = tell(mix())
    assert found.among == 7 and found.technique == "fingers"
    assert all(auc < 0.72 for auc in found.auc.values()), found.auc
    assert all(min(scale) > 0.6 and max(scale) <= 1 for scale in found.real.values())
    assert 0.85 < np.median(found.real["all"]) < 0.97


@pytest.mark.parametrize("by", [-40.0, 40.0])
def test_one_wrong_figure_gives_it_away_and_is_named(by: float) -> None:
    """Hiss far too faint or too loud is found in either direction; without noises the bass is a real one again."""
    found = tell(move("hiss", by))
    assert found.auc["all"] > 0.95 and found.auc["no timbre"] > 0.95 and found.auc["no noise"] < 0.72
    first = found.signs[0]
    assert first.auc > 0.95 and first.title.startswith("10-16 kHz")
    assert (float(first.value) > float(first.high)) == (by > 0)
    assert str(first) in found.text() and json.dumps(found.json())


def test_figures_that_no_note_shows_do_no_harm() -> None:
    notes = mix()
    figures = notes.figures.copy()
    figures[:, [FIGURES.index(key) for key in NOISE]] = np.nan
    found = tell(replace(notes, figures=figures))
    assert all(auc < 0.75 for auc in found.auc.values()), found.auc


def test_few_basses_of_a_technique_are_compared_with_all() -> None:
    found = tell(replace(mix(), technique="pick"))
    assert found.technique == "" and found.among == 7 and "of all techniques" in found.text()


def test_shipped_recordings_are_not_compared_with_themselves(run: Run, tmp_path: Path) -> None:
    """Of seven real basses six are left; the same is written as JSON."""
    figures = tmp_path / "told.json"
    text = cli_text(run, "compare", "--tell", GROWLY, "--json", figures)
    assert text.startswith("growlybass, fingers: beside 6 real basses played with fingers")
    (reported,) = json.loads(figures.read_text())["basses"]
    assert set(reported["auc"]) == {"all", "no timbre", "no noise"} and len(reported["real_auc"]["all"]) == 6
    assert 0.8 < reported["auc"]["all"] <= 1 and f"{reported['auc']['all']:.2f}" in text


def test_what_cannot_be_told(run: Run, tmp_path: Path) -> None:
    for arguments, why in (
        ([], "--tell: name recordings, or a preset"),
        ([GROWLY / "C2_ff_rr1.flac"], "--tell: recordings, fingers has 1 note of 1 pitch; at least 8 notes of 2"),
        ([GROWLY, "-o", tmp_path / "told.html"], "-o: --tell has no page"),
    ):
        err = refusal(run, "compare", "--tell", *arguments)
        assert why in err, (arguments, err)


def test_groups_need_notes_of_two_pitches() -> None:
    with pytest.raises(ValueError, match="mine, fingers has 0 notes of 0 pitches"):
        group(Bass("mine", "fingers", False, ()))
