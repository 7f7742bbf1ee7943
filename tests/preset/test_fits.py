"""Presets that `livebass fit` made tell how: tools/fits.toml makes them again."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

TOOLS, PRESETS = (Path(__file__).parents[2] / folder for folder in ("tools", "presets"))
FITS: dict[str, dict[str, Any]] = tomllib.loads((TOOLS / "fits.toml").read_text())
SOURCES = tomllib.loads((TOOLS / "real_notes.toml").read_text())


@pytest.mark.parametrize("name", FITS)
def test_a_fitted_preset_names_its_recordings_and_its_command(name: str) -> None:
    told, text = FITS[name], (PRESETS / f"{name}.toml").read_text()
    source = SOURCES[told["recordings"]]
    assert source["shipped"], "not in the public domain"
    assert source["bass"] in text and source["source"] in text and told["notes"] in text
    command = f"livebass fit {told['recordings']} --like {told['like']} --seed {told['seed']}"
    assert f"{command} --evaluations {told['evaluations']}\n" in text
    assert told["why"] in text
    made = tomllib.loads(text)
    set_by_hand = made["neck"] | made["output"] | made["player"]
    assert {key: set_by_hand[key] for key in told["by_hand"]} == told["by_hand"]
    assert {key: made[key] for key in ("name", "description", "like")} == {
        key: told[key] for key in ("name", "description", "like")
    }


def test_no_other_preset_says_that_a_fit_made_it() -> None:
    assert {p.stem for p in PRESETS.glob("*.toml") if "livebass fit" in p.read_text()} == set(FITS)
