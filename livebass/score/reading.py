"""Reads the bass part of a Standard MIDI File.

A take, which a text at its beginning says it is, was played on a livebass: its messages are left as they are, in their
order, and it sounds as it was heard. A file by anybody else is cleaned (score.py). Both keep channels and release
velocities.

Of a file the bass part is taken: the notes of General MIDI's basses or, where there are none, of tracks called bass.
The channels of a zone, which a mode gives to the strings or the notes of one instrument, belong together.
"""

from __future__ import annotations

import functools
import os
import re
import stat
import sys
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Callable, Container
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from mido import Message

from livebass.score.score import LEAST_RATE, LONGEST, RELEASE, Event, Score, checked_rate, cleaned, note_off, score_from
from livebass.score.takes import with_basses
from livebass.smf import Smf, SmfError, parse_smf
from livebass.units import note_name

TAKE = "as played by livebass"  # text at the beginning of a file: it is left as it is
CHANNELS = 16
DRUMS = 9  # channel 10, counted from 0
BASS_PROGRAMS = range(32, 40)  # General MIDI, counted from 0: the eight basses
# "Bass", "E-Bass", "bass 2", "Bass Guitar", but no double-bassoon, bass drum or bass clarinet.
BASS_NAME = re.compile(
    r"(?<![a-z])e?bass(es|line|guitar|gitarre)?(?![a-z])(?![\W_]*(drum|clarinet|trombone|flute|voc|voice|singer))",
    re.IGNORECASE,
)
LARGEST = 64 << 20  # bytes of a MIDI file
STDIN = Path("-")
MOST_NAMED = 8  # parts in an error
DEFAULT_TEMPO = 500_000  # us per quarter note, until a file sets another


class ScoreError(ValueError):
    """A MIDI file that cannot be played. The message is one line: file, place, and what is allowed."""


@dataclass(frozen=True)
class Part:
    """The notes of one channel in one track of a MIDI file."""

    channel: int  # 1 to 16
    track: int  # from 1
    name: str  # of the track; "": it has none
    programs: tuple[int, ...]  # General MIDI's, counted from 1, that its notes have; empty: the file sets none
    notes: int
    switches: int  # note-ons of keys that switch, and are none of the notes
    lowest: int  # note numbers; 0 without notes
    highest: int
    chosen: int  # how many of its notes are played

    @property
    def range(self) -> str:
        """Lowest to highest note, "E1 to D#4"; "" without notes."""
        if not self.notes:
            return ""
        names = note_name(self.lowest), note_name(self.highest)
        return names[0] if self.lowest == self.highest else " to ".join(names)

    @property
    def is_drums(self) -> bool:
        return self.channel == DRUMS + 1

    def __str__(self) -> str:
        programs = f"program {' '.join(map(str, self.programs))}" if self.programs else "no program"
        named = f' "{self.name}"' if self.name else ""
        several = "s" * (self.notes != 1)
        kind = "drums" if self.is_drums else programs
        return f"channel {self.channel}{named} ({kind}, {self.notes} note{several}, {self.range})"


def read_score(path: str | os.PathLike[str], rate: int, channel: str | int = "auto") -> Score:
    """The bass part of a Standard MIDI File (type 0 or 1) in frames at `rate` Hz; of standard input if `path` is "-".

    `channel` "auto" takes the notes played while their channel's program is 33 to 40, counted from 1 (the General MIDI
    basses); if there are none, those of tracks called bass, or else of a zone without a program; of a take, which
    `livebass play` recorded, all, and the basses that it names. "all" takes every channel but 10, the drums; 1 to 16
    takes that one. Controllers are taken from the channels of these notes, and from those of their zone: the channels
    that controller 126 gives to strings or RPN 6 to notes, which have the program of any of them. Raises ScoreError if
    the file cannot be played, and ValueError for a rate or channel that is not allowed.
    """
    read = _read(path, rate, channel)
    if not read.chosen:
        raise ScoreError(f"{path}: {_nothing_chosen(channel, read.parts)}")
    program, changes = _programs(read.events, read.chosen, read.zone)
    events = [e for place, e in enumerate(read.events) if e[1].type != "program_change" or place in changes]
    score = score_from(events, Path(path).stem, rate, program, read.remarks)
    return with_basses(replace(score, file_end=read.end), read.marks)


def read_parts(path: str | os.PathLike[str], channel: str | int = "auto", switches: Container[int] = ()) -> list[Part]:
    """The parts of a Standard MIDI File by channel and track, and which of them `read_score` would play.

    Keys in `switches` are no notes. Raises ScoreError and ValueError as it does, but not for a file without a bass.
    """
    read = _read(path, LEAST_RATE, channel)
    return list(_parts(read.notes, read.places, read.names, switches))


def _file_bytes(path: Path) -> bytes:
    """The content of a regular file, or for "-" of standard input, of at most LARGEST bytes. Raises ScoreError."""
    if path == STDIN:
        data = _stdin()
        if len(data) > LARGEST:
            raise ScoreError(f"{path}: allowed are up to {LARGEST >> 20} MB")
        return data
    try:
        kind = path.stat()
        if stat.S_ISDIR(kind.st_mode):
            raise ScoreError(f"{path}: is a directory, not a MIDI file")
        if not stat.S_ISREG(kind.st_mode):
            raise ScoreError(f"{path}: is not a regular file")
        if kind.st_size > LARGEST:
            raise ScoreError(f"{path}: {kind.st_size >> 20} MB, allowed: up to {LARGEST >> 20} MB")
        return path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError for a zero byte in the name
        if isinstance(error, ScoreError):
            raise
        raise ScoreError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


@functools.cache  # there is nothing left to read the next time
def _stdin() -> bytes:
    """Standard input up to its end, or to a byte more than a MIDI file may have."""
    try:
        return sys.stdin.buffer.read(LARGEST + 1)
    except OSError as error:
        raise ScoreError(f"{STDIN}: cannot be read: {error.strerror or error}") from None


def _frame_of(smf: Smf, rate: int) -> Callable[[int], int]:
    """A function from tick to nearest frame. It computes in integers, so that times do not drift over hours."""
    if not smf.ticks_per_quarter:
        over, under = smf.ticks_per_second
        return lambda tick: (2 * tick * under * rate + over) // (2 * over)
    ticks, times, tempos = [0], [0], [DEFAULT_TEMPO]  # time in us times ticks per quarter note
    for tick, tempo in smf.tempos:
        times.append(times[-1] + (tick - ticks[-1]) * tempos[-1])
        ticks.append(tick)
        tempos.append(tempo)
    whole = smf.ticks_per_quarter * 1_000_000

    def frame(tick: int) -> int:
        k = bisect_right(ticks, tick) - 1
        return (2 * (times[k] + (tick - ticks[k]) * tempos[k]) * rate + whole) // (2 * whole)

    return frame


def _timed(smf: Smf, rate: int) -> tuple[list[Event], int]:
    """The messages with frames, and the frame of the file's end. Note-ons with velocity 0 become note-offs."""
    frame = _frame_of(smf, rate)
    end = frame(smf.end_tick)
    if end > LONGEST * rate:
        raise SmfError(f"lasts {end / rate / 3600:.4g} hours, allowed: up to {LONGEST // 3600}")
    events = []
    for tick, m, track in smf.messages:
        off = m.type == "note_on" and m.velocity == 0
        events.append((frame(tick), note_off(m.channel, m.note, RELEASE) if off else m, track))
    return events, end


def _ended(events: list[Event], end: int) -> list[Event]:
    """The events as they are, and at frame `end` a note-off for each key that is still down."""
    down: set[tuple[int, int]] = set()
    for _, m, _ in events:
        if m.type == "note_on":
            down.add((m.channel, m.note))
        elif m.type == "note_off":
            down.discard((m.channel, m.note))
    end = max([end, *(frame for frame, _, _ in events[-1:])])
    return events + [(end, note_off(channel, note, RELEASE), 0) for channel, note in sorted(down)]


def _modes(events: list[Event]) -> dict[int, frozenset[int]]:
    """The places of messages that give channels a meaning, as the performer takes them, and which channels each."""
    modes: dict[int, frozenset[int]] = {}
    high = low = 127  # of the RPN that is selected
    for place, (_, m, _) in enumerate(events):
        if m.type != "control_change":
            continue
        if m.control == 101:
            high = m.value
        elif m.control == 100:
            low = m.value
        elif m.control in (98, 99, 121):
            high = low = 127
        elif m.control == 126 and m.value > 1:
            modes[place] = frozenset(range(m.channel, min(m.channel + m.value, CHANNELS)))
        elif m.control == 6 and (high, low) == (0, 6) and m.value > 1:
            members = min(m.value, CHANNELS - 1)
            first = 0 if m.channel == 0 else CHANNELS - 1 - members
            modes[place] = frozenset({m.channel, *range(first, first + members + 1)})
    return modes


def _zone(events: list[Event]) -> tuple[frozenset[int], list[Event]]:
    """The channels that modes make one instrument of, and the events without the modes that are not believed.

    Not believed are modes where some notes of these channels have the program of a bass, and some another.
    """
    modes = _modes(events)
    zone = frozenset[int]().union(*modes.values())
    programs = {note.program for note in _notes(events, zone) if note.channel in zone} - {None}
    if len({program in BASS_PROGRAMS for program in programs}) < 2:
        return zone, events
    return frozenset(), [event for place, event in enumerate(events) if place not in modes]


class _Note(NamedTuple):
    """A note-on among cleaned events."""

    place: int  # in the list of events
    track: int  # from 0
    channel: int  # from 0
    note: int
    program: int | None  # of its channel, or its zone, when it begins, from 0; None: not set so far


class _Read(NamedTuple):
    """The notes read from a file, and those that `channel` chooses."""

    notes: list[_Note]
    places: set[int]  # of the notes that are chosen
    names: tuple[str, ...]  # of the tracks
    events: list[Event]  # of the chosen notes and of their channels
    chosen: list[_Note]  # the same notes, placed among these events
    zone: frozenset[int]  # channels that are one instrument
    remarks: tuple[str, ...]
    end: int  # frame of the end of the file
    marks: list[tuple[int, str]]  # (frame, text) of a take: which bass plays from there on

    @property
    def parts(self) -> tuple[Part, ...]:
        return _parts(self.notes, self.places, self.names)


def _read(path: str | os.PathLike[str], rate: int, channel: str | int) -> _Read:
    """Reads a MIDI file and chooses the notes to play. Raises ScoreError and ValueError as `read_score` does."""
    checked_rate(rate)
    if channel not in ("auto", "all", *range(1, 17)):
        raise ValueError(f'channel {channel!r}: allowed are "auto", "all" and 1 to 16')
    path = Path(path)
    try:
        smf = parse_smf(_file_bytes(path))
        events, end = _timed(smf, rate)
    except SmfError as error:
        raise ScoreError(f"{path}: {error}") from None
    taken = TAKE in smf.texts
    if taken:
        zone, clean = frozenset(range(CHANNELS)), _ended(events, end)
    else:
        zone, events = _zone(events)
        clean = cleaned(events, end, rate)
    notes = _notes(clean, zone)
    chosen = [note for note in notes if (taken and channel == "auto") or _wanted(channel, note, zone)]
    tracks = set() if chosen or channel != "auto" else _called_bass(notes, smf.names, zone)
    if not chosen and not tracks and channel == "auto":
        chosen = [note for note in notes if note.channel in zone and note.program is None]
    remarks = smf.warnings
    if tracks:
        chosen = [note for note in notes if note.track in tracks]
        called = ", ".join(f'"{smf.names[track]}"' for track in sorted(tracks))
        said = f"no channel has a bass program, 33 to 40: plays the track{'s' * (len(tracks) > 1)} called {called}"
        remarks = (*remarks, said)
    places, channels = {note.place for note in chosen}, {note.channel for note in chosen}
    heard = channels | zone if channels & zone else channels  # controllers and programs
    if tracks:  # others may share the channel: their notes must not end these
        own = [e for e in events if e[1].channel in heard and (e[2] in tracks or not _is_note(e[1]))]
        kept = cleaned(own, end, rate)
    else:
        kept = [
            e
            for place, e in enumerate(clean)
            if place in places or (e[1].channel in (channels if _is_note(e[1]) else heard) and e[1].type != "note_on")
        ]
    frame = _frame_of(smf, rate)
    marks = [(frame(tick), text) for tick, text in smf.marks if taken]
    return _Read(notes, places, smf.names, kept, _notes(kept, zone), zone, remarks, end, marks)


def _is_note(m: Message) -> bool:
    return m.type in ("note_on", "note_off")


def _notes(events: list[Event], zone: Container[int]) -> list[_Note]:
    """The notes of events, with the programs they have; of a channel of the zone without one, the zone's."""
    programs: list[int | None] = [None] * CHANNELS
    of_zone: int | None = None
    notes = []
    for place, (_, m, track) in enumerate(events):
        if m.type == "program_change":
            programs[m.channel] = m.program
            of_zone = m.program if m.channel in zone else of_zone
        elif m.type == "note_on":
            program = programs[m.channel]
            if program is None and m.channel in zone:
                program = of_zone
            notes.append(_Note(place, track, m.channel, m.note, program))
    return notes


def _programs(events: list[Event], chosen: list[_Note], zone: Container[int]) -> tuple[int | None, set[int]]:
    """The program that the chosen notes begin with, and the places of the changes after that.

    Several channels may begin with several: it is that of most notes. Of several changes between two notes the last
    one counts, and none that changes nothing.
    """
    begun: Counter[int | None] = Counter()  # notes before their channel's first change
    waiting: dict[int, int] = {}  # places of program changes without a note so far, by channel, -1: by zone
    changes: list[int] = []
    played: set[int] = set()
    changed: set[int] = set()
    note_of = {note.place: note for note in chosen}
    for place, (_, m, _) in enumerate(events):
        part = -1 if m.channel in zone else m.channel
        if m.type == "program_change":
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
        if events[place][1].program != program:
            program = events[place][1].program
            kept.add(place)
    return first, kept


def _wanted(channel: str | int, note: _Note, zone: Container[int]) -> bool:
    """True if `channel` chooses the note; for "auto" by its program."""
    drums = note.channel == DRUMS and DRUMS not in zone
    if channel == "auto":
        return not drums and note.program in BASS_PROGRAMS
    if channel == "all":
        return not drums
    return channel == note.channel + 1


def _called_bass(notes: list[_Note], names: tuple[str, ...], zone: Container[int]) -> set[int]:
    """The tracks called bass; a track with notes of several instruments has the name of the piece, and is none."""
    channels: dict[int, set[int]] = defaultdict(set)
    for note in notes:
        channels[note.track].add(-1 if note.channel in zone else note.channel)
    return {
        track
        for track, used in channels.items()
        if len(used) == 1 and DRUMS not in used and BASS_NAME.search(names[track])
    }


def _parts(
    notes: list[_Note], places: set[int], names: tuple[str, ...], switches: Container[int] = ()
) -> tuple[Part, ...]:
    """The parts of `notes` by channel and track; chosen are those at `places`. Keys in `switches` are no notes."""
    parts: dict[tuple[int, int], list[_Note]] = defaultdict(list)
    pressed: Counter[tuple[int, int]] = Counter()
    for note in notes:
        part = parts[note.channel, note.track]
        if note.note in switches:
            pressed[note.channel, note.track] += 1
        else:
            part.append(note)
    return tuple(
        Part(
            channel=channel + 1,
            track=track + 1,
            name=names[track],
            programs=tuple(dict.fromkeys(n.program + 1 for n in part if n.program is not None)),
            notes=len(part),
            switches=pressed[channel, track],
            lowest=min((n.note for n in part), default=0),
            highest=max((n.note for n in part), default=0),
            chosen=sum(n.place in places for n in part),
        )
        for (channel, track), part in sorted(parts.items())
    )


def _nothing_chosen(channel: str | int, parts: tuple[Part, ...]) -> str:
    """Says why no note was chosen, and which parts there are."""
    if not parts:
        return "has no notes"
    there = ", ".join(map(str, parts[:MOST_NAMED]))
    if len(parts) > MOST_NAMED:
        there += f" and {len(parts) - MOST_NAMED} more, see render --list"
    if channel == "auto":
        why = "no bass notes: no channel has a bass program, 33 to 40, and no track is called bass"
        return f"{why}; use --channel N or --channel all; there is {there}"
    return f"no notes on {'any channel but 10' if channel == 'all' else f'channel {channel}'}; there is {there}"
