"""Every command of livebass, and its `--help`."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Iterator

import click

from livebass.cli import main as cli


def commands(
    command: click.Command = cli.livebass, path: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    """Every command and subcommand, with its words after `livebass`; the first is the program itself."""
    yield path, command
    if isinstance(command, click.Group):
        for name, below in command.commands.items():
            yield from commands(below, (*path, name))


def main() -> None:
    """Prints what `--help` prints for every command, and its status, as JSON."""
    found = {}
    for path, _ in commands():
        with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(said):
            status = cli.run([*path, "--help"])
        found[" ".join(path)] = f"{said.getvalue()}status {status}\n"
    print(json.dumps(found))
