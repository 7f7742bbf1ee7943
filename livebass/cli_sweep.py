"""`livebass study sweep`: any parameter of a preset or of a pluck over a grid."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass import limits
from livebass.cli_render import announce_kernels, shown_progress
from livebass.cli_values import CONTACT_RATE, MODES, Number, Quantity
from livebass.quality import QUALITIES
from livebass.sweep_quantities import QUANTITIES, USUAL

if TYPE_CHECKING:
    from livebass.sweep_grid import Axis
    from livebass.sweep_work import Point, Settings

INTERRUPTED = 130


class Vary(click.ParamType):
    """KEY=FROM:TO:N."""

    name = "KEY=FROM:TO:N[:log]"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return self.name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Axis:
        from livebass.sweep_grid import axis

        try:
            return axis(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


def _quantities() -> str:
    """The list in the help."""
    return "\b\nQuantities:\n" + "\n".join(f"  {row.title:<36}{row.meaning}" for row in QUANTITIES.values())


@click.command(epilog=_quantities())
@click.option("--vary", "axes", type=Vary(), multiple=True, help="A parameter and its values; may be given again.")
@click.option("-p", "--preset", metavar="NAME|FILE", default="paper-g", show_default=True, help="The bass.")
@click.option("--string", "string", default="G", show_default=True, help="Name of the string.")
@click.option("--fret", type=Number("number", 0, 36, whole=True), default=0, show_default=True, help="0: open.")
@click.option("--apex", type=Quantity(*limits.APEX), default=3.6e-3, show_default="3.6mm",
              help="Height of the plucked corner.")
@click.option("--at", "at", type=Quantity(*limits.AT), default=0.64, show_default="0.64m",
              help="Where it is, from the stop (the nut or the fret).")
@click.option("--angle", type=Quantity(*limits.ANGLE), default=0.0, show_default="0deg",
              help="Of the pluck, from straight up.")
@click.option("--duration", type=Quantity(*limits.DURATION), default=1.0, show_default="1 s")
@click.option("-q", "--quality", type=click.Choice(list(QUALITIES)), default="reference", show_default=True)
@click.option("--modes", type=MODES, help="Modes of the string as stopped, instead of the quality's.")
@click.option("--contact-rate", type=CONTACT_RATE,
              help="Such as 8MHz, instead of the quality's; raised to a whole multiple of 51.2 kHz.")
@click.option("--quantity", "quantities", metavar="NAME", type=click.Choice(list(QUANTITIES)), multiple=True,
              help=f"To draw; may be given again. [default: {', '.join(USUAL)}]")
@click.option("--picture/--no-picture", default=True, help="Draw it, or leave matplotlib alone.")
@click.option("--workers", type=Number("count", 1, 1024, whole=True), help="Processes. [default: one a core]")
@click.option("--scheduler", metavar="ADDRESS", help="Of a Dask cluster that computes instead: tcp://host:8786.")
@click.option("--json", "file", type=click.Path(path_type=Path), metavar="FILE", help="Write all of it to FILE too.")
@click.option("-o", "--output", "directory", type=click.Path(path_type=Path), required=True, metavar="DIR",
              help="Made if need be.")
def sweep(
    axes: tuple[Axis, ...], quantities: tuple[str, ...], picture: bool, workers: int | None, scheduler: str | None,
    file: Path | None, directory: Path, **pluck: Any,
) -> None:
    """Pluck a string for every combination of parameters.

    KEY is a number of a preset file, neck.action, neck.lift.6, string.tension (all strings), string.G.tension,
    string.G.neck.action, pickup.1.position, player.rounding (see `livebass presets keys`), or pluck.apex, pluck.at,
    pluck.angle, pluck.fret. FROM and TO have units where the key has; N values in equal steps, or with :log in equal
    ratios.

    Into DIR go sweep.csv with all quantities, sweep.png and sweep.svg of those chosen, and points/, a file a point.
    Killed or interrupted at any moment, the same command goes on where it was. Points of other sweeps in DIR are used
    where they are the same; the table and picture are those of the last sweep.

    With --scheduler the points are computed by the workers of a Dask cluster, for the same table: scheduler and workers
    need this version of livebass, with the same NumPy and Numba (pip install 'livebass[cluster]').

    \b
    Examples:
      livebass study sweep --vary neck.contact_stiffness=1e9:1e13:9:log -o stiffness
      livebass study sweep --vary pluck.apex=1mm:7mm:13 --vary pluck.at=0.1m:0.8m:15 --duration 0.3s -o plucks
      livebass study sweep -p slap --string E --vary string.E.neck.action=1.5mm:3mm:7 --at 0.6 -o action
    """
    from livebass import sweep as sweeping
    from livebass.quality import quality_with
    from livebass.sweep_grid import USAGE
    from livebass.sweep_plot import check, drawable, pictures
    from livebass.sweep_work import Settings, grid

    if not axes:
        raise click.UsageError(f"--vary {USAGE}")
    if workers is not None and scheduler is not None:
        raise click.UsageError("--workers is of this machine, --scheduler of a cluster: give one")
    quality = quality_with(pluck.pop("quality"), pluck["modes"], pluck.pop("contact_rate"))
    settings = Settings(quality=quality, **pluck)
    draw = picture and drawable(axes)
    if draw:
        check()
    points = grid(settings, axes)
    sweeping.places(directory, file)
    results = sweeping.found(directory, points)
    try:
        _complete(directory, points, results, workers or os.cpu_count() or 1, scheduler)
        drawn: tuple[bytes, ...] = ()
        if draw:
            values = {name: _column(points, results, name) for name in quantities or USUAL}
            drawn = pictures(axes, values, _title(settings))
        described = sweeping.as_json(settings, axes, points, results)
        sweeping.write(directory, sweeping.table(axes, points, results), drawn, file, described)
    except KeyboardInterrupt:
        kept = f"{_found(points, results)} of {len(points)} points are kept in {directory}"
        click.echo(f"livebass: error: interrupted, {kept}: the same command goes on", err=True)
        raise click.exceptions.Exit(INTERRUPTED) from None
    if picture and not draw:
        click.echo("no picture: that shows up to 3 parameters, the first of 3 with up to 12 values", err=True)
    click.echo(f"{len(points)} points -> {directory / sweeping.TABLE}", err=True)


def _found(points: Sequence[Point], results: dict[str, dict[str, float]]) -> int:
    return sum(point.digest in results for point in points)


def _complete(
    directory: Path, points: Sequence[Point], results: dict[str, dict[str, float]], workers: int, scheduler: str | None
) -> None:
    """Compute the points that `results` lacks, and say how many there were."""
    from livebass.sweep import completed

    missing = len({point.digest for point in points} - results.keys())
    there = f"{len(points)} points, {_found(points, results)} found in {directory}"
    if not missing:
        click.echo(f"{there}, nothing to compute", err=True)
        return
    with _computer(points[0], workers, scheduler) as (where, compute):
        click.echo(f"{there}, {missing} to compute {where}", err=True)
        with shown_progress("sweep") as progress:
            for done in completed(directory, points, results, compute):
                if progress:
                    progress(done / missing)


@contextmanager
def _computer(first: Point, workers: int, scheduler: str | None) -> Iterator[tuple[str, Callable[[Any], Any]]]:
    """Where, and what gives the results of points: the cluster, or here, the kernels compiled before it starts."""
    if scheduler is not None:
        from livebass import sweep_cluster

        with sweep_cluster.connected(scheduler) as compute:
            yield f"on {scheduler}", compute
        return
    from livebass import kernels, sweep_local

    announce_kernels()
    if not kernels.cached():
        sweep_local.compile_kernels(first)
    say = functools.partial(click.echo, err=True)
    where = f"with {workers} process{'es' * (workers != 1)}"
    yield where, lambda points: sweep_local.computed(points, workers, say)


def _column(points: Sequence[Point], results: dict[str, dict[str, float]], name: str) -> Any:
    """One quantity of all points, (points,)."""
    import numpy as np

    return np.array([results[point.digest][name] for point in points])


def _title(settings: Settings) -> str:
    return (
        f"{Path(settings.preset).stem}, string {settings.string} fret {settings.fret}, {settings.apex * 1e3:g} mm "
        f"at {settings.at * 1e3:g} mm, {settings.duration:g} s, unless varied"
    )
