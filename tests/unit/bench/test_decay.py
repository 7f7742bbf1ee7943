"""T60 by octave: found in sounds of known decay, and the T60 of the presets."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.costs import slow
from support.places import TOOLS

from livebass import load_preset
from livebass.lab.comparison.ringing import OCTAVES, ringing
from livebass.rows.arrays import Floats

with pytest.MonkeyPatch.context() as patch:
    patch.syspath_prepend(str(TOOLS))
    from decay import Note, by_octave, preset_notes, recorded_notes, table

RATE = 44_100


def note(f0: float, t60_s: Floats, seconds: float = 4.0, noise_db: float = -90.0, stiffness: float = 1e-4) -> Floats:
    """A note of len(t60_s) partials, in noise."""
    t, j = np.arange(round(seconds * RATE)) / RATE, np.arange(1, len(t60_s) + 1)
    nu = j * f0 * np.sqrt(1 + stiffness * j**2)
    sound = np.cos(2 * math.pi * np.outer(nu, t) + j[:, None] ** 2) * np.exp(-6.9078 * t / np.asarray(t60_s)[:, None])
    mix = (sound / j[:, None]).sum(axis=0)
    return 0.3 * mix / np.abs(mix).max() + 10 ** (noise_db / 20) * np.random.default_rng(2).normal(size=t.size)


@pytest.mark.parametrize("f0", [41.2, 98.0, 220.0])
def test_known_decays(f0: float) -> None:
    t60 = 12.0 / np.arange(1, 25) ** 0.7
    rings = ringing(note(f0, t60), RATE, 1.01 * f0)
    nu, found = rings.frequency, rings.t60
    j = np.rint(nu / f0 / np.sqrt(1 + 1e-4 * np.rint(nu / f0) ** 2)).astype(int)
    assert len(j) >= 22 and np.all(np.diff(j) > 0)
    np.testing.assert_allclose(found, t60[j - 1], rtol=0.05)


def test_noise_is_no_decay() -> None:
    """Noise and steady sounds are ignored; the remaining results are as without them."""
    t60 = 4.0 / np.arange(1, 21)
    rings = ringing(note(98.0, t60, noise_db=-50.0), RATE, 98.0)
    nu, found = rings.frequency, rings.t60
    assert 5 <= nu.size < 20
    np.testing.assert_allclose(found, t60[: nu.size], rtol=0.15)
    hum = np.sin(2 * math.pi * 98 * np.arange(2 * RATE) / RATE)
    assert ringing(hum, RATE, 98.0).t60.size == 0 and ringing(0 * hum, RATE, 98.0).t60.size == 0


def test_recordings_in_a_folder(tmp_path: Path) -> None:
    """An open A and a C beside it; a click and a text are not notes."""
    bass = load_preset("jazz-finger")
    for name, f0, t60 in (("a", 55.0, 8.0), ("c", 65.4, 4.0)):
        sound = note(f0, np.full(40, t60))
        soundfile.write(tmp_path / f"{name}.wav", np.concatenate([np.zeros(RATE // 5), sound]), RATE)
    soundfile.write(tmp_path / "click.flac", np.eye(1, RATE)[0], RATE)
    (tmp_path / "notes.txt").write_text("nothing to hear")
    a, c = recorded_notes([tmp_path], bass)
    assert (a.open, c.open) == (True, False)
    assert np.median(a.t60) == pytest.approx(8, rel=0.05) and np.median(c.t60) == pytest.approx(4, rel=0.05)
    lines = table([("both", [a, c])]).splitlines()
    assert "200-400 Hz" in lines[0] and "both, stopped / open" in lines[3] and "0.5" in lines[3]
    assert np.isnan(by_octave([])).all() and np.isnan(by_octave([Note(True, np.array([60.0]), np.ones(1))])).all()
    with pytest.raises(ValueError, match="no such file"):
        recorded_notes([tmp_path / "none.wav"], bass)


@cache
def listen(name: str) -> tuple[Floats, Floats]:
    """T60 (s) by octave of a preset's open and stopped notes."""
    notes = preset_notes(load_preset(name), (2, 5, 9))
    return by_octave([n for n in notes if n.open]), by_octave([n for n in notes if not n.open])


LOW, HIGH = OCTAVES.index(200.0), OCTAVES.index(1600.0)


@pytest.mark.parametrize(
    ("name", "minimum", "maximum"),
    [("jazz-finger", 7, 14), slow("precision-finger", 7, 14), slow("flatwound", 2.5, 5)],
)
def test_stopped_notes_ring_as_long_as_real_ones(name: str, minimum: float, maximum: float) -> None:
    open_, stopped = listen(name)
    assert minimum < stopped[LOW] < maximum, stopped
    ratio = stopped[LOW:HIGH] / open_[LOW:HIGH]
    assert np.all((ratio > 0.5) & (ratio < 1.35)), ratio


@pytest.mark.parametrize(("name", "minimum"), [("jazz-finger", 0.4), slow("precision-finger", 0.4)])
def test_no_cliff_above_1500_hz(name: str, minimum: float) -> None:
    """From octave to octave T60 falls at most to 0.4; beyond a plateau it once fell to 0.3.

    The highest octaves of recordings that ring longer than this do so in noise (comparison/ringing.py).
    """
    _, stopped = listen(name)
    fall = stopped[HIGH:] / stopped[HIGH - 1 : -1]
    assert np.all(fall > 0.4) and stopped[-1] > minimum, stopped
