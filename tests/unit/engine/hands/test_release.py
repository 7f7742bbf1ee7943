"""Hands that end a note, on basses that people play: how firm they are, and how evenly they end notes."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support.levels import db
from support.motion import mode_speeds
from support.own_basses import FRETTED, PLAYED, load_preset
from support.played import Played, event
from support.strings import even, far_from_frets

from livebass import QUALITIES
from livebass.engine.engine import Engine
from livebass.engine.prepare import Voice, play_frames
from livebass.kernels.string.records import EVENT, HAND, PLUCK, TOUCH_EVENT, TOUCHES
from livebass.rows.arrays import Floats

RATE = 48000
RINGS = 0.2  # s before the release
FIRM = 90.0  # 1/s, a player's fingers
MODES = 160


@cache
def engine(preset: str, free: bool = False) -> Engine:
    """A preset, its frets out of reach if `free`, and its tension constant."""
    bass = even(load_preset(preset))
    return Engine(far_from_frets(bass) if free else bass, QUALITIES["live"], RATE)


class Ended:
    """A note on one string that hands end after RINGS."""

    def __init__(self, made: Engine, i: int, fret: int, *hands: np.ndarray) -> None:
        self.voice: Voice = made.another().voices[i]
        self.ops = made.pool.records[i]
        self._events, place = np.zeros(0, EVENT), 0.87 * float(self.ops[fret]["length"])
        pluck = event(PLUCK, fret, apex=5e-4, place=place, width=2e-3, seconds=1e-4, angle=0.5)
        self.after(RINGS, pluck)
        self.rang = self.speeds()
        for hand in hands:
            hand["frame"] = round(RINGS * RATE)
        self._events = np.concatenate(hands) if hands else self._events

    def after(self, seconds: float, events: np.ndarray | None = None) -> Ended:
        """Plays `seconds` more."""
        play_frames(self.voice, self.ops, self._events if events is None else events, np.zeros(round(seconds * RATE)))
        self._events = np.zeros(0, EVENT)
        return self

    def speeds(self) -> Floats:
        return mode_speeds(self.voice, MODES)

    def fallen(self) -> float:
        """Level of the motion relative to that before the release, dB."""
        return db(float(np.linalg.norm(self.speeds()) / np.linalg.norm(self.rang)))


def release(damping: float = FIRM) -> np.ndarray:
    return event(HAND, value=damping)


@pytest.mark.parametrize("preset", PLAYED)
def test_notes_end_as_fast_up_the_neck_as_down(preset: str) -> None:
    """Within 0.1 s by no more than 1.45 times as many dB at fret 12 as at fret 3: fingers cover more of a short string,
    and are so much softer.
    """
    made = engine(preset)
    for i in range(len(made.voices)):
        low, high = (Ended(made, i, fret, release()).after(0.09).fallen() for fret in (3, 12))
        assert low < -25 and 0.95 < high / low < 1.45, (i, low, high)


@pytest.mark.parametrize("preset", PLAYED)
@pytest.mark.parametrize("damping", [FIRM, FIRM / 2])
def test_the_rest_of_the_hands_takes_12_a_second_from_every_mode(preset: str, damping: float) -> None:
    """With the fingers lifted at once it is all that damps; a softer hand takes less in proportion."""
    made = engine(preset, free=True)
    lifted = [event(TOUCH_EVENT, finger=k, place=0.3, seconds=1e-5) for k in range(TOUCHES)]
    ringing, ended = Ended(made, 1, 0).after(0.1), Ended(made, 1, 0, release(damping), *lifted).after(0.1)
    loud = ringing.speeds() > 1e-3 * ringing.speeds().max()
    taken = -np.log(ended.speeds()[loud] / ringing.speeds()[loud]) / 0.1
    assert loud.sum() > 20 and np.abs(taken / (12.0 * damping / FIRM) - 1).max() < 0.02, taken


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("fret", [12, 3])
def test_a_finger_that_eases_off_keeps_the_string_stopped_at_first(preset: str, fret: int) -> None:
    """Past a dashpot of R impedances 2 / (2 + R) of a wave goes on: at first 3 % at most, half-way through 5 %."""
    made = engine(preset)
    ended = Ended(made, 1, fret, release())
    op = ended.ops[0]
    impedance = float(op["fine"] ** 2 / op["weight"] * op["speed"])
    passing = []
    for seconds in (1e-3, 11.5e-3, 14.5e-3):
        finger = float(ended.after(seconds).voice.record["touches"]["resistance"][0, 0]) / impedance
        passing.append(2 / (2 + finger))
    assert 0.01 < passing[0] < 0.03 and passing[1] < 0.05 and passing[2] > 0.3, passing


@pytest.mark.parametrize("preset", FRETTED)
@pytest.mark.parametrize("fret", [1, 2, 12])
def test_all_fingers_that_end_a_note_lie_on_the_string(preset: str, fret: int) -> None:
    """Near the nut, too. The one at the fret presses there alone; others on 5 to 10 mm, more than twice as much."""
    made = engine(preset)
    touches = Ended(made, 1, fret, release()).after(1e-3).voice.record["touches"][0]
    length, open_length = (float(made.pool.records[1, k]["length"]) for k in (fret, 0))
    assert touches["place"][0] == pytest.approx(length) and (touches["wanted"] > 0).all()
    assert (touches["place"] > 0).all() and (touches["place"] < 0.99 * open_length).all()
    assert (touches["width"][1:] > 2 * touches["width"][0]).all() and touches["width"][0] > 1e-3
    assert (touches["width"][1:] > 2.5e-3).all() and (touches["width"][1:] < 5e-3).all(), "half of it"


@pytest.mark.parametrize("preset", PLAYED)
def test_fingers_land_on_an_open_string_within_12_ms(preset: str) -> None:
    """One by the pickups, the others between the nut and the octave."""
    ended = Ended(engine(preset), 1, 0, release())
    for seconds, part in ((6e-3, 0.5), (5e-3, 11 / 12), (2e-3, 1.0)):
        touches = ended.after(seconds).voice.record["touches"][0]
        assert touches["resistance"] / touches["wanted"] == pytest.approx(np.full(TOUCHES, part), abs=0.01)
    places = np.sort(touches["place"]) / float(ended.ops[0]["length"])  # from the saddle
    assert 0.1 < places[0] < 0.25 and (places[1:] > 0.5).all() and (places[1:] < 0.95).all()


@pytest.mark.parametrize("preset", PLAYED)
@pytest.mark.parametrize("resistance", [0.3, 0.1])
def test_waves_that_lie_on_a_finger_lose_as_if_it_covered_the_string(preset: str, resistance: float) -> None:
    """A finger of R N s/m takes R / (2 mu L) a second from modes whose waves are shorter than it is wide."""
    made = engine(preset, free=True)
    ended, wide = Ended(made, 1, 0), 40e-3
    finger = event(TOUCH_EVENT, place=0.3, resistance=resistance, width=wide)
    finger["frame"] = round(RINGS * RATE)
    before = ended.after(10e-3, finger).speeds()
    after = ended.after(20e-3).speeds()
    op, alone = ended.ops[0], Ended(made, 1, 0).after(10e-3)
    free = [alone.speeds(), alone.after(20e-3).speeds()]
    under = int(ended.voice.slots[int(ended.voice.record["slot"][0])]["touch_modes"][0])
    short = np.arange(MODES) >= under
    short &= (before > 1e-4 * before.max()) & (after > 0)
    taken = -np.log(after[short] / before[short] * free[0][short] / free[1][short]) / 20e-3
    mass = float(op["fine"] ** 2 / op["weight"] * op["length"])
    assert short.sum() > 5 and np.abs(taken / (resistance / (2 * mass)) - 1).max() < 0.03, taken


@pytest.mark.parametrize("preset", PLAYED)
def test_hands_in_any_haste_take_energy_and_give_none(preset: str) -> None:
    """Twice the spread of recorded ones: five notes end at different speeds, and none grows on the way."""
    string, rates = Played(preset, 1), []
    string.record["release_spread"] = 2.0
    none = np.zeros(0, EVENT)
    for _ in range(5):
        string.play(event(PLUCK, apex=1e-4, place=0.7, width=2e-3, seconds=1e-4))
        string.let_ring(0.05)
        before = string.energy()
        string.play(event(HAND, value=FIRM))
        after = []
        for _ in range(RATE // 20):
            string.play(none)
            after.append(string.energy())
        assert 0.0 < max(after) < 1.001 * before
        rates.append(np.log(before / after[-1]))
        string.let_ring(0.25)
    assert max(rates) > 1.5 * min(rates)
