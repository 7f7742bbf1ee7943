"""Exports strokes as a MIDI file for notation and other synthesizers: notes at sounding pitch, without key switches.

All notes have one channel, and so one staff. Only a note that moves while another one sounds has a channel of its own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from mido import Message

from livebass.tab import moves, perform
from livebass.tab.messages import FADE_CC, RELEASE, SEMITONES, Strings, beginning, conductor, file_of, track_of
from livebass.tab.model import Bar
from livebass.tab.perform import A_FRET, MIN_BEFORE, Performance, Stroke

SOFTER = 24  # velocities: dead notes, and notes of the left hand
MUTED = (perform.DEAD, "left slap")
LEGATO = (perform.HAMMER, perform.PULL, perform.SLIDE)
OFF = (perform.OFF_DOWN, perform.OFF_UP)
DEAD_LENGTH, PALM_LENGTH = 0.06, 0.2  # s that muted notes last at most
MODULATION_CC = 1
DB_A_DECADE = 40  # of velocities, in General MIDI
NEAR = 1e-3  # s


def to_plain_midi(
    performance: Performance, bars: Sequence[Bar], strings: Strings, dynamics: float
) -> tuple[bytes, Counter[str]]:
    """A Standard MIDI File of a performance, and how many of each sign it leaves out.

    `dynamics`, dB, change the force of every note.
    """
    lacks, lines = Counter(performance.lacks), [_Line(opened) for opened in strings.opens]
    for stroke, after in moves.following(performance.strokes):
        if sign := moves.missing(stroke, strings.frets):
            lacks[sign] += 1
        else:
            lines[stroke.string].play(stroke, after)
    notes = [note for line in lines for note in line.notes]
    factor = 10 ** (dynamics / DB_A_DECADE)
    for note in notes:
        note.velocity = min(max(round(note.velocity * factor), 1), 127)
    _share_channels(notes, len(strings.opens))
    tempos, moving = performance.tempos, moves.Moves(performance.tempos)
    events = beginning(strings.program, range(max((note.string for note in notes), default=0) + 1))
    for note in notes:
        begin = tempos.tick(note.time)
        events += [(move.tick, moves.CONTROL, _message(move, note.string)) for move in moving.of(note)]
        end = max(tempos.tick(note.end), begin + 1)
        for tick, rank, kind, velocity in (
            (begin, moves.BEGIN, "note_on", note.velocity), (end, moves.END, "note_off", RELEASE),
        ):  # fmt: skip
            events.append((tick, rank, Message(kind, channel=note.string, note=note.fret, velocity=velocity)))
    return file_of(conductor(performance, bars), track_of(events)), lacks


class _Line:
    """The notes of a string: their frets are keys, and a slide bends the note before it."""

    def __init__(self, opened: int) -> None:
        self.opened, self.notes = opened, list[Stroke]()
        self.last: Stroke | None = None

    def play(self, stroke: Stroke, after: Stroke | None) -> None:
        """Plays a stroke, before `after`."""
        last, self.last = self.last, stroke
        if stroke.kind in (perform.SLIDE, *OFF) and last is not None and stroke.time - last.end < NEAR:
            self._slide(last, stroke, after)
        elif stroke.kind not in OFF:
            self.notes.append(self._note(stroke))

    def _note(self, stroke: Stroke) -> Stroke:
        over = SEMITONES[stroke.partial] if stroke.kind in (perform.HARMONIC, perform.PINCH) else 0
        note = replace(stroke, fret=self.opened + stroke.fret + over)
        if stroke.kind in (*MUTED, *LEGATO):
            note.velocity -= SOFTER
        longest = DEAD_LENGTH if stroke.kind in MUTED else PALM_LENGTH if stroke.palm else note.end
        note.end = min(note.end, note.time + longest)
        return note

    def _slide(self, last: Stroke, stroke: Stroke, after: Stroke | None) -> None:
        """Slides from the `last` stroke, whose note ends where the new one begins."""
        before, begin, end, way = self.notes[-1], stroke.time, stroke.end, stroke.fret - last.fret
        arrival = begin + (stroke.slow or A_FRET * abs(way))
        struck = (
            after is not None
            and after.kind not in perform.TIED
            and after.fret == stroke.fret
            and after.time - end < NEAR
            and arrival > end - NEAR
        )
        nowhere = stroke.kind in OFF or struck
        arrival = end if nowhere else min(arrival, max(end - MIN_BEFORE, (begin + end) / 2))
        if not nowhere and last.kind not in perform.TIED and last.end - last.time < MIN_BEFORE - NEAR:  # slides in
            self.notes[-1] = note = self._note(replace(stroke, time=before.time, kind=before.kind))
            note.bend = ((begin, -way), (arrival, 0.0), *stroke.bend)
            return
        height = moves.height_at(before.bend, begin)
        before.bend = (*((time, y) for time, y in before.bend if time < begin), (begin, height), (arrival, float(way)))
        before.end = arrival
        if not nowhere:
            self.notes.append(self._note(replace(stroke, time=arrival)))


def _share_channels(notes: list[Stroke], channels: int) -> None:
    """Gives each note a channel as its string, and sorts them. There are as many `channels` as strings."""
    sounding = [list[Stroke]() for _ in range(channels)]
    notes.sort(key=lambda note: (note.time, note.fret))
    for note in notes:
        sounding = [[other for other in others if other.end - note.time > NEAR] for others in sounding]
        note.string = next(channel for channel, others in enumerate(sounding) if _fits(note, others))
        sounding[note.string].append(note)


def _fits(note: Stroke, others: Sequence[Stroke]) -> bool:
    """True if a note can share a channel with others that sound: none moves, and none has its key."""
    return not others or not (_moves(note) or any(_moves(other) or other.fret == note.fret for other in others))


def _moves(note: Stroke) -> bool:
    """True if controllers change a note's sound."""
    return bool(note.bend or note.vibrato or note.fade)


def _message(move: moves.Move, channel: int) -> Message:
    if move.what == moves.BEND:
        return Message("pitchwheel", channel=channel, pitch=move.value)
    number = MODULATION_CC if move.what == moves.VIBRATO else FADE_CC
    return Message("control_change", channel=channel, control=number, value=move.value)
