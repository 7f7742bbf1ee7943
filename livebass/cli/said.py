"""Says what the commands have to say on stderr: each thing is one line, whatever names are in it.

A terminal gets lines that end between words, at its width; a file or a pipe gets each thing as one line.
"""

from __future__ import annotations

import shutil
import sys
import textwrap

import click

from livebass.units import one_line

USUAL_WIDTH = 80  # columns, of tables where there is no terminal
INDENT = "  "  # of the further lines of one thing


def say(line: str) -> None:
    """Prints one line on stderr; line ends and terminal codes in the names of files are written out."""
    text = one_line(line)
    if sys.stderr.isatty():
        text = textwrap.fill(
            text, width(), subsequent_indent=INDENT, break_long_words=False, break_on_hyphens=False,
            replace_whitespace=False, drop_whitespace=True,
        )  # fmt: skip
    click.echo(text, err=True)


def width() -> int:
    """The columns of the terminal, or USUAL_WIDTH."""
    return max(20, shutil.get_terminal_size((USUAL_WIDTH, 24)).columns)


def wrapped(head: str, text: str) -> str:
    """A row of a table whose last column, `text`, goes on below itself."""
    return textwrap.fill(
        text, width(), initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip
