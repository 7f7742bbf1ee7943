"""`livebass map`: plucks every note of a bass and shows where the neck buzzes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from livebass.cli import options
from livebass.cli.messages import say
from livebass.cli.progress import have_kernels, shown_progress
from livebass.cli.values import Quantity
from livebass.model.quality import QUALITIES
from livebass.rows.units import one_line

if TYPE_CHECKING:
    from livebass.lab.experiment.grid import Axis
    from livebass.lab.experiment.workers import Compute
    from livebass.model.instrument import Instrument

PICTURES = ("png", "svg")


@click.command("map")
@options.preset_option("The bass.", default=options.DEFAULT_PRESET, show_default=True)
@options.option("--beside", str, "Another bass or set-up, to compare.", metavar="NAME|FILE")
@options.vary_option
@options.count_option("--velocity", 127, "Velocity of the plucks.", default=100, metavar="1-127")
@options.option("--duration", Quantity("time", 0.01, 10.0), "Time in which contacts count.", default="0.5s")
@options.quality_option("live", "Precision of the strings.")
@options.count_option("--workers", 256, "Number of threads.  [default: one per core]")
@options.scheduler_option
@options.file_option("-o --output", "Draw the map; needs matplotlib.", metavar="FILE.png|FILE.svg")
@options.file_option("--csv csv_file", "Write the map as CSV.")
def map_(
    preset: str, beside: str | None, axes: tuple[Axis, ...], velocity: int, duration: float, quality: str,
    workers: int | None, scheduler: str | None, **files: Path | None,
) -> None:  # fmt: skip
    """Pluck every note of a bass, and show where the neck buzzes.

    The bass's player plays each fret of each string once, on strings at rest. The table has, for each note, the number
    of contacts with frets or board from the release on, and when the last one comes: buzz that lasts. A note that frets
    out, as the string lies on a higher fret at rest, has that fret instead.

    --vary makes a map for every combination of values of a preset's keys, as for `livebass study sweep`. --scheduler
    gives the same maps; scheduler and workers need this version of livebass with the same NumPy and Numba
    (pip install 'livebass[cluster]').

    \b
    Examples:
      livebass map -p mine.toml -o neck.png
      livebass map -p jazz-finger --beside mine.toml --velocity 110 --csv neck.csv
      livebass map -p mine.toml --vary neck.action=1.5mm:3mm:7 --csv actions.csv
    """
    output, csv_file = files["output"], files["csv_file"]
    if output is not None and output.suffix.lower().removeprefix(".") not in PICTURES:
        raise click.UsageError(f"{output}: a picture's name ends in .png or .svg")
    if axes and beside is not None:
        raise click.UsageError("--vary and --beside: give one of them")
    options.check_cluster(workers, scheduler)
    options.files_to_write({"--output": output, "--csv": csv_file})
    from livebass.lab.experiment import fretmap
    from livebass.preset.load import load_preset
    from livebass.report.picture import check_plots

    if axes:
        basses = fretmap.varied_basses(preset, axes)
    else:
        given = [name for name in (preset, beside) if name is not None]
        basses = _told_apart([load_preset(name) for name in given], given)
    if output is not None:
        if len(basses) > len(fretmap.LETTERS):
            raise click.UsageError(f"--output draws one or two maps, not {len(basses)}; --csv takes them all")
        check_plots("map -o")
    notes = fretmap.notes_of(basses, velocity, duration, QUALITIES[quality])
    with _computer(workers, scheduler) as (where, compute):
        if where or axes:
            say(f"{len(notes)} notes to compute{where}")
        with shown_progress(_label(basses)) as progress:
            maps = fretmap.fret_maps(notes, compute, progress)
    options.write_results(
        [
            (output, lambda: fretmap.picture(maps, output.suffix.lower().removeprefix(".") if output else "png")),
            (csv_file, lambda: fretmap.csv(maps)),
        ],
        fretmap.table(maps),
    )


def _told_apart(basses: list[Instrument], given: Sequence[str]) -> list[Instrument]:
    """Two different basses of one name get the names of their files, too: a copied preset keeps its name."""
    if len(basses) < 2 or basses[0].name != basses[1].name or basses[0] == basses[1]:
        return basses
    return [replace(bass, name=f"{bass.name} ({Path(name).name})") for bass, name in zip(basses, given, strict=True)]


def _label(basses: Sequence[Instrument]) -> str:
    names = [one_line(bass.name) for bass in basses]
    return f"plucking {names[0]}" + (f" and {len(names) - 1} more" if names[1:] else "")


@contextmanager
def _computer(workers: int | None, scheduler: str | None) -> Iterator[tuple[str, Compute]]:
    """Yields where notes are computed, in words, and what computes them; compiles the kernels if needed."""
    from livebass.lab.experiment import fretmap
    from livebass.lab.experiment.workers import connect

    if scheduler is not None:
        with connect(scheduler, fretmap.solve_note) as compute:
            yield f" on {scheduler}", compute
        return
    have_kernels()
    yield "", partial(fretmap.in_threads, workers=workers)
