"""Passes over the modes of a string that moves freely for a span of frames: all at once. A quartet is heard here.

A mode goes from (q, P) over half the span to (x, y), where the tension that the motion adds acts for all its frames,
and then over the other half. A quartet is sensed in each frame on the way. A frame after (q, P) a mode's velocity is
later_q q + later_p P. The coefficients of a quartet are rows.spans[FOUR], those of a long run (long_run.py) [MANY].

Tension, whose kick in a single frame is P <- P - a q (tension.py), acts by three shears: P <- P - c q, q <- q + d P,
P <- P - c q. A mode that turns by less than KICKED rad in N frames is kicked: c = a N / 2, d = 0. A faster one would
resonate with kicks so far apart; it turns ahead instead, by the angle that kicks of all phases make on average: with
a / (2 kappa omega) a frame, c = a N / 4 and d = a N / 2 / (kappa omega)^2. Shears keep the area, so neither gains
energy.

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
from livebass.kernels.string.records import EIGHT, FOUR, LONG_RUN, MANY, QUARTET, TWO, WHOLE

KICKED, TURNED = 2.0, 1.0  # rad, in a span and in one frame


@jit
def fours(low, high):
    return four(low[0], high[0]), four(low[1], high[1])


# Coefficients


@jit
def twice(rows, a, b, g):
    """Coefficients of a leap over twice the time."""
    return a * a - b * g, like(rows, 2.0) * a * b, like(rows, 2.0) * a * g


@jit
def prepare_of(rows, n, first, omega, ideal, h, kicked):
    whole, two, eight = rows.leaps[WHOLE], rows.leaps[TWO], rows.leaps[EIGHT]
    none, half = like(rows, 0.0), like(rows, 0.5)
    for j in range(n):
        a, b, g = whole.a[j], whole.b[j], whole.g[j]
        rows.later_q[j] = -(rows.pace[j] * g + rows.sigma[j] * a)
        rows.later_p[j] = rows.pace[j] * a - rows.sigma[j] * b
        a, b, g = twice(rows, a, b, g)
        two.a[j], two.b[j], two.g[j] = a, b, g
        a, b, g = twice(rows, a, b, g)
        eight.a[j], eight.b[j], eight.g[j] = twice(rows, a, b, g)
        number = number_like(rows, first + j)
        turn = like(rows, h * max(omega[j], ideal * np.float64(number)))
        slow = turn < like(rows, TURNED)
        pull = rows.tense[j] if slow else none
        give = number * number * rows.pace[j] / like(rows, omega[j] * omega[j]) if slow else none
        rows.kick[j] = pull
        for which, frames in ((FOUR, like(rows, 0.5 * QUARTET)), (MANY, like(rows, 0.5 * LONG_RUN))):
            kick = like(rows, 2.0) * frames * turn < kicked
            rows.spans[which].pull[j] = frames * pull if kick else half * frames * pull
            rows.spans[which].give[j] = none if kick else frames * give


@jit
def prepare(w, op):
    """Sets the coefficients for many frames at once, unless they are up to date."""
    if w.spanned:
        return
    w.spanned = 1
    split, h = w.split, op.steps * op.fine
    ideal = np.pi / op.length * op.speed  # rad/s, of the fundamental without a bend, which limits the tension, too
    prepare_of(w.low, split, np.int64(0), w.omega, ideal, h, KICKED)
    prepare_of(w.high, op.padded - split, split, w.omega[split:], ideal, h, 0.0)


# Motion


@jit
def middle(rows, which, j, q, p, push):
    """(q, P) of mode `j` half the span `which` later, after the tension of all its frames."""
    half, span = rows.leaps[TWO + which], rows.spans[which]
    x, y = half.a[j] * q + half.b[j] * p, half.a[j] * p - half.g[j] * q
    pull = push * span.pull[j]
    y -= pull * x
    x += push * span.give[j] * y
    return x, y - pull * x


@jit
def half_later(rows, which, j, q, p):
    """Displacement of mode `j` half the span `which` after (q, P)."""
    return rows.leaps[TWO + which].a[j] * q + rows.leaps[TWO + which].b[j] * p


@jit
def complete(rows, which, j, x, y, kept):
    """Moves mode `j` from its state in the middle to the end, and keeps the one before in q_before and p_before."""
    half = rows.leaps[TWO + which]
    rows.q_before[j] = rows.q[j]
    rows.p_before[j] = rows.p[j]
    rows.q[j] = kept * (half.a[j] * x + half.b[j] * y)
    rows.p[j] = kept * (half.a[j] * y - half.g[j] * x)


@jit
def advance_of(rows, which, first, n, push, kept):
    push, kept = like(rows, push), like(rows, kept)
    for j in range(np.uint64(first), np.uint64(n)):  # a signed index might count from the end: that does not vectorise
        x, y = middle(rows, which, j, rows.q[j], rows.p[j], push)
        complete(rows, which, j, x, y, kept)


@jit
def advance(w, which, first, n, push, kept):
    """Moves the modes from `first` on by the span `which`, and multiplies the motion by `kept`."""
    split = w.split
    advance_of(w.low, which, min(first, split), lower(w, n), push, kept)
    advance_of(w.high, which, max(first - split, 0), max(n - split, 0), push, kept)


@over()
@jit
def restore(rows, n):
    """Takes `complete` back."""
    for j in range(n):
        rows.q[j] = rows.q_before[j]
        rows.p[j] = rows.p_before[j]


@from_mode_of_both(one)
@jit
def slope_square_ahead(rows, across, n, first, which):
    """Sum of u's and v's (j q_j)^2 in the middle of the span `which`, j from 1."""
    s = like(rows, 0.0)
    for j in range(n):
        number = number_like(rows, first + j)
        x = half_later(rows, which, j, rows.q[j], rows.p[j])
        r = half_later(across, which, j, across.q[j], across.p[j])
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
        x, y = middle(rows, FOUR, j, q, p, push)
        v2 += weight[j] * velocity_at(rows, j, x, y)
        v3 += weight[j] * velocity_later(rows, j, x, y)
        complete(rows, FOUR, j, x, y, kept)
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
        x, y = middle(rows, FOUR, j, q, p, push)
        now, later = velocity_at(rows, j, x, y), velocity_later(rows, j, x, y)
        v2 += weight[j] * now
        w2 += other[j] * now
        v3 += weight[j] * later
        w3 += other[j] * later
        complete(rows, FOUR, j, x, y, kept)
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
        x, y = middle(rows, FOUR, j, q, p, push)
        v2 += weight[j] * velocity_at(rows, j, x, y)
        v3 += weight[j] * velocity_later(rows, j, x, y)
    return v0, v1, v2, v3


@jit
def displace(w, n, push):
    """Fills w.q and w.p with the displacements of the lowest `n` modes, float64, in two and in four frames."""
    rows = w.low
    for j in range(n):
        x, y = middle(rows, FOUR, j, rows.q[j], rows.p[j], push)
        w.q[j] = x
        w.p[j] = half_later(rows, FOUR, j, x, y)


# A look ahead (looks.py)


@jit
def foresee(w, n, which):
    """Fills w.q and w.p with displacements of the lowest `n` modes, float64, in half and in all of the span `which`.

    Returns the sums of their amplitudes of velocity, m^1.5/s, and of acceleration, m^1.5/s^2.
    """
    rows, fast, s = w.low, 0.0, 0.0
    half = rows.leaps[TWO + which]
    for j in range(n):
        q, p, omega = rows.q[j], rows.p[j], w.omega[j]
        a, b, g = half.a[j], half.b[j], half.g[j]
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
