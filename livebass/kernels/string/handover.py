"""Hands a motion over to the modes of another length, at every fret change of a sounding string.

The longer part of the string has the length L and modes j, the shorter part L' = L - s and modes m; the shorter part's
stop lies s from the longer part's. The projection of one part's modes on the other's has a formula:

    M_mj = 2 / sqrt(L L') k'_m sin(k_j s) / (k'_m^2 - k_j^2),   where k'_m = k_j: sqrt(L'/L) cos(k_j s).

To the shorter: the displacement at s, less the height of the crown there, is the place of the string's end when the
finger meets it; from there the stop moves to rest (stop.py). The modes get q'_m = sum_j M_mj q_j - u(s) l_m, with u(s)
the displacement by the modes alone and l_m = sqrt(2 L') / (pi m), and the same for velocities. Motion beyond s stays
with the fingers. The same formula with s < 0 continues the motion as an odd function beyond the old end: this serves a
gliding finger that lengthens the string (glide.py).

To the longer: q_j = sum_m M_mj q'_m + T_j, where T is the shape that the finger held, a triangle with its corner at s:
beyond s the string was straight and at rest.

Summing over the old modes for each new mode takes nearly all the time. So u and v go together, and one division serves
two quotients: with r = 1 / (a b), 1 / a = r b. Where modes are float32 the sums are, too: twice as many fit into a
vector. Their differences of squares are between numbers in two parts, so that none loses digits. The highest modes are
skipped if together they are NEGLIGIBLE. `a` is the sounding slot, `b` the other, loaded and silent; `op` and `to` are
their operators. [audio thread]
"""

import numpy as np

from livebass.compiling import compiled, jit
from livebass.kernels.machine.elementary import cos, sin
from livebass.kernels.string import modal
from livebass.kernels.string.modal import LANES, mode_number
from livebass.kernels.string.operators import heights, positions
from livebass.kernels.string.records import BLOCK

SAME = 1e-9  # relative, of wave numbers that count as equal
CLOSE = 1e-6  # m: stops this close are the same
NEGLIGIBLE = 1e-12  # part of all weighted displacements, and velocities, that the skipped highest modes may have

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
def needed_modes(w, n):
    """Number of the `n` weighted modes that count, in whole BLOCKs: all above are NEGLIGIBLE."""
    q = NEGLIGIBLE * NEGLIGIBLE * sum_of_squares(w.q_before, 0, n)
    p = NEGLIGIBLE * NEGLIGIBLE * sum_of_squares(w.p_before, 0, n)
    while n > 0:
        q -= sum_of_squares(w.q_before, n - BLOCK, n)
        p -= sum_of_squares(w.p_before, n - BLOCK, n)
        if not (q >= 0.0 and p >= 0.0):
            break
        n -= BLOCK
    return n


def sums(width, parts, apart):
    """Makes the kernel that sums in `width`.

    parts(x) gives a wanted number the form of the squares; apart(x, squares, j) is its distance from square j.
    """

    def two(u, v, squares, n, new, new_v, wanted, m):
        """Sets new.q[m] to the sum of `n` weighted displacements over (wanted[m] - squares[j]); velocities: new.p[m].

        Does the same for the next mode, and for `v` and `new_v`. No difference may be zero.
        """
        a, b = parts(wanted[m]), parts(wanted[m + 1])
        q_a = q_b = p_a = p_b = width(0.0)
        y_a = y_b = z_a = z_b = width(0.0)
        for j in range(n):
            to_a, to_b = apart(a, squares, j), apart(b, squares, j)
            inverse = width(1.0) / (to_a * to_b)
            over_a, over_b = inverse * to_b, inverse * to_a
            q, p, y, z = u.q_before[j], u.p_before[j], v.q_before[j], v.p_before[j]
            q_a += q * over_a
            q_b += q * over_b
            p_a += p * over_a
            p_b += p * over_b
            y_a += y * over_a
            y_b += y * over_b
            z_a += z * over_a
            z_b += z * over_b
        new.q[m], new.q[m + 1], new.p[m], new.p[m + 1] = q_a, q_b, p_a, p_b
        new_v.q[m], new_v.q[m + 1], new_v.p[m], new_v.p[m + 1] = y_a, y_b, z_a, z_b

    two.__qualname__ = f"sums.{parts.__name__}"
    return fast(two)


@fast
def one_part(x):
    return x


@fast
def apart_in_one(x, squares, j):
    return x - squares[j]


@jit
def two_parts(x):
    """A number as the sum of two in float32."""
    rough = np.float32(x)
    return rough, np.float32(x - rough)


@jit
def apart_in_two(x, squares, j):
    return (x[0] - squares[0][j]) + (x[1] - squares[1][j])


two_sums = sums(np.float64, one_part, apart_in_one)
two_single_sums = sums(np.float32, two_parts, apart_in_two)


@jit
def all_sums(u, v, squares, n, new, new_v, wanted, to):
    """`two_sums` for all modes of `to`, in float32 if some of them are."""
    n = max(needed_modes(u, n), needed_modes(v, n))
    if to.split == to.padded:
        for m in range(0, to.modes, 2):
            two_sums(u, v, squares, n, new, new_v, wanted, m)
    else:
        rough, rest = new.high.q_before, new.high.p_before
        for j in range(n):
            rough[j], rest[j] = two_parts(squares[j])
        to_single(u, n)
        to_single(v, n)
        for m in range(0, to.modes, 2):
            two_single_sums(u.high, v.high, (rough, rest), n, new, new_v, wanted, m)
    new.q[to.modes : to.padded] = 0.0
    new.p[to.modes : to.padded] = 0.0
    new_v.q[to.modes : to.padded] = 0.0
    new_v.p[to.modes : to.padded] = 0.0


@jit
def to_single(w, n):
    """Copies `n` weighted modes to w.high.q_before and w.high.p_before."""
    modal.copy_row(w.high.q_before, w.q_before, n)
    modal.copy_row(w.high.p_before, w.p_before, n)


@jit
def equal_mode(m, op, to, n):
    """Index of the mode, among `n` of `op`, with the wave number of mode `m` of `to`; -1: none."""
    number = mode_number(m) * (op.length / to.length)
    whole = np.rint(number)
    return np.int64(whole) - 1 if abs(number - whole) <= SAME * number and 1.0 <= whole <= n else -1


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
    k1_new = np.pi / to.length
    root = np.sqrt(min(op.length, to.length) / max(op.length, to.length))
    for m in range(to.modes):
        j = equal_mode(m, op, to, n)
        if j >= 0:
            part = root * cos(mode_number(m) * k1_new * s)
            q, v = part * w.q[j], part * (w.p[j] / w.kappa[j] - w.sigma[j] * w.q[j])
            new.q[m] += q
            new.p[m] += new.kappa[m] * (v + new.sigma[m] * q)


@jit
def to_shorter(a, op, b, to):
    """Hands the motion of slot `a` over to the shorter `b`, for u and, if it moves, v.

    Returns the modes' displacement and velocity at b's stop, for u, then v.
    """
    n, across = max(a.active, a.v_active), a.v_active > 0
    old_v, new_v = (a.v, b.v) if across else (a.u, b.u)
    s = op.length - to.length
    k1, k1_new = np.pi / op.length, np.pi / to.length
    squares, wanted = b.u.q_before, b.u.p_before
    fill_squares(squares, k1, n)
    fill_squares(wanted, k1_new, to.padded)
    x, v = weigh_at(a.u, op, s, n)
    x_v = v_v = 0.0
    if across:
        x_v, v_v = weigh_at(a.v, op, s, n)
    for m in range(to.padded):
        j = equal_mode(m, op, to, n)
        if j >= 0:  # a mode with a node at the new stop: it projects on no other mode
            squares[j] = 0.0
            a.u.q_before[j] = 0.0
            a.u.p_before[j] = 0.0
            old_v.q_before[j] = 0.0
            old_v.p_before[j] = 0.0
    all_sums(a.u, old_v, squares, n, b.u, new_v, wanted, to)
    end_on_line(a.u, op, b.u, to, n, x, v)
    if across:
        end_on_line(a.v, op, b.v, to, n, x_v, v_v)
    return x, v, x_v, v_v


@jit
def end_on_line(w, op, new, to, n, place, speed):
    """Turns one polarisation's sums into the motion over the line to its stop, at `place` with `speed`."""
    scale = 2.0 / np.sqrt(op.length * to.length) * (np.pi / to.length)
    line = np.sqrt(2.0 * to.length) / np.pi
    for m in range(to.modes):
        k = mode_number(m)
        set_mode_state(new, m, scale * k * new.q[m] - place * line / k, scale * k * new.p[m] - speed * line / k)
    add_equal_modes(w, op, new, to, n)
    modal.narrow(new, to.padded)


@jit
def weigh_at(w, op, s, n):
    """Weights `n` modes by their shape at `s` for `all_sums`; returns displacement and velocity there."""
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
    """Hands the motion of slot `a` over to the longer `b`, for u and, if `b` has it, v.

    u's stop was at[0] m over the line that the longer string rests on, and moved at at[1] m/s; v's stop: `at_v`.
    """
    n, across = max(a.active, a.v_active), b.v_ready > 0 and a.v_active > 0
    old_v, new_v = (a.v, b.v) if across else (a.u, b.u)
    k1, k1_old = np.pi / to.length, np.pi / op.length
    squares, wanted = b.u.q_before, b.u.p_before
    fill_squares(squares, k1_old, n)
    fill_squares(wanted, k1, to.padded)
    for j in range(to.padded):
        if equal_mode(j, op, to, n) >= 0:  # a mode with a node at the old stop: no other mode projects on it
            wanted[j] = 0.0
    weigh_slopes(a.u, k1_old, n)
    if across:
        weigh_slopes(a.v, k1_old, n)
    all_sums(a.u, old_v, squares, n, b.u, new_v, wanted, to)
    for j in range(to.modes):
        if wanted[j] == 0.0:
            set_mode_state(b.u, j, 0.0, 0.0)
            set_mode_state(new_v, j, 0.0, 0.0)
    corner = a.u.q_before, a.u.p_before
    fill_corner(corner[0], corner[1], op, to)
    add_corner(a.u, op, b.u, to, n, corner, at)
    if across:
        add_corner(a.v, op, b.v, to, n, corner, at_v)
    elif b.v_ready:
        clear_sums(b.v, to)
        add_corner(a.v, op, b.v, to, np.int64(0), corner, at_v)


@jit
def weigh_slopes(w, k1, n):
    """Weights `n` modes by their wave numbers, starting with `k1`, for `all_sums`."""
    velocities(w, n)
    for m in range(n):
        k = mode_number(m) * k1
        w.q_before[m] *= k
        w.p_before[m] *= k


@jit
def clear_sums(new, to):
    """Sets the sums of all modes of `to` to a string at rest."""
    new.q[: to.padded] = 0.0
    new.p[: to.padded] = 0.0


@jit
def fill_corner(phi, shape, op, to):
    """Fills the modes' shapes `phi` at the old stop, times M's factor, and the `shape` of a corner of 1 m there."""
    s = to.length - op.length
    k1 = np.pi / to.length
    scale = 2.0 / np.sqrt(op.length * to.length)
    corner = np.sqrt(2 / to.length) * to.length / (s * (to.length - s))
    for j in range(to.modes):
        k = mode_number(j) * k1
        at_stop = sin(k * s)
        phi[j] = -scale * at_stop
        shape[j] = corner * at_stop / (k * k * (1 + to.held_stiffness * (k * k)))


@jit
def add_corner(w, op, new, to, n, corner, at):
    """Turns one polarisation's sums into the longer string's motion, and adds the `corner` (phi, shape) at the old
    stop.
    """
    phi, shape = corner
    place, speed = at
    for j in range(to.modes):
        set_mode_state(new, j, phi[j] * new.q[j] + place * shape[j], phi[j] * new.p[j] + speed * shape[j])
    add_equal_modes(w, op, new, to, n)
    modal.narrow(new, to.padded)
