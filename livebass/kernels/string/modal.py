"""Passes over the modes of a string: all arithmetic whose cost grows with their number.

A mode is (q, P). q is its displacement; P = E s p is its momentum scaled to the fine step dt, with
E = exp(-sigma dt), s = sin(omega dt), p = (q' + sigma q) / omega. One fine step without force is then

    q <- a q + P,   P <- a P - b q,   a = E cos(omega dt),  b = (E s)^2

and k fine steps at once, exactly, with three numbers: q <- A q + B P, P <- A P - G q.

Fine steps with contact are taken one by one, in (q, d), d = q^n - q^{n-1}, which float32 can carry:

    d <- E^2 d - s q,   q <- q + d,   s = (1 - E)^2 + 4 E sin^2(omega dt / 2).

A force f of eq. 12 acting during a step adds dt^2 dx/mu phi f to q and to d, after the step: this is the scheme of
eq. 12, q^{n+1} = C q^n - Ct q^{n-1} + F, with the difference of two displacements as a number of its own, which loses
no digits. The first of them has no force before it, and turns (q, P) into (q, d) on its way: d = P - (1 - a) q,
1 - a = (s + l) / 2, l = 1 - E^2. `to_momenta` turns it back: P = E^2 d - (E^2 - a) q, E^2 - a = (s - l) / 2. E^2
rounded to float32 is another damping, in all of these the same, and never above 1; s, which makes the frequency, is
small, and keeps its digits where nothing adds it to 1 (`ordered`).

The lowest `split` modes of a working set are float64, in the rows w.low, those above may be float32, in w.high: each
loop stands here once, for the rows of either width, and is compiled for both. In it a number of float64 would make the
whole loop float64: `like` gives it the width of the rows. Sums are taken in the width of the rows, those of both are
added in float64. An event that computes with the state takes it out in float64 (`widen`) and puts it back (`narrow`).

Each loop reads a mode once and adds, multiplies and stores; exp and sin stand only where coefficients are made. The
compiler may reassociate sums into vector lanes (`LANES`), the same way each time on one kind of processor. Loops
vectorise because distances between the rows of a working set are constants (records.py). w is a working set, op an
operator, m a contact point of it, n a number of modes, whole BLOCKs. A function whose name ends in `_of` takes the
first n of `rows`, those of w.low or of w.high; `first` is the mode of rows[0] where that counts. [any thread]
"""

import numpy as np

from livebass.compiling import compiled
from livebass.kernels.machine.elementary import exp, sin_cos
from livebass.kernels.string import operators
from livebass.kernels.string.operators import (
    MOST_LEFT,
    SINGLE,
    coefficient_at,
    fine_coefficients,
    high_coefficient,
    high_shape,
    high_taps,
    low_coefficient,
    low_shape,
    low_taps,
)
from livebass.kernels.string.records import BLOCK, LONGER, PART, WHOLE

LANES = {"reassoc", "contract", "nsz", "arcp"}
jit = compiled(fastmath=LANES)
ordered = compiled(fastmath=LANES - {"reassoc"})  # sums as they are written
apart = compiled(fastmath=LANES, attributes="noinline")  # for events: many of them call it, of both widths

# m^1.5/s: a slower mode is silence (slot.silence_of), as pickups hear velocity. A loud one has 1: FAINT is 200 dB
# below that, ENDED, of a string whose note a hand has ended, 160 dB, less than 24 bits hold.
DEAD, FAINT, ENDED = 1e-13, 1e-10, 1e-8
MOST_TURN = 2 * np.pi * 0.45  # rad a fine step, of a mode that a string is played with


@jit
def mode_number(j):
    """The number j + 1 of mode `j`, from 1. Processors convert integers of 32 bits many at a time, of 64 bits not."""
    return np.float64(np.int32(j + 1))


@jit
def like(rows, x):
    """`x` in the width of the rows."""
    return rows.q.dtype.type(x)


@jit
def number_like(rows, j):
    """`mode_number` in the width of the rows."""
    return rows.q.dtype.type(np.int32(j + 1))


@jit
def lower(w, n):
    """How many of `n` modes are in w.low."""
    return min(w.split, n)


@ordered
def first_step_of(rows, n):
    half, one = like(rows, 0.5), like(rows, 1.0)
    for j in range(n):
        x = rows.q[j]
        d = rows.p[j] - half * ((one - rows.kept[j]) + rows.spring[j]) * x
        rows.p[j] = d
        rows.q[j] = x + d


@jit
def first_step(w, n):
    """Takes the first of the fine steps: (q, P) becomes (q, d) a step later."""
    split = lower(w, n)
    first_step_of(w.low, split)
    first_step_of(w.high, n - split)


@ordered
def first_step_before_leap_of(rows, n):
    half, one = like(rows, 0.5), like(rows, 1.0)
    for j in range(n):
        x = rows.q_before[j]
        d = rows.p_before[j] - half * ((one - rows.kept[j]) + rows.spring[j]) * x
        rows.p[j] = d
        rows.q[j] = x + d


@jit
def first_step_before_leap(w, n):
    """`first_step` from where the last `try_leap` began."""
    split = lower(w, n)
    first_step_before_leap_of(w.low, split)
    first_step_before_leap_of(w.high, n - split)


@ordered
def to_momenta_of(rows, n):
    half, one = like(rows, 0.5), like(rows, 1.0)
    for j in range(n):
        kept = rows.kept[j]
        rows.p[j] = kept * rows.p[j] - half * (rows.spring[j] - (one - kept)) * rows.q[j]


@ordered
def to_momenta_after_of(rows, phi, f, n):
    half, one, f = like(rows, 0.5), like(rows, 1.0), like(rows, f)
    for j in range(n):
        kick = f * phi[j]
        kept = rows.kept[j]
        x = rows.q[j] + kick
        rows.p[j] = kept * (rows.p[j] + kick) - half * (rows.spring[j] - (one - kept)) * x
        rows.q[j] = x


@jit
def to_momenta_after(w, op, m, f, n):
    """`kick` at point `m`, then `to_momenta`."""
    split = lower(w, n)
    to_momenta_after_of(w.low, low_shape(op, m), f, split)
    to_momenta_after_of(w.high, high_shape(op, m), f, n - split)


@jit
def to_momenta(w, n):
    """Turns (q, d) back into (q, P)."""
    split = lower(w, n)
    to_momenta_of(w.low, split)
    to_momenta_of(w.high, n - split)


# Fine steps after the first, and their forces, of (q, d). fine_1, fine_2 and fine_4 take one after the forces `f` at
# that many points, and return the displacements (m) there; a point may stand twice in the list, with the force 0 the
# second time. phi and chi are the mode shapes at the first two points, psi and xi at the others.
@jit
def fine_1_of(rows, phi, f, n):
    f0 = like(rows, f)
    u0 = like(rows, 0.0)
    for j in range(n):
        kick = f0 * phi[j]
        x, d = rows.q[j] + kick, rows.p[j] + kick
        d = rows.kept[j] * d - rows.spring[j] * x
        x += d
        rows.p[j] = d
        rows.q[j] = x
        u0 += phi[j] * x
    return u0


@jit
def fine_1(w, op, point, f, n):
    split = lower(w, n)
    u0 = fine_1_of(w.low, low_shape(op, point), f, split)
    v0 = fine_1_of(w.high, high_shape(op, point), f, n - split)
    return u0 + v0


@jit
def fine_2_of(rows, phi, chi, f, n):
    f0, f1 = like(rows, f[0]), like(rows, f[1])
    u0 = u1 = like(rows, 0.0)
    for j in range(n):
        kick = f0 * phi[j] + f1 * chi[j]
        x, d = rows.q[j] + kick, rows.p[j] + kick
        d = rows.kept[j] * d - rows.spring[j] * x
        x += d
        rows.p[j] = d
        rows.q[j] = x
        u0 += phi[j] * x
        u1 += chi[j] * x
    return u0, u1


@jit
def fine_2(w, op, points, f, n):
    split = lower(w, n)
    a, b = points
    u0, u1 = fine_2_of(w.low, low_shape(op, a), low_shape(op, b), f, split)
    v0, v1 = fine_2_of(w.high, high_shape(op, a), high_shape(op, b), f, n - split)
    return u0 + v0, u1 + v1


@jit
def fine_4_of(rows, phi, chi, psi, xi, f, n):
    f0, f1, f2, f3 = like(rows, f[0]), like(rows, f[1]), like(rows, f[2]), like(rows, f[3])
    u0 = u1 = u2 = u3 = like(rows, 0.0)
    for j in range(n):
        kick = f0 * phi[j] + f1 * chi[j] + f2 * psi[j] + f3 * xi[j]
        x, d = rows.q[j] + kick, rows.p[j] + kick
        d = rows.kept[j] * d - rows.spring[j] * x
        x += d
        rows.p[j] = d
        rows.q[j] = x
        u0 += phi[j] * x
        u1 += chi[j] * x
        u2 += psi[j] * x
        u3 += xi[j] * x
    return u0, u1, u2, u3


@jit
def fine_4(w, op, points, f, n):
    split = lower(w, n)
    a, b, c, d = points
    u0, u1, u2, u3 = fine_4_of(w.low, low_shape(op, a), low_shape(op, b), low_shape(op, c), low_shape(op, d), f, split)
    v0, v1, v2, v3 = fine_4_of(
        w.high, high_shape(op, a), high_shape(op, b), high_shape(op, c), high_shape(op, d), f, n - split
    )
    return u0 + v0, u1 + v1, u2 + v2, u3 + v3


@jit
def kick_of(rows, phi, f, n):
    f = like(rows, f)
    for j in range(n):
        x = f * phi[j]
        rows.q[j] += x
        rows.p[j] += x


@jit
def kick(w, op, m, f, n):
    """Adds the effect of one contact force at point `m`, after a fine step."""
    split = lower(w, n)
    kick_of(w.low, low_shape(op, m), f, split)
    kick_of(w.high, high_shape(op, m), f, n - split)


@jit
def fine_of(rows, n):
    for j in range(n):
        x, d = rows.q[j], rows.p[j]
        d = rows.kept[j] * d - rows.spring[j] * x
        x += d
        rows.p[j] = d
        rows.q[j] = x


@jit
def fine(w, n):
    """Takes one fine step, free."""
    split = lower(w, n)
    fine_of(w.low, split)
    fine_of(w.high, n - split)


@jit
def fine_kicked_2_of(rows, phi, chi, f, n):
    f0, f1 = like(rows, f[0]), like(rows, f[1])
    for j in range(n):
        kick = f0 * phi[j] + f1 * chi[j]
        x, d = rows.q[j] + kick, rows.p[j] + kick
        d = rows.kept[j] * d - rows.spring[j] * x
        x += d
        rows.p[j] = d
        rows.q[j] = x


@jit
def fine_kicked_2(w, op, points, f, n):
    """Takes one fine step after two forces `f` at two `points`."""
    split = lower(w, n)
    a, b = points
    fine_kicked_2_of(w.low, low_shape(op, a), low_shape(op, b), f, split)
    fine_kicked_2_of(w.high, high_shape(op, a), high_shape(op, b), f, n - split)


@jit
def fine_kicked_4_of(rows, phi, chi, psi, xi, f, n):
    f0, f1, f2, f3 = like(rows, f[0]), like(rows, f[1]), like(rows, f[2]), like(rows, f[3])
    for j in range(n):
        kick = f0 * phi[j] + f1 * chi[j] + f2 * psi[j] + f3 * xi[j]
        x, d = rows.q[j] + kick, rows.p[j] + kick
        d = rows.kept[j] * d - rows.spring[j] * x
        x += d
        rows.p[j] = d
        rows.q[j] = x


@jit
def fine_kicked_4(w, op, points, f, n):
    """Takes one fine step after four forces `f` at four `points`."""
    split = lower(w, n)
    a, b, c, d = points
    fine_kicked_4_of(w.low, low_shape(op, a), low_shape(op, b), low_shape(op, c), low_shape(op, d), f, split)
    fine_kicked_4_of(w.high, high_shape(op, a), high_shape(op, b), high_shape(op, c), high_shape(op, d), f, n - split)


@jit
def displacement_4_of(rows, phi, chi, psi, xi, n):
    u0 = u1 = u2 = u3 = like(rows, 0.0)
    for j in range(n):
        q = rows.q[j]
        u0 += phi[j] * q
        u1 += chi[j] * q
        u2 += psi[j] * q
        u3 += xi[j] * q
    return u0, u1, u2, u3


@jit
def displacement_4(w, op, points, n):
    """Displacements at four `points` in one pass."""
    split = lower(w, n)
    a, b, c, d = points
    u0, u1, u2, u3 = displacement_4_of(
        w.low, low_shape(op, a), low_shape(op, b), low_shape(op, c), low_shape(op, d), split
    )
    v0, v1, v2, v3 = displacement_4_of(
        w.high, high_shape(op, a), high_shape(op, b), high_shape(op, c), high_shape(op, d), n - split
    )
    return u0 + v0, u1 + v1, u2 + v2, u3 + v3


@jit
def leap_of(rows, which, n):
    a, b, g = rows.leaps[which].a, rows.leaps[which].b, rows.leaps[which].g
    for j in range(n):
        x = rows.q[j]
        y = rows.p[j]
        rows.q[j] = a[j] * x + b[j] * y
        rows.p[j] = a[j] * y - g[j] * x


@jit
def leap(w, which, n):
    """Takes many fine steps at once, free, by the coefficients leaps[which]."""
    split = lower(w, n)
    leap_of(w.low, which, split)
    leap_of(w.high, which, n - split)


@jit
def try_leap_of(rows, which, n):
    a, b, g = rows.leaps[which].a, rows.leaps[which].b, rows.leaps[which].g
    for j in range(n):
        x = rows.q[j]
        y = rows.p[j]
        rows.q_before[j] = x
        rows.p_before[j] = y
        rows.q[j] = a[j] * x + b[j] * y
        rows.p[j] = a[j] * y - g[j] * x


@jit
def try_leap(w, which, n):
    """Leaps, and keeps the state before in q_before and p_before."""
    split = lower(w, n)
    try_leap_of(w.low, which, split)
    try_leap_of(w.high, which, n - split)


@jit
def leap_from_before_of(rows, which, n):
    a, b, g = rows.leaps[which].a, rows.leaps[which].b, rows.leaps[which].g
    for j in range(n):
        x = rows.q_before[j]
        y = rows.p_before[j]
        rows.q[j] = a[j] * x + b[j] * y
        rows.p[j] = a[j] * y - g[j] * x


@jit
def leap_from_before(w, which, n):
    """Leaps from where the last `try_leap` began."""
    split = lower(w, n)
    leap_from_before_of(w.low, which, split)
    leap_from_before_of(w.high, which, n - split)


@jit
def keep_of(rows, n):
    for j in range(n):
        rows.q_before[j] = rows.q[j]
        rows.p_before[j] = rows.p[j]


@jit
def keep(w, n):
    """Keeps the state in q_before and p_before, as `try_leap` does."""
    split = lower(w, n)
    keep_of(w.low, split)
    keep_of(w.high, n - split)


@jit
def whole_leap(w, j):
    """The coefficient a of mode `j` over a frame."""
    if j < w.split:
        return w.low.leaps[WHOLE].a[j]
    return np.float64(w.high.leaps[WHOLE].a[j - w.split])


@jit
def state_of(w, j):
    """q and P of mode `j`."""
    if j < w.split:
        return w.low.q[j], w.low.p[j]
    return np.float64(w.high.q[j - w.split]), np.float64(w.high.p[j - w.split])


@jit
def set_state(w, j, q, p):
    """Sets q and P of mode `j`."""
    if j < w.split:
        w.low.q[j] = q
        w.low.p[j] = p
    else:
        w.high.q[j - w.split] = q
        w.high.p[j - w.split] = p


@jit
def sum_of_products(phi, values, zero, n):
    u = zero
    for j in range(n):
        u += phi[j] * values[j]
    return u


@jit
def displacement(w, op, m, n):
    """Displacement (m) at contact point `m`."""
    split = lower(w, n)
    u = sum_of_products(low_shape(op, m), w.low.q, like(w.low, 0.0), split)
    return u + sum_of_products(high_shape(op, m), w.high.q, like(w.high, 0.0), n - split)


@jit
def displacement_under(w, phi, n):
    """Displacement (m) at a place with mode shapes `phi`, float64."""
    split = lower(w, n)
    u = sum_of_products(phi, w.low.q, 0.0, split)
    return u + sum_of_products(phi[split:], w.high.q, 0.0, n - split)


@jit
def displacement_before_leap(w, op, m, n):
    """Displacement (m) at contact point `m` before the last `try_leap`, or of `keep_step_before`."""
    split = lower(w, n)
    u = sum_of_products(low_shape(op, m), w.low.q_before, like(w.low, 0.0), split)
    return u + sum_of_products(high_shape(op, m), w.high.q_before, like(w.high, 0.0), n - split)


@ordered
def step_before(rows, j, q, p):
    """Displacement of mode `j` a fine step before (q, P): q^{n-1} = q - (P + (E^2 - a) q) / E^2."""
    kept = rows.kept[j]
    return q - (p + like(rows, 0.5) * (rows.spring[j] - (like(rows, 1.0) - kept)) * q) / kept


@jit
def displacement_step_before_of(rows, phi, n):
    u = like(rows, 0.0)
    for j in range(n):
        u += phi[j] * step_before(rows, j, rows.q[j], rows.p[j])
    return u


@jit
def displacement_step_before(w, op, m, n):
    """Displacement (m) at contact point `m` one fine step ago."""
    split = lower(w, n)
    u = displacement_step_before_of(w.low, low_shape(op, m), split)
    return u + displacement_step_before_of(w.high, high_shape(op, m), n - split)


@jit
def displacement_step_before_leap_of(rows, phi, n):
    u = like(rows, 0.0)
    for j in range(n):
        u += phi[j] * step_before(rows, j, rows.q_before[j], rows.p_before[j])
    return u


@jit
def displacement_step_before_leap(w, op, m, n):
    """Displacement (m) at contact point `m` one fine step before the last `try_leap` began."""
    split = lower(w, n)
    u = displacement_step_before_leap_of(w.low, low_shape(op, m), split)
    return u + displacement_step_before_leap_of(w.high, high_shape(op, m), n - split)


@jit
def displacement_now_and_later_of(rows, phi, which, n):
    a, b = rows.leaps[which].a, rows.leaps[which].b
    u = 0.0
    later = 0.0
    for j in range(n):
        u += phi[j] * rows.q[j]
        later += phi[j] * (a[j] * rows.q[j] + b[j] * rows.p[j])
    return u, later


@jit
def displacement_now_and_later(w, phi, which, n):
    """Displacement (m) at a place with mode shapes `phi`, float64, now, and after the leap leaps[which]."""
    split = lower(w, n)
    u, later = displacement_now_and_later_of(w.low, phi, which, split)
    v, later_v = displacement_now_and_later_of(w.high, phi[split:], which, n - split)
    return u + v, later + later_v


@jit
def shift_of(rows, c, f, n):
    for j in range(n):
        rows.q[j] += f * c[j]


@jit
def shift(w, c, f, n):
    """Adds `f` times `c` to the displacements."""
    split = lower(w, n)
    shift_of(w.low, c, f, split)
    shift_of(w.high, c[split:], f, n - split)


@jit
def dot(phi, other, n):
    """Sum of products of two rows."""
    return sum_of_products(phi, other, 0.0, n)


@jit
def dot_of_shape(op, m, values, n):
    """Sum of products of `values`, float64, and the mode shapes at contact point `m`."""
    split = min(op.split, n)
    x = sum_of_products(low_shape(op, m), values, 0.0, split)
    return x + sum_of_products(high_shape(op, m), values[split:], 0.0, n - split)


@jit
def keep_step_before_of(rows, n):
    for j in range(n):
        rows.q_before[j] = step_before(rows, j, rows.q[j], rows.p[j])


@jit
def keep_step_before(w, n):
    """Puts the displacements of the modes one fine step ago into q_before, for `displacement_before_leap`."""
    split = lower(w, n)
    keep_step_before_of(w.low, split)
    keep_step_before_of(w.high, n - split)


@apart
def copy_row(to, values, n):
    """Copies `n` numbers; numba's own assignment of slices allocates where they might overlap."""
    for j in range(n):
        to[j] = values[j]


@jit
def read_tap_of(rows, of_q, of_p, n):
    y = like(rows, 0.0)
    for j in range(n):
        y += of_q[j] * rows.q[j] + of_p[j] * rows.p[j]
    return y


@jit
def read_tap(w, op, row, n):
    """Linear output with the weights of q of tap `row`, and those of P of the next one."""
    split = lower(w, n)
    y = read_tap_of(w.low, low_taps(op, row), low_taps(op, row + 1), split)
    return y + read_tap_of(w.high, high_taps(op, row), high_taps(op, row + 1), n - split)


@jit
def sense_1_of(rows, weight, n):
    u = v = like(rows, 0.0)
    for j in range(n):
        q = rows.q[j]
        u += weight[j] * q
        v += weight[j] * (rows.pace[j] * rows.p[j] - rows.sigma[j] * q)
    return u, v


@jit
def sense_1(w, op, row, n):
    """Displacement (m) and velocity (m/s) at the pickup of tap `row`."""
    split = lower(w, n)
    u, v = sense_1_of(w.low, low_taps(op, row), split)
    x, y = sense_1_of(w.high, high_taps(op, row), n - split)
    return u + x, v + y


@jit
def sense_2_of(rows, weight, other, n):
    u0 = v0 = u1 = v1 = like(rows, 0.0)
    for j in range(n):
        q = rows.q[j]
        moving = rows.pace[j] * rows.p[j] - rows.sigma[j] * q
        u0 += weight[j] * q
        v0 += weight[j] * moving
        u1 += other[j] * q
        v1 += other[j] * moving
    return u0, v0, u1, v1


@jit
def sense_2(w, op, row, n):
    """Displacements and velocities at the two pickups from tap `row` on, in one pass."""
    split = lower(w, n)
    u0, v0, u1, v1 = sense_2_of(w.low, low_taps(op, row), low_taps(op, row + 1), split)
    x0, y0, x1, y1 = sense_2_of(w.high, high_taps(op, row), high_taps(op, row + 1), n - split)
    return u0 + x0, v0 + y0, u1 + x1, v1 + y1


@jit
def speed_2_of(rows, weight, other, n):
    v0 = v1 = like(rows, 0.0)
    for j in range(n):
        moving = rows.pace[j] * rows.p[j] - rows.sigma[j] * rows.q[j]
        v0 += weight[j] * moving
        v1 += other[j] * moving
    return v0, v1


@jit
def speed_2(w, op, row, n):
    """Velocities (m/s) at the two pickups from tap `row` on, in one pass."""
    split = lower(w, n)
    v0, v1 = speed_2_of(w.low, low_taps(op, row), low_taps(op, row + 1), split)
    y0, y1 = speed_2_of(w.high, high_taps(op, row), high_taps(op, row + 1), n - split)
    return v0 + y0, v1 + y1


@jit
def tap_held(w, op, row, n):
    """Linear output of the held shape at rest, at tap `row`."""
    split = min(op.split, n)
    y = sum_of_products(low_taps(op, row), w.held, 0.0, split)
    return y + sum_of_products(high_taps(op, row), w.held[split:], 0.0, n - split)


@jit
def scale_of(rows, factor, n):
    factor = like(rows, factor)
    for j in range(n):
        rows.q[j] *= factor
        rows.p[j] *= factor


@jit
def scale(w, factor, n):
    """Multiplies the motion by `factor`."""
    split = lower(w, n)
    scale_of(w.low, factor, split)
    scale_of(w.high, factor, n - split)


@jit
def damp_by_finger_of(rows, finger, n):
    for j in range(n):
        rows.q[j] *= finger[j]
        rows.p[j] *= finger[j]


@jit
def damp_by_finger(w, n):
    """Damps each mode as the finger that touches does in one frame."""
    split = lower(w, n)
    damp_by_finger_of(w.low, w.finger, split)
    damp_by_finger_of(w.high, w.finger[split:], n - split)


@jit
def momenta_along(rows, shapes, n):
    one, two, three = shapes[0], shapes[1], shapes[2]
    x = y = z = like(rows, 0.0)
    for j in range(n):
        p = rows.p[j]
        x += one[j] * p
        y += two[j] * p
        z += three[j] * p
    return x, y, z


@jit
def take_momenta(rows, shapes, x, y, z, n):
    one, two, three = shapes[0], shapes[1], shapes[2]
    x, y, z = like(rows, x), like(rows, y), like(rows, z)
    for j in range(n):
        rows.p[j] -= x * one[j] + y * two[j] + z * three[j]


@jit
def apply_dashpots(w, shapes, high, products, c, n):
    """Takes the parts `c` of the momentum that the motion has along each of three `shapes`, one after the other.

    `high` are the same shapes for the modes in w.high. `products` are those of the first and second, the first and
    third, the second and third: a finger on the string (touch.py).
    """
    split = lower(w, n)
    x, y, z = momenta_along(w.low, shapes, split)
    x_h, y_h, z_h = momenta_along(w.high, high, n - split)
    x = c[0] * (x + x_h)
    y = c[1] * (y + y_h - products[0] * x)
    z = c[2] * (z + z_h - products[1] * x - products[2] * y)
    take_momenta(w.low, shapes, x, y, z, split)
    take_momenta(w.high, high, x, y, z, n - split)


@jit
def kick_end_of(rows, x, first, n):
    x = like(rows, x)
    for j in range(n):
        rows.p[j] += rows.kappa[j] * (x / number_like(rows, first + j))


@jit
def kick_end(w, x, n):
    """Adds the velocities x / m, m from 1: the string's end changes its speed (stop.py)."""
    split = lower(w, n)
    kick_end_of(w.low, x, np.int64(0), split)
    kick_end_of(w.high, x, split, n - split)


@jit
def slope_ahead_of(rows, weight, h, n):
    s = 0.0
    for j in range(n):
        q = rows.q[j]
        s += weight[j] * (q + h * (rows.pace[j] * rows.p[j] - rows.sigma[j] * q))
    return s


@jit
def slope_ahead(w, weight, h, n):
    """Sum of the displacements, `h` s from now at their velocities, with weights."""
    split = lower(w, n)
    return slope_ahead_of(w.low, weight, h, split) + slope_ahead_of(w.high, weight[split:], h, n - split)


@jit
def slope_square_of(rows, first, n):
    s = like(rows, 0.0)
    for j in range(n):
        x = number_like(rows, first + j) * rows.q[j]
        s += x * x
    return s


@jit
def slope_square(w, n):
    """Sum of (j q_j)^2, j from 1."""
    split = lower(w, n)
    return slope_square_of(w.low, np.int64(0), split) + slope_square_of(w.high, split, n - split)


@jit
def tighten_of(rows, push, first, n):
    push = like(rows, push)
    for j in range(n):
        number = number_like(rows, first + j)
        rows.p[j] -= rows.kappa[j] * push * (number * number) * rows.q[j]


@jit
def tighten(w, push, n):
    """Takes push j^2 q_j from the velocities, j from 1: more tension for a moment (tension.py)."""
    split = lower(w, n)
    tighten_of(w.low, push, np.int64(0), split)
    tighten_of(w.high, push, split, n - split)


@jit
def fade_of(rows, factor, first, n):
    factor = like(rows, factor)
    for j in range(first, n):
        rows.q[j] *= factor
        rows.p[j] *= factor


@jit
def fade(w, factor, first, n):
    """Multiplies the motion of the modes from `first` on by `factor`."""
    split = lower(w, n)
    fade_of(w.low, factor, first, split)
    fade_of(w.high, factor, max(first - split, 0), n - split)


@jit
def add_shape_of(rows, held, kappa, sigma, up, moving, n):
    for j in range(n):
        x = held[j]
        rows.q[j] += up * x
        rows.p[j] += kappa[j] * (moving + sigma[j] * up) * x


@jit
def add_shape(w, up, moving, n):
    """Adds `up` times the held shape to the motion, moving by `moving` (1/s) times it: p = (q' + sigma q) / omega."""
    split = lower(w, n)
    add_shape_of(w.low, w.held, w.kappa, w.sigma, up, moving, split)
    add_shape_of(w.high, w.held[split:], w.kappa[split:], w.sigma[split:], up, moving, n - split)


@jit
def add_strike_of(rows, strike, weight, n):
    weight = like(rows, weight)
    for j in range(n):
        rows.p[j] += weight * rows.kappa[j] * like(rows, strike[j])


@jit
def add_strike(w, weight, n):
    """Adds `weight` times the velocities of the strike."""
    split = lower(w, n)
    add_strike_of(w.low, w.strike, weight, split)
    add_strike_of(w.high, w.strike[split:], weight, n - split)


@jit
def square_speed(rows, kappa, omega, j):
    """The squared velocity amplitude of mode `j`, m^3/s^2."""
    v = rows.p[j] / kappa[j]
    d = omega[j] * rows.q[j]
    return v * v + d * d


@jit
def speed_square_of(rows, kappa, omega, n):
    e = 0.0
    for j in range(n):
        e += square_speed(rows, kappa, omega, j)
    return e


@jit
def speed_square(w, n):
    """Sum of squared velocity amplitudes, m^3/s^2: twice the energy per linear density."""
    split = lower(w, n)
    e = speed_square_of(w.low, w.kappa, w.omega, split)
    return e + speed_square_of(w.high, w.kappa[split:], w.omega[split:], n - split)


@jit
def held_speed_square(w, follow, n):
    """`speed_square` of the held shape alone, as it is released with its velocity `follow` (1/s) times itself."""
    e = 0.0
    for j in range(n):
        x = w.held[j]
        e += (follow * follow + w.omega[j] * w.omega[j]) * (x * x)
    return e


@jit
def invariant_of(rows, kappa, omega, n):
    e = 0.0
    for j in range(n):
        p = np.float64(rows.p[j])
        x = kappa[j] * omega[j] * rows.q[j]
        e += p * p + x * x
    return e


@jit
def invariant(w, n):
    """Sum of P^2 + b q^2, m^3, b = (kappa omega)^2: the energy that eq. 12 conserves, in units of mu / (2 dt^2).

    It never divides by kappa, which vanishes for a mode at a multiple of half the contact rate.
    """
    split = lower(w, n)
    e = invariant_of(w.low, w.kappa, w.omega, split)
    return e + invariant_of(w.high, w.kappa[split:], w.omega[split:], n - split)


@jit
def square_amplitude(rows, kappa, omega, j):
    """The squared amplitude of mode `j`, m^3."""
    p = rows.p[j] / (kappa[j] * omega[j])
    x = np.float64(rows.q[j])
    return x * x + p * p


@jit
def amplitude_sum_of(rows, kappa, omega, n):
    s = 0.0
    for j in range(n):
        s += np.sqrt(square_amplitude(rows, kappa, omega, j))
    return s


@jit
def amplitude_sum(w, n):
    """Sum of modal amplitudes, m^1.5: sqrt(2/L) times it bounds every displacement from now on."""
    split = lower(w, n)
    s = amplitude_sum_of(w.low, w.kappa, w.omega, split)
    return s + amplitude_sum_of(w.high, w.kappa[split:], w.omega[split:], n - split)


@jit
def is_dead(rows, kappa, omega, n, silence):
    """True if the last BLOCK of `n` modes is below `silence` (m^1.5/s); sets it to exact zero."""
    most = 0.0
    for j in range(n - BLOCK, n):
        most = max(most, square_speed(rows, kappa, omega, j))
    if most > silence * silence:
        return False
    for j in range(n - BLOCK, n):
        rows.q[j] = like(rows, 0.0)
        rows.p[j] = like(rows, 0.0)
    return True


@jit
def drop_dead_modes(w, n, silence):
    """Sets BLOCKs at the top below `silence` (m^1.5/s) to exact zero and returns the number of modes left."""
    while n > 0:
        split = w.split
        if n > split:
            dead = is_dead(w.high, w.kappa[split:], w.omega[split:], n - split, silence)
        else:
            dead = is_dead(w.low, w.kappa, w.omega, n, silence)
        if not dead:
            break
        n -= BLOCK
    return n


@jit
def clear_motion_of(rows, n):
    for j in range(n):
        rows.q[j] = like(rows, 0.0)
        rows.p[j] = like(rows, 0.0)


@apart
def clear_motion(w, n):
    """Sets the motion to zero."""
    split = lower(w, n)
    clear_motion_of(w.low, split)
    clear_motion_of(w.high, n - split)


@jit
def widen_of(rows, q, p, n):
    for j in range(n):
        q[j] = rows.q[j]
        p[j] = rows.p[j]


@apart
def widen(w, n):
    """Takes the state of `n` modes out into w.q and w.p, float64, for an event that computes with it."""
    split = lower(w, n)
    widen_of(w.low, w.q, w.p, split)
    widen_of(w.high, w.q[split:], w.p[split:], n - split)


@jit
def narrow_of(rows, q, p, n):
    for j in range(n):
        rows.q[j] = q[j]
        rows.p[j] = p[j]


@apart
def narrow(w, n):
    """Puts the state of `n` modes back from w.q and w.p."""
    split = lower(w, n)
    narrow_of(w.low, w.q, w.p, split)
    narrow_of(w.high, w.q[split:], w.p[split:], n - split)


@jit
def left_by_leap(rows, decay):
    """The part exp(-`decay`) of the motion that a leap leaves, in rows of float32 MOST_LEFT at most."""
    left = exp(-decay)
    return min(left, MOST_LEFT) if rows.q.itemsize == SINGLE else left


@jit
def retune_of(rows, kappas, omega, sigmas, op, n):
    fine = op.fine
    for j in range(n):
        w_d = omega[j]
        sigma = sigmas[j]
        sine, cosine = sin_cos(0.5 * w_d * fine)
        rows.kept[j], rows.spring[j], damp = fine_coefficients(sigma * fine, sine)
        es = damp * (2.0 * sine * cosine)
        kappa = es / w_d
        rows.p[j] *= kappa / kappas[j]
        kappas[j] = kappa
        rows.kappa[j] = kappa
        rows.pace[j] = 1.0 / kappa
        for which in range(3):
            row = WHOLE
            k = op.steps
            if which == 1:
                row = LONGER
                k = op.steps + 1
            elif which == 2:
                row = PART
                k = op.part_steps
            h = k * fine
            damp_k = left_by_leap(rows, sigma * h)
            sine, cosine = sin_cos(w_d * h)
            sin_k = damp_k * sine
            rows.leaps[row].a[j] = damp_k * cosine
            rows.leaps[row].b[j] = sin_k / es
            rows.leaps[row].g[j] = sin_k * es


@apart
def retune(w, op, rows, ratio):
    """Sets coefficients for `ratio` times the frequencies of those of `op` at `rows` (1/s stay), the motion kept.

    P follows kappa, so that displacement and velocity stay. sigma stays, the undamped frequency scales; sigma << omega.
    Modes that would get above MOST_TURN stay there: above, the contact rate cannot carry them.
    """
    highest = MOST_TURN / op.fine
    omega = coefficient_at(rows, op, operators.OMEGA)
    for j in range(op.padded):
        w.omega[j] = omega[j] * ratio
        if w.omega[j] > highest and w.omega[j] > omega[j]:
            w.omega[j] = max(highest, omega[j])
    split = w.split
    retune_of(w.low, w.kappa, w.omega, w.sigma, op, split)
    retune_of(w.high, w.kappa[split:], w.omega[split:], w.sigma[split:], op, op.padded - split)


@jit
def tune_of(rows, kappas, omega, sigmas, fine, steps, n):
    h = steps * fine
    for j in range(n):
        w_d = omega[j]
        sigma = sigmas[j]
        sine, cosine = sin_cos(0.5 * w_d * fine)
        rows.kept[j], rows.spring[j], damp = fine_coefficients(sigma * fine, sine)
        es = damp * (2.0 * sine * cosine)
        kappas[j] = es / w_d
        rows.pace[j] = w_d / es
        damp_k = left_by_leap(rows, sigma * h)
        sine, cosine = sin_cos(w_d * h)
        sin_k = damp_k * sine
        rows.leaps[WHOLE].a[j] = damp_k * cosine
        rows.leaps[WHOLE].b[j] = sin_k / es
        rows.leaps[WHOLE].g[j] = sin_k * es


@apart
def tune(w, fine, steps, n):
    """Sets the coefficients of `n` modes, but of parts of a frame and of longer ones, by w.omega and w.sigma."""
    split = lower(w, n)
    tune_of(w.low, w.kappa, w.omega, w.sigma, fine, steps, split)
    tune_of(w.high, w.kappa[split:], w.omega[split:], w.sigma[split:], fine, steps, n - split)


@apart
def take_coefficients(w, op, rows):
    """Gives the working set the coefficients of operator `op` at `rows`, those of u or of v, untuned."""
    n, split = op.padded, op.split
    w.split = split
    copy_row(w.kappa, coefficient_at(rows, op, operators.KAPPA), n)
    copy_row(w.omega, coefficient_at(rows, op, operators.OMEGA), n)
    copy_row(w.sigma, coefficient_at(rows, op, operators.SIGMA), n)
    copy_row(w.low.kept, low_coefficient(rows, op, operators.KEPT), split)
    copy_row(w.high.kept, high_coefficient(rows, op, operators.KEPT), n - split)
    copy_row(w.low.spring, low_coefficient(rows, op, operators.SPRING), split)
    copy_row(w.high.spring, high_coefficient(rows, op, operators.SPRING), n - split)
    copy_row(w.low.pace, low_coefficient(rows, op, operators.PACE), split)
    copy_row(w.high.pace, high_coefficient(rows, op, operators.PACE), n - split)
    for which in (WHOLE, LONGER, PART):
        row = operators.LEAPS + 3 * which
        copy_row(w.low.leaps[which].a, low_coefficient(rows, op, row), split)
        copy_row(w.high.leaps[which].a, high_coefficient(rows, op, row), n - split)
        copy_row(w.low.leaps[which].b, low_coefficient(rows, op, row + 1), split)
        copy_row(w.high.leaps[which].b, high_coefficient(rows, op, row + 1), n - split)
        copy_row(w.low.leaps[which].g, low_coefficient(rows, op, row + 2), split)
        copy_row(w.high.leaps[which].g, high_coefficient(rows, op, row + 2), n - split)
    copy_row(w.low.kappa, w.kappa, split)
    copy_row(w.high.kappa, w.kappa[split:], n - split)
    copy_row(w.low.sigma, w.sigma, split)
    copy_row(w.high.sigma, w.sigma[split:], n - split)


@jit
def change_coefficients(w, old, op, rows):
    """Gives the working set the coefficients of `op` at `rows` in place of those of `old`, the motion kept.

    Modes that come in anew are at rest, and no hand touches them; so are those that only fill up a block.
    """
    shared = min(old.modes, op.modes)
    widen(w, shared)
    for j in range(shared):
        w.p[j] /= w.kappa[j]
    for j in range(shared, op.padded):
        w.q[j] = 0.0
        w.p[j] = 0.0
        w.held[j] = 0.0
        w.strike[j] = 0.0
        w.finger[j] = 1.0
    take_coefficients(w, op, rows)
    for j in range(op.padded):
        w.p[j] *= w.kappa[j]
    narrow(w, op.padded)
