"""`livebass study claims`: what the paper says, and what comes out here."""

from __future__ import annotations

from pathlib import Path

import click

from livebass.cli_render import announce_kernels, shown_progress
from livebass.cli_values import Number

FILES = ("claims.json", "claims.csv", "claims.html")


@click.command()
@click.argument("ids", nargs=-1, metavar="[ID]...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="DIR",
    help="Write the table as claims.json, .csv and .html as well; made if need be.",
)  # fmt: skip
@click.option("--json", "file", type=click.Path(path_type=Path), metavar="FILE", help="Write it as JSON to FILE.")
@click.option("--workers", type=Number("count", 1, 64, whole=True), help="Threads that solve; as many as cores.")
def claims(ids: tuple[str, ...], output: Path | None, file: Path | None, workers: int | None) -> int:
    """Check every statement of the paper that can be checked, or those of the given IDs.

    Solves the paper's cases with all modes at its contact rates, and some more, each once, and holds each statement of
    Issanchou et al. (2018) against what is measured in them: a table on stdout, whose first column has the IDs. Takes
    about a quarter of a minute. The status is 1 if a statement does not hold.

    \b
    Examples:
      livebass study claims --json claims.json
      livebass study claims b-first-contact b-first-set
    """
    from livebass.atomic import Transaction, checked_place

    texts = [] if output is None else [(output / name, name.rpartition(".")[2]) for name in FILES]
    if file is not None:
        texts.append((file, "json"))
    try:
        import scipy  # noqa: F401
    except ImportError as error:
        raise click.ClickException(f"{error}; pip install 'livebass[analysis]'") from None
    from livebass import claims as checker
    from livebass import claims_text

    wanted = checker.chosen(ids)
    announce_kernels()
    with Transaction() as files:
        if output is not None:
            files.directory(output)
        if len({checked_place(path) for path, _ in texts}) < len(texts):  # now, not after the work
            raise click.UsageError(f"--json {file}: -o writes a file of that name")
        with shown_progress("solving") as progress:
            results = checker.check(wanted, workers, progress)
        click.echo(claims_text.table(results))
        for path, kind in texts:
            files.write(path, claims_text.WRITERS[kind](results).encode())
    return int(not all(r.passed for r in results))
