"""The table of studies, and their execution: each motion is solved once, on all cores."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from livebass import __version__
from livebass.files.whole import Transaction, checked_place
from livebass.lab.analysis.motion import Solved
from livebass.lab.paper.claims import check, runs
from livebass.lab.paper.figures import measure, output, section_4, section_4_1, section_4_2, sections_2_3
from livebass.lab.paper.figures.study import Findings, Study, Table
from livebass.lab.paper.solving import Job, share_jobs, solve_in_turn
from livebass.report.picture import check_installed
from livebass.report.progress import Progress, Say, silent, steps
from livebass.report.text import json_text
from livebass.system.cores import core_count


def cases(*names: str) -> Callable[[float | None], dict[str, Job]]:
    """The jobs of a study of these cases of the paper."""
    return lambda duration: {name: measure.case_job(name, duration) for name in names}


def statement_jobs(duration: float | None) -> dict[str, Job]:
    """The runs of all claims, at the paper's durations; ignores `duration`."""
    return {name: runs.job(name) for name in check.needed_runs(check.choose_claims())}


def statements(motions: Mapping[str, Solved]) -> Findings:
    """The study `statements`: checks every claim, claims about contacts over many plucks."""
    claims = check.choose_claims()
    values = check.over_plucks(claims, check.PLUCKS)
    results = [check.result(claim, motions, values.get(claim.id, ())) for claim in claims]
    parts = check.parts(results)
    captions = f"Statements of the paper. {check.legend_line()}", *check.NOT_COUNTED.values()
    tables = [
        Table(name, caption, check.HEAD, [check.cells(r) for r in part])
        for name, caption, part in zip(("statements", *check.NOT_COUNTED), captions, parts, strict=True)
        if part
    ]
    verdict = check.count_line(results)
    return Findings(tables=tables, numbers={"verdict": verdict, "claims": [r.as_json() for r in results]})


SEEN = "displacement, spectrogram, characteristic frequency"
STUDIES = {
    study.name: study
    for study in (
        Study(
            "linear", "The string and the neck at rest", "2.2, 3.2",
            "figures 1 and 3: fret crowns; frequencies and quality factors, measured and modelled",
            cases(), sections_2_3.linear,
        ),
        Study("a", "Case A: 0.87 mm, no contact", "4.1", SEEN, cases("a"), section_4_1.one_case("a", "Case A")),
        Study(
            "b", "Case B: 3.6 mm, 8 MHz", "4.1.1",
            f"{SEEN}, contacts and pitch, shapes (figure 8), energies, T60",
            section_4_1.case_b_jobs, section_4_1.case_b,
        ),
        Study(
            "c", "Case C: 7.8 mm, 16 MHz", "4.1.2", f"{SEEN}, contacts and pitch (figures 5 and 7)",
            cases("c"), section_4_1.one_case("c", "Case C"),
        ),
        Study(
            "cases", "Cases A, B and C together", "4.1", "figures 4 and 6", cases("a", "b", "c"), section_4_1.together
        ),
        Study(
            "oblique", "Second polarisation: plucked 3.1 mm up and 2.2 mm across", "4.1.3",
            "figure 9: both displacements, zooms and spectrograms", cases("oblique"), section_4_1.oblique,
        ),
        Study(
            "dispersion", "Without dispersion", "4.2.1", "figures 7a and 10: spectrogram, contacts, pitch",
            cases("b", "harmonic"), section_4_2.dispersion,
        ),
        Study(
            "plucking-point", "Plucked near the bridge, in the middle, near the nut", "4.2.2",
            "figure 11: spectrograms, first shapes, contacts", cases(*section_4_2.PLUCKED),
            section_4_2.plucking_point,
        ),
        Study(
            "neck", "The neck: as measured, straightened to 2 mm, straight, sixth fret up", "4.2.3",
            "figure 12: spectrograms, necks, contacts, pitch", cases(*section_4_2.NECKS), section_4_2.neck,
        ),
        Study(
            "stiffness", "Soft frets: K = 1e9", "4.2.4", "figure 13: spectrogram, contacts, pitch",
            cases("b", "soft"), section_4_2.stiffness,
        ),
        Study(
            "fretless", "A fretless bass, plucked as in case B", "5", f"{SEEN}, places of contact and pitch",
            cases("fretless"), section_4_1.one_case("fretless", "Fretless"),
        ),
        Study(
            "convergence", "Contact rates and numbers of modes", "4",
            "errors of displacement and characteristic frequency against the finest",
            section_4.convergence_jobs, section_4.convergence,
        ),
        Study(
            "statements", "What the paper says, and what comes out", "2 to 4",
            "each statement that can be checked, what is expected and what was measured",
            statement_jobs, statements,
        ),
    )
}  # fmt: skip


def choose_studies(names: Iterable[str]) -> list[Study]:
    """The studies called `names`, "all" for all, each once, in the order of the table.

    Raises ValueError, which lists them, for an unknown name.
    """
    requested = [name.lower() for name in names]
    for name in requested:
        if name not in STUDIES and name != "all":
            raise ValueError(f"study {name!r}: unknown; there are {', '.join(STUDIES)}, or all")
    return [study for name, study in STUDIES.items() if name in requested or "all" in requested]


PAGE = "index.html"
PLAYER = Path("page", "livebass.html")  # plays and shows cases; if it exists, links go there


def check_extras() -> None:
    """Raise LookupError, one line, if the libraries that draw, fill the page and resample are missing."""
    check_installed("study", "analysis,plots", ("jinja2", "matplotlib.figure", "scipy.signal"))


def run_studies(
    studies: Sequence[Study],
    directory: Path,
    *,
    duration: float | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
    say: Say = silent,
    json_file: Path | None = None,
) -> dict[str, Any]:
    """Solve, draw and write `studies` into directories of their names in `directory`, with a page over all of them.

    `duration` s replaces each motion's own; `workers` threads solve (default: one per core); `progress` gets the
    fraction done, `say` a line such as "study 7 of 12: neck" before each study. Returns the content of `json_file`.
    Raises ValueError and OSError; completed studies then stay, and are on the page. [main thread]
    """
    check_extras()
    began = time.perf_counter()
    needed = {study.name: study.jobs(duration) for study in studies}
    jobs = [job for by_name in needed.values() for job in by_name.values()]
    solutions = len(set(share_jobs(jobs).values()))
    step = steps(progress, solutions + len(studies))
    with Transaction() as files:
        _claim(files, studies, directory, json_file)
        summaries: dict[str, dict[str, Any]] = {}
        with closing(solve_in_turn((by_name.values() for by_name in needed.values()), workers, step)) as solving:
            for number, study in enumerate(studies, 1):
                say(f"study {number} of {len(studies)}: {study.name}")
                solved = next(solving)
                motions = {key: solved[job] for key, job in needed[study.name].items()}
                about = {"duration_s": duration, "solved_in_s": sum(one.motion.wall_s for one in motions.values())}
                summaries[study.name] = output.write(directory / study.name, study, study.report(motions), about)
                with Transaction() as page:
                    page.write(directory / PAGE, _page_over_all(directory, summaries).encode())
                step()
        result = {
            "version": __version__, "duration_s": duration, "workers": workers or core_count(),
            "solutions": solutions, "studies": summaries, "wall_s": time.perf_counter() - began,
        }  # fmt: skip
        if json_file is not None:
            files.write_text(json_file, json_text(result))
    return result


def _claim(files: Transaction, studies: Sequence[Study], directory: Path, json_file: Path | None) -> None:
    """Make the directories; raise OutputError now, not after the work, if a file cannot be written."""
    for path in (directory, *(directory / study.name for study in studies)):
        files.directory(path)
    for path in (directory / PAGE, *([] if json_file is None else [json_file])):
        checked_place(path)


def _page_over_all(directory: Path, summaries: Mapping[str, dict[str, Any]]) -> str:
    """The page, including studies of earlier runs in `directory`, with links to the page that plays."""
    found = (summaries.get(name) or output.read_summary(directory / name) for name in STUDIES)
    player = PLAYER.as_posix() if (directory / PLAYER).is_file() else ""
    return output.page([summary for summary in found if summary], __version__, player)
