"""Custom impulse responses: the part read of a sound file, and one clear line for any unusable file."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import soundfile
from scipy.signal import butter, fftconvolve, sosfilt
from support.command import Run, refusal
from support.levels import rms

from livebass import load_preset, quality_with, render_to_array, score_of
from livebass.model.instrument import Response
from livebass.preset.response import load_response
from livebass.preset.source import PresetError
from livebass.rows.units import decibels

RATE = 48_000
GOOD = np.exp(-np.arange(2000) / 300)
BAD = {
    "long": (np.ones(RATE + 1), RATE, "lasts 1 s without silence; a response lasts 1 s at most"),
    "hall": (np.tile([1.0, -0.5], 60_000), RATE, "lasts 2.5 s without silence"),
    "endless": (np.append(np.zeros(61 * 8000), 1.0), 8000, "lasts 61 s; a response lasts 60 s at most"),
    "slow": (GOOD, 7999, "its rate must be from 8000 to 192000 Hz, not 7999 Hz"),
    "fast": (GOOD, 192_001, "its rate must be from 8000 to 192000 Hz, not 192001 Hz"),
    "nan": (np.where(np.arange(2000) == 7, np.nan, GOOD), RATE, "sample 7 is not a finite number"),
    "infinite": (np.where(np.arange(2000) == 9, -np.inf, GOOD), RATE, "sample 9 is not a finite number"),
    "nan-left": (np.stack([np.where(np.arange(2000) == 5, np.nan, GOOD), GOOD], 1), RATE, "sample 5 is not a finite"),
    "silent": (0 * GOOD, RATE, "is silent"),
    "nothing": (1e-20 * GOOD, RATE, "is silent"),
    "both-silent": (np.zeros((90, 2)), RATE, "is silent"),
    "empty": (GOOD[:0], RATE, "is silent"),
}


def play(response: Response) -> np.ndarray:
    return np.frombuffer(response.played)


def given(
    folder: Path, sound: np.ndarray, rate: int = RATE, subtype: str = "DOUBLE", normalized: bool = False
) -> Response:
    soundfile.write(folder / "given.wav", sound, rate, subtype=subtype)
    return load_response(folder / "given.wav", normalized)


def test_a_response_is_as_the_file_has_it_without_its_silent_end(tmp_path: Path) -> None:
    sound = np.concatenate([np.zeros(5), GOOD, np.full(300, 9e-7)])
    found = given(tmp_path, sound, 44_100)
    assert (found.rate, found.count, found.remark) == (44_100, 5 + len(GOOD), "")
    assert np.array_equal(play(found), sound[: found.count])
    with pytest.raises(PresetError, match="its loudest sample is 101, allowed up to 100"):
        given(tmp_path, 101 * GOOD)


@pytest.mark.parametrize("floor", [0.0, 3e-4])
def test_what_sounds_of_a_longer_file_is_a_response(tmp_path: Path, floor: float) -> None:
    """Silence before and after it is cut off, even if it is a recording's noise."""
    rng = np.random.default_rng(3)
    sound = np.concatenate([np.zeros(RATE), 0.1 * GOOD, np.zeros(3 * RATE)])
    sound += 0.1 * floor * rng.uniform(-1, 1, len(sound))
    for normalized in (False, True):
        found = play(given(tmp_path, sound, normalized=normalized))
        assert len(GOOD) <= len(found) <= len(GOOD) + RATE // 50
        gain = found[0] / sound[RATE]
        kept = len(GOOD) // 2  # its very end fades out
        assert found[:kept] == pytest.approx(gain * sound[RATE : RATE + kept], rel=1e-12)
        assert normalized or gain == 1


def test_silence_before_the_sound_goes_where_the_level_is_set(tmp_path: Path) -> None:
    late = np.concatenate([np.zeros(4000), [1e-4], GOOD])
    kept, cut = given(tmp_path, late), given(tmp_path, late, normalized=True)
    assert np.array_equal(play(kept), late) and len(play(cut)) == len(GOOD)


CHANNELS = {
    "the same": ([GOOD, GOOD], GOOD, "2 channels; the left one is played"),
    "others": ([0.01 * GOOD, GOOD[::-1]], 0.01 * GOOD, "2 channels; the left one is played"),
    "right": ([1e-5 * GOOD, GOOD], GOOD, "2 channels; the right one is played; the left one is silent"),
    "third": ([0 * GOOD, 0 * GOOD, GOOD, GOOD[::-1]], GOOD, "4 channels; channel 3 is played; what comes"),
    "bad right": ([GOOD, np.where(GOOD > 0.99, -np.inf, 0)], None, "sample 0 is not a finite number"),
}


@pytest.mark.parametrize("name", CHANNELS)
def test_one_channel_is_taken_and_said(tmp_path: Path, run: Run, name: str) -> None:
    channels, wanted, says = CHANNELS[name]
    file = tmp_path / "given.wav"
    if wanted is None:
        with pytest.raises(PresetError, match=says):
            given(tmp_path, np.stack(channels, 1))
        return
    found = given(tmp_path, np.stack(channels, 1))
    assert np.array_equal(play(found), wanted) and found.remark.startswith(f"{file}: {says}")
    assert found == given(tmp_path, wanted), "the remark is no part of it"
    if name == "right":
        given(tmp_path, np.stack(channels, 1))
        line = ("render", "--note", "A1", "--duration", "0.1", "--modes", 30, "--tail", 0, "-o", tmp_path / "out.wav")
        status, _, err = run(*line, "--response", file)
        assert status == 0 and err.count(found.remark) == 1
        (tmp_path / "mine.toml").write_text('like = "jazz-finger"\n[effects]\nresponse = "given.wav"\n')
        status, out, _ = run("presets", "check", tmp_path / "mine.toml")
        assert status == 0 and found.remark in out.splitlines()


def band_pass(rate: int, low: float, high: float) -> np.ndarray:
    """A cabinet that passes frequencies from `low` to `high` (Hz), the same at any rate."""
    sos = butter(2, [low, min(high, 0.45 * rate)], "band", fs=rate, output="sos")
    return np.asarray(sosfilt(sos, np.arange(rate // 5) == 0))


@cache
def phrase() -> np.ndarray:
    """A few notes of a bass, at RATE."""
    notes = [(0.4 * k, 0.35, note, 100) for k, note in enumerate((28, 33, 38, 43))]
    return render_to_array(load_preset("jazz-finger"), score_of(notes, RATE), quality_with("live", modes=60)).sum(0)


@pytest.mark.parametrize(
    ("low", "high", "near"), [(70, 5000, 1.0), (50, 900, 1.0), (80, 12_000, 1.0), (300, 3000, 3.5)]
)
def test_every_response_leaves_a_bass_as_loud(tmp_path: Path, low: float, high: float, near: float) -> None:
    dry = phrase()
    found = []
    for level in (1e-4, 0.02, 40.0):
        samples = level * band_pass(RATE, low, high)
        response = play(given(tmp_path, samples, normalized=True))
        found.append(decibels(rms(fftconvolve(dry, response)[: len(dry)]) / rms(dry)))
        assert abs(found[-1]) < near
    assert found == pytest.approx([found[0]] * 3, abs=1e-6), "whatever the level of the file"


@pytest.mark.parametrize(
    ("rate", "subtype"), [(44_100, "PCM_24"), (96_000, "FLOAT"), (192_000, "DOUBLE"), (44_100, "PCM_16")]
)
def test_the_level_is_the_same_at_every_rate_and_in_every_format(tmp_path: Path, rate: int, subtype: str) -> None:
    """Gains at a bass's frequencies: a response at another rate has other samples but the same gains."""

    def gains(rate: int, subtype: str) -> list[float]:
        samples = band_pass(rate, 70, 4000)
        samples = play(given(tmp_path, samples / np.abs(samples).max(), rate, subtype, True))
        at = np.exp(-2j * np.pi * np.outer((60, 200, 1000), np.arange(len(samples))) / rate)
        return [decibels(float(each)) for each in np.abs(at @ samples)]

    assert gains(rate, subtype) == pytest.approx(gains(RATE, "DOUBLE"), abs=0.2)


def test_one_sample_is_no_change_and_high_notes_alone_are_not_made_a_scream(tmp_path: Path) -> None:
    for rate in (8000, RATE, 192_000):
        assert play(given(tmp_path, np.array([0.0, -0.003, 0.0]), rate, normalized=True)) == pytest.approx([-1.0])
    high = play(given(tmp_path, band_pass(RATE, 15_000, 16_000), normalized=True))
    assert np.abs(np.fft.rfft(high, 1 << 16)).max() < 100
    assert len(play(given(tmp_path, np.full(9000, 0.5), normalized=True))) == 9000


def test_level_by_key_and_by_option(tmp_path: Path, run: Run) -> None:
    """A preset's response keeps the file's level unless the preset says otherwise; --response is normalized."""
    quiet = 0.001 * band_pass(RATE, 70, 5000)
    soundfile.write(tmp_path / "cab.wav", quiet, RATE, subtype="DOUBLE")

    def preset(*lines: str) -> Path:
        name = tmp_path / "mine.toml"
        name.write_text("\n".join(['like = "jazz-finger"', "[effects]", *lines]))
        return name

    def effects(*lines: str) -> Response:
        found = load_preset(preset(*lines)).effects.response
        assert found
        return found

    cabinet = 'response = "cab.wav"'
    assert effects(cabinet) == effects(cabinet, 'response_level = "file"') == load_response(tmp_path / "cab.wav", False)
    assert effects(cabinet, 'response_level = "normalized"') == load_response(tmp_path / "cab.wav")
    with pytest.raises(PresetError, match=r"effects.response_level must be normalized or file"):
        effects(cabinet, 'response_level = "loud"')

    def level(*arguments: object) -> float:
        out = tmp_path / "out.wav"
        line = ("render", "--note", "A1", "--duration", "0.2", "--modes", 40, "--tail", 0, "--bits", "float")
        assert run(*line, *arguments, "-o", out)[0] == 0
        return decibels(rms(soundfile.read(out)[0]))

    option = ("--response", tmp_path / "cab.wav")
    as_file, normal, dry = level("-p", preset(cabinet)), level(*option), level()
    assert as_file < dry - 40 and abs(normal - dry) < 3
    for expected, arguments in (
        (as_file, (*option, "--response-level", "file")),
        (normal, ("-p", preset(cabinet), "--response-level", "normalized")),
    ):
        assert level(*arguments) == pytest.approx(expected, abs=1e-3)
    kept = preset(cabinet, 'response_level = "normalized"')
    assert level("-p", kept) == pytest.approx(normal, abs=1e-3)
    assert level("-p", kept, "--response-level", "file") == pytest.approx(as_file, abs=1e-3)
    status, _, err = run("render", "--note", "A1", "--duration", "0.1", "--modes", 30, "--tail", 0,
                         "--response-level", "file", "-o", tmp_path / "out.wav")  # fmt: skip
    assert status == 0 and "has no response; --response-level changes nothing" in err


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_response_is_one_line(name: str, run: Run, tmp_path: Path) -> None:
    sound, rate, says = BAD[name]
    file = tmp_path / f"{name}.wav"
    soundfile.write(file, sound, rate, subtype="DOUBLE")
    err = refusal(run, "render", "--note", "A1", "--response", file, "-o", tmp_path / "out.wav")
    assert f"{file}: {says}" in err and not (tmp_path / "out.wav").exists()


def test_a_missing_file_and_a_file_of_another_kind(run: Run, tmp_path: Path) -> None:
    (tmp_path / "text.wav").write_text("no sound")
    (tmp_path / "song.wav").write_bytes(b"\x18FICHIER GUITAR PRO v5.10" + bytes(99))
    os.mkfifo(tmp_path / "pipe")
    for name, says in (
        ("none.wav", "no such file"),
        ("text.wav", "not a sound file"),
        ("song.wav", "a Guitar Pro 5 file, not a sound file; export it as MIDI"),
        (".", "is a directory"),
        ("pipe", "is not a regular file"),
    ):
        assert says in refusal(run, "play", "--response", tmp_path / name)


def test_a_preset_says_which_key_is_wrong(tmp_path: Path, run: Run) -> None:
    preset = tmp_path / "mine.toml"
    text = run("presets", "show", "jazz-finger")[1]
    for line, says in (
        ('response = "none.wav"', f"effects.response: {tmp_path}/none.wav: no such file"),
        ("response = 3", "effects.response must be a sound file such as WAV of at most 1 s, 8000 to 192000 Hz"),
        ("drive = 1.5", "effects.drive must be a number from 0 to 1"),
        ("gain = 1", "effects.gain: unknown key; "),
        ("eq_bass = 3", 'effects.eq_bass must be a text with a unit such as "-15 dB"'),
        ('eq_bass = "16 dB"', "effects.eq_bass must be from -15 dB to 15 dB"),
        ('eq_low_mid_frequency = "4 kHz"', "effects.eq_low_mid_frequency must be from 0.1 kHz to 1 kHz, not"),
        ('cabinet = "2x12"', "effects.cabinet must be none or closed-4x10 or closed-8x10 or vented-1x15"),
    ):
        preset.write_text(f"{text}\n[effects]\n{line}\n")
        with pytest.raises(PresetError) as caught:
            load_preset(preset)
        assert says in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("option", [["--compression", "1.1"], ["--drive", "-0.1"], ["--drive", "nan"]])
def test_knobs_go_from_0_to_1(option: list[str], run: Run) -> None:
    refusal(run, "render", "--note", "A1", *option)


@pytest.mark.parametrize(
    ("option", "says"),
    [
        (["--eq-treble", "15.1"], "from -15 dB to 15 dB"), (["--eq-high-mid-frequency", "100Hz"], "500 Hz"),
        (["--cabinet", "2x12"], "'closed-4x10'"), (["--limiter", "maybe"], "'amp', 'off', 'on'"),
    ],
)  # fmt: skip
def test_an_amp_has_its_limits(option: list[str], says: str, run: Run) -> None:
    assert says in refusal(run, "render", "--note", "A1", *option)
