"""How clear of the string its contact points are, and how long for sure: over frets and boards alike. [any thread]"""

import numpy as np

from livebass import rows
from livebass.kernels import jit
from livebass.layout import CLEARANCE, CLEARANCE_NOW, DUE, ETA, ETA_OLD, KNOWN, OP_HEIGHT, ROW, STAMP

C0, C1, KN, DU = CLEARANCE * ROW, CLEARANCE_NOW * ROW, KNOWN * ROW, DUE * ROW
EN, EO, ST = ETA * ROW, ETA_OLD * ROW, STAMP * ROW
NEVER = float(1 << 60)


@jit
def height(op, pool, m):
    return pool[op.start + OP_HEIGHT * ROW + m]


@jit
def suspicious(op, w, pool, o, m, step, end, way, n):
    """Whether point m, its shape at pool[o], may touch between `step` and `end`; CLEARANCE_NOW tells of the end."""
    clear = rows.displacement(w, pool, o, n) - height(op, pool, m)
    w[C1 + m] = clear
    known = w[KN + m]
    if 0 <= known < step and w[C0 + m] + clear > way * (end - known):
        return False
    if known < step:
        w[C0 + m] = rows.displacement_old(w, pool, o, n) - height(op, pool, m)
        w[KN + m] = step
    held = w[ST + m] == step and (w[EN + m] > 0.0 or w[EO + m] > 0.0)
    return held or w[C0 + m] <= 0.0 or w[C0 + m] + clear <= way * (end - step)


@jit
def stayed_clear(w, looked, count, end, way):
    """The points in `looked` did not touch up to `end`."""
    for i in range(count):
        m = looked[i]
        w[C0 + m] = w[C1 + m]
        w[KN + m] = end
        w[DU + m] = end + np.floor(w[C1 + m] / way)


@jit
def before_contact(w, suspects, count, step):
    """Of a point that was solved for up to `step` the penetration is known."""
    for i in range(count):
        m = suspects[i]
        if w[ST + m] == step:
            w[C0 + m] = -w[EN + m]


@jit
def after_contact(w, suspects, count, end, way):
    """The clearances of all suspects are those at `end`."""
    for i in range(count):
        m = suspects[i]
        w[KN + m] = end
        w[DU + m] = end
        if w[C0 + m] > 0.0:
            w[DU + m] = end + np.floor(w[C0 + m] / way)
