"""The pitch of notes that move the string straight up, on necks with turned axes, against the note's.

A hammer or a thumb moves u alone, so both lines of its fundamental sound: that of axis a, which is in tune, and that of
b, up to 13 cents away.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from support.costs import quick
from support.messages import Message, on, send_now
from support.own_basses import AS_SHIPPED
from support.quiet import ALONE, engine, without_noise

from livebass import QUALITIES, load_preset
from livebass.engine.engine import Engine
from livebass.model.instrument import Instrument, note_frequency, speaking
from livebass.model.modes import dampings
from livebass.rows.arrays import Floats

RATE = 48000
TURNED = ("slap", "precision-pick", "jazz-finger", "upright", "short-scale")
ON_STRING, TAP, FINGERS, THUMB = (16, 9, 14, 19), 2, 13, 18  # key switches
START, SECONDS = 0.2, 0.6  # s that are heard
CENTS = 3.0
SPLIT = 7.0  # times as fast as b that axis a dies on a dead spot


def heard(sound: Floats, note: int) -> float:
    """Cents from a note to its fundamental: the mean of its momentary frequency, weighted by its power.

    The pitch of a beating pair is heard near that mean (Feth 1974; Anantharaman, Krishnamurthy and Feth 1993).
    """
    hertz = note_frequency(note)
    window = np.hanning(round(4 * RATE / hertz))
    turn = sound * np.exp(-2j * math.pi * hertz / RATE * np.arange(sound.size))
    part = np.convolve(turn, window / window.sum(), "same")[round(START * RATE) :][: round(SECONDS * RATE)]
    turns = part[1:] * part[:-1].conj()
    off = float(np.sum(np.angle(turns) * np.abs(turns)) / np.sum(np.abs(turns))) * RATE / (2 * math.pi)
    return 1200 * math.log2(1 + off / hertz)


def played(preset: str, i: int, note: int, switch: int) -> float:
    """`heard` of a note of medium force on string `i`, played as a key switch says."""
    hands = engine(preset + AS_SHIPPED + ALONE)
    messages: list[Message] = [on(ON_STRING[i], 100), on(switch, 100), on(note, 70)]
    send_now(hands, *messages)
    return heard(hands.process(round((START + SECONDS + 0.1) * RATE)).sum(axis=0), note)


def is_dead(bass: Instrument, i: int, fret: int) -> bool:
    """True where the neck takes the fundamental's line along a before that along b."""
    s = replace(speaking(bass.strings[i], bass.necks[i], fret), axes_turned=0.0)
    return bool(dampings(s, 1)[0] > SPLIT * dampings(s, 1, across=True)[0])


@pytest.mark.parametrize(
    ("preset", "i"),
    quick(
        itertools.product(TURNED, range(4)),
        always=[*(("slap", i) for i in range(4)), *((name, k) for k, name in enumerate(TURNED[1:]))],
    ),
)
def test_hammers_and_thumbs_are_in_tune(preset: str, i: int) -> None:
    """Within 3 cents of the note, and of the plucked note; dead spots excepted, which no tuning serves."""
    bass = load_preset(preset)
    for fret in (3, 5, 6, 7, 9, 12):
        note = bass.strings[i].open_note + fret
        if is_dead(bass, i, fret):
            continue
        plucked = played(preset, i, note, FINGERS)
        for switch in (TAP, THUMB)[: 2 if i < 2 else 1]:
            found = played(preset, i, note, switch)
            assert abs(found) < CENTS and abs(found - plucked) < CENTS, (fret, switch, found, plucked)


def test_dead_spots_are_few() -> None:
    """All on the G string: C# on slap, D on precision-pick, C on short-scale."""
    dead = {
        (name, i, fret)
        for name in TURNED
        for bass in [load_preset(name)]
        for i in range(4)
        for fret in range(13)
        if is_dead(bass, i, fret)
    }
    assert dead == {("slap", 3, 6), ("precision-pick", 3, 7), ("short-scale", 3, 5)}, dead


def test_farther_turned_axes_would_be_heard_flat() -> None:
    """At 70 degrees a hammer-on wakes b, not a: it is 4 cents flat, beyond what the presets keep."""
    bass = load_preset("jazz-finger")
    necks = tuple(replace(neck, axes_turned=math.radians(70)) for neck in bass.necks)
    hands = Engine(without_noise(replace(bass, necks=necks), answering="off"), QUALITIES["live"], RATE)
    send_now(hands, on(ON_STRING[0], 100), on(TAP, 100), on(35, 70))
    assert heard(hands.process(round((START + SECONDS + 0.1) * RATE)).sum(axis=0), 35) < -CENTS


def test_the_stronger_of_two_lines_counts_for_more() -> None:
    time = np.arange(round((START + SECONDS + 0.1) * RATE)) / RATE
    one, two = (np.sin(2 * math.pi * note_frequency(57) * 2 ** (cents / 1200) * time) for cents in (5.0, -35.0))
    assert heard(one, 57) == pytest.approx(5.0, abs=0.05) and -35 < heard(one + two, 57) < 5
    assert heard(one + 0.3 * two, 57) == pytest.approx(5 - 40 * 0.09 / 1.09, abs=1.5)
