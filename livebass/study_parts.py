"""What a study is, and what comes out of one: figures, tables, sounds, arrays and numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.analysis import Contactogram, contactogram
from livebass.instrument import Speaking
from livebass.motion import Motion, Trial

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Solved:
    """A trial and how it came out."""

    trial: Trial
    motion: Motion

    @property
    def speaking(self) -> Speaking:
        return self.trial.speaking

    @property
    def contacts(self) -> Contactogram:
        """Which fret was touched when; 0 is wood."""
        return contactogram(self.motion.contact_time_s, self.motion.contact_index, self.speaking.contact_fret)

    @property
    def contact_place(self) -> Floats:
        """Where each of `contacts` was, m from the stop."""
        return np.asarray(self.speaking.contact_position, np.float64)[self.motion.contact_index]

    @property
    def over_board(self) -> bool:
        """Whether the string may touch wood, anywhere, and not frets only."""
        return bool(self.speaking.surface)

    def displacement(self, across: bool = False) -> Floats:
        """u at its sensor, or v at its own, m, (n,); ValueError for v of a pluck along u."""
        if not across:
            return self.motion.displacement_m
        if self.motion.across_m is None:
            raise ValueError("plucked along u: there is no v")
        return self.motion.across_m


@dataclass(frozen=True)
class Picture:
    """A figure; its file is called `name`."""

    name: str
    caption: str
    figure: Any  # matplotlib.figure.Figure


@dataclass(frozen=True)
class Table:
    """Rows under columns, as CSV; on the page too where `shown`."""

    name: str
    caption: str
    columns: tuple[str, ...]
    rows: list[tuple[Any, ...]]
    shown: bool = True


@dataclass(frozen=True)
class Sound:
    """Something to listen to, (n,), in m; its file is called `name`."""

    name: str
    caption: str
    samples: Floats
    rate: int  # Hz


@dataclass
class Findings:
    """All that comes out of a study."""

    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    sounds: list[Sound] = field(default_factory=list)
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)  # into result.npz
    numbers: dict[str, Any] = field(default_factory=dict)  # what JSON can hold


@dataclass(frozen=True)
class Study:
    """One question to the model: the motions it needs, and what is made of them."""

    name: str
    title: str
    section: str  # of the paper
    gives: str  # what comes out, in a line
    trials: Callable[[float | None], dict[str, Trial]]  # duration (s) of each, None: its own
    report: Callable[[Mapping[str, Solved]], Findings]  # of the same keys


def curve(name: str, caption: str, **columns: Any) -> Table:
    """A table of arrays of one length, too long to be shown."""
    rows = list(zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True))
    return Table(name, caption, tuple(columns), rows, shown=False)
