"""Passes over the modes of a string: all arithmetic whose cost grows with their number.

A mode is (q, P). q is its displacement; P = E s p is its momentum scaled to the fine step dt, with
E = exp(-sigma dt), s = sin(omega dt), p = (q' + sigma q) / omega. One fine step without force is then

    q <- a q + P,   P <- a P - b q,   a = E cos(omega dt),  b = (E s)^2

and k fine steps at once, exactly, with three numbers: q <- A q + B P, P <- A P - G q.

Fine steps with contact are taken one by one, in (q, d), d = q^n - q^{n-1}, which needs the fewest operations:

    d <- d - (l d + s q),   q <- q + d,   l = 1 - E^2,   s = (1 - E)^2 + 4 E sin^2(omega dt / 2).

A force f of eq. 12 acting during a step adds dt^2 dx/mu phi f to q and to d, after the step: this is the scheme of
eq. 12, q^{n+1} = C q^n - Ct q^{n-1} + F, with the difference of two displacements as a number of its own, which loses
no digits. The first of them has no force before it, and turns (q, P) into (q, d) on its way: d = P - (1 - a) q,
1 - a = (l + s) / 2. `to_momenta` turns it back: P = E^2 d - (E^2 - a) q, E^2 - a = (s - l) / 2.

Each loop reads a mode once and adds, multiplies and stores; exp and sin stand only where coefficients are made. The
compiler may reassociate sums into vector lanes (`LANES`), the same way each time on one kind of processor. Loops
vectorise because distances between the rows of a working set are constants (records.py). w is a working set, op an
operator, phi the mode shapes at a point, n a number of modes, whole BLOCKs. [any thread]
"""

import numpy as np

from livebass.compiling import compiled
from livebass.kernels.machine.elementary import exp, exp_less_one, sin_cos
from livebass.kernels.string import operators
from livebass.kernels.string.operators import coefficient_at, shape
from livebass.kernels.string.records import BLOCK, LONGER, PART, WHOLE

LANES = {"reassoc", "contract", "nsz", "arcp"}
jit = compiled(fastmath=LANES)

DEAD = 1e-17  # m^1.5: a mode below this is silence
MOST_TURN = 2 * np.pi * 0.45  # rad a fine step, of a mode that a string is played with


@jit
def mode_number(j):
    """The number j + 1 of mode `j`, from 1. Processors convert integers of 32 bits many at a time, of 64 bits not."""
    return np.float64(np.int32(j + 1))


@jit
def fine_coefficients(decay, half_sine):
    """Returns loss l, spring s and E of a mode that loses exp(-`decay`) a fine step; `half_sine`: sin(omega dt / 2).

    The first two are small: nothing of them is the difference of larger numbers.
    """
    gone = -exp_less_one(-decay)
    left = 1.0 - gone
    return gone * (1.0 + left), gone * gone + 4.0 * left * (half_sine * half_sine), left


@jit
def first_step(w, n):
    """Takes the first of the fine steps: (q, P) becomes (q, d) a step later."""
    for j in range(n):
        x = w.q[j]
        d = w.p[j] - 0.5 * (w.loss[j] + w.spring[j]) * x
        w.p[j] = d
        w.q[j] = x + d


@jit
def first_step_before_leap(w, n):
    """`first_step` from where the last `try_leap` began."""
    for j in range(n):
        x = w.q_before[j]
        d = w.p_before[j] - 0.5 * (w.loss[j] + w.spring[j]) * x
        w.p[j] = d
        w.q[j] = x + d


@jit
def to_momenta(w, n):
    """Turns (q, d) back into (q, P)."""
    for j in range(n):
        loss = w.loss[j]
        w.p[j] = (1.0 - loss) * w.p[j] - 0.5 * (w.spring[j] - loss) * w.q[j]


# Fine steps after the first, and their forces, of (q, d). fine_1, fine_2 and fine_4 take one after the forces `f` at that many
# points, and return the displacements (m) there; a point may stand twice in the list, with the force 0 the second time.
@jit
def fine_1(w, op, point, f, n):
    phi = shape(op, point)
    u0 = 0.0
    for j in range(n):
        kick = f * phi[j]
        x = w.q[j] + kick
        d = w.p[j] + kick
        d = (d - w.loss[j] * d) - w.spring[j] * x
        x += d
        w.p[j] = d
        w.q[j] = x
        u0 += phi[j] * x
    return u0


@jit
def fine_2(w, op, points, f, n):
    first, second = shape(op, points[0]), shape(op, points[1])
    f0, f1 = f
    u0 = 0.0
    u1 = 0.0
    for j in range(n):
        kick = f0 * first[j] + f1 * second[j]
        x = w.q[j] + kick
        d = w.p[j] + kick
        d = (d - w.loss[j] * d) - w.spring[j] * x
        x += d
        w.p[j] = d
        w.q[j] = x
        u0 += first[j] * x
        u1 += second[j] * x
    return u0, u1


@jit
def fine_4(w, op, points, f, n):
    first, second = shape(op, points[0]), shape(op, points[1])
    third, fourth = shape(op, points[2]), shape(op, points[3])
    f0, f1, f2, f3 = f
    u0 = 0.0
    u1 = 0.0
    u2 = 0.0
    u3 = 0.0
    for j in range(n):
        kick = f0 * first[j] + f1 * second[j] + f2 * third[j] + f3 * fourth[j]
        x = w.q[j] + kick
        d = w.p[j] + kick
        d = (d - w.loss[j] * d) - w.spring[j] * x
        x += d
        w.p[j] = d
        w.q[j] = x
        u0 += first[j] * x
        u1 += second[j] * x
        u2 += third[j] * x
        u3 += fourth[j] * x
    return u0, u1, u2, u3


@jit
def kick(w, phi, f, n):
    """Adds the effect of one contact force at a point with mode shapes `phi`, after a fine step."""
    for j in range(n):
        x = f * phi[j]
        w.q[j] += x
        w.p[j] += x


@jit
def fine(w, n):
    """Takes one fine step, free."""
    for j in range(n):
        x = w.q[j]
        d = w.p[j]
        d = (d - w.loss[j] * d) - w.spring[j] * x
        x += d
        w.p[j] = d
        w.q[j] = x


@jit
def fine_kicked_2(w, op, points, f, n):
    """Takes one fine step after two forces `f` at two `points`."""
    first, second = shape(op, points[0]), shape(op, points[1])
    f0, f1 = f
    for j in range(n):
        kick = f0 * first[j] + f1 * second[j]
        x = w.q[j] + kick
        d = w.p[j] + kick
        d = (d - w.loss[j] * d) - w.spring[j] * x
        x += d
        w.p[j] = d
        w.q[j] = x


@jit
def fine_kicked_4(w, op, points, f, n):
    """Takes one fine step after four forces `f` at four `points`."""
    first, second = shape(op, points[0]), shape(op, points[1])
    third, fourth = shape(op, points[2]), shape(op, points[3])
    f0, f1, f2, f3 = f
    for j in range(n):
        kick = f0 * first[j] + f1 * second[j] + f2 * third[j] + f3 * fourth[j]
        x = w.q[j] + kick
        d = w.p[j] + kick
        d = (d - w.loss[j] * d) - w.spring[j] * x
        x += d
        w.p[j] = d
        w.q[j] = x


@jit
def displacement_4(w, op, points, n):
    """Displacements at four `points` in one pass."""
    first, second = shape(op, points[0]), shape(op, points[1])
    third, fourth = shape(op, points[2]), shape(op, points[3])
    u0 = 0.0
    u1 = 0.0
    u2 = 0.0
    u3 = 0.0
    for j in range(n):
        q = w.q[j]
        u0 += first[j] * q
        u1 += second[j] * q
        u2 += third[j] * q
        u3 += fourth[j] * q
    return u0, u1, u2, u3


@jit
def leap(w, which, n):
    """Takes many fine steps at once, free, by the coefficients w.leaps[which]."""
    a, b, g = w.leaps[which].a, w.leaps[which].b, w.leaps[which].g
    for j in range(n):
        x = w.q[j]
        y = w.p[j]
        w.q[j] = a[j] * x + b[j] * y
        w.p[j] = a[j] * y - g[j] * x


@jit
def try_leap(w, which, n):
    """Leaps, and keeps the state before in q_before and p_before."""
    a, b, g = w.leaps[which].a, w.leaps[which].b, w.leaps[which].g
    for j in range(n):
        x = w.q[j]
        y = w.p[j]
        w.q_before[j] = x
        w.p_before[j] = y
        w.q[j] = a[j] * x + b[j] * y
        w.p[j] = a[j] * y - g[j] * x


@jit
def leap_from_before(w, which, n):
    """Leaps from where the last `try_leap` began."""
    a, b, g = w.leaps[which].a, w.leaps[which].b, w.leaps[which].g
    for j in range(n):
        x = w.q_before[j]
        y = w.p_before[j]
        w.q[j] = a[j] * x + b[j] * y
        w.p[j] = a[j] * y - g[j] * x


@jit
def keep(w, n):
    """Keeps the state in q_before and p_before, as `try_leap` does."""
    for j in range(n):
        w.q_before[j] = w.q[j]
        w.p_before[j] = w.p[j]


@jit
def displacement(w, phi, n):
    """Displacement (m) at a point with mode shapes `phi`."""
    u = 0.0
    for j in range(n):
        u += phi[j] * w.q[j]
    return u


@jit
def displacement_before_leap(w, phi, n):
    """Displacement (m) before the last `try_leap`, or of `keep_step_before`."""
    u = 0.0
    for j in range(n):
        u += phi[j] * w.q_before[j]
    return u


@jit
def displacement_step_before(w, phi, n):
    """Displacement (m) one fine step ago: q^{n-1} = q - (P + (E^2 - a) q) / E^2."""
    u = 0.0
    for j in range(n):
        loss = w.loss[j]
        x = w.q[j]
        u += phi[j] * (x - (w.p[j] + 0.5 * (w.spring[j] - loss) * x) / (1.0 - loss))
    return u


@jit
def displacement_step_before_leap(w, phi, n):
    """Displacement (m) one fine step before the last `try_leap` began."""
    u = 0.0
    for j in range(n):
        loss = w.loss[j]
        x = w.q_before[j]
        u += phi[j] * (x - (w.p_before[j] + 0.5 * (w.spring[j] - loss) * x) / (1.0 - loss))
    return u


@jit
def displacement_now_and_later(w, phi, which, n):
    """Displacement (m) at a point now, and after the leap w.leaps[which]."""
    a, b = w.leaps[which].a, w.leaps[which].b
    u = 0.0
    later = 0.0
    for j in range(n):
        u += phi[j] * w.q[j]
        later += phi[j] * (a[j] * w.q[j] + b[j] * w.p[j])
    return u, later


@jit
def shift(w, c, f, n):
    """Adds `f` times `c` to the displacements."""
    for j in range(n):
        w.q[j] += f * c[j]


@jit
def dot(phi, other, n):
    """Sum of products of two rows."""
    x = 0.0
    for j in range(n):
        x += phi[j] * other[j]
    return x


@jit
def keep_step_before(w, n):
    """Puts the displacements of the modes one fine step ago into q_before, for `displacement_before_leap`."""
    for j in range(n):
        loss = w.loss[j]
        q = w.q[j]
        w.q_before[j] = q - (w.p[j] + 0.5 * (w.spring[j] - loss) * q) / (1.0 - loss)


@jit
def copy_row(to, values, n):
    """Copies `n` numbers; numba's own assignment of slices allocates where they might overlap."""
    for j in range(n):
        to[j] = values[j]


@jit
def read_tap(w, of_q, of_p, n):
    """Linear output with the weights `of_q` and `of_p`."""
    y = 0.0
    for j in range(n):
        y += of_q[j] * w.q[j] + of_p[j] * w.p[j]
    return y


@jit
def sense_1(w, weight, n):
    """Displacement (m) and velocity (m/s) at a pickup with these weights."""
    u = 0.0
    v = 0.0
    for j in range(n):
        q = w.q[j]
        u += weight[j] * q
        v += weight[j] * (w.pace[j] * w.p[j] - w.sigma[j] * q)
    return u, v


@jit
def sense_2(w, weight, other, n):
    """Displacements and velocities at two pickups in one pass."""
    u0 = 0.0
    v0 = 0.0
    u1 = 0.0
    v1 = 0.0
    for j in range(n):
        q = w.q[j]
        moving = w.pace[j] * w.p[j] - w.sigma[j] * q
        u0 += weight[j] * q
        v0 += weight[j] * moving
        u1 += other[j] * q
        v1 += other[j] * moving
    return u0, v0, u1, v1


@jit
def speed_2(w, weight, other, n):
    """Velocities (m/s) at two pickups in one pass."""
    v0 = 0.0
    v1 = 0.0
    for j in range(n):
        moving = w.pace[j] * w.p[j] - w.sigma[j] * w.q[j]
        v0 += weight[j] * moving
        v1 += other[j] * moving
    return v0, v1


@jit
def tap_held(w, weight, n):
    """Linear output of the held shape at rest."""
    y = 0.0
    for j in range(n):
        y += weight[j] * w.held[j]
    return y


@jit
def scale(w, factor, n):
    """Multiplies the motion by `factor`."""
    for j in range(n):
        w.q[j] *= factor
        w.p[j] *= factor


@jit
def damp_by_finger(w, n):
    """Damps each mode as the finger that touches does in one frame."""
    for j in range(n):
        w.q[j] *= w.finger[j]
        w.p[j] *= w.finger[j]


@jit
def apply_dashpots(w, shapes, products, c, n):
    """Takes the parts `c` of the momentum that the motion has along each of three `shapes`, one after the other.

    `products` are those of the first and second, the first and third, the second and third: a finger on the string
    (touch.py).
    """
    first, second, third = shapes[0], shapes[1], shapes[2]
    x = 0.0
    y = 0.0
    z = 0.0
    for j in range(n):
        p = w.p[j]
        x += first[j] * p
        y += second[j] * p
        z += third[j] * p
    x *= c[0]
    y = c[1] * (y - products[0] * x)
    z = c[2] * (z - products[1] * x - products[2] * y)
    for j in range(n):
        w.p[j] -= x * first[j] + y * second[j] + z * third[j]


@jit
def kick_end(w, x, n):
    """Adds the velocities x / m, m from 1: the string's end changes its speed (stop.py)."""
    for j in range(n):
        w.p[j] += w.kappa[j] * (x / mode_number(j))


@jit
def slope_ahead(w, weight, h, n):
    """Sum of the displacements, `h` s from now at their velocities, with weights."""
    s = 0.0
    for j in range(n):
        q = w.q[j]
        s += weight[j] * (q + h * (w.pace[j] * w.p[j] - w.sigma[j] * q))
    return s


@jit
def slope_square(w, n):
    """Sum of (j q_j)^2, j from 1."""
    s = 0.0
    for j in range(n):
        x = mode_number(j) * w.q[j]
        s += x * x
    return s


@jit
def tighten(w, push, n):
    """Takes push j^2 q_j from the velocities, j from 1: more tension for a moment (tension.py)."""
    for j in range(n):
        w.p[j] -= w.kappa[j] * push * (mode_number(j) * mode_number(j)) * w.q[j]


@jit
def fade(w, factor, first, n):
    """Multiplies the motion of the modes from `first` on by `factor`."""
    for j in range(first, n):
        w.q[j] *= factor
        w.p[j] *= factor


@jit
def release_shape(w, follow, n):
    """Adds the held shape to the motion, its velocity `follow` (1/s) times itself: p = (q' + sigma q) / omega."""
    for j in range(n):
        x = w.held[j]
        w.q[j] += x
        w.p[j] += w.kappa[j] * (w.sigma[j] + follow) * x


@jit
def add_strike(w, weight, n):
    """Adds `weight` times the velocities of the strike."""
    for j in range(n):
        w.p[j] += weight * w.kappa[j] * w.strike[j]


@jit
def speed_square(w, n):
    """Sum of squared velocity amplitudes, m^3/s^2: twice the energy per linear density."""
    e = 0.0
    for j in range(n):
        v = w.p[j] / w.kappa[j]
        d = w.omega[j] * w.q[j]
        e += v * v + d * d
    return e


@jit
def held_speed_square(w, follow, n):
    """`speed_square` of the held shape alone, as it is released with its velocity `follow` (1/s) times itself."""
    e = 0.0
    for j in range(n):
        x = w.held[j]
        e += (follow * follow + w.omega[j] * w.omega[j]) * (x * x)
    return e


@jit
def invariant(w, n):
    """Sum of P^2 + b q^2, m^3, b = (kappa omega)^2: the energy that eq. 12 conserves, in units of mu / (2 dt^2).

    It never divides by kappa, which vanishes for a mode at a multiple of half the contact rate.
    """
    e = 0.0
    for j in range(n):
        x = w.kappa[j] * w.omega[j] * w.q[j]
        e += w.p[j] * w.p[j] + x * x
    return e


@jit
def amplitude_sum(w, n):
    """Sum of modal amplitudes, m^1.5: sqrt(2/L) times it bounds every displacement from now on."""
    s = 0.0
    for j in range(n):
        p = w.p[j] / (w.kappa[j] * w.omega[j])
        x = w.q[j]
        s += np.sqrt(x * x + p * p)
    return s


@jit
def drop_dead_modes(w, n):
    """Sets dead BLOCKs at the top to exact zero and returns the number of modes left."""
    while n > 0:
        most = 0.0
        for j in range(n - BLOCK, n):
            p = w.p[j] / (w.kappa[j] * w.omega[j])
            x = w.q[j]
            most = max(most, x * x + p * p)
        if most > DEAD * DEAD:
            break
        for j in range(n - BLOCK, n):
            w.q[j] = 0.0
            w.p[j] = 0.0
        n -= BLOCK
    return n


@jit
def clear_motion(w, n):
    """Sets the motion to zero."""
    for j in range(n):
        w.q[j] = 0.0
        w.p[j] = 0.0


@jit
def retune(w, op, rows, ratio):
    """Sets coefficients for `ratio` times the frequencies of those of `op` at `rows` (1/s stay), the motion kept.

    P follows kappa, so that displacement and velocity stay. sigma stays, the undamped frequency scales; sigma << omega.
    Modes that would get above MOST_TURN stay there: above, the contact rate cannot carry them.
    """
    fine = op.fine
    highest = MOST_TURN / fine
    omega = coefficient_at(rows, op, operators.OMEGA)
    for j in range(op.padded):
        w.omega[j] = omega[j] * ratio
        if w.omega[j] > highest and w.omega[j] > omega[j]:
            w.omega[j] = max(highest, omega[j])
    for j in range(op.padded):
        w_d = w.omega[j]
        sigma = w.sigma[j]
        sine, cosine = sin_cos(0.5 * w_d * fine)
        w.loss[j], w.spring[j], damp = fine_coefficients(sigma * fine, sine)
        es = damp * (2.0 * sine * cosine)
        kappa = es / w_d
        w.p[j] *= kappa / w.kappa[j]
        w.kappa[j] = kappa
        w.pace[j] = 1.0 / kappa
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
            damp_k = exp(-sigma * h)
            sine, cosine = sin_cos(w_d * h)
            sin_k = damp_k * sine
            w.leaps[row].a[j] = damp_k * cosine
            w.leaps[row].b[j] = sin_k / es
            w.leaps[row].g[j] = sin_k * es


@jit
def tune(w, fine, steps, n):
    """Sets the coefficients of `n` modes, but of parts of a frame and of longer ones, by w.omega and w.sigma."""
    h = steps * fine
    for j in range(n):
        w_d = w.omega[j]
        sigma = w.sigma[j]
        sine, cosine = sin_cos(0.5 * w_d * fine)
        w.loss[j], w.spring[j], damp = fine_coefficients(sigma * fine, sine)
        es = damp * (2.0 * sine * cosine)
        w.kappa[j] = es / w_d
        w.pace[j] = w_d / es
        damp_k = exp(-sigma * h)
        sine, cosine = sin_cos(w_d * h)
        sin_k = damp_k * sine
        w.leaps[WHOLE].a[j] = damp_k * cosine
        w.leaps[WHOLE].b[j] = sin_k / es
        w.leaps[WHOLE].g[j] = sin_k * es


@jit
def take_coefficients(w, op, rows):
    """Gives the working set the coefficients of operator `op` at `rows`, those of u or of v, untuned."""
    n = op.padded
    copy_row(w.loss, coefficient_at(rows, op, operators.LOSS), n)
    copy_row(w.spring, coefficient_at(rows, op, operators.SPRING), n)
    for which in (WHOLE, LONGER, PART):
        copy_row(w.leaps[which].a, coefficient_at(rows, op, operators.LEAPS + 3 * which), n)
        copy_row(w.leaps[which].b, coefficient_at(rows, op, operators.LEAPS + 3 * which + 1), n)
        copy_row(w.leaps[which].g, coefficient_at(rows, op, operators.LEAPS + 3 * which + 2), n)
    copy_row(w.kappa, coefficient_at(rows, op, operators.KAPPA), n)
    copy_row(w.omega, coefficient_at(rows, op, operators.OMEGA), n)
    copy_row(w.sigma, coefficient_at(rows, op, operators.SIGMA), n)
    copy_row(w.pace, coefficient_at(rows, op, operators.PACE), n)


@jit
def change_coefficients(w, old, op, rows):
    """Gives the working set the coefficients of `op` at `rows` in place of those of `old`, the motion kept.

    Modes that come in anew are at rest, and no hand touches them; so are those that only fill up a block.
    """
    shared = min(old.modes, op.modes)
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
