"""Plays single notes of a bass on given strings, as a MIDI guitar does: a channel for each string."""

from __future__ import annotations

import math

import numpy as np

from livebass.engine.engine import Engine
from livebass.model.instrument import Player
from livebass.model.keymap import velocity_parts
from livebass.rows.arrays import Floats

MONO, NOTE_ON, NOTE_OFF = (0xB0, 126), 0x90, 0x80
DEFAULT_RATE = 44_100  # Hz


def velocity_of(player: Player, force: float) -> int:
    """The velocity whose force is nearest, on a log scale; 1 and 127 for forces beyond the player's."""
    softest = max(player.softest, 1e-3)
    part = math.log(max(force, 1e-6) / softest) / max(math.log(player.hardest / softest), 1e-9)
    parts = velocity_parts(player.velocity_curve)
    return 1 + int(np.argmin(np.abs(np.array(parts[1:]) - part)))


def play_note(
    engine: Engine, string: int, key: int, velocity: int, seconds: float, released: float | None = None
) -> Floats:
    """The sound (n,) of a note on a string, by its index, for `seconds`; let go after `released` (s), if given."""
    channel = len(engine.instrument.strings) - 1 - string
    frames, messages = [0], [[NOTE_ON | channel, key, velocity]]
    if channel or len(engine.instrument.strings) > 1:
        frames.insert(0, 0)
        messages.insert(0, [*MONO, len(engine.instrument.strings)])
    if released is not None:
        frames.append(round(released * engine.rate))
        messages.append([NOTE_OFF | channel, key, 64])
    engine.send(np.array(frames), np.array(messages, np.uint8))
    return np.asarray(engine.process(round(seconds * engine.rate)).sum(axis=0))
