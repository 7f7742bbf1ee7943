"""Inner loops over modes, all the arithmetic of the engine.

A mode is (q, P). q is its displacement; P = E s p is its momentum scaled to the fine step dt, with
E = exp(-sigma dt), s = sin(omega dt), p = (q' + sigma q) / omega. One fine step without force is then

    q <- a q + P,   P <- a P - b q,   a = E cos(omega dt),  b = (E s)^2

and k fine steps at once, exactly, with three numbers: q <- A q + B P, P <- A P - G q. A force f of eq. 12 acting
during a step adds dt^2 dx/mu phi f to q and a times that to P, after the step: this is the scheme of eq. 12,
q^{n+1} = C q^n - Ct q^{n-1} + F, in a form with one state instead of two displacements, whose difference
would lose digits. Each loop touches a mode once; sums are reassociated by the compiler into lanes, the same
way each time. Distances between rows are compile-time constants (layout.py): without that no loop vectorises.
[any thread]
"""

import numpy as np

from livebass.compiling import LEAN, compiled
from livebass.kernels.records import BLOCK, LONGER, PART, ROW, WHOLE

LANES = {"reassoc", "contract", "nsz", "arcp"}
jit = compiled(fastmath=LANES, **LEAN)

DEAD = 1e-17  # m^1.5: a mode below this is silence


@jit
def fine_1(w, f0, n):
    u0 = 0.0
    for j in range(n):
        kick = f0 * w.near_shape[0, j]
        a = w.fine_a[j]
        x = w.q[j] + kick
        y = w.p[j] + a * kick
        q = a * x + y
        w.p[j] = a * y - w.fine_b[j] * x
        w.q[j] = q
        u0 += w.near_shape[0, j] * q
    return u0


@jit
def fine_2(w, f0, f1, n):
    u0 = 0.0
    u1 = 0.0
    for j in range(n):
        kick = f0 * w.near_shape[0, j] + f1 * w.near_shape[1, j]
        a = w.fine_a[j]
        x = w.q[j] + kick
        y = w.p[j] + a * kick
        q = a * x + y
        w.p[j] = a * y - w.fine_b[j] * x
        w.q[j] = q
        u0 += w.near_shape[0, j] * q
        u1 += w.near_shape[1, j] * q
    return u0, u1


@jit
def fine_3(w, f0, f1, f2, n):
    u0 = 0.0
    u1 = 0.0
    u2 = 0.0
    for j in range(n):
        kick = f0 * w.near_shape[0, j] + f1 * w.near_shape[1, j] + f2 * w.near_shape[2, j]
        a = w.fine_a[j]
        x = w.q[j] + kick
        y = w.p[j] + a * kick
        q = a * x + y
        w.p[j] = a * y - w.fine_b[j] * x
        w.q[j] = q
        u0 += w.near_shape[0, j] * q
        u1 += w.near_shape[1, j] * q
        u2 += w.near_shape[2, j] * q
    return u0, u1, u2


@jit
def fine_4(w, f0, f1, f2, f3, n):
    u0 = 0.0
    u1 = 0.0
    u2 = 0.0
    u3 = 0.0
    for j in range(n):
        kick = f0 * w.near_shape[0, j] + f1 * w.near_shape[1, j] + f2 * w.near_shape[2, j] + f3 * w.near_shape[3, j]
        a = w.fine_a[j]
        x = w.q[j] + kick
        y = w.p[j] + a * kick
        q = a * x + y
        w.p[j] = a * y - w.fine_b[j] * x
        w.q[j] = q
        u0 += w.near_shape[0, j] * q
        u1 += w.near_shape[1, j] * q
        u2 += w.near_shape[2, j] * q
        u3 += w.near_shape[3, j] * q
    return u0, u1, u2, u3


@jit
def kick(w, row, f, n):
    """Adds the effect of one contact force, its shape in working row `row`, after a fine step."""
    phi = w.near_shape[row]
    for j in range(n):
        x = f * phi[j]
        w.q[j] += x
        w.p[j] += w.fine_a[j] * x


@jit
def kick_from(w, pool, o, f, n):
    """`kick` with the shape that starts at pool[o]."""
    phi = pool[o : o + n]
    for j in range(n):
        x = f * phi[j]
        w.q[j] += x
        w.p[j] += w.fine_a[j] * x


@jit
def fine(w, n):
    """One fine step, free."""
    for j in range(n):
        a = w.fine_a[j]
        x = w.q[j]
        y = w.p[j]
        w.q[j] = a * x + y
        w.p[j] = a * y - w.fine_b[j] * x


@jit
def kicked_2(w, pool, o, p, f, g, n):
    """One fine step after the forces f and g, their shapes at pool[o] and pool[p]."""
    first = pool[o : o + n]
    second = pool[p : p + n]
    for j in range(n):
        kick = f * first[j] + g * second[j]
        a = w.fine_a[j]
        x = w.q[j] + kick
        y = w.p[j] + a * kick
        w.q[j] = a * x + y
        w.p[j] = a * y - w.fine_b[j] * x


@jit
def kicked_4(w, pool, o, p, r, s, f, g, h, i, n):
    """`kicked_2` with four forces."""
    first = pool[o : o + n]
    second = pool[p : p + n]
    third = pool[r : r + n]
    fourth = pool[s : s + n]
    for j in range(n):
        kick = f * first[j] + g * second[j] + h * third[j] + i * fourth[j]
        a = w.fine_a[j]
        x = w.q[j] + kick
        y = w.p[j] + a * kick
        w.q[j] = a * x + y
        w.p[j] = a * y - w.fine_b[j] * x


@jit
def displacement_4(w, pool, o, p, r, s, n):
    """`displacement` at four points."""
    first = pool[o : o + n]
    second = pool[p : p + n]
    third = pool[r : r + n]
    fourth = pool[s : s + n]
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
def leap(w, row, n):
    """Many fine steps at once, free: with A, B, G of rows `row` and two more."""
    a, b, g = w.leaps[row].a, w.leaps[row].b, w.leaps[row].g
    for j in range(n):
        x = w.q[j]
        y = w.p[j]
        w.q[j] = a[j] * x + b[j] * y
        w.p[j] = a[j] * y - g[j] * x


@jit
def try_leap(w, row, n):
    """`leap` that keeps the state before it in the _OLD rows."""
    a, b, g = w.leaps[row].a, w.leaps[row].b, w.leaps[row].g
    for j in range(n):
        x = w.q[j]
        y = w.p[j]
        w.q_before[j] = x
        w.p_before[j] = y
        w.q[j] = a[j] * x + b[j] * y
        w.p[j] = a[j] * y - g[j] * x


@jit
def take_back(w, n):
    for j in range(n):
        w.q[j] = w.q_before[j]
        w.p[j] = w.p_before[j]


@jit
def displacement(w, pool, o, n):
    """u at the point whose shape starts at pool[o]."""
    phi = pool[o : o + n]
    u = 0.0
    for j in range(n):
        u += phi[j] * w.q[j]
    return u


@jit
def displacement_old(w, pool, o, n):
    phi = pool[o : o + n]
    u = 0.0
    for j in range(n):
        u += phi[j] * w.q_before[j]
    return u


@jit
def displacement_before(w, pool, o, n):
    """u one fine step ago: q^{n-1} = (a q - P) / E^2, and E^2 = a^2 + b."""
    phi = pool[o : o + n]
    u = 0.0
    for j in range(n):
        a = w.fine_a[j]
        u += phi[j] * (a * w.q[j] - w.p[j]) / (a * a + w.fine_b[j])
    return u


@jit
def displacement_near(w, row, n):
    phi = w.near_shape[row]
    u = 0.0
    for j in range(n):
        u += phi[j] * w.q[j]
    return u


@jit
def copy_row(to, pool, o, n):
    phi = pool[o : o + n]
    for j in range(n):
        to[j] = phi[j]


@jit
def tap(w, pool, o, n):
    """A linear output: weights of q at pool[o], of P one row further."""
    of_q = pool[o : o + n]
    of_p = pool[o + ROW : o + ROW + n]
    y = 0.0
    for j in range(n):
        y += of_q[j] * w.q[j] + of_p[j] * w.p[j]
    return y


@jit
def sense_1(w, pool, o, n):
    """Displacement and velocity at a pickup whose weights start at pool[o]."""
    weight = pool[o : o + n]
    u = 0.0
    v = 0.0
    for j in range(n):
        q = w.q[j]
        u += weight[j] * q
        v += weight[j] * (w.pace[j] * w.p[j] - w.sigma[j] * q)
    return u, v


@jit
def sense_2(w, pool, o, n):
    """`sense_1` at two pickups, of the next row too."""
    weight = pool[o : o + n]
    other = pool[o + ROW : o + ROW + n]
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
def tap_shape(w, pool, o, n):
    """The tap of the held shape at rest."""
    y = 0.0
    for j in range(n):
        y += pool[o + j] * w.held[j]
    return y


@jit
def scale(w, factor, n):
    for j in range(n):
        w.q[j] *= factor
        w.p[j] *= factor


@jit
def finger(w, n):
    for j in range(n):
        w.q[j] *= w.finger[j]
        w.p[j] *= w.finger[j]


@jit
def release(w, n):
    """Adds the held shape, at rest: p = sigma q / omega."""
    for j in range(n):
        x = w.held[j]
        w.q[j] += x
        w.p[j] += w.kappa[j] * w.sigma[j] * x


@jit
def push(w, weight, n):
    for j in range(n):
        w.p[j] += weight * w.kappa[j] * w.strike[j]


@jit
def speed_square(w, n):
    """Sum of squared velocity amplitudes, m^3/s^2: twice the energy over mu."""
    e = 0.0
    for j in range(n):
        v = w.p[j] / w.kappa[j]
        d = w.omega[j] * w.q[j]
        e += v * v + d * d
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
def living(w, n):
    """Modes in use once dead BLOCKs at the top are set to exact zero."""
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
def clear(w, n):
    for j in range(n):
        w.q[j] = 0.0
        w.p[j] = 0.0


@jit
def retune(w, ratio, fine, steps, part_steps, n):
    """Coefficients of `n` modes whose frequencies are `ratio` times the operators', the motion kept.

    OMEGA holds the tuned frequencies already; P follows KAPPA, so that displacement and velocity stay.
    """
    for j in range(n):
        w_d = w.omega[j]
        sigma = w.sigma[j]
        damp = np.exp(-sigma * fine)
        es = damp * np.sin(w_d * fine)
        kappa = es / w_d
        w.p[j] *= kappa / w.kappa[j]
        w.kappa[j] = kappa
        w.pace[j] = 1.0 / kappa
        w.fine_a[j] = damp * np.cos(w_d * fine)
        w.fine_b[j] = es * es
        for which in range(3):
            row = WHOLE
            k = steps
            if which == 1:
                row = LONGER
                k = steps + 1
            elif which == 2:
                row = PART
                k = part_steps
            h = k * fine
            damp_k = np.exp(-sigma * h)
            sin_k = damp_k * np.sin(w_d * h)
            w.leaps[row].a[j] = damp_k * np.cos(w_d * h)
            w.leaps[row].b[j] = sin_k / es
            w.leaps[row].g[j] = sin_k * es


@jit
def exchange(w, old, new):
    """P becomes velocity over omega; modes that come in anew are at rest, and no hand touches them."""
    for j in range(old):
        w.p[j] /= w.kappa[j]
    for j in range(old, new):
        w.q[j] = 0.0
        w.p[j] = 0.0
        w.held[j] = 0.0
        w.strike[j] = 0.0
        w.finger[j] = 1.0


@jit
def from_velocity(w, n):
    for j in range(n):
        w.p[j] *= w.kappa[j]
