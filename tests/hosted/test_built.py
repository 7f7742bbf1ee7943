"""The bench's sliders: a plugin builds the same bass as `livebass render` does from a preset with the same values."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.clap import Plugin, value
from support.picture import Host, library, shelf
from support.plugins import RATE

from livebass import QUALITIES, load_preset, render_to_array, score_of
from livebass.engine.render import mix_strings, single
from livebass.rows.arrays import Floats
from livebass.rows.techniques import SLIDER_ROWS

PRESET = "jazz-finger"
BASSES = (PRESET,)
NUMBERS = {symbol: row.parameter.number for symbol, row in SLIDER_ROWS.items()}
SCORE = score_of([(0.0, 0.5, 28, 110), (0.2, 0.6, 36, 80)], RATE)
FRAMES = 16000


@pytest.fixture
def plugin(folder: Path, lend: Any) -> Plugin:
    return lend(Plugin(folder, active=False))  # type: ignore[no-any-return]


def render(file: Path | str) -> Floats:
    """The sound of a preset by `livebass render`."""
    sound = render_to_array(load_preset(file), SCORE, QUALITIES["live"], tail=0.1)
    return mix_strings(single(sound))[:FRAMES]


def preset_of(values: dict[str, float], folder: Path) -> Path:
    file = folder / "changed.toml"
    file.write_text(f'like = "{PRESET}"\n[bench]\n' + "".join(f"{name} = {x}\n" for name, x in values.items()))
    return file


CASES = {
    "neck": {"action": -0.8, "neck_relief": 0.1, "nut_height": -0.05, "fret": 3, "fret_height": 0.1},
    "strings": {"gauge": 15, "tension": -5, "wear": 300, "foam": 4},
    "pickups": {"pickup_place": -12, "pickup_height": 0.5, "cable": 300, "pickup_2_place": 3.3, "pickup_1_height": -1},
    "hand": {"finger_width": 50, "pluck_angle": 20, "hardest": 20, "neck_resonance": -1.07, "neck_mass": -66.96},
    "loss": {"contact_loss": -100},
}


@pytest.mark.parametrize("case", CASES)
def test_it_sounds_as_the_preset_with_these_values(plugin: Plugin, tmp_path: Path, case: str) -> None:
    """Bit for bit."""
    own, wanted = render(PRESET), render(preset_of(CASES[case], tmp_path))
    for symbol, number in CASES[case].items():
        plugin.set(NUMBERS[symbol], number)
    plugin.activate()
    plugin.offline()  # overload relieves no string offline
    sound = plugin.play(SCORE, FRAMES)
    assert np.array_equal(sound, wanted) and np.abs(own - wanted).max() > 0.02 * np.abs(wanted).max()


def test_a_pages_link_in_a_plugin_sounds_as_a_render(plugin: Plugin, tmp_path: Path, lend: Any) -> None:
    """Bit for bit, pasted into a window and saved with the session; test_change.py: the page makes the same file."""
    values = {"action": -1.2, "gauge": 10, "fret": 7, "fret_height": 0.12, "pickup_2_place": 9.04}
    link = f"https://example.org/livebass/#like={PRESET}&" + "&".join(f"{name}={x}" for name, x in values.items())
    host = lend(Host(shelf(tmp_path, ["slap", PRESET]), RATE))
    assert library().lb_take_text(host.address, link.encode()) is None
    assert plugin.load(host.save())
    plugin.activate()
    plugin.offline()
    assert np.array_equal(plugin.play(SCORE, FRAMES), render(preset_of(values, tmp_path)))


def test_a_state_and_a_change_while_it_plays(plugin: Plugin, folder: Path) -> None:
    """Offline the plugin waits for a change, and a second bounce, of a saved state, is the same."""
    plugin.activate()
    plugin.offline()
    quiet = plugin.play([], 512)
    plugin.set(NUMBERS["gauge"], 20.0)
    given = [(600, value(NUMBERS["foam"], 30.0))]
    first = plugin.play(given, 8192)
    state = plugin.save()
    sound = plugin.play(SCORE, FRAMES)
    assert not quiet.any() and not first.any() and np.abs(sound).max() > 0.01
    with closing(Plugin(folder, active=False)) as other:
        assert other.load(state)
        other.activate()
        again = other.play(SCORE, FRAMES)
    assert np.array_equal(sound, again)
