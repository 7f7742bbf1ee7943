"""Checks images: one that `check_file` accepts may be played.

It rejects damaged ones, and any that would make other kernels read or write outside their memory. Limits come from the
rows of the numbers (rows.py). [any thread]
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.bass.instrument import (
    FILE_BYTES,
    INSTRUMENT_WORDS,
    MAGIC,
    TIERS,
    WORD,
    answers_of,
    file_at,
    notes_of,
    words_before_numbers,
)
from livebass.kernels.machine.native import floats_at, record_address, words_at
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.kernels.string.law import lines_of
from livebass.kernels.string.preparing import LISTS, MAX_WORDS, NOTE, NOTE_BYTES, NOTE_WORDS, note_at
from livebass.kernels.string.records import BLOCK, DOUBLE, MAX_ANSWERING, MAX_NEAR, ROW
from livebass.rows.row import LARGEST, limits, table

jit = compiled(attributes=SMALL)

# Return values of `check_file`
GOOD, FOREIGN, DAMAGED, LATER = range(4)  # LATER: only `take_file`
# Limits of the words of an INSTRUMENT, then of a NOTE: columns as rows.Limit
LIMITS = table([*limits(INSTRUMENT_WORDS, MAX_STRINGS), *limits(NOTE_WORDS)])
NOTE_LIMITS = len(limits(INSTRUMENT_WORDS, MAX_STRINGS))  # the first of a NOTE
PLACE, COUNT, PER_STRING, WHOLE, MINIMUM, MAXIMUM = range(6)
NOTE_LISTS = tuple((NOTE.fields[name][1] // WORD, width) for name, width in LISTS.items())  # type: ignore[index]
TAPS = NOTE.fields["taps"][1] // WORD  # type: ignore[index]


@entry("uint64(int64, int64)", SMALL)
def checksum(address, count):
    """FNV-1a of `count` words at an address (Fowler, Noll, Vo), a word at a time."""
    return checksum_of(address, count)


@entry("int64(int64, int64)", SMALL)
def check_file(address, size):
    """Returns GOOD for the image of `size` bytes at an address, or the reason it cannot be played."""
    if size < FILE_BYTES + WORD or size % WORD != 0 or size > WORD * MAX_WORDS:
        return np.int64(FOREIGN)
    file, last = file_at(address), size // WORD - 1
    if file.magic != MAGIC:
        return np.int64(FOREIGN)
    if file.words != last + 1 or checksum_of(address, last) != np.uint64(words_at(address + WORD * last, 1)[0]):
        return np.int64(DAMAGED)
    if not is_instrument(file.instrument):
        return np.int64(DAMAGED)
    numbers = last - words_before_numbers(file) - file.instrument.response_count
    if numbers < 0:
        return np.int64(DAMAGED)
    where = address + WORD * words_before_numbers(file)
    if not all_within(where, numbers + file.instrument.response_count, -LARGEST, LARGEST):
        return np.int64(DAMAGED)
    notes = notes_of(file)
    modes = words_at(address + FILE_BYTES + NOTE_BYTES * notes, TIERS * notes)
    for k in range(notes):
        place = address + FILE_BYTES + NOTE_BYTES * k
        note = note_at(place)
        taps = 2 if file.instrument.sensed else file.instrument.pickups[k // (file.instrument.frets + 1)]
        others = lines_answering(address, k // (file.instrument.frets + 1))
        if k % (file.instrument.frets + 1) == 0:
            count = note.obstacles_count + note.surface_count
            hand = file.instrument.hand[k // (file.instrument.frets + 1)]
            if hand > 0 and (count > numbers or hand - 1 > numbers - count):
                return np.int64(DAMAGED)
        if note.answers_count != others:
            return np.int64(DAMAGED)
        if note.taps_count != taps or not is_note(place, file.instrument.sensed, where, numbers):
            return np.int64(DAMAGED)
        for tier in range(TIERS):
            count = modes[tier * notes + k]
            if count < 1 or count > min(note.grid_points - 1, ROW - BLOCK):
                return np.int64(DAMAGED)
    return np.int64(GOOD)


@jit
def lines_answering(address, i):
    """Number of lines of the other strings of the file at an address that may answer string `i`."""
    instrument, count = file_at(address).instrument, np.int64(0)
    for t in range(instrument.strings):
        if t != i:
            open_note = note_at(address + FILE_BYTES + NOTE_BYTES * t * (instrument.frets + 1))
            count += lines_of(open_note, instrument.answering_modes[t])
    return count


@jit
def checksum_of(address, count):
    """`checksum`, for kernels."""
    words, total = words_at(address, count), np.uint64(0xCBF29CE484222325)
    for k in range(count):
        total = (total ^ np.uint64(words[k])) * np.uint64(0x100000001B3)
    return total


@jit
def all_within(address, count, minimum, maximum):
    """True if `count` float64 at an address are numbers from `minimum` to `maximum`."""
    numbers, good = floats_at(address, count), True
    for k in range(count):
        if not minimum <= numbers[k] <= maximum:
            good = False
    return good


@jit
def are_within(address, first, last, strings):
    """True if a record's words at an address are within LIMITS, rows `first` to `last`, for `strings` strings."""
    for row in range(first, last):
        place, count = address + WORD * np.int64(LIMITS[row, PLACE]), np.int64(LIMITS[row, COUNT])
        if LIMITS[row, PER_STRING] > 0.0:
            count = strings * np.int64(LIMITS[row, PER_STRING])
        whole, numbers = words_at(place, count), floats_at(place, count)
        for k in range(count):
            x = np.float64(whole[k]) if LIMITS[row, WHOLE] > 0.0 else numbers[k]
            if not LIMITS[row, MINIMUM] <= x <= LIMITS[row, MAXIMUM]:
                return False
    return True


@jit
def is_instrument(instrument):
    """True if kernels can take the numbers of an INSTRUMENT."""
    strings = min(max(instrument.strings, 0), MAX_STRINGS)
    if not are_within(record_address(instrument), 0, NOTE_LIMITS, strings):
        return False
    for i in range(strings):
        if answers_of(instrument, i) > MAX_ANSWERING or (instrument.sensed and instrument.pickups[i] > 0):
            return False
    return True


@jit
def is_note(address, sensed, where, numbers):
    """True if kernels can take the NOTE at an address, with its lists among the `numbers` at `where`."""
    if not are_within(address, NOTE_LIMITS, len(LIMITS), 0):
        return False
    words = words_at(address, NOTE_BYTES // WORD)
    for place, width in NOTE_LISTS:
        first, count = words[place], words[place + 1]
        if count > numbers or first > numbers - (1 if sensed and place == TAPS else width) * count:
            return False
    note = note_at(address)
    if note.obstacles_count > MAX_NEAR or note.surface_count == 1:
        return False
    for k in range(note.obstacles_count):
        x = floats_at(where + DOUBLE * (note.obstacles + 2 * k), 1)[0]
        if not 0.0 <= x <= note.length:
            return False
    for k in range(note.surface_count):
        x = floats_at(where + DOUBLE * (note.surface + 2 * k), 1)[0]
        if not -note.length <= x <= 2.0 * note.length:
            return False
    return True
