"""A slot, one sounding note of a string: got ready, tuned, given other operators, and looked after.

What moves it from frame to frame is in frets.py and board.py. [any thread]

One frame of motion of a slot as the call of a C function.

`frets.player` and `board.player` are called by their addresses: what they hold is compiled once, and not again into
all that leads to them, and a board only where there is one. [any thread]
"""

import numpy as np

from livebass.compiling import counted, jit
from livebass.kernels import modal as rows
from livebass.kernels.native import call_3, carray, pointer, record_address
from livebass.kernels.records import (
    BLOCK,
    FINE_A,
    GROUP_ROOM,
    LONGER,
    MOST_NEAR,
    OMEGA,
    OP_HEIGHT,
    OPERATOR,
    PART,
    ROW,
    STRING,
    WHOLE,
)

NEVER_STEP = 1 << 60
# Fastest point over the root mean square velocity that the string's energy gives: plucks were seen to reach 3.8
# (hard, near the bridge); the narrow pulse of a thumb more.
SAFETY, SAFETY_STRUCK = 5.0, 10.0
SLACK = 0.02  # m/s
HOUSEKEEPING = 64  # frames between looks for dead modes
STEEPEST = 0.1  # root mean square velocity over wave speed that a string bears: no playing reaches a third of it


@jit
def take_coefficients(op, w, pool):
    """One polarisation goes by operator `op`, untuned."""
    whole, longer, part = w.leaps[WHOLE], w.leaps[LONGER], w.leaps[PART]
    o = op.start
    for row in (
        w.fine_a,
        w.fine_b,
        whole.a,
        whole.b,
        whole.g,
        longer.a,
        longer.b,
        longer.g,
        part.a,
        part.b,
        part.g,
        w.kappa,
        w.omega,
        w.sigma,
        w.pace,
    ):  # as they follow each other in the pool
        rows.copy_row(row, pool, o, op.padded)
        o += ROW


@jit
def load(s, op, w, pool, step):
    """Makes the silent slot `s` ready to play operator `op`."""
    n = op.padded
    take_coefficients(op, w, pool)
    rows.clear(w, n)
    s.ratio = 1.0
    s.heard = op.tap_modes
    s.across = 0
    s.swaying = 0
    s.safety = SAFETY
    s.active = 0
    s.touching = 0
    s.fading = 0
    s.hand = 1.0
    for m in range(op.points):
        w.solved_at[m] = -1.0
    disturb(s, op, w, step)


@jit
def open_across(s, op, across, pool):
    """Makes the slot's second polarisation ready to move, where it is not."""
    if s.across:
        return
    take_coefficients(op, across, pool)
    rows.clear(across, op.padded)
    for m in range(op.points):
        across.solved_at[m] = -1.0
    if s.ratio != 1.0:
        tune(op, across, pool, s.ratio)
    s.across = 1


@jit
def disturb(s, op, w, step):
    """After an event: every point needs a look, all modes may sound."""
    if s.on:
        s.active = op.padded
        s.fastest = s.safety * np.sqrt(rows.speed_square(w, op.padded) / op.length) + SLACK
    s.due = step
    s.quiet = -1
    for m in range(op.points):
        w.due[m] = -1.0
        w.known_at[m] = -1.0
    if op.points > MOST_NEAR:
        for g in range(GROUP_ROOM):
            w.group_due[g] = -1.0
            w.group_known_at[g] = -1.0


@jit
def bend(s, op, w, across, pool, ratio, most):
    """Tunes the slot to `ratio` times the operators' frequencies without a jump of displacement or velocity.

    Modes that get above `most` (rad/s) are not heard any more.
    """
    tune(op, w, pool, ratio)
    if s.across:
        tune(op, across, pool, ratio)
    s.ratio = ratio
    s.heard = op.tap_modes
    if ratio > 1.0:
        while s.heard > 0 and w.omega[min(s.heard, op.modes) - 1] > most:
            s.heard -= BLOCK


@jit
def tune(op, w, pool, ratio):
    """Coefficients of one polarisation for frequencies `ratio` times the operators'."""
    base = op.start + (OMEGA - FINE_A) * ROW
    for j in range(op.padded):
        # sigma stays, the undamped frequency scales; sigma << omega
        w.omega[j] = pool[base + j] * ratio
    rows.retune(w, ratio, op.fine, op.steps, op.part_steps, op.padded)


@jit
def exchange(s, old, op, w, across, pool):
    """Makes the sounding slot `s` go on with `op`, untuned."""
    change_operator(old, op, w, pool)
    if s.across:
        change_operator(old, op, across, pool)
        s.swaying = op.padded
    s.ratio = 1.0
    s.heard = op.tap_modes
    s.active = op.padded


@jit
def change_operator(old, op, w, pool):
    """The motion of one polarisation goes on with `op` in place of `old`."""
    rows.exchange(w, min(old.modes, op.modes), op.padded)  # what only fills up a block has to stay at rest
    take_coefficients(op, w, pool)
    rows.from_velocity(w, op.padded)
    for m in range(op.points):
        w.solved_at[m] = -1.0


@jit
def weaken(s, op, w, across, factor):
    """Takes a motion back to what a string bears; one that is no number ends."""
    if factor > 0.0:
        rows.scale(w, factor, s.active)
        rows.scale(across, factor, s.swaying)
        for m in range(op.points):
            w.solved_at[m] = -1.0
            across.solved_at[m] = -1.0
    else:
        rows.clear(w, op.padded)
        rows.clear(across, op.padded)
        s.active = 0
        s.swaying = 0
        s.on = 0


@jit
def keep_house(s, op, w, across, pool, step):
    """Drops dead modes, and finds out whether a contact is still possible. At fixed frame numbers only."""
    n = rows.living(w, s.active)
    s.active = n
    if s.swaying:
        s.swaying = rows.living(across, s.swaying)
    if n == 0 and s.swaying == 0:
        s.on = 0
        return
    speed = np.sqrt(rows.speed_square(w, n) / op.length)
    most = max(speed, np.sqrt(rows.speed_square(across, s.swaying) / op.length)) if s.swaying else speed
    if not most < STEEPEST * op.speed:
        weaken(s, op, w, across, STEEPEST * op.speed / most)
        return
    if op.points == 0 or s.fading or s.quiet > step:
        return
    held = False
    lowest = np.inf
    for m in range(op.points):
        held = held or (w.solved_at[m] == step and (w.eta[m] > 0.0 or w.eta_before[m] > 0.0))
        lowest = min(lowest, -pool[op.start + OP_HEIGHT * ROW + m])
    if held:
        return
    s.fastest = min(s.fastest, s.safety * speed + SLACK)
    if np.sqrt(2.0 / op.length) * rows.amplitude_sum(w, n) < lowest:
        s.quiet = NEVER_STEP


def padded(modes: int) -> int:
    """Modes up to a whole BLOCK."""
    return -(-modes // BLOCK) * BLOCK


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
