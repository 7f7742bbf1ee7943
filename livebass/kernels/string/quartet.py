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
    at,
    at_two,
    four,
    from_mode_of_both,
    jit,
    like,
    lower,
    number_like,
    one,
    over,
)
from livebass.kernels.string.operators import tap_row
from livebass.kernels.string.records import QUARTET, TWO, WHOLE

KICKED, TURNED = 2.0, 1.0  # rad, in four frames and in one


@jit
def fours(low, high):
    return four(low[0], high[0]), four(low[1], high[1])


# Coefficients


@jit
def prepare_of(rows, n, first, omega, ideal, h, kicked):
    whole, two = rows.leaps[WHOLE], rows.leaps[TWO]
    for j in range(n):
        a, b, g = whole.a[j], whole.b[j], whole.g[j]
        two.a[j] = a * a - b * g
        two.b[j] = like(rows, 2.0) * a * b
        two.g[j] = like(rows, 2.0) * a * g
        rows.later_q[j] = -(rows.pace[j] * g + rows.sigma[j] * a)
        rows.later_p[j] = rows.pace[j] * a - rows.sigma[j] * b
        number = number_like(rows, first + j)
        turn = like(rows, h * max(omega[j], ideal * np.float64(number)))
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
    ideal = np.pi / op.length * op.speed  # rad/s, of the fundamental without a bend, which limits the tension, too
    prepare_of(w.low, split, np.int64(0), w.omega, ideal, h, KICKED)
    prepare_of(w.high, op.padded - split, split, w.omega[split:], ideal, h, 0.0)


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


@jit
def complete(rows, j, x, y, kept):
    """Moves mode `j` from its state in the middle to the end, and keeps the one before in q_before and p_before."""
    two = rows.leaps[TWO]
    rows.q_before[j] = rows.q[j]
    rows.p_before[j] = rows.p[j]
    rows.q[j] = kept * (two.a[j] * x + two.b[j] * y)
    rows.p[j] = kept * (two.a[j] * y - two.g[j] * x)


@jit
def advance_of(rows, first, n, push, kept):
    push, kept = like(rows, push), like(rows, kept)
    for j in range(np.uint64(first), np.uint64(n)):  # a signed index might count from the end: that does not vectorise
        x, y = middle(rows, j, rows.q[j], rows.p[j], push)
        complete(rows, j, x, y, kept)


@jit
def advance(w, first, n, push, kept):
    """Moves the modes from `first` on by four frames, and multiplies the motion by `kept`."""
    split = w.split
    advance_of(w.low, min(first, split), lower(w, n), push, kept)
    advance_of(w.high, max(first - split, 0), max(n - split, 0), push, kept)


@over()
@jit
def restore(rows, n):
    """Takes `complete` back."""
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


@at(four, tap_row)
@jit
def play_1(rows, n, weight, push, kept):
    """Velocities (m/s) in four frames at the pickup of a tap; moves the modes on by these."""
    push, kept = like(rows, push), like(rows, kept)
    v0 = v1 = v2 = v3 = like(rows, 0.0)
    for j in range(n):
        q, p = rows.q[j], rows.p[j]
        v0 += weight[j] * velocity_at(rows, j, q, p)
        v1 += weight[j] * velocity_later(rows, j, q, p)
        x, y = middle(rows, j, q, p, push)
        v2 += weight[j] * velocity_at(rows, j, x, y)
        v3 += weight[j] * velocity_later(rows, j, x, y)
        complete(rows, j, x, y, kept)
    return v0, v1, v2, v3


@at_two(fours, tap_row)
@jit
def play_2(rows, n, taps, push, kept):
    """`play_1` at two pickups."""
    weight, other = taps
    push, kept = like(rows, push), like(rows, kept)
    v0 = v1 = v2 = v3 = w0 = w1 = w2 = w3 = like(rows, 0.0)
    for j in range(n):
        q, p = rows.q[j], rows.p[j]
        now, later = velocity_at(rows, j, q, p), velocity_later(rows, j, q, p)
        v0 += weight[j] * now
        w0 += other[j] * now
        v1 += weight[j] * later
        w1 += other[j] * later
        x, y = middle(rows, j, q, p, push)
        now, later = velocity_at(rows, j, x, y), velocity_later(rows, j, x, y)
        v2 += weight[j] * now
        w2 += other[j] * now
        v3 += weight[j] * later
        w3 += other[j] * later
        complete(rows, j, x, y, kept)
    return (v0, v1, v2, v3), (w0, w1, w2, w3)


@at(four, tap_row)
@jit
def sense(rows, n, weight, push):
    """The velocities of `play_1`; nothing moves."""
    push = like(rows, push)
    v0 = v1 = v2 = v3 = like(rows, 0.0)
    for j in range(n):
        q, p = rows.q[j], rows.p[j]
        v0 += weight[j] * velocity_at(rows, j, q, p)
        v1 += weight[j] * velocity_later(rows, j, q, p)
        x, y = middle(rows, j, q, p, push)
        v2 += weight[j] * velocity_at(rows, j, x, y)
        v3 += weight[j] * velocity_later(rows, j, x, y)
    return v0, v1, v2, v3


@jit
def displace(w, n, push):
    """Fills w.q and w.p with the displacements of the lowest `n` modes, float64, in two and in four frames."""
    rows = w.low
    for j in range(n):
        x, y = middle(rows, j, rows.q[j], rows.p[j], push)
        w.q[j] = x
        w.p[j] = after_two(rows, j, x, y)


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
def displacements(w, phi, n):
    """Displacements (m) of the lowest `n` modes, float64, weighted by `phi`: now, and as in w.q and in w.p."""
    now = then = last = 0.0
    for j in range(n):
        now += phi[j] * w.low.q[j]
        then += phi[j] * w.q[j]
        last += phi[j] * w.p[j]
    return now, then, last
