"""One frame of motion of a slot as the call of a C function.

`frets.player` and `board.player` are called by their addresses: what they hold is compiled once, and not again into
all that leads to them, and a board only where there is one. [any thread]
"""

import numpy as np
from numba import carray

from livebass.kernels import counted, jit
from livebass.layout import OPERATOR, STRING
from livebass.native import call_3, pointer, record_address

ARGUMENTS = 9  # int64, in the last row of scratch


@jit
def call(player, string, ops, pool, log, k, steps):
    """Moves slot k by `steps` fine steps, by the C function at address `player`."""
    a = string.scratch[3]
    a[0], a[1] = record_address(string), k
    a[2], a[3], a[4], a[5] = ops.ctypes.data, ops.shape[0], pool.ctypes.data, pool.shape[0]
    a[6], a[7], a[8] = log.ctypes.data, log.shape[0], steps
    call_3(player, np.int64(a.ctypes.data), np.int64(0), np.int64(0))


@counted
def arguments(address):
    """What `call` left at `address`, the string in an array of one: numba returns no records among others."""
    a = carray(pointer(address), ARGUMENTS, np.int64)
    string = carray(pointer(a[0]), 1, STRING)
    ops = carray(pointer(a[2]), a[3], OPERATOR)
    pool = carray(pointer(a[4]), a[5], np.float64)
    log = carray(pointer(a[6]), (a[7], 2), np.int64)
    return string, ops, pool, log, a[1], a[8]
