"""How clear of the string its contact points are, and how long for sure: over frets and boards alike. [any thread]"""

import numpy as np

from livebass import rows
from livebass.kernels import jit
from livebass.layout import OP_HEIGHT, ROW

NEVER = float(1 << 60)


@jit
def height(op, pool, m):
    return pool[op.start + OP_HEIGHT * ROW + m]


@jit
def suspicious(op, w, pool, o, m, step, end, way, n):
    """Whether point m, its shape at pool[o], may touch between `step` and `end`; CLEARANCE_NOW tells of the end."""
    clear = rows.displacement(w, pool, o, n) - height(op, pool, m)
    w.clearance_now[m] = clear
    known = w.known_at[m]
    if 0 <= known < step and w.clearance[m] + clear > way * (end - known):
        return False
    if known < step:
        w.clearance[m] = rows.displacement_old(w, pool, o, n) - height(op, pool, m)
        w.known_at[m] = step
    held = w.solved_at[m] == step and (w.eta[m] > 0.0 or w.eta_before[m] > 0.0)
    return held or w.clearance[m] <= 0.0 or w.clearance[m] + clear <= way * (end - step)


@jit
def stayed_clear(w, looked, count, end, way):
    """The points in `looked` did not touch up to `end`."""
    for i in range(count):
        m = looked[i]
        w.clearance[m] = w.clearance_now[m]
        w.known_at[m] = end
        w.due[m] = end + np.floor(w.clearance_now[m] / way)


@jit
def before_contact(w, suspects, count, step):
    """Of a point that was solved for up to `step` the penetration is known."""
    for i in range(count):
        m = suspects[i]
        if w.solved_at[m] == step:
            w.clearance[m] = -w.eta[m]


@jit
def after_contact(w, suspects, count, end, way):
    """The clearances of all suspects are those at `end`."""
    for i in range(count):
        m = suspects[i]
        w.known_at[m] = end
        w.due[m] = end
        if w.clearance[m] > 0.0:
            w.due[m] = end + np.floor(w.clearance[m] / way)
