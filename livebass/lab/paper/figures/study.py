"""A study: one question to the model, the motions it needs, and the resulting figures, tables and sounds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.lab.analysis.motion import Solved
from livebass.lab.paper.solving import Job
from livebass.rows.arrays import Floats


@dataclass(frozen=True)
class Picture:
    """A figure; its files are called `name`."""

    name: str
    caption: str
    figure: Any  # matplotlib.figure.Figure


@dataclass(frozen=True)
class Table:
    """Rows under columns, for a CSV file and, if `shown`, the page."""

    name: str
    caption: str
    columns: tuple[str, ...]
    rows: list[tuple[Any, ...]]
    shown: bool = True


@dataclass(frozen=True)
class Sound:
    """A displacement to listen to, (n,), m; its file is called `name`."""

    name: str
    caption: str
    samples: Floats
    rate: int  # Hz


@dataclass
class Findings:
    """The results of a study."""

    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    sounds: list[Sound] = field(default_factory=list)
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)  # into result.npz
    numbers: dict[str, Any] = field(default_factory=dict)  # into summary.json


@dataclass(frozen=True)
class Study:
    """A question to the model: the motions that it needs, and the report on them."""

    name: str
    title: str
    section: str  # of the paper
    gives: str  # its results in one line
    jobs: Callable[[float | None], dict[str, Job]]  # takes the duration of each (s); None: its own
    report: Callable[[Mapping[str, Solved]], Findings]  # takes the solved jobs under the same keys


def curve(name: str, caption: str, **columns: Any) -> Table:
    """A table of arrays of equal length, for the CSV file only."""
    rows = list(zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True))
    return Table(name, caption, tuple(columns), rows, shown=False)
