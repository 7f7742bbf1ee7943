"""Equal velocity, equal level: over every preset, string, fret and stroke that a player uses.

A level is that of the first LENGTH s, rms, of an even player's note: what an ear takes for its loudness. `python
tests/engine/test_evenness.py PRESET ...` prints the table, a row a string, stroke and velocity, a column a fret.
"""

from __future__ import annotations

import dataclasses
import functools
import sys
from collections.abc import Iterable

import numpy as np
import pytest

from livebass import QUALITIES, load_preset, preset_names
from livebass.engine.engine import Engine
from livebass.kernels import performer
from livebass.units import decibels

RATE = 48000
LENGTH = 0.3  # s
NEIGHBOURS, STRING = 3.0, 6.0  # dB, at most: from fret to fret, and from the lowest to the highest of a string
VELOCITIES = (60, 100)
# Key switches of the strokes, by the usual map; "own": what the bass begins with
KEYS = {"own": None, "fingers": 13, "pick": 15, "thumb and pops": 18, "tap": 2, "ghost": 10, "left": 7}
STROKES = ("own", "pick", "thumb and pops")
SOME = (0, 1, 4, 9, 12, 16, 19, 20)  # frets
SLAPPED = ("slap", "slap-thumb")
THUMB_AND_POPS = 2.0  # dB, between the typical note of the thumb and of pops
UP_STROKE = (0.5, 1.5)  # dB under a stroke that goes down
LEGATO = (2.0, 7.0)  # dB of a hammer-on or tap at velocity 80 under the pluck, any note; and ...
USUAL_LEGATO = (3.0, 6.0)  # ... the typical one
SAME_HAMMER = 3.0  # dB, by which a hammer-on at any moment differs from others
GHOST_AND_LEFT = 4.0  # dB, between the peaks of ghost notes and of left-hand slaps
LOW = [name for name in preset_names() if name.startswith("paper")]  # of these the notes are measured, not the hand


@functools.cache
def engine(name: str) -> Engine:
    bass = load_preset(name)
    return Engine(dataclasses.replace(bass, player=dataclasses.replace(bass.player, unevenness=0.0)), QUALITIES["live"], RATE)


def play(player: Engine, *messages: tuple[int, int, int]) -> None:
    """Sends messages now."""
    player.send(np.full(len(messages), player.frame), np.array(messages, np.uint8))


def on_string(player: Engine, i: int, fret: int) -> int:
    """The key of a note, which string `i` will play."""
    key = player.instrument.strings[i].open_note + fret
    player.performer["string_of"][0, key] = i
    return key


def sound(name: str, i: int, fret: int, stroke: str, velocity: int, up: bool = False) -> np.ndarray:
    """The first LENGTH s of one note out of silence, (n_frames,)."""
    player = engine(name).another()
    switch = KEYS[stroke]
    if switch is not None:
        play(player, (0x90, switch, 100))
    player.performer["other"] = int(up)
    play(player, (0x90, on_string(player, i, fret), velocity))
    return player.process(round(LENGTH * RATE)).sum(axis=0)


def rms(x: np.ndarray) -> float:
    return decibels(float(np.sqrt(np.mean(x**2))))


def level(name: str, i: int, fret: int, stroke: str, velocity: int) -> float:
    return rms(sound(name, i, fret, stroke, velocity))


def levels(name: str, i: int, frets: Iterable[int], stroke: str, velocity: int) -> np.ndarray:
    last = engine(name).frets
    return np.array([level(name, i, fret, stroke, velocity) for fret in frets if fret <= last])


def check(name: str, stroke: str, velocity: int, frets: Iterable[int]) -> None:
    for i, string in enumerate(engine(name).instrument.strings):
        found = levels(name, i, frets, stroke, velocity)
        what = f"{name}, {stroke}, velocity {velocity}, {string.name}: {np.round(found, 1)}"
        assert np.ptp(found) <= STRING, f"{what} differ by {np.ptp(found):.1f} dB"
        steps = np.abs(np.diff(found)).max()
        assert steps <= NEIGHBOURS, f"{what}: a step of {steps:.1f} dB"


if __name__ == "__main__":
    for name in sys.argv[1:] or preset_names():
        for stroke in STROKES:
            for velocity in VELOCITIES:
                for i, string in enumerate(engine(name).instrument.strings):
                    row = levels(name, i, range(engine(name).frets + 1), stroke, velocity)
                    ends = f"{np.ptp(row):4.1f} {np.abs(np.diff(row)).max():4.1f}"
                    print(f"{name:16} {stroke:14} {velocity:3} {string.name:2} {ends} |", *(f"{x:5.1f}" for x in row), flush=True)
