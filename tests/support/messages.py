"""MIDI messages, as (status, first, second), and those of a score with their frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from livebass.engine.basses import Basses
from livebass.engine.engine import Engine
from livebass.score.score import Score

Message = tuple[int, int, int]
Timed = tuple[int, int, int, int]  # frame, status, first, second


def messages_of(score: Score) -> list[Timed]:
    """A score's messages in the form of `Module.send` and the page's audio thread."""
    return [(int(frame), *map(int, message)) for frame, message in zip(score.frames, score.messages, strict=True)]


def send(engine: Engine | Basses, messages: Sequence[Sequence[int]]) -> None:
    """Sends messages (frame, status, first, second) to an engine."""
    rows = np.array(messages, np.int64).reshape(-1, 4)
    engine.send(rows[:, 0].copy(), rows[:, 1:].astype(np.uint8))


def send_now(engine: Engine, *messages: Message) -> None:
    """Sends messages that an engine plays at once."""
    send(engine, [(engine.frame, *message) for message in messages])


def on(key: int, velocity: int = 90) -> Message:
    return (0x90, key, velocity)


def off(key: int) -> Message:
    return (0x80, key, 0)


def control(number: int, value: int = 0) -> Message:
    return (0xB0, number, value)


def wheel(value: int) -> Message:
    """The pitch bend wheel at `value`, -8192 to 8191."""
    return (0xE0, (value + 8192) & 127, (value + 8192) >> 7)
