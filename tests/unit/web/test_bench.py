"""The page's bench: what an export writes of its sliders."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from livebass import load_preset
from livebass.model.instrument import Effects
from livebass.techniques import SLIDER_ROWS
from livebass.web.bench import Source, bench


def sliders(name: str) -> list[dict[str, Any]]:
    found = bench(load_preset(name), Source(name))
    assert found
    return list(found["sliders"])


def test_a_bass_as_it_was_exported_keeps_what_was_given(tmp_path: Path) -> None:
    """The export options for tuning, hands and effects are in the preset that the page saves."""
    source = Source("jazz-finger", {"tuning": "drop-d", "a4": 442.0})
    bass = load_preset("jazz-finger", **source.given)
    bass = replace(bass, player=replace(bass.player, floor_noise=-200.0, wheel="slide"), effects=Effects(drive=0.25))
    found = bench(bass, source)
    assert found and {"gauge", "tension", "action"} <= {slider["symbol"] for slider in found["sliders"]}
    text = ["like = " + json.dumps(found["like"])]
    for section, keys in found["head"].items():
        text += [f"[{section}]"] * bool(section) + [f"{name} = {value}" for name, value in keys.items()]
    (tmp_path / "saved.toml").write_text("\n".join(text))
    assert load_preset(tmp_path / "saved.toml") == bass
    assert bench(load_preset("slap"), source) is None


def test_sliders_are_those_that_change_the_bass_and_say_what_it_has() -> None:
    found = {slider["symbol"]: slider for slider in sliders("jazz-finger")}
    assert len(found) == len(SLIDER_ROWS)
    assert [found["action"][name] for name in ("own", "ownUnit")] == [2.4, "mm"]
    assert [found["neck_relief"]["own"], found["nut_height"]["own"], found["cable"]["own"]] == [0.3, 0.5, 700.0]
    assert [found[f"pickup_{k}_place"]["own"] for k in (1, 2)] == [152.4, 60.96]
    assert found["pickup_2_height"]["name"] == "Bridge pickup: height" and found["fret"]["most"] == 20
    assert not {"fret", "fret_height"} & {slider["symbol"] for slider in sliders("fretless")}
    assert not any(s["group"] == "Pickups" or s["symbol"] == "contact_loss" for s in sliders("paper-bass"))
    for row in SLIDER_ROWS.values():
        p = row.parameter
        assert p.least <= p.usual == 0 < p.most and row.step < p.most - p.least
