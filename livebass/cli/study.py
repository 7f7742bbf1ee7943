"""`livebass study` recomputes Issanchou et al. (2018) and sweeps over parameters; `livebass simulate` plucks once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass.cli import options
from livebass.cli.messages import say
from livebass.cli.progress import have_kernels, shown_progress, shown_steps
from livebass.cli.values import CONTACT_RATE, MODES, RATE, Number, Quantity
from livebass.lab.experiment.quantities import DEFAULT_QUANTITIES, QUANTITIES
from livebass.model.quality import ANGLE, APEX, AT, DURATION
from livebass.system.cores import core_count
from livebass.system.interrupts import INTERRUPTED

if TYPE_CHECKING:
    from livebass.lab.experiment.grid import Axis, Point, Settings

FILES = ("claims.json", "claims.csv", "claims.html")
# For one pluck of one string, and the precision of its solution.
pluck_options = options.together(
    options.preset_option("The bass.", default="paper-g", show_default=True),
    options.option("--string", str, "Name of the string.", default="G"),
    options.option("--fret", Number("number", 0, 36, whole=True), "0 is open.", default=0),
    options.option(
        "--apex",
        Quantity(*APEX),
        "How far the string is pulled; below 0, towards the frets.  [default: 3.6mm]",
        default=3.6e-3,
        show_default=False,
    ),
    options.option(
        "--at",
        Quantity(*AT),
        "Place of the pluck, from the nut or the pressed fret.",
        default="0.64m",
    ),
    options.option(
        "--angle",
        Quantity(*ANGLE),
        "Direction of the pull: 0deg is away from the neck, 90deg across it.",
        default="0deg",
    ),
    options.option("--duration", Quantity(*DURATION), "Length of the motion.", default="1s"),
    options.quality_option("reference", "Precision of the string."),
    options.option("--modes", MODES, "Number of modes of the stopped string; replaces the quality's."),
)


@click.command()
@click.argument("ids", nargs=-1, metavar="[ID]...")
@options.folder_option("Write the table as claims.json, .csv and .html to DIR as well; created if missing.")
@options.file_option("--json file", "Write it as JSON to FILE.")
@options.count_option(
    "--plucks", 1000, "Plucks that judge claims about contacts; 0: only the paper's own pluck.", default=40, minimum=0
)
@options.count_option("--workers", 64, "Number of threads.  [default: one per core]")
def claims(
    ids: tuple[str, ...], output: Path | None, file: Path | None, plucks: int, workers: int | None
) -> int:  # fmt: skip
    """Check the paper's statements: all, or those with the given IDs.

    Computes the cases of Issanchou et al. (2018) with all modes at the paper's contact rates and compares each
    statement with the result. Prints a table; its first column has the IDs. The exit status is 1 if a statement fails.

    Contacts are chaotic: a millimetre of place or rounding moves their end by a third. So livebass checks a statement
    about contacts by many plucks, within what the paper leaves open: their median must agree. A number that the paper
    takes from one such pluck must lie between their 5 and 95 % quantiles. Takes about a minute on two cores, with
    --plucks 0 a quarter of a minute.

    \b
    Examples:
      livebass study claims --json claims.json
      livebass study claims b-first-contact b-phase --plucks 200
    """
    from livebass.files.whole import Transaction, checked_place

    texts = [] if output is None else [(output / name, name.rpartition(".")[2]) for name in FILES]
    if file is not None:
        texts.append((file, "json"))
    from livebass.report.picture import check_installed

    check_installed("study claims", "analysis", ("scipy.signal", *(("jinja2",) if output is not None else ())))
    from livebass.lab.paper.claims.check import WRITERS, all_hold, check_claims, choose_claims, table

    choose_claims(ids)  # now, not after the work
    results = []
    try:
        with Transaction() as files:
            if output is not None:
                files.directory(output)
            if len({checked_place(path) for path, _ in texts}) < len(texts):  # now, not after the work
                raise click.UsageError(f"--json {file}: -o writes a file of that name")
            have_kernels()
            with shown_progress("solving") as progress:
                results = check_claims(ids, plucks, workers, progress)
            for path, kind in texts:
                files.write_text(path, WRITERS[kind](results))
    finally:  # neither a closed pipe may lose the files nor a full disk the table
        if results:
            click.echo(table(results))
    return int(not all_hold(results))


class Interrupted(click.ClickException):
    """Ctrl-C, with its own line about what is kept."""

    exit_code = INTERRUPTED


def _quantities() -> str:
    """The list of quantities in the help."""
    return "\b\nQuantities:\n" + "\n".join(f"  {row.title:<36}{row.meaning}" for row in QUANTITIES.values())


@click.command(epilog=_quantities())
@options.vary_option
@pluck_options
@options.option(
    "--contact-rate",
    CONTACT_RATE,
    "Steps a second in contact, such as 8MHz, rounded up to a multiple of 51.2 kHz; replaces the quality's.",
)
@options.option(
    "--quantity quantities",
    click.Choice(list(QUANTITIES)),
    f"Quantity to draw; repeatable.  [default: {', '.join(DEFAULT_QUANTITIES)}]",
    metavar="NAME",
    multiple=True,
)
@options.option(
    "--picture/--no-picture", bool, "Draw the quantities; needs matplotlib.", default=True, show_default=False
)
@options.cluster_options
@options.file_option("--json file", "Also write everything to FILE as JSON.")
@options.folder_option(options.CREATED, "directory", required=True)
def sweep(
    axes: tuple[Axis, ...],
    quantities: tuple[str, ...],
    picture: bool,
    workers: int | None,
    scheduler: str | None,
    file: Path | None,
    directory: Path,
    **pluck: Any,
) -> None:
    """Pluck a string for every combination of parameters.

    KEY is a number of a preset (see `livebass presets keys`), such as neck.action, neck.lift.6, string.tension (all
    strings), string.G.tension, string.G.neck.action, pickup.1.position or player.rounding; or pluck.apex, pluck.at,
    pluck.angle, pluck.fret. FROM and TO have the units of the key. N values are in equal steps, or with :log in equal
    ratios.

    DIR gets sweep.csv with all quantities, sweep.png and sweep.svg with the chosen quantities, and points/ with a file
    per point. After an interruption the same command continues. Points in DIR from other sweeps are used if they are
    the same; table and picture show the last sweep.

    --scheduler gives the same table. Scheduler and workers need this version of livebass with the same NumPy and Numba
    (pip install 'livebass[cluster]').

    \b
    Examples:
      livebass study sweep --vary neck.contact_stiffness=1e9:1e13:9:log -o stiffness
      livebass study sweep --vary pluck.apex=1mm:7mm:13 --vary pluck.at=0.1m:0.8m:15 --duration 0.3s -o plucks
      livebass study sweep -p slap --string E --vary string.E.neck.action=1.5mm:3mm:7 --at 0.6 -o action
    """
    from livebass.files.whole import Transaction
    from livebass.lab.experiment import sweep as sweeping
    from livebass.lab.experiment.grid import USAGE, Settings, grid
    from livebass.model.quality import quality_with
    from livebass.report.picture import check_plots

    if not axes:
        raise click.UsageError(f"--vary {USAGE}")
    options.check_cluster(workers, scheduler)
    quality = quality_with(pluck.pop("quality"), pluck["modes"], pluck.pop("contact_rate"))
    settings = Settings(quality=quality, **pluck)
    draw = picture and sweeping.drawable(axes)
    if draw:
        check_plots("the picture", "; --no-picture does without")
    points = grid(settings, axes)
    results: dict[str, dict[str, float]] = {}
    try:
        with Transaction() as new:  # directories, removed again if they stay empty
            sweeping.prepare(new, directory, file)
            results |= sweeping.read_points(directory, points)
            _complete(directory, points, results, workers or core_count(), scheduler)
        made, drawn = sweeping.Sweep(axes, tuple(points), results), tuple[bytes, ...]()
        if draw:
            drawn = sweeping.pictures(
                axes, {name: made.values(name) for name in quantities or DEFAULT_QUANTITIES}, _title(settings)
            )
        sweeping.write(directory, made.table(), drawn, file, made.described(settings))
    except KeyboardInterrupt:
        count = sum(point.digest in results for point in points)
        kept = f"{count} of {len(points)} points are kept in {directory}: the same command goes on"
        raise Interrupted(f"interrupted, {kept if count else 'nothing written'}") from None
    if picture and not draw:
        say("no picture: it shows up to 3 parameters, the first of three with up to 12 values")
    say(f"{len(points)} points -> {directory / sweeping.TABLE}")


def _complete(
    directory: Path, points: Sequence[Point], results: dict[str, dict[str, float]], workers: int, scheduler: str | None
) -> None:
    """Compute the points missing in `results`, and report how many were there."""
    from livebass.lab.experiment.sweep import compute_missing

    missing = len({point.digest for point in points} - results.keys())
    there = f"{len(points)} points, {sum(point.digest in results for point in points)} found in {directory}"
    if not missing:
        say(f"{there}, nothing to compute")
        return
    with _computer(workers, scheduler) as (where, compute):
        say(f"{there}, {missing} to compute {where}")
        with shown_progress("sweep") as progress:
            for done in compute_missing(directory, points, results, compute):
                if progress:
                    progress(done / missing)


@contextmanager
def _computer(workers: int, scheduler: str | None) -> Iterator[tuple[str, Callable[[Any], Any]]]:
    """Yield where points are computed, in words, and the function that computes them.

    Compiles the kernels first if needed.
    """
    from livebass.lab.experiment.workers import compute_points, connect

    if scheduler is not None:
        with connect(scheduler) as compute:
            yield f"on {scheduler}", compute
        return
    have_kernels()  # compiled here once, not in every process
    where = f"with {workers} process{'es' * (workers != 1)}"
    yield where, lambda points: compute_points(points, workers, say)


def _title(settings: Settings) -> str:
    from livebass.preset.load import load_preset

    place = load_preset(settings.preset).neck(settings.string).note_text(settings.fret)
    return (
        f"{Path(settings.preset).stem}, string {settings.string} {place}, "
        f"{settings.apex * 1e3:g} mm at {settings.at * 1e3:g} mm, {settings.duration:g} s, unless varied"
    )


@click.command()
@pluck_options
@options.option("--contact-rate", CONTACT_RATE, "Steps a second in contact, such as 8MHz; replaces the quality's.")
@options.option("--rate", RATE, "Sample rate of the output.", default=44100)
@options.option(
    "--solver", click.Choice(["engine", "reference"]), "reference: brute force, step by step; slow.", default="engine"
)
@options.flag("--analyse", "Also write pitch, characteristic frequency, energies and T60.")
@options.option(
    "--shape-at",
    Quantity("time", 0, 60),
    "Also write the string's shape at this time, such as 3.9ms; repeatable.",
    multiple=True,
    metavar="TIME",
)
@options.folder_option(options.CREATED, required=True)
def simulate(
    preset: str, rate: int, solver: str, analyse: bool, shape_at: tuple[float, ...], output: Path, **pluck: Any
) -> None:  # fmt: skip
    """Pluck one string once and write its motion.

    DIR gets displacement.wav (the sensor, peak -1 dBFS; wav_metres_per_unit in result.npz converts it to metres),
    contacts.csv (time_s,fret,position_m; fret 0 is wood) and result.npz (everything): all three files or none.

    --analyse adds to result.npz the pitch over time (YIN), the characteristic frequency (eq. 14; needs SciPy), T60 by
    mode and, with the engine, the total energy and the energy of each mode at about 100 times.

    \b
    Example, case B of Issanchou et al. (2018):
      livebass simulate --preset paper-g --apex 3.6mm --at 0.64 -o case-b
    """
    from livebass.lab.experiment.simulate import simulate_to_directory
    from livebass.model.quality import quality_with
    from livebass.model.trial import PluckRequest
    from livebass.preset.load import load_preset

    bass = load_preset(preset)
    options.folder_to_write(output)  # now, not after compiling
    if solver == "engine":
        have_kernels()
    quality = quality_with(pluck.pop("quality"), pluck["modes"], pluck.pop("contact_rate"))
    say(simulate_to_directory(bass, PluckRequest(quality=quality, **pluck), output, rate, solver, analyse, shape_at))


HELP = ("-h", "--help")


class StudyGroup(click.Group):
    """A group that treats a word that is no command as the name of a study to run."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, *HELP):
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group(cls=StudyGroup)
def study() -> None:
    """Reproduce the paper, or sweep parameters.

    \b
    Examples:
      livebass study list                 the studies
      livebass study all -o paper         all studies; then open paper/index.html
      livebass study b neck -o paper      case B and the necks only
    """


@study.command("list")
def list_studies() -> None:
    """Print the studies: name, section, title, results."""
    from livebass.lab.paper.figures.studies import STUDIES

    for one in STUDIES.values():
        click.echo(f"{one.name:15} {one.section:9} {one.title}\n{'':26}{one.gives}")


@study.command()
@click.argument("names", nargs=-1, required=True, metavar="NAME...")
@options.folder_option(options.CREATED, required=True)
@options.file_option("--json json_file", "Also write all numbers as JSON.")
@options.option(
    "--duration", Quantity("time", 0.1, 10), "Length of each motion; replaces the study's own (mostly 1 s)."
)
@options.count_option(
    "--workers",
    256,
    "Number of motions computed at once.  [default: one per core]",
    default=core_count(),
    show_default=False,
)
@options.flag("--player", "Also write the page that plays, and link the cases to it.")
def run(
    names: tuple[str, ...], output: Path, json_file: Path | None, duration: float | None, workers: int, player: bool
) -> None:
    """Run the named studies, or `all`. You may omit the word `run`.

    DIR/NAME gets figures (PNG, SVG), data (result.npz, CSV), sounds (WAV, 44.1 kHz, peak -1 dBFS) and summary.json: all
    of them or none. DIR/index.html shows all studies in DIR. The study `statements` shows the results of `livebass
    study claims`. Needs pip install 'livebass[analysis,plots]'.

    --player also writes DIR/page/livebass.html, the page of `livebass export web --single` with the paper's string.
    Cases A, B and C embed it, to show the pluck in slow motion with its sound.
    """
    from livebass.lab.paper.figures.studies import check_extras, choose_studies, run_studies

    try:
        studies = choose_studies(names)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    check_extras()
    options.folder_to_write(output)  # now, not after compiling
    have_kernels()
    if player:
        _write_player(output)
    with shown_steps(f"study 1 of {len(studies)}: {studies[0].name}") as (progress, tell):
        result = run_studies(
            studies, output, duration=duration, workers=workers, progress=progress, say=tell, json_file=json_file
        )
    count = f"{len(studies)} stud{'y' if len(studies) == 1 else 'ies'} from {result['solutions']} motions"
    say(f"{count} in {result['wall_s']:.1f} s -> {output / 'index.html'}")


def _write_player(directory: Path) -> None:
    """Writes the page that plays the paper's string, at the place that studies in `directory` link to."""
    from livebass.cli.shelf import page_ready
    from livebass.files.whole import checked_directory
    from livebass.lab.paper.cases import PRESET
    from livebass.lab.paper.figures.studies import PLAYER
    from livebass.preset.load import load_preset
    from livebass.web.bench import Source
    from livebass.web.export import export_page, is_page

    place = (directory / PLAYER).parent
    checked_directory(place, is_page)  # now, not after a minute of work
    page_ready()
    export_page({PRESET: load_preset(PRESET)}, place, single=True, sources={PRESET: Source(PRESET)}, element=True)


study.add_command(claims)
study.add_command(sweep)
