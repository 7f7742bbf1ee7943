"""One frame of motion of a slot as the call of a C function.

`frets.player` and `board.player` are called by their addresses: what they hold is compiled once, and not again into
all that leads to them, and a board only where there is one. [any thread]
"""

import numpy as np
from numba import carray

from livebass.kernels import counted, jit
from livebass.layout import OPERATOR, POLARISATIONS, ROW, SLOT, VOICE, VOICE_SLOTS, WORK_ROWS
from livebass.native import call_3, pointer, record_address

ARGUMENTS = 12  # int64, in the last row of scratch


@jit
def call(player, v, slots, ops, w2, pool, scratch, log, k, steps):
    """Moves slot k by `steps` fine steps, by the C function at address `player`."""
    a = scratch[3]
    a[0], a[1], a[2] = record_address(v), slots.ctypes.data, k
    a[3], a[4] = ops.ctypes.data, ops.shape[0]
    a[5], a[6], a[7] = w2.ctypes.data, pool.ctypes.data, pool.shape[0]
    a[8], a[9], a[10], a[11] = scratch.ctypes.data, log.ctypes.data, log.shape[0], steps
    call_3(player, np.int64(a.ctypes.data), np.int64(0), np.int64(0))


@counted
def arguments(address):
    """What `call` left at `address`, `v` in an array of one: numba returns no records among others."""
    a = carray(pointer(address), ARGUMENTS, np.int64)
    v = carray(pointer(a[0]), 1, VOICE)
    slots = carray(pointer(a[1]), VOICE_SLOTS, SLOT)
    ops = carray(pointer(a[3]), a[4], OPERATOR)
    w2 = carray(pointer(a[5]), (POLARISATIONS * VOICE_SLOTS, WORK_ROWS * ROW), np.float64)
    pool = carray(pointer(a[6]), a[7], np.float64)
    scratch = carray(pointer(a[8]), (4, ROW), np.int64)
    log = carray(pointer(a[9]), (a[10], 2), np.int64)
    return v, slots, ops, w2, pool, scratch, log, a[2], a[11]
