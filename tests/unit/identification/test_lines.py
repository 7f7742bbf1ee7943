"""The parts of a partial: one line or two, a common glide, and its audible length."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.costs import quick
from support.own_basses import load_preset
from support.strings import DAMPINGS, FREQUENCIES

from livebass.lab.identification.glide import Glide, glide_of, straighten
from livebass.lab.identification.identify import identify
from livebass.lab.identification.partials import Take, track
from livebass.lab.identification.result import Identified
from livebass.rows.units import cents

RATE, F0, COUNT = 48_000, 97.97, 20
NU, SIGMA = np.array(FREQUENCIES[:COUNT]), np.array(DAMPINGS[:COUNT])


def tones(lines: list[tuple[float, float, float]], seconds: float = 4.0, ahead: Glide | None = None) -> np.ndarray:
    """Returns a sum of damped sines (Hz, 1/s, amplitude), on a warped time if they glide, with noise at -80 dB."""
    t = np.arange(round(seconds * RATE)) / RATE
    string = t + ahead.ahead(t) if ahead else t
    sound = np.zeros(t.size)
    for k, (nu, sigma, amplitude) in enumerate(lines):
        sound += amplitude * np.exp(-sigma * t) * np.cos(2 * math.pi * nu * string + k)
    return sound + np.random.default_rng(1).normal(scale=1e-4, size=t.size)


def listen(folder: Path, sound: np.ndarray) -> Identified:
    silence = np.random.default_rng(2).normal(scale=1e-4, size=RATE // 4)
    soundfile.write(folder / "g.wav", 0.02 * np.concatenate([silence, sound]), RATE, subtype="FLOAT")
    return identify(folder / "g.wav", load_preset("paper-g"), modes=COUNT)


def straight_line(lines: list[tuple[float, float, float]], down: float = 30.0) -> float:
    """Returns the damping (1/s) of a straight line through the audible level of `lines`, from 0.1 s on."""
    t = np.arange(0.1, 3.9, 1e-3)
    wave = sum(a * np.exp((2j * math.pi * nu - sigma) * t) for nu, sigma, a in lines)
    level = 20 * np.log10(np.abs(wave))
    last = int(np.argmax(level < level[0] - down)) or t.size
    return float(-np.polyfit(t[:last], level[:last], 1)[0] * math.log(10) / 20)


@pytest.mark.parametrize(
    ("faster", "level", "apart"), quick([(5.0, -10, 0.1), (6.0, -20, 0.4), (3.0, 0, 0.3)], [(6.0, -20, 0.4)])
)
def test_the_t60_of_two_lines_is_that_heard(tmp_path: Path, faster: float, level: float, apart: float) -> None:
    """The louder line dies at once; mostly the other one is heard."""
    slow = 10 ** (level / 20)
    pairs = {j: [(NU[j], faster, 1.0), (NU[j] + apart, 0.4, slow)] for j in (3, 6, 10)}
    lines = [line for j in range(COUNT) for line in pairs.get(j, [(NU[j], SIGMA[j], 1.0)])]
    result = listen(tmp_path, tones(lines))
    by_number = {p.number: p for p in result.partials}
    assert {j for j, p in by_number.items() if p.v} == {4, 7, 11}
    for j, pair in pairs.items():
        p = by_number[j + 1]
        assert p.v is not None and p.u.damping == pytest.approx(faster, rel=0.1)
        assert p.v.damping == pytest.approx(0.4, rel=0.1) and p.v.frequency == pytest.approx(NU[j] + apart, rel=3e-5)
        assert 20 * math.log10(p.v.amplitude / p.u.amplitude) == pytest.approx(level, abs=1.5)
        assert abs(math.log(p.damping / straight_line(pair))) < 0.15 < math.log(faster / p.damping)
    v = result.across
    assert v is not None and v.damping == pytest.approx(0.4 - faster, rel=0.1) and v.detuning > 0
    assert result.string.measured_dampings[3] == by_number[4].damping


def test_a_glide_is_no_second_line(tmp_path: Path) -> None:
    """A string that starts 8 cents sharp: single lines with its own dampings, and the pitch it settles at."""
    glide = Glide(((0.003, 0.3), (0.0016, 0.9)))
    result = listen(tmp_path, tones([(nu, sigma, 1.0) for nu, sigma in zip(NU, SIGMA, strict=True)], ahead=glide))
    assert not any(p.v for p in result.partials) and result.across is None
    np.testing.assert_allclose([p.damping for p in result.partials], SIGMA, rtol=0.03)
    assert max(abs(cents(p.frequency / nu)) for p, nu in zip(result.partials, NU, strict=True)) < 0.5
    (found,) = result.glides
    assert found is not None and found.cents == pytest.approx(glide.cents, rel=0.1)


@pytest.mark.slow
def test_two_lines_that_glide(tmp_path: Path) -> None:
    """It separates the two lines of a partial from the glide of all."""
    glide = Glide(((0.002, 0.5),))
    lines = [(nu, sigma, 1.0) for nu, sigma in zip(NU, SIGMA, strict=True)] + [(NU[4] + 0.8, 0.3, 0.4)]
    result = listen(tmp_path, tones(lines, ahead=glide))
    assert [p.number for p in result.partials if p.v] == [5]
    assert result.across is not None and result.across.detuning == pytest.approx(0.8 / NU[4], rel=0.05)


def test_a_steady_note_has_no_glide() -> None:
    sound = tones([(nu, sigma, 1.0) for nu, sigma in zip(NU, SIGMA, strict=True)])
    take = Take("g.wav", 0.0, sound, RATE)
    assert glide_of(take, track(sound, RATE, F0, COUNT), F0) is None


def test_straightened_sound_is_that_of_a_steady_string() -> None:
    glide = Glide(((0.005, 0.4),))
    lines = [(NU[0], 0.5, 1.0), (NU[9], 1.0, 0.3)]
    take = Take("g.wav", 0.0, tones(lines, 2.0, glide), RATE)
    mine, steady = straighten(take, glide).sound, tones(lines, 2.1)
    # amplitudes stay in place, up to 2 ms later
    assert np.sqrt(np.mean((mine - steady[: mine.size])[RATE // 10 :] ** 2)) < 3e-3
