"""Notes with times: a `Score`, from a list of notes or cleaned events.

A live player ends a key at its first note-off, however often it was struck (kernels/player): it cannot know whether
another will come. In a file the future is known, so it is cleaned: at one frame, note-offs and controllers come before
note-ons; every note-on has its end, at least `BRIEF` seconds later; an end without a note is dropped; and if notes of
one pitch overlap, the end of the earlier one does not cut the later one.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import groupby
from numbers import Integral
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebass.bounds import between, refusal, within
from livebass.score.smf import Message

# Kinds of messages
NOTE_OFF, NOTE_ON, CONTROL, PROGRAM, PRESSURE, WHEEL = 0x80, 0x90, 0xB0, 0xC0, 0xD0, 0xE0
CHANNELS = 16
RELEASE = 64  # velocity of a note-off without its own
BRIEF = 1e-3  # s, least length of a note: even a zero-length note sounds
LONGEST = 24 * 3600  # s, of a score
LEAST_RATE, MOST_RATE = 8000, 192_000  # Hz


class Event(NamedTuple):
    """A channel message with its time. A line has one channel; its messages belong together."""

    frame: int
    message: Message
    track: int = 0  # of the file, from 0
    line: int = 0  # a note ends by a note-off of its own line


@dataclass(frozen=True)
class TakenBass:
    """A bass that a take names, and where it starts to play."""

    frame: int
    program: int  # selects it in the score, from 0
    preset: str  # a name or a path, which need not exist
    given: Mapping[str, str]  # options of `livebass play` that changed it, by name, as typed
    file: str = ""  # the text of a preset file, as it was; "": not kept


@dataclass(frozen=True, eq=False)
class Score:
    """The notes and controllers to play, as channel messages with times.

    It keeps a program change only after the first note, and if it changes the program.
    """

    frames: NDArray[np.int64]  #: (n,) sample frames at `rate`, ascending
    messages: NDArray[np.uint8]  #: (n, 3) MIDI status and data; unused data is 0
    end_frame: int  #: of the last message, where the tail begins
    notes: int  #: number of note-ons
    name: str  #: of the piece, for messages
    rate: int  #: Hz
    program: int | None = None  #: first General MIDI program of a file, from 0; None: the file sets none
    remarks: tuple[str, ...] = ()  #: a line each: harmless damage in the file, and the chosen parts
    basses: tuple[TakenBass, ...] = ()  #: named in a take: chosen by `program` and the program changes
    file_end: int = 0  #: frame at the end of the file, including other parts; 0: no file
    foreign: bool = False  #: read from a file that is not a livebass take: its low keys may be notes (low_keys.py)
    raised: int = 0  #: notes that were too low and moved up by octaves
    left_out: int = 0  #: key switches of another instrument (low_keys.py)
    beats: tuple[tuple[int, bool], ...] = ()  #: (frame, whether a bar begins) of each beat, if the file has bars

    @property
    def changes(self) -> list[tuple[int, int]]:
        """(frame, program from 0) of the program changes after the first note."""
        changed = self.messages[:, 0] & 0xF0 == PROGRAM
        return list(zip(self.frames[changed].tolist(), self.messages[changed, 1].tolist(), strict=True))

    def on_one_bass(self) -> Score:
        """Returns the score without its program changes and the basses that they choose."""
        kept = self.messages[:, 0] & 0xF0 != PROGRAM
        return replace(self, frames=self.frames[kept], messages=self.messages[kept], basses=())


def single_note(note: int, velocity: int, duration: float, rate: int) -> Score:
    """Returns a score of one note.

    Args:
        note: MIDI note, 0 to 127; C4 is 60.
        velocity: 1 to 127.
        duration: Seconds until the note-off.
        rate: Sample rate of the frames in the score, Hz.

    Raises:
        ValueError: As `score_of`.

    Example:
        >>> single_note(28, 100, 0.5, 48000).messages
        array([[144,  28, 100],
               [128,  28,  64]], dtype=uint8)
    """
    return score_of([(0.0, duration, note, velocity)], rate, name=f"note {note}")


def score_of(
    notes: Iterable[tuple[float, float, int, int]],
    rate: int,
    bends: Iterable[tuple[float, float]] = (),
    name: str = "notes",
    controls: Iterable[tuple[float, int, int]] = (),
) -> Score:
    """Returns a score of notes that you list.

    Args:
        notes: (start in s, length in s, MIDI note 0 to 127, velocity 1 to 127) of each note, in any order.
        rate: Sample rate of the frames in the score, a whole number of Hz from 8000 to 192 000.
        bends: (time in s, position -1 to 1) of each move of the pitch wheel.
        name: Name of the piece, for messages.
        controls: (time in s, controller 0 to 127, value 0 to 127) of each controller message.

    Raises:
        ValueError: A value out of these limits.

    Example:
        >>> score = score_of([(0.0, 0.25, 28, 100), (0.5, 0.25, 33, 80)], rate=48000)
        >>> score.notes, score.end_frame
        (2, 36000)
    """
    checked_rate(rate)
    events: list[Event] = []
    for start, length, note, velocity in notes:
        _check_whole("note", note, 0, 127)
        _check_whole("velocity", velocity, 1, 127)
        within("start of a note", start, 0, LONGEST, "s")
        within("length of a note", length, 0, LONGEST, "s")
        first = round(start * rate)
        last = round((start + length) * rate)
        events += [Event(first, Message(NOTE_ON, note, velocity)), Event(last, note_off(0, note, RELEASE))]
    for time, position in bends:
        within("time of a bend", time, 0, LONGEST, "s")
        within("bend", position, -1, 1)
        high, low = divmod(round(8192 + 8191 * position), 128)
        events.append(Event(round(time * rate), Message(WHEEL, low, high)))
    for time, number, value in controls:
        within("time of a controller", time, 0, LONGEST, "s")
        _check_whole("controller", number, 0, 127)
        _check_whole("value of a controller", value, 0, 127)
        events.append(Event(round(time * rate), Message(CONTROL, number, value)))
    events.sort(key=lambda e: e.frame)
    return score_from(cleaned(events, 0, rate), name, rate)


def checked_rate(rate: int) -> None:
    """Raises ValueError unless `rate` is a whole number of Hz from LEAST_RATE to MOST_RATE."""
    _check_whole("rate", rate, LEAST_RATE, MOST_RATE, "Hz")


def _check_whole(name: str, number: object, least: int, most: int, unit: str = "") -> None:
    """Raises ValueError unless `number` is an integer of any kind, numpy's included, within its limits."""
    if not (isinstance(number, Integral) and least <= int(number) <= most):
        raise refusal(name, between(least, most, unit, whole=True), f"{number} {unit}".rstrip())


def note_off(channel: int, note: int, velocity: int) -> Message:
    return Message(NOTE_OFF | channel, note, velocity)


def cleaned(events: list[Event], end: int, rate: int) -> list[Event]:
    """The events in the order of a `Score`, with exactly one note-off for each note."""
    keys: dict[tuple[int, int, int], list[tuple[int, bool, int]]] = defaultdict(list)
    clean: list[Event] = []
    for event in events:
        m = event.message
        if m.kind in (NOTE_ON, NOTE_OFF):
            keys[event.line, m.channel, m.first].append((event.frame, m.kind == NOTE_ON, m.second))
        if m.kind != NOTE_OFF:
            clean.append(event)
    for (line, channel, note), strokes in keys.items():
        for frame, velocity in note_ends(strokes, end, max(1, round(BRIEF * rate))):
            clean.append(Event(frame, note_off(channel, note, velocity), 0, line))
    # Controllers come first: a pedal pressed as a note ends holds it, and a bend acts before the next note begins.
    rank = {NOTE_OFF: 1, NOTE_ON: 2}
    return sorted(clean, key=lambda e: (e.frame, rank.get(e.message.kind, 0)))


def note_ends(strokes: list[tuple[int, bool, int]], end: int, brief: int) -> list[tuple[int, int]]:
    """(frame, release velocity) at which the notes of one key end.

    strokes: (frame, True for a note-on, velocity) in file order.

    A note-off ends the oldest note held; at its own frame, earlier notes before new ones. If the key has been struck
    again since and another note-off will come, the note-off ends nothing, and the new note sounds on. Notes still held
    end at frame `end`. A note lasts at least `brief` frames, unless its key is struck again sooner.
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


def score_from(
    events: list[Event], name: str, rate: int, program: int | None = None, remarks: tuple[str, ...] = ()
) -> Score:
    """The score of cleaned events, or of a take's."""
    messages = np.zeros((len(events), 3), np.uint8)
    for row, event in zip(messages, events, strict=True):
        row[:] = event.message
    return Score(
        frames=np.array([event.frame for event in events], np.int64),
        messages=messages,
        end_frame=max((event.frame for event in events), default=0),
        notes=int(np.count_nonzero(messages[:, 0] & 0xF0 == NOTE_ON)),
        name=name,
        rate=rate,
        program=program,
        remarks=remarks,
    )
