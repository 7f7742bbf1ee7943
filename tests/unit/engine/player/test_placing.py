"""Fingers of the fretting hand between notes: which messages make them come down on a fret or leave a string."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from support.hands import Hands, bass
from support.messages import control, off, on

from livebass.kernels.player import placing
from livebass.kernels.string import records as at
from livebass.rows.techniques import GHOST, HARMONIC, LEGATO, SLIDE, TAP

RATE = 48000
LOW, OTHER, OPEN = 31, 42, 38  # E string fret 3, D string fret 4, open D
LATER = 1.0  # s: a hand that has left meanwhile
RUB = np.void


def hands(noise: float = 1.0, **player: object) -> Hands:
    return Hands(bass(fretting_noise=noise, **player))


def rubs(events: NDArray[np.void]) -> list[RUB]:
    return [e for e in events if e["kind"] == at.RUBBING]


def placed(made: Hands, seconds: float, *messages: tuple[int, int, int]) -> list[RUB]:
    """The fingers that come down or leave for `messages`, so long after those before."""
    made.frame += round(seconds * RATE)
    return rubs(made(*messages))


def test_a_finger_that_comes_down_elsewhere_sounds_with_its_stroke() -> None:
    """After the stroke's own event and without a wait, as loud and long as the table says; not for the first note."""
    made = hands()
    assert placed(made, 0.0, on(LOW)) == []
    made.frame += RATE // 2
    events = made(off(LOW), on(OTHER))
    assert [int(e["kind"]) for e in events] == [at.HAND, at.RUBBING, at.PLUCK, at.RUBBING, at.RUBBING]
    leaving, kept, down = rubs(events)
    assert leaving["wait"] > 0 and kept["value"] == 0 and kept["string"] == leaving["string"] == 0
    assert down["wait"] == 0 and down["string"] == 2
    assert abs(20 * np.log10(down["value"])) <= placing.UNEQUAL
    assert placing.SHORT <= down["seconds"] <= placing.LONG


def test_a_farther_place_takes_longer() -> None:
    """On average over notes; chance adds a part."""
    near, far = ([], [])
    for k in range(40):
        made = Hands(bass(fretting_noise=1.0), 0)  # on one string
        made.p["seed"] = k
        placed(made, 0.0, on(LOW))
        near += [float(e["seconds"]) for e in placed(made, LATER, on(LOW + 1))]
        far += [float(e["seconds"]) for e in placed(made, LATER, on(LOW + 9))]
    assert len(near) == len(far) == 40 and len(set(near)) == 40
    assert np.mean(far) > np.mean(near) + 0.4 * (placing.LONG - placing.SHORT)


def assert_fills(values: Sequence[float], low: float, high: float) -> None:
    """Values lie between these ends, all over the range, as many of them above its middle as below."""
    assert low <= min(values) < low + 0.03 * (high - low) and high - 0.03 * (high - low) < max(values) <= high
    assert abs(np.mean(values) - (low + high) / 2) < 0.1 * (high - low)


@pytest.mark.parametrize("frets, far", [(1, 1 / 7), (3, 3 / 7), (7, 1.0), (12, 1.0)])
@pytest.mark.parametrize("strings", [(0, 0), (0, 2), (2, 1)])
def test_times_and_levels_are_drawn_and_times_grow_with_the_frets(
    strings: tuple[int, int], frets: int, far: float
) -> None:
    """0.4 of what a time may differ by is drawn; the rest is the way along the neck, from whatever string."""
    made, keys, came, left = hands(), [], [], []
    made(control(126, 4))  # a channel a string
    for i, fret in [*zip(strings, (2, 2 + frets), strict=True)] * 150:
        keys.append((3 - i, (28, 33, 38, 43)[i] + fret))
        came += placed(made, 0.1, (0x90 | keys[-1][0], keys[-1][1], 90))[-1:]
        left += placed(made, 0.1, (0x80 | keys[-1][0], keys[-1][1], 0))
    assert len(came) == 299 and len(left) == 300
    short = 0.09 + 0.13 * 0.6 * far
    assert_fills([float(e["seconds"]) for e in came], short, short + 0.13 * 0.4)
    assert_fills([20 * np.log10(e["value"]) for e in came], -4.0, 4.0)
    assert_fills([20 * np.log10(e["value"]) for e in left], -10.0, -2.0)
    assert_fills([float(e["wait"]) for e in left], 0.12, 0.22)
    assert {float(e["seconds"]) for e in left} == {0.09}
    numbers = [(e["seconds"] - short) / 0.052 for e in came] + [(e["wait"] - 0.12) / 0.1 for e in left]
    numbers += [0.5 + 20 * np.log10(e["value"]) / 8 for e in came]
    numbers += [0.5 + (6 + 20 * np.log10(e["value"])) / 8 for e in left]
    assert np.diff(np.sort(numbers)).min() > 1e-9, "no random number is drawn twice"


def test_a_finger_that_stays_does_not_sound() -> None:
    made = hands()
    placed(made, 0.0, on(LOW))
    assert placed(made, 0.5, on(LOW)) == []
    placed(made, 0.5, off(LOW))
    assert [float(e["value"]) for e in placed(made, 0.05, on(LOW))] == [0.0]  # it does not leave
    placed(made, 0.5, off(LOW))
    down = placed(made, LATER, on(LOW))[-1]  # it had left
    assert down["value"] > 0


@pytest.mark.parametrize("early", [True, False])
def test_it_has_left_when_its_wait_is_over(early: bool) -> None:
    """A frame before, it is still there."""
    made = hands()
    placed(made, 0.0, on(LOW))
    (leaving,) = placed(made, 0.5, off(LOW))
    made.frame += int(leaving["wait"] * RATE) + (not early)
    assert [bool(e["value"] > 0) for e in rubs(made(on(LOW)))] == [False] + [True] * (not early)


def test_a_hand_without_time_does_not_sound() -> None:
    made = hands()
    placed(made, 0.0, on(LOW))
    assert placed(made, LATER, on(LOW + 3), on(OTHER + 2))  # a chord: one movement ...
    assert len(rubs(made(on(47)))) == 0
    assert placed(made, 0.9 * placing.HAND_TIME, on(LOW + 4)) == []  # ... as are notes in a hurry
    assert len(placed(made, 1.1 * placing.HAND_TIME, on(LOW + 5))) == 1


@pytest.mark.parametrize("technique", [LEGATO, SLIDE, TAP, GHOST, HARMONIC])
def test_techniques_of_the_left_hand_have_their_own_sounds(technique: int) -> None:
    """Hammer-ons and pull-offs, slides, taps, ghost notes, harmonics."""
    made = hands()
    placed(made, 0.0, on(LOW))
    made.p["switched"][technique] = 1
    for key in (LOW + 2, LOW):  # up and down on the string, which sounds
        assert placed(made, LATER, on(key)) == []
    made.p["switched"][technique] = 0
    assert placed(made, LATER, on(OTHER))


def test_open_strings_and_soft_ghosts_need_no_finger() -> None:
    made = hands(ghost_below=20)
    placed(made, 0.0, on(LOW))
    assert placed(made, LATER, on(OPEN)) == []
    assert placed(made, LATER, off(OPEN)) == []
    assert placed(made, LATER, on(OTHER, 10)) == [] and placed(made, LATER, off(OTHER)) == []
    assert placed(made, LATER, on(OTHER))


def test_a_finger_leaves_after_its_note_unless_the_hand_goes_on() -> None:
    made = hands()
    placed(made, 0.0, on(LOW))
    (leaving,) = placed(made, 0.5, off(LOW))
    assert placing.LEAVES <= leaving["wait"] <= placing.LEAVES + placing.LEAVES_LATER
    assert 0.0 < leaving["value"] < 1.0
    made(control(64, 127))  # with the pedal down, the finger leaves when the note ends
    placed(made, LATER, on(OTHER))
    assert placed(made, 0.5, off(OTHER)) == []
    assert len(placed(made, 0.5, control(64, 0))) == 1


def test_a_string_that_no_note_plays_has_no_finger_to_lift() -> None:
    made = hands()
    placed(made, 0.0, on(LOW))
    placed(made, 0.5, off(LOW))
    assert placed(made, 0.5, off(LOW), control(123)) == []


def test_without_the_key_no_finger_sounds() -> None:
    made = hands(0.0)
    for key in (LOW, OTHER, LOW + 5):
        assert placed(made, LATER, on(key)) == [] and placed(made, LATER, off(key)) == []


def test_its_level_is_that_of_the_key() -> None:
    levels = []
    for noise in (0.5, 2.0):
        made = hands(noise)
        placed(made, 0.0, on(LOW))
        (leaving,), (down,) = placed(made, 0.3, off(LOW)), placed(made, LATER, on(OTHER))[-1:]
        levels.append((float(leaving["value"]), float(down["value"])))
    assert levels[1] == pytest.approx(4 * np.array(levels[0]))
