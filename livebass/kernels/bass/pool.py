"""The pool of an instrument file: the operators of all its notes, for one tier and rate. [any thread]"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.bass.instrument import (
    FILE_BYTES,
    TIERS,
    WORD,
    clear_memory,
    copy_words,
    file_at,
    lines,
    notes_of,
    whole_steps,
    words_before_numbers,
)
from livebass.kernels.machine.native import float_control, flush_bits, record_at, set_float_control, words_at
from livebass.kernels.string import preparing
from livebass.kernels.string.operators import hand_heights
from livebass.kernels.string.records import DOUBLE, OPERATOR

jit = compiled(attributes=SMALL)

# The operators of one tier of a file at one rate
POOL = np.dtype(
    [
        ("file", "i8"),  # address of a file that `check_file` accepts
        ("tier", "i8"),
        ("exact", "i8"),  # 1: all modes in float64
        ("rate", "f8"),  # audio, Hz
        ("memory", "i8"),  # address, on a cache line; OPERATOR (strings, frets + 1) come first
        ("bytes", "i8"),  # of memory: `measure_pool` sets it
        ("clean", "i8"),  # 1: memory holds zeros
        ("preparing", preparing.PREPARING),
        ("note", preparing.NOTE),  # workspace
        ("before", preparing.NOTE),  # workspace
        ("operator", OPERATOR),  # workspace
    ],
    align=True,
)
pool_at = record_at(POOL)


@jit
def begin_pool(pool):
    """Sets the values that the operators of all notes share, and resets the measurements."""
    file, work = file_at(pool.file), pool.preparing
    notes, tier = notes_of(file), file.instrument.tiers[pool.tier]
    work.count = notes
    work.numbers = pool.file + WORD * words_before_numbers(file)
    work.taps = preparing.SENSORS if file.instrument.sensed else preparing.PICKUPS
    work.lossless = 0
    work.exact = pool.exact
    work.rate = pool.rate
    work.numerator = np.int64(whole_steps(tier.contact_rate, pool.rate))
    work.denominator = 1
    work.contact_rate = work.numerator * pool.rate
    work.carried = file.instrument.carried
    work.apart = file.instrument.frets + 1
    work.words = 0
    work.table_words = 0


@jit
def take_note(pool, k, note):
    """Copies note `k` of the file to the NOTE at an address, with its modes in the pool's tier."""
    notes = notes_of(file_at(pool.file))
    copy_words(pool.file + FILE_BYTES + preparing.NOTE_BYTES * k, note, preparing.NOTE_BYTES // WORD)
    modes = words_at(pool.file + FILE_BYTES + preparing.NOTE_BYTES * notes, TIERS * notes)
    preparing.note_at(note).modes = modes[pool.tier * notes + k]
    preparing.fit_modes(pool.preparing, preparing.note_at(note))


@entry("void(int64)", SMALL)
def measure_pool(address):
    """Sets the `bytes` that the POOL at an address needs."""
    pool = pool_at(address)
    begin_pool(pool)
    work = pool.preparing
    for k in range(work.count):
        take_note(pool, k, address + NOTE_PLACE)
        shared = k >= work.apart
        if shared:
            take_note(pool, k - work.apart, address + BEFORE_PLACE)
            shared = preparing.have_same_shapes(work, pool.note, pool.before)
        preparing.measure(work, pool.note, pool.operator, shared)
    records = lines(preparing.OPERATOR_BYTES * work.count) + lines(preparing.NOTE_BYTES * work.count)
    pool.bytes = records + lines(DOUBLE * work.words) + lines(DOUBLE * work.table_words)


@entry("int64(int64)", SMALL)
def fill_pool(address):
    """Fills the memory of the POOL at an address, after `measure_pool`.

    Returns DONE, or why the file's modes cannot be played at this rate: OVERDAMPED or FROZEN (preparing.py). The memory
    may hold anything before; afterwards it is read-only, and any number of basses may share it.
    """
    pool = pool_at(address)
    before = float_control()
    set_float_control(before & ~flush_bits())  # the same rows whatever the host's settings
    if not pool.clean:
        clear_memory(pool.memory, pool.bytes)
    work, words = pool.preparing, pool.preparing.words
    begin_pool(pool)
    work.operators = pool.memory
    work.notes = work.operators + lines(preparing.OPERATOR_BYTES * work.count)
    work.memory = work.notes + lines(preparing.NOTE_BYTES * work.count)
    work.table = work.memory + lines(DOUBLE * words)
    for k in range(work.count):
        take_note(pool, k, work.notes + preparing.NOTE_BYTES * k)
    preparing.measure_all(work)
    state = preparing.fill(work)
    take_hands(pool)
    set_float_control(before)
    return state


@jit
def take_hands(pool):
    """Gives the hand the file's heights to measure its force by, if the file has them."""
    instrument, work = file_at(pool.file).instrument, pool.preparing
    frets = instrument.frets + 1
    for i in range(instrument.strings):
        if instrument.hand[i] > 0:
            note = preparing.note_at(work.notes + preparing.NOTE_BYTES * i * frets)
            op = preparing.operator_at(work.operators + preparing.OPERATOR_BYTES * i * frets)
            preparing.set_heights(work, note, op, hand_heights(op), instrument.hand[i] - 1, 1)


NOTE_PLACE, BEFORE_PLACE = (POOL.fields[name][1] for name in ("note", "before"))  # type: ignore[index]
