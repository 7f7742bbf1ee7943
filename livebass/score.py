"""Notes with times: a Standard MIDI File, or one note, as channel messages in sample frames.

A `Score` is clean by construction, whatever the file: at one frame note-offs and controllers come before
note-ons; every note-on has its end, at least `BRIEF` seconds later; an end without a note is dropped; and of
overlapping notes of one pitch the earlier one's end does not cut the later one.
"""

from __future__ import annotations

import operator
import os
import stat
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebass.smf import DEFAULT_TEMPO, Smf, SmfError, parse_smf

NOTE_OFF, NOTE_ON, PROGRAM = 0x8, 0x9, 0xC  # upper four bits of a status byte
DRUMS = 9  # channel 10, counted from 0: never a bass
BASS_PROGRAMS = range(32, 40)  # General MIDI, counted from 0: the eight basses
BRIEF = 1e-3  # s, least length of a note: a zero-length note still sounds
LONGEST = 24 * 3600  # s
LARGEST = 64 << 20  # bytes of a MIDI file
LEAST_RATE, MOST_RATE = 8000, 192_000  # Hz

Event = tuple[int, bytes]  # (frame, status and one or two data bytes)


class ScoreError(ValueError):
    """A MIDI file that cannot be played; one line with file, place and what is allowed."""


@dataclass(frozen=True, eq=False)
class Score:
    """What to play, on one channel."""

    frames: NDArray[np.int64]  # (n,) sample frames at `rate`, ascending
    messages: NDArray[np.uint8]  # (n, 3) MIDI status and data; channel 0; unused data is 0
    end_frame: int  # frame of the last message: where the tail begins
    notes: int  # note-ons among the messages
    name: str  # of the piece, for people
    rate: int  # Hz


def read_score(path: str | os.PathLike[str], rate: int, channel: str | int = "auto") -> Score:
    """The bass part of a Standard MIDI File (type 0 or 1) in frames at `rate` Hz.

    `channel` "auto" takes the notes played while their channel's program is 32 to 39 (the General MIDI
    basses); "all" takes every channel but 10, the drums; 1 to 16 takes that one. Controllers come along from
    the channels that have such notes. Raises ScoreError for the file, ValueError for another rate or channel.
    """
    checked_rate(rate)
    if channel not in ("auto", "all", *range(1, 17)):
        raise ValueError(f'channel {channel!r}: allowed are "auto", "all" and 1 to 16')
    path = Path(path)
    try:
        smf = parse_smf(_file_bytes(path))
        events, end = _timed(smf, rate)
        chosen = _selected(_cleaned(events, end, rate), channel)
    except SmfError as error:
        raise ScoreError(f"{path}: {error}") from None
    return _score(chosen, path.stem, rate)


def single_note(note: int, velocity: int, duration: float, rate: int) -> Score:
    """One note of `duration` s. `note` 0 to 127, `velocity` 1 to 127. Raises ValueError as `score_of` does."""
    return score_of([(0.0, duration, note, velocity)], rate, name=f"note {note}")


def score_of(
    notes: Iterable[tuple[float, float, int, int]],
    rate: int,
    bends: Iterable[tuple[float, float]] = (),
    name: str = "notes",
) -> Score:
    """A score from (start s, length s, note 0 to 127, velocity 1 to 127), in any order.

    `bends` are (time s, position -1 to 1 of the pitch wheel). Raises ValueError for values out of range, and for
    a rate that is not a whole number of Hz from LEAST_RATE to MOST_RATE.
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
        events += [(first, bytes([NOTE_ON << 4, note, velocity])), (last, bytes([NOTE_OFF << 4, note, 64]))]
    for time, position in bends:
        if not (0 <= time <= LONGEST and -1 <= position <= 1):
            raise ValueError(f"bend to {position} at {time} s: allowed are -1 to 1 and 0 to {LONGEST} s")
        wheel = round(8192 + 8191 * position)
        events.append((round(time * rate), bytes([0xE0, wheel & 0x7F, wheel >> 7])))
    events.sort(key=lambda e: e[0])
    return _score(_cleaned(events, 0, rate), name, rate)


def checked_rate(rate: int) -> None:
    """Raises ValueError unless `rate` is a whole number of Hz that an engine can run at."""
    if not (_whole(rate) and LEAST_RATE <= rate <= MOST_RATE):
        raise ValueError(f"rate {rate} Hz: allowed are whole numbers from {LEAST_RATE} to {MOST_RATE}")


def _whole(number: object) -> bool:
    """Whether it is an integer of any kind, numpy's among them."""
    try:
        operator.index(number)  # type: ignore[arg-type]
    except TypeError:
        return False
    return True


def _file_bytes(path: Path) -> bytes:
    try:
        kind = path.stat()
        if stat.S_ISDIR(kind.st_mode):
            raise ScoreError(f"{path}: is a directory, not a MIDI file")
        if not stat.S_ISREG(kind.st_mode):
            raise ScoreError(f"{path}: is not a regular file")
        if kind.st_size > LARGEST:
            raise ScoreError(f"{path}: {kind.st_size >> 20} MB, allowed: up to {LARGEST >> 20} MB")
        return path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        if isinstance(error, ScoreError):
            raise
        raise ScoreError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


def _frame_of(smf: Smf, rate: int) -> Callable[[int], int]:
    """Tick -> nearest frame, in integers, so that hours into a file nothing has drifted."""
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
    """Messages in frames, and the frame the file ends at; note-ons of velocity 0 become note-offs."""
    frame = _frame_of(smf, rate)
    end = frame(smf.end_tick)
    if end > LONGEST * rate:
        raise SmfError(f"lasts {end / rate / 3600:.4g} hours, allowed: up to {LONGEST // 3600}")
    off_or_as_is = (
        (tick, bytes([m[0] - 0x10, m[1], 64]) if m[0] >> 4 == NOTE_ON and m[2] == 0 else m)
        for tick, m in smf.messages
    )
    return [(frame(tick), m) for tick, m in off_or_as_is], end


def _cleaned(events: list[Event], end: int, rate: int) -> list[Event]:
    """The same events in the order of a `Score`, with one note-off for each note that ends."""
    keys: dict[tuple[int, int], list[tuple[int, bool]]] = defaultdict(list)
    clean: list[Event] = []
    for frame, m in events:
        if m[0] >> 4 in (NOTE_ON, NOTE_OFF):
            keys[m[0] & 0xF, m[1]].append((frame, m[0] >> 4 == NOTE_ON))
        if m[0] >> 4 != NOTE_OFF:
            clean.append((frame, m))
    for (channel, note), strokes in keys.items():
        for frame in note_ends(strokes, end, max(1, round(BRIEF * rate))):
            clean.append((frame, bytes([NOTE_OFF << 4 | channel, note, 64])))
    # Controllers first: a pedal pressed as a note ends holds it, a bend is there when the next note begins.
    rank = {NOTE_OFF: 1, NOTE_ON: 2}
    return sorted(clean, key=lambda e: (e[0], rank.get(e[1][0] >> 4, 0)))


def note_ends(strokes: list[tuple[int, bool]], end: int, brief: int) -> list[int]:
    """Frames at which one key's notes end, from its (frame, is a note-on) in file order.

    An off ends the oldest note held; at its frame, earlier notes before new ones. Where the key has been
    struck again since and another off is still to come, the off ends nothing: the new note sounds on.
    Whatever is still held ends at frame `end`. A note lasts `brief` frames at least, unless it is struck
    again before.
    """
    moments = []  # (frame, ons, offs)
    for frame, group in groupby(strokes, key=lambda s: s[0]):
        kinds = [on for _, on in group]
        moments.append((frame, sum(kinds), len(kinds) - sum(kinds)))
    ends: list[int] = []
    held, struck = 0, 0
    for (frame, ons, offs), (_, _, offs_next) in zip(moments, [*moments[1:], (end, 0, 0)], strict=True):
        early = min(offs, held)
        held -= early
        if early and not (held and (ons or offs_next)):
            ends.append(max(frame, struck + brief))
            held = 0
        if ons:
            if ends and ends[-1] > frame:
                ends[-1] = frame
            late = min(offs - early, held + ons)
            held, struck = held + ons - late, frame
            if late and not (held and offs_next):
                ends.append(frame + brief)
                held = 0
    return ends + [max(end, struck + brief)] * bool(held)


def _selected(events: list[Event], channel: str | int) -> list[Event]:
    """The events of the chosen notes and of their channels; SmfError where there is no such note."""
    programs = [0] * 16
    kept: list[Event] = []
    sounding, chosen = set(), set()  # channels with notes, with chosen notes
    for frame, m in events:
        kind, where = m[0] >> 4, m[0] & 0xF
        if kind == PROGRAM:
            programs[where] = m[1]
        elif kind == NOTE_ON:
            sounding.add(where)
            if not _wanted(channel, where, programs[where]):
                continue
            chosen.add(where)
        kept.append((frame, m))
    if not chosen:
        raise SmfError(_nothing_chosen(channel, sorted(sounding)))
    return [(frame, m) for frame, m in kept if m[0] & 0xF in chosen]


def _wanted(channel: str | int, where: int, program: int) -> bool:
    if channel == "auto":
        return where != DRUMS and program in BASS_PROGRAMS
    if channel == "all":
        return where != DRUMS
    return channel == where + 1


def _nothing_chosen(channel: str | int, sounding: list[int]) -> str:
    if not sounding:
        return "has no notes"
    there = f"notes are on channel {', '.join(str(c + 1) for c in sounding)}"
    if channel == "auto":
        return f"no bass notes: no channel uses programs 32-39; use --channel N or --channel all ({there})"
    return f"no notes on {'any channel but 10' if channel == 'all' else f'channel {channel}'} ({there})"


def _score(events: list[Event], name: str, rate: int) -> Score:
    """Events as arrays, all on channel 0."""
    messages = np.zeros((len(events), 3), np.uint8)
    for row, (_, m) in zip(messages, events, strict=True):
        row[: len(m)] = list(m)
        row[0] &= 0xF0
    return Score(
        frames=np.array([frame for frame, _ in events], np.int64),
        messages=messages,
        end_frame=max((frame for frame, _ in events), default=0),
        notes=int(np.count_nonzero(messages[:, 0] >> 4 == NOTE_ON)),
        name=name,
        rate=rate,
    )
