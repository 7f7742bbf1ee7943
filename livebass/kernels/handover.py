"""A motion goes over to the modes of another length: every change of fret of a string that sounds.

The longer part of the string has the length L and modes j, the shorter one L' = L - s and modes m; the shorter one's
stop lies s from the longer one's. The projection of the modes of one on those of the other is a formula:

    M_mj = 2 / sqrt(L L') k'_m sin(k_j s) / (k'_m^2 - k_j^2),   where k'_m = k_j: sqrt(L'/L) cos(k_j s).

To the shorter: the displacement at s, less the height of the crown there, is where the string's end is when the finger
meets it; from there the stop moves to rest (stop.py). The modes get q'_m = sum_j M_mj q_j - u(s) l_m, with u(s) the
displacement by the modes alone and l_m = sqrt(2 L') / (pi m), and the same for velocities. What was beyond s stays with
the fingers. The same formula with s < 0 continues the motion oddly beyond the old end: so it goes to a longer
string while a finger glides (glide.py).

To the longer: q_j = sum_m M_mj q'_m + T_j, where T is the shape that the finger held, a triangle with its corner at s:
beyond s the string was straight and at rest.

Both directions are one pass of two nested loops, without a table. `a` is the slot that sounds, `b` the other, loaded
and silent; `op` and `to` are their operators. [audio thread]
"""

import numpy as np

from livebass.compiling import compiled, jit
from livebass.kernels.elementary import cos, sin
from livebass.kernels.modal import LANES
from livebass.kernels.operators import heights, positions

SAME = 1e-9  # relative, of wave numbers that count as equal
CLOSE = 1e-6  # m: stops that are one

fast = compiled(fastmath=LANES)


@jit
def crown_height(op, s):
    """Height (m) of the obstacle next to `s` (m from the stop) over the string at rest; 0 without obstacles."""
    best, height = np.inf, 0.0
    x, h = positions(op), heights(op)
    for m in range(op.points):
        if abs(x[m] - s) < best:
            best = abs(x[m] - s)
            height = h[m]
    return height


@jit
def fill_squares(squares, top, n):
    """Squares of the `n` wave numbers top (j + 1), in a row: quicker than to make them in every sum."""
    for j in range(n):
        k = top * (j + 1)
        squares[j] = k * k


@fast
def sums_of_one(q, p, squares, n, square):
    """Sums of the first `n` q[j] and p[j] over (square - squares[j])."""
    x = 0.0
    y = 0.0
    for j in range(n):
        part = 1.0 / (square - squares[j])
        x += q[j] * part
        y += p[j] * part
    return x, y


@fast
def sums_of_two(q, p, q_v, p_v, squares, n, square):
    """`sums_of_one` of two polarisations: the quotients take longer than the sums."""
    x = 0.0
    y = 0.0
    x_v = 0.0
    y_v = 0.0
    for j in range(n):
        part = 1.0 / (square - squares[j])
        x += q[j] * part
        y += p[j] * part
        x_v += q_v[j] * part
        y_v += p_v[j] * part
    return x, y, x_v, y_v


@jit
def equal_mode(k, top, n):
    """Index of the mode with the wave number `k` among n modes with top (j + 1); -1: there is none."""
    j = np.int64(np.rint(k / top)) - 1
    return j if 0 <= j < n and abs(top * (j + 1) - k) <= SAME * k else -1


@jit
def velocities(w, n):
    """Puts the velocities of `n` modes into w.p_before, and their displacements into w.q_before."""
    for j in range(n):
        w.q_before[j] = w.q[j]
        w.p_before[j] = w.pace[j] * w.p[j] - w.sigma[j] * w.q[j]


@jit
def put(w, j, q, v):
    """Gives mode `j` a displacement and a velocity."""
    w.q[j] = q
    w.p[j] = w.kappa[j] * (v + w.sigma[j] * q)


@jit
def straight(w, j, part):
    """Displacement and velocity of mode `j` times `part`."""
    q = w.q[j]
    return part * q, part * (w.pace[j] * w.p[j] - w.sigma[j] * q)


@jit
def projected(a, squares, k, n, same, factor, part):
    """Displacement and velocity of the mode with the wave number `k`, of u and, where it moves, of v.

    They are `factor` times the sums over all `n` weighed modes but `same`, whose own part is `part`.
    """
    u, v = a.u, a.v
    j = max(same, 0)
    kept = squares[j], u.q_before[j], u.p_before[j], v.q_before[j], v.p_before[j]
    if same >= 0:  # no mode has the wave number 0
        squares[j] = u.q_before[j] = u.p_before[j] = v.q_before[j] = v.p_before[j] = 0.0
    if a.v_active > 0:
        x, y, x_v, y_v = sums_of_two(u.q_before, u.p_before, v.q_before, v.p_before, squares, n, k * k)
    else:
        x, y = sums_of_one(u.q_before, u.p_before, squares, n, k * k)
        x_v = y_v = 0.0
    squares[j], u.q_before[j], u.p_before[j], v.q_before[j], v.p_before[j] = kept
    x, y, x_v, y_v = factor * x, factor * y, factor * x_v, factor * y_v
    if same >= 0:
        q, p = straight(u, same, part)
        x, y = x + q, y + p
        if a.v_active > 0:
            q, p = straight(v, same, part)
            x_v, y_v = x_v + q, y_v + p
    return x, y, x_v, y_v


@jit
def to_shorter(a, op, b, to):
    """Hands the motion of slot `a` over to the shorter `b`, of u and, where it moves, of v.

    Returns displacement and velocity at its stop by the modes, of u, then of v.
    """
    s = op.length - to.length
    k1, k1_new = np.pi / op.length, np.pi / to.length
    n = max(a.active, a.v_active)
    sways = a.v_active > 0
    u_stop, u_speed = weigh_at(a.u, op, s, n)
    v_stop = v_speed = 0.0
    if sways:
        v_stop, v_speed = weigh_at(a.v, op, s, n)
    squares = b.u.q_before
    fill_squares(squares, k1, n)
    scale = 2.0 / np.sqrt(op.length * to.length)
    for m in range(to.modes):
        k = (m + 1) * k1_new
        same = equal_mode(k, k1, n)
        part = np.sqrt(to.length / op.length) * cos(k * s) if same >= 0 else 0.0
        q, p, q_v, p_v = projected(a, squares, k, n, same, scale * k, part)
        line = np.sqrt(2 * to.length) / (np.pi * (m + 1))
        put(b.u, m, q - u_stop * line, p - u_speed * line)
        if sways:
            put(b.v, m, q_v - v_stop * line, p_v - v_speed * line)
    return u_stop, u_speed, v_stop, v_speed


@jit
def weigh_at(w, op, s, n):
    """Weighs `n` modes by their shape at `s` for `projected`; returns displacement and velocity there."""
    velocities(w, n)
    k1 = np.pi / op.length
    u = 0.0
    v = 0.0
    for j in range(n):
        phi = sin((j + 1) * k1 * s)
        w.q_before[j] *= phi
        w.p_before[j] *= phi
        u += w.q_before[j]
        v += w.p_before[j]
    root = np.sqrt(2 / op.length)
    return u * root, v * root


@jit
def weigh_by_number(w, op, n):
    """Weighs `n` modes by their wave numbers for `projected`."""
    velocities(w, n)
    for m in range(n):
        k = (m + 1) * (np.pi / op.length)
        w.q_before[m] *= k
        w.p_before[m] *= k


@jit
def to_longer(a, op, b, to, at, at_v):
    """Hands the motion of slot `a` over to the longer `b`, of u and, where it moves, of v.

    The stop of u was at[0] m over the line that the longer string rests on, and moved at at[1] m/s; that of v `at_v`.
    """
    s = to.length - op.length
    k1, k1_old = np.pi / to.length, np.pi / op.length
    n = max(a.active, a.v_active)
    sways = a.v_active > 0
    weigh_by_number(a.u, op, n)
    if sways:
        weigh_by_number(a.v, op, n)
    squares = b.u.q_before
    fill_squares(squares, k1_old, n)
    scale = 2.0 / np.sqrt(op.length * to.length)
    corner = np.sqrt(2 / to.length) * to.length / (s * (to.length - s))
    for j in range(to.modes):
        k = (j + 1) * k1
        phi = sin(k * s)
        same = equal_mode(k, k1_old, n)
        part = np.sqrt(op.length / to.length) * cos(k * s) if same >= 0 else 0.0
        q, p, q_v, p_v = projected(a, squares, k, n, same, -scale * phi, part)
        shape = corner * phi / (k * k) / (1 + to.held_stiffness * (k * k))
        put(b.u, j, q + at[0] * shape, p + at[1] * shape)
        if b.v_ready:
            put(b.v, j, q_v + at_v[0] * shape, p_v + at_v[1] * shape)
