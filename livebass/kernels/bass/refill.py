"""Changes notes of a bass in place: from a BENCH (bench.py) to its file, and from there to a pool.

That does for what makes no list of the file and no row of the pool longer than there is room: heights of frets and
boards, a fret that chokes notes, places and widths of pickups, dampings, masses and stiffnesses, the law of contacts.
Where there is no room, `keep_notes` or `refill_notes` say so, and the bass must be built anew. What is no note stays:
the INSTRUMENT has the places of the pickups, too, and a bass set up before has its noises and its room to run ahead.

The hand stays: it goes on measuring its force by the open strings' neck as it was (`hand_heights`, operators.py). [any
thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.bass.bench import bench_at
from livebass.kernels.bass.check import checksum_of
from livebass.kernels.bass.instrument import (
    FILE_BYTES,
    ROOM_OF_STROKES,
    TIERS,
    WORD,
    added_at,
    added_of,
    clear_memory,
    copy_words,
    file_at,
    notes_of,
    room_of_effects,
    words_before_numbers,
)
from livebass.kernels.bass.pool import pool_at, take_note
from livebass.kernels.machine.native import (
    copy_record,
    float_control,
    floats_at,
    flush_bits,
    record_address,
    set_float_control,
    words_at,
)
from livebass.kernels.string.modal import copy_row
from livebass.kernels.string.operators import DOUBLE, hand_heights, heights
from livebass.kernels.string.preparing import (
    DONE,
    NOTE_BYTES,
    OPERATOR_BYTES,
    behind_table,
    fill_operator,
    lay_out,
    measure,
    measure_by_own,
    note_at,
    operator_at,
    set_heights,
)
from livebass.parts import VERSION

NO_ROOM, OTHER_PLACES = 3, 4  # what these return besides DONE, OVERDAMPED and FROZEN


@entry("int64(int64, int64)")
def keep_notes(bench, file):
    """Puts the notes that `fill_bench` made of the BENCH at an address into the file at an address, and seals that.

    Returns DONE; or NO_ROOM, and leaves the file alone, if it has other notes or too little room for their lists.
    """
    b, f = bench_at(bench), file_at(file)
    notes = b.strings * (b.frets + 1)
    if notes != notes_of(f) or b.frets != f.instrument.frets or b.used > room_of_lists(file):
        return np.int64(NO_ROOM)
    copy_words(b.notes, file + FILE_BYTES, NOTE_BYTES // WORD * notes)
    copy_words(b.modes, file + FILE_BYTES + NOTE_BYTES * notes, TIERS * notes)
    copy_words(b.lists, file + WORD * words_before_numbers(f), b.used)
    last = f.words - 1
    words_at(file + WORD * last, 1)[0] = np.int64(checksum_of(file, last))
    return np.int64(DONE)


@jit
def room_of_lists(file):
    """Words of the file at an address for the lists of its notes."""
    f = file_at(file)
    room = f.words - 1 - words_before_numbers(f) - room_of_effects(file)
    if f.version != VERSION:
        room -= ROOM_OF_STROKES
    added = added_of(file)
    for i in range(f.instrument.strings):
        if added != 0 and added_at(added).hand[i] > 0:
            room = min(room, added_at(added).hand[i] - 1)
    return room


@entry("int64(int64, int64, int64)")
def refill_notes(pool, first, count):
    """Fills `count` notes from `first` on of the filled POOL at an address anew, by its file as that is now.

    No bass may play from it; one is set up anew afterwards (setup.py). Returns DONE; or, with the notes before filled,
    NO_ROOM, or why one cannot be played, OVERDAMPED or FROZEN.
    """
    before = float_control()
    set_float_control(before & ~flush_bits())
    state = np.int64(DONE)
    for k in range(first, first + count):
        if state == DONE:
            state = refill(pool_at(pool), k)
    set_float_control(before)
    return state


@jit
def refill(pool, k):
    """Fills note `k` of a pool; returns as `refill_notes`."""
    work = pool.preparing
    op, place = operator_at(work.operators + OPERATOR_BYTES * k), work.notes + NOTE_BYTES * k
    start, end, points = op.coefficients, work.table, op.points
    if k + 1 < work.count:
        end = operator_at(work.operators + OPERATOR_BYTES * (k + 1)).coefficients
    words, table = work.words, work.table_words
    take_note(pool, k, record_address(pool.note))
    measure(work, pool.note, pool.operator)
    fits = lay_out(work, pool.note, pool.operator, start) <= end and work.table_words == table
    work.words, work.table_words = words, table
    opened = is_open(pool, k)
    if not fits or (opened and pool.operator.points != points):
        return np.int64(NO_ROOM)
    kept = floats_at(work.table + DOUBLE * behind_table(pool.note), points)
    if opened:
        copy_row(kept, hand_heights(op), points)
    note = note_at(place)
    copy_record(note, pool.note)
    op.modes, op.padded, op.split = pool.operator.modes, pool.operator.padded, pool.operator.split
    op.points = pool.operator.points
    clear_memory(start, end - start)
    lay_out(work, note, op, start)
    state = fill_operator(work, note, op)
    measure_by_own(op)
    if opened:
        copy_row(hand_heights(op), kept, points)
    return state


@jit
def is_open(pool, k):
    """True if note `k` of a pool is that of an open string, by which the hand measures its force."""
    return k % (file_at(pool.file).instrument.frets + 1) == 0


@entry("int64(int64, int64, int64)")
def take_heights(pool, first, count):
    """Gives `count` notes from `first` on of the filled POOL at an address the heights that its file has now.

    The bass may go on: its strings take the heights of a note as it begins. Returns DONE; or OTHER_PLACES, with the
    notes before done, for a note that is stopped elsewhere, or over other contacts.
    """
    p = pool_at(pool)
    work = p.preparing
    for k in range(first, first + count):
        op, note = operator_at(work.operators + OPERATOR_BYTES * k), note_at(work.notes + NOTE_BYTES * k)
        take_note(p, k, record_address(p.note))
        same = p.note.length == note.length and p.note.obstacles_count == note.obstacles_count
        if not same or p.note.surface_count != note.surface_count:
            return np.int64(OTHER_PLACES)
        note.obstacles, note.surface = p.note.obstacles, p.note.surface
        set_heights(work, note, op, heights(op), height_list(note), 2)
        if not is_open(p, k):
            measure_by_own(op)
    return np.int64(DONE)


@entry("int64(int64, int64)")
def keep_hand(pool, old):
    """Has the hand measure its force on the filled POOL at an address as it does on an old one of the bass.

    Returns DONE; or OTHER_PLACES, for a bass with other contacts under its open strings.
    """
    work, before = pool_at(pool).preparing, pool_at(old).preparing
    for k in range(work.count):
        if is_open(pool_at(pool), k):
            op = operator_at(work.operators + OPERATOR_BYTES * k)
            other = operator_at(before.operators + OPERATOR_BYTES * k)
            if before.count != work.count or other.points != op.points:
                return np.int64(OTHER_PLACES)
            copy_row(hand_heights(op), hand_heights(other), op.points)
    return np.int64(DONE)


@jit
def height_list(note):
    """Returns where the heights of the contacts of a note begin, among the numbers."""
    return (note.obstacles if note.surface_count == 0 else note.surface) + 1
