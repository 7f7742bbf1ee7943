"""Tunings by system exclusive messages, which livebass ignores, and says so."""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.machine.elementary import exp2, round_even
from livebass.kernels.machine.native import bytes_at, words_at
from livebass.kernels.score.memory import exclusives_at, file_at
from livebass.kernels.score.remarks import SCALE_TUNING, TUNING, TUNINGS, add_remark
from livebass.kernels.score.sorting import fill_order, sort_by

jit = compiled(attributes=SMALL)

CENT_PARTS = 20480  # of a cent: every tuning is a whole number of them
FINE, COARSE, TENTH = 100 * CENT_PARTS // 8192, 100 * CENT_PARTS, CENT_PARTS // 10  # steps of master tunings
FINE_MIDDLE, COARSE_MIDDLE, NIBBLES_MIDDLE = 8192, 64, 1024
A4 = 440.0  # Hz


@jit
def remark_tunings(score):
    """A remark for each kind of tuning."""
    count = file_at(score.file).exclusives
    rows = exclusives_at(score.exclusives, count)
    order, spare, tunings = (
        words_at(score.words[0], count), words_at(score.words[1], count), words_at(score.words[2], count),
    )  # fmt: skip
    found, scales = 0, 0
    for k in range(count):
        data = bytes_at(score.data + rows[k].at, rows[k].size)
        tuning = tuning_of(data, rows[k].size)
        if tuning != 0:
            tunings[found] = tuning
            found += 1
        if rows[k].size >= 3 and (data[0] == 0x7E or data[0] == 0x7F) and data[2] == 0x08:
            scales = 1
    fill_order(order, found)
    sort_by(order, spare, tunings, found)
    different = 0
    for k in range(found):
        if k == 0 or tunings[order[k]] != tunings[order[k - 1]]:
            different += 1
    if different == 1:
        pitch = np.int64(round_even(10.0 * A4 * exp2(tunings[order[0]] / (1200.0 * CENT_PARTS))))
        add_remark(score, TUNING, cents(tunings[order[0]]), pitch // 10, pitch % 10, 0)
    elif different > 1:
        add_remark(score, TUNINGS, different, cents(tunings[order[0]]), cents(tunings[order[found - 1]]), 0)
    if scales == 1:
        add_remark(score, SCALE_TUNING, 0, 0, 0, 0)


@jit
def cents(tuning):
    """A tuning in whole cents."""
    return np.int64(round_even(tuning / CENT_PARTS))


@jit
def tuning_of(data, size):
    """A master tuning, in CENT_PARTS; 0: another message."""
    if size >= 6 and data[0] == 0x7F and data[2] == 0x04 and data[3] == 0x03:
        return (np.int64(data[4]) + 128 * np.int64(data[5]) - FINE_MIDDLE) * FINE
    if size >= 6 and data[0] == 0x7F and data[2] == 0x04 and data[3] == 0x04:
        return (np.int64(data[5]) - COARSE_MIDDLE) * COARSE
    if size >= 11 and data[0] == 0x41 and data[2] == 0x42 and data[3] == 0x12 and is_address(data, 4, 0x40):
        return (nibbles(data, 7) - NIBBLES_MIDDLE) * TENTH
    if size >= 10 and data[0] == 0x43 and data[2] == 0x4C and is_address(data, 3, 0x00):
        return (nibbles(data, 6) - NIBBLES_MIDDLE) * TENTH
    return np.int64(0)


@jit
def is_address(data, at, high):
    """True if three bytes are an address of the system's tuning."""
    return data[at] == high and data[at + 1] == 0x00 and data[at + 2] == 0x00


@jit
def nibbles(data, start):
    """The number in the low halves of four bytes."""
    value = np.int64(0)
    for k in range(start, start + 4):
        value = value << 4 | np.int64(data[k]) & 0x0F
    return value
