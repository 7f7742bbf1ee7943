"""Dead spots: where a partial meets a resonance of the neck, against string and neck as one linear system."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.costs import of_each_kind
from support.whole import lines

from livebass import load_preset, preset_names
from livebass.kernels.string import law
from livebass.model.instrument import Speaking, speaking
from livebass.model.modes import dampings, frequencies
from livebass.model.neck import Admittance, Resonance, flat
from livebass.rows.arrays import Floats

PARTIALS = 12
CENTS, PART = 1.0, 0.05  # allowed off the strongest line
ALIKE = 0.9  # a second line as strong as the first to this part may be the one that plays


def ringing(s: Speaking, across: bool) -> tuple[Floats, Floats]:
    """The frequencies (Hz) at which the first partials ring along a, or b if `across`, and their dampings (1/s)."""
    s = replace(s, axes_turned=0.0)
    nu, sigma = frequencies(s, PARTIALS, across), dampings(s, PARTIALS, across)
    return np.sqrt(nu**2 - (sigma / (2 * math.pi)) ** 2), sigma


def off(s: Speaking, across: bool, nu: Floats, sigma: Floats) -> tuple[Floats, Floats]:
    """How far `nu` (cents) and `sigma` (a part) lie off the strongest lines, or off others that are as strong."""
    found = lines(s, PARTIALS, across)
    each = [
        (np.abs(1200 * np.log2(2 * math.pi * nu / line.imag)), np.abs(sigma / -line.real - 1))
        for line in (found.first, found.second)
    ]
    second = (found.share > ALIKE) & (each[1][0] < each[0][0])
    return np.where(second, each[1][0], each[0][0]), np.where(second, each[1][1], each[0][1])


def notes(name: str) -> list[Speaking]:
    bass = load_preset(name)
    return [speaking(*one, k) for one in zip(bass.strings, bass.necks, strict=True) for k in range(13)]


@pytest.mark.parametrize("name", of_each_kind(n for n in preset_names() if not n.startswith("paper-")))
def test_partials_ring_as_string_and_neck_do_together(name: str) -> None:
    for s in notes(name):
        for across in (False, True):
            cents, part = off(s, across, *ringing(s, across))
            assert cents.max() < CENTS and part.max() < PART, (s.string.name, s.fret, across, cents, part)


def test_the_printed_law_would_miss_them() -> None:
    """Eqs. 8 and 9 lie off by 30 cents and four times the damping where the pick's first strings met the neck."""
    bass = load_preset("precision-pick@1")
    s = speaking(bass.strings[2], bass.necks[2], 0)
    cents, part = off(s, False, *ringing(replace(s, paper_law=1), False))
    assert cents[1] > 25 and part[1] > 2


@pytest.mark.parametrize("quality", [0.3, 0.5, 3.0, 30.0, 300.0])
def test_a_resonance_that_passes_a_partial(quality: float) -> None:
    """Weak or strong, narrow or wide, slow or fast to decay: the partial follows its strongest line."""
    bass = load_preset("jazz-finger")
    for mass in (3.0, 0.3):
        for f in (60.0, 95.0, 97.9, 98.1, 103.0, 196.0, 400.0):
            y = Admittance((Resonance(f, quality, mass, 0), Resonance(700.0, 20.0, 0.2, 0)))
            s = speaking(bass.strings[3], replace(bass.necks[3], admittance=y), 0)
            cents, part = off(s, False, *ringing(s, False))
            assert np.median(part) < 0.02 and cents.max() < 4 and part.max() < 0.1, (f, mass, cents, part)


def test_a_note_on_a_wolf_stays_near_its_pitch() -> None:
    """Where string and neck move alike, no line may lie at the pitch: the note takes the nearest, never a wild one."""
    bass = load_preset("jazz-finger")
    pitch = bass.strings[3].frequency(bass.strings[3].open_note)
    y = Admittance((Resonance(pitch, 40.0, 0.3, 0),))
    s = speaking(bass.strings[3], replace(bass.necks[3], admittance=y), 0)
    found = abs(1200 * math.log2(ringing(s, False)[0][0] / pitch))
    assert 5 < found < 60 and lines(s, 1).share[0] > 0.8


def test_on_the_pole_itself() -> None:
    """Where the admittance is infinite, the step still leads to finite numbers."""
    numbers = flat([(100.0, 20.0, 0.5)])
    decay = 100.0 / 40.0
    pole = math.sqrt(100.0**2 - decay**2), decay
    at = law.approach(numbers, (0, 1), 0.3, pole, law.nearest(numbers, 0, 1, pole), pole)
    split = math.sqrt(0.3 / (4 * math.pi * 0.5))  # Hz: both lines lie this far from it
    assert math.dist(at, pole) == pytest.approx(split, rel=0.05)
    assert math.isfinite(law.moving(numbers, 0, pole)[2])
