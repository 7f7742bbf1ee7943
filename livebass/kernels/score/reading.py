"""The C functions that read a score, in this order.

1. The shell fills FILE and the rows that SCORE names. `measure_lines` sets `bytes`, the size of `memory`.
2. `read_lines` finds lines, zones and tunings, and sets `more_bytes`, the size of `more`; returns TOO_LONG, TOO_MUCH
   or 0.
3. `read_parts_of` cleans the messages and finds the parts, `parts_count` of them.
4. `choose_notes` chooses notes, as often as wanted: `played_count` PLAYED at `played`, `program`, `end`, and
   `remarks_count` REMARK at `remarks`. `describe_part` lists a part of the last choice.

`memory` and `more` together take about 150 bytes a message. If tracks share a channel but have programs of their own, a
message of another track there counts once for each of them: TOO_MUCH says that there are more than MAX_EVENTS then, or
more than MAX_PARTS parts.
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.machine.native import copy_record, words_at
from livebass.kernels.player.messages import NOTE_OFF, NOTE_ON, RELEASE
from livebass.kernels.player.performer import CHANNELS
from livebass.kernels.score import memory
from livebass.kernels.score.apart import copy_events, end_by_others
from livebass.kernels.score.choosing import choose, group_notes, list_part
from livebass.kernels.score.cleaning import clean
from livebass.kernels.score.lines import (
    MAX_PARTS,
    count_notes,
    drop_portamento,
    end_soon,
    fill_events,
    fill_exclusives,
    find_basses,
    find_parts,
    find_programs,
    make_lines,
    rank_ports,
    set_apart,
)
from livebass.kernels.score.modes import find_zone
from livebass.kernels.score.programs import choose_programs, read_notes
from livebass.kernels.score.records import REMARK
from livebass.kernels.score.smf import MAX_EVENTS
from livebass.kernels.score.spread import MODE_MESSAGES, join_spread
from livebass.kernels.score.times import find_times, frame_of
from livebass.kernels.score.tunings import remark_tunings
from livebass.kernels.score.turns import take_turns

jit = compiled(attributes=SMALL)

LINE_REMARKS = 4  # at most
SEGMENT_SIZE, SENT_SIZE, LINE_SIZE, PART_SIZE = (
    memory.SEGMENT.itemsize,
    memory.SENT.itemsize,
    memory.LINE.itemsize,
    memory.PART.itemsize,
)
TRACK_SIZE, TIMED_SIZE, NOTE_SIZE, PLAYED_SIZE = (
    memory.TRACK.itemsize,
    memory.TIMED.itemsize,
    memory.NOTE.itemsize,
    memory.PLAYED.itemsize,
)
REMARK_SIZE = REMARK.itemsize


@entry("int64(int64)", SMALL)
def measure_lines(address):
    """Counts what the file has for the SCORE at an address; returns `bytes`."""
    score = memory.score_at(address)
    ports, score.note_ons = rank_ports(score)
    score.lines_count = CHANNELS * ports
    score.max_parts = min(score.note_ons, score.lines_count * memory.file_at(score.file).tracks)
    score.max_lines = score.lines_count + score.max_parts
    score.memory = 0
    lay_out_lines(score)
    score.bytes = score.free
    return score.bytes


@jit
def lay_out_lines(score):
    """Divides `memory`."""
    file = memory.file_at(score.file)
    score.free = score.memory
    score.segments = memory.take_memory(score, SEGMENT_SIZE * (file.tempos + 1))
    score.events = memory.take_memory(score, TIMED_SIZE * (MODE_MESSAGES + file.messages)) + TIMED_SIZE * MODE_MESSAGES
    score.sent_exclusives = memory.take_memory(score, SENT_SIZE * file.exclusives)
    score.lines = memory.take_memory(score, LINE_SIZE * (score.max_lines + 1))
    score.parts = memory.take_memory(score, PART_SIZE * score.max_parts)
    score.tracks = memory.take_memory(score, TRACK_SIZE * file.tracks)
    score.remarks = memory.take_memory(score, REMARK_SIZE * (LINE_REMARKS + score.max_parts + memory.MAX_BASSES))
    score.tables[0] = memory.take_memory(score, memory.WORD * memory.KEYS * score.lines_count)
    for k in range(len(score.words)):
        score.words[k] = memory.take_memory(score, memory.WORD * max(score.note_ons, file.exclusives))


@entry("int64(int64)", SMALL)
def read_lines(address):
    """Finds the lines of the SCORE at an address; returns 0, TOO_LONG or TOO_MUCH."""
    score = memory.score_at(address)
    lay_out_lines(score)
    score.error, score.remarks_count, score.has_zone, score.parts_count, score.splits = 0, 0, 0, 0, 0
    find_times(score)
    make_lines(score)
    fill_events(score)
    if not end_soon(score):
        score.error = memory.TOO_LONG
        return score.error
    fill_exclusives(score)
    find_parts(score)
    if score.parts_count > MAX_PARTS:
        score.error = memory.TOO_MUCH
        return score.error
    if score.take == 1:
        lines, score.has_zone, score.copies = memory.lines_of(score), 1, score.events_count
        for k in range(score.lines_count):
            lines[k].zone = 1
    else:
        find_instruments(score)
    if score.copies > MAX_EVENTS:
        score.error = memory.TOO_MUCH
        return score.error
    score.line_remarks = score.remarks_count
    count_notes(score)
    score.more = 0
    lay_out_notes(score)
    score.more_bytes = score.free
    return np.int64(0)


@jit
def find_instruments(score):
    """Finds zones and drums, and sets tracks apart."""
    find_basses(score)
    find_zone(score)
    remark_tunings(score)
    find_programs(score)
    if score.has_zone == 0:
        join_spread(score)
    drop_portamento(score)
    set_apart(score)


@jit
def lay_out_notes(score):
    """Divides `more`."""
    c, notes = score.cleaning, score.note_ons
    maximum = score.copies + notes - (0 if score.take == 1 else score.note_offs)
    score.free = score.more
    score.copied = memory.take_memory(score, TIMED_SIZE * score.copies) if score.splits > 0 else score.events
    for k in range(len(score.tables)):
        score.tables[k] = memory.take_memory(score, memory.WORD * memory.KEYS * score.lines_count)
    c.strokes = memory.take_memory(score, memory.WORD * score.copies)
    score.clean = memory.take_memory(score, TIMED_SIZE * maximum)
    score.all_notes = memory.take_memory(score, NOTE_SIZE * notes)
    score.of_part = memory.take_memory(score, memory.WORD * notes)
    score.sent = memory.take_memory(score, TIMED_SIZE * maximum)
    score.sent_notes = memory.take_memory(score, NOTE_SIZE * notes)
    score.played = memory.take_memory(score, PLAYED_SIZE * (maximum + notes))


@entry("int64(int64)", SMALL)
def read_parts_of(address):
    """Finds the notes and parts of the SCORE at an address, after `read_lines`; returns `parts_count`."""
    score = memory.score_at(address)
    lay_out_notes(score)
    if score.take == 1:
        end_take(score)
    else:
        if score.splits > 0:
            copy_events(score)
        end_by_others(score)
        score.clean_count = clean_events(score, score.clean, 0)
    read_notes(score, score.clean, score.clean_count, score.all_notes)
    group_notes(score)
    return score.parts_count


@jit
def clean_events(score, out, marked):
    """Cleans the messages, or the marked ones, to the address `out`; returns their number."""
    c = score.cleaning
    c.rate, c.rows, c.count, c.marked, c.lines = score.rate, score.events, score.events_count, marked, score.lines_count
    c.end, c.out, c.table, c.found = score.end, out, score.tables[0], score.tables[1]
    c.frames, c.ends, c.order, c.spare = score.words[0], score.words[1], score.words[2], score.words[3]
    clean(c)
    return c.made


@jit
def end_take(score):
    """Copies a take's messages, and adds a note-off at the end for each key that is still down."""
    rows, count, keys = memory.events_of(score), score.events_count, CHANNELS * memory.KEYS
    memory.clear_words(score.tables[0], keys)
    clean_rows, down = memory.timed_at(score.clean, count + score.note_ons), words_at(score.tables[0], keys)
    for k in range(count):
        copy_record(clean_rows[k], rows[k])
        if memory.is_note(rows[k]):
            key = (np.int64(rows[k].status) & 0x0F) * memory.KEYS + np.int64(rows[k].first)
            down[key] = 1 if memory.kind_of(rows[k]) == NOTE_ON else memory.NONE
    end = max(score.end, rows[count - 1].frame) if count > 0 else score.end
    for place in range(keys):
        if down[place] == 1:
            row = clean_rows[count]
            row.frame, row.line, row.track, row.part, row.mark = end, place // memory.KEYS, 0, memory.NONE, 0
            row.status, row.first, row.second = NOTE_OFF | place // memory.KEYS, place % memory.KEYS, RELEASE
            count += 1
    score.clean_count = count


@entry("int64(int64, int64, int64)", SMALL)
def choose_notes(address, how, number):
    """Chooses notes of the SCORE at an address: AUTO, ALL, OF_CHANNEL or OF_PART `number`, from 0.

    Returns how many are chosen; if there are any, or in a take, `played` has what to play.
    """
    score = memory.score_at(address)
    choose(score, how, number)
    score.played_count, score.notes, score.program = 0, 0, memory.NONE
    if score.chosen > 0 or score.take == 1:  # a take may have strokes without notes
        hear_lines(score)
        if score.alone == 1:
            mark_alone(score)
            score.sent_count = clean_events(score, score.sent, 1)
        else:
            copy_chosen(score)
        rows, notes = memory.timed_at(score.sent, score.sent_count), memory.notes_at(score.sent_notes, score.note_ons)
        score.notes = read_notes(score, score.sent, score.sent_count, score.sent_notes)
        choose_programs(score, rows, score.sent_count, notes, score.notes)
        turns = score.take == 0 and take_turns(score, rows, notes, score.notes)
        play(score, rows, turns)
    return score.chosen


@jit
def hear_lines(score):
    """Finds the lines of the chosen notes, and those whose controllers and programs are for them."""
    lines, parts, zone = memory.lines_of(score), memory.parts_of(score), score.take
    for k in range(score.lines_count):
        lines[k].chosen = 0
    for k in range(score.parts_count):
        if parts[k].chosen > 0:
            lines[parts[k].line].chosen = 1
            zone |= lines[parts[k].line].zone
    for k in range(score.lines_count):
        lines[k].heard = 1 if lines[k].chosen == 1 or (zone == 1 and lines[k].zone == 1) else 0


@jit
def mark_alone(score):
    """Marks the messages of whole parts: not those of other parts on their lines."""
    rows, lines, parts = memory.events_of(score), memory.lines_of(score), memory.parts_of(score)
    for k in range(score.events_count):
        row = rows[k]
        own = row.part != memory.NONE and parts[row.part].chosen > 0
        shared = row.part == memory.NONE and not memory.is_note(row) and lines[row.line].heard == 1
        row.mark = 1 if own or shared else 0


@jit
def copy_chosen(score):
    """Copies the messages of the chosen notes and of their lines."""
    rows, lines, n, count = memory.timed_at(score.clean, score.clean_count), memory.lines_of(score), 0, 0
    notes, sent = memory.notes_at(score.all_notes, score.note_ons), memory.timed_at(score.sent, score.clean_count)
    for k in range(score.clean_count):
        row = rows[k]
        line = lines[row.line]
        if memory.kind_of(row) == NOTE_ON:
            kept = notes[n].chosen == 1
            n += 1
        elif memory.kind_of(row) == NOTE_OFF and score.take == 0:
            kept = line.chosen == 1
        else:
            kept = line.heard == 1
        if kept:
            copy_record(sent[count], row)
            count += 1
    score.sent_count = count


@jit
def play(score, rows, turns):
    """Writes the messages to play, with a channel for each line and the program changes that count."""
    lines, count = memory.lines_of(score), 0
    played = memory.played_at(score.played, score.sent_count + score.notes)
    set_channels(score, rows, turns)
    for k in range(score.sent_count):
        row = rows[k]
        to = np.int64(lines[row.line].to)
        if turns and row.mark == 1:
            set_played(played[count], row.frame, memory.PROGRAM | to, np.int64(lines[row.line].program), 0)
            count += 1
        if is_sent(row, turns):
            set_played(played[count], row.frame, memory.kind_of(row) | to, np.int64(row.first), np.int64(row.second))
            count += 1
    score.played_count = count


@jit
def set_played(played, frame, status, first, second):
    """Sets a message to play."""
    played.frame, played.status, played.first, played.second = frame, status, first, second


@jit
def is_sent(row, turns):
    """True unless a message is a program change that does not count."""
    return memory.kind_of(row) != memory.PROGRAM or (row.mark == 1 and not turns)


@jit
def set_channels(score, rows, turns):
    """Gives each line that plays a channel: its own, or a free one if another line has it; the zone comes first."""
    lines, taken = memory.lines_of(score), np.int64(0)
    for k in range(score.lines_count):
        lines[k].sent = 0
    for k in range(score.sent_count):
        if is_sent(rows[k], turns):
            lines[rows[k].line].sent = 1
    for zone in (1, 0):
        for k in range(score.lines_count):
            line = lines[k]
            if line.sent == 1 and line.zone == zone:
                line.to = free_channel(taken, np.int64(line.channel))
                taken |= np.int64(1) << np.int64(line.to)


@jit
def free_channel(taken, own):
    """The channel `own`, the first free one if it is taken, or `own` if all are; `taken` has a bit for each."""
    if (taken >> own) & 1 == 0:
        return own
    for channel in range(CHANNELS):
        if (taken >> channel) & 1 == 0:
            return np.int64(channel)
    return own


@entry("void(int64, int64, int64, int64)", SMALL)
def describe_part(address, part, switches, listed):
    """Fills the LISTED at an address with a part of the SCORE at another.

    switches: address of 128 bytes, by key; 1 for keys that are no notes. 0: all are notes.
    """
    list_part(memory.score_at(address), part, switches, memory.listed_at(listed))


@entry("int64(int64, int64)", SMALL)
def frame_at_tick(address, tick):
    """Returns the frame of a tick of the SCORE at an address, after `read_lines`."""
    return frame_of(memory.score_at(address), tick)
