"""Passes over the modes of a string: all arithmetic whose cost grows with the number of modes.

A mode is (q, P). q is its displacement; P = E s p is its momentum scaled to the fine step dt, with
E = exp(-sigma dt), s = sin(omega dt), p = (q' + sigma q) / omega. One fine step without force is then

    q <- a q + P,   P <- a P - b q,   a = E cos(omega dt),  b = (E s)^2

and k fine steps at once, exactly, with three numbers: q <- A q + B P, P <- A P - G q.

Fine steps with contact advance one by one, in (q, d), d = q^n - q^{n-1}, which float32 can carry:

    d <- E^2 d - s q,   q <- q + d,   s = (1 - E)^2 + 4 E sin^2(omega dt / 2).

A force f of eq. 12 acting during a step adds dt^2 dx/mu phi f to q and to d, after the step: this is the scheme of
eq. 12, q^{n+1} = C q^n - Ct q^{n-1} + F, but stores the difference of two displacements separately, which loses no
digits. The first fine step has no force before it, and turns (q, P) into (q, d): d = P - (1 - a) q,
1 - a = (s + l) / 2, l = 1 - E^2. `to_momenta` turns it back: P = E^2 d - (E^2 - a) q, E^2 - a = (s - l) / 2. E^2
rounded to float32 changes the damping, equally in all of these, and never exceeds 1; s, which sets the frequency, is
small, and keeps its digits as long as nothing adds it to 1 (`ordered`).

The lowest `split` modes of a working set are float64, in the rows w.low; the modes above may be float32, in w.high.
Each loop is written once, as a function of `rows`, and compiled for both widths. A maker (`over`, `from_mode`, `along`,
`by_pitch`, `at`, `at_two`, `at_four`) turns it into a function of the working set, which calls it for w.low and for
w.high: `fine(rows, n)` below is `modal.fine(w, n)` elsewhere. `from_mode_of_both`, `at_of_both` and `at_two_of_both` do
the same for loops over u and v at once. A single float64 would make a loop's arithmetic float64: `like` gives numbers
the width of the rows. Sums use the width of the rows; the two partial sums are added in float64.
An event that computes with the state takes it out in float64 (`widen`) and puts it back (`narrow`).

Each loop reads a mode once and adds, multiplies and stores; exp and sin occur only where coefficients are made. The
compiler may reassociate sums into vector lanes (`LANES`), the same way each time on one kind of processor. Loops
vectorise because the distances between a working set's rows are constants (records.py). w is a working set, op an
operator, m one of its contact points, n a number of modes, whole BLOCKs. [any thread]
"""

import numpy as np

from livebass.compiling import compiled, inlined
from livebass.kernels.machine.elementary import exp, sin_cos
from livebass.kernels.string import operators
from livebass.kernels.string.operators import (
    MAX_LEFT,
    coefficient_at,
    fine_coefficients,
    high_part,
    leap_steps,
    low_part,
    mixed_coefficient,
    shape_row,
    tap_row,
)
from livebass.kernels.string.records import BLOCK, SINGLE, WHOLE

LANES = {"reassoc", "contract", "nsz", "arcp"}
jit = compiled(fastmath=LANES)
ordered = compiled(fastmath=LANES - {"reassoc"})  # sums as they are written
apart = compiled(fastmath=LANES, attributes="noinline")  # for events, which call it in many places, in both widths

# m^1.5/s: slower modes are silent (slot.silences_of), as pickups hear velocity. A loud mode has 1. In exact qualities
# modes are silent at DEAD, 260 dB below that, and at FAINT once a hand has ended the note; in the others at UNHEARD:
# what these leave out is 100 dB below a loud note. Modes that no pickup senses matter for contact alone, and are silent
# at UNSENSED.
DEAD, FAINT, UNHEARD, UNSENSED = 1e-13, 1e-10, 3e-7, 3e-5
MAX_TURN = 2 * np.pi * 0.45  # rad per fine step, of a mode that sounds


@jit
def mode_number(j):
    """The number j + 1 of mode `j`, from 1. Processors convert 32-bit integers many at a time, but not 64-bit ones."""
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
    """Number of the `n` modes that are in w.low."""
    return min(w.split, n)


# Makers. `add` adds a loop's results over w.low and over w.high.


@jit
def nothing(low, high):
    pass


@jit
def one(low, high):
    return low + high


@jit
def two(low, high):
    return low[0] + high[0], low[1] + high[1]


@jit
def greater(low, high):
    return max(low, high)


@jit
def four(low, high):
    return low[0] + high[0], low[1] + high[1], low[2] + high[2], low[3] + high[3]


def maker(of):
    """Makes a decorator from `of`, which turns a loop into a function of a working set."""

    def decorator(*options):
        def make(loop):
            both = of(loop, *options)
            both.__name__, both.__qualname__, both.__doc__ = loop.__name__, f"{loop.__name__}.both", loop.__doc__
            return jit(both)

        return make

    return decorator


@maker
def over(loop, add=nothing):
    """loop(rows, n, ...) becomes a function of (w, n, ...)."""

    def both(w, n, *given):
        split = lower(w, n)
        return add(loop(w.low, split, *given), loop(w.high, n - split, *given))

    return both


@maker
def from_mode(loop, add=nothing):
    """loop(rows, n, first, ...), with `first` the mode of rows[0], becomes a function of (w, n, ...)."""

    def both(w, n, *given):
        split = lower(w, n)
        return add(loop(w.low, split, np.int64(0), *given), loop(w.high, n - split, split, *given))

    return both


@maker
def along(loop, add=nothing):
    """loop(rows, n, numbers, ...), with a float64 for each mode, becomes a function of (w, n, numbers, ...)."""

    def both(w, n, numbers, *given):
        split = lower(w, n)
        return add(loop(w.low, split, numbers, *given), loop(w.high, n - split, numbers[split:], *given))

    return both


@maker
def by_pitch(loop, add=nothing):
    """loop(rows, n, kappa, omega), with the rows of w in float64, becomes a function of (w, n)."""

    def both(w, n):
        split = lower(w, n)
        low = loop(w.low, split, w.kappa, w.omega)
        return add(low, loop(w.high, n - split, w.kappa[split:], w.omega[split:]))

    return both


@maker
def at(loop, add=nothing, row_of=shape_row):
    """loop(rows, n, phi, ...), with the row of `op` at a place, becomes a function of (w, n, op, place, ...).

    `row_of` finds the row's address: `shape_row` for contact points as places, `tap_row` for taps.
    """

    def both(w, n, op, place, *given):
        split, row = lower(w, n), row_of(op, place)
        low = loop(w.low, split, low_part(row, op), *given)
        return add(low, loop(w.high, n - split, high_part(row, op), *given))

    return both


@maker
def at_two(loop, add=nothing, row_of=shape_row):
    """`at` for two places: the loop gets two rows."""

    def both(w, n, op, places, *given):
        split, a, b = lower(w, n), row_of(op, places[0]), row_of(op, places[1])
        low = loop(w.low, split, (low_part(a, op), low_part(b, op)), *given)
        return add(low, loop(w.high, n - split, (high_part(a, op), high_part(b, op)), *given))

    return both


@maker
def at_four(loop, add=nothing, row_of=shape_row):
    """`at` for four places: the loop gets four rows."""

    def both(w, n, op, places, *given):
        split, a, b = lower(w, n), row_of(op, places[0]), row_of(op, places[1])
        c, d = row_of(op, places[2]), row_of(op, places[3])
        phi = low_part(a, op), low_part(b, op), low_part(c, op), low_part(d, op)
        low = loop(w.low, split, phi, *given)
        phi = high_part(a, op), high_part(b, op), high_part(c, op), high_part(d, op)
        return add(low, loop(w.high, n - split, phi, *given))

    return both


# The same for loops over the rows of u and v, whose modes are split alike: what both need is read once. Modes that have
# ended are zero, so `n` may be the number of modes of the one that has more.


@maker
def from_mode_of_both(loop, add=nothing):
    """loop(rows, across, n, first, ...) becomes a function of (u, v, n, ...)."""

    def both(u, v, n, *given):
        split = lower(u, n)
        low = loop(u.low, v.low, split, np.int64(0), *given)
        return add(low, loop(u.high, v.high, n - split, split, *given))

    return both


@maker
def at_of_both(loop, add=nothing, row_of=shape_row):
    """loop(rows, across, n, phi, ...) becomes a function of (u, v, n, op, place, ...)."""

    def both(u, v, n, op, place, *given):
        split, row = lower(u, n), row_of(op, place)
        low = loop(u.low, v.low, split, low_part(row, op), *given)
        return add(low, loop(u.high, v.high, n - split, high_part(row, op), *given))

    return both


@maker
def at_two_of_both(loop, add=nothing, row_of=shape_row):
    """`at_of_both` for two places: the loop gets two rows."""

    def both(u, v, n, op, places, *given):
        split, a, b = lower(u, n), row_of(op, places[0]), row_of(op, places[1])
        low = loop(u.low, v.low, split, (low_part(a, op), low_part(b, op)), *given)
        return add(low, loop(u.high, v.high, n - split, (high_part(a, op), high_part(b, op)), *given))

    return both


# Fine steps


@ordered
def begin(rows, j, x, p):
    """Takes mode `j` from (q, P) = (x, p) through the first fine step to (q, d)."""
    d = p - like(rows, 0.5) * ((like(rows, 1.0) - rows.kept[j]) + rows.spring[j]) * x
    rows.p[j] = d
    rows.q[j] = x + d


@over()
@ordered
def first_step(rows, n):
    """Takes the first of the fine steps: (q, P) becomes (q, d) a step later."""
    for j in range(n):
        begin(rows, j, rows.q[j], rows.p[j])


@over()
@ordered
def first_step_before_leap(rows, n):
    """`first_step` from the start of the last `try_leap`."""
    for j in range(n):
        begin(rows, j, rows.q_before[j], rows.p_before[j])


@ordered
def turn_back(rows, j, x, d):
    """Turns (q, d) = (x, d) of mode `j` back into (q, P)."""
    kept = rows.kept[j]
    rows.p[j] = kept * d - like(rows, 0.5) * (rows.spring[j] - (like(rows, 1.0) - kept)) * x
    rows.q[j] = x


@over()
@ordered
def to_momenta(rows, n):
    """Turns (q, d) back into (q, P)."""
    for j in range(n):
        turn_back(rows, j, rows.q[j], rows.p[j])


@at()
@ordered
def to_momenta_after(rows, n, phi, f):
    """`kick`, then `to_momenta`."""
    f = like(rows, f)
    for j in range(n):
        kick = f * phi[j]
        turn_back(rows, j, rows.q[j] + kick, rows.p[j] + kick)


# Fine steps after the first, and their forces, in (q, d). fine_1, fine_2 and fine_4 apply the forces `f` at that many
# points, take a step, and return the displacements (m) there; a point may be listed twice, with force 0 the second
# time.
@jit
def step(rows, j, kick):
    """Takes mode `j` one fine step after `kick`; returns its new displacement."""
    x, d = rows.q[j] + kick, rows.p[j] + kick
    d = rows.kept[j] * d - rows.spring[j] * x
    x += d
    rows.p[j] = d
    rows.q[j] = x
    return x


@at(one)
@jit
def fine_1(rows, n, phi, f):
    f0, u0 = like(rows, f), like(rows, 0.0)
    for j in range(n):
        u0 += phi[j] * step(rows, j, f0 * phi[j])
    return u0


@at_two(two)
@jit
def fine_2(rows, n, shapes, f):
    phi, chi = shapes
    f0, f1 = like(rows, f[0]), like(rows, f[1])
    u0 = u1 = like(rows, 0.0)
    for j in range(n):
        x = step(rows, j, f0 * phi[j] + f1 * chi[j])
        u0 += phi[j] * x
        u1 += chi[j] * x
    return u0, u1


@at_four(four)
@jit
def fine_4(rows, n, shapes, f):
    phi, chi, psi, xi = shapes
    f0, f1, f2, f3 = like(rows, f[0]), like(rows, f[1]), like(rows, f[2]), like(rows, f[3])
    u0 = u1 = u2 = u3 = like(rows, 0.0)
    for j in range(n):
        x = step(rows, j, f0 * phi[j] + f1 * chi[j] + f2 * psi[j] + f3 * xi[j])
        u0 += phi[j] * x
        u1 += chi[j] * x
        u2 += psi[j] * x
        u3 += xi[j] * x
    return u0, u1, u2, u3


@at()
@jit
def kick(rows, n, phi, f):
    """Adds the effect of one contact force at one point, after a fine step."""
    f = like(rows, f)
    for j in range(n):
        x = f * phi[j]
        rows.q[j] += x
        rows.p[j] += x


@over()
@jit
def fine(rows, n):
    """Takes one free fine step."""
    for j in range(n):
        step(rows, j, like(rows, 0.0))


@at_two()
@jit
def fine_kicked_2(rows, n, shapes, f):
    """Takes one fine step after two forces `f` at two points."""
    phi, chi = shapes
    f0, f1 = like(rows, f[0]), like(rows, f[1])
    for j in range(n):
        step(rows, j, f0 * phi[j] + f1 * chi[j])


@at_four()
@jit
def fine_kicked_4(rows, n, shapes, f):
    """Takes one fine step after four forces `f` at four points."""
    phi, chi, psi, xi = shapes
    f0, f1, f2, f3 = like(rows, f[0]), like(rows, f[1]), like(rows, f[2]), like(rows, f[3])
    for j in range(n):
        step(rows, j, f0 * phi[j] + f1 * chi[j] + f2 * psi[j] + f3 * xi[j])


@at_four(four)
@jit
def displacement_4(rows, n, shapes):
    """Displacements at four points in one pass."""
    phi, chi, psi, xi = shapes
    u0 = u1 = u2 = u3 = like(rows, 0.0)
    for j in range(n):
        q = rows.q[j]
        u0 += phi[j] * q
        u1 += chi[j] * q
        u2 += psi[j] * q
        u3 += xi[j] * q
    return u0, u1, u2, u3


# Leaps over many fine steps at once, free, by the coefficients leaps[which]


@jit
def turn(rows, which, j, x, y):
    """Takes mode `j` one leap from (q, P) = (x, y)."""
    leap = rows.leaps[which]
    rows.q[j] = leap.a[j] * x + leap.b[j] * y
    rows.p[j] = leap.a[j] * y - leap.g[j] * x


@over()
@jit
def leap(rows, n, which):
    """Leaps."""
    for j in range(n):
        turn(rows, which, j, rows.q[j], rows.p[j])


@over()
@jit
def leap_fading(rows, n, which, factor):
    """Leaps, and multiplies the motion by `factor`."""
    factor = like(rows, factor)
    for j in range(n):
        turn(rows, which, j, factor * rows.q[j], factor * rows.p[j])


@over()
@jit
def try_leap(rows, n, which):
    """Leaps, and keeps the previous state in q_before and p_before."""
    for j in range(n):
        x, y = rows.q[j], rows.p[j]
        rows.q_before[j] = x
        rows.p_before[j] = y
        turn(rows, which, j, x, y)


@over()
@jit
def leap_from_before(rows, n, which):
    """Leaps from the start of the last `try_leap`."""
    for j in range(n):
        turn(rows, which, j, rows.q_before[j], rows.p_before[j])


@over()
@jit
def keep(rows, n):
    """Keeps the state in q_before and p_before, as `try_leap` does."""
    for j in range(n):
        rows.q_before[j] = rows.q[j]
        rows.p_before[j] = rows.p[j]


@jit
def whole_leap(w, j):
    """Mode `j`'s coefficient a over a frame."""
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


# Displacements and velocities


@jit
def sum_of_products(phi, values, zero, n):
    u = zero
    for j in range(n):
        u += phi[j] * values[j]
    return u


@at(one)
@jit
def displacement(rows, n, phi):
    """Displacement (m) at a contact point."""
    return sum_of_products(phi, rows.q, like(rows, 0.0), n)


@along(one)
@jit
def displacement_under(rows, n, phi):
    """Displacement (m) at a place with mode shapes `phi`, float64."""
    return sum_of_products(phi, rows.q, 0.0, n)


@at(one)
@jit
def displacement_before_leap(rows, n, phi):
    """Displacement (m) at a contact point before the last `try_leap`, or from `keep_step_before`."""
    return sum_of_products(phi, rows.q_before, like(rows, 0.0), n)


@ordered
def step_before(rows, j, q, p):
    """Displacement of mode `j` a fine step before (q, P): q^{n-1} = q - (P + (E^2 - a) q) / E^2."""
    kept = rows.kept[j]
    return q - (p + like(rows, 0.5) * (rows.spring[j] - (like(rows, 1.0) - kept)) * q) / kept


@jit
def spring_of(w, j):
    """The coefficient `spring` of mode `j`."""
    if j < w.split:
        return w.low.spring[j]
    return np.float64(w.high.spring[j - w.split])


@along()
@ordered
def add_rest(rows, n, rest, part):
    """Adds `part` of a state at rest under forces that act after each fine step (draped.py): d = 0."""
    for j in range(n):
        x = like(rows, part * rest[j])
        rows.q[j] += x
        rows.p[j] -= like(rows, 0.5) * (rows.spring[j] - (like(rows, 1.0) - rows.kept[j])) * x


@over(greater)
@ordered
def fastest_mode(rows, n):
    """The greatest d^2, m^3, of a mode: of its displacement in a fine step."""
    most = like(rows, 0.0)
    for j in range(n):
        d = rows.q[j] - step_before(rows, j, rows.q[j], rows.p[j])
        most = max(most, d * d)
    return most


@at(one)
@jit
def displacement_step_before(rows, n, phi):
    """Displacement (m) at a contact point one fine step ago."""
    u = like(rows, 0.0)
    for j in range(n):
        u += phi[j] * step_before(rows, j, rows.q[j], rows.p[j])
    return u


@at(one)
@jit
def displacement_step_before_leap(rows, n, phi):
    """Displacement (m) at a contact point one fine step before the last `try_leap` began."""
    u = like(rows, 0.0)
    for j in range(n):
        u += phi[j] * step_before(rows, j, rows.q_before[j], rows.p_before[j])
    return u


@along(two)
@jit
def displacement_now_and_later(rows, n, phi, which):
    """Displacement (m) at a place with mode shapes `phi`, float64, now and after leaps[which]."""
    a, b = rows.leaps[which].a, rows.leaps[which].b
    u = later = 0.0
    for j in range(n):
        u += phi[j] * rows.q[j]
        later += phi[j] * (a[j] * rows.q[j] + b[j] * rows.p[j])
    return u, later


@along()
@jit
def shift(rows, n, c, f):
    """Adds `f` times `c` to the displacements."""
    for j in range(n):
        rows.q[j] += f * c[j]


@jit
def dot(phi, other, n):
    """Sum of products of two rows."""
    return sum_of_products(phi, other, 0.0, n)


@jit
def dot_of_row(op, row, values, n):
    """Sum of products of `values`, float64, and the mixed row (shapes or tap) of `op` at the address `row`."""
    split = min(op.split, n)
    return dot(low_part(row, op), values, split) + dot(high_part(row, op), values[split:], n - split)


@over()
@jit
def keep_step_before(rows, n):
    """Puts the modes' displacements one fine step ago into q_before, for `displacement_before_leap`."""
    for j in range(n):
        rows.q_before[j] = step_before(rows, j, rows.q[j], rows.p[j])


@apart
def copy_row(to, values, n):
    """Copies `n` numbers; numba's own slice assignment allocates if the slices might overlap."""
    for j in range(n):
        to[j] = values[j]


@at_two(one, tap_row)
@jit
def read_tap(rows, n, taps):
    """Linear output with one tap's weights for q, and another's for P."""
    of_q, of_p = taps
    y = like(rows, 0.0)
    for j in range(n):
        y += of_q[j] * rows.q[j] + of_p[j] * rows.p[j]
    return y


@jit
def velocity(rows, j):
    return rows.pace[j] * rows.p[j] - rows.sigma[j] * rows.q[j]


@at(two, tap_row)
@jit
def sense_1(rows, n, weight):
    """Displacement (m) and velocity (m/s) at the pickup of a tap."""
    u = v = like(rows, 0.0)
    for j in range(n):
        u += weight[j] * rows.q[j]
        v += weight[j] * velocity(rows, j)
    return u, v


@at_two(four, tap_row)
@jit
def sense_2(rows, n, taps):
    """Displacement and velocity at one tap's pickup, then at another's, in one pass."""
    weight, other = taps
    u0 = v0 = u1 = v1 = like(rows, 0.0)
    for j in range(n):
        q, moving = rows.q[j], velocity(rows, j)
        u0 += weight[j] * q
        v0 += weight[j] * moving
        u1 += other[j] * q
        v1 += other[j] * moving
    return u0, v0, u1, v1


@at_of_both(two, tap_row)
@jit
def sense_1_of_both(rows, across, n, weight, heard):
    """`sense_1` of u with the part `heard` of v's velocity."""
    heard = like(rows, heard)
    u = v = like(rows, 0.0)
    for j in range(n):
        u += weight[j] * rows.q[j]
        v += weight[j] * (velocity(rows, j) + heard * velocity(across, j))
    return u, v


@at_two_of_both(four, tap_row)
@jit
def sense_2_of_both(rows, across, n, taps, heard):
    """`sense_2` of u with the parts `heard`, at the one pickup and at the other, of v's velocity."""
    weight, other = taps
    of_v, of_v_there = like(rows, heard[0]), like(rows, heard[1])
    u0 = v0 = u1 = v1 = like(rows, 0.0)
    for j in range(n):
        q, moving, aside = rows.q[j], velocity(rows, j), velocity(across, j)
        u0 += weight[j] * q
        v0 += weight[j] * (moving + of_v * aside)
        u1 += other[j] * q
        v1 += other[j] * (moving + of_v_there * aside)
    return u0, v0, u1, v1


# Other changes of the motion


@jit
def fade_from(rows, n, first, factor):
    factor, q, p = like(rows, factor), rows.q[first:], rows.p[first:]  # indices from 0 on become vector instructions
    for j in range(n - first):
        q[j] *= factor
        p[j] *= factor


@jit
def fade(w, n, first, factor):
    """Multiplies the motion of modes `first` and up by `factor`."""
    split = lower(w, n)
    fade_from(w.low, split, first, factor)
    fade_from(w.high, n - split, max(first - split, 0), factor)


@over()
@jit
def scale(rows, n, factor):
    """Multiplies the motion by `factor`."""
    fade_from(rows, n, 0, factor)


@along()
@jit
def damp_by_finger(rows, n, finger):
    """Damps each mode as the touching finger does in one frame: w.finger."""
    for j in range(n):
        kept = like(rows, finger[j])
        rows.q[j] *= kept
        rows.p[j] *= kept


@jit
def exchange(u, v, flow, scale, n):
    """Exchanges amplitudes between the first `n` modes of u and v, float64, by the rows of slot.flow (turning.py)."""
    for j in range(n):
        of_u, of_v = scale[0, j], scale[1, j]
        x_u, p_u, x_v, p_v = of_u * u.low.q[j], u.low.p[j], of_v * v.low.q[j], v.low.p[j]
        a_x, a_y, b_x, b_y, g_x, g_y = flow[0, j], flow[1, j], flow[2, j], flow[3, j], flow[4, j], flow[5, j]
        u.low.q[j] = (a_x * x_u + a_y * p_u + g_x * x_v + g_y * p_v) * scale[2, j]
        u.low.p[j] = a_x * p_u - a_y * x_u + g_x * p_v - g_y * x_v
        v.low.q[j] = (b_x * x_v + b_y * p_v + g_x * x_u + g_y * p_u) * scale[3, j]
        v.low.p[j] = b_x * p_v - b_y * x_v + g_x * p_u - g_y * x_u


@jit
def share_to_come(flow, j, times):
    """The most of the amplitude of mode `j` that `times` exchanges pass on."""
    return min(times * np.sqrt(flow[4, j] * flow[4, j] + flow[5, j] * flow[5, j]), 1.0)


@jit
def speed_square_to_come(u, v, flow, times, n):
    """Growth of u's `speed_square` by at most `times` exchanges of its first `n` modes with v."""
    e = 0.0
    for j in range(n):
        more = share_to_come(flow, j, times) * np.sqrt(square_speed(v.low, v.kappa, v.omega, j))
        e += more * (2.0 * np.sqrt(square_speed(u.low, u.kappa, u.omega, j)) + more)
    return e


@jit
def speed_square_passed(u, v, flow, n, first):
    """`speed_square` of what an exchange of `n` modes passes on, of these modes, and of those from `first` on."""
    passed = size = highs = 0.0
    for j in range(n):
        square = square_speed(u.low, u.kappa, u.omega, j) + square_speed(v.low, v.kappa, v.omega, j)
        passed += (flow[4, j] * flow[4, j] + flow[5, j] * flow[5, j]) * square
        size += square
        if j >= first:
            highs += square
    return passed, size, highs


@jit
def amplitude_to_come(v, flow, times, n):
    """Growth of u's `amplitude_sum` by at most `times` exchanges of its first `n` modes with `v`."""
    s = 0.0
    for j in range(n):
        s += share_to_come(flow, j, times) * np.sqrt(square_speed(v.low, v.kappa, v.omega, j)) / v.omega[j]
    return s


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
def momenta_of_both(rows, across, shapes, n):
    """`momenta_along` of u's and v's rows in one pass."""
    one, two, three = shapes[0], shapes[1], shapes[2]
    x = y = z = x_v = y_v = z_v = like(rows, 0.0)
    for j in range(n):
        a, b, c, p, p_v = one[j], two[j], three[j], rows.p[j], across.p[j]
        x += a * p
        y += b * p
        z += c * p
        x_v += a * p_v
        y_v += b * p_v
        z_v += c * p_v
    return (x, y, z), (x_v, y_v, z_v)


@jit
def take_momenta(rows, shapes, taken, n):
    one, two, three = shapes[0], shapes[1], shapes[2]
    x, y, z = like(rows, taken[0]), like(rows, taken[1]), like(rows, taken[2])
    for j in range(n):
        rows.p[j] -= x * one[j] + y * two[j] + z * three[j]


@jit
def take_from_both(rows, across, shapes, taken, taken_v, n):
    """`take_momenta` from u's and v's rows in one pass."""
    one, two, three = shapes[0], shapes[1], shapes[2]
    x, y, z = like(rows, taken[0]), like(rows, taken[1]), like(rows, taken[2])
    x_v, y_v, z_v = like(rows, taken_v[0]), like(rows, taken_v[1]), like(rows, taken_v[2])
    for j in range(n):
        a, b, c = one[j], two[j], three[j]
        rows.p[j] -= x * a + y * b + z * c
        across.p[j] -= x_v * a + y_v * b + z_v * c


@jit
def taken_in_turn(low, high, products, c):
    """The parts `c` of three momenta that dashpots take one after another; `low` and `high`: of the two widths."""
    x = c[0] * (low[0] + high[0])
    y = c[1] * (low[1] + high[1] - products[0] * x)
    return x, y, c[2] * (low[2] + high[2] - products[1] * x - products[2] * y)


@jit
def apply_dashpots(w, shapes, high, products, c, n):
    """Removes the parts `c` of the motion's momentum along each of three `shapes`, one after another.

    `high` holds the same shapes for the modes in w.high. `products` holds the shapes' products 0 1, 0 2 and 1 2: a
    finger on the string (touch.py).
    """
    split = lower(w, n)
    low = momenta_along(w.low, shapes, split)
    taken = taken_in_turn(low, momenta_along(w.high, high, n - split), products, c)
    take_momenta(w.low, shapes, taken, split)
    take_momenta(w.high, high, taken, n - split)


@jit
def apply_dashpots_to_both(u, v, shapes, high, products, c, n):
    """`apply_dashpots` to u and v, whose modes are split alike: the shapes are read once."""
    split = lower(u, n)
    low, low_v = momenta_of_both(u.low, v.low, shapes, split)
    above, above_v = momenta_of_both(u.high, v.high, high, n - split)
    taken, taken_v = taken_in_turn(low, above, products, c), taken_in_turn(low_v, above_v, products, c)
    take_from_both(u.low, v.low, shapes, taken, taken_v, split)
    take_from_both(u.high, v.high, high, taken, taken_v, n - split)


@from_mode()
@jit
def kick_end(rows, n, first, x):
    """Adds the velocities x / m, m from 1: the string's end changes its speed (stop.py)."""
    x = like(rows, x)
    for j in range(n):
        rows.p[j] += rows.kappa[j] * (x / number_like(rows, first + j))


@along(one)
@jit
def slope_ahead(rows, n, weight, h):
    """Weighted sum of the displacements, extrapolated by `h` s at their velocities."""
    s = 0.0
    for j in range(n):
        s += weight[j] * (rows.q[j] + h * velocity(rows, j))
    return s


@from_mode(one)
@jit
def slope_square(rows, n, first):
    """Sum of (j q_j)^2, j from 1."""
    s = like(rows, 0.0)
    for j in range(n):
        x = number_like(rows, first + j) * rows.q[j]
        s += x * x
    return s


@from_mode_of_both(one)
@jit
def slope_square_of_both(rows, across, n, first):
    """Sum of u's and v's (j q_j)^2, j from 1."""
    s = like(rows, 0.0)
    for j in range(n):
        number = number_like(rows, first + j)
        s += number * number * (rows.q[j] * rows.q[j] + across.q[j] * across.q[j])
    return s


@from_mode()
@jit
def set_tense(rows, n, first):
    """Sets rows.tense from rows.kappa."""
    for j in range(n):
        number = number_like(rows, first + j)
        rows.tense[j] = rows.kappa[j] * (number * number)


@over()
@jit
def tighten(rows, n, push):
    """Subtracts push j^2 q_j from the velocities, j from 1: more tension for a moment (tension.py)."""
    push = like(rows, push)
    for j in range(n):
        rows.p[j] -= rows.tense[j] * (push * rows.q[j])


@jit
def add_shape_of(rows, held, kappa, sigma, up, moving, n):
    for j in range(n):
        x = held[j]
        rows.q[j] += up * x
        rows.p[j] += kappa[j] * (moving + sigma[j] * up) * x


@jit
def add_shape(w, up, moving, n):
    """Adds `up` times the held shape, at `moving` (1/s) times the shape as velocity: p = (q' + sigma q) / omega."""
    split = lower(w, n)
    add_shape_of(w.low, w.held, w.kappa, w.sigma, up, moving, split)
    add_shape_of(w.high, w.held[split:], w.kappa[split:], w.sigma[split:], up, moving, n - split)


@along()
@jit
def add_strike(rows, n, strike, weight):
    """Adds `weight` times the velocities `strike`: w.strike."""
    weight = like(rows, weight)
    for j in range(n):
        rows.p[j] += weight * rows.kappa[j] * like(rows, strike[j])


# Energies, and silent modes


@jit
def square_speed(rows, kappa, omega, j):
    """The squared velocity amplitude of mode `j`, m^3/s^2."""
    v = rows.p[j] / kappa[j]
    d = omega[j] * rows.q[j]
    return v * v + d * d


@by_pitch(one)
@jit
def speed_square(rows, n, kappa, omega):
    """Sum of squared velocity amplitudes, m^3/s^2: twice the energy per linear density."""
    e = 0.0
    for j in range(n):
        e += square_speed(rows, kappa, omega, j)
    return e


@jit
def held_speed_square(w, follow, n):
    """`speed_square` of the held shape alone, released with the velocity `follow` (1/s) times itself."""
    e = 0.0
    for j in range(n):
        x = w.held[j]
        e += (follow * follow + w.omega[j] * w.omega[j]) * (x * x)
    return e


@by_pitch(one)
@jit
def invariant(rows, n, kappa, omega):
    """Sum of P^2 + b q^2, m^3, b = (kappa omega)^2: the energy that eq. 12 conserves, in units of mu / (2 dt^2).

    It never divides by kappa, which is 0 for a mode at a multiple of half the contact rate.
    """
    e = 0.0
    for j in range(n):
        p = np.float64(rows.p[j])
        x = kappa[j] * omega[j] * rows.q[j]
        e += p * p + x * x
    return e


@by_pitch(one)
@jit
def amplitude_sum(rows, n, kappa, omega):
    """Sum of modal amplitudes, m^1.5: sqrt(2/L) times it bounds every later displacement."""
    s = 0.0
    for j in range(n):
        p = rows.p[j] / (kappa[j] * omega[j])
        x = np.float64(rows.q[j])
        s += np.sqrt(x * x + p * p)
    return s


@jit
def is_dead(rows, kappa, omega, n, silence):
    """True if the last BLOCK of `n` modes is below `silence` (m^1.5/s); sets it to exact zero."""
    maximum = 0.0
    for j in range(n - BLOCK, n):
        maximum = max(maximum, square_speed(rows, kappa, omega, j))
    if maximum > silence * silence:
        return False
    for j in range(n - BLOCK, n):
        rows.q[j] = like(rows, 0.0)
        rows.p[j] = like(rows, 0.0)
    return True


@jit
def drop_dead_modes(w, n, silences, heard):
    """Sets top BLOCKs to exact zero, and returns the number of remaining modes.

    `silences`, m^1.5/s: modes are silent below the first, and those from `heard` on below the second.
    """
    while n > 0:
        silence = silences[1] if n > heard else silences[0]
        split = w.split
        if n > split:
            dead = is_dead(w.high, w.kappa[split:], w.omega[split:], n - split, silence)
        else:
            dead = is_dead(w.low, w.kappa, w.omega, n, silence)
        if not dead:
            break
        n -= BLOCK
    return n


@over()
@apart
def clear_motion(rows, n):
    """Sets the motion to zero."""
    for j in range(n):
        rows.q[j] = like(rows, 0.0)
        rows.p[j] = like(rows, 0.0)


# Events: state and coefficients


@jit
def widen_of(rows, q, p, n):
    for j in range(n):
        q[j] = rows.q[j]
        p[j] = rows.p[j]


@apart
def widen(w, n):
    """Copies the state of `n` modes to w.q and w.p, float64, for an event that computes with it."""
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
    """The part exp(-`decay`) of the motion after a leap; at most MAX_LEFT in float32 rows."""
    left = exp(-decay)
    return min(left, MAX_LEFT) if rows.q.itemsize == SINGLE else left


@inlined
def set_fine(rows, j, omega, sigma, fine):
    """Sets the coefficients of mode `j` for a fine step; returns E s."""
    sine, cosine = sin_cos(0.5 * omega * fine)
    rows.kept[j], rows.spring[j], damp = fine_coefficients(sigma * fine, sine)
    return damp * (2.0 * sine * cosine)


@inlined
def set_leap(leap, j, turned, left, es):
    """Sets mode `j`'s coefficients for a leap that turns it by `turned` and leaves the part `left`."""
    sine, cosine = sin_cos(turned)
    sin_k = left * sine
    leap.a[j] = left * cosine
    leap.b[j] = sin_k / es
    leap.g[j] = sin_k * es


@jit
def retune_of(rows, n, kappas, omega, sigmas, op):
    fine = op.fine
    for j in range(n):
        w_d, sigma = omega[j], sigmas[j]
        es = set_fine(rows, j, w_d, sigma, fine)
        kappa = es / w_d
        rows.p[j] *= kappa / kappas[j]
        kappas[j] = kappa
        rows.kappa[j] = kappa
        rows.pace[j] = 1.0 / kappa
        for which in range(op.leaps):
            h = leap_steps(op, which) * fine
            set_leap(rows.leaps[which], j, w_d * h, left_by_leap(rows, sigma * h), es)


@apart
def retune(w, op, rows, ratio):
    """Scales the frequencies of `op`'s coefficients at `rows` by `ratio` and keeps the motion.

    P follows kappa, which keeps displacement and velocity. sigma (1/s) stays, the undamped frequency scales;
    sigma << omega. Frequencies stop at MAX_TURN: above it the contact rate cannot carry modes.
    """
    highest = MAX_TURN / op.fine
    omega = coefficient_at(rows, op, operators.OMEGA)
    for j in range(op.padded):
        w.omega[j] = omega[j] * ratio
        if w.omega[j] > highest and w.omega[j] > omega[j]:
            w.omega[j] = max(highest, omega[j])
    split = w.split
    retune_of(w.low, split, w.kappa, w.omega, w.sigma, op)
    retune_of(w.high, op.padded - split, w.kappa[split:], w.omega[split:], w.sigma[split:], op)
    set_tense(w, op.padded)
    w.spanned = 0


@jit
def tune_of(rows, n, kappas, omega, sigmas, op):
    fine = op.fine
    h = op.steps * fine
    for j in range(n):
        w_d, sigma = omega[j], sigmas[j]
        es = set_fine(rows, j, w_d, sigma, fine)
        kappas[j] = es / w_d
        rows.pace[j] = w_d / es
        set_leap(rows.leaps[WHOLE], j, w_d * h, left_by_leap(rows, sigma * h), es)


@apart
def tune(w, op):
    """Sets the fine-step and frame coefficients for the modes of `op` from w.omega and w.sigma."""
    split = lower(w, op.padded)
    tune_of(w.low, split, w.kappa, w.omega, w.sigma, op)
    tune_of(w.high, op.padded - split, w.kappa[split:], w.omega[split:], w.sigma[split:], op)
    w.spanned = 0


@jit
def take_row(low, high, op, row):
    """Copies the mixed row of `op` at the address `row` to `low` and `high`."""
    copy_row(low, low_part(row, op), op.split)
    copy_row(high, high_part(row, op), op.padded - op.split)


@jit
def put_row(op, row, low, high):
    """Copies `low` and `high` to the mixed row of `op` at the address `row`."""
    copy_row(low_part(row, op), low, op.split)
    copy_row(high_part(row, op), high, op.padded - op.split)


@apart
def take_coefficients(w, op, rows):
    """Gives the working set the untuned coefficients of operator `op` at `rows`: u's or v's."""
    n, split = op.padded, op.split
    w.split = split
    copy_row(w.kappa, coefficient_at(rows, op, operators.KAPPA), n)
    copy_row(w.omega, coefficient_at(rows, op, operators.OMEGA), n)
    copy_row(w.sigma, coefficient_at(rows, op, operators.SIGMA), n)
    take_row(w.low.kept, w.high.kept, op, mixed_coefficient(rows, op, operators.KEPT))
    take_row(w.low.spring, w.high.spring, op, mixed_coefficient(rows, op, operators.SPRING))
    take_row(w.low.pace, w.high.pace, op, mixed_coefficient(rows, op, operators.PACE))
    for which in range(op.leaps):
        low, high, row = w.low.leaps[which], w.high.leaps[which], operators.LEAPS + 3 * which
        take_row(low.a, high.a, op, mixed_coefficient(rows, op, row))
        take_row(low.b, high.b, op, mixed_coefficient(rows, op, row + 1))
        take_row(low.g, high.g, op, mixed_coefficient(rows, op, row + 2))
    copy_row(w.low.kappa, w.kappa, split)
    copy_row(w.high.kappa, w.kappa[split:], n - split)
    copy_row(w.low.sigma, w.sigma, split)
    copy_row(w.high.sigma, w.sigma[split:], n - split)
    set_tense(w, n)
    w.spanned = 0


@jit
def change_coefficients(w, old, op, rows):
    """Replaces the working set's coefficients of `old` by `op`'s at `rows`, and keeps the motion.

    New modes, and modes that only fill up a block, are at rest and untouched by hands.
    """
    shared = min(old.modes, op.modes)
    widen(w, shared)
    for j in range(shared):
        w.p[j] /= w.kappa[j]
    w.q[shared : op.padded] = 0.0
    w.p[shared : op.padded] = 0.0
    w.held[shared : op.padded] = 0.0
    w.strike[shared : op.padded] = 0.0
    w.finger[shared : op.padded] = 1.0
    take_coefficients(w, op, rows)
    for j in range(op.padded):
        w.p[j] *= w.kappa[j]
    narrow(w, op.padded)
