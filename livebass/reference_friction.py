"""Friction of eq. 7 and the implicit equation for it, for the brute-force solver. Numba only.

At a point that touches (u^n < g), w = v^{n+1} - v^{n-1} solves w + C A sat(w / delta) = w*, delta = 2 dt s, with
sat(x) = x between -1 and 1 and its sign beyond, w* what w would be without friction. C is positive definite and sat
grows, so there is one solution; points known to stick or to slide make a linear system.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from livebass.kernels import counted
from livebass.reference_contact import eliminate

Floats = NDArray[np.float64]
MOST_GUESSES = 40
MOST_SWEEPS = 100_000


@counted
def sat(x: float) -> float:
    return min(max(x, -1.0), 1.0)


@counted
def solve_friction(
    coupling: Floats, wanted: Floats, touching: Floats, most: float, delta: float, force: Floats
) -> bool:
    """Writes the friction (P,) N/m at the points with `touching` > 0, zero elsewhere. False if it fails.

    coupling (P, P) m per N/m, wanted (P,) w*, most: A, N/m; delta: m.
    """
    points = wanted.size
    active = np.empty(points, dtype=np.int64)
    count = 0
    for m in range(points):
        force[m] = 0.0
        if touching[m] > 0:
            active[count] = m
            count += 1
    if count == 0:
        return True
    w = np.empty(count)
    state, matrix = np.zeros(count), np.empty((count, count))  # 0 sticks, -1 and 1 slide
    for a in range(count):
        state[a] = sat(wanted[active[a]] / delta)
        if abs(state[a]) < 1:
            state[a] = 0.0
    for _ in range(MOST_GUESSES):
        for a in range(count):
            w[a] = wanted[active[a]]
            for b in range(count):
                c = coupling[active[a], active[b]] * most
                matrix[a, b] = (1.0 if a == b else 0.0) + (c / delta if state[b] == 0 else 0.0)
                w[a] -= c * state[b]
        eliminate(matrix, w)
        right = True
        for a in range(count):
            now = 0.0 if abs(w[a]) <= delta else np.sign(w[a])
            right = right and now == state[a]
            state[a] = now
        if right:
            for a in range(count):
                force[active[a]] = -most * sat(w[a] / delta)
            return True
    return _in_turn(coupling, wanted, active[:count], most, delta, force)


@counted
def _in_turn(
    coupling: Floats, wanted: Floats, active: NDArray[np.int64], most: float, delta: float, force: Floats
) -> bool:
    """One point after the other: descends to the one solution, slowly."""
    for _ in range(MOST_SWEEPS):
        change = 0.0
        for m in active:
            alone = wanted[m]
            for k in active:
                if k != m:
                    alone += coupling[m, k] * force[k]
            c = coupling[m, m] * most
            new = -most * sat(alone / (delta + c))
            change = max(change, abs(new - force[m]))
            force[m] = new
        if change <= 1e-14 * most:
            return True
    return False
