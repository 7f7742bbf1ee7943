"""Fills in what only its context tells of a note: its force under a hairpin, the neighbours of an ornament in the key.

A hairpin leads from its first note evenly to the next dynamic, or, without one that is louder (crescendo) or softer
(diminuendo), a mark further, from mf to f for example. An ornament turns to the next notes of the key.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from fractions import Fraction
from itertools import groupby

from livebass.tab.model import DYNAMICS, FORTE, SOFTEST, STEP, Beat, Note, Tab, velocity_of

TRILL = Fraction(1, 4)  # quarter notes, each note
# Steps of an ornament in the key, before the note's own pitch
ORNAMENTS = {"mordent": (0, -1), "inverted mordent": (0, 1), "turn": (1, 0, -1), "inverted turn": (-1, 0, 1)}
WAYS = {"crescendo": 1, "diminuendo": -1}


def fill_in(tab: Tab) -> Tab:
    """Completes the notes of a piece, in place."""
    for track in tab.tracks:
        opens = [note + track.capo for note in track.tuning]
        lines, at = defaultdict[int, list[tuple[Fraction, Beat]]](list), Fraction(0)  # by voice
        for bar, voices in zip(tab.bars, track.bars, strict=False):
            for voice, beats in enumerate(voices):
                lines[voice] += [(at + beat.at, beat) for beat in beats]
            at += bar.length
        for line in lines.values():
            _swell(line)
        for bar, voices in zip(tab.bars, track.bars, strict=False):
            for note in (note for beats in voices for beat in beats for note in beat.notes if note.ornament):
                if 0 <= note.string < len(opens):
                    _turn(note, opens[note.string] + note.fret, bar.fifths)
    return tab


def _swell(line: Sequence[tuple[Fraction, Beat]]) -> None:
    """Changes the velocities of the beats, at their places in a voice, under its hairpins."""
    forces, force = list[int](), FORTE
    for _, beat in line:
        force = beat.notes[0].velocity if beat.notes else force
        forces.append(force)
    for (kind, force), group in groupby(range(len(line)), lambda k: (line[k][1].hairpin, forces[k])):
        if not kind:
            continue
        numbers = list(group)
        begin, (end, last) = line[numbers[0]][0], line[numbers[-1]]
        after = next((forces[k] for k in range(numbers[-1] + 1, len(line)) if line[k][1].notes), force)
        goal = after if (after - force) * WAYS[kind] > 0 else force + WAYS[kind] * STEP
        goal = min(max(goal, SOFTEST), velocity_of(DYNAMICS[-1]))
        for k in numbers:
            part = (line[k][0] - begin) / (end + last.length - begin)
            for note in line[k][1].notes:
                note.velocity = min(max(round(note.velocity + part * (goal - force)), 1), velocity_of(DYNAMICS[-1]))


def _turn(note: Note, pitch: int, fifths: int) -> None:
    """Gives an ornament, on the MIDI note `pitch`, its frets."""
    scale = {7 * (fifths + k) % 12 for k in range(-1, 6)}
    up, down = (next(step for step in (way, 2 * way) if (pitch + step) % 12 in scale) for way in (1, -1))
    if note.ornament == "trill":
        note.trill = note.fret + up, TRILL
    else:
        note.turns = tuple(note.fret + (0, up, down)[step] for step in ORNAMENTS[note.ornament])
