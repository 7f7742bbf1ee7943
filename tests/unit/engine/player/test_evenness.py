"""Equal velocity, equal level: over every preset, string, fret and stroke that a player uses.

A level is the rms of the first LENGTH s of an even player's note, which an ear takes for its loudness.
`python tests/unit/engine/player/test_evenness.py PRESET ...` prints a table: a row per string, stroke and velocity, a
column per fret.
"""

from __future__ import annotations

import functools
import itertools
import sys
from collections.abc import Iterable

import numpy as np
import pytest
from support.costs import KINDS, of_each_kind, quick
from support.messages import send_now
from support.strings import even

from livebass import QUALITIES, load_preset, preset_names
from livebass.engine.engine import Engine
from livebass.rows.units import decibels

RATE = 48000
LENGTH = 0.3  # s
STRING, NEIGHBOURS = 7.5, 3.0  # dB, at most: from the lowest to the highest note of a string, and from fret to fret
GUEST = 1.0  # dB more, for strokes chosen by a key
# dB more, for strings whose short notes die soonest: an upright's, old flat wounds on a short neck, at a dead spot
DYING = {"upright": 6.0, "short-scale": 4.0, "six-string": 0.5, "muted": 0.5, "palm": 2.0, "precision-pick": 0.5}
LAST_THUMB = 7.0  # dB, at the last fret under slap's thumb: no fret lies under it to slap the string on
# Key switches of the strokes, by the usual map; "own": the bass's initial stroke
KEYS = {"own": None, "fingers": 13, "pick": 15, "thumb and pops": 18, "tap": 2, "ghost": 10, "left": 7}
STROKES = ("own", "pick", "thumb and pops")
SOME, FEW = (0, 4, 9, 16, 20, 24), (0, 9, 20, 24)  # frets, for hard notes and for others
PAPER = ("paper-bass", "paper-fretless", "paper-g")  # laboratory strings, which nobody slaps
SLAPPED = ("slap", "slap-impulse")
# Always run: the preset's initial stroke on one bass of each kind that people play, and two others
ALWAYS = {"own": KINDS - {*PAPER}, "pick": {"six-string"}, "thumb and pops": {"precision-finger"}}
TWO = ["jazz-finger", "slap"]  # always run
PLAYED = sorted(set(preset_names()) - {*PAPER, "upright"})  # nobody plays an upright with a pick, or slaps it so
THUMB_AND_POPS, GUESTS = 3.0, 3.0  # dB, between typical notes of thumb and pops; on a finger bass
UP_STROKE = (0.5, 4.0)  # dB of a pick's up-stroke below its down-stroke
LEGATO, ANY_LEGATO = (0.3, 8.0), (-2.0, 12.5)  # dB over plucks: typical hammer-ons and taps at velocity 80; any
SAME_HAMMER = 3.0  # dB, at most, by which a hammer-on varies with its moment
GHOST_AND_LEFT = 6.5  # dB, between typical peaks of ghost notes and of left-hand slaps
# s between two notes of a string; dB, at most, between the second and one from silence: other strings answer
AFTER, ANEW = 0.25, 1.6


@functools.cache
def engine(name: str) -> Engine:
    return Engine(even(load_preset(name)), QUALITIES["live"], RATE)


def on_string(player: Engine, i: int, fret: int) -> int:
    """The key of a note that string `i` will play."""
    key = player.instrument.strings[i].open_note + fret
    player.performer["controls"]["string_of"][0, key] = i
    return key


def sound(name: str, i: int, fret: int, stroke: str, velocity: int, up: bool = False) -> np.ndarray:
    """The first LENGTH s of one note from silence, (n_frames,)."""
    player = engine(name).another()
    switch = KEYS[stroke]
    if switch is not None:
        send_now(player, (0x90, switch, 100))
    player.performer["hands"]["other"] = int(up)
    send_now(player, (0x90, on_string(player, i, fret), velocity))
    return player.process(round(LENGTH * RATE)).sum(axis=0)


def rms(x: np.ndarray) -> float:
    return decibels(float(np.sqrt(np.mean(x**2))))


def level(name: str, i: int, fret: int, stroke: str, velocity: int) -> float:
    return rms(sound(name, i, fret, stroke, velocity))


def levels(name: str, i: int, frets: Iterable[int], stroke: str, velocity: int) -> np.ndarray:
    last = engine(name).frets
    return np.array([level(name, i, fret, stroke, velocity) for fret in frets if fret <= last])


def is_last_of_thumb(name: str, stroke: str, i: int) -> bool:
    """True if a thumb with a mass strikes string `i`."""
    bass = engine(name).instrument
    return bass.player.thumb_mass > 0.0 and stroke != "pick" and i < bass.player.slapped_strings


@pytest.mark.parametrize(
    ("stroke", "name"),
    [
        pytest.param(stroke, name, marks=() if name in ALWAYS[stroke] else pytest.mark.slow)
        for stroke, name in itertools.product(STROKES, preset_names())
        if stroke != "thumb and pops" or name not in (*PAPER, *SLAPPED, "upright")  # a slapped bass begins with them
    ],
)
def test_a_string_is_even(name: str, stroke: str) -> None:
    more = (0.0 if stroke == "own" else GUEST) + DYING.get(name, 0.0)
    bass = engine(name).instrument
    dear = bass.over_board and stroke != "own"  # a hard pop over a board takes many times its own length to compute
    for velocity, frets in ((60, FEW), (100, FEW[:3] if dear else SOME)):
        for i, string in list(enumerate(bass.strings))[:: 3 if dear else 1]:
            found = levels(name, i, frets, stroke, velocity)
            what = f"{name}, {stroke}, velocity {velocity}, {string.name}: {np.round(found, 1)}"
            if is_last_of_thumb(name, stroke, i):
                assert abs(found[-1] - found[-2]) <= LAST_THUMB, what
                found = found[:-1]
            assert np.ptp(found) <= STRING + more, f"{what} differ by {np.ptp(found):.1f} dB"
            # the tested frets are not neighbours, so this is stricter than required
            assert np.abs(np.diff(found)).max() <= STRING + more
            beside = levels(name, i, (0, 1), stroke, velocity)  # the steepest step: the nut stands high
            assert np.ptp(beside) <= NEIGHBOURS + more, f"{what}: a step of {np.ptp(beside):.1f} dB"


def typical(name: str, strings: Iterable[int], stroke: str, velocity: int) -> float:
    """The median level of notes on these strings."""
    return float(np.median([levels(name, i, (0, 3, 5, 8, 12, 15), stroke, velocity) for i in strings]))


@pytest.mark.parametrize(
    ("name", "velocity"),
    quick(
        itertools.product((*SLAPPED, "jazz-finger", "precision-finger"), (60, 80, 100)),
        always=[("slap", 60), ("slap-impulse", 80), ("jazz-finger", 100)],
    ),
)
def test_pops_are_level_with_the_thumb(name: str, velocity: int) -> None:
    """Pops of a slapped bass, and pops that a key brings to another."""
    apart = THUMB_AND_POPS if name in SLAPPED else GUESTS
    slapped = engine(name).instrument.player.slapped_strings or 2
    thumb = typical(name, range(slapped), "thumb and pops", velocity)
    pops = typical(name, range(slapped, len(engine(name).instrument.strings)), "thumb and pops", velocity)
    assert abs(thumb - pops) <= apart, f"{name}, {velocity}: thumb {thumb:.1f}, pops {pops:.1f} dB"


@pytest.mark.parametrize("name", SLAPPED)
def test_a_slapped_bass_pops_of_itself(name: str) -> None:
    """Its initial stroke is the one of key 18; with fingers, key 13, it does not pop."""
    last = len(engine(name).instrument.strings) - 1
    own, keyed, fingers = (sound(name, last, 5, stroke, 100) for stroke in ("own", "thumb and pops", "fingers"))
    assert np.array_equal(own, keyed)
    assert rms(own) - rms(fingers) > 1.0


@pytest.mark.parametrize("name", of_each_kind(PLAYED))
def test_a_pick_that_goes_up_is_hardly_softer(name: str) -> None:
    less = [
        rms(sound(name, i, fret, "pick", 80)) - rms(sound(name, i, fret, "pick", 80, up=True))
        for i in range(len(engine(name).instrument.strings))
        for fret in (0, 5, 12)
    ]
    assert UP_STROKE[0] <= float(np.median(less)) <= UP_STROKE[1], less


def hammer(name: str, i: int, first: int, second: int, after: float, velocity: int = 80) -> float:
    """Level of a hammer-on between two frets, `after` s after the pluck."""
    player = engine(name).another()
    send_now(player, (0x90, KEYS["fingers"] or 0, 100), (0xB0, 68, 127), (0x90, on_string(player, i, first), velocity))
    player.process(round(after * RATE))
    send_now(player, (0x90, player.instrument.strings[i].open_note + second, velocity))
    return rms(player.process(round(LENGTH * RATE)).sum(axis=0))


@pytest.mark.parametrize("name", quick(PLAYED, TWO))
def test_a_hammer_on_is_a_little_softer_than_a_pluck_at_any_moment(name: str) -> None:
    """Whatever the string's motion when the finger lands; a tap from silence too."""
    strings = range(len(engine(name).instrument.strings))
    under = []
    for k, (i, (first, second)) in enumerate(itertools.product(strings, ((0, 2), (5, 7), (3, 4)))):
        pluck = level(name, i, second, "fingers", 80)
        found = [hammer(name, i, first, second, 0.3 + 1.7e-3 * moment) for moment in range(k % 3, 9, 3)]
        assert np.ptp(found) <= SAME_HAMMER, (name, i, first, second, found)
        under.append(pluck - float(np.median(found)))
    taps = [level(name, i, f, "fingers", 80) - level(name, i, f, "tap", 80) for i in strings for f in (2, 7, 12, 17)]
    for what in (under, taps):
        assert LEGATO[0] <= np.median(what) <= LEGATO[1], np.round(what, 1)
        assert min(what) >= ANY_LEGATO[0] and max(what) <= ANY_LEGATO[1], np.round(what, 1)


def second(name: str, i: int, before: int, fret: int, stroke: str) -> float:
    """Level of a note AFTER another of the same string and stroke has ended."""
    player = engine(name).another()
    send_now(player, (0x90, KEYS[stroke] or 0, 100))
    for k, n in enumerate((before, fret)):
        player.performer["hands"]["other"] = 0
        key = on_string(player, i, n)
        send_now(player, (0x90, key, 100))
        if k == 0:
            player.process(round(LENGTH * RATE))
            send_now(player, (0x80, key, 0))
            player.process(round(AFTER * RATE))
    return rms(player.process(round(LENGTH * RATE)).sum(axis=0))


@pytest.mark.parametrize(
    ("name", "stroke"),
    quick(
        itertools.product(("slap", "slap-impulse", "jazz-finger", "fretless"), ("fingers", "pick", "thumb and pops")),
        always=[("slap", "thumb and pops"), ("fretless", "pick")],
    ),
)
def test_a_note_is_as_loud_on_a_string_that_hands_have_just_ended(name: str, stroke: str) -> None:
    """The inaudible rest of the last note takes nothing from this one, on the same fret or another."""
    for i in range(len(engine(name).instrument.strings)):
        for before, fret in ((3, 3), (5, 3), (0, 7)):
            change = second(name, i, before, fret, stroke) - level(name, i, fret, stroke, 100)
            assert abs(change) < ANEW, (name, stroke, i, before, fret, change)


@pytest.mark.parametrize("name", quick(sorted(set(PLAYED) - {"fretless"}), TWO))  # over a board key 7 is a ghost note
def test_ghost_notes_and_left_hand_slaps_are_alike(name: str) -> None:
    notes = [(i, fret) for i in range(len(engine(name).instrument.strings)) for fret in (0, 5, 12)]
    for velocity in (60, 80, 100):
        ghost, left = (
            np.median([decibels(float(np.abs(sound(name, *note, stroke, velocity)).max())) for note in notes])
            for stroke in ("ghost", "left")
        )
        assert abs(ghost - left) <= GHOST_AND_LEFT, f"{name}, {velocity}: ghost {ghost:.1f}, left hand {left:.1f} dBFS"


if __name__ == "__main__":
    for name in sys.argv[1:] or preset_names():
        for stroke in STROKES:
            for velocity in (60, 100):
                for i, string in enumerate(engine(name).instrument.strings):
                    row = levels(name, i, range(engine(name).frets + 1), stroke, velocity)
                    ends = f"{np.ptp(row):4.1f} {np.abs(np.diff(row)).max():4.1f}"
                    heading = f"{name:16} {stroke:14} {velocity:3} {string.name:2} {ends} |"
                    print(heading, *(f"{x:5.1f}" for x in row), flush=True)
