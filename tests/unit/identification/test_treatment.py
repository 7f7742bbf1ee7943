"""Effects added to a recording after the string: reported with their evidence, and left out where that helps."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.own_basses import load_preset
from support.strings import DAMPINGS, FREQUENCIES

from livebass.lab.identification.identify import identify
from livebass.lab.identification.result import Identified
from livebass.lab.identification.treatment import loop_of

RATE, COUNT, SECONDS = 48_000, 20, 4.0
FEW = 8  # modes, where only the messages count
T = np.arange(round(SECONDS * RATE)) / RATE
NU, SIGMA = np.array(FREQUENCIES[:COUNT]), np.array(DAMPINGS[:COUNT])


@cache
def string(noise: float = 1e-4) -> np.ndarray:
    """The published modes of the G, all equally loud at first, with noise."""
    sound = sum(np.exp(-s * T) * np.sin(2 * np.pi * nu * T) for nu, s in zip(NU, SIGMA, strict=True))
    sound = np.asarray(0.5 * sound / np.abs(sound).max())
    return sound + np.random.default_rng(3).normal(scale=noise, size=T.size)


def loop(sound: np.ndarray, since: float = 0.8, length: float = 0.2) -> np.ndarray:
    first, turn = round(since * RATE), round(length * RATE)
    return sound[np.where(np.arange(sound.size) < first, np.arange(sound.size), 0) + np.where(
        np.arange(sound.size) < first, 0, first + (np.arange(sound.size) - first) % turn)]  # fmt: skip


def fade(sound: np.ndarray, seconds: float = 1.0) -> np.ndarray:
    return sound * np.clip((T[-1] - T) / seconds, 0, 1)


def compress(sound: np.ndarray, threshold: float = -12.0, ratio: float = 4.0) -> np.ndarray:
    """A compressor that follows the level within 50 ms and releases below the threshold (dB below the loudest)."""
    window = np.hanning(round(0.1 * RATE))
    level = 10 * np.log10(np.convolve(sound**2, window / window.sum(), "same") + 1e-12)
    over = np.maximum(level - level.max() - threshold, 0.0)
    return sound * 10 ** (-over * (1 - 1 / ratio) / 20)


def listen(folder: Path, sound: np.ndarray, lead: bool = True, modes: int = COUNT) -> Identified:
    silence = np.random.default_rng(2).normal(scale=1e-4, size=RATE // 4 if lead else 0)
    soundfile.write(folder / "g.wav", np.concatenate([silence, sound]), RATE, subtype="PCM_24")
    return identify(folder / "g.wav", load_preset("paper-g"), modes=modes)


def test_an_untouched_note_raises_no_doubt(tmp_path: Path) -> None:
    assert listen(tmp_path, string()).doubts == ()


@pytest.mark.parametrize(
    ("length", "noise"), [(0.0102 * 3, 0.0), (0.0102 * 3, 3e-3), (0.2, 1e-4), (0.7, 0.0), (0.7, 3e-3)]
)
def test_a_loop_is_found_and_left_out(tmp_path: Path, noise: float, length: float) -> None:
    result = listen(tmp_path, loop(string(noise), 1.0, length), modes=FEW)
    (doubt,) = (d for d in result.doubts if "loop" in d)
    assert f"repeats itself every {round(length * RATE) / RATE:.4g} s" in doubt
    assert 0.9 < result.takes[0].duration_s < 1.0 + length + 0.25


def test_a_loop_left_out_leaves_the_dampings(tmp_path: Path) -> None:
    result = listen(tmp_path, loop(string(), 1.0, 0.2))
    off = [abs(np.log(p.damping / SIGMA[p.number - 1])) for p in result.partials]
    assert len(off) == COUNT and np.median(off) < 0.02


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-4, 1e-2])
def test_strings_and_sines_are_no_loops(noise: float) -> None:
    """They repeat after a period too; a lone sine after every one."""
    rng = np.random.default_rng(1)
    for sound in (string(0.0), np.exp(-0.3 * T) * np.sin(2 * np.pi * 41.2 * T), np.sin(2 * np.pi * 50 * T)):
        assert loop_of(sound + rng.normal(scale=noise + 1e-7, size=T.size), RATE) is None


@pytest.mark.parametrize(
    ("done", "says"),
    [
        (lambda x: x[: round(1.2 * RATE)], "is cut after 1.2 s, where it has fallen by"),
        (lambda x: compress(x), "a compressor that lets go there"),
        (lambda x: fade(x), "a fade, or a hand"),
    ],
    ids=["cut", "compressed", "faded"],
)
def test_what_was_done_is_said(tmp_path: Path, done: Callable[[np.ndarray], np.ndarray], says: str) -> None:
    (doubt,) = listen(tmp_path, done(string())).doubts
    assert says in doubt and "g.wav: the note at 0.2" in doubt


def test_a_fade_left_out_leaves_the_dampings(tmp_path: Path) -> None:
    result = listen(tmp_path, fade(string()))
    off = [abs(np.log(p.damping / SIGMA[p.number - 1])) for p in result.partials]
    assert len(off) == COUNT and np.median(off) < 0.1 and result.takes[0].duration_s < 3.3


def test_a_note_without_its_attack(tmp_path: Path) -> None:
    (doubt,) = listen(tmp_path, string()[round(0.3 * RATE) + 37 :], lead=False, modes=FEW).doubts
    assert "its attack is cut off" in doubt
