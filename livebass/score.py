"""Notes with times: a `Score` from a Standard MIDI File, from a list of notes, or a demo phrase.

A player ends a key at its first note-off, however often it was struck (kernels/player): whoever plays cannot know
whether another one is to come. A take, which a text at its beginning says it is, was played so: its messages are left
as they are, in their order, and it sounds as it was heard. A file by anybody else shows its future. There a `Score` is
clean by construction: at one frame, note-offs and controllers come before note-ons; every note-on has its end, at least
`BRIEF` seconds later; an end without a note is dropped; and of overlapping notes of one pitch, the end of the earlier
one does not cut the later one. Both keep channels and release velocities.

Of a file the bass part is taken: the notes of General MIDI's basses or, where there are none, of tracks called bass.
The channels of a zone, which a mode gives to the strings or the notes of one instrument, belong together.
"""

from __future__ import annotations

import functools
import operator
import os
import re
import stat
import sys
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mido import Message
from numpy.typing import NDArray

from livebass.smf import Smf, SmfError, message, parse_smf
from livebass.units import note_name, note_number

NOTE_OFF, NOTE_ON, PROGRAM = 0x80, 0x90, 0xC0
RELEASE = 64  # velocity of a note-off that has none of its own
TAKE = "as played by livebass"  # text at the beginning of a file: it is left as it is
CHANNELS = 16
DRUMS = 9  # channel 10, counted from 0
BASS_PROGRAMS = range(32, 40)  # General MIDI, counted from 0: the eight basses
# "Bass", "E-Bass", "bass 2", "Bass Guitar", but no double-bassoon, bass drum or bass clarinet.
BASS_NAME = re.compile(
    r"(?<![a-z])e?bass(es|line|guitar|gitarre)?(?![a-z])(?![\W_]*(drum|clarinet|trombone|flute|voc|voice|singer))",
    re.IGNORECASE,
)
BRIEF = 1e-3  # s, least length of a note: even a zero-length note sounds
LONGEST = 24 * 3600  # s, of a score
LARGEST = 64 << 20  # bytes of a MIDI file
STDIN = Path("-")
MOST_NAMED = 8  # parts in an error
LEAST_RATE, MOST_RATE = 8000, 192_000  # Hz
DEFAULT_TEMPO = 500_000  # us per quarter note, until a file sets another

Event = tuple[int, Message, int]  # (frame, channel message, track of the file from 0)


class ScoreError(ValueError):
    """A MIDI file that cannot be played. The message is one line: file, place, and what is allowed."""


@dataclass(frozen=True, eq=False)
class Score:
    """The notes and controllers to play, as channel messages with times.

    Program changes among them are those after the first note that change the program.
    """

    frames: NDArray[np.int64]  # (n,) sample frames at `rate`, ascending
    messages: NDArray[np.uint8]  # (n, 3) MIDI status and data; unused data is 0
    end_frame: int  # of the last message, where the tail begins
    notes: int  # number of note-ons
    name: str  # of the piece, for messages
    rate: int  # Hz
    program: int | None = None  # General MIDI's, counted from 0, that a file begins with; None: the file sets none
    remarks: tuple[str, ...] = ()  # a line each: damage in the file that did not matter, and what was chosen from it
    file_end: int = 0  # frame of the end of the file, its other parts included; 0: there is no file

    @property
    def changes(self) -> list[tuple[int, int]]:
        """(frame, program from 0) of the program changes after the first note."""
        changed = self.messages[:, 0] & 0xF0 == PROGRAM
        return list(zip(self.frames[changed].tolist(), self.messages[changed, 1].tolist(), strict=True))

    def on_one_bass(self) -> Score:
        """The score without its program changes."""
        kept = self.messages[:, 0] & 0xF0 != PROGRAM
        return replace(self, frames=self.frames[kept], messages=self.messages[kept])


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


def single_note(note: int, velocity: int, duration: float, rate: int) -> Score:
    """One note of `duration` s. `note` 0 to 127, `velocity` 1 to 127. Raises ValueError as `score_of` does."""
    return score_of([(0.0, duration, note, velocity)], rate, name=f"note {note}")


def score_of(
    notes: Iterable[tuple[float, float, int, int]],
    rate: int,
    bends: Iterable[tuple[float, float]] = (),
    name: str = "notes",
    controls: Iterable[tuple[float, int, int]] = (),
) -> Score:
    """A score from (start s, length s, note 0 to 127, velocity 1 to 127), in any order.

    `bends` are (time s, position -1 to 1 of the pitch wheel), `controls` (time s, controller, value, 0 to 127 each).
    Raises ValueError for values out of range, and for a rate that is not a whole number of Hz from LEAST_RATE to
    MOST_RATE.
    """
    checked_rate(rate)
    events: list[Event] = []
    for start, length, note, velocity in notes:
        if not (_whole(note) and _whole(velocity) and 0 <= note <= 127 and 1 <= velocity <= 127):
            raise ValueError(f"note {note} at velocity {velocity}: allowed are whole numbers, 0 to 127 and 1 to 127")
        if not (0 <= start <= LONGEST and 0 <= length <= LONGEST):
            raise ValueError(f"note of {length} s at {start} s: allowed are 0 to {LONGEST} s")
        first = round(start * rate)
        last = round((start + length) * rate)
        events += [(first, message(bytes([NOTE_ON, note, velocity])), 0), (last, _note_off(0, note, RELEASE), 0)]
    for time, position in bends:
        if not (0 <= time <= LONGEST and -1 <= position <= 1):
            raise ValueError(f"bend to {position} at {time} s: allowed are -1 to 1 and 0 to {LONGEST} s")
        events.append((round(time * rate), Message("pitchwheel", pitch=round(8192 + 8191 * position) - 8192), 0))
    for time, number, value in controls:
        if not (0 <= time <= LONGEST and 0 <= number <= 127 and 0 <= value <= 127):
            raise ValueError(f"controller {number} to {value} at {time} s: allowed are 0 to 127 and 0 to {LONGEST} s")
        events.append((round(time * rate), Message("control_change", control=number, value=value), 0))
    events.sort(key=lambda e: e[0])
    return _score(_cleaned(events, 0, rate), name, rate)


def checked_rate(rate: int) -> None:
    """Raises ValueError unless `rate` is a whole number of Hz from LEAST_RATE to MOST_RATE."""
    if not (_whole(rate) and LEAST_RATE <= rate <= MOST_RATE):
        raise ValueError(f"rate {rate} Hz: allowed are whole numbers from {LEAST_RATE} to {MOST_RATE}")


def _whole(number: object) -> bool:
    """True for an integer of any kind, numpy's included."""
    try:
        operator.index(number)  # type: ignore[arg-type]
    except TypeError:
        return False
    return True


def read_score(path: str | os.PathLike[str], rate: int, channel: str | int = "auto") -> Score:
    """The bass part of a Standard MIDI File (type 0 or 1) in frames at `rate` Hz; of standard input if `path` is "-".

    `channel` "auto" takes the notes played while their channel's program is 33 to 40, counted from 1 (the General MIDI
    basses); if there are none, those of tracks called bass, or else of a zone without a program; of a take, which
    `livebass play` recorded, all. "all" takes every channel but 10, the drums; 1 to 16 takes that one. Controllers are
    taken from the channels of these notes, and from those of their zone: the channels that controller 126 gives to
    strings or RPN 6 to notes, which have the program of any of them. Raises ScoreError if the file cannot be played,
    and ValueError for a rate or channel that is not allowed.
    """
    read = _read(path, rate, channel)
    if not read.chosen:
        raise ScoreError(f"{path}: {_nothing_chosen(channel, read.parts)}")
    program, changes = _programs(read.events, read.chosen, read.zone)
    events = [e for place, e in enumerate(read.events) if e[1].type != "program_change" or place in changes]
    score = _score(events, Path(path).stem, rate, program, read.remarks)
    return replace(score, file_end=read.end)


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
        events.append((frame(tick), _note_off(m.channel, m.note, RELEASE) if off else m, track))
    return events, end


def _note_off(channel: int, note: int, velocity: int) -> Message:
    return message(bytes([NOTE_OFF | channel, note, velocity]))


def _ended(events: list[Event], end: int) -> list[Event]:
    """The events as they are, and at frame `end` a note-off for each key that is still down."""
    down: set[tuple[int, int]] = set()
    for _, m, _ in events:
        if m.type == "note_on":
            down.add((m.channel, m.note))
        elif m.type == "note_off":
            down.discard((m.channel, m.note))
    end = max([end, *(frame for frame, _, _ in events[-1:])])
    return events + [(end, _note_off(channel, note, RELEASE), 0) for channel, note in sorted(down)]


def _cleaned(events: list[Event], end: int, rate: int) -> list[Event]:
    """The events in the order of a `Score`, with exactly one note-off for each note."""
    keys: dict[tuple[int, int], list[tuple[int, bool, int]]] = defaultdict(list)
    clean: list[Event] = []
    for event in events:
        frame, m, _ = event
        if m.type in ("note_on", "note_off"):
            keys[m.channel, m.note].append((frame, m.type == "note_on", m.velocity))
        if m.type != "note_off":
            clean.append(event)
    for (channel, note), strokes in keys.items():
        for frame, velocity in note_ends(strokes, end, max(1, round(BRIEF * rate))):
            clean.append((frame, _note_off(channel, note, velocity), 0))
    # Controllers come first: a pedal pressed as a note ends holds it, and a bend is there before the next note begins.
    rank = {"note_off": 1, "note_on": 2}
    return sorted(clean, key=lambda e: (e[0], rank.get(e[1].type, 0)))


def note_ends(strokes: list[tuple[int, bool, int]], end: int, brief: int) -> list[tuple[int, int]]:
    """(frame, release velocity) at which the notes of one key end.

    strokes: (frame, True for a note-on, velocity) in file order.

    A note-off ends the oldest note held; at its own frame, earlier notes before new ones. If the key has been struck
    again since and another note-off is still to come, the note-off ends nothing, and the new note sounds on. Notes
    still held end at frame `end`. A note lasts at least `brief` frames, unless its key is struck again before.
    """
    moments: list[tuple[int, int, list[int]]] = []  # (frame, note-ons, velocities of note-offs)
    for frame, group in groupby(strokes, key=lambda s: s[0]):
        here = list(group)
        moments.append((frame, sum(on for _, on, _ in here), [velocity for _, on, velocity in here if not on]))
    ends: list[tuple[int, int]] = []
    held, struck = 0, 0
    for (frame, ons, offs), (_, _, offs_next) in zip(moments, [*moments[1:], (end, 0, [])], strict=True):
        early = min(len(offs), held)
        held -= early
        if early and not (held and (ons or offs_next)):
            ends.append((max(frame, struck + brief), offs[early - 1]))
            held = 0
        if ons:
            if ends and ends[-1][0] > frame:
                ends[-1] = (frame, ends[-1][1])
            late = min(len(offs) - early, held + ons)
            held, struck = held + ons - late, frame
            if late and not (held and offs_next):
                ends.append((frame + brief, offs[early + late - 1]))
                held = 0
    return ends + [(max(end, struck + brief), RELEASE)] * bool(held)


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
        clean = _cleaned(events, end, rate)
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
        kept = _cleaned(own, end, rate)
    else:
        kept = [
            e
            for place, e in enumerate(clean)
            if place in places or (e[1].channel in (channels if _is_note(e[1]) else heard) and e[1].type != "note_on")
        ]
    return _Read(notes, places, smf.names, kept, _notes(kept, zone), zone, remarks, end)


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


def _score(
    events: list[Event], name: str, rate: int, program: int | None = None, remarks: tuple[str, ...] = ()
) -> Score:
    """The score of cleaned events, or of those of a take."""
    messages = np.zeros((len(events), 3), np.uint8)
    for row, (_, m, _) in zip(messages, events, strict=True):
        data = m.bytes()
        row[: len(data)] = data
    return Score(
        frames=np.array([frame for frame, _, _ in events], np.int64),
        messages=messages,
        end_frame=max((frame for frame, _, _ in events), default=0),
        notes=int(np.count_nonzero(messages[:, 0] & 0xF0 == NOTE_ON)),
        name=name,
        rate=rate,
        program=program,
        remarks=remarks,
    )


# The demo phrases, in E minor, to hear a preset by: soft and hard notes on every string, a bend, repeated notes.
TEMPO = 112.0  # quarter notes per minute
STYLES = ("finger", "slap", "techniques")

# One row a note: (start in sixteenths, length in sixteenths, note, velocity). At velocities below 40 the string does
# not reach the frets, above 110 it hits most of them: the phrase has both, so that a spectrogram shows it.
FINGER = (
    (0, 3, "E1", 36), (4, 1.5, "E1", 52), (6, 1.5, "G1", 60), (8, 3, "A1", 48), (12, 1, "B1", 66),
    (13, 1, "B1", 72), (14, 1, "D2", 80), (15, 1, "D#2", 70),
    (16, 3, "E2", 92), (19, 1, "E1", 45), (20, 1, "E1", 64), (21, 1, "E1", 80), (22, 1, "E1", 96),
    (23, 1, "E1", 108), (24, 2, "G2", 88), (26, 2, "F#2", 76), (28, 2, "D2", 72), (30, 2, "B1", 64),
    (32, 2.5, "C2", 84), (35, 1, "G2", 92), (36, 1, "C3", 100), (37, 2.5, "B2", 88),
    (40, 4, "D3", 116), (44, 1, "B2", 84), (45, 1, "G2", 76), (46, 1, "D2", 70), (47, 1, "A1", 66),
    (48, 3, "E1", 124), (51, 1, "E1", 58), (52, 1, "G1", 96), (53, 1, "A1", 100), (54, 2, "B1", 118),
    (56, 8, "E1", 30),
)  # fmt: skip
# During the held D3 the wheel rises by a tone and comes back: (sixteenth, position).
FINGER_BENDS = tuple((40.5 + k / 8, min(k, 28 - k) / 14) for k in range(29))

SLAP = (
    (0, 1, "E1", 112), (2, 1, "E1", 100), (3, 0.7, "E2", 118), (4, 1, "E1", 106), (6, 0.7, "D2", 112),
    (7, 0.7, "E2", 120), (8, 1, "G1", 110), (10, 1, "G1", 98), (11, 0.7, "G2", 118), (12, 1, "A1", 112),
    (13, 0.7, "A2", 116), (14, 1, "A#1", 104), (15, 0.7, "B1", 110),
    *((16 + k, 0.7, note, 96 + 26 * (k % 4 == 0) + 14 * (k % 4 == 3)) for k, note in enumerate(
        ("E1", "E1", "E2", "D2", "E1", "G1", "G2", "E2", "E1", "E1", "D2", "E2", "A1", "A2", "B1", "B2"))),
    (32, 3, "C2", 34), (36, 3, "G1", 42), (40, 3, "A1", 50), (44, 1, "B1", 62), (45, 1, "B1", 74),
    (46, 1, "B1", 88), (47, 1, "B1", 104),
    (48, 1, "E1", 124), (50, 1, "E1", 108), (51, 0.7, "E2", 122), (52, 0.7, "G2", 124), (54, 1, "D2", 100),
    (55, 1, "D#2", 104), (56, 8, "E1", 127),
)  # fmt: skip
SLAP_BENDS = tuple((58 + k / 8, -min(k, 16 - k) / 16) for k in range(17))


def demo_score(rate: int, style: str = "finger") -> Score:
    """A phrase of about nine seconds at `rate` Hz, for a bass that is plucked ("finger") or slapped ("slap").

    Or, in about 26 s, one phrase for each technique ("techniques"). Raises ValueError for another style.
    """
    if style not in STYLES:
        raise ValueError(f"style {style!r}: allowed are {', '.join(STYLES)}")
    if style == "techniques":
        return techniques_score(rate)
    rows, bends = (SLAP, SLAP_BENDS) if style == "slap" else (FINGER, FINGER_BENDS)
    sixteenth = 60 / TEMPO / 4
    return score_of(
        [(at * sixteenth, length * sixteenth, note_number(name), velocity) for at, length, name, velocity in rows],
        rate,
        [(at * sixteenth, position) for at, position in bends],
        name=f"demo, {style}",
    )


# One phrase a technique: its name, the key switch that is held meanwhile (None: there is none), the controllers before
# it (number, value), and its notes: start and length in eighths, note, velocity. Legato notes overlap.
Phrase = tuple[str, int | None, tuple[tuple[int, int], ...], tuple[tuple[float, float, str, int], ...]]
TECHNIQUES: tuple[Phrase, ...] = (
    ("fingers", 13, (), ((0, 1, "E1", 60), (1, 1, "G1", 70), (2, 1, "A1", 80), (3, 2, "E2", 100))),
    ("hammer-on and pull-off", 12, (), (
        (0, 3.9, "A1", 80), (1, 1, "B1", 70), (3, 0.9, "B1", 70), (4, 4, "D2", 80), (5, 1, "E2", 80),
        (6.5, 1, "F#2", 90))),
    ("trill", 12, (), ((0, 6, "A2", 80), *((1 + k / 2, 0.25, "B2", 80) for k in range(8)))),
    ("tapping", 2, (), ((0, 0.9, "E2", 80), (1, 0.9, "B2", 100), (2, 0.9, "E3", 110), (3, 2, "G2", 100))),
    ("slides", 4, (), ((0, 4, "E2", 90), (1.5, 2.4, "B2", 90), (4, 4, "B2", 90), (5.5, 2.4, "F#2", 90))),
    ("vibrato", None, ((1, 127),), ((0, 6, "D3", 90),)),
    ("bend", None, ((1, 0),), ((0, 6, "D3", 90),)),
    ("palm mute, loose", None, ((9, 25),), tuple((k, 0.9, n, 90) for k, n in enumerate(("E1", "G1", "A1")))),
    ("palm mute, tight", None, ((9, 110),), tuple((k, 0.9, n, 90) for k, n in enumerate(("E1", "G1", "A1", "E2")))),
    ("ghost notes", 10, ((9, 0),), tuple((k / 2, 0.4, n, 90) for k, n in enumerate(("A1", "A1", "E2", "A1", "E2")))),
    ("left-hand slap", 7, (), tuple((k / 2, 0.4, n, 100) for k, n in enumerate(("E1", "E1", "A1", "D2")))),
    ("natural harmonics", 17, (), ((0, 2, "G3", 90), (1, 2, "D3", 90), (2, 2, "A2", 90), (3, 3, "D4", 90))),
    ("artificial harmonics", 17, (), ((0, 2, "F#2", 90), (2, 3, "B2", 100))),
    ("let ring", None, ((64, 127),), ((0, 0.5, "E1", 80), (1, 0.5, "B1", 70), (2, 0.5, "G2", 70), (3, 0.5, "D3", 70))),
    ("thumb and pops", 18, ((64, 0),), (
        (0, 0.5, "E1", 110), (1, 0.4, "E2", 110), (1.5, 0.4, "E1", 90), (2, 0.5, "A1", 110), (3, 0.5, "G2", 120))),
    ("pick", 15, (), ((0, 0.5, "E1", 90), (0.5, 0.5, "E1", 80), (1, 1, "G1", 100), (2, 2, "A1", 110))),
    ("a finger's last word", 13, (), ((0, 6, "E1", 60),)),
)  # fmt: skip
WHEELS = {"bend": tuple((1 + k / 8, min(k, 24 - k, 8) / 8) for k in range(25))}  # (eighth, position) in a phrase


def techniques_score(rate: int) -> Score:
    """The phrases of TECHNIQUES one after the other at `rate` Hz, a fifth of a second apart."""
    eighth, at = 0.25, 0.1  # s
    notes: list[tuple[float, float, int, int]] = []
    controls: list[tuple[float, int, int]] = []
    bends: list[tuple[float, float]] = []
    for called, switch, before, phrase in TECHNIQUES:
        length = max(start + long for start, long, _, _ in phrase) * eighth
        if switch is not None:
            notes.append((at, length + 0.05, switch, 100))
        controls += [(at, number, value) for number, value in before]
        notes += [
            (at + 0.02 + start * eighth, long * eighth, note_number(name), velocity)
            for start, long, name, velocity in phrase
        ]
        bends += [(at + start * eighth, position) for start, position in WHEELS.get(called, ())]
        at += length + 0.25
    return score_of(notes, rate, bends, name="demo, techniques", controls=controls)
