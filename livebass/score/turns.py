"""Basses that take turns: lines with a program each, such as slap for the verses and fingers for the choruses."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise

from livebass.score.lines import BASS_PROGRAMS, Note
from livebass.score.score import NOTE_OFF, PROGRAM, Event
from livebass.score.smf import Message
from livebass.score.spread import OVERLAP

LEAST_TURN = 4  # notes of a turn, on average
MOST_TOGETHER = 0.1  # of the notes may begin while another bass plays


def in_turns(events: Sequence[Event], chosen: Sequence[Note], rate: int) -> list[Event]:
    """The events with a program change at each turn but the first; none if the basses do not take turns."""
    programs = {note.line: note.program for note in chosen}
    alone = all(note.program in BASS_PROGRAMS and note.program == programs[note.line] for note in chosen)
    begins = [chosen[0], *(note for before, note in pairwise(chosen) if note.program != before.program)]
    if not alone or len(begins) < 2 or len(chosen) < LEAST_TURN * len(begins) or _together(events, chosen, rate):
        return []
    later = {note.place for note in begins[1:]}
    found = []
    for place, event in enumerate(events):
        if place in later:
            change = Message(PROGRAM | event.message.channel, programs[event.line] or 0)
            found.append(event._replace(message=change))
        if event.message.kind != PROGRAM:
            found.append(event)
    return found


def _together(events: Sequence[Event], chosen: Sequence[Note], rate: int) -> bool:
    """True if too many notes begin while a bass with another program plays."""
    programs = {note.place: note.program for note in chosen}
    down: dict[tuple[int, int], list[int]] = defaultdict(list)  # places of notes, by line and key
    ends: dict[int, int] = {}  # frames, by the places of notes
    for place, (frame, m, _, line) in enumerate(events):
        if place in programs:
            down[line, m.first].append(place)
        elif m.kind == NOTE_OFF:
            ends.update(dict.fromkeys(down.pop((line, m.first), ()), frame))
    until: dict[int | None, int] = {}  # frame at which each program is silent
    together = 0
    for note in chosen:
        begin = events[note.place].frame
        together += any(end > begin + OVERLAP * rate for program, end in until.items() if program != note.program)
        until[note.program] = max(until.get(note.program, 0), ends.get(note.place, begin))
    return together > MOST_TOGETHER * len(chosen)
