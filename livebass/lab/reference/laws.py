"""Contact (eq. 6), friction (eq. 7) and hands at P points, and the implicit equations for their forces. Numba only.

Contact. A penetration that goes from a to b = a + r feels the force (psi(b) - psi(a)) / r, psi the potential. This is
0/0 if the penetration hardly changes, so force and slope are written as quotients that do not cancel. For alpha = 1.5,
with a and b now the square roots of the penetrations, the force is a ratio of polynomials: (a^5 - b^5) / (a^2 - b^2).
`solve_forces` solves r = r* - coupling f(r) by Newton's method. Each point has a law of its own: contact, as with frets
or flesh, with any loss of Hunt and Crossley, or a linear spring with a dashpot.

Friction. At a point that touches (u^n < g), w = v^{n+1} - v^{n-1} solves w + C A sat(w / delta) = w*, where w* is w
without friction, delta = 2 dt s, and sat(x) is x between -1 and 1 and its sign beyond. C is positive definite and sat
never falls, so there is one solution. `solve_friction` finds which points stick and which slide; then the system is
linear.

Equation numbers: Issanchou et al. (2018).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebass.compiling.by_numba import counted
from livebass.rows.arrays import Floats, Ints

MAX_NEWTON_STEPS = 60
ACCEPTED_RESIDUAL = 1e-15  # m; Newton goes on below it as long as the residual falls
MIN_PART = 1e-9  # of a Newton step, when halving one that overshoots
NEARLY_EQUAL = 1e-4  # relative change of penetration below which the slope is taken at a middle point
MAX_GUESSES = 40  # at the points that stick
MAX_SWEEPS = 100_000  # over the points, if all guesses fail

ABSENT, CONTACT, LINEAR, FLESH = 0, 1, 2, 3  # kinds of law


class Laws(NamedTuple):
    """The law of each of P points: force f from penetration eta, per m of string.

    CONTACT: psi = K / (alpha + 1) [eta]_+^(alpha + 1), and its force times max(0, 1 + `loss` r), after Hunt and
    Crossley. FLESH: the same psi, and the loss K [middle eta]_+^alpha `loss` r, which cannot make f negative. LINEAR:
    psi = K eta^2 / 2, and the loss `loss` r. ABSENT: no force.
    """

    kind: Ints  # (P,)
    stiffness: Floats  # (P,) K: N/m per m^alpha; LINEAR: N/m per m
    exponent: Floats  # (P,) alpha
    loss: Floats  # (P,) CONTACT, FLESH: c / (2 dt), 1/m; LINEAR: R / (2 dt), N/m per m


@counted
def contacts(points: int, stiffness: float, exponent: float, loss: float) -> Laws:
    """Contact as with frets at each of `points` points."""
    shape = np.ones(points)
    return Laws(np.full(points, CONTACT), stiffness * shape, exponent * shape, loss * shape)


@counted
def absent(points: int) -> Laws:
    """No force at any of `points` points."""
    return Laws(np.full(points, ABSENT), np.zeros(points), np.ones(points), np.zeros(points))


class Forces(NamedTuple):
    """The equation that `solve_forces` solves."""

    coupling: Floats
    free: Floats
    before: Floats
    laws: Laws


@counted
def potential(eta: float, stiffness: float, exponent: float) -> float:
    """psi(eta) = K / (alpha + 1) [eta]_+^(alpha + 1), J per m of string."""
    return stiffness / (exponent + 1) * eta ** (exponent + 1) if eta > 0 else 0.0


@counted
def contact_force(before: float, r: float, stiffness: float, exponent: float) -> tuple[float, float]:
    """Force f (N/m) and df/dr for a penetration going from `before` to before + r (m)."""
    after = before + r
    if before <= 0 and after <= 0:
        return 0.0, 0.0
    if after <= 0:
        force = potential(before, stiffness, exponent) / -r
        return force, force / -r
    if before <= 0:
        force = potential(after, stiffness, exponent) / r
        return force, (stiffness * after**exponent - force) / r
    if exponent == 1.5:
        return _force_of_roots(math.sqrt(after), math.sqrt(before), stiffness)
    return _force_of_powers(before, after, r, stiffness, exponent)


@counted
def _force_of_roots(a: float, b: float, stiffness: float) -> tuple[float, float]:
    """f (N/m) and df/dr for alpha = 1.5; a^2 = eta^{n+1} > 0, b^2 = eta^{n-1} > 0."""
    force = stiffness / 2.5 * (a**4 + a**3 * b + a**2 * b**2 + a * b**3 + b**4) / (a + b)
    slope = stiffness / 5 * (3 * a**3 + 6 * a**2 * b + 4 * a * b**2 + 2 * b**3) / (a + b) ** 2
    return force, slope


@counted
def _force_of_powers(before: float, after: float, r: float, stiffness: float, exponent: float) -> tuple[float, float]:
    """f (N/m) and df/dr for any alpha, both penetrations > 0: f = K/(alpha+1) h^alpha (1 - (1-s)^(alpha+1)) / s.

    h is the greater penetration and s = |r| / h.
    """
    high = max(before, after)
    s = abs(r) / high
    quotient = -math.expm1((exponent + 1) * math.log1p(-s)) / s if s > 0 else exponent + 1
    force = stiffness / (exponent + 1) * high**exponent * quotient
    if s > NEARLY_EQUAL:
        return force, (stiffness * after**exponent - force) / r
    # f' = K alpha int_0^1 t (before + t r)^(alpha-1) dt; the weight t has its centre at t = 2/3
    return force, stiffness * exponent / 2 * (before + r * 2 / 3) ** (exponent - 1)


@counted
def law_energy(kind: int, eta: float, stiffness: float, exponent: float) -> float:
    """psi(eta) of a law of `Laws`, J per m of string."""
    if kind == LINEAR:
        return stiffness * eta * eta / 2
    return potential(eta, stiffness, exponent) if kind != ABSENT else 0.0


@counted
def law_force(
    kind: int, before: float, r: float, stiffness: float, exponent: float, loss: float
) -> tuple[float, float]:
    """Force f (N/m) and df/dr of a law of `Laws`, for a penetration going from `before` to before + r (m)."""
    if kind == LINEAR:
        return stiffness * (before + r / 2) + loss * r, stiffness / 2 + loss
    if kind == ABSENT:
        return 0.0, 0.0
    force, slope = contact_force(before, r, stiffness, exponent)
    if kind == CONTACT:
        part = max(1 + loss * r, 0.0)
        return force * part, slope * part + (force * loss if part > 0 else 0.0)
    middle = before + r / 2
    if loss > 0 and middle > 0:
        resistance = loss * stiffness * middle**exponent
        force += resistance * r
        slope += resistance * (1 + exponent * r / (2 * middle))
        if force <= 0:
            return 0.0, 0.0
    return force, slope


@counted
def lost_energy(
    kind: int, force: float, before: float, after: float, stiffness: float, exponent: float, loss: float
) -> float:
    """Energy that a law's loss takes in two steps, J per m of string: f r less the gain of its potential."""
    r = after - before
    if loss == 0 or kind == ABSENT:
        return 0.0
    if kind == LINEAR:
        return loss * r * r
    return force * r - (potential(after, stiffness, exponent) - potential(before, stiffness, exponent))


@counted
def solve_forces(coupling: Floats, free: Floats, before: Floats, laws: Laws, force: Floats, after: Floats) -> bool:
    """Solves r = r* - coupling f(r), r* = free - before, for the forces f at the points. Returns False if it fails.

    coupling: (P, P) m per N/m; free: eta^{n+1} without force, (P,) m; before: eta^{n-1}, (P,) m. Writes `force`, (P,)
    N/m, and `after`, eta^{n+1}, (P,) m; `force` must be zero before. Contacts that did not touch and would not touch
    without force join the Newton system only if the other points push them in.
    """
    points = free.size
    active = np.empty(points, dtype=np.int64)
    chosen = np.zeros(points, dtype=np.bool_)
    count = 0
    for m in range(points):
        if laws.kind[m] == LINEAR or (laws.kind[m] != ABSENT and (free[m] > 0 or before[m] > 0)):
            active[count] = m
            chosen[m] = True
            count += 1
    while True:
        if not _newton(Forces(coupling, free, before, laws), active[:count], force, after):
            return False
        known = count
        for m in range(points):
            if not chosen[m]:
                after[m] = free[m]
                for k in active[:known]:
                    after[m] -= coupling[m, k] * force[k]
                if after[m] > 0 and laws.kind[m] != ABSENT:
                    active[count] = m
                    chosen[m] = True
                    count += 1
        if count == known:
            return True


@counted
def _newton(of: Forces, active: Ints, force: Floats, after: Floats) -> bool:
    """Newton's method for the points `active`, from r* until the residual stops falling. Halves steps that overshoot.

    Writes `force` and `after` at these points. Returns False if the remaining residual is too large.
    """
    coupling, free, before, _ = of
    count = active.size
    r, trial, slope = np.empty(count), np.empty(count), np.empty(count)
    residual, change, matrix = np.empty(count), np.empty(count), np.empty((count, count))
    for a in range(count):
        r[a] = free[active[a]] - before[active[a]]
    error = _residual(of, active, r, force, slope, residual)
    for _ in range(MAX_NEWTON_STEPS):
        for a in range(count):
            change[a] = -residual[a]
            for b in range(count):
                matrix[a, b] = coupling[active[a], active[b]] * slope[b] + (1.0 if a == b else 0.0)
        eliminate(matrix, change)
        part = 1.0
        while True:
            for a in range(count):
                trial[a] = r[a] + part * change[a]
            tried = _residual(of, active, trial, force, slope, residual)
            if tried < error or error <= ACCEPTED_RESIDUAL or part < MIN_PART:
                break
            part /= 2
        if tried >= error:  # down to rounding, or stuck
            break
        error = tried
        r[:] = trial
    error = _residual(of, active, r, force, slope, residual)
    for a in range(count):
        after[active[a]] = before[active[a]] + r[a]
    return error <= ACCEPTED_RESIDUAL


@counted
def _residual(of: Forces, active: Ints, r: Floats, force: Floats, slope: Floats, residual: Floats) -> float:
    """Writes f(r), df/dr and r - r* + coupling f of the points `active`; returns the largest residual, m."""
    coupling, free, before, laws = of
    for a in range(active.size):
        m = active[a]
        force[m], slope[a] = law_force(laws.kind[m], before[m], r[a], laws.stiffness[m], laws.exponent[m], laws.loss[m])
    largest = 0.0
    for a in range(active.size):
        m = active[a]
        residual[a] = r[a] - (free[m] - before[m])
        for k in active:
            residual[a] += coupling[m, k] * force[k]
        largest = max(largest, abs(residual[a]))
    return largest


@counted
def eliminate(matrix: Floats, x: Floats) -> None:
    """Solves matrix y = x by Gaussian elimination with row pivoting; y replaces x, `matrix` is overwritten."""
    n = x.size
    for c in range(n):
        p = c
        for i in range(c + 1, n):
            if abs(matrix[i, c]) > abs(matrix[p, c]):
                p = i
        if p != c:
            for k in range(n):
                matrix[c, k], matrix[p, k] = matrix[p, k], matrix[c, k]
            x[c], x[p] = x[p], x[c]
        for i in range(c + 1, n):
            factor = matrix[i, c] / matrix[c, c]
            for k in range(c, n):
                matrix[i, k] -= factor * matrix[c, k]
            x[i] -= factor * x[c]
    for c in range(n - 1, -1, -1):
        for k in range(c + 1, n):
            x[c] -= matrix[c, k] * x[k]
        x[c] /= matrix[c, c]


@counted
def sat(x: float) -> float:
    """x, limited to -1 to 1: the law of eq. 7."""
    return min(max(x, -1.0), 1.0)


@counted
def solve_friction(
    coupling: Floats, wanted: Floats, touching: Floats, maximum: float, delta: float, force: Floats
) -> bool:
    """Solves w + C A sat(w / delta) = w* for the friction at the points that touch. Returns False if it fails.

    coupling: C, (P, P) m per N/m; wanted: w*, (P,) m; touching: penetration, (P,) m; most: A, N/m; delta: m. Writes
    `force`, (P,) N/m: -A sat(w / delta) at points with `touching` > 0, zero elsewhere.
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
    for _ in range(MAX_GUESSES):
        for a in range(count):
            w[a] = wanted[active[a]]
            for b in range(count):
                c = coupling[active[a], active[b]] * maximum
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
                force[active[a]] = -maximum * sat(w[a] / delta)
            return True
    return _in_turn(coupling, wanted, active[:count], maximum, delta, force)


@counted
def _in_turn(
    coupling: Floats, wanted: Floats, active: NDArray[np.int64], maximum: float, delta: float, force: Floats
) -> bool:
    """Solves point by point, over and over, until `force` settles: slow, but sure to descend."""
    for _ in range(MAX_SWEEPS):
        change = 0.0
        for m in active:
            alone = wanted[m]
            for k in active:
                if k != m:
                    alone += coupling[m, k] * force[k]
            c = coupling[m, m] * maximum
            new = -maximum * sat(alone / (delta + c))
            change = max(change, abs(new - force[m]))
            force[m] = new
        if change <= 1e-14 * maximum:
            return True
    return False
