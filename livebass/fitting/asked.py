"""A fit as somebody asks for it: files in, a preset out."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from livebass.comparison.names import NOTE
from livebass.comparison.notes import measured
from livebass.cores import core_count
from livebass.experiment.workers import Compute, connected, lasting
from livebass.fitting.fit import Fitted, Wanted, fit_recorded
from livebass.fitting.guide import Step, steps
from livebass.fitting.notes import recorded
from livebass.fitting.problem import solved
from livebass.fitting.written import text_of
from livebass.preset.load import DEFAULT, load_preset
from livebass.preset.source import PresetError
from livebass.report.progress import Say, silent
from livebass.units import one_line


@dataclass(frozen=True)
class Fit:
    """What to fit, and how long to search."""

    like: str | None = None  # preset to begin with, a name or path; None: the nearest shipped one
    tuning: str | None = None  # of the open strings, as for `load_preset`
    technique: str | None = None  # of all notes: "fingers", "pick" ...; None: by the file names
    beside: tuple[str | os.PathLike[str], ...] = ()  # notes of other real basses, to judge by
    seed: int = 0  # of the search
    trials: int = 600
    minutes: float = math.inf
    workers: int | None = None  # processes; None: one per core
    scheduler: str | None = None  # of a Dask cluster, instead


def fit(
    notes: Sequence[str | os.PathLike[str]],
    asked: Fit = Fit(),
    directory: str | os.PathLike[str] | None = None,
    say: Say = silent,
    step: Callable[[int], None] = lambda _: None,
) -> Fitted:
    """Turns recorded notes of a bass into a preset, as `livebass fit` does.

    Args:
        notes: Sound files of single notes, or folders of them; `livebass fit --help` says how to name them.
        asked: What to fit, and how long.
        directory: Keeps every trial, so that the same call goes on; None: they are forgotten.
        say: Gets a line for each part of the work, and for each doubt.
        step: Gets the number of trials done.

    Returns:
        The fit: `sentence` judges it, `fitted_preset` writes the preset.

    Raises:
        ValueError: A file is no sound, or the notes do not suffice; one line.
        PresetError: `like` is no preset.
    """
    found = recorded(tuple(map(Path, notes)), asked.technique, _guide(asked))
    for doubt in found.doubts:
        say(f"doubt: {doubt}")
    with _place(directory) as place, _computer(asked, say) as compute:
        return fit_recorded(found, _wanted(asked), compute, place, say, step)


def fitted_preset(fitted: Fitted, path: str | os.PathLike[str], remark: str = "livebass.fit") -> str:
    """Returns the text of a fitted preset, to write to `path`; `remark`: how it was made."""
    return text_of(fitted, Path(path), remark)


def _guide(asked: Fit) -> list[Step]:
    """The guide in whose order one long recording may be; none if the default bass cannot be tuned so."""
    try:
        return steps(load_preset(asked.like or DEFAULT, tuning=asked.tuning))
    except PresetError:
        if asked.like is not None:
            raise
        return []


def _wanted(asked: Fit) -> Wanted:
    others = tuple(
        (one_line(path.resolve().name), tuple(n for n in measured([path], asked.technique) if n.kind == NOTE))
        for path in map(Path, asked.beside)
    )
    return Wanted(DEFAULT, asked.like, asked.tuning, asked.seed, asked.trials, asked.minutes, others)


@contextmanager
def _place(directory: str | os.PathLike[str] | None) -> Iterator[Path]:
    """The directory of the trials, with its folder of points."""
    with TemporaryDirectory() if directory is None else nullcontext(directory) as place:
        (Path(place) / "points").mkdir(parents=True, exist_ok=True)
        yield Path(place)


@contextmanager
def _computer(asked: Fit, say: Say) -> Iterator[Compute]:
    if asked.scheduler is not None:
        with connected(asked.scheduler, solved) as compute:
            yield compute
        return
    with lasting(asked.workers or core_count(), solved, say) as compute:
        yield compute
