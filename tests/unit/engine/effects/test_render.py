"""Effects in a render: after the mix only, to the end of their own sound, and not one bit's difference when off."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from scipy.signal import fftconvolve
from support.command import Run
from support.own_basses import load_preset
from support.strings import behind

from livebass import Quality, loudness, render_to_array, single_note
from livebass.engine.basses import Basses
from livebass.engine.engine import Engine, mix_strings, single
from livebass.engine.render import render_to_file
from livebass.model.instrument import Effects, Instrument, Response
from livebass.score.score import Score

RATE = 44_100
LIGHT = Quality("light", 60, 192e3)
JAZZ, SLAP = load_preset("jazz-finger"), load_preset("slap")
TAPS = np.exp(-np.arange(40_000) / 20_000) * np.cos(np.arange(40_000) / 7) / 40
HALL = Response(RATE, TAPS.tobytes())
NOTE = single_note(33, 110, 0.2, RATE)


def write(bass: Instrument, path: Path, score: Score = NOTE, **more: Any) -> np.ndarray:
    render_to_file(bass, score, path, quality=LIGHT, rate=RATE, bits="float", **more)
    return soundfile.read(path, dtype="float32")[0]


def test_a_response_is_heard_in_the_mix_alone_and_to_its_end(tmp_path: Path) -> None:
    dry = write(JAZZ, tmp_path / "dry.wav", stems=True)
    wet = write(behind(JAZZ, response=HALL), tmp_path / "wet.wav", stems=True)
    last = len(dry) - RATE // 50  # both fade out at the end
    assert np.abs(wet[:last] - fftconvolve(dry, TAPS)[:last]).max() < 1e-6 * np.abs(wet).max()
    for string in "EADG":
        alone = [soundfile.read(tmp_path / f"{name}.{string}.wav", dtype="float32")[0] for name in ("dry", "wet")]
        assert np.array_equal(alone[0][:last], alone[1][:last])
    assert len(wet) > len(dry) + RATE // 10, "the response rings on"
    assert np.abs(wet[-RATE // 5 :]).max() < 1e-3 * np.abs(wet).max()
    assert np.array_equal(render_to_array(behind(JAZZ, drive=0.5), NOTE, LIGHT), render_to_array(JAZZ, NOTE, LIGHT))


def test_the_gain_comes_behind_the_effects(tmp_path: Path) -> None:
    bass = behind(JAZZ, compression=0.6, drive=0.4)
    one, other = (write(bass, tmp_path / f"{k}.wav", gain_db=gain, tail=0.1) for k, gain in enumerate((0.0, -12.0)))
    assert np.allclose(other, one * 10 ** (-12 / 20), rtol=1e-6, atol=1e-12)
    assert len(one) == round(0.3 * RATE) and not np.array_equal(one, write(JAZZ, tmp_path / "dry.wav", tail=0.1))


def test_normalizing_measures_what_is_heard(tmp_path: Path) -> None:
    bass = behind(JAZZ, drive=0.8, response=HALL)
    sound = write(bass, tmp_path / "a.wav", single_note(33, 110, 1.0, RATE), normalize=-25.0, stems=True)
    assert loudness(sound, RATE) == pytest.approx(-25, abs=1e-3)
    strings = [soundfile.read(tmp_path / f"a.{name}.wav", dtype="float32")[0] for name in "EADG"]
    assert not np.allclose(mix_strings(np.array(strings)), sound, atol=1e-3)


def mix_of(playing: Engine | Basses, size: int, frames: int = 12_000) -> np.ndarray:
    playing.send(np.array([0, 4000]), np.array([[0x90, 33, 120], [0xC0, 36, 0]], np.uint8))
    out = []
    for begin in range(0, frames, size):
        strings, mix = playing.process_with_mix(min(size, frames - begin))
        out.append(mix_strings(single(strings)) if mix is None else mix)
    return np.concatenate(out)


@pytest.mark.parametrize("size", [100, 4096])
def test_splitting_a_render_changes_nothing(size: int) -> None:
    bass = behind(JAZZ, compression=0.5, drive=0.5, response=HALL)
    assert np.array_equal(mix_of(Engine(bass, LIGHT, RATE), size), mix_of(Engine(bass, LIGHT, RATE), 12_000))


def test_basses_keep_their_own_effects() -> None:
    """A program change brings the new bass's effects; the old bass's remaining sound goes through its own."""

    def basses(first: Instrument, second: Instrument) -> np.ndarray:
        return mix_of(Basses(Engine(first, LIGHT, RATE), {36: second}), 12_000)

    one, other = basses(behind(JAZZ, drive=0.7), SLAP), basses(behind(JAZZ, drive=0.7), behind(SLAP, response=HALL))
    assert np.array_equal(one, other), "the second bass plays no note"
    assert not np.allclose(one, basses(JAZZ, behind(SLAP, drive=0.7)), atol=1e-3)
    assert np.allclose(basses(JAZZ, behind(SLAP, drive=0.7)), basses(JAZZ, SLAP), atol=1e-6)


def test_options_of_a_render_take_the_place_of_the_presets(run: Run, tmp_path: Path) -> None:
    soundfile.write(tmp_path / "hall.wav", TAPS, RATE, subtype="DOUBLE")
    text = run("presets", "show", "jazz-finger")[1]
    preset = tmp_path / "mine.toml"
    preset.write_text(f'{text}\n[effects]\ncompression = 0.5\nresponse = "hall.wav"\n')
    assert load_preset(preset).effects == Effects(compression=0.5, response=HALL)
    assert load_preset("jazz-finger").effects == Effects()
    render = ["render", "--note", "A1", "--duration", "200ms", "--rate", RATE, "--modes", "60", "--bits", "float"]
    for name, given in (
        ("a", ["-p", preset, "--drive", "0.3"]),
        (
            "b",
            ["--response", tmp_path / "hall.wav", "--response-level", "file", "--compression", "0.5", "--drive", "0.3"],
        ),
        ("c", ["-p", preset, "--compression", "0", "--drive", "0.3"]),
    ):
        assert run(*render, *given, "-o", tmp_path / f"{name}.wav")[0] == 0
    a, b, c = (soundfile.read(tmp_path / f"{name}.wav", dtype="float32")[0] for name in "abc")
    assert np.array_equal(a, b) and not np.array_equal(a[:9000], c[:9000])
