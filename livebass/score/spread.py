"""Finds an instrument that spreads over the channels of a track, although no mode message says so.

MIDI guitars send a channel a string, MPE keyboards a channel a note. What they record often lacks the mode messages,
and a program. A track is such an instrument if its channels have no program, each has one note at a time, and either
all together have, too, or each bends its own notes.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from statistics import median
from typing import NamedTuple

from livebass.score.score import CHANNELS, CONTROL, NOTE_OFF, NOTE_ON, PRESSURE, PROGRAM, WHEEL, Event
from livebass.score.smf import Message

# A bass's range: most notes of a part lie within, half of them no higher than the middle
LOWEST, HIGHEST, MIDDLE, MOST = 16, 67, 50, 0.9  # E0, G4, D3; fraction of notes
OVERLAP = 0.06  # s, allowed overlap of notes in a line
MOST_OVERLAP = 0.25  # of the notes may overlap for longer
LEAST_BENT = 3  # channels that bend their own notes
MOST_STAYING = 0.1  # of the notes of MPE may be on the channel of the note before
TIMBRE = 74  # controller of MPE

Stroke = tuple[int, int, int]  # begin, end, key


class Spread(NamedTuple):
    """The lines of an instrument that spreads over the channels of a track."""

    lines: frozenset[int]  # with the master of MPE
    mode: tuple[Event, ...]  # that makes it MPE; empty: a channel a string


def is_low(keys: Collection[int]) -> bool:
    """True if these notes lie where a bass plays."""
    within = sum(LOWEST <= key <= HIGHEST for key in keys)
    return bool(keys) and within >= MOST * len(keys) and median(keys) <= MIDDLE


def spread(events: Sequence[Event], rate: int) -> Spread | None:
    """The lowest instrument that spreads over the channels of a track and lies in a bass's range."""
    with_programs = {event.line for event in events if event.message.kind == PROGRAM}
    playing: dict[int, set[int]] = defaultdict(set)  # tracks with notes, by line
    for event in events:
        if event.message.kind == NOTE_ON:
            playing[event.line].add(event.track)
    own_lines: dict[int, list[int]] = defaultdict(list)  # by track
    for line, tracks in sorted(playing.items()):
        for track in tracks:
            own_lines[track].append(line)
    wanted = {
        track: own
        for track, own in sorted(own_lines.items())
        if len(own) > 1
        and own[0] // CHANNELS == own[-1] // CHANNELS
        and not with_programs.intersection(own)
        and all(len(playing[line]) == 1 for line in own)
    }
    if not wanted:
        return None
    all_strokes, moved = _strokes(events, set().union(*wanted.values())), _moved(events)
    found: list[tuple[float, Spread]] = []
    for track, own in wanted.items():
        strokes = {line: all_strokes[line] for line in own}
        keys = [key for line in own for _, _, key in strokes[line]]
        if is_low(keys) and _is_one(strokes, moved, OVERLAP * rate):
            mode = _mode(strokes, track, playing)
            found.append((median(keys), Spread(frozenset([*own, *(event.line for event in mode)]), mode)))
    return min(found, key=lambda row: row[0])[1] if found else None


def _strokes(events: Iterable[Event], lines: Collection[int]) -> dict[int, list[Stroke]]:
    """(begin, end, key) of the notes of each line, by begin; notes without end take no time."""
    found: dict[int, list[Stroke]] = {line: [] for line in lines}
    begun: dict[tuple[int, int], int] = {}  # number of the last note of a key on its line
    for frame, m, _, line in events:
        if line not in found:
            continue
        if m.kind == NOTE_ON:
            begun[line, m.first] = len(found[line])
            found[line].append((frame, frame, m.first))
        elif m.kind == NOTE_OFF and (line, m.first) in begun:
            number = begun.pop((line, m.first))
            found[line][number] = (found[line][number][0], frame, m.first)
    return found


def _moved(events: Iterable[Event]) -> Counter[int]:
    """The number of messages that bend or colour the notes of each line."""
    moved: Counter[int] = Counter()
    for event in events:
        m = event.message
        moved[event.line] += m.kind in (WHEEL, PRESSURE) or (m.kind == CONTROL and m.first == TIMBRE)
    return moved


def _is_one(strokes: dict[int, list[Stroke]], moved: Mapping[int, int], overlap: float) -> bool:
    """True if each line has one note at a time, and either all lines together have, too, or each bends its own."""
    if not all(_is_single(own, overlap) for own in strokes.values()):
        return False
    if _is_single(sorted(stroke for own in strokes.values() for stroke in own), overlap):
        return True
    return len(strokes) >= LEAST_BENT and all(moved[line] >= len(own) for line, own in strokes.items())


def _is_single(strokes: Sequence[Stroke], overlap: float) -> bool:
    """True if most notes end when the next one begins."""
    overlapping = sum(end > begin + overlap for (_, end, _), (begin, _, _) in pairwise(strokes))
    return overlapping <= MOST_OVERLAP * len(strokes)


def _mode(strokes: dict[int, list[Stroke]], track: int, playing: Collection[int]) -> tuple[Event, ...]:
    """The messages that make the lines MPE if they look like it; else none, for a channel a string.

    In MPE the first channel has no notes, and the next note takes another channel. The lowest notes of strings rise or
    fall from channel to channel.
    """
    lines = sorted(strokes)
    port, last = lines[0] - lines[0] % CHANNELS, lines[-1] % CHANNELS
    lows = [min(key for _, _, key in strokes[line]) for line in lines]
    rise_or_fall = {(a < b) - (a > b) for a, b in pairwise(lows)} in ({1}, {-1})
    order = [line for *_, line in sorted((*stroke, line) for line, own in strokes.items() for stroke in own)]
    stays = sum(a == b for a, b in pairwise(order))
    others = any(line in playing and line not in strokes for line in range(port, port + last + 1))
    if len(lines) < LEAST_BENT or lines[0] == port or others or rise_or_fall or stays > MOST_STAYING * len(order):
        return ()
    sent = ((101, 0), (100, 6), (6, last), (101, 127), (100, 127))
    return tuple(Event(0, Message(CONTROL, *data), track, port) for data in sent)
