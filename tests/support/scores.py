"""A dense score, and playing it in blocks of any sizes."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from itertools import cycle
from operator import itemgetter

import numpy as np

from livebass import Quality, Score, load_preset
from livebass.engine.basses import Basses
from livebass.engine.engine import Engine
from livebass.model.keymap import MODO
from livebass.rows.arrays import Floats
from support.messages import messages_of, send

SWITCH_KEYS = [key for key, *_ in MODO.keys]
QUICK = Quality("quick", 150, 400e3)
RATE = 44100


def blocks(frames: int, sizes: Iterable[int], start: int = 0) -> Iterator[tuple[int, int]]:
    """The first frame and the size of blocks of `sizes`, in turn, that have `frames` from `start` on, or more."""
    begin = start
    for size in cycle(sizes):
        if begin >= start + frames:
            return
        yield begin, size
        begin += size


def busy_score(rate: int = RATE) -> Score:
    """A second and a half of random notes, techniques, bends and pedal, off the edges of blocks."""
    rng = np.random.default_rng(7)
    frames, messages = [], []
    held: list[int] = []
    for frame in np.sort(rng.integers(0, rate * 3 // 2, 150)).tolist():
        kind = rng.integers(0, 13)
        if kind < 5:
            held.append(int(rng.integers(24, 70)))
            message = [0x90, held[-1], int(rng.integers(1, 128))]
        elif kind < 7 and held:
            message = [0x80, held.pop(0), int(rng.integers(0, 128))]
        elif kind < 8:
            message = [0xE0, int(rng.integers(0, 128)), int(rng.integers(0, 128))]
        elif kind < 11:
            message = [0xB0, int(rng.choice([1, 7, 9, 11, 16, 64, 65, 68, 120, 121])), int(rng.integers(0, 128))]
        else:
            message = [int(rng.choice([0x90, 0x90, 0x80])), int(rng.choice(SWITCH_KEYS)), 64]
        frames.append(frame)
        messages.append(message)
    notes = sum(message[0] == 0x90 for message in messages)
    return Score(np.array(frames), np.array(messages, np.uint8), frames[-1], notes, "busy", rate)


def play_in_blocks(
    engine: Engine | Basses, messages: Sequence[Sequence[int]], frames: int, sizes: Sequence[int]
) -> Floats:
    """Messages (frame, status, first, second) played until `frames`, (strings, frames), in blocks of `sizes` in turn.

    Each block's messages are sent before it.
    """
    blocks, sent, turns = [], 0, cycle(sizes)
    while engine.frame < frames:
        count = min(next(turns), frames - engine.frame)
        until = bisect_left(messages, engine.frame + count, key=itemgetter(0))
        if until > sent:
            send(engine, messages[sent:until])
        blocks.append(engine.process(count))
        sent = until
    return np.concatenate(blocks, axis=1)


def in_blocks(score: Score, sizes: list[int], preset: str = "slap") -> Floats:
    """`score` played by `play_in_blocks`."""
    return play_in_blocks(Engine(load_preset(preset), QUICK, score.rate), messages_of(score), score.end_frame, sizes)
