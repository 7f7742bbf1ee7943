"""Options shared by several commands."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from livebass.cli.values import Number
from livebass.model.quality import QUALITIES

Decorator = Callable[[Any], Any]
DEFAULT_PRESET = "jazz-finger"


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


def file_option(*names: str, help: str, metavar: str = "FILE", **more: Any) -> Decorator:
    """An option that takes the path of a file."""
    return click.option(*names, type=PATH, metavar=metavar, help=help, **more)


def folder_option(help: str, *names: str, **more: Any) -> Decorator:
    """The option -o DIR."""
    return file_option("-o", "--output", *names, metavar="DIR", help=help, **more)


def preset_option(help: str, *names: str, **more: Any) -> Decorator:
    """The option -p NAME|FILE."""
    return click.option("-p", "--preset", *names, metavar="NAME|FILE", help=help, **more)


def quality_option(default: str, help: str, *names: str, among: tuple[str, ...] = tuple(QUALITIES)) -> Decorator:
    """The option -q."""
    kind = click.Choice(among)
    return click.option("-q", "--quality", *names, type=kind, default=default, show_default=True, help=help)


def count_option(name: str, most: int, help: str, least: int = 1, metavar: str = "count", **more: Any) -> Decorator:
    """An option that takes an integer from `least` to `most`; `more` may hold its `default`."""
    kind = Number(metavar, least, most, whole=True)
    return click.option(name, type=kind, show_default="default" in more, help=help, **more)


rendered_quality = quality_option(
    "studio", "Precision of the strings: number of modes, steps of contact with the frets."
)


presets_option = preset_option(
    "A bass: a name from `livebass presets list`, or your own file; repeatable.  [default: all]",
    "presets",
    multiple=True,
)


def given(name: str) -> bool:
    """Returns whether an option was given on the command line."""
    return click.get_current_context().get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
