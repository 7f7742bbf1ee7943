"""Prints the commands' messages on stderr: one line each, whatever names it contains.

On a terminal, lines wrap between words at its width; a file or a pipe gets one line per message.
"""

from __future__ import annotations

import math
import os
import shutil
import sys
import textwrap
from contextlib import suppress

import click

from livebass.rows.units import one_line

DEFAULT_WIDTH, MIN_WIDTH = 80, 20  # columns: of tables without a terminal; of a very narrow one
INDENT = "  "  # of continuation lines


def say(line: str) -> None:
    """Prints one line on stderr; escapes line ends and terminal codes in file names."""
    click.echo(fill_line(one_line(line)), err=True)


def fill_line(line: str) -> str:
    """`line`, wrapped between words to the terminal's width if stderr is one."""
    if not sys.stderr.isatty():
        return line
    return textwrap.fill(line, width(), subsequent_indent=INDENT, break_long_words=False, break_on_hyphens=False)


def width() -> int:
    """The columns of the terminal on stderr or stdout, or DEFAULT_WIDTH."""
    with suppress(OSError, ValueError):
        return max(MIN_WIDTH, os.get_terminal_size(sys.stderr.fileno()).columns)
    return max(MIN_WIDTH, shutil.get_terminal_size((DEFAULT_WIDTH, 24)).columns)


def wrap_row(head: str, text: str) -> str:
    """A table row whose last column, `text`, wraps within its column."""
    return textwrap.fill(
        text, width(), initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip


def clipping(clipped: int, gain: float, peak: float) -> str:
    """Tells how many samples clipped at `gain` (dB), and from the `peak` (dB) which gain avoids it."""
    return f", {clipped} samples clipped: try --gain {math.floor(gain - peak)}"
