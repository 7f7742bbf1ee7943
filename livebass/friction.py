"""The friction force of eq. 7: v at a point that touches, one implicit equation a point, weakly coupled points.

w = v^{n+1} - v^{n-1} solves w + sum_k W_mk A sat(w_k / slip) = w*, slip = 2 dt s: a point sticks (|w| < slip) or
slides. Alone it is a formula, ff = -A sat(w* / (slip + W_mm A)); coupled ones take turns. [any thread]
"""

from livebass.kernels import jit
from livebass.layout import MOST_NEAR

MOST_SWEEPS = 1000
ENOUGH = 1e-13  # of A


@jit
def solve_points(near, count, free, old, eta, f, coupling, diagonal, most, slip):
    """Friction f (N/m, kept in place, the first guess too) at the points in `near` with eta > 0, zero at the others.

    free, old, eta: v^{n+1} without friction, v^{n-1}, penetration at n, by point index; coupling: rows of MOST_NEAR.
    Returns how many touch.
    """
    touching = 0
    for i in range(count):
        if eta[near[i]] > 0.0:
            touching += 1
        else:
            f[near[i]] = 0.0
    if touching == 0:
        return 0
    for _ in range(MOST_SWEEPS):
        change = 0.0
        for i in range(count):
            m = near[i]
            if eta[m] <= 0.0:
                continue
            wanted = free[m] - old[m]
            if not diagonal:
                for k in range(count):
                    if k != i:
                        wanted += coupling[i * MOST_NEAR + k] * f[near[k]]
            new = -most * min(max(wanted / (slip + coupling[i * MOST_NEAR + i] * most), -1.0), 1.0)
            change = max(change, abs(new - f[m]))
            f[m] = new
        if diagonal or touching == 1 or change <= ENOUGH * most:
            break
    return touching
