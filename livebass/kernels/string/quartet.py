"""Passes over the modes of a string that moves freely for four frames: all four at once.

A mode goes from (q, P) over two frames to (x, y), where the tension that the motion adds acts for all four, and then
over two more. On the way it is sensed in each frame. A frame after (q, P) its velocity is later_q q + later_p P.

Tension, whose kick in a single frame is P <- P - a q (tension.py), acts by three shears: P <- P - c q, q <- q + d P,
P <- P - c q. A mode that turns by less than KICKED rad in four frames is kicked: c = 2 a, d = 0. A faster one would
resonate with kicks so far apart; it turns ahead instead, by the angle that kicks of all phases make on average: with
a / (2 kappa omega) a frame, c = a and d = 2 a / (kappa omega)^2. Shears keep the area, so neither gains energy.

A pickup's flux follows the displacement, which changes slowly: it is summed at every second frame over the float64
modes of u, and lies half way in between. w is a working set, op an operator, n a number of modes, whole BLOCKs.
[any thread]
"""

import numpy as np

from livebass.kernels.string.modal import (
    at_of_both,
    at_two_of_both,
    from_mode_of_both,
    jit,
    like,
    lower,
    number_like,
    one,
    over,
    velocity,
)
from livebass.kernels.string.operators import low_part, tap_row
from livebass.kernels.string.records import QUARTET, TWO, WHOLE

KICKED, TURNED = 2.0, 1.0  # rad, in four frames and in one


@jit
def four(low, high):
    return low[0] + high[0], low[1] + high[1], low[2] + high[2], low[3] + high[3]


@jit
def fours(low, high):
    return four(low[0], high[0]), four(low[1], high[1])


# Coefficients


@jit
def prepare_of(rows, n, first, omega, h, kicked):
    whole, two = rows.leaps[WHOLE], rows.leaps[TWO]
    for j in range(n):
        a, b, g = whole.a[j], whole.b[j], whole.g[j]
        two.a[j] = a * a - b * g
        two.b[j] = like(rows, 2.0) * a * b
        two.g[j] = like(rows, 2.0) * a * g
        rows.later_q[j] = -(rows.pace[j] * g + rows.sigma[j] * a)
        rows.later_p[j] = rows.pace[j] * a - rows.sigma[j] * b
        number, turn = number_like(rows, first + j), like(rows, omega[j] * h)
        pull = like(rows, 0.5 * QUARTET) * rows.tense[j]
        give = like(rows, 0.5 * QUARTET) * number * number * rows.pace[j] / like(rows, omega[j] * omega[j])
        kick = like(rows, QUARTET) * turn < kicked
        rows.pull[j] = pull if kick else like(rows, 0.5) * pull if turn < like(rows, TURNED) else like(rows, 0.0)
        rows.give[j] = give if not kick and turn < like(rows, TURNED) else like(rows, 0.0)


@jit
def prepare(w, op):
    """Sets the coefficients for four frames, unless they are up to date."""
    if w.fours:
        return
    w.fours = 1
    split, h = w.split, op.steps * op.fine
    prepare_of(w.low, split, np.int64(0), w.omega, h, KICKED)
    prepare_of(w.high, op.padded - split, split, w.omega[split:], h, 0.0)


# Motion


@jit
def middle(rows, j, q, p, push):
    """(q, P) of mode `j` two frames later, after the tension of four frames."""
    two = rows.leaps[TWO]
    x, y = two.a[j] * q + two.b[j] * p, two.a[j] * p - two.g[j] * q
    pull = push * rows.pull[j]
    y -= pull * x
    x += push * rows.give[j] * y
    return x, y - pull * x


@jit
def after_two(rows, j, q, p):
    """Displacement of mode `j` two frames after (q, P)."""
    return rows.leaps[TWO].a[j] * q + rows.leaps[TWO].b[j] * p


@over()
@jit
def advance(rows, n, push, kept):
    """Moves four frames, and multiplies the motion by `kept`; q_before and p_before keep the previous state."""
    push, kept, two = like(rows, push), like(rows, kept), rows.leaps[TWO]
    for j in range(n):
        q, p = rows.q[j], rows.p[j]
        rows.q_before[j] = q
        rows.p_before[j] = p
        x, y = middle(rows, j, q, p, push)
        rows.q[j] = kept * (two.a[j] * x + two.b[j] * y)
        rows.p[j] = kept * (two.a[j] * y - two.g[j] * x)


@over()
@jit
def restore(rows, n):
    """Takes `advance` back."""
    for j in range(n):
        rows.q[j] = rows.q_before[j]
        rows.p[j] = rows.p_before[j]


@from_mode_of_both(one)
@jit
def slope_square_ahead(rows, across, n, first):
    """Sum of u's and v's (j q_j)^2 in two frames, j from 1."""
    s = like(rows, 0.0)
    for j in range(n):
        number = number_like(rows, first + j)
        x, r = after_two(rows, j, rows.q[j], rows.p[j]), after_two(across, j, across.q[j], across.p[j])
        s += number * number * (x * x + r * r)
    return s


@jit
def fade_each_of(rows, kept, n):
    for j in range(n):
        rows.q[j] *= kept[j]
        rows.p[j] *= kept[j]


@jit
def fade_each(w, kept, high, n):
    """Multiplies the motion of each mode by its own factor; `high` holds the factors of the modes in w.high."""
    split = lower(w, n)
    fade_each_of(w.low, kept, split)
    fade_each_of(w.high, high, n - split)


@jit
def momentum_along_of(rows, across, shape, n):
    x = x_v = like(rows, 0.0)
    for j in range(n):
        x += shape[j] * rows.p[j]
        x_v += shape[j] * across.p[j]
    return x, x_v


@jit
def take_along_of(rows, across, shape, x, x_v, n):
    x, x_v = like(rows, x), like(rows, x_v)
    for j in range(n):
        rows.p[j] -= x * shape[j]
        across.p[j] -= x_v * shape[j]


@jit
def apply_dashpot(u, v, shape, high, c, n):
    """Removes the part `c` of u's and v's momentum along `shape`; `high` holds it for the modes in w.high."""
    split = lower(u, n)
    x, x_v = momentum_along_of(u.low, v.low, shape, split)
    above, above_v = momentum_along_of(u.high, v.high, high, n - split)
    take_along_of(u.low, v.low, shape, c * (x + above), c * (x_v + above_v), split)
    take_along_of(u.high, v.high, high, c * (x + above), c * (x_v + above_v), n - split)


# Senses


@jit
def velocity_later(rows, j, q, p):
    """Velocity of mode `j` a frame after (q, P)."""
    return rows.later_p[j] * p + rows.later_q[j] * q


@jit
def velocity_at(rows, j, q, p):
    """Velocity of mode `j` at (q, P)."""
    return rows.pace[j] * p - rows.sigma[j] * q


@at_of_both(four, tap_row)
@jit
def sense_1(rows, across, n, weight, heard, push):
    """Velocities (m/s) in four frames at the pickup of a tap: u's with the part `heard` of v's."""
    heard, push = like(rows, heard), like(rows, push)
    v0 = v1 = v2 = v3 = like(rows, 0.0)
    for j in range(n):
        q, p, r, s = rows.q[j], rows.p[j], across.q[j], across.p[j]
        v0 += weight[j] * (velocity(rows, j) + heard * velocity(across, j))
        v1 += weight[j] * (velocity_later(rows, j, q, p) + heard * velocity_later(across, j, r, s))
        q, p = middle(rows, j, q, p, push)
        r, s = middle(across, j, r, s, push)
        v2 += weight[j] * (velocity_at(rows, j, q, p) + heard * velocity_at(across, j, r, s))
        v3 += weight[j] * (velocity_later(rows, j, q, p) + heard * velocity_later(across, j, r, s))
    return v0, v1, v2, v3


@at_two_of_both(fours, tap_row)
@jit
def sense_2(rows, across, n, taps, heard, push):
    """`sense_1` at the one pickup and at the other, with the parts `heard` of v."""
    weight, other = taps
    of_v, of_v_there, push = like(rows, heard[0]), like(rows, heard[1]), like(rows, push)
    v0 = v1 = v2 = v3 = w0 = w1 = w2 = w3 = like(rows, 0.0)
    for j in range(n):
        q, p, r, s = rows.q[j], rows.p[j], across.q[j], across.p[j]
        moving, aside = velocity(rows, j), velocity(across, j)
        v0 += weight[j] * (moving + of_v * aside)
        w0 += other[j] * (moving + of_v_there * aside)
        moving, aside = velocity_later(rows, j, q, p), velocity_later(across, j, r, s)
        v1 += weight[j] * (moving + of_v * aside)
        w1 += other[j] * (moving + of_v_there * aside)
        q, p = middle(rows, j, q, p, push)
        r, s = middle(across, j, r, s, push)
        moving, aside = velocity_at(rows, j, q, p), velocity_at(across, j, r, s)
        v2 += weight[j] * (moving + of_v * aside)
        w2 += other[j] * (moving + of_v_there * aside)
        moving, aside = velocity_later(rows, j, q, p), velocity_later(across, j, r, s)
        v3 += weight[j] * (moving + of_v * aside)
        w3 += other[j] * (moving + of_v_there * aside)
    return (v0, v1, v2, v3), (w0, w1, w2, w3)


@jit
def displacements_of(rows, n, weight, push):
    push = like(rows, push)
    u0 = u2 = u4 = like(rows, 0.0)
    for j in range(n):
        q, p = rows.q[j], rows.p[j]
        x, y = middle(rows, j, q, p, push)
        u0 += weight[j] * q
        u2 += weight[j] * x
        u4 += weight[j] * after_two(rows, j, x, y)
    return u0, u2, u4


@jit
def displacements(u, n, op, tap, push):
    """Displacements (m) of u's float64 modes at the pickup of a tap, now, in two and in four frames."""
    return displacements_of(u.low, lower(u, n), low_part(tap_row(op, tap), op), push)


# A look ahead (looks.py)


@jit
def foresee(w, n):
    """Fills w.q and w.p with the displacements of the lowest `n` modes, float64, in 8 and in 16 frames.

    Returns the sums of their amplitudes of velocity, m^1.5/s, and of acceleration, m^1.5/s^2.
    """
    rows, fast, s = w.low, 0.0, 0.0
    for j in range(n):
        q, p, omega = rows.q[j], rows.p[j], w.omega[j]
        a, b, g = rows.leaps[TWO].a[j], rows.leaps[TWO].b[j], rows.leaps[TWO].g[j]
        a, b, g = a * a - b * g, 2.0 * a * b, 2.0 * a * g
        a, b, g = a * a - b * g, 2.0 * a * b, 2.0 * a * g
        x, y = a * q + b * p, a * p - g * q
        w.q[j] = x
        w.p[j] = a * x + b * y
        moving, turned = rows.pace[j] * p, omega * q
        size = np.sqrt(moving * moving + turned * turned)
        fast += size
        s += omega * size
    return fast, s


@jit
def amplitudes_of(rows, n, omega):
    s = like(rows, 0.0)
    for j in range(n):
        q, y = rows.q[j], rows.pace[j] * rows.p[j] / like(rows, omega[j])
        s += np.sqrt(q * q + y * y)
    return s


@jit
def amplitudes_above(w, n):
    """Sum of the amplitudes of the modes above `w.split`, of the first `n`, m^1.5."""
    return np.float64(amplitudes_of(w.high, max(n - w.split, 0), w.omega[w.split :]))


@jit
def displacements_ahead(w, phi, n):
    """Displacements (m) of the lowest `n` modes at a contact point with shapes `phi`: now, in 8 and in 16 frames."""
    u0 = u8 = u16 = 0.0
    for j in range(n):
        u0 += phi[j] * w.low.q[j]
        u8 += phi[j] * w.q[j]
        u16 += phi[j] * w.p[j]
    return u0, u8, u16
