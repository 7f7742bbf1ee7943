"""A requested fit: sound files in, a preset out."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from livebass.lab.comparison.names import NOTE
from livebass.lab.comparison.notes import measure_notes
from livebass.lab.experiment.workers import Compute, connect, lasting
from livebass.lab.fitting.fit import Fitted, Wanted, fit_recorded
from livebass.lab.fitting.guide import Step, steps
from livebass.lab.fitting.notes import read_notes
from livebass.lab.fitting.preset_text import text_of
from livebass.lab.fitting.problem import solve_task
from livebass.preset.load import load_preset
from livebass.preset.programs import DEFAULT
from livebass.preset.source import PresetError
from livebass.report.progress import Say, silent
from livebass.rows.units import one_line
from livebass.system.cores import core_count


@dataclass(frozen=True)
class Fit:
    """Says what to fit, and how long to search."""

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
    request: Fit = Fit(),
    directory: str | os.PathLike[str] | None = None,
    say: Say = silent,
    step: Callable[[int], None] = lambda _: None,
) -> Fitted:
    """Turns recorded notes of a bass into a preset, as `livebass fit` does.

    Args:
        notes: Sound files of single notes, or folders of them; `livebass fit --help` says how to name them.
        request: What to fit, and how long.
        directory: Keeps every trial, so that the same call goes on; None: they are forgotten.
        say: Gets a line for each part of the work, and for each doubt.
        step: Gets the number of trials done.

    Returns:
        The fit: `sentence` judges it, `fitted_preset` writes the preset.

    Raises:
        ValueError: A file is no sound, or the notes do not suffice; one line.
        PresetError: `like` is no preset.
    """
    found = read_notes(tuple(map(Path, notes)), request.technique, _guide(request))
    for doubt in found.doubts:
        say(f"doubt: {doubt}")
    with _place(directory) as place, _computer(request, say) as compute:
        return fit_recorded(found, _request_details(request), compute, place, say, step)


def fitted_preset(fitted: Fitted, path: str | os.PathLike[str], remark: str = "livebass.fit") -> str:
    """Returns the text of a fitted preset.

    Args:
        fitted: The fit.
        path: Where the text will be written: paths in it are relative.
        remark: How the preset was made, for its first line.
    """
    return text_of(fitted, Path(path), remark)


def _guide(request: Fit) -> list[Step]:
    """The guide in whose order one long recording may be; none if the default bass cannot be tuned so."""
    try:
        return steps(load_preset(request.like or DEFAULT, tuning=request.tuning))
    except PresetError:
        if request.like is not None:
            raise
        return []


def _request_details(request: Fit) -> Wanted:
    others = tuple(
        (one_line(path.resolve().name), tuple(n for n in measure_notes([path], request.technique) if n.kind == NOTE))
        for path in map(Path, request.beside)
    )
    return Wanted(DEFAULT, request.like, request.tuning, request.seed, request.trials, request.minutes, others)


@contextmanager
def _place(directory: str | os.PathLike[str] | None) -> Iterator[Path]:
    """The directory of the trials, with its folder of points."""
    with TemporaryDirectory() if directory is None else nullcontext(directory) as place:
        (Path(place) / "points").mkdir(parents=True, exist_ok=True)
        yield Path(place)


@contextmanager
def _computer(request: Fit, say: Say) -> Iterator[Compute]:
    if request.scheduler is not None:
        with connect(request.scheduler, solve_task) as compute:
            yield compute
        return
    with lasting(request.workers or core_count(), solve_task, say) as compute:
        yield compute
