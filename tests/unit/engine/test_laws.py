"""Laws of the engine, to the bit: blocks split anywhere, threads change nothing, same input, same file.

Also: nothing aliases, and the kernel cache notices a change in any kernel source.
"""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.own_basses import load_preset
from support.quiet import without_noise
from support.scores import QUICK, RATE, busy_score, in_blocks

from livebass import Quality, render_to_file
from livebass.compiling import store
from livebass.engine.engine import Engine


@pytest.mark.parametrize("preset", ["slap", "paper-bass"])
def test_splitting_a_block_anywhere_changes_nothing(preset: str) -> None:
    score = busy_score()
    whole = in_blocks(score, [10**9], preset)
    assert np.abs(whole).max(axis=1).all(), "every string plays"
    singly = [1] * 1000 + [score.end_frame // 2]  # at the beginning and in the middle
    for sizes in (singly, [63], [64], [65], [1000, 1, 63, 64, 65, 7]):
        assert np.array_equal(in_blocks(score, sizes, preset), whole), sizes


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["slap", "paper-bass"])
def test_frames_one_by_one_change_nothing(preset: str) -> None:
    score = busy_score()
    assert np.array_equal(in_blocks(score, [1], preset), in_blocks(score, [10**9], preset))


def test_threads_change_nothing() -> None:
    bass, score = load_preset("slap"), busy_score()
    alone = list(Engine(bass, QUICK, RATE, workers=1).play(score, 0.5))
    together = list(Engine(bass, QUICK, RATE, workers=4).play(score, 0.5))
    assert all(np.array_equal(a, b) for a, b in zip(alone, together, strict=True))


def test_the_same_input_gives_the_same_bytes(tmp_path: Path) -> None:
    bass, score = load_preset("jazz-finger"), busy_score()
    for name in ("first", "second"):
        render_to_file(bass, score, tmp_path / f"{name}.wav", quality=QUICK, rate=RATE, seed=3)
    assert (tmp_path / "first.wav").read_bytes() == (tmp_path / "second.wav").read_bytes()


def test_stems_add_up_to_the_mix(tmp_path: Path) -> None:
    report = render_to_file(
        load_preset("slap"), busy_score(), tmp_path / "song.wav", quality=QUICK, rate=RATE, bits="float", stems=True
    )
    mix, *stems = (soundfile.read(path, dtype="float32")[0] for path in report.files)
    assert len(stems) == 4
    total = stems[0].copy()
    for stem in stems[1:]:
        assert np.abs(stem).max() > 0.01
        total += stem
    assert np.array_equal(total, mix)


@pytest.mark.parametrize(("preset", "exact"), [("jazz-finger", False), ("paper-bass", True)])
def test_what_48_khz_gives_is_what_192_khz_has_below_its_limit(preset: str, exact: bool) -> None:
    """Below 18 kHz nothing folds down or is lost: contacts are solved at the same 768 kHz for both rates.

    The tone circuit is left out, as its digital filter differs a little between rates, and so is the tension, which
    follows the motion once a frame. The frets of paper-bass are lossless, so its contacts amplify every difference:
    float32 rounds differently at each rate, to -47 dB. It is played in float64.
    """
    wire = np.array([1.0, 0, 0, 0])
    bass = without_noise(preset)
    bass = dataclasses.replace(bass, strings=tuple(dataclasses.replace(s, axial_stiffness=0.0) for s in bass.strings))
    quality = Quality("the same contacts", 200, 768e3, exact=exact)
    spectra = []
    for rate in (48000, 192000):
        engine = Engine(bass, quality, rate)
        for voice in engine.voices:
            voice.record["b"], voice.record["a"] = wire, wire
        # hard plucks at times common to both rates; no hands, which act once a frame
        frames = np.arange(4) * (rate // 100)
        engine.send(frames, np.array([[0x90, key, 120] for key in (30, 35, 40, 45)], np.uint8))
        sound = engine.process(rate).sum(axis=0)
        assert all(contacts > 5 for _, contacts in (v.note() for v in engine.voices))
        spectra.append(np.fft.rfft(sound * np.hanning(rate))[:18000] / rate)
    low, high = spectra
    heard = np.abs(high) ** 2
    for first, last in ((20, 200), (200, 1000), (1000, 5000), (5000, 10000), (10000, 18000)):
        there = np.sum(heard[first:last]) + 1e-4 * np.sum(heard)  # a band 40 dB below the sound masks nothing
        folded = 10 * np.log10(np.sum(np.abs(low - high)[first:last] ** 2) / there)
        assert folded < -60, f"{first} to {last} Hz"


def test_every_file_that_compiles_is_in_the_key_of_the_cache() -> None:
    """A change in any of `sources` recompiles the kernels."""
    compiles = re.compile(r"^from livebass\.compiling import .*\b(jit|entry|inlined|compiled)\b", re.MULTILINE)
    found = {path for path in store.PACKAGE.rglob("*.py") if compiles.search(path.read_text())}
    assert len(found) > 10 and found <= set(store.sources())
