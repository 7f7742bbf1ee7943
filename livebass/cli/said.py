"""Says what the commands have to say on stderr: each thing is one line, whatever names are in it."""

from __future__ import annotations

import click

from livebass.units import one_line


def say(line: str) -> None:
    """Prints one line on stderr; line ends and terminal codes in the names of files are written out."""
    click.echo(one_line(line), err=True)
