"""Impulse responses of one's own: what is read of a sound file, and one clear line for any that is none."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import Run, assert_one_clear_line

from livebass import load_preset
from livebass.preset.response import load_response
from livebass.preset.source import PresetError

RATE = 48_000
GOOD = np.exp(-np.arange(2000) / 300)
BAD = {
    "stereo": (np.stack([GOOD, GOOD], 1), RATE, "has 2 channels; a response is mono"),
    "long": (np.append(np.zeros(RATE), 1.0), RATE, "lasts 1 s; a response lasts 1 s at most"),
    "slow": (GOOD, 7999, "has 7999 Hz; allowed are 8000 to 192000 Hz"),
    "fast": (GOOD, 192_001, "has 192001 Hz"),
    "nan": (np.where(np.arange(2000) == 7, np.nan, GOOD), RATE, "sample 7 is not a finite number"),
    "infinite": (np.where(np.arange(2000) == 9, -np.inf, GOOD), RATE, "sample 9 is not a finite number"),
    "silent": (0 * GOOD, RATE, "is silent"),
    "empty": (GOOD[:0], RATE, "is silent"),
    "loud": (101 * GOOD, RATE, "its loudest sample is 101, allowed up to 100"),
}


def test_a_response_is_as_the_file_has_it_without_its_silent_end(tmp_path: Path) -> None:
    sound = np.concatenate([np.zeros(5), GOOD, np.full(300, 9e-7)])
    soundfile.write(tmp_path / "a.wav", sound, 44_100, subtype="DOUBLE")
    found = load_response(tmp_path / "a.wav")
    assert (found.rate, found.count) == (44_100, 5 + len(GOOD))
    assert np.array_equal(np.frombuffer(found.samples), sound[: found.count])


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_response_is_one_line(name: str, run: Run, tmp_path: Path) -> None:
    sound, rate, says = BAD[name]
    file = tmp_path / f"{name}.wav"
    soundfile.write(file, sound, rate, subtype="DOUBLE")
    status, _, err = run("render", "--note", "A1", "--response", file, "-o", tmp_path / "out.wav")
    assert_one_clear_line(status, err)
    assert f"{file}: {says}" in err and not (tmp_path / "out.wav").exists()


def test_a_missing_file_and_a_file_of_another_kind(run: Run, tmp_path: Path) -> None:
    (tmp_path / "text.wav").write_text("no sound")
    os.mkfifo(tmp_path / "pipe")
    for name, says in (
        ("none.wav", "no such file"),
        ("text.wav", "not a sound file"),
        (".", "is a directory"),
        ("pipe", "is not a regular file"),
    ):
        status, _, err = run("play", "--response", tmp_path / name)
        assert_one_clear_line(status, err)
        assert says in err


def test_a_preset_says_which_key_is_wrong(tmp_path: Path, run: Run) -> None:
    preset = tmp_path / "mine.toml"
    text = run("presets", "show", "jazz-finger")[1]
    for line, says in (
        ('response = "none.wav"', f"effects.response: {tmp_path}/none.wav: no such file"),
        ("response = 3", "effects.response = 3: allowed: a mono WAV file of at most 1 s, 8000 to 192000 Hz"),
        ("drive = 1.5", "effects.drive = 1.5: allowed: a number from 0 to 1"),
        ("gain = 1", "effects.gain: unknown key; "),
    ):
        preset.write_text(f"{text}\n[effects]\n{line}\n")
        with pytest.raises(PresetError) as caught:
            load_preset(preset)
        assert says in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("option", [["--compression", "1.1"], ["--drive", "-0.1"], ["--drive", "nan"]])
def test_knobs_go_from_0_to_1(option: list[str], run: Run) -> None:
    assert_one_clear_line(*run("render", "--note", "A1", *option)[::2])
