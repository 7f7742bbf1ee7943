"""Reads the bass part of a Standard MIDI File.

A text at its beginning marks a take, played on a livebass: its messages and their order stay, and it sounds as it was
heard. Other files are cleaned (score.py). Both keep channels and release velocities.
"""

from __future__ import annotations

import functools
import os
import stat
import sys
from collections import Counter
from collections.abc import Container
from dataclasses import dataclass, replace
from pathlib import Path

from livebass import tracknames
from livebass.bounds import refusal
from livebass.score.choosing import Choice, Part, Parts
from livebass.score.lines import Lines, Note, is_note, lines_of
from livebass.score.score import (
    CHANNELS,
    LEAST_RATE,
    NOTE_OFF,
    NOTE_ON,
    PROGRAM,
    RELEASE,
    Event,
    Score,
    checked_rate,
    cleaned,
    note_off,
    score_from,
)
from livebass.score.smf import SmfError, parse_smf
from livebass.score.takes import with_basses
from livebass.score.turns import in_turns

TAKE = "as played by livebass"  # text at the beginning of a file: leave it unchanged
LARGEST = 64 << 20  # bytes of a MIDI file
STDIN = Path("-")
MOST_NAMED = 8  # parts in an error


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
            program, else the only part that is not drums, or the lowest part without a program in a bass's range.

    Raises:
        ScoreError: The file cannot be played.
        ValueError: An invalid rate or channel.
    """
    return score_in(None, Path(path), rate, channel)


def score_in(data: bytes | None, path: Path, rate: int, channel: str | int = "auto") -> Score:
    """`read_score` for the bytes of a file that `path` names in messages; None: those at `path`."""
    read = _read(data, path, rate, channel)
    if not read.choice.notes:
        raise ScoreError(f"{path}: {_nothing_chosen(channel, read.parts.listed())}")
    events = read.chosen_events(rate)
    notes = read.lines.notes(events)
    program, changes = _programs(events, notes, read.lines.zone)
    sent = [e for place, e in enumerate(events) if e.message.kind != PROGRAM or place in changes]
    if not read.take and (turns := in_turns(events, notes, rate)):
        program, sent = notes[0].program, turns
    score = score_from(_on_channels(sent, read.lines), path.stem, rate, program, read.remarks)
    return with_basses(replace(score, file_end=read.lines.end, foreign=not read.take), read.lines.marks)


def read_parts(path: str | os.PathLike[str], channel: str | int = "auto", switches: Container[int] = ()) -> list[Part]:
    """The parts of a Standard MIDI File by port, channel and track, and which of them `read_score` would play.

    Keys in `switches` are not notes. Raises the same errors, but none for a file without a bass.
    """
    read = _read(None, Path(path), LEAST_RATE, channel)
    return list(read.parts.listed(read.choice, switches))


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


@dataclass
class _Read:
    """A file as read, and the parts chosen from it."""

    take: bool
    lines: Lines
    events: list[Event]  # cleaned, or a take's
    parts: Parts
    choice: Choice
    remarks: tuple[str, ...]

    def chosen_events(self, rate: int) -> list[Event]:
        """The events of the chosen notes and of their lines."""
        chosen = {note.line for note in self.choice.notes}
        heard = chosen | self.lines.zone if chosen & self.lines.zone else chosen  # controllers and programs
        if self.choice.alone:  # other parts may share the line: ignore their messages
            parts = {(note.line, note.track) for note in self.choice.notes}
            others = {(note.line, note.track) for note in self.parts.notes} - parts
            own = [e for e in self.lines.events if e.line in heard and (e.line, e.track) not in others]
            return cleaned(
                [e for e in own if (e.line, e.track) in parts or not is_note(e.message)], self.lines.end, rate
            )
        places = {note.place for note in self.choice.notes}
        ended = heard if self.take else chosen
        return [
            e
            for place, e in enumerate(self.events)
            if place in places or (e.line in (ended if is_note(e.message) else heard) and e.message.kind != NOTE_ON)
        ]


def _read(data: bytes | None, path: Path, rate: int, channel: str | int) -> _Read:
    """Reads a MIDI file and chooses the notes to play. Raises ScoreError and ValueError as `read_score` does."""
    checked_rate(rate)
    if channel not in ("auto", "all", *range(1, 17)):
        raise refusal("channel", '"auto", "all" or a number from 1 to 16', repr(channel))
    try:
        smf = parse_smf(file_bytes(path) if data is None else data, path.name)
        if tracknames.is_game(smf.names):
            raise SmfError(tracknames.GAME_REFUSAL)
        take = TAKE in smf.texts
        lines = lines_of(smf, rate, take)
    except SmfError as error:
        raise ScoreError(f"{path}: {error}") from None
    events = _ended(lines.events, lines.end) if take else cleaned(lines.events, lines.end, rate)
    parts = Parts(smf, lines, lines.notes(events), rate)
    choice = parts.choose(channel, take)
    remarks = (*smf.warnings, *lines.remarks, *choice.remarks)
    return _Read(take, lines, events, parts, choice, remarks)


def _ended(events: list[Event], end: int) -> list[Event]:
    """The events, and at frame `end` a note-off for each key that is still down."""
    down: set[tuple[int, int]] = set()
    for event in events:
        m = event.message
        if m.kind == NOTE_ON:
            down.add((m.channel, m.first))
        elif m.kind == NOTE_OFF:
            down.discard((m.channel, m.first))
    end = max([end, *(event.frame for event in events[-1:])])
    return events + [Event(end, note_off(channel, note, RELEASE), 0, channel) for channel, note in sorted(down)]


def _on_channels(events: list[Event], lines: Lines) -> list[Event]:
    """The events with a channel for each line: its own, or a free one if that is taken."""
    channels: dict[int, int] = {}
    for line in sorted({event.line for event in events}, key=lambda line: (line not in lines.zone, line)):
        own, taken = lines.lines[line].channel, set(channels.values())
        free = [channel for channel in (own, *range(CHANNELS)) if channel not in taken]
        channels[line] = free[0] if free else own

    def moved(event: Event) -> Event:
        m, channel = event.message, channels[event.line]
        if m.channel == channel:
            return event
        return event._replace(message=m._replace(status=m.kind | channel))

    return [moved(event) for event in events]


def _programs(events: list[Event], chosen: list[Note], zone: Container[int]) -> tuple[int | None, set[int]]:
    """The program at the start of the chosen notes, and the places of later changes.

    If lines begin with different programs, the one of most notes counts. Of several changes between two notes the last
    one counts, if it changes anything.
    """
    begun: Counter[int | None] = Counter()  # notes before their line's first change
    waiting: dict[int, int] = {}  # places of program changes without a note so far, by line, -1: by zone
    changes: list[int] = []
    played: set[int] = set()
    changed: set[int] = set()
    note_of = {note.place: note for note in chosen}
    for place, event in enumerate(events):
        part = -1 if event.line in zone else event.line
        if event.message.kind == PROGRAM:
            waiting[part] = place
        elif place in note_of:
            change = waiting.pop(part, None)
            if change is not None and part in played:
                changes.append(change)
                changed.add(part)
            if part not in changed:
                begun[note_of[place].program] += 1
            played.add(part)
    first = program = begun.most_common(1)[0][0]
    kept = set()
    for place in sorted(changes):
        if events[place].message.first != program:
            program = events[place].message.first
            kept.add(place)
    return first, kept


def _nothing_chosen(channel: str | int, parts: tuple[Part, ...]) -> str:
    """Says why no note was chosen, and lists the parts."""
    if not parts:
        return "has no notes"
    there = ", ".join(map(str, parts[:MOST_NAMED]))
    if len(parts) > MOST_NAMED:
        there += f" and {len(parts) - MOST_NAMED} more, see render --list"
    if channel == "auto":
        why = "no bass notes: no channel has a bass program, 33 to 40, and no track is called bass"
        return f"{why}; use --channel N or --channel all; there is {there}"
    return f"no notes {'but drums' if channel == 'all' else f'on channel {channel}'}; there is {there}"
