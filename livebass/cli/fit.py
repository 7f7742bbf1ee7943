"""`livebass fit`: recorded notes of a bass become a preset."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass.cli import options
from livebass.cli.compare import TECHNIQUES
from livebass.cli.groups import GroupedCommand
from livebass.cli.messages import say
from livebass.cli.progress import have_kernels, shown_progress, shown_steps
from livebass.cli.study import Interrupted
from livebass.cli.tuning import tuning_type
from livebass.cli.values import Number

if TYPE_CHECKING:
    from livebass.lab.fitting.fit import Fitted
    from livebass.model.instrument import Instrument

TRIALS = 600
GROUPS = {
    "Notes": "--technique --tuning --beside",
    "Search": "--like --seed --evaluations --minutes --workers --scheduler",
    "Results": "--output --page",
    "Guide": "--guide --record",
    "Help": "--help",
}


@click.command(cls=GroupedCommand, groups=GROUPS)
@click.argument("notes", nargs=-1, type=options.PATH, metavar="NOTES...")
@options.option(
    "--technique", click.Choice(TECHNIQUES), "Technique of all notes.  [default: by the file names, or fingers]"
)
@options.option("--tuning", tuning_type, "Tuning of the open strings, as for play.")
@options.option(
    "--beside",
    options.PATH,
    "Notes of another real bass, to show how far apart real basses are; repeatable.",
    multiple=True,
    metavar="DIR",
)
@options.option(
    "--like",
    str,
    "The preset to begin with; the new one takes everything else from it.  [default: the nearest shipped one]",
    metavar="NAME|FILE",
)
@options.count_option("--seed", 2**31, "Seed of the search.", minimum=0, metavar="number", default=0)
@options.count_option("--evaluations", 100_000, "Trials of the search.", minimum=12, default=TRIALS)
@options.option("--minutes", Number("number", 0.01, 10_000), "End the search after this time.")
@options.cluster_options
@options.file_option("-o --output", "Preset to write.", metavar="FILE.toml")
@click.option("--page/--no-page", default=True, help="Write a page of the same name; needs Matplotlib.")
@options.flag("--guide", "Print what to play, for the strings of --like and --tuning.")
@options.option("--record", options.PATH, "With --guide: ask for each note and record it to DIR.", metavar="DIR")
def fit(notes: tuple[Path, ...], output: Path | None, guide: bool, record: Path | None, **how: Any) -> None:
    """Turn recorded notes of your bass into a preset.

    NOTES are sound files of single notes, or folders of them, as for `livebass compare`: the command hears the pitch,
    and words in names tell the force (pp to ff, soft medium hard, v1 ...), the technique and releases. A name such as
    stringE_fret05_soft_take1.flac also tells the string, which matters much; otherwise the fit finds it by the
    inharmonicity of the note. `livebass fit --guide` says what to play; one long recording in that order works too.

    The fit identifies open strings, reads losses, noise and hum off the notes, and then searches for the hand, the
    contact with the frets and the mix of pickups. It plays a few notes again and again and compares them with yours.
    Notes that it never hears judge the result. -o FILE.toml writes `like = ...` and what changed; FILE.html shows
    before and after; FILE-points keeps every trial, so that the same command goes on after an interruption. The same
    notes, seed and number of trials give the same preset. 600 trials take some five minutes on two cores.

    \b
    Examples:
      livebass fit --guide
      livebass fit --guide --record my-bass
      livebass fit my-bass -o my-bass.toml
      livebass fit my-bass --like jazz-finger --minutes 5 -o my-bass.toml
    """
    if guide or record is not None:
        _guide(how["like"] or options.DEFAULT_PRESET, how["tuning"], guide, record)
        return
    if not notes or output is None:
        raise click.UsageError("give NOTES... and -o FILE.toml, or --guide")
    if output.suffix != ".toml":
        raise click.UsageError(f"-o {output}: a preset's name ends in .toml")
    options.check_cluster(how["workers"], how["scheduler"])
    _fit(notes, output, **how)


def _guide(like: str, tuning: Any, guide: bool, record: Path | None) -> None:
    from livebass.lab.fitting.guide import guide_text, steps

    if not guide:
        raise click.UsageError("--record needs --guide")
    bass = _bass(like, tuning)
    if record is None:
        click.echo(guide_text(bass))
        return
    from livebass.files.whole import Transaction
    from livebass.lab.fitting.recording import opened_input
    from livebass.lab.fitting.recording import record as record_steps

    wanted = steps(bass)
    try:
        with opened_input() as read, Transaction() as made:
            made.directory(record)
            record_steps(wanted, record, read, say)
    except KeyboardInterrupt:
        there = sum((record / step.file).exists() for step in wanted)
        raise Interrupted(f"interrupted, {there} of {len(wanted)} notes are in {record}: the same command goes on") \
            from None  # fmt: skip
    say(f"{len(wanted)} notes -> {record}; now: livebass fit {record} -o my-bass.toml")


def _bass(like: str, tuning: Any) -> Instrument:
    from livebass.cli.tuning import load_tuned

    return load_tuned(like, {} if tuning is None else {"tuning": tuning})


def _fit(notes: tuple[Path, ...], output: Path, page: bool, **how: Any) -> None:
    from livebass.files.whole import Transaction, checked_place
    from livebass.report.picture import check_installed

    needed = ("cmaes", "scipy.optimize", *(("matplotlib.figure", "jinja2") if page else ()))
    check_installed("fit", f"fit,analysis{',plots' if page else ''}", needed)
    for place in (output, *((output.with_suffix(".html"),) if page else ())):
        checked_place(place)
    points = output.with_name(f"{output.stem}-points")
    try:
        with Transaction() as made:
            made.directory(points)
            made.directory(points / "points")
            fitted = _run_fit(notes, how, points)
        _write(fitted, output, page, how)
    except KeyboardInterrupt:
        count = len(list((points / "points").glob("[!.]*.json")))
        kept = f"{count} trials are kept in {points}: the same command goes on" if count else "nothing written"
        raise Interrupted(f"interrupted, {kept}") from None


def _run_fit(notes: tuple[Path, ...], how: dict[str, Any], points: Path) -> Fitted:
    from livebass.lab.fitting.fit import Fit
    from livebass.lab.fitting.request import fit as fit_notes

    minutes = math.inf if how["minutes"] is None else how["minutes"]
    request = Fit(
        how["like"], how["tuning"], how["technique"], how["beside"], how["seed"], how["evaluations"], minutes,
        how["workers"], how["scheduler"],
    )  # fmt: skip
    have_kernels()
    with shown_steps("fit") as (bar, tell):
        done = 0

        def step(count: int) -> None:
            nonlocal done
            done += count
            if bar:
                bar(min(done / (request.trials + 60), 1.0))

        return fit_notes(notes, request, points, tell, step)


def _write(fitted: Fitted, output: Path, page: bool, how: dict[str, Any]) -> None:
    from livebass.files.whole import Transaction
    from livebass.lab.fitting.preset_text import fitted_preset

    with Transaction() as files:
        files.write_text(output, fitted_preset(fitted, output, _command(how, fitted.recorded.name, fitted.best.trials)))
        if page:
            from livebass.lab.fitting.page import page as page_of

            with shown_progress("page") as progress:
                text = page_of(fitted, output.stem, progress)
            files.write_text(output.with_suffix(".html"), text)
    for doubt in fitted.doubts[len(fitted.recorded.doubts) :]:
        say(f"doubt: {doubt}")
    click.echo(fitted.sentence)
    pages = f", {output.with_suffix('.html')}" if page else ""
    say(f"{fitted.best.trials} trials, like {fitted.problem.label} -> {output}{pages}")


def _command(how: dict[str, Any], name: str, trials: int) -> str:
    """The command that makes the same preset from the same notes."""
    given = [part for key in ("like", "tuning", "technique") if how[key] for part in (f"--{key}", str(how[key]))]
    return shlex.join(["livebass", "fit", name, *given, "--seed", str(how["seed"]), "--evaluations", str(trials)])
