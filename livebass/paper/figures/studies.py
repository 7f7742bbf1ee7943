"""What the paper says, statement by statement, beside what comes out: what `study claims` checks, for the page.

The studies there are, by name. A new one is a row here: what it needs solved, and what it makes of that.

Runs studies: what several of them need is solved once, on all cores; each then writes its directory.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from livebass import __version__
from livebass.engine.solve import solve_trial
from livebass.files import Transaction, checked_place
from livebass.model.trial import Motion, Trial
from livebass.paper.claims import check as claims
from livebass.paper.claims.check import HEAD, cells, count_line
from livebass.paper.figures import basics as study_convergence
from livebass.paper.figures import basics as study_linear
from livebass.paper.figures import measure as study_measure
from livebass.paper.figures import motions as study_cases
from livebass.paper.figures import motions as study_energy
from livebass.paper.figures import motions as study_variations
from livebass.paper.figures import output as study_files
from livebass.paper.figures.measure import Findings, Solved, Study, Table
from livebass.paper.figures.output import page
from livebass.report.progress import Progress
from livebass.report.text import json_text


def claims_trials(duration: float | None) -> dict[str, Trial]:
    """None: the claims solve what they look at, for as long as the paper speaks of, whatever the duration."""
    return {}


def claims_report(motions: Mapping[str, Solved]) -> Findings:
    """All of them checked."""
    results = claims.check(claims.chosen())
    table = Table("statements", f"{count_line(results)} within the tolerance", HEAD, [cells(r) for r in results])
    return Findings(tables=[table], numbers={"claims": [r.as_json() for r in results]})


def cases(*names: str) -> Callable[[float | None], dict[str, Trial]]:
    """The trials of these cases of the paper."""
    return lambda duration: {name: study_measure.case_trial(name, duration) for name in names}


def one_case(name: str, title: str) -> Callable[[Mapping[str, Solved]], Findings]:
    """All there is to say of one case."""
    return lambda motions: study_cases.case_findings(name, title, motions[name])


SEEN = "displacement, spectrogram, characteristic frequency"
STUDIES = {
    study.name: study
    for study in (
        Study(
            "linear", "The string and the neck at rest", "2.2, 3.2",
            "figures 1 and 3: fret crowns; frequencies and quality factors, measured and modelled",
            study_linear.linear_trials, study_linear.linear_report,
        ),
        Study("a", "Case A: 0.87 mm, no contact", "4.1", SEEN, cases("a"), one_case("a", "Case A")),
        Study(
            "b", "Case B: 3.6 mm, 8 MHz", "4.1.1",
            f"{SEEN}, contacts and pitch, shapes (figure 8), energies, T60",
            study_energy.energy_trials, study_energy.energy_report,
        ),
        Study(
            "c", "Case C: 7.8 mm, 16 MHz", "4.1.2", f"{SEEN}, contacts and pitch (figures 5 and 7)",
            cases("c"), one_case("c", "Case C"),
        ),
        Study(
            "cases", "Cases A, B and C together", "4.1", "figures 4 and 6", cases("a", "b", "c"), study_cases.together
        ),
        Study(
            "oblique", "Second polarisation: plucked 3.1 mm up and 2.2 mm across", "4.1.3",
            "figure 9: both displacements, zooms and spectrograms", cases("oblique"), study_variations.oblique,
        ),
        Study(
            "dispersion", "Without dispersion", "4.2.1", "figures 7a and 10: spectrogram, contacts, pitch",
            cases("b", "harmonic"), study_variations.dispersion,
        ),
        Study(
            "plucking-point", "Plucked near the bridge, in the middle, near the nut", "4.2.2",
            "figure 11: spectrograms, first shapes, contacts", cases(*study_variations.PLUCKED),
            study_variations.plucking_point,
        ),
        Study(
            "neck", "The neck: as measured, half straightened, straight, sixth fret up", "4.2.3",
            "figure 12: spectrograms, necks, contacts, pitch", cases(*study_variations.NECKS), study_variations.neck,
        ),
        Study(
            "stiffness", "Soft frets: K = 1e9", "4.2.4", "figure 13: spectrogram, contacts, pitch",
            cases("b", "soft"), study_variations.stiffness,
        ),
        Study(
            "fretless", "A fretless bass, plucked as in case B", "5", f"{SEEN}, places of contact and pitch",
            cases("fretless"), one_case("fretless", "Fretless"),
        ),
        Study(
            "convergence", "Contact rates and numbers of modes", "4",
            "errors of displacement and characteristic frequency against the finest",
            study_convergence.convergence_trials, study_convergence.convergence_report,
        ),
        Study(
            "statements", "What the paper says, and what comes out", "2 to 4",
            "each statement that can be checked, what is expected and what was measured",
            claims_trials, claims_report,
        ),
    )
}  # fmt: skip


def chosen(names: Iterable[str]) -> list[Study]:
    """The studies called so, each once, in the order of the table; "all" for all. ValueError names those there are."""
    asked = [name.lower() for name in names]
    for name in asked:
        if name not in STUDIES and name != "all":
            raise ValueError(f"study {name!r}: there are {', '.join(STUDIES)}, and all of them as all")
    return [study for name, study in STUDIES.items() if name in asked or "all" in asked]


NEEDED = "study needs matplotlib, Jinja2 and SciPy: pip install 'livebass[analysis,plots]'"
PAGE = "index.html"


def check_extras() -> None:
    """Raise LookupError, one line, where the libraries that draw, fill the page and resample are not installed."""
    try:
        import jinja2  # noqa: F401
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
            files.write(json_file, json_text(result).encode())
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
