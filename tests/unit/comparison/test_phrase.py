"""Phrases built to have known ends, ghost notes, sounds between notes and spreads."""

from __future__ import annotations

import math

import numpy as np
import pytest
from support.phrases import RATE, phrase, plucked

from livebass.lab.comparison.phrase import measure_phrase, spreads


@pytest.mark.parametrize("f0", [41.2, 98.0])
@pytest.mark.parametrize("rate", [200.0, 430.0, 720.0])
def test_ends_fall_as_fast_as_they_do(rate: float, f0: float) -> None:
    found = measure_phrase(phrase(rate, f0=f0), RATE)
    assert len(found.notes) == 8 and len(found.ends) == 8
    assert np.median([end.rate for end in found.ends]) == pytest.approx(rate, rel=0.15)
    assert not found.ghosts and not found.between and found.gaps >= 7


@pytest.mark.parametrize("knock", [-10.0, -24.0])
def test_the_burst_of_an_end(knock: float) -> None:
    """Its level is that of the knock relative to a medium note; highs jump where they had died."""
    found = measure_phrase(phrase(knock=knock, floor=-50.0), RATE)
    assert len(found.notes) == 8 == len(found.ends) and not found.ghosts
    assert np.median([end.burst for end in found.ends]) == pytest.approx(knock, abs=2)
    quiet = measure_phrase(phrase(floor=-50.0), RATE)
    jump, none = (float(np.median([end.jump for end in each.ends])) for each in (found, quiet))
    assert none < 3 and jump - none == pytest.approx(knock - np.median([e.burst for e in quiet.ends]), abs=4)


def test_a_louder_phrase_has_the_same_figures() -> None:
    sound = phrase(knock=-20.0, ghosts=-9.0)
    first, second = measure_phrase(sound, RATE), measure_phrase(4 * sound, RATE)
    assert [e.burst for e in first.ends] == pytest.approx([e.burst for e in second.ends], abs=0.01)
    assert [e.rate for e in first.ends] == pytest.approx([e.rate for e in second.ends], rel=0.01)


@pytest.mark.parametrize("level", [-6.0, -12.0])
def test_ghost_notes(level: float) -> None:
    """Short strokes without a hold: 900 Hz that falls by 12 dB in 17 ms, heard through windows of 20 ms."""
    found = measure_phrase(phrase(ghosts=level), RATE)
    assert len(found.notes) == 8 and len(found.ghosts) == 8 and not found.between
    assert np.median([g.level for g in found.ghosts]) == pytest.approx(level, abs=1)
    assert np.median([g.centroid for g in found.ghosts]) == pytest.approx(900, rel=0.05)
    assert np.median([g.length for g in found.ghosts]) == pytest.approx(0.027, abs=0.012)


@pytest.mark.parametrize("level", [-22.0, -30.0])
def test_fingers_placed_between_notes(level: float) -> None:
    found = measure_phrase(phrase(placed=level), RATE)
    assert len(found.notes) == 8 and not found.ghosts and len(found.between) == 8 == found.gaps
    assert np.median([s.level for s in found.between]) == pytest.approx(level, abs=1)
    assert 1700 < np.median([s.centroid for s in found.between]) < 2300
    assert 0.03 < np.median([s.length for s in found.between]) < 0.08


def test_the_spread_of_repeated_notes() -> None:
    levels = (0.0, 2.0, -2.0, 1.0, -1.0, 0.0, 2.0, -2.0)
    level, bright = spreads(measure_phrase(phrase(levels=levels), RATE).notes)
    assert level == pytest.approx(np.std(levels, ddof=1), abs=0.05) and bright < 1
    assert math.isnan(spreads(measure_phrase(phrase(levels=(0.0, 0.0)), RATE).notes)[0])


def test_notes_that_ring_on_have_no_end() -> None:
    """Legato: the next note begins while the last one sounds."""
    sound = np.concatenate([0.1 * plucked(f0, 9.0, 0.0, 0.4) for f0 in (55.0, 65.4, 49.0, 55.0)])
    found = measure_phrase(sound, RATE)
    assert len(found.notes) == 4 and not found.ends and not found.gaps
    assert [n.key for n in found.notes] == [33, 36, 31, 33]


def test_what_is_no_phrase() -> None:
    for sound in (np.zeros(RATE), np.ones(100), np.full(RATE, math.nan)):
        with pytest.raises(ValueError, match=r"at least 0\.3 s"):
            measure_phrase(sound, RATE)
