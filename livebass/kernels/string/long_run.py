"""Passes over the modes of a held string that moves freely for LONG_RUN frames: what pickups sense in all of them.

In a frame a mode goes from (q, P) through its free motion to (x, y), and tension kicks it to y - k x (tension.py). This
map has the trace t = 2 a - b k and the determinant d = a^2 + b g. So whatever depends linearly on a mode obeys

    s_{n+2} = t s_{n+1} - d s_n

from frame to frame, exactly, and its velocity needs two multiplications a frame. This begins afresh in each run, from
the float64 state: in float32 it errs by some 1e-5 until the run ends. The tension is that in the middle of the run.
The state goes on by the passes of quartet.py.

A pickup's flux follows the displacement, which changes slowly: it is summed at every second frame over the float64
modes of u, by the same law for two frames, and lies half way in between. w is a working set, op an operator, n a number
of modes, whole BLOCKs. [any thread]
"""

import numpy as np

from livebass.kernels.string.modal import copy_row, jit, like, lower
from livebass.kernels.string.operators import high_part, low_part, tap_row
from livebass.kernels.string.quartet import half_later
from livebass.kernels.string.records import FOUR, WHOLE


@jit
def law(rows, j, push):
    """Trace and determinant of a frame of mode `j` under tension."""
    whole = rows.leaps[WHOLE]
    a, b = whole.a[j], whole.b[j]
    return like(rows, 2.0) * a - push * rows.kick[j] * b, a * a + b * whole.g[j]


@jit
def prepare(w, op, pickups):
    """Copies the modes' weights at the pickups, unless they are up to date; after quartet.prepare."""
    if w.spanned == 2:
        return
    w.spanned = 2
    n = lower(w, op.padded)
    for k in range(pickups):
        row, weights = tap_row(op, k), w.weights[k]
        copy_row(weights, low_part(row, op), n)
        copy_row(weights[n:], high_part(row, op), op.padded - n)


@jit
def begin_of(rows, n, push, speed, later, turn, fall):
    push = like(rows, push)
    for j in range(n):
        q, p = rows.q[j], rows.p[j]
        t, d = law(rows, j, push)
        x = rows.leaps[WHOLE].a[j] * q + rows.leaps[WHOLE].b[j] * p
        after = rows.later_p[j] * p + rows.later_q[j] * q - rows.pace[j] * push * rows.kick[j] * x
        speed[j] = np.float32(rows.pace[j] * p - rows.sigma[j] * q)
        later[j] = np.float32(after)
        turn[j] = np.float32(t)
        fall[j] = np.float32(d)


@jit
def begin(w, n, push):
    """Prepares the velocities of the lowest `n` modes for `next_four`, from the present frame on."""
    k = lower(w, n)
    begin_of(w.low, k, push, w.speed, w.later, w.turn, w.fall)
    begin_of(w.high, n - k, push, w.speed[k:], w.later[k:], w.turn[k:], w.fall[k:])


@jit
def next_four(w, n, one, two):
    """Velocities (m/s) at the pickups `one` and `two` in the next four frames."""
    weight, other = w.weights[one], w.weights[two]
    v0 = v1 = v2 = v3 = w0 = w1 = w2 = w3 = np.float32(0.0)
    for j in range(n):
        t, d = w.turn[j], w.fall[j]
        a, b = w.speed[j], w.later[j]
        v0 += weight[j] * a
        w0 += other[j] * a
        v1 += weight[j] * b
        w1 += other[j] * b
        a = t * b - d * a
        b = t * a - d * b
        v2 += weight[j] * a
        w2 += other[j] * a
        v3 += weight[j] * b
        w3 += other[j] * b
        a = t * b - d * a
        w.speed[j] = a
        w.later[j] = t * a - d * b
    return (v0, v1, v2, v3), (w0, w1, w2, w3)


@jit
def displacements(w, n, op, k, push):
    """Displacements (m) of the lowest `n` modes, float64, at pickup `k`, in every second frame, up to that after it."""
    rows, phi = w.low, low_part(tap_row(op, k), op)
    u0 = u1 = u2 = u3 = u4 = u5 = u6 = u7 = u8 = 0.0
    for j in range(n):
        a, p = rows.q[j], rows.p[j]
        t, d = law(rows, j, push)
        t, d = t * t - 2.0 * d, d * d
        b = half_later(rows, FOUR, j, a, p)
        u0 += phi[j] * a
        u1 += phi[j] * b
        a = t * b - d * a
        b = t * a - d * b
        u2 += phi[j] * a
        u3 += phi[j] * b
        a = t * b - d * a
        b = t * a - d * b
        u4 += phi[j] * a
        u5 += phi[j] * b
        a = t * b - d * a
        b = t * a - d * b
        u6 += phi[j] * a
        u7 += phi[j] * b
        u8 += phi[j] * (t * b - d * a)
    return u0, u1, u2, u3, u4, u5, u6, u7, u8
