"""Limits of the arguments of `identify`, shared with the command: this file loads fast."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

from livebass.model.quality import Limits
from livebass.rows.bounds import within

MODES = (4, 200)  # partials to look for
CHANNELS = (1, 64)
F0 = Limits("frequency", 20, 1000)
START = Limits("time", 0, 10)
DURATION = Limits("time", 0.05, 60)


@dataclass(frozen=True)
class Search:
    """The notes to look for in recordings, and how much of each to use. Raises ValueError for values out of limits."""

    note: int | None = None  # MIDI, of the open string
    f0: float | None = None  # Hz, instead of `note`; None for both: any pitch
    modes: int = 60  # partials at most
    start: float = 0.02  # s after the attack
    duration: float = 5.0  # s at most
    channel: int | None = None  # from 1; None: the loudest

    def __post_init__(self) -> None:
        within("modes", self.modes, *MODES, whole=True)
        if self.channel is not None:
            within("channel", self.channel, *CHANNELS, whole=True)
        START.check("start", self.start)
        DURATION.check("duration", self.duration)
        if self.f0 is not None:
            F0.check("f0", self.f0)
            if self.note is not None:
                raise ValueError("note and f0 are both given: one of them is enough")


class Searching(TypedDict, total=False):
    """The fields of a `Search`, as keyword arguments."""

    note: int | None
    f0: float | None
    modes: int
    start: float
    duration: float
    channel: int | None
