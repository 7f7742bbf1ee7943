"""A finger that lies on a string: how it lands, lifts, moves on and changes its pressure, frame by frame."""

from __future__ import annotations

import numpy as np
import pytest
from support.own_basses import FRETTED
from support.played import RATE, Played, event

from livebass.kernels.string.records import PLUCK, TOUCH_EVENT
from livebass.rows.arrays import Floats

FIRM, WIDTH, FINGER = 0.4, 4e-3, 1  # N s/m; m, half; which finger
LANDING, LIFTING = 5e-3, 15e-3  # s, of a finger whose event says no times


def lay(place: float = 0.2, resistance: float = FIRM, width: float = WIDTH, seconds: float = 0.0) -> np.ndarray:
    """The event of a finger that lands `place` m from the saddle, or with no resistance lifts."""
    return event(TOUCH_EVENT, finger=FINGER, place=place, resistance=resistance, width=width, seconds=seconds)


def pressures(string: Played, frames: int) -> Floats:
    """The finger's resistance (N s/m) after each of the next frames, (frames,)."""
    found = np.empty(frames)
    for k in range(frames):
        string.play(event(PLUCK)[:0])
        found[k] = string.record["touches"][FINGER]["resistance"]
    return found


def ramp(begin: float, end: float, seconds: float, frames: int) -> Floats:
    """A straight line over `seconds` from its first frame on, (frames,), then `end`."""
    part = np.minimum(np.arange(1, frames + 1) / (seconds * RATE), 1.0)
    made: Floats = begin + (end - begin) * part
    return made


@pytest.fixture(params=FRETTED)
def string(request: pytest.FixtureRequest) -> Played:
    """A string that sounds."""
    played = Played(request.param, 0)
    played.play(event(PLUCK, apex=1e-3, place=0.2))
    return played


def test_it_lands_and_lifts_on_straight_lines(string: Played) -> None:
    frames = round(1.5 * LIFTING * RATE)
    string.play(lay())
    first = float(string.record["touches"][FINGER]["resistance"])
    assert first == pytest.approx(FIRM / (LANDING * RATE))
    assert pressures(string, frames) == pytest.approx(ramp(first, FIRM + first, LANDING, frames).clip(max=FIRM))
    string.play(lay(resistance=0.0))
    first = FIRM - FIRM / (LIFTING * RATE)
    assert pressures(string, frames) == pytest.approx(ramp(first, first - FIRM, LIFTING, frames).clip(min=0), abs=1e-12)


def test_it_lifts_by_itself_after_its_time_and_in_the_time_of_its_event(string: Played) -> None:
    stays, frames = 8e-3, round(30e-3 * RATE)
    string.play(lay(seconds=stays))
    found = pressures(string, frames)
    still = np.flatnonzero(found == FIRM)
    assert still[-1] == round(stays * RATE) - 3, "the next frame lifts it"
    assert np.diff(found[still[-1] :])[:100] == pytest.approx(-FIRM / (LIFTING * RATE))
    string.play(lay())
    pressures(string, frames)
    string.play(lay(resistance=0.0, seconds=4e-3))
    assert np.flatnonzero(pressures(string, frames) < 1e-12)[0] == round(4e-3 * RATE) - 2


@pytest.mark.parametrize("place, width, lands", [(0.2, WIDTH, False), (0.21, WIDTH, True), (0.2, 2 * WIDTH, True)])
def test_at_another_place_it_lands_again_and_at_the_same_it_stays(
    string: Played, place: float, width: float, lands: bool
) -> None:
    string.play(lay())
    pressures(string, round(2 * LANDING * RATE))
    string.play(lay(place, 1.5 * FIRM, width))
    now = float(string.record["touches"][FINGER]["resistance"])
    step = 1.5 * FIRM / (LANDING * RATE)
    assert now == pytest.approx(step if lands else FIRM + step)
