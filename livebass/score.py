"""Notes with times: a `Score` from a Standard MIDI File, from a list of notes, or a demo phrase.

A `Score` is clean by construction, whatever the file: at one frame, note-offs and controllers come before note-ons;
every note-on has its end, at least `BRIEF` seconds later; an end without a note is dropped; and of overlapping notes of
one pitch, the end of the earlier one does not cut the later one.

Standard MIDI Files are parsed here and not by a library, because the promises are stricter than a library's: every file
that keeps to the format is read (unknown chunks, escapes, odd texts and key signatures are passed over), and an error
in a file is reported with its track and byte.
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

from livebass.units import note_number

NOTE_OFF, NOTE_ON, PROGRAM = 0x8, 0x9, 0xC  # upper four bits of a status byte
DRUMS = 9  # channel 10, counted from 0
BASS_PROGRAMS = range(32, 40)  # General MIDI, counted from 0: the eight basses
BRIEF = 1e-3  # s, least length of a note: even a zero-length note sounds
LONGEST = 24 * 3600  # s, of a score
LARGEST = 64 << 20  # bytes of a MIDI file
LEAST_RATE, MOST_RATE = 8000, 192_000  # Hz
DEFAULT_TEMPO = 500_000  # us per quarter note, until a file sets another
SMPTE_RATES = {24: (24, 1), 25: (25, 1), 29: (30_000, 1001), 30: (30, 1)}  # frames/s as a fraction
META_END, META_TEMPO = 0x2F, 0x51

Event = tuple[int, bytes]  # (frame, status and one or two data bytes)


class ScoreError(ValueError):
    """A MIDI file that cannot be played. The message is one line: file, place, and what is allowed."""


class SmfError(ValueError):
    """Bytes that are not a Standard MIDI File, or not one that can be played. The message names the place."""


@dataclass(frozen=True, eq=False)
class Score:
    """The notes and controllers to play, as channel messages with times, all on one channel."""

    frames: NDArray[np.int64]  # (n,) sample frames at `rate`, ascending
    messages: NDArray[np.uint8]  # (n, 3) MIDI status and data; channel 0; unused data is 0
    end_frame: int  # of the last message, where the tail begins
    notes: int  # number of note-ons
    name: str  # of the piece, for messages
    rate: int  # Hz


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
    """The bass part of a Standard MIDI File (type 0 or 1) in frames at `rate` Hz.

    `channel` "auto" takes the notes played while their channel's program is 32 to 39 (the General MIDI basses); "all"
    takes every channel but 10, the drums; 1 to 16 takes that one. Controllers are taken from the channels of these
    notes. Raises ScoreError if the file cannot be played, and ValueError for a rate or channel that is not allowed.
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


def _file_bytes(path: Path) -> bytes:
    """The content of a regular file of at most LARGEST bytes. Raises ScoreError."""
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
    off_or_as_is = (
        (tick, bytes([m[0] - 0x10, m[1], 64]) if m[0] >> 4 == NOTE_ON and m[2] == 0 else m) for tick, m in smf.messages
    )
    return [(frame(tick), m) for tick, m in off_or_as_is], end


def _cleaned(events: list[Event], end: int, rate: int) -> list[Event]:
    """The events in the order of a `Score`, with exactly one note-off for each note."""
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
    # Controllers come first: a pedal pressed as a note ends holds it, and a bend is there before the next note begins.
    rank = {NOTE_OFF: 1, NOTE_ON: 2}
    return sorted(clean, key=lambda e: (e[0], rank.get(e[1][0] >> 4, 0)))


def note_ends(strokes: list[tuple[int, bool]], end: int, brief: int) -> list[int]:
    """Frames at which the notes of one key end. strokes: (frame, True for a note-on) in file order.

    A note-off ends the oldest note held; at its own frame, earlier notes before new ones. If the key has been struck
    again since and another note-off is still to come, the note-off ends nothing, and the new note sounds on. Notes
    still held end at frame `end`. A note lasts at least `brief` frames, unless its key is struck again before.
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
    """The events of the notes that `channel` chooses, and of their channels. Raises SmfError if there are none."""
    programs = [0] * 16
    kept: list[Event] = []
    sounding, chosen = set(), set()  # channels with notes, and with chosen notes
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
    """True if `channel` chooses a note on channel `where`, counted from 0, that plays `program`."""
    if channel == "auto":
        return where != DRUMS and program in BASS_PROGRAMS
    if channel == "all":
        return where != DRUMS
    return channel == where + 1


def _nothing_chosen(channel: str | int, sounding: list[int]) -> str:
    """Says why no note was chosen, and on which channels there are notes."""
    if not sounding:
        return "has no notes"
    there = f"notes are on channel {', '.join(str(c + 1) for c in sounding)}"
    if channel == "auto":
        return f"no bass notes: no channel uses programs 32-39; use --channel N or --channel all ({there})"
    return f"no notes on {'any channel but 10' if channel == 'all' else f'channel {channel}'} ({there})"


def _score(events: list[Event], name: str, rate: int) -> Score:
    """The score of cleaned events, all put on channel 0."""
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


@dataclass(frozen=True)
class Smf:
    """The content of a Standard MIDI File. Ticks count from the start of the file."""

    ticks_per_quarter: int  # 0 if time is in SMPTE frames
    ticks_per_second: tuple[int, int]  # numerator, denominator; (0, 1) if time is in quarter notes
    messages: tuple[tuple[int, bytes], ...]  # (tick, status and data) by tick, then track, then place in the track
    tempos: tuple[tuple[int, int], ...]  # (tick, us per quarter note) by tick
    end_tick: int  # of the track that ends last


class _Bytes:
    """A cursor over `data` up to `end`. Its errors name `place` and the byte."""

    def __init__(self, data: bytes, start: int, end: int, place: str) -> None:
        self.data, self.at, self.end, self.place = data, start, end, place

    def fail(self, what: str, at: int | None = None) -> SmfError:
        return SmfError(f"{self.place}, byte {self.at if at is None else at}: {what}")

    def take(self, count: int, what: str) -> bytes:
        """Reads `count` bytes; `what` they are is for the error."""
        if self.at + count > self.end:
            left = self.end - self.at
            raise self.fail(f"{what} of {count} bytes, {left} left: the file is truncated or damaged")
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self, what: str) -> int:
        """Reads a variable-length quantity, of at most 4 bytes."""
        start, value = self.at, 0
        for _ in range(4):
            byte = self.take(1, what)[0]
            value = value << 7 | byte & 0x7F
            if byte < 0x80:
                return value
        raise self.fail(f"{what} longer than the 4 bytes allowed", start)


def parse_smf(data: bytes) -> Smf:
    """Parses a Standard MIDI File of type 0 or 1. Raises SmfError, with track and byte, for anything else."""
    if not data:
        raise SmfError("the file is empty (0 bytes)")
    if data[:4] != b"MThd":
        raise SmfError("not a Standard MIDI File (it does not begin with MThd)")
    head = _Bytes(data, 4, len(data), "header")
    size = int.from_bytes(head.take(4, "header length"))
    if size < 6:
        raise SmfError(f"header, byte 4: header length {size}, allowed: 6 or more")
    body = head.take(size, "header")
    kind, count, division = (int.from_bytes(body[i : i + 2]) for i in (0, 2, 4))
    if kind not in (0, 1):
        raise SmfError(f"type {kind} MIDI file, allowed: type 0 (one track) or 1 (tracks together)")
    per_quarter, per_second = _division(division)
    messages: list[tuple[int, bytes]] = []
    tempos: list[tuple[int, int]] = []
    end = 0
    for number in range(1, count + 1):
        track = _next_track(head, number, count)
        end = max(end, _read_track(track, messages, tempos))
    messages.sort(key=lambda m: m[0])
    tempos.sort(key=lambda t: t[0])
    return Smf(per_quarter, per_second, tuple(messages), tuple(tempos), end)


def _division(word: int) -> tuple[int, tuple[int, int]]:
    """Ticks per quarter note and per second (numerator, denominator); the one not in use is zero."""
    if word & 0x8000 == 0:
        if word == 0:
            raise SmfError("header, byte 12: 0 ticks per quarter note, allowed: 1 to 32767")
        return word, (0, 1)
    frames, ticks = 256 - (word >> 8), word & 0xFF
    if frames not in SMPTE_RATES or ticks == 0:
        what = f"{frames} SMPTE frames of {ticks} ticks"
        raise SmfError(f"header, byte 12: {what}, allowed: 24, 25, 29 or 30 frames of 1 to 255 ticks")
    over, under = SMPTE_RATES[frames]
    return 0, (over * ticks, under)


def _next_track(file: _Bytes, number: int, count: int) -> _Bytes:
    """The bytes of the next MTrk chunk. Other chunks are passed over, as the format asks."""
    file.place = f"track {number} of {count}"
    while True:
        kind = file.take(4, "chunk name")
        size = int.from_bytes(file.take(4, "chunk length"))
        start = file.at
        file.take(size, "chunk")
        if kind == b"MTrk":
            return _Bytes(file.data, start, start + size, file.place)


def _read_track(track: _Bytes, messages: list[tuple[int, bytes]], tempos: list[tuple[int, int]]) -> int:
    """Appends the channel messages and tempos of a track; returns its last tick. An end mark may be missing."""
    tick, running = 0, 0
    while track.at < track.end:
        tick += track.number("delta time")
        start = track.at
        status = track.take(1, "event")[0]
        if status == 0xFF:
            kind = track.take(1, "meta event")[0]
            data = track.take(track.number("meta event length"), "meta event")
            if kind == META_END:
                break
            if kind == META_TEMPO:
                tempos.append((tick, _tempo(track, data, start)))
        elif status in (0xF0, 0xF7):
            track.take(track.number("system exclusive length"), "system exclusive")
        elif status > 0xEF:
            raise track.fail(f"status byte 0x{status:02X} is not allowed in a file", start)
        else:
            if status < 0x80:
                if running == 0:
                    raise track.fail(f"data byte 0x{status:02X} without a status byte before it", start)
                track.at = start
            else:
                running = status
            data = track.take(1 if running >> 4 in (0xC, 0xD) else 2, "message")
            if max(data) > 0x7F:
                raise track.fail(f"data byte 0x{max(data):02X} in a message, allowed: 0 to 0x7F", start)
            messages.append((tick, bytes([running]) + data))
    return tick


def _tempo(track: _Bytes, data: bytes, start: int) -> int:
    """Reads a tempo, us per quarter note."""
    tempo = int.from_bytes(data)
    if len(data) != 3 or tempo == 0:
        raise track.fail(f"tempo {tempo} in {len(data)} bytes, allowed: 1 to 16777215 us in 3 bytes", start)
    return tempo


# The demo phrases, in E minor, to hear a preset by: soft and hard notes on every string, a bend, repeated notes.
TEMPO = 112.0  # quarter notes per minute
STYLES = ("finger", "slap")

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
    """A phrase of about eight seconds at `rate` Hz, for a bass that is plucked ("finger") or slapped ("slap").

    Raises ValueError for another style.
    """
    if style not in STYLES:
        raise ValueError(f"style {style!r}: allowed are {', '.join(STYLES)}")
    rows, bends = (SLAP, SLAP_BENDS) if style == "slap" else (FINGER, FINGER_BENDS)
    sixteenth = 60 / TEMPO / 4
    return score_of(
        [(at * sixteenth, length * sixteenth, note_number(name), velocity) for at, length, name, velocity in rows],
        rate,
        [(at * sixteenth, position) for at, position in bends],
        name=f"demo, {style}",
    )
