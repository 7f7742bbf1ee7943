"""Prints the commands' messages on stderr: one line each, whatever names it contains.

On a terminal, lines wrap between words at its width; a file or a pipe gets one line per message.
"""

from __future__ import annotations

import math
import os
import shutil
import sys
import textwrap
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from livebass.rows.units import one_line

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument

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


def fretting_out(bass: Instrument) -> str:
    """Names the notes of `bass` that fret out, by the fret or place that they lie on; empty if there are none."""
    from livebass.model.rest import choked

    by_crown: dict[str, dict[str, list[int]]] = {}
    for note in choked(bass):
        by_crown.setdefault(bass.neck(note.string).fret_text(note.on), {}).setdefault(note.string, []).append(note.fret)
    if not by_crown:
        return ""
    parts = []
    for on, strings in by_crown.items():
        named = (f"{string} at {bass.neck(string).fret_text(*frets, board='')}" for string, frets in strings.items())
        parts.append(f"on {on} lies {'; '.join(named)}")
    sound = "sound as the place nearer the bridge" if bass.necks[0].fretless else "soon die away at the higher fret"
    return f"notes fret out, and {sound} that the string lies on at rest: {', '.join(parts)}"


def say_choked(basses: Iterable[Instrument]) -> None:
    """Says which notes of `basses` fret out, a line for each bass."""
    for bass in {id(bass): bass for bass in basses}.values():
        if line := fretting_out(bass):
            say(f"{bass.name}: {line}")


def clipping(clipped: int, gain: float, peak: float) -> str:
    """Tells how many samples clipped at `gain` (dB), and from the `peak` (dB) which gain avoids it."""
    return f", {clipped} samples clipped: try --gain {math.floor(gain - peak)}"
