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


@fast
def weighted_sums(values, others, top, first, last, square):
    """Sums of values[j] and others[j] over (square - k_j^2) for `first` <= j < `last`; k_j = top (j + 1)."""
    x = 0.0
    y = 0.0
    for j in range(first, last):
        k = top * (j + 1)
        part = 1.0 / (square - k * k)
        x += values[j] * part
        y += others[j] * part
    return x, y


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
def to_shorter(w, op, new, to, n):
    """Hands `n` modes of `w` over to the shorter `new`; returns displacement and velocity at its stop, by the modes."""
    s = op.length - to.length
    k1, k1_new = np.pi / op.length, np.pi / to.length
    velocities(w, n)
    u = 0.0
    v = 0.0
    for j in range(n):
        phi = sin((j + 1) * k1 * s)
        w.q_before[j] *= phi
        w.p_before[j] *= phi
        u += w.q_before[j]
        v += w.p_before[j]
    u *= np.sqrt(2 / op.length)
    v *= np.sqrt(2 / op.length)
    scale = 2.0 / np.sqrt(op.length * to.length)
    for m in range(to.modes):
        k = (m + 1) * k1_new
        same = equal_mode(k, k1, n)
        if same < 0:
            x, y = weighted_sums(w.q_before, w.p_before, k1, np.int64(0), n, k * k)
        else:
            x, y = weighted_sums(w.q_before, w.p_before, k1, np.int64(0), same, k * k)
            x_2, y_2 = weighted_sums(w.q_before, w.p_before, k1, same + 1, n, k * k)
            x, y = x + x_2, y + y_2
        x *= scale * k
        y *= scale * k
        if same >= 0:
            part = np.sqrt(to.length / op.length) * cos(k * s)
            q = w.q[same]
            x += part * q
            y += part * (w.pace[same] * w.p[same] - w.sigma[same] * q)
        line = np.sqrt(2 * to.length) / (np.pi * (m + 1))
        put(new, m, x - u * line, y - v * line)
    return u, v


@jit
def to_longer(w, op, new, to, n, height, speed):
    """Hands `n` modes of `w` over to the longer `new`.

    The stop was `height` m over the line that the longer string rests on, and moved at `speed`.
    """
    s = to.length - op.length
    k1, k1_old = np.pi / to.length, np.pi / op.length
    velocities(w, n)
    for m in range(n):
        k = (m + 1) * k1_old
        w.q_before[m] *= k
        w.p_before[m] *= k
    scale = 2.0 / np.sqrt(op.length * to.length)
    corner = np.sqrt(2 / to.length) * to.length / (s * (to.length - s))
    for j in range(to.modes):
        k = (j + 1) * k1
        phi = sin(k * s)
        same = equal_mode(k, k1_old, n)
        if same < 0:
            x, y = weighted_sums(w.q_before, w.p_before, k1_old, np.int64(0), n, k * k)
        else:
            x, y = weighted_sums(w.q_before, w.p_before, k1_old, np.int64(0), same, k * k)
            x_2, y_2 = weighted_sums(w.q_before, w.p_before, k1_old, same + 1, n, k * k)
            x, y = x + x_2, y + y_2
        x *= -scale * phi
        y *= -scale * phi
        if same >= 0:
            part = np.sqrt(op.length / to.length) * cos(k * s)
            q = w.q[same]
            x += part * q
            y += part * (w.pace[same] * w.p[same] - w.sigma[same] * q)
        shape = corner * phi / (k * k) / (1 + to.held_stiffness * (k * k))
        put(new, j, x + height * shape, y + speed * shape)
