"""Levels of every preset: a hard line nearly fills full scale, nothing exceeds it, there is no DC."""

from __future__ import annotations

import numpy as np
import pytest

from livebass import QUALITIES, load_preset, preset_names, render_to_array, score_of
from livebass.model.instrument import Instrument, note_frequency
from livebass.units import decibels

RATE = 48000
GAP, LENGTH = 0.3, 0.25  # s, from note to note, and of each
PLACES = (5, 12)  # frets each string is played at
HARD, SOFT = 127, 20  # velocities
LOUDEST = (-8.0, -0.5)  # dBFS, peak of a hard line
DYNAMICS = 12.0  # dB, at least, between the two lines
DC = -60.0  # dBFS, at most, of the mean of the steady part


def line(bass: Instrument, velocity: int) -> np.ndarray:
    """The mix (n_frames,) of two notes a string; the fingering may choose another string for them."""
    notes = [string.open_note + fret for string in bass.strings for fret in PLACES]
    played = [(k * GAP, LENGTH, note, velocity) for k, note in enumerate(notes)]
    return render_to_array(bass, score_of(played, RATE), QUALITIES["live"], tail=0.5).sum(axis=0)


@pytest.mark.parametrize("name", preset_names())
def test_levels(name: str) -> None:
    bass = load_preset(name)
    hard, soft = line(bass, HARD), line(bass, SOFT)
    peak = decibels(np.abs(hard).max())
    assert LOUDEST[0] <= peak <= LOUDEST[1], f"{name}: a hard line peaks at {peak:.1f} dBFS, allowed {LOUDEST}"
    below = peak - decibels(np.abs(soft).max())
    assert below >= DYNAMICS, f"{name}: a soft line is {below:.1f} dB below a hard one, at least {DYNAMICS}"


@pytest.mark.parametrize("name", preset_names())
def test_nothing_beyond_full_scale(name: str) -> None:
    """A chromatic run, each note struck hard while the one before still sounds."""
    bass = load_preset(name)
    notes = range(bass.strings[0].open_note, bass.strings[-1].open_note + PLACES[-1] + 1)
    run = score_of([(0.134 * k, 0.14, note, HARD) for k, note in enumerate(notes)], RATE)
    peak = decibels(np.abs(render_to_array(bass, run, QUALITIES["live"]).sum(axis=0)).max())
    assert peak <= 0.0, f"{name}: a run peaks at {peak:.1f} dBFS"


@pytest.mark.parametrize("name", preset_names())
def test_no_dc(name: str) -> None:
    bass = load_preset(name)
    lowest = bass.strings[0].open_note
    period = RATE / note_frequency(lowest)  # frames
    note = score_of([(0.0, 1.5, lowest, HARD)], RATE)
    steady = render_to_array(bass, note, QUALITIES["live"], tail=0.0).sum(axis=0)[RATE // 2 :]
    whole = steady[: round(int(len(steady) / period) * period)]
    level = decibels(max(abs(whole.mean()), 1e-12))
    assert level <= DC, f"{name}: a mean of {level:.1f} dBFS, at most {DC}"
