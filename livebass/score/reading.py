"""Reads the bass part of a Standard MIDI File.

A text at its beginning marks a take, played on a livebass: its messages and their order stay, and it sounds as it was
heard. Other files are cleaned (score.py). Both keep channels and release velocities.
"""

from __future__ import annotations

import functools
import os
import stat
import sys
from collections.abc import Container
from pathlib import Path

from livebass.kernels.score.memory import NONE
from livebass.rows.bounds import refusal
from livebass.score import tracknames
from livebass.score.choosing import Part, Parts
from livebass.score.found import Found
from livebass.score.score import MIN_RATE, Score, checked_rate, messages_of
from livebass.score.sentences import NO_BASS
from livebass.score.smf import Smf, SmfError, parse_smf
from livebass.score.takes import strokes_of, with_basses

TAKE = "as played by livebass"  # text at the beginning of a file: leave it unchanged
LARGEST = 64 << 20  # bytes of a MIDI file
STDIN = Path("-")
MAX_NAMED = 8  # parts in an error


class ScoreError(ValueError):
    """A MIDI file or tablature that cannot be played. The message is one line: file, place, and what is allowed."""


def read_score(path: str | os.PathLike[str], rate: int, channel: str | int = "auto") -> Score:
    """Reads the bass part of a Standard MIDI File.

    From a take, recorded by `livebass play`, "auto" reads all notes, and the basses that it names. Controllers come
    from the channels of the notes and of their zone: the channels that controller 126 assigns to strings or RPN 6 to
    notes, which share the program of any of them.

    Args:
        path: The file; "-" is standard input.
        rate: Sample rate of the frames in the score, a whole number of Hz from 8000 to 192 000.
        channel: 1 to 16 reads that channel, "all" everything but drums. "auto" reads the notes with programs 33 to 40,
            counted from 1 (the General MIDI basses). Without any, it reads tracks called bass, else a zone without a
            program, else the only part that is not drums, or the lowest part without a program in a bass's range. Of a
            Yamaha style it reads the first variant of the bass.

    Raises:
        ScoreError: The file cannot be played.
        ValueError: An invalid rate or channel.
    """
    return score_in(None, Path(path), rate, channel)


def score_in(data: bytes | None, path: Path, rate: int, channel: str | int = "auto") -> Score:
    """`read_score` for the bytes of a file that `path` names in messages; None: those at `path`."""
    smf, found, parts = _read(data, path, rate, channel)
    row, played = found.row, found.played
    texts = [(found.frame(tick), text) for tick, text in smf.marks] if row["take"] else []
    strokes = strokes_of(texts, int(row["end"]))
    if not (row["chosen"] or strokes):
        raise ScoreError(f"{path}: {_nothing_chosen(channel, parts.listed())}")
    score = Score(
        frames=played["frame"].copy(),
        messages=messages_of(played),
        end_frame=int(played["frame"].max(initial=0)),
        notes=int(row["notes"]),
        name=path.stem,
        rate=rate,
        program=None if row["program"] == NONE else int(row["program"]),
        remarks=(*smf.warnings, *parts.remarks()),
        file_end=int(row["end"]),
        foreign=not row["take"],
    )
    return with_basses(score.with_strokes(strokes) if strokes else score, texts)


def read_parts(path: str | os.PathLike[str], channel: str | int = "auto", switches: Container[int] = ()) -> list[Part]:
    """The parts of a Standard MIDI File by port, channel and track, and which of them `read_score` would play.

    Keys in `switches` are not notes. Raises the same errors, but none for a file without a bass.
    """
    return parts_in(None, Path(path), channel, switches)


def parts_in(data: bytes | None, path: Path, channel: str | int = "auto", switches: Container[int] = ()) -> list[Part]:
    """`read_parts` for the bytes of a file that `path` names in messages; None: those at `path`."""
    return list(_read(data, path, MIN_RATE, channel)[2].listed(switches))


def file_bytes(path: Path) -> bytes:
    """The content, at most LARGEST bytes, of a regular file or, for "-", standard input. Raises ScoreError."""
    if path == STDIN:
        data = _stdin()
        if len(data) > LARGEST:
            raise ScoreError(f"{path}: has more than {LARGEST >> 20} MB, which is the most")
        return data
    try:
        kind = path.stat()
        if stat.S_ISDIR(kind.st_mode):
            raise ScoreError(f"{path}: is a directory, not a MIDI file")
        if not stat.S_ISREG(kind.st_mode):
            raise ScoreError(f"{path}: is not a regular file")
        if kind.st_size > LARGEST:
            raise ScoreError(f"{path}: has {kind.st_size >> 20} MB, more than {LARGEST >> 20} MB")
        return path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError for a zero byte in the name
        if isinstance(error, ScoreError):
            raise
        raise ScoreError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


@functools.cache  # nothing is left to read the next time
def _stdin() -> bytes:
    """Standard input up to its end, or to one byte more than allowed in a MIDI file."""
    try:
        return sys.stdin.buffer.read(LARGEST + 1)
    except OSError as error:
        raise ScoreError(f"{STDIN}: cannot be read: {error.strerror or error}") from None


def _read(data: bytes | None, path: Path, rate: int, channel: str | int) -> tuple[Smf, Found, Parts]:
    """Reads a MIDI file and chooses the notes to play. Raises ScoreError and ValueError as `read_score` does."""
    checked_rate(rate)
    if channel not in ("auto", "all", *range(1, 17)):
        raise refusal("channel", '"auto", "all" or a number from 1 to 16', repr(channel))
    try:
        smf = parse_smf(file_bytes(path) if data is None else data, path.name)
        if tracknames.is_game(smf.names):
            raise SmfError(tracknames.GAME_REFUSAL)
        found = Found(smf, rate, TAKE in smf.texts)
    except SmfError as error:
        raise ScoreError(f"{path}: {error}") from None
    found.choose(channel)
    return smf, found, Parts(smf, found, channel)


def _nothing_chosen(channel: str | int, parts: tuple[Part, ...]) -> str:
    """Says why no note was chosen, and lists the parts."""
    if not parts:
        return "has no notes"
    there = ", ".join(map(str, parts[:MAX_NAMED]))
    if len(parts) > MAX_NAMED:
        there += f" and {len(parts) - MAX_NAMED} more, see render --list"
    if channel == "auto":
        return f"no bass notes: {NO_BASS}; use --channel N or --channel all; there is {there}"
    return f"no notes {'but drums' if channel == 'all' else f'on channel {channel}'}; there is {there}"
