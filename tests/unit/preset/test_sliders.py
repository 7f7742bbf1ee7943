"""The sections [bench] and [plugin] of a preset: sliders, in the units of plugins and links."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import Run
from support.presets import load_text as of

from livebass import load_preset
from livebass.model.bench import change_bass
from livebass.preset.build import PresetError
from livebass.preset.keys import KEYS
from livebass.rows.techniques import PARAMETER_ROWS, SLIDER_ROWS


def test_each_parameter_that_a_sound_keeps_is_a_key() -> None:
    wanted = {p.symbol for p in PARAMETER_ROWS.values() if p.group != "Processor" and p.symbol != "bass"}
    keys = {key.name: key for key in KEYS if key.section in ("bench", "plugin")}
    assert keys.keys() == wanted and {name for name in keys if keys[name].section == "bench"} == SLIDER_ROWS.keys()
    assert all(float(key.minimum) <= 0 < float(key.maximum) and key.default is None for key in keys.values())


def test_the_sliders_change_what_the_other_sections_say(tmp_path: Path) -> None:
    text = 'like = "slap"\ncapo = 2\n[neck]\ncontact_loss = "90 N s/m"\n[bench]\n'
    plain = of(tmp_path, text)
    made = of(tmp_path, text + "gauge = 10\nwear = 50.004\ncontact_loss = 100\n[plugin]\ngain = -3\n")
    assert made == change_bass(replace(plain, played=(("gain", -3.0),)), {"gauge": 10, "wear": 50, "contact_loss": 100})
    assert made.necks[0].contact_loss == 180.0
    assert of(tmp_path, text + "action = -1\n") == plain  # with a capo heights stay


def test_a_preset_that_is_like_one_with_sliders_has_them(tmp_path: Path) -> None:
    of(tmp_path, 'like = "slap"\n[bench]\ngauge = 10\nwear = 50\n', "other.toml")
    made = of(tmp_path, 'like = "other.toml"\n[bench]\nwear = 0\naction = -0.5\n')
    assert made == change_bass(load_preset("slap"), {"gauge": 10, "action": -0.5})


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("[bench]\naction = 4", "bench.action must be a number from -2 to 3"),
        ('[bench]\naction = "1 mm"', "bench.action must be a number from -2 to 3"),
        ("[bench]\nfret = 1.5", "bench.fret must be a whole number from 0 to 24"),
        ("[bench]\nacton = 1", "bench.acton: unknown key; nearest: action"),
        ("[plugin]\ngain = 99", "plugin.gain must be a number from -60 to 20"),
        ("[bench]\nfret = 7\nfret_height = 1.5\naction = -1.9", "string[E].neck: fret 7 stands 0.86 mm above string E"),
        ("[[bench]]\naction = 1", "bench must be a table of keys such as bench.action"),
    ],
)
def test_faults_are_one_line(tmp_path: Path, lines: str, says: str) -> None:
    with pytest.raises(PresetError) as caught:
        of(tmp_path, f'like = "jazz-finger"\n{lines}\n')
    assert str(caught.value).startswith(f"{tmp_path / 'mine.toml'}: {says}")


def test_the_values_of_a_plugin_play_the_bass(tmp_path: Path, run: Run) -> None:
    made = of(tmp_path, 'like = "slap"\n[bench]\ngauge = 10\n[plugin]\ntone = 0.3\ndrive = 0.5\n')
    assert made.played == (("tone", float(np.float32(0.3))),) and made.effects.drive == 0.5
    status, out, err = run("presets", "check", tmp_path / "mine.toml")
    assert status == 0 and "plugin.tone" not in out + err and "plugin.drive" not in out + err


def test_choices_of_a_plugin_are_those_of_a_preset(tmp_path: Path) -> None:
    lines = "eq_bass = -3\neq_low_mid_frequency = 2\ncabinet = 4\nlimiter = 2"
    made = of(tmp_path, f'like = "slap"\n[plugin]\n{lines}\n').effects
    given = 'eq_bass = "-3 dB"\neq_low_mid_frequency = "250 Hz"\ncabinet = "vented-1x15"\nlimiter = "off"\n'
    assert made == of(tmp_path, f'like = "slap"\n[effects]\n{given}').effects
    none = of(tmp_path, 'like = "scooped-slap"\n[plugin]\ncabinet = 1\n').effects
    assert none.cabinet == "none" and none.eq_bass == 6.0
