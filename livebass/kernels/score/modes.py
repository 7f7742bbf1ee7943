"""Zones: the lines that mode messages make one instrument, a channel a string or a channel a note."""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.native import copy_record
from livebass.kernels.player.controls import DATA, NRPN, NRPN_FINE, RESET_CONTROLLERS, RPN, RPN_FINE
from livebass.kernels.player.messages import CONTROL, MONO, MPE_RPN, NOTE_ON
from livebass.kernels.player.performer import CHANNELS
from livebass.kernels.score.memory import NONE, events_of, kind_of, lines_of
from livebass.kernels.score.programs import begin_programs, is_bass_program, program_of, take_program

jit = compiled(attributes=SMALL)

UNSELECTED = 127  # instead of a parameter


@jit
def find_zone(score):
    """Finds the lines that modes join, and drops modes that the file cannot mean.

    It cannot mean them if some notes of these lines have a bass program, and some another.
    """
    rows, lines = events_of(score), lines_of(score)
    clear_selected(score)
    for k in range(score.events_count):
        first, stop = zone_of(lines, rows[k])
        if first != NONE:
            score.has_zone = 1
            lines[rows[k].line].zone = 1
        for line in range(first, stop):
            lines[line].zone = 1
    if score.has_zone == 1 and programs_contradict(score, rows):
        drop_modes(score, rows, lines)


@jit
def clear_selected(score):
    """Selects no parameter."""
    lines = lines_of(score)
    for k in range(score.lines_count):
        lines[k].high, lines[k].low = UNSELECTED, UNSELECTED


@jit
def zone_of(lines, row):
    """First line and end of those that a message joins, as the performer reads it; NONE: it joins none.

    Its own line belongs to them.
    """
    none = np.int64(NONE)
    if kind_of(row) != CONTROL:
        return none, none
    line, home, number, value = lines[row.line], np.int64(lines[row.line].home), row.first, np.int64(row.second)
    port = lines[home]
    if number == RPN:
        port.high = value
    elif number == RPN_FINE:
        port.low = value
    elif number in (NRPN_FINE, NRPN, RESET_CONTROLLERS):
        port.high, port.low = UNSELECTED, UNSELECTED
    elif number == MONO and value > 1:
        stop = home + np.int64(line.channel) + value
        return np.int64(row.line), stop if stop < home + CHANNELS else home + CHANNELS
    elif number == DATA and port.high == 0 and port.low == MPE_RPN and value > 1:
        members = value if value < CHANNELS else np.int64(CHANNELS - 1)
        first = home if line.channel == 0 else home + CHANNELS - 1 - members
        return first, first + members + 1
    return none, none


@jit
def programs_contradict(score, rows):
    """True if some notes of the zone have a bass program, and some another."""
    lines, bass, other = lines_of(score), 0, 0
    begin_programs(score, rows, score.events_count)
    for k in range(score.events_count):
        row = rows[k]
        take_program(score, row)
        if kind_of(row) == NOTE_ON and lines[row.line].zone == 1:
            program = program_of(score, lines[row.line])
            if is_bass_program(program):
                bass = 1
            elif program != NONE:
                other = 1
    return bass == 1 and other == 1


@jit
def drop_modes(score, rows, lines):
    """Drops the messages that join lines."""
    clear_selected(score)
    kept = 0
    for k in range(score.events_count):
        if zone_of(lines, rows[k])[0] == NONE:
            copy_record(rows[kept], rows[k])
            kept += 1
    score.events_count, score.has_zone = kept, 0
    for k in range(score.lines_count):
        lines[k].zone = 0
