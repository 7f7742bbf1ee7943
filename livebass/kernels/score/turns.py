"""Basses that take turns: lines with a program each, such as slap for the verses and fingers for the choruses."""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.native import words_at
from livebass.kernels.player.messages import NOTE_OFF, NOTE_ON
from livebass.kernels.score.memory import KEYS, NONE, clear_words, kind_of, lines_of, place_of
from livebass.kernels.score.programs import BASS_PROGRAMS, FIRST_BASS, is_bass_program
from livebass.kernels.score.spread import OVERLAP

jit = compiled(attributes=SMALL)

BASSES = len(BASS_PROGRAMS)
MIN_TURN = 4  # notes of a turn, on average
MAX_TOGETHER = 0.1  # of the notes may begin while another bass plays


@jit
def take_turns(score, rows, notes, count):
    """True if the basses take turns; marks, in place of program changes, the note that begins each turn but the first.

    `count` notes are among the messages `rows`.
    """
    lines, turns = lines_of(score), 1
    for n in range(count):
        lines[rows[notes[n].place].line].program = notes[n].program
    for n in range(count):
        note = notes[n]
        if not is_bass_program(note.program) or lines[rows[note.place].line].program != note.program:
            return False
        turns += 1 if n > 0 and notes[n - 1].program != note.program else 0
    if turns < 2 or count < MIN_TURN * turns or are_together(score, rows, notes, count):
        return False
    for k in range(score.sent_count):
        rows[k].mark = 0
    for n in range(1, count):
        if notes[n - 1].program != notes[n].program:
            rows[notes[n].place].mark = 1
    score.program = np.int64(notes[0].program)
    return True


@jit
def are_together(score, rows, notes, count):
    """True if too many notes begin while a bass with another program plays."""
    ends, until, together = words_at(score.words[0], count), score.counts, 0
    find_ends(score, rows, ends)
    until[:BASSES] = 0
    for n in range(count):
        begin, own = rows[notes[n].place].frame, notes[n].program - FIRST_BASS
        other = False
        for bass in range(BASSES):
            other = other or (bass != own and until[bass] > begin + OVERLAP * score.rate)
        together += 1 if other else 0
        until[own] = max(until[own], ends[n])
    return together > MAX_TOGETHER * count


@jit
def find_ends(score, rows, ends):
    """The frame at which each note ends; without an end, where it begins."""
    keys, n = score.lines_count * KEYS, 0
    clear_words(score.tables[0], keys)
    down, following = words_at(score.tables[0], keys), words_at(score.words[1], score.note_ons)
    for k in range(score.sent_count):
        row = rows[k]
        if kind_of(row) == NOTE_ON:
            ends[n] = row.frame
            following[n] = down[place_of(row)]
            down[place_of(row)] = n
            n += 1
        elif kind_of(row) == NOTE_OFF:
            note = down[place_of(row)]
            down[place_of(row)] = NONE
            while note != NONE:
                ends[note] = row.frame
                note = following[note]
