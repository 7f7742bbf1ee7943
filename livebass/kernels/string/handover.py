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

A sum over the modes of the old length for each mode of the new one takes nearly all the time, most of it for divisions.
So four sums go side by side, and one division serves four quotients: with r = 1 / (a b c d), 1 / a = (r c d) b. The
highest modes are left out if all of them together are NEGLIGIBLE. `a` is the slot that sounds, `b` the other, loaded
and silent; `op` and `to` are their operators. [audio thread]
"""

import numpy as np

from livebass.compiling import compiled, jit
from livebass.kernels.machine.elementary import cos, sin
from livebass.kernels.string import modal
from livebass.kernels.string.modal import LANES, mode_number
from livebass.kernels.string.operators import heights, positions
from livebass.kernels.string.records import BLOCK

SAME = 1e-9  # relative, of wave numbers that count as equal
CLOSE = 1e-6  # m: stops that are one
NEGLIGIBLE = 1e-12  # of all weighed displacements, and velocities: what the highest modes have that are left out

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
    """Fills a row with the squares of the `n` wave numbers top (j + 1)."""
    for j in range(n):
        k = top * mode_number(j)
        squares[j] = k * k


@fast
def sum_of_squares(values, first, end):
    """Sum of the squares of values[first:end]."""
    x = 0.0
    for j in range(first, end):
        x += values[j] * values[j]
    return x


@jit
def needed(w, n):
    """Number of the `n` weighed modes that count, in whole BLOCKs: those above are NEGLIGIBLE."""
    q = NEGLIGIBLE * NEGLIGIBLE * sum_of_squares(w.q_before, 0, n)
    p = NEGLIGIBLE * NEGLIGIBLE * sum_of_squares(w.p_before, 0, n)
    while n > 0:
        q -= sum_of_squares(w.q_before, n - BLOCK, n)
        p -= sum_of_squares(w.p_before, n - BLOCK, n)
        if not (q >= 0.0 and p >= 0.0):
            break
        n -= BLOCK
    return n


@fast
def four_sums(w, squares, n, new, wanted, m):
    """Gives new.q[m] the sum of the first `n` weighed displacements over (wanted[m] - squares[j]), new.p[m] velocities.

    The same for the next three modes. No difference may be zero.
    """
    a, b, c, d = wanted[m], wanted[m + 1], wanted[m + 2], wanted[m + 3]
    q_a = q_b = q_c = q_d = 0.0
    p_a = p_b = p_c = p_d = 0.0
    for j in range(n):
        square, q, p = squares[j], w.q_before[j], w.p_before[j]
        x, y, z, u = a - square, b - square, c - square, d - square
        x_y, z_u = x * y, z * u
        inverse = 1.0 / (x_y * z_u)
        over_x_y, over_z_u = inverse * z_u, inverse * x_y
        part = over_x_y * y
        q_a += q * part
        p_a += p * part
        part = over_x_y * x
        q_b += q * part
        p_b += p * part
        part = over_z_u * u
        q_c += q * part
        p_c += p * part
        part = over_z_u * z
        q_d += q * part
        p_d += p * part
    new.q[m], new.q[m + 1], new.q[m + 2], new.q[m + 3] = q_a, q_b, q_c, q_d
    new.p[m], new.p[m + 1], new.p[m + 2], new.p[m + 3] = p_a, p_b, p_c, p_d


@jit
def all_sums(w, squares, n, new, wanted, to):
    """`four_sums` for all modes of `to`."""
    n = needed(w, n)
    for m in range(0, to.modes, 4):
        four_sums(w, squares, n, new, wanted, m)
    for m in range(to.modes, to.padded):
        new.q[m] = 0.0
        new.p[m] = 0.0


@jit
def equal_mode(k, top, n):
    """Index of the mode with the wave number `k` among n modes with top (j + 1); -1: there is none."""
    j = np.int64(np.rint(k / top)) - 1
    return j if 0 <= j < n and abs(top * (j + 1) - k) <= SAME * k else -1


@jit
def velocities(w, n):
    """Puts the velocities of `n` modes into w.p_before, and their displacements into w.q_before."""
    modal.widen(w, n)
    for j in range(n):
        w.q_before[j] = w.q[j]
        w.p_before[j] = w.p[j] / w.kappa[j] - w.sigma[j] * w.q[j]


@jit
def set_mode_state(w, j, q, v):
    """Sets displacement and velocity of mode `j` in w.q and w.p, for modal.narrow."""
    w.q[j] = q
    w.p[j] = w.kappa[j] * (v + w.sigma[j] * q)


@jit
def add_equal_modes(w, op, new, to, n):
    """Adds the projection of modes of `op` on modes of `to` with the same wave number."""
    s = op.length - to.length
    k1, k1_new = np.pi / op.length, np.pi / to.length
    root = np.sqrt(min(op.length, to.length) / max(op.length, to.length))
    for m in range(to.modes):
        k = (m + 1) * k1_new
        j = equal_mode(k, k1, n)
        if j >= 0:
            part = root * cos(k * s)
            q, v = part * w.q[j], part * (w.p[j] / w.kappa[j] - w.sigma[j] * w.q[j])
            new.q[m] += q
            new.p[m] += new.kappa[m] * (v + new.sigma[m] * q)


@jit
def to_shorter(a, op, b, to):
    """Hands the motion of slot `a` over to the shorter `b`, of u and, where it moves, of v.

    Returns displacement and velocity at its stop by the modes, of u, then of v.
    """
    x, v = shorten(a.u, op, b.u, to, a.active)
    x_v = v_v = 0.0
    if a.v_active > 0:
        x_v, v_v = shorten(a.v, op, b.v, to, a.v_active)
    return x, v, x_v, v_v


@jit
def shorten(w, op, new, to, n):
    """`to_shorter` of the `n` modes of one polarisation."""
    s = op.length - to.length
    k1, k1_new = np.pi / op.length, np.pi / to.length
    squares, wanted = new.q_before, new.p_before
    fill_squares(squares, k1, n)
    fill_squares(wanted, k1_new, to.padded)
    place, speed = weigh_at(w, op, s, n)
    for m in range(to.padded):
        j = equal_mode((m + 1) * k1_new, k1, n)
        if j >= 0:  # it has a node at the new stop: no other mode takes anything of it
            squares[j] = 0.0
            w.q_before[j] = 0.0
            w.p_before[j] = 0.0
    all_sums(w, squares, n, new, wanted, to)
    scale = 2.0 / np.sqrt(op.length * to.length) * k1_new
    line = np.sqrt(2.0 * to.length) / np.pi
    for m in range(to.modes):
        k = mode_number(m)
        set_mode_state(new, m, scale * k * new.q[m] - place * line / k, scale * k * new.p[m] - speed * line / k)
    add_equal_modes(w, op, new, to, n)
    modal.narrow(new, to.padded)
    return place, speed


@jit
def weigh_at(w, op, s, n):
    """Weighs `n` modes by their shape at `s` for `all_sums`; returns displacement and velocity there."""
    velocities(w, n)
    k1 = np.pi / op.length
    for j in range(n):
        phi = sin(mode_number(j) * k1 * s)
        w.q_before[j] *= phi
        w.p_before[j] *= phi
    root = np.sqrt(2 / op.length)
    return root * sum_of(w.q_before, n), root * sum_of(w.p_before, n)


@fast
def sum_of(values, n):
    """Sum of `n` numbers."""
    x = 0.0
    for j in range(n):
        x += values[j]
    return x


@jit
def to_longer(a, op, b, to, at, at_v):
    """Hands the motion of slot `a` over to the longer `b`, of u and, where it moves, of v.

    The stop of u was at[0] m over the line that the longer string rests on, and moved at at[1] m/s; that of v `at_v`.
    """
    lengthen(a.u, op, b.u, to, a.active, at)
    if b.v_ready:
        lengthen(a.v, op, b.v, to, a.v_active, at_v)


@jit
def lengthen(w, op, new, to, n, at):
    """`to_longer` of the `n` modes of one polarisation."""
    s = to.length - op.length
    k1, k1_old = np.pi / to.length, np.pi / op.length
    squares, wanted = new.q_before, new.p_before
    fill_squares(squares, k1_old, n)
    fill_squares(wanted, k1, to.padded)
    for j in range(to.padded):
        if equal_mode((j + 1) * k1, k1_old, n) >= 0:  # it has a node at the old stop: it takes nothing of other modes
            wanted[j] = 0.0
    velocities(w, n)
    for m in range(n):
        k = mode_number(m) * k1_old
        w.q_before[m] *= k
        w.p_before[m] *= k
    all_sums(w, squares, n, new, wanted, to)
    scale = 2.0 / np.sqrt(op.length * to.length)
    corner = np.sqrt(2 / to.length) * to.length / (s * (to.length - s))
    place, speed = at
    for j in range(to.modes):
        k = mode_number(j) * k1
        phi = sin(k * s)
        shape = corner * phi / (k * k) / (1 + to.held_stiffness * (k * k))
        factor = -scale * phi if wanted[j] != 0.0 else 0.0
        set_mode_state(new, j, factor * new.q[j] + place * shape, factor * new.p[j] + speed * shape)
    add_equal_modes(w, op, new, to, n)
    modal.narrow(new, to.padded)
