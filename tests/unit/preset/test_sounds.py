"""The factory sounds: presets that all play, equally loud."""

from __future__ import annotations

import numpy as np
import pytest
from support.command import Run
from support.costs import of_each_kind, quick

from livebass import QUALITIES, load_preset, preset_names, score_of
from livebass.engine.engine import Engine, single
from livebass.engine.render import mix_strings
from livebass.preset.build import Builder
from livebass.preset.load import preset_tables, preset_text
from livebass.preset.sounds import sound_names, sound_text, sound_title, sound_values, sounds_of
from livebass.rows.arrays import Floats
from livebass.rows.techniques import PARAMETER_ROWS, SLIDER_ROWS
from livebass.sound.meter import LoudnessMeter

RATE = 48000
LINE = [(0.25 * k, 0.23, note, 80) for k, note in enumerate((28, 28, 31, 33, 35, 40, 38, 33))]  # a medium line
LEVEL, APART = -25.0, 1.5  # LUFS, dB


def test_the_sounds_are_presets_with_names_of_their_own() -> None:
    names = sound_names()
    assert len(names) == 34 == len({sound_title(name).casefold() for name in names})
    assert not set(names) & set(preset_names())
    assert sorted(name for bass in preset_names() for name in sounds_of(bass)) == sorted(names)
    for name in names:
        bass = load_preset(name)
        assert bass.name == sound_title(name) and 10 < len(bass.description) < 90
        for symbol, value in sound_values(name).items():
            row = PARAMETER_ROWS[symbol]
            assert row.minimum <= value <= row.maximum and value != row.default, (name, symbol)
            assert symbol in SLIDER_ROWS or symbol in dict(bass.played) or getattr(bass.effects, symbol)


@pytest.mark.parametrize("bass", of_each_kind(name for name in preset_names() if sounds_of(name)))
def test_sounds_pass_the_checks_that_loading_them_omits(bass: str) -> None:
    for name in sounds_of(bass):
        label, tables = preset_tables(name)
        assert Builder(label).instrument(tables) == load_preset(name)
        assert preset_text(name).startswith(sound_text(name).rstrip("\n"))


@pytest.mark.parametrize("name", quick(sound_names(), sound_names()[::5]))
def test_a_medium_line_is_as_loud_as_in_all_sounds(name: str) -> None:
    sound = play(name)
    meter = LoudnessMeter(RATE)
    meter.add(sound.astype(np.float32))
    assert np.isfinite(sound).all() and np.abs(sound).max() < 1.0
    assert abs(meter.loudness() - LEVEL) < APART


def play(name: str) -> Floats:
    """The medium line with effects and gain."""
    bass = load_preset(name)
    made, out = Engine(bass, QUALITIES["live"], RATE), []
    for strings, mix in made.play_with_mix(score_of(LINE, RATE), 0.3):
        out.append(mix_strings(single(strings)) if mix is None else mix)
    return np.asarray(np.concatenate(out) * 10 ** (dict(bass.played).get("gain", 0.0) / 20), np.float64)


def test_the_list_names_them_and_render_plays_them(run: Run, tmp_path: object) -> None:
    status, out, _ = run("presets", "list", "--sounds")
    assert status == 0 and [line.split()[0] for line in out.splitlines() if line[0] != " "] == sound_names()
    assert all(load_preset(name).description in " ".join(out.split()) for name in sound_names())
    assert run("render", "--note", "E1", "-p", "metal-pick", "-o", f"{tmp_path}/metal.wav")[0] == 0
