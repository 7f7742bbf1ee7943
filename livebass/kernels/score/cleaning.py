"""Cleans messages: each note gets one end.

A live player ends a key at its first note-off, however often it was struck (kernels/player): it cannot know whether
another will come. In a file the future is known: at one frame, note-offs and controllers come before note-ons; every
note-on has its end, at least BRIEF seconds later; an end without a note is dropped; and if notes of one pitch overlap,
the end of the earlier one does not cut the later one.
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.machine.elementary import round_even
from livebass.kernels.machine.native import copy_record, words_at
from livebass.kernels.player.messages import NOTE_OFF, NOTE_ON, RELEASE
from livebass.kernels.score.memory import (
    KEYS,
    NONE,
    cleaning_at,
    clear_words,
    is_note,
    kind_of,
    place_of,
    timed_at,
)
from livebass.kernels.score.sorting import fill_order, sort_by

jit = compiled(attributes=SMALL)

BRIEF = 1e-3  # s, the minimum length of a note: even a zero-length note sounds
CLEANING_TABLES, CLEANING_WORDS = 2, 4  # words for each line and key, and for each note
VELOCITY, PLACE = 7, 11  # bits of an end: channel above the velocity, and line and key


@entry("int64(int64)", SMALL)
def clean_messages(address):
    """Cleans the rows of a CLEANING; returns how many there are then, at most all without note-offs and two a note."""
    cleaning = cleaning_at(address)
    clean(cleaning)
    return cleaning.made


@jit
def clean(c):
    """Writes the messages of `c` in playing order, with exactly one note-off for each note."""
    rows = timed_at(c.rows, c.count)
    brief = brief_of(c.rate)
    keys = group_strokes(c, rows)
    table, found = words_at(c.table, c.lines * KEYS), words_at(c.found, c.lines * KEYS)
    c.ended = 0
    start = 0
    for k in range(keys):
        stop = table[found[k]]
        end_notes(c, rows, start, stop, brief)
        start = stop
    order = words_at(c.order, c.ended)
    fill_order(order, c.ended)
    sort_by(order, words_at(c.spare, c.ended), words_at(c.frames, c.ended), c.ended)
    write_clean(c, rows)


@jit
def brief_of(rate):
    """The minimum length of a note in frames."""
    return max(np.int64(1), np.int64(round_even(BRIEF * rate)))


@jit
def counts(c, row):
    """True if a message belongs to those to clean."""
    return c.marked == 0 or row.mark == 1


@jit
def group_strokes(c, rows):
    """Groups note-ons and note-offs by line and key, in the order in which the keys appear.

    Returns the number of keys. `found` has the keys, `table` where the strokes of each end.
    """
    clear_words(c.table, c.lines * KEYS)
    table, found = words_at(c.table, c.lines * KEYS), words_at(c.found, c.lines * KEYS)
    keys, total = 0, 0
    for k in range(c.count):
        if is_note(rows[k]) and counts(c, rows[k]):
            place = place_of(rows[k])
            if table[place] == NONE:
                table[place] = 0
                found[keys] = place
                keys += 1
            table[place] += 1
            total += 1
    start = 0
    for k in range(keys):
        count = table[found[k]]
        table[found[k]] = start
        start += count
    strokes = words_at(c.strokes, total)
    for k in range(c.count):
        if is_note(rows[k]) and counts(c, rows[k]):
            place = place_of(rows[k])
            strokes[table[place]] = k
            table[place] += 1
    return keys


@jit
def moment(rows, strokes, start, stop):
    """The strokes of one key at one frame, from `start`: where they end, and how many note-ons and note-offs."""
    k, ons, offs = start, 0, 0
    while k < stop and rows[strokes[k]].frame == rows[strokes[start]].frame:
        if kind_of(rows[strokes[k]]) == NOTE_ON:
            ons += 1
        else:
            offs += 1
        k += 1
    return k, ons, offs


@jit
def end_notes(c, rows, start, stop, brief):
    """Ends the notes of one key, whose strokes are those from `start` to `stop`.

    A note-off ends the oldest note held; at its own frame, earlier notes before new ones. If the key has been struck
    again since and another note-off will come, the note-off ends nothing, and the new note sounds on. Notes still held
    end at the end. A note lasts at least `brief` frames, unless its key is struck again sooner.
    """
    strokes, frames, begun = words_at(c.strokes, stop), words_at(c.frames, c.ended + stop - start), c.ended
    held, struck, at = 0, np.int64(0), start
    after, ons, offs = moment(rows, strokes, at, stop)
    while at < stop:
        frame = rows[strokes[at]].frame
        following, ons_next, offs_next = moment(rows, strokes, after, stop)
        early = min(offs, held)
        held -= early
        if early > 0 and not (held > 0 and (ons > 0 or offs_next > 0)):
            add_end(c, rows, strokes, at, early, max(frame, struck + brief))
            held = 0
        if ons > 0:
            if c.ended > begun and frames[c.ended - 1] > frame:
                frames[c.ended - 1] = frame
            late = min(offs - early, held + ons)
            held, struck = held + ons - late, frame
            if late > 0 and not (held > 0 and offs_next > 0):
                add_end(c, rows, strokes, at, early + late, frame + brief)
                held = 0
        at, after, ons, offs = after, following, ons_next, offs_next
    if held > 0:
        add_end(c, rows, strokes, start, 0, max(c.end, struck + brief))


@jit
def add_end(c, rows, strokes, at, number, frame):
    """Adds an end at `frame`, by note-off `number`, from 1, of those from `at`; 0: by none."""
    words_at(c.frames, c.ended + 1)[c.ended] = frame
    row = rows[strokes[at]]
    velocity = np.int64(RELEASE)
    k = at - 1
    for _ in range(number):
        k += 1
        while kind_of(rows[strokes[k]]) == NOTE_ON:
            k += 1
        velocity = np.int64(rows[strokes[k]].second)
    channel = np.int64(row.status) & 0x0F
    words_at(c.ends, c.ended + 1)[c.ended] = place_of(row) << PLACE | channel << VELOCITY | velocity
    c.ended += 1


@jit
def write_clean(c, rows):
    """Writes controllers, ends and notes, frame by frame."""
    frames, order, at, end = words_at(c.frames, c.ended), words_at(c.order, c.ended), 0, 0
    c.made = 0
    while at < c.count or end < c.ended:
        frame = rows[at].frame if at < c.count else frames[order[end]]
        if end < c.ended:
            frame = min(frame, frames[order[end]])
        stop = at
        while stop < c.count and rows[stop].frame == frame:
            stop += 1
        for k in range(at, stop):
            if not is_note(rows[k]) and counts(c, rows[k]):
                write_row(c, rows[k])
        while end < c.ended and frames[order[end]] == frame:
            write_end(c, frame, words_at(c.ends, c.ended)[order[end]])
            end += 1
        for k in range(at, stop):
            if kind_of(rows[k]) == NOTE_ON and counts(c, rows[k]):
                write_row(c, rows[k])
        at = stop


@jit
def write_row(c, row):
    """Writes a message."""
    copy_record(timed_at(c.out, c.made + 1)[c.made], row)
    c.made += 1


@jit
def write_end(c, frame, end):
    """Writes a note-off."""
    row = timed_at(c.out, c.made + 1)[c.made]
    row.frame, row.line, row.track, row.part, row.mark = frame, end >> PLACE >> 7, 0, NONE, 0
    row.status, row.first, row.second = NOTE_OFF | end >> VELOCITY & 0x0F, end >> PLACE & 0x7F, end & 0x7F
    c.made += 1
