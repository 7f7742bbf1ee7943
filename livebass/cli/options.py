"""Options shared by several commands."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from livebass.cli.values import Number, Parsed
from livebass.model.quality import QUALITIES
from livebass.preset.programs import DEFAULT

Decorator = Callable[[Any], Any]
DEFAULT_PRESET = DEFAULT


class FileName(click.Path):
    """The path of a file or folder; refuses an empty one, as from an unset shell variable."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not os.fspath(value):
            self.fail("'': is not a file name", param, ctx)
        return super().convert(value, param, ctx)


PATH = FileName(path_type=Path)
CREATED = "Directory to write to; created if missing."


@contextmanager
def of_option(name: str) -> Iterator[None]:
    """Puts the option's name before a PresetError raised in the block."""
    from livebass.preset.source import PresetError

    try:
        yield
    except PresetError as error:
        raise PresetError(f"{name}: {error}") from None


def together(*options: Decorator) -> Decorator:
    """A decorator that gives a command these options; --help lists them in this order."""

    def decorate(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def option(names: str, kind: Any, help: str, **more: Any) -> Decorator:
    """The option called `names`, such as "-o --output", whose value is of a `kind`; help shows its default, if any."""
    return click.option(*names.split(), type=kind, help=help, **{"show_default": "default" in more} | more)


def flag(names: str, help: str, **more: Any) -> Decorator:
    """An option without a value."""
    return click.option(*names.split(), is_flag=True, help=help, **more)


def file_option(names: str, help: str, metavar: str = "FILE", **more: Any) -> Decorator:
    """An option that takes the path of a file."""
    return option(names, PATH, help, metavar=metavar, **more)


def folder_option(help: str, name: str = "", **more: Any) -> Decorator:
    """The option -o DIR, in Python called `name`."""
    return file_option(f"-o --output {name}", help, metavar="DIR", **more)


def preset_option(help: str, name: str = "", **more: Any) -> Decorator:
    """The option -p NAME|FILE, in Python called `name`."""
    return option(f"-p --preset {name}", str, help, metavar="NAME|FILE", **more)


def quality_option(default: str, help: str, among: tuple[str, ...] = tuple(QUALITIES)) -> Decorator:
    """The option -q."""
    return option("-q --quality", click.Choice(among), help, default=default)


def count_option(
    name: str, maximum: int, help: str, minimum: int = 1, metavar: str = "count", **more: Any
) -> Decorator:
    """An option that takes an integer from `minimum` to `maximum`; `more` may hold its `default`."""
    return option(name, Number(metavar, minimum, maximum, whole=True), help, **more)


def _axis(text: str) -> Any:
    """A parameter and its values, KEY=FROM:TO:N. Raises ValueError."""
    from livebass.lab.experiment.grid import axis

    return axis(text)


vary_option = option(
    "--vary axes",
    Parsed("axis", _axis),
    "A parameter and its values; repeatable.",
    multiple=True,
    metavar="KEY=FROM:TO:N[:log]",
)
scheduler_option = option(
    "--scheduler",
    str,
    "Compute on the Dask cluster with this scheduler, such as tcp://host:8786.",
    metavar="ADDRESS",
)
cluster_options = together(
    count_option("--workers", 1024, "Number of processes.  [default: one per core]"), scheduler_option
)


def check_cluster(workers: int | None, scheduler: str | None) -> None:
    """Raises UsageError if both --workers and --scheduler are given."""
    if workers is not None and scheduler is not None:
        raise click.UsageError("--workers is for this machine, --scheduler for a cluster: give one of them")


def seed_option(maximum: int = 2**31) -> Decorator:
    """The option --seed."""
    text = "Seed of the player's small variations; the same seed gives the same result."
    return count_option("--seed", maximum, text, minimum=0, metavar="number", default=0)


rendered_quality = quality_option(
    "studio", "Precision of the strings: number of modes, steps of contact with the frets."
)
presets_option = preset_option(
    "A bass: a name from `livebass presets list`, or your own file; repeatable.  [default: all]",
    "presets",
    multiple=True,
)


def files_to_write(files: Mapping[str, Path | None], sources: Iterable[Path] = ()) -> list[Path]:
    """The given files by option, checked before the work. Raises UsageError for equal ones and for one of `sources`."""
    from livebass.files.whole import checked_place

    found = {option: path for option, path in files.items() if path is not None}
    if len({checked_place(path) for path in found.values()}) < len(found):
        raise click.UsageError(f"{' and '.join(found)}: the same file")
    for path in found.values():
        if path.exists() and any(source.exists() and os.path.samefile(source, path) for source in sources):
            raise click.UsageError(f"{path}: is a recording itself; name another file")
    return list(found.values())


def folder_to_write(folder: Path) -> None:
    """Checks, before the work, that files can be written into `folder`, which need not exist. Raises OutputError."""
    from livebass.files.whole import checked_directory

    checked_directory(folder, lambda there: True)


def write_results(made: Iterable[tuple[Path | None, Callable[[], str | bytes]]], table: str) -> None:
    """Writes the content `made` for each path, except None; prints `table` even if that fails, as on a full disk."""
    from livebass.files.whole import Transaction

    try:
        with Transaction() as files:
            for path, content in made:
                data = content() if path is not None else b""
                if path is not None and isinstance(data, bytes):
                    files.write(path, data)
                elif path is not None:
                    files.write_text(path, str(data))
    finally:
        click.echo(table.removesuffix("\n"))


def is_given(name: str) -> bool:
    """Returns whether an option was given on the command line."""
    return click.get_current_context().get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
