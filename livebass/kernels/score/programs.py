"""The programs, banks and drums of notes; and which program a score begins with, and changes to."""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.player.messages import NOTE_ON
from livebass.kernels.score.kits import BANK, has_drums, reset_kits
from livebass.kernels.score.memory import (
    KEYS,
    NONE,
    PROGRAM,
    is_control,
    kind_of,
    lines_of,
    notes_at,
    timed_at,
)

jit = compiled(attributes=SMALL)

BASS_PROGRAMS = range(32, 40)  # General MIDI, counted from 0: the eight basses
FIRST_BASS, LAST_BASS = BASS_PROGRAMS[0], BASS_PROGRAMS[-1]
BASS_AND_LEAD = 87  # named for both: its notes tell which
# Mallets, free reeds, timpani, voices, brass, reeds, pipes and drums: of several parts that are called bass, the voice,
# the wind or the drum is the other
UNLIKE = np.zeros(KEYS, np.int64)
UNLIKE[8:16] = UNLIKE[20:24] = UNLIKE[52:55] = UNLIKE[56:80] = UNLIKE[112:120] = 1
UNLIKE[[47, 85, 91, 108, 109, 111]] = 1
SEVERAL = -2  # instead of a program


@jit
def is_bass_program(program):
    """True for a bass of General MIDI."""
    return FIRST_BASS <= program <= LAST_BASS


@jit
def begin_programs(score, rows, count):
    """Begins a pass over messages.

    A line with only one program has it from its first note on. A line of the zone without a program has the zone's.
    """
    lines, one = lines_of(score), NONE
    for k in range(score.lines_count):
        lines[k].program, lines[k].bank = NONE, NONE
    for k in range(count):
        if kind_of(rows[k]) == PROGRAM:
            line = lines[rows[k].line]
            line.program = rows[k].first if line.program == NONE or line.program == rows[k].first else SEVERAL
    for k in range(score.lines_count):
        if lines[k].zone == 1 and lines[k].program != NONE:
            one = lines[k].program if one == NONE or one == lines[k].program else SEVERAL
    for k in range(score.lines_count):
        if lines[k].program == SEVERAL:
            lines[k].program = NONE
    score.zone_program = one if one != SEVERAL else NONE


@jit
def take_program(score, row):
    """Takes a message that sets a program or a bank."""
    line = lines_of(score)[row.line]
    if kind_of(row) == PROGRAM:
        line.program = row.first
        if line.zone == 1:
            score.zone_program = np.int64(row.first)
    elif is_control(row, BANK):
        line.bank = row.second


@jit
def program_of(score, line):
    """The program of a line's next note; NONE: not yet set."""
    return score.zone_program if line.program == NONE and line.zone == 1 else np.int64(line.program)


@jit
def read_notes(score, address, count, notes_address):
    """Fills NOTE rows from `count` TIMED messages; returns their number."""
    rows, notes, lines, found = timed_at(address, count), notes_at(notes_address, score.note_ons), lines_of(score), 0
    begin_programs(score, rows, count)
    reset_kits(score)
    for k in range(count):
        row = rows[k]
        take_program(score, row)
        if kind_of(row) == NOTE_ON:
            line, note = lines[row.line], notes[found]
            drums = line.zone == 0 and has_drums(score, line, row.frame, row.track)
            note.place, note.part, note.key, note.chosen = k, row.part, row.first, 0
            note.program, note.bank, note.drums = program_of(score, line), line.bank, 1 if drums else 0
            found += 1
    return found


@jit
def choose_programs(score, rows, count, notes, notes_count):
    """Finds the program at the start of the chosen notes, and marks later changes.

    If lines begin with different programs, the one of most notes counts. Of several changes between two notes the last
    one counts, if it changes anything.
    """
    lines, ranked, n = lines_of(score), 0, 0
    score.counts[:] = 0
    order = score.heads  # programs by their first note
    for k in range(score.max_lines + 1):
        lines[k].waiting, lines[k].played, lines[k].changed = NONE, 0, 0
    for k in range(count):
        rows[k].mark = 0
        line = lines[score.max_lines if lines[rows[k].line].zone == 1 else np.int64(rows[k].line)]
        if kind_of(rows[k]) == PROGRAM:
            line.waiting = k
        elif kind_of(rows[k]) == NOTE_ON:
            ranked = count_program(score, rows, line, np.int64(notes[n].program), order, ranked)
            n += 1
    score.program = NONE
    maximum = 0
    for k in range(ranked):
        if score.counts[order[k] + 1] > maximum:
            maximum, score.program = score.counts[order[k] + 1], order[k]
    keep_changes(score, rows, count)


@jit
def count_program(score, rows, line, program, order, ranked):
    """Counts the program of a note of `line`; a change that waits for the note is marked."""
    if line.waiting != NONE and line.played == 1:
        rows[line.waiting].mark = 1
        line.changed = 1
    line.waiting = NONE
    line.played = 1
    if line.changed == 0:
        if score.counts[program + 1] == 0:
            order[ranked] = program
            ranked += 1
        score.counts[program + 1] += 1
    return ranked


@jit
def keep_changes(score, rows, count):
    """Unmarks changes to the program that plays already."""
    now = score.program
    for k in range(count):
        if rows[k].mark == 1:
            if rows[k].first == now:
                rows[k].mark = 0
            now = np.int64(rows[k].first)
