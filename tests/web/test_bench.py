"""The luthier's bench of the page: what it changes is what a preset with these keys is, byte for byte, and is kept."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.browser import chromium, open_page

from livebass import load_preset
from livebass.model.instrument import Effects
from livebass.plugin.instrument import instrument_file
from livebass.preset.build import PresetError
from livebass.preset.keys import KEYS
from livebass.units import DIMENSIONS, quantity
from livebass.web.bench import CONTROLS, Source, bench
from livebass.web.export import export_page

# The preset that the page saves, and the instrument file that it builds, of a bass with these values
MADE = """
const [name, values, done] = arguments;
(async () => {
  const own = benches.get(name), kept = own.slots;
  own.slots = {A: {}, B: {}};
  try {
    own.setAll(values);
    const bytes = new Uint8Array(await changedFile(name, await read(`basses/${name}.lbass`)));
    let text = "";
    for (let k = 0; k < bytes.length; k += 32768) text += String.fromCharCode(...bytes.subarray(k, k + 32768));
    done({toml: own.toml(), file: btoa(text)});
  } catch (error) {
    done({toml: own.toml(), error: error.message});
  } finally {
    own.slots = kept;
  }
})();
"""
BASSES = ("jazz-finger", "slap", "fretless", "paper-bass", "five-string-active")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder = tmp_path_factory.mktemp("bench")
    file = export_page({name: load_preset(name) for name in BASSES}, folder / "page", single=True)
    with chromium(folder / "profile", loggingPrefs={"browser": "ALL"}) as driver:
        driver.set_script_timeout(60)
        open_page(driver, file.as_uri())
        yield driver


def made(page: Any, name: str, values: dict[str, float]) -> tuple[str, bytes | str]:
    """The preset that the page saves of a bass with these values; and its instrument file, or why there is none."""
    found = page.execute_async_script(MADE, name, values)
    return found["toml"], found["error"] if "error" in found else base64.b64decode(found["file"])


def each_slider(name: str) -> Iterator[dict[str, float]]:
    """The values of a bench with one slider moved, each to two places."""
    for control in sliders(name):
        symbol = "lift7" if control["symbol"] == "lift" else control["symbol"]
        span = control["most"] - control["least"]
        for part in (0.3, 0.62):
            yield {symbol: round(control["least"] + part * span, 6)}


def sliders(name: str) -> list[dict[str, Any]]:
    found = bench(load_preset(name), Source(name))
    assert found
    return list(found["controls"])


@pytest.mark.parametrize("name", BASSES)
def test_each_slider_makes_the_instrument_file_of_the_saved_preset(page: Any, tmp_path: Path, name: str) -> None:
    usual, refused = instrument_file(load_preset(name)), []
    for values in each_slider(name):
        toml, file = made(page, name, values)
        (tmp_path / "saved.toml").write_text(toml)
        if isinstance(file, str):  # a neck that nobody can play, here as there
            with pytest.raises(PresetError, match=re.escape(file.split(" mm ")[0])):
                load_preset(tmp_path / "saved.toml")
            refused.append(values)
            continue
        assert file == instrument_file(load_preset(tmp_path / "saved.toml")) != usual, (values, toml)
    wanted = [{"action": 3.91}, {"relief": 1.24}]  # a board that would begin above the strings
    assert refused == (wanted if name == "fretless" else [])


def test_all_at_once_is_the_saved_preset(page: Any, tmp_path: Path) -> None:
    for name in BASSES:
        values: dict[str, float] = {}
        for one in each_slider(name):
            values |= {symbol: value for symbol, value in one.items() if symbol not in values}
        if name == "fretless":
            values |= {"nut_height": 0.6}
        toml, file = made(page, name, values | ({"lift5": 0.1} if "lift7" in values else {}))
        (tmp_path / "saved.toml").write_text(toml)
        assert file == instrument_file(load_preset(tmp_path / "saved.toml")), (name, toml)


def test_a_bass_as_it_was_exported_keeps_what_was_given(tmp_path: Path) -> None:
    """Tuning, hands and effects that were options of the export are in the preset that the page saves."""
    source = Source("jazz-finger", {"tuning": "drop-d", "a4": 442.0})
    bass = load_preset("jazz-finger", **source.given)
    bass = replace(bass, player=replace(bass.player, floor_noise=-200.0, wheel="slide"), effects=Effects(drive=0.25))
    found = bench(bass, source)
    assert found and not {"gauge", "tension", "damping", "mute"} & {c["symbol"] for c in found["controls"]}
    text = ["like = " + json.dumps(found["like"])]
    for section, keys in found["head"].items():
        text += [f"[{section}]"] * bool(section) + [f"{name} = {value}" for name, value in keys.items()]
    (tmp_path / "saved.toml").write_text("\n".join(text))
    assert load_preset(tmp_path / "saved.toml") == bass
    assert bench(load_preset("slap"), source) is None


def test_sliders_stay_within_what_their_keys_allow() -> None:
    for control in CONTROLS:
        key = next(key for key in KEYS if f"{key.section}.{key.name}" == control.key)
        assert control.least < control.most and control.step < control.most - control.least
        if control.unit == "x" or control.symbol in ("height", "lift", "mute"):
            continue
        kind = key.kind.removesuffix("[]")
        least, most = (quantity(x, kind) if kind in DIMENSIONS else float(x) for x in (key.least, key.most))
        size = DIMENSIONS[kind].units[control.unit] if control.unit else 1.0
        assert least <= control.least * size and control.most * size <= most, control
