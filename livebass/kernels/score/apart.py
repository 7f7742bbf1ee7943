"""Tracks apart: messages on the lines of their tracks, and note-offs on the lines of the notes that they end."""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.native import copy_record, words_at
from livebass.kernels.player.messages import NOTE_OFF, NOTE_ON
from livebass.kernels.score.lines import goes_to, part_of
from livebass.kernels.score.memory import (
    KEYS,
    NONE,
    events_of,
    is_note,
    kind_of,
    lines_of,
    parts_of,
    place_of,
    timed_at,
)

jit = compiled(attributes=SMALL)


@jit
def copy_events(score):
    """Puts each message on the lines that it goes to."""
    rows, copies, lines, made = events_of(score), timed_at(score.copied, score.copies), lines_of(score), 0
    for k in range(score.events_count):
        row, line = rows[k], lines[rows[k].line]
        if line.split == 0:
            copy_record(copies[made], row)
            made += 1
            continue
        for part in range(line.first_part, line.first_part + line.parts):
            if goes_to(score, row, part):
                copy_record(copies[made], row)
                copies[made].line = parts_of(score)[part].line
                copies[made].part = part if row.part == part else NONE
                made += 1
    score.events, score.events_count = score.copied, made


@jit
def end_by_others(score):
    """Puts note-offs on the lines whose notes they end.

    A note-off that ends nothing on its line ends a note of the same key on another line that lacks one.
    """
    if not count_left(score):
        return
    list_wanting(score)
    rows, count = events_of(score), score.lines_count * KEYS
    held = words_at(score.tables[0], count)
    held[:] = 0
    for k in range(score.events_count):
        row = rows[k]
        if kind_of(row) == NOTE_ON:
            held[place_of(row)] += 1
        elif kind_of(row) == NOTE_OFF and held[place_of(row)] > 0:
            held[place_of(row)] -= 1
        elif kind_of(row) == NOTE_OFF:
            end_other(score, row, held)


@jit
def count_left(score):
    """Counts note-offs less note-ons by line and key; returns True if there are more of each somewhere."""
    rows, count = events_of(score), score.lines_count * KEYS
    left, more, fewer = words_at(score.tables[0], count), False, False
    left[:] = 0
    for k in range(score.events_count):
        if is_note(rows[k]):
            left[place_of(rows[k])] += 1 if kind_of(rows[k]) == NOTE_OFF else -1
    for k in range(count):
        more, fewer = more or left[k] > 0, fewer or left[k] < 0
    return more and fewer


@jit
def list_wanting(score):
    """Lists, for each key, the lines with more note-ons, in the order in which the key appears there."""
    rows, count = events_of(score), score.lines_count * KEYS
    left, following, met = (
        words_at(score.tables[0], count), words_at(score.tables[1], count), words_at(score.tables[2], count),
    )  # fmt: skip
    score.heads[:] = NONE
    last = score.counts
    for k in range(count):
        following[k], met[k] = NONE, 0
    for k in range(score.events_count):
        if not is_note(rows[k]):
            continue
        place, key = place_of(rows[k]), np.int64(rows[k].first)
        if left[place] < 0 and met[place] == 0:
            met[place] = 1
            if score.heads[key] == NONE:
                score.heads[key] = place
            else:
                following[last[key]] = place
            last[key] = place


@jit
def end_other(score, row, held):
    """Makes a note-off end a note on another line, if one wants it."""
    following = words_at(score.tables[1], score.lines_count * KEYS)
    place = score.heads[row.first]
    while place != NONE and held[place] == 0:
        place = following[place]
    if place != NONE:
        held[place] -= 1
        row.line = place // KEYS
        row.status = NOTE_OFF | np.int64(lines_of(score)[row.line].channel)
        row.part = part_of(score, row.line, row.track)
