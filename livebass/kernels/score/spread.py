"""Finds an instrument that spreads over the channels of a track, although no mode message says so.

MIDI guitars send a channel a string, MPE keyboards a channel a note. What they record often lacks the mode messages,
and a program. A track is such an instrument if its channels have no program, each has one note at a time, and either
all together have, too, or each bends its own notes.
"""

import numpy as np

from livebass.compiling import SMALL, compiled, inlined
from livebass.kernels.machine.native import words_at
from livebass.kernels.player.controls import DATA, RPN, RPN_FINE
from livebass.kernels.player.messages import BRIGHTNESS, CONTROL, MPE_RPN, NOTE_OFF, NOTE_ON, PRESSURE, WHEEL
from livebass.kernels.score.memory import (
    KEYS,
    NONE,
    TIMED,
    clear_words,
    events_of,
    file_at,
    is_control,
    kind_of,
    lines_of,
    parts_of,
    place_of,
    tracks_of,
)
from livebass.kernels.score.modes import UNSELECTED
from livebass.kernels.score.remarks import NOTE_CHANNELS, STRING_CHANNELS, add_remark
from livebass.kernels.score.sorting import sort_by, twice_median

jit = compiled(attributes=SMALL)

# A bass's range: most notes of a part lie within, half of them no higher than the middle
LOWEST, HIGHEST, MIDDLE, MAXIMUM = 16, 67, 50, 0.9  # E0, G4, D3; fraction of notes
OVERLAP = 0.06  # s, allowed overlap of notes in a line
MAX_OVERLAP = 0.25  # of the notes may overlap for longer
MIN_BENT = 3  # channels that bend their own notes
MAX_STAYING = 0.1  # of the notes of MPE may be on the channel of the note before
MODE_MESSAGES = 5  # that make channels MPE
ROW = TIMED.itemsize
OWNER = 32  # bits of a key above its line


@jit
def is_low(counts, total):
    """True if `total` notes, by key, lie where a bass plays."""
    within = 0
    for key in range(LOWEST, HIGHEST + 1):
        within += counts[key]
    return total > 0 and within >= MAXIMUM * total and twice_median(counts, total) <= 2 * MIDDLE


@jit
def join_spread(score):
    """Makes a zone of the lowest instrument that spreads over a track's channels and lies in a bass's range."""
    if not find_wanted(score):
        return
    fill_strokes(score)
    tracks, lowest, track, mode = tracks_of(score), np.int64(2 * KEYS), np.int64(NONE), False
    for t in range(file_at(score.file).tracks):
        if tracks[t].lines > 1 and parts_of(score)[tracks[t].first_part].wanted == 1:
            count = count_keys(score, t)
            low = is_low(score.counts, count)
            middle = twice_median(score.counts, count)
            if low and middle < lowest and is_one(score, t):
                lowest, track, mode = middle, np.int64(t), is_mpe(score, t)
    if track != NONE:
        make_zone(score, track, mode)


@jit
def find_wanted(score):
    """Marks the parts of tracks that have several channels of a port for themselves, without a program."""
    tracks, parts, lines, found = tracks_of(score), parts_of(score), lines_of(score), False
    for t in range(file_at(score.file).tracks):
        if tracks[t].lines < 2:
            continue
        wanted = lines[parts[tracks[t].first_part].line].home == lines[parts[tracks[t].last_part].line].home
        k = np.int64(tracks[t].first_part)
        while k != NONE and wanted:
            line = lines[parts[k].line]
            wanted = line.parts == 1 and line.programmed == 0
            k = np.int64(parts[k].next)
        k = np.int64(tracks[t].first_part)
        while k != NONE and wanted:
            found, parts[k].wanted = True, 1
            k = np.int64(parts[k].next)
    return found


@jit
def fill_strokes(score):
    """Begin, end and key of the notes of the wanted parts, part by part; and how often lines bend their notes."""
    rows, parts, lines, start = events_of(score), parts_of(score), lines_of(score), 0
    begins, ends, keys = strokes_of(score)
    begun = words_at(score.tables[0], score.lines_count * KEYS)
    clear_words(score.tables[0], score.lines_count * KEYS)
    for k in range(score.parts_count):
        parts[k].start, parts[k].filled = start, start
        start += parts[k].notes
    for k in range(score.events_count):
        row, line = rows[k], lines[rows[k].line]
        kind = kind_of(row)
        if kind in (WHEEL, PRESSURE) or is_control(row, BRIGHTNESS):
            line.moved += 1
        if line.parts != 1 or parts[line.first_part].wanted == 0:
            continue
        if kind == NOTE_ON:
            part = parts[line.first_part]
            begins[part.filled], ends[part.filled] = row.frame, row.frame
            keys[part.filled] = np.int64(row.first) << OWNER | np.int64(row.line)
            begun[place_of(row)] = part.filled
            part.filled += 1
        elif kind == NOTE_OFF and begun[place_of(row)] != NONE:
            ends[begun[place_of(row)]] = row.frame
            begun[place_of(row)] = NONE


@inlined
def strokes_of(score):
    """The words that hold begin, end and key of notes; the key is above the number of the line."""
    count = score.note_ons
    return words_at(score.words[0], count), words_at(score.words[1], count), words_at(score.words[2], count)


@jit
def count_keys(score, track):
    """Counts the notes of a track, by key; returns how many there are."""
    parts, keys, total = parts_of(score), strokes_of(score)[2], 0
    score.counts[:] = 0
    k = np.int64(tracks_of(score)[track].first_part)
    while k != NONE:
        for n in range(parts[k].start, parts[k].filled):
            score.counts[keys[n] >> OWNER] += 1
        total += parts[k].notes
        k = np.int64(parts[k].next)
    return total


@jit
def is_one(score, track):
    """True if each line has one note at a time, and either all lines together have, too, or each bends its own."""
    parts, lines, tracks = parts_of(score), lines_of(score), tracks_of(score)
    order, own, bent = order_of(score), 0, True
    k = np.int64(tracks[track].first_part)
    while k != NONE:
        part, count = parts[k], parts[k].notes
        for n in range(count):
            order[n] = part.start + n
        if not is_single(score, count):
            return False
        bent = bent and lines[part.line].moved >= count
        own += 1
        k = np.int64(part.next)
    return is_single(score, sort_strokes(score, track)) or (own >= MIN_BENT and bent)


@inlined
def order_of(score):
    """The words that hold the order of notes."""
    return words_at(score.words[3], score.note_ons)


@jit
def sort_strokes(score, track):
    """Sorts the notes of a track by begin, end, key and line; returns how many there are."""
    begins, ends, keys = strokes_of(score)
    order, spare, parts, count = order_of(score), words_at(score.words[4], score.note_ons), parts_of(score), 0
    k = np.int64(tracks_of(score)[track].first_part)
    while k != NONE:
        for n in range(parts[k].start, parts[k].filled):
            order[count] = n
            count += 1
        k = np.int64(parts[k].next)
    sort_by(order, spare, keys, count)
    sort_by(order, spare, ends, count)
    sort_by(order, spare, begins, count)
    return count


@jit
def is_single(score, count):
    """True if most of the first `count` notes in `order` end when the next one begins."""
    begins, ends, _ = strokes_of(score)
    order, overlap, overlapping = order_of(score), OVERLAP * score.rate, 0
    for n in range(count - 1):
        if ends[order[n]] > begins[order[n + 1]] + overlap:
            overlapping += 1
    return overlapping <= MAX_OVERLAP * count


@jit
def is_mpe(score, track):
    """True if a track's lines look like MPE, not like a channel a string.

    In MPE the first channel has no notes, and the next note takes another channel. The lowest notes of strings rise or
    fall from channel to channel.
    """
    parts, lines, tracks, keys = parts_of(score), lines_of(score), tracks_of(score), strokes_of(score)[2]
    first, last = np.int64(parts[tracks[track].first_part].line), np.int64(parts[tracks[track].last_part].line)
    home, own = np.int64(lines[first].home), np.int64(tracks[track].lines)
    if own < MIN_BENT or first == home or rises_or_falls(score, track):
        return False
    for line in range(home, last + 1):
        if lines[line].parts > 0 and parts[lines[line].first_part].track != track:
            return False
    count, order, stays = sort_strokes(score, track), order_of(score), 0
    for n in range(count - 1):
        if (keys[order[n]] ^ keys[order[n + 1]]) & ((1 << OWNER) - 1) == 0:
            stays += 1
    return stays <= MAX_STAYING * count


@jit
def rises_or_falls(score, track):
    """True if the lowest notes of a track rise from channel to channel, or fall."""
    parts, keys, before, ups, downs, steps = parts_of(score), strokes_of(score)[2], np.int64(NONE), 0, 0, 0
    k = np.int64(tracks_of(score)[track].first_part)
    while k != NONE:
        low = np.int64(KEYS)
        for n in range(parts[k].start, parts[k].filled):
            low = min(low, keys[n] >> OWNER)
        if before != NONE:
            steps += 1
            ups += 1 if low > before else 0
            downs += 1 if low < before else 0
        before = low
        k = np.int64(parts[k].next)
    return steps > 0 and (ups == steps or downs == steps)


@jit
def make_zone(score, track, mode):
    """Joins a track's lines; `mode`: as MPE, which messages at the beginning say."""
    parts, lines, tracks = parts_of(score), lines_of(score), tracks_of(score)
    k = np.int64(tracks[track].first_part)
    first, last = lines[parts[k].line], lines[parts[tracks[track].last_part].line]
    while k != NONE:
        lines[parts[k].line].zone = 1
        k = np.int64(parts[k].next)
    score.has_zone = 1
    low, high = np.int64(first.channel) + 1, np.int64(last.channel) + 1
    if not mode:
        add_remark(score, STRING_CHANNELS, low, high, 0, 0)
        return
    lines[first.home].zone = 1
    add_remark(score, NOTE_CHANNELS, np.int64(1), high, 0, 0)
    score.events -= MODE_MESSAGES * ROW
    score.events_count += MODE_MESSAGES
    rows = events_of(score)
    set_control(rows[0], first.home, track, RPN, 0)
    set_control(rows[1], first.home, track, RPN_FINE, MPE_RPN)
    set_control(rows[2], first.home, track, DATA, high - 1)
    set_control(rows[3], first.home, track, RPN, UNSELECTED)
    set_control(rows[4], first.home, track, RPN_FINE, UNSELECTED)


@jit
def set_control(row, line, track, number, value):
    """Makes a row a controller message of channel 1 at frame 0."""
    row.frame, row.line, row.track, row.part, row.mark = 0, line, track, NONE, 0
    row.status, row.first, row.second = CONTROL, number, value
