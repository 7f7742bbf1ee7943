"""The player's settings that hosts move: velocity curve, humanise, hand position, open strings; and the blend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from support.scores import play_in_blocks
from support.strings import even

from livebass import load_preset
from livebass.engine.engine import Engine
from livebass.kernels.string.records import PLUCK
from livebass.model.quality import Quality
from livebass.rows.arrays import Floats

RATE, LIGHT = 24000, Quality("light", 60, 192e3)
ON, UP = 0x90, 0x80
SIXTEENTHS = [(round(0.15 * k * RATE), ON, 40 + k % 5, 90) for k in range(24)]


def engine(preset: str = "jazz-finger", seed: int = 0, **played: float) -> Engine:
    """An engine without noise or unevenness that plays with these values of parameters."""
    bass = even(load_preset(preset))
    return Engine(replace(bass, played=tuple(played.items())), LIGHT, RATE, seed)


def plucks(made: Engine, notes: list[tuple[int, ...]]) -> NDArray[np.void]:
    """The plucks that these messages become."""
    events = made.play_messages(
        np.array([frame for frame, *_ in notes], np.int64), np.array([message for _, *message in notes], np.uint8)
    )
    return events[events["kind"] == PLUCK]


def sound(made: Engine, notes: list[tuple[int, ...]], sizes: tuple[int, ...] = (RATE,), seconds: float = 1.0) -> Floats:
    """The strings' sum, in blocks of these sizes in turn."""
    return play_in_blocks(made, notes, round(seconds * RATE), sizes).sum(axis=0)


def test_the_curve_is_soft_as_played_or_hard() -> None:
    scale = [(k * 100, ON, 28, velocity) for k, velocity in enumerate((1, 32, 64, 96, 127))]
    soft, own, hard = (plucks(engine(velocity_curve=curve), scale)["apex"] for curve in (-1.0, 0.0, 1.0))
    assert np.array_equal(own, plucks(engine(), scale)["apex"])
    assert np.all(soft[1:4] > own[1:4]) and np.all(own[1:4] > hard[1:4])
    for end in (0, -1):
        assert soft[end] == own[end] == hard[end], "softest and hardest notes stay"
    square = plucks(Engine(changed_curve(2.0), LIGHT, RATE), scale)["apex"]
    assert hard == pytest.approx(square), "an exponent of 2"


def changed_curve(exponent: float):  # type: ignore[no-untyped-def]
    bass = engine().instrument
    return replace(bass, player=replace(bass.player, velocity_curve=exponent))


def test_humanised_force_differs_within_its_limits_and_repeats_by_the_seed() -> None:
    own, other = plucks(engine(), SIXTEENTHS)["apex"], plucks(engine(humanise_force=3.0), SIXTEENTHS)["apex"]
    decibels = 20 * np.log10(other / own)
    assert np.abs(decibels).max() <= 3.0 + 1e-9 and np.std(decibels) > 0.5
    assert np.array_equal(other, plucks(engine(humanise_force=3.0), SIXTEENTHS)["apex"])
    assert not np.array_equal(other, plucks(engine(seed=1, humanise_force=3.0), SIXTEENTHS)["apex"])


def test_humanised_strokes_only_come_later_and_blocks_change_nothing() -> None:
    made = engine(humanise_time=25.0)
    waits = plucks(made, SIXTEENTHS)["wait"]
    assert 0 <= waits.min() < 0.005 and 0.018 < waits.max() <= 0.025
    assert not plucks(engine(), SIXTEENTHS)["wait"].any()
    note = [(1000, ON, 40, 100)]
    began = first(sound(engine(humanise_time=25.0), note))
    wait = round(float(plucks(engine(humanise_time=25.0), note)["wait"][0]) * RATE)
    assert began - first(sound(engine(), note)) == wait > 20
    line = sound(engine(humanise_time=25.0, humanise_force=3.0), SIXTEENTHS)
    assert np.array_equal(line, sound(engine(humanise_time=25.0, humanise_force=3.0), SIXTEENTHS, (64, 1, 333)))


def first(played: Floats) -> int:
    return int(np.flatnonzero(played)[0])


@pytest.mark.parametrize("preset", ["jazz-finger", "slap", "slap-impulse"])
def test_a_note_released_while_its_stroke_waits_sounds_as_long(preset: str) -> None:
    """Finger, thrown thumb and struck thumb."""
    made = engine(preset, humanise_time=30.0)
    at = 2 * RATE // 100  # 20 ms
    seed = next(s for s in range(20) if wait_of(preset, s) > 0.022)
    short = [(1000, ON, 28, 110), (1000 + at, UP, 28, 0)]
    late, plain = sound(engine(preset, seed, humanise_time=30.0), short), sound(engine(preset, seed), short)
    assert made.instrument.player.slapped_strings == load_preset(preset).player.slapped_strings
    peak, wanted = np.abs(late).max(), np.abs(plain).max()
    assert 0.5 * wanted < peak < 2 * wanted, "it is not lost"
    assert np.abs(late[-RATE // 4 :]).max() < 0.02 * peak, "and it ends"


def wait_of(preset: str, seed: int) -> float:
    events = engine(preset, seed, humanise_time=30.0).play_messages(
        np.array([1000]), np.array([[ON, 28, 110]], np.uint8)
    )
    return float(events["wait"].max())


def frets(made: Engine, keys: tuple[int, ...]) -> list[tuple[int, int]]:
    """String and fret of each key, struck and released."""
    notes = [n for k, key in enumerate(keys) for n in ((1000 * k, ON, key, 90), (1000 * k + 900, UP, key, 0))]
    found = plucks(made, notes)
    return list(zip(found["string"].tolist(), found["fret"].tolist(), strict=True))


def test_the_hand_prefers_its_position() -> None:
    keys = (40, 43, 45, 40)
    assert frets(engine(), keys) == [(2, 2), (3, 0), (3, 2), (2, 2)]
    assert frets(engine(hand_position=7.0), keys) == [(1, 7), (3, 0), (2, 7), (1, 7)]
    assert frets(engine(hand_position=7.0, avoid_open=1.0), keys) == [(1, 7), (1, 10), (2, 7), (1, 7)]
    assert frets(engine(hand_position=7.0), (28,)) == [(0, 0)], "no other place has it"


def test_open_strings_are_avoided_where_another_string_has_the_note() -> None:
    keys = (33, 38, 43, 28)
    assert [fret for _, fret in frets(engine(), keys)] == [0, 0, 0, 0]
    assert [fret for _, fret in frets(engine(avoid_open=1.0), keys)] == [5, 5, 5, 0]
    held = [(0, ON, 36, 90), (500, ON, 33, 90)]  # the E string is taken
    assert plucks(engine(avoid_open=1.0, hand_position=8.0), held)["fret"].tolist() == [8, 0]


def test_the_blend_in_its_middle_is_the_basss_own() -> None:
    note = [(0, ON, 33, 100)]
    own, middle = sound(engine(), note), sound(engine(blend=0.0), note)
    neck, bridge = sound(engine(blend=-1.0), note), sound(engine(blend=1.0), note)
    assert np.array_equal(own, middle)
    by_controller = sound(engine(), [(0, 0xB0, 18, 127), *note])
    assert np.array_equal(bridge, by_controller) and np.abs(neck - bridge).max() > 0.1 * np.abs(own).max()
    assert 1.2 * pitch_of_mass(neck) < pitch_of_mass(bridge), "the bridge pickup has less of the fundamental"
    under = [p.strings for p in load_preset("precision-finger").output.pickups]
    assert under == [("E", "A"), ("D", "G")], "one pickup under each string"
    assert np.array_equal(sound(engine("precision-finger"), note), sound(engine("precision-finger", blend=1.0), note))


def pitch_of_mass(played: Floats) -> float:
    """The mean frequency of the power, Hz."""
    power = np.abs(np.fft.rfft(played)) ** 2
    return float(power @ np.fft.rfftfreq(len(played), 1 / RATE) / power.sum())
