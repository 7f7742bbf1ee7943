"""Presets that `livebass fit` made tell how: tools/fits.toml makes them again."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from support.places import ROOT

from livebass.lab.fitting.bounds import FREE
from livebass.preset.load import own_tables, preset_tables

TOOLS, PRESETS = ROOT / "tools", ROOT / "presets"
with pytest.MonkeyPatch.context() as patch:
    patch.syspath_prepend(str(TOOLS))
    from fit_presets import onto

FITS: dict[str, dict[str, Any]] = tomllib.loads((TOOLS / "fits.toml").read_text())
SOURCES = tomllib.loads((TOOLS / "real_notes.toml").read_text())
ON_BASES = [name for name, reported in FITS.items() if reported["like"].startswith("tools/bases/")]
DECIDED = {f.key for f in FREE} | {"name", "description", "gain", "softest", "floor_noise", "release_noise"}
DECIDED |= {"pluck_nearest", "pluck_farthest", "inharmonicity"}  # by a fit
FIT = """# Made by a fit.
like = "{}"
name = "Fitted"

[neck]
axes_turned = "40 deg"  # sd 2 deg
resonance_masses = {{unit = "kg", values = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14]}}  # sd 5 %

[[string]]
name = "A"
thermoelastic = 0.002  # sd 0.0001

[player]
softest = 0.5  # by the force of the softest notes
hardest = 6.0  # sd 0.1
"""


@pytest.mark.parametrize("name", FITS)
def test_a_fitted_preset_names_its_recordings_and_its_command(name: str) -> None:
    reported, text = FITS[name], (PRESETS / f"{name}.toml").read_text()
    source = SOURCES[reported["recordings"]]
    assert source["shipped"], "not in the public domain"
    assert source["bass"] in text and source["source"] in text and reported["notes"] in text
    command = f"livebass fit {reported['recordings']} --like {reported['like']} --seed {reported['seed']}"
    assert f"{command} --evaluations {reported['evaluations']}\n" in text
    assert reported["why"] in text
    made = tomllib.loads(text)
    for string in made["string"]:
        set_by_hand = string | made["neck"] | made["output"] | made["player"]
        assert {key: set_by_hand[key] for key in reported["by_hand"]} == reported["by_hand"]
    assert {key: made[key] for key in ("name", "description")} == {
        key: reported[key] for key in ("name", "description")
    }
    assert made["like"] == (own_tables(ROOT / reported["like"])[1]["like"] if name in ON_BASES else reported["like"])


def test_no_other_preset_says_that_a_fit_made_it() -> None:
    assert {p.stem for p in PRESETS.glob("*.toml") if "livebass fit" in p.read_text()} == set(FITS)


@pytest.mark.parametrize("name", ON_BASES)
def test_a_preset_differs_from_its_base_in_what_a_fit_decides(name: str) -> None:
    made, base = own_tables(name)[1], own_tables(ROOT / FITS[name]["like"])[1]
    assert made.keys() == base.keys()
    for section, there in base.items():
        of_each = zip(made[section], there, strict=True) if isinstance(there, list) else [(made[section], there)]
        for new, old in of_each:
            if isinstance(old, dict):
                assert {key for key in new.keys() | old.keys() if new.get(key) != old.get(key)} <= DECIDED
            else:
                assert new == old or section in DECIDED


@pytest.mark.parametrize("name", ON_BASES)
def test_a_fit_written_onto_its_base_is_the_fitted_preset(name: str, tmp_path: Path) -> None:
    base = ROOT / FITS[name]["like"]
    text = FIT.format(base)
    written = onto(base.read_text(), text)
    for file, content in (("fit", text), ("onto", written)):
        (tmp_path / f"{file}.toml").write_text(content)
    fitted, made = (preset_tables(tmp_path / f"{file}.toml")[1] for file in ("fit", "onto"))
    assert made | {"name": "Fitted"} == fitted
    comments = [line for line in base.read_text().splitlines() if line.startswith("#")]
    assert comments and set(comments) <= set(written.splitlines()) and written.startswith("# Made by a fit.\n")
