"""`livebass study`: cases, figures and statements of Issanchou et al. (2018) anew, and questions of one's own."""

from __future__ import annotations

import os
from pathlib import Path

import click

from livebass.cli_claims import claims
from livebass.cli_render import announce_kernels, shown_progress
from livebass.cli_sweep import sweep
from livebass.cli_values import Number, Quantity

HELP = ("-h", "--help")


class NamesToo(click.Group):
    """A group in which what is no command is the name of a study to run."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, *HELP):
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group(cls=NamesToo)
def study() -> None:
    """The paper's cases, figures and statements computed anew; sweeps over any parameter of a preset.

    \b
    Examples:
      livebass study list                 what there is
      livebass study all -o paper         all of it; then open paper/index.html
      livebass study b neck -o paper      case B and the necks only
    """


@study.command("list")
def list_studies() -> None:
    """Print the studies: name, section, title, what comes out."""
    from livebass.studies import STUDIES

    for one in STUDIES.values():
        click.echo(f"{one.name:15} {one.section:9} {one.title}\n{'':26}{one.gives}")


@study.command()
@click.argument("names", nargs=-1, required=True, metavar="NAME...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, metavar="DIR", help="Made if need be."
)
@click.option("--json", "json_file", type=click.Path(path_type=Path), metavar="FILE", help="All numbers as JSON.")
@click.option(
    "--duration", type=Quantity("time", 0.1, 10), help="Of each motion, instead of the study's own (mostly 1 s)."
)
@click.option(
    "--workers", type=Number("count", 1, 256, whole=True), default=os.cpu_count() or 1, show_default="cores",
    help="Motions computed side by side.",
)  # fmt: skip
def run(names: tuple[str, ...], output: Path, json_file: Path | None, duration: float | None, workers: int) -> None:
    """Run studies: those of the NAMEs, or `all`. The word `run` may be left out.

    Into DIR/NAME go figures (PNG, SVG), data (result.npz, CSV), sounds (WAV, 44.1 kHz, peak -1 dBFS) and summary.json;
    over all the studies in DIR goes the page DIR/index.html. A study's files appear together, or none of them. Needs
    pip install 'livebass[analysis,plots]'. The study `statements` is what `livebass study claims` checks.
    """
    from livebass.studies import chosen

    try:
        studies = chosen(names)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    from livebass.study_run import check_extras, run_studies

    check_extras()
    announce_kernels()
    with shown_progress("studies") as progress:
        result = run_studies(
            studies, output, duration=duration, workers=workers, progress=progress, json_file=json_file
        )
    count = f"{len(studies)} stud{'y' if len(studies) == 1 else 'ies'} from {result['solutions']} motions"
    click.echo(f"{count} in {result['wall_s']:.1f} s -> {output / 'index.html'}", err=True)


study.add_command(claims)
study.add_command(sweep)
