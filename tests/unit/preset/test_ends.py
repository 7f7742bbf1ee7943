"""How notes of shipped presets end, and what the fretting hand does between them, as on recorded basses.

Levels are those of the loudest 30 ms, relative to a medium note's. Recordings: kernels/hands/noise.py names them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt
from support.costs import of_each_kind
from support.levels import db

from livebass import QUALITIES, load_preset, preset_names, score_of
from livebass.engine.engine import Engine
from livebass.rows.arrays import Floats
from livebass.rows.units import OFF

RATE = 48000
NAMES = [name for name in preset_names() if not name.startswith(("paper", "upright"))]
FRETS = (0, 3, 7)
MEDIUM = 64
RINGS, AFTER = 0.6, 0.3  # s of a note before its end, and after that


def band(x: Floats, low: float, high: float) -> Floats:
    return np.asarray(sosfiltfilt(butter(4, [low, high], "band", fs=RATE, output="sos"), x))


def level(x: Floats) -> float:
    """dB of the loudest 30 ms; `x` begins at once."""
    n = round(0.03 * RATE)
    power = np.convolve(x**2, np.ones(n) / n)
    return float(10 * np.log10(power.max() + 1e-30))


def fall(x: Floats) -> float:
    """Rate (dB/s) from 5 to 25 dB under the loudest 10 ms."""
    n = round(0.01 * RATE)
    power = 10 * np.log10(np.convolve(x**2, np.ones(n) / n, "valid") + 1e-30)
    power = power[np.argmax(power[: round(0.1 * RATE)]) :]
    first, last = (int(np.flatnonzero(power < power[0] - d)[0]) for d in (5.0, 25.0))
    return 20.0 * RATE / (last - first)


@cache
def engine(name: str, fretting: bool = False) -> Engine:
    """The preset without the noise of its electronics, and with its fretting hand or without."""
    bass = load_preset(name)
    player = replace(bass.player, floor_noise=OFF, hum=OFF, **({} if fretting else {"fretting_noise": 0.0}))
    return Engine(replace(bass, player=player), QUALITIES["live"], RATE)


def play(made: Engine, notes: list[tuple[float, float, int, int]], seed: int, tail: float) -> Floats:
    return np.concatenate([b.sum(axis=0) for b in made.another(seed).play(score_of(notes, RATE), tail)])


@cache
def releases(name: str) -> Floats:
    """Level of 1.5 to 4 kHz and of all, dB, and rate, dB/s, of the ends of medium notes all over the neck."""
    made, found = engine(name), []
    for i, string in enumerate(load_preset(name).strings):
        for fret in FRETS:
            sound = play(made, [(0.0, RINGS, string.open_note + fret, MEDIUM)], 1 + 10 * i + fret, AFTER)
            note, end = np.split(sound, [round(RINGS * RATE)])
            found.append((level(band(end, 1500.0, 4000.0)) - level(note), level(end) - level(note), fall(end)))
    return np.array(found)


@pytest.mark.parametrize("name", of_each_kind(NAMES))
def test_notes_end_without_a_burst_of_highs(name: str) -> None:
    highs, whole = np.median(releases(name)[:, :2], axis=0)
    assert -40.0 <= highs <= -20.0 and -13.0 <= whole <= -8.0, (highs, whole)


@pytest.mark.parametrize("name", of_each_kind(NAMES))
def test_notes_end_quickly_and_no_two_alike(name: str) -> None:
    rates = releases(name)[:, 2]
    assert 330.0 <= np.median(rates) <= 720.0, rates
    slow, quick = np.percentile(rates, [10, 90])
    assert quick / slow >= 1.5, rates


@pytest.mark.parametrize("name", of_each_kind(NAMES))
def test_fingers_that_come_down_are_as_loud_as_recorded_ones(name: str) -> None:
    """A line on fretted notes with rests: median level, and centroid of the fingers alone; the first note has none."""
    strings = load_preset(name).strings[:3]
    keys = [s.open_note + fret for fret in (3, 2, 4) for s in strings]
    notes = [(0.1 + 0.5 * k, 0.3, key, MEDIUM) for k, key in enumerate(keys)]
    alone = play(engine(name), notes, 5, 0.2)
    fingers = play(engine(name, fretting=True), notes, 5, 0.2) - alone
    medium = np.median([level(alone[round(t * RATE) : round((t + 0.3) * RATE)]) for t, *_ in notes])
    parts = [fingers[round(t * RATE) : round((t + 0.3) * RATE)] for t, *_ in notes]
    assert not parts[0].any()
    levels = [level(x) - medium for x in parts[1:]]
    assert -30.0 <= np.median(levels) <= -21.0 and np.ptp(levels) < 14.0, levels
    power = np.mean([np.abs(np.fft.rfft(x)) ** 2 for x in parts[1:]], axis=0)
    assert 1000.0 <= power @ np.fft.rfftfreq(parts[1].size, 1 / RATE) / power.sum() <= 2900.0


@pytest.mark.parametrize("name", ["jazz-finger", "precision-finger", "flatwound"])
def test_hammer_ons_and_pull_offs_have_no_other_fingers(name: str) -> None:
    key = load_preset(name).strings[1].open_note + 3
    sounds = []
    for fretting in (True, False):
        made = engine(name, fretting).another(1)
        frames = RATE // 10 + RATE // 5 * np.arange(5)
        messages = [(0xB0, 68, 127), (0x90, key, 64), (0x90, key + 2, 64), (0x80, key + 2, 64), (0x90, key + 4, 64)]
        made.send(frames, np.array(messages, np.uint8))
        sounds.append(made.process(RATE + RATE // 5).sum(axis=0))
    assert np.array_equal(*sounds) and db(float(np.abs(sounds[0]).max())) > -60.0


def test_the_papers_basses_have_none_of_this() -> None:
    for name in (n for n in preset_names() if n.startswith("paper")):
        player = load_preset(name).player
        assert (player.release_noise, player.release_spread, player.fretting_noise) == (OFF, 0.0, 0.0)
