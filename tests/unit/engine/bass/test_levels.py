"""Levels of every preset: all equally loud, a hard line nearly fills full scale and never exceeds it, no DC."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from support.costs import of_each_kind, slow

from livebass import QUALITIES, load_preset, preset_names, render_to_array, score_of
from livebass.model.instrument import note_frequency
from livebass.rows.units import decibels, note_number
from livebass.score.phrases import FINGER, TEMPO
from livebass.sound.analysis import loudness

RATE = 48000
PLACES = (5, 12)  # frets played on each string
BAR = 16  # sixteenths
HARD, DEFAULT, SOFT = 127, 90, 20  # velocities
LOUDEST = (-10.0, -2.0)  # dBFS, peak of a hard line: hands that press hard notes into each other keep it lower
APART = 2.0  # LU, at most, between any two basses
QUICK = {"jazz-finger", "precision-pick", "slap", "paper-g"}
DYNAMICS = (6.0, 18.0)  # dB, between a soft line and a hard one: real hands give 8 to 16 dB from softest to hardest
LABORATORY, MIN_IN_LABORATORY = "paper", 20.0  # dB: force alone, without a hand
DC = -60.0  # dBFS, at most, of the mean of the steady part


@functools.cache
def line(name: str, velocity: int, end: float = BAR) -> np.ndarray:
    """The mix (n_frames,) of the demo phrase of fingers up to `end`, in sixteenths, all notes at one velocity."""
    sixteenth = 60 / TEMPO / 4
    phrase = [(at, length, note_number(note)) for at, length, note, _ in FINGER if at < end]
    notes = [(at * sixteenth, length * sixteenth, note, velocity) for at, length, note in phrase]
    return render_to_array(load_preset(name), score_of(notes, RATE), QUALITIES["live"], tail=0.5).sum(axis=0)


@pytest.mark.parametrize("name", of_each_kind(preset_names(), dear="fretless"))
def test_levels(name: str) -> None:
    peak = decibels(np.abs(line(name, HARD)).max())
    assert LOUDEST[0] <= peak <= LOUDEST[1], f"{name}: a hard line peaks at {peak:.1f} dBFS, allowed {LOUDEST}"
    below = peak - decibels(np.abs(line(name, SOFT)).max())
    low, high = (MIN_IN_LABORATORY, 60.0) if name.startswith(LABORATORY) else DYNAMICS
    assert low <= below <= high, f"{name}: a soft line is {below:.1f} dB below a hard one, allowed {low} to {high}"


@pytest.mark.parametrize(("names", "end"), [(QUICK, 2 * BAR), slow(set(preset_names()), math.inf)])
def test_basses_are_as_loud_as_one_another(names: set[str], end: float) -> None:
    found = {name: loudness(line(name, DEFAULT, end), RATE) for name in names}
    assert max(found.values()) - min(found.values()) <= APART, found


@pytest.mark.parametrize("name", of_each_kind(preset_names(), dear="fretless"))
def test_nothing_beyond_full_scale(name: str) -> None:
    """A chromatic run: each note is struck hard while the one before still sounds."""
    bass = load_preset(name)
    notes = range(bass.strings[0].open_note, bass.strings[-1].open_note + PLACES[-1] + 1)
    run = score_of([(0.134 * k, 0.14, note, HARD) for k, note in enumerate(notes)], RATE)
    peak = decibels(np.abs(render_to_array(bass, run, QUALITIES["live"]).sum(axis=0)).max())
    assert peak <= 0.0, f"{name}: a run peaks at {peak:.1f} dBFS"


@pytest.mark.parametrize("name", of_each_kind(preset_names()))
def test_no_dc(name: str) -> None:
    bass = load_preset(name)
    lowest = bass.strings[0].open_note
    period = RATE / note_frequency(lowest)  # frames
    note = score_of([(0.0, 1.5, lowest, HARD)], RATE)
    steady = render_to_array(bass, note, QUALITIES["live"], tail=0.0).sum(axis=0)[RATE // 2 :]
    whole = steady[: round(int(len(steady) / period) * period)]
    level = decibels(max(abs(whole.mean()), 1e-12))
    assert level <= DC, f"{name}: a mean of {level:.1f} dBFS, at most {DC}"
