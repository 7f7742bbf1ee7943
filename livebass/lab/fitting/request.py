"""A requested fit: sound files in, a preset out."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory

from livebass.lab.comparison.names import NOTE
from livebass.lab.comparison.notes import measure_notes
from livebass.lab.experiment.workers import Compute, connect, lasting
from livebass.lab.fitting.fit import Fit, Fitted, fit_recorded
from livebass.lab.fitting.guide import Step, steps
from livebass.lab.fitting.notes import read_notes
from livebass.lab.fitting.problem import solve_task
from livebass.preset.load import load_preset
from livebass.preset.programs import DEFAULT
from livebass.preset.source import PresetError
from livebass.report.progress import Say, silent
from livebass.rows.units import one_line
from livebass.system.cores import core_count


def fit(
    notes: Sequence[str | os.PathLike[str]],
    request: Fit = Fit(),  # noqa: B008  # it is frozen
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
        others = [
            (one_line(path.resolve().name), [n for n in measure_notes([path], request.technique) if n.kind == NOTE])
            for path in map(Path, request.beside)
        ]
        return fit_recorded(found, request, others, compute, place, say, step)


def _guide(request: Fit) -> list[Step]:
    """The guide in whose order one long recording may be; none if the default bass cannot be tuned so."""
    try:
        return steps(load_preset(request.like or DEFAULT, tuning=request.tuning))
    except PresetError:
        if request.like is not None:
            raise
        return []


@contextmanager
def _place(directory: str | os.PathLike[str] | None) -> Iterator[Path]:
    """The directory of the trials, with its folder of points."""
    with TemporaryDirectory() if directory is None else nullcontext(directory) as place:
        (Path(place) / "points").mkdir(parents=True, exist_ok=True)
        yield Path(place)


def _computer(request: Fit, say: Say) -> AbstractContextManager[Compute]:
    if request.scheduler is not None:
        return connect(request.scheduler, solve_task)
    return lasting(request.workers or core_count(), solve_task, say)
