"""Runs studies: what several of them need is solved once, on all cores; each then writes its directory."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from livebass import __version__, study_files
from livebass.atomic import Transaction, checked_place
from livebass.engine import solve_trial
from livebass.motion import Motion, Trial
from livebass.studies import STUDIES
from livebass.study_page import page
from livebass.study_parts import Solved, Study

NEEDED = "study needs matplotlib and SciPy: pip install 'livebass[analysis,plots]'"
PAGE = "index.html"
Progress = Callable[[float], None]


def check_extras() -> None:
    """LookupError, one line, where the libraries that draw and resample are not installed."""
    try:
        import matplotlib.figure  # noqa: F401
        import scipy.signal  # noqa: F401
    except ImportError:
        raise LookupError(NEEDED) from None


def run_studies(
    studies: Sequence[Study],
    directory: Path,
    *,
    duration: float | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    json_file: Path | None = None,
) -> dict[str, Any]:
    """Solve, draw and write `studies` into directories of their names in `directory`, and a page over all there are.

    `duration` s instead of each motion's own; `workers` threads solve (default: as many as cores); `progress` is told
    the fraction done. What is returned is what `json_file` holds. Raises ValueError and OSError; studies that were
    complete then stay, no other has a file. [main thread]
    """
    check_extras()
    began = time.perf_counter()
    needed = {study.name: study.trials(duration) for study in studies}
    unique = list(dict.fromkeys(trial for trials in needed.values() for trial in trials.values()))
    done = iter(range(1, len(unique) + len(studies) + 1))

    def step() -> None:
        if progress:
            progress(next(done) / (len(unique) + len(studies)))

    with Transaction() as files:
        _claim(files, studies, directory, json_file)
        motions = solve_all(unique, workers, step)
        summaries = {}
        for study in studies:
            solved = {key: Solved(trial, motions[trial]) for key, trial in needed[study.name].items()}
            about = {"duration_s": duration, "solved_in_s": sum(s.motion.wall_s for s in solved.values())}
            summaries[study.name] = study_files.write(directory / study.name, study, study.report(solved), about)
            step()
        result = {
            "version": __version__, "duration_s": duration, "workers": _threads(workers), "solutions": len(unique),
            "studies": summaries, "wall_s": time.perf_counter() - began,
        }  # fmt: skip
        files.write(directory / PAGE, _page_over_all(directory, summaries).encode())
        if json_file is not None:
            files.write(json_file, study_files.json_bytes(result))
    return result


def solve_all(trials: Sequence[Trial], workers: int | None, step: Callable[[], None]) -> dict[Trial, Motion]:
    """The engine's solution of each, the longest first so that no core waits; `step` is called after each."""
    if not trials:
        return {}
    for trial in {bool(t.speaking.surface): t for t in trials}.values():  # one a kind of contact: compiles, or loads
        solve_trial(replace(trial, duration=1 / trial.output_rate, states=()))
    ordered = sorted(trials, key=lambda t: -t.duration * t.contact_rate)
    motions = {}
    with ThreadPoolExecutor(_threads(workers)) as pool:
        futures = {pool.submit(solve_trial, trial): trial for trial in ordered}
        try:
            for future in as_completed(futures):
                trial, motion = futures[future], future.result()
                if not np.isfinite(motion.displacement_m).all():
                    rate = f"{trial.contact_rate / 1e6:g} MHz"
                    raise ValueError(f"{trial.modes} modes at {rate}: the solution is not finite; take another rate")
                motions[trial] = motion
                step()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return motions


def _threads(workers: int | None) -> int:
    return workers or os.cpu_count() or 1


def _claim(files: Transaction, studies: Sequence[Study], directory: Path, json_file: Path | None) -> None:
    """Make the directories; OutputError now, not after the work, where something cannot be written."""
    for path in (directory, *(directory / study.name for study in studies)):
        files.directory(path)
    for path in (directory / PAGE, *([] if json_file is None else [json_file])):
        checked_place(path)


def _page_over_all(directory: Path, summaries: Mapping[str, dict[str, Any]]) -> str:
    """The page, with the studies of earlier runs too."""
    found = (summaries.get(name) or study_files.read_summary(directory / name) for name in STUDIES)
    return page([summary for summary in found if summary], __version__)
