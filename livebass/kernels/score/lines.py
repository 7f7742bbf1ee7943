"""From the messages of a file to lines and parts: who plays what, at which frame."""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.native import copy_record, words_at
from livebass.kernels.player.messages import NOTE_OFF, NOTE_ON, RELEASE
from livebass.kernels.player.performer import CHANNELS
from livebass.kernels.score import memory
from livebass.kernels.score.kits import MELODIC
from livebass.kernels.score.remarks import PORTAMENTO, add_remark
from livebass.kernels.score.smf import MAX_EVENTS
from livebass.kernels.score.sorting import fill_order, sort_by
from livebass.kernels.score.times import frame_of
from livebass.rows.techniques import BEND_STARTS, FUNCTION_ROWS

jit = compiled(attributes=SMALL)

LONGEST = 24 * 3600  # s, of a score
LONGEST_REST = 60  # s from the last note to the end of a file; a longer rest is cut off
LAST_NOTE = 10  # s that a note without end lasts there
MAX_PARTS = 4096
PORTAMENTO_TIME = FUNCTION_ROWS["bend"].controllers[0]  # a controller; livebass takes bend with it


@jit
def rank_ports(score):
    """Ranks the ports with messages, port 0 if there are none; returns their number and that of the note-ons."""
    count = memory.file_at(score.file).messages
    messages = memory.messages_at(score.messages, count)
    score.ranks[:] = memory.NONE
    notes = 0
    for k in range(count):
        score.ranks[messages[k].port] = 0
        if messages[k].status & 0xF0 == NOTE_ON and messages[k].second > 0:
            notes += 1
    if count == 0:
        score.ranks[0] = 0
    ports = 0
    for port in range(memory.PORTS):
        if score.ranks[port] != memory.NONE:
            score.ranks[port] = ports
            ports += 1
    return ports, notes


@jit
def make_lines(score):
    """Makes a line of each channel of the ports."""
    lines = memory.lines_of(score)
    for port in range(memory.PORTS):
        if score.ranks[port] != memory.NONE:
            for channel in range(CHANNELS):
                set_line(lines, score.ranks[port] * CHANNELS + channel, port, channel)


@jit
def set_line(lines, k, port, channel):
    """Sets line `k` to all of a channel."""
    line = lines[k]
    line.port, line.channel, line.root, line.home = port, channel, k, k - channel
    line.first_part, line.parts, line.moved, line.program, line.bank = 0, 0, 0, memory.NONE, memory.NONE
    line.high, line.low, line.zone, line.split, line.programmed, line.ready = 127, 127, 0, 0, 0, 0


@jit
def fill_events(score):
    """The messages with their frames; note-ons of velocity 0 become note-offs."""
    count = memory.file_at(score.file).messages
    messages, tick, frame = memory.messages_at(score.messages, count), np.int64(memory.NONE), np.int64(0)
    score.events_count = count
    rows = memory.events_of(score)
    for k in range(count):
        message, row = messages[k], rows[k]
        if message.tick != tick:
            tick = message.tick
            frame = frame_of(score, tick)
        row.frame, row.track, row.part, row.mark = frame, message.track, memory.NONE, 0
        row.line = score.ranks[message.port] * CHANNELS + (np.int64(message.status) & 0x0F)
        row.status, row.first, row.second = message.status, message.first, message.second
        if memory.kind_of(row) == NOTE_ON and row.second == 0:
            row.status, row.second = NOTE_OFF | np.int64(row.status) & 0x0F, RELEASE


@jit
def fill_exclusives(score):
    """The system exclusive messages of ports that play, with their frames."""
    given = memory.file_at(score.file).exclusives
    rows, sent, count = memory.exclusives_at(score.exclusives, given), memory.sent_at(score.sent_exclusives, given), 0
    for k in range(given):
        if score.ranks[rows[k].port] != memory.NONE:
            row = sent[count]
            row.frame, row.home = frame_of(score, rows[k].tick), score.ranks[rows[k].port] * CHANNELS
            row.at, row.size = rows[k].at, rows[k].size
            count += 1
    score.exclusives_count = count


@jit
def end_soon(score):
    """Sets the end: the file's, or soon after its last note; returns False if it lasts too long."""
    rows, rate, count = memory.events_of(score), score.rate, score.events_count
    score.end, score.last = frame_of(score, memory.file_at(score.file).end), 0
    for k in range(count):
        score.end = max(score.end, rows[k].frame)
        if memory.is_note(rows[k]):
            score.last = max(score.last, rows[k].frame)
    if score.last > LONGEST * rate:
        return False
    if score.end - score.last > LONGEST_REST * rate:
        while count > 0 and rows[count - 1].frame > score.last + LONGEST_REST * rate:
            count -= 1
        score.events_count = count
        score.end = rows[count - 1].frame if count > 0 else 0
        if held_at_end(rows, count):
            score.end += LAST_NOTE * rate
    return True


@jit
def held_at_end(rows, count):
    """True if there are more note-ons than note-offs."""
    held = 0
    for k in range(count):
        if memory.is_note(rows[k]):
            held += 1 if memory.kind_of(rows[k]) == NOTE_ON else -1
    return held > 0


@jit
def find_parts(score):
    """Finds the parts: the tracks with notes on each line."""
    rows, tracks = memory.events_of(score), memory.tracks_of(score)
    for t in range(memory.file_at(score.file).tracks):
        track = tracks[t]
        track.seen, track.first_part, track.last_part, track.lines, track.bass = (
            memory.NONE,
            memory.NONE,
            memory.NONE,
            0,
            0,
        )
    met, order, spare = (
        words_at(score.words[0], score.note_ons),
        words_at(score.words[1], score.note_ons),
        words_at(score.words[2], score.note_ons),
    )
    count = 0
    for k in range(score.events_count):
        if memory.kind_of(rows[k]) == NOTE_ON and tracks[rows[k].track].seen != rows[k].line:
            tracks[rows[k].track].seen = rows[k].line
            met[count] = np.int64(rows[k].line) << 32 | np.int64(rows[k].track)
            count += 1
    fill_order(order, count)
    sort_by(order, spare, met, count)
    score.parts_count = 0
    for k in range(count):
        if score.parts_count <= MAX_PARTS and (k == 0 or met[order[k]] != met[order[k - 1]]):
            add_part(score, met[order[k]] >> 32, met[order[k]] & 0xFFFFFFFF)
    if score.parts_count <= MAX_PARTS:
        assign_parts(score)


@jit
def add_part(score, line, track):
    """Adds the next part, of a track on a line."""
    k, own, of = score.parts_count, memory.lines_of(score)[line], memory.tracks_of(score)[track]
    parts = memory.parts_at(score.parts, k + 1)
    part = parts[k]
    part.line, part.track, part.next, part.notes, part.wanted = line, track, memory.NONE, 0, 0
    part.keys[:] = 0
    part.programs[:] = 0
    if own.parts == 0:
        own.first_part = k
    own.parts += 1
    if of.lines == 0:
        of.first_part = k
    else:
        parts[of.last_part].next = k
    of.last_part = k
    of.lines += 1
    score.parts_count += 1


@jit
def assign_parts(score):
    """Gives the messages their parts, and the parts their keys."""
    rows, parts = memory.events_of(score), memory.parts_of(score)
    for k in range(score.events_count):
        row = rows[k]
        row.part = part_of(score, row.line, row.track)
        if memory.kind_of(row) == NOTE_ON:
            part = parts[row.part]
            part.notes += 1
            memory.add_to(part.keys, np.int64(row.first))


@jit
def part_of(score, line, track):
    """The part of a track on a line; NONE: it has no notes there."""
    root = memory.lines_of(score)[memory.lines_of(score)[line].root]
    parts = memory.parts_of(score)
    low, high = np.int64(root.first_part), np.int64(root.first_part) + np.int64(root.parts)
    stop = high
    while low < high:
        half = (low + high) >> 1
        if parts[half].track < track:
            low = half + 1
        else:
            high = half
    return low if low < stop and parts[low].track == track and parts[low].line == line else np.int64(memory.NONE)


@jit
def find_basses(score):
    """Finds the tracks of one line that are called bass and play at least MELODIC keys.

    Some programs number the channels of their tracks in order, and so give channel 10 to any instrument.
    """
    tracks, parts = memory.tracks_of(score), memory.parts_of(score)
    for t in range(memory.file_at(score.file).tracks):
        called = memory.name_of(score, t, memory.TRACK_NAME) & (memory.IS_BASS | memory.BASS_INSTRUMENT) != 0
        if called and tracks[t].lines == 1 and memory.size_of(parts[tracks[t].first_part].keys) >= MELODIC:
            tracks[t].bass = 1


@jit
def drop_portamento(score):
    """Drops controller 5: files use it as portamento time, and only a livebass bends by it."""
    rows, lines, bends, kept = memory.events_of(score), memory.lines_of(score), 0, 0
    for k in range(score.events_count):
        row = rows[k]
        if memory.is_control(row, PORTAMENTO_TIME):
            if row.second < BEND_STARTS:
                lines[row.line].ready = 1
            elif lines[row.line].ready == 1:
                bends += 1
        else:
            copy_record(rows[kept], rows[k])
            kept += 1
    score.events_count = kept
    if bends > 0:
        add_remark(score, PORTAMENTO, bends, 0, 0, 0)


@jit
def find_programs(score):
    """Finds the lines that set programs, and the programs of each part."""
    rows, lines, parts = memory.events_of(score), memory.lines_of(score), memory.parts_of(score)
    for k in range(score.events_count):
        if memory.kind_of(rows[k]) == memory.PROGRAM:
            lines[rows[k].line].programmed = 1
            if rows[k].part != memory.NONE:
                memory.add_to(parts[rows[k].part].programs, np.int64(rows[k].first))


@jit
def set_apart(score):
    """Gives tracks that share a channel but have programs of their own a line each; counts the messages then."""
    rows, lines = memory.events_of(score), memory.lines_of(score)
    score.lines_count = score.max_lines - score.max_parts
    score.splits, score.copies, base = 0, 0, score.lines_count
    for k in range(base):
        if lines[k].zone == 0 and lines[k].parts > 1 and programs_differ(score, lines[k]):
            lines[k].split = 1
            score.splits += 1
    for k in range(score.events_count):
        row, line = rows[k], lines[rows[k].line]
        if line.split == 1 and memory.kind_of(row) == NOTE_ON and memory.parts_of(score)[line.first_part].line < base:
            split_line(score, line)
    for k in range(score.events_count):
        if score.copies <= MAX_EVENTS:  # no more are counted
            score.copies += copies_of(score, rows[k])


@jit
def programs_differ(score, line):
    """True if tracks on a line set different programs."""
    parts, first = memory.parts_of(score), memory.NONE
    for k in range(line.first_part, line.first_part + line.parts):
        if memory.size_of(parts[k].programs) > 0:
            if first == memory.NONE:
                first = k
            for word in range(len(parts[k].programs)):
                if parts[k].programs[word] != parts[first].programs[word]:
                    return True
    return False


@jit
def split_line(score, line):
    """Gives each track on a line its own."""
    lines, parts = memory.lines_of(score), memory.parts_of(score)
    for k in range(line.first_part, line.first_part + line.parts):
        own = lines[score.lines_count]
        set_line(lines, score.lines_count, np.int64(line.port), np.int64(line.channel))
        own.root, own.home = line.root, line.home
        parts[k].line = score.lines_count
        score.lines_count += 1


@jit
def goes_to(score, row, k):
    """True if a message on a line that is split goes to part `k` there.

    One of a track without notes goes to all; so does a program, to tracks without their own.
    """
    part = memory.parts_of(score)[k]
    own = part.track == row.track or row.part == memory.NONE
    return own or (memory.kind_of(row) == memory.PROGRAM and memory.size_of(part.programs) == 0)


@jit
def copies_of(score, row):
    """How many lines a message goes to."""
    line, count = memory.lines_of(score)[row.line], 0
    if line.split == 0:
        return 1
    if row.part != memory.NONE and memory.kind_of(row) != memory.PROGRAM:
        return 1
    for k in range(line.first_part, line.first_part + line.parts):
        if goes_to(score, row, k):
            count += 1
    return count


@jit
def count_notes(score):
    """Counts note-ons and note-offs."""
    rows, score.note_ons, score.note_offs = memory.events_of(score), 0, 0
    for k in range(score.events_count):
        if memory.kind_of(rows[k]) == NOTE_ON:
            score.note_ons += 1
        elif memory.kind_of(rows[k]) == NOTE_OFF:
            score.note_offs += 1
