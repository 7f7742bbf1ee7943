"""Says what the commands have to say on stderr: each thing is one line, whatever names are in it.

A terminal gets lines that end between words, at its width; a file or a pipe gets each thing as one line.
"""

from __future__ import annotations

import math
import os
import shutil
import sys
import textwrap
from contextlib import suppress

import click

from livebass.units import one_line

USUAL_WIDTH, LEAST_WIDTH = 80, 20  # columns, of tables where there is no terminal; of a very narrow one
INDENT = "  "  # of the further lines of one thing


def say(line: str) -> None:
    """Prints one line on stderr; line ends and terminal codes in the names of files are written out."""
    click.echo(filled(one_line(line)), err=True)


def filled(line: str) -> str:
    """`line`, which ends between words where stderr is a terminal: lines of its width."""
    if not sys.stderr.isatty():
        return line
    return textwrap.fill(line, width(), subsequent_indent=INDENT, break_long_words=False, break_on_hyphens=False)


def width() -> int:
    """The columns of the terminal that stderr is, or stdout, or USUAL_WIDTH."""
    with suppress(OSError, ValueError):
        return max(LEAST_WIDTH, os.get_terminal_size(sys.stderr.fileno()).columns)
    return max(LEAST_WIDTH, shutil.get_terminal_size((USUAL_WIDTH, 24)).columns)


def wrapped(head: str, text: str) -> str:
    """A row of a table whose last column, `text`, goes on below itself."""
    return textwrap.fill(
        text, width(), initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip


def clipping(clipped: int, gain: float, peak: float) -> str:
    """Says how many samples were clipped at `gain` (dB), and which gain would clip none, from the `peak` (dB)."""
    return f", {clipped} samples clipped: try --gain {math.floor(gain - peak)}"
