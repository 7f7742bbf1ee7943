"""The contact force of eqs. 6 and 12: one implicit scalar equation a point, weakly coupled points.

At point m, r = eta^{n+1} - eta^{n-1} solves r + sum_k W_mk f_k = r*, where r* is what r would be without
force and f = (psi(eta^{n+1}) - psi(eta^{n-1})) / r. f is convex and grows with r, so Newton from r* comes down
to the root without overshoot; points that W couples are solved together, by Newton in all of them, or in the one or
two that may touch. [any thread]

The friction force of eq. 7: v at a point that touches, one implicit equation a point, weakly coupled points.

w = v^{n+1} - v^{n-1} solves w + sum_k W_mk A sat(w_k / slip) = w*, slip = 2 dt s: a point sticks (|w| < slip) or
slides. Alone it is a formula, ff = -A sat(w* / (slip + W_mm A)); coupled ones take turns. [any thread]

How clear of the string its contact points are, and how long for sure: over frets and boards alike. [any thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels import modal as rows
from livebass.kernels.records import MOST_NEAR, OP_HEIGHT, ROW

MOST_ITERATIONS = 60
MOST_TOGETHER = 12  # iterations of coupled points; they need 3 or 4
MOST_SWEEPS = 400
SMALL = 1e-17  # m
ENOUGH = 1e-6  # of r: Newton converges quadratically, so the error left is near rounding
# The workspace of `solve_together`: a matrix, and four vectors
RESIDUAL = MOST_NEAR * MOST_NEAR
SLOPE, LAW, TRIAL, WORKSPACE = (RESIDUAL + k * MOST_NEAR for k in (1, 2, 3, 4))


@jit
def force(r, old, stiffness, exponent):
    """(f, df/dr): the divided difference of psi between penetrations `old` and old + r."""
    if exponent == 1.5:
        return force_of_three_halves(r, old, stiffness / 2.5)
    a = max(old + r, 0.0)
    b = max(old, 0.0)
    if a == 0.0 and b == 0.0:
        return 0.0, 0.0
    if r == 0.0:
        r = 1e-30
    e = exponent + 1.0
    if a > 0.0 and b > 0.0 and abs(r) < 1e-4 * b:
        mid = b + 0.5 * r
        f = stiffness * mid**exponent
        return f, 0.5 * stiffness * exponent * mid ** (exponent - 1.0)
    f = stiffness / e * (a**e - b**e) / r
    return f, (stiffness * a**exponent - f) / r


@jit
def force_of_three_halves(r, old, k):
    """`force` for alpha = 1.5, k = K / 2.5.

    Where both penetrations are positive f = k (x^5 - y^5) / (x^2 - y^2), x and y their roots: no cancellation.
    """
    a = old + r
    if a > 0.0:
        x = np.sqrt(a)
        if old > 0.0:
            b = old
            y = np.sqrt(b)
            s = x + y
            top = a * a + (a + b) * x * y + a * b + b * b
            part = k / (2.0 * x * s * s)
            return part * top * 2.0 * x * s, part * ((4.0 * a * x + 3.0 * a * y + 2.0 * x * b + y * b) * s - top)
        part = k * a * x / r
        f = part * a
        return f, (2.5 * part * r - f) / r
    if old > 0.0:
        f = -k * old * old * np.sqrt(old) / r
        return f, -f / r
    return 0.0, 0.0


@jit
def solve_point(wanted, old, weight, stiffness, exponent, guess):
    """The force f at a point: r + weight f(r) = wanted. Zero where nothing touches. `guess`: of f."""
    if old <= 0.0 and old + wanted <= 0.0:
        return 0.0
    # from the left of the root the first step leads to its right, from where it comes down; but where nothing
    # would touch there is no slope to follow
    r = wanted - weight * guess
    if old <= 0.0 and old + r <= 0.0:
        r = wanted
    for _ in range(MOST_ITERATIONS):
        f, slope = force(r, old, stiffness, exponent)
        step = (r + weight * f - wanted) / (1.0 + weight * slope)
        r -= step
        if abs(step) <= ENOUGH * abs(r) + SMALL:
            break
    # from the equation itself: smoother than the force law where that is steep
    return (wanted - r) / weight


@jit
def solve_points(near, count, wanted, old, f, coupling, diagonal, stiffness, exponent, work):
    """Forces f (kept in place, also as the first guess) at `count` points, and how many are not zero.

    near: indices of the points; wanted, old: r* and eta^{n-1} by point index; coupling: W of the points in `near`,
    rows of MOST_NEAR; work: WORKSPACE numbers.
    """
    if diagonal or count == 1:
        for i in range(count):
            m = near[i]
            f[m] = solve_point(wanted[m], old[m], coupling[i * MOST_NEAR + i], stiffness, exponent, f[m])
    elif not solve_few(near, count, wanted, old, f, coupling, stiffness, exponent) and not solve_together(
        near, count, wanted, old, f, coupling, stiffness, exponent, work
    ):
        solve_in_turn(near, count, wanted, old, f, coupling, stiffness, exponent)
    touching = 0
    for i in range(count):
        if f[near[i]] != 0.0:
            touching += 1
    return touching


@jit
def solve_few(near, count, wanted, old, f, coupling, stiffness, exponent):
    """Where one or two of the points could touch without force, as is usual. False, and f as it was, otherwise.

    The others feel the forces at those two and stay clear, or it is not for this function.
    """
    first = second = -1
    for i in range(count):
        m = near[i]
        if old[m] > 0.0 or old[m] + wanted[m] > 0.0:
            if first < 0:
                first = i
            elif second < 0:
                second = i
            else:
                return False
    if first < 0:
        return False
    a, o = near[first], first * MOST_NEAR
    if second < 0:
        second = first
        g = 0.0
        h = solve_point(wanted[a], old[a], coupling[o + first], stiffness, exponent, f[a])
    else:
        b, p = near[second], second * MOST_NEAR
        g, h, good = solve_two(
            wanted[a], old[a], f[a], wanted[b], old[b], f[b],
            coupling[o + first], coupling[o + second], coupling[p + first], coupling[p + second], stiffness, exponent,
        )  # fmt: skip
        if not good:
            return False
    for i in range(count):
        m = near[i]
        felt = coupling[i * MOST_NEAR + first] * g + coupling[i * MOST_NEAR + second] * h
        if i != first and i != second and old[m] + wanted[m] - felt > 0.0:
            return False
    for i in range(count):
        f[near[i]] = 0.0
    f[a] = g
    f[near[second]] = h
    return True


@jit
def solve_two(wanted, old, guess, wanted_2, old_2, guess_2, w11, w12, w21, w22, stiffness, exponent):
    """`solve_together` of two points: their forces, and whether it converged."""
    r = wanted - w11 * guess - w12 * guess_2
    if old <= 0.0 and old + r <= 0.0:
        r = wanted
    s = wanted_2 - w21 * guess - w22 * guess_2
    if old_2 <= 0.0 and old_2 + s <= 0.0:
        s = wanted_2
    for _ in range(MOST_TOGETHER):
        f, slope = force(r, old, stiffness, exponent)
        g, slope_2 = force(s, old_2, stiffness, exponent)
        rest = wanted - r - w11 * f - w12 * g
        rest_2 = wanted_2 - s - w21 * f - w22 * g
        a, b, c, d = 1.0 + w11 * slope, w12 * slope_2, w21 * slope, 1.0 + w22 * slope_2
        inverse = 1.0 / (a * d - b * c)
        step = (rest * d - b * rest_2) * inverse
        step_2 = (a * rest_2 - c * rest) * inverse
        r += step
        s += step_2
        if abs(step) <= ENOUGH * abs(r) + SMALL and abs(step_2) <= ENOUGH * abs(s) + SMALL:
            return f + slope * step, g + slope_2 * step_2, True
    return 0.0, 0.0, False


@jit
def solve_together(near, count, wanted, old, f, coupling, stiffness, exponent, work):
    """Newton in all points at once. False, and f as it was, where it does not converge.

    With D the slopes of the law, a step solves (1 + W D) dr = -residual; what comes out is f + D dr of the last one,
    which fulfils the equation to rounding.
    """
    residual, slope, law = work[RESIDUAL:SLOPE], work[SLOPE:LAW], work[LAW:TRIAL]
    r = work[TRIAL:WORKSPACE]
    for i in range(count):
        m = near[i]
        x = wanted[m]
        for k in range(count):
            x -= coupling[i * MOST_NEAR + k] * f[near[k]]
        if old[m] <= 0.0 and old[m] + x <= 0.0:
            x = wanted[m]
        r[i] = x
    for _ in range(MOST_TOGETHER):
        for i in range(count):
            law[i], slope[i] = force(r[i], old[near[i]], stiffness, exponent)
        for i in range(count):
            x = wanted[near[i]] - r[i]
            for k in range(count):
                c = coupling[i * MOST_NEAR + k]
                x -= c * law[k]
                work[i * MOST_NEAR + k] = c * slope[k]
            residual[i] = x
            work[i * MOST_NEAR + i] += 1.0
        eliminate(work, residual, count)
        done = True
        for i in range(count):
            step = residual[i]
            r[i] += step
            law[i] += slope[i] * step
            done = done and abs(step) <= ENOUGH * abs(r[i]) + SMALL
        if done:
            for i in range(count):
                f[near[i]] = law[i]
            return True
    return False


@jit
def eliminate(matrix, x, count):
    """Solves matrix y = x in place, rows of MOST_NEAR; 1 + W D needs no pivoting, as W is positive and D >= 0."""
    for i in range(count):
        inverse = 1.0 / matrix[i * MOST_NEAR + i]
        for k in range(i + 1, count):
            factor = matrix[k * MOST_NEAR + i] * inverse
            if factor != 0.0:
                for c in range(i + 1, count):
                    matrix[k * MOST_NEAR + c] -= factor * matrix[i * MOST_NEAR + c]
                x[k] -= factor * x[i]
    for i in range(count - 1, -1, -1):
        y = x[i]
        for k in range(i + 1, count):
            y -= matrix[i * MOST_NEAR + k] * x[k]
        x[i] = y / matrix[i * MOST_NEAR + i]


@jit
def solve_in_turn(near, count, wanted, old, f, coupling, stiffness, exponent):
    """One point after the other, again and again: slow, but it always gets there."""
    for _ in range(MOST_SWEEPS):
        change = 0.0
        for i in range(count):
            m = near[i]
            rest = wanted[m]
            for k in range(count):
                if k != i:
                    rest -= coupling[i * MOST_NEAR + k] * f[near[k]]
            weight = coupling[i * MOST_NEAR + i]
            new = solve_point(rest, old[m], weight, stiffness, exponent, f[m])
            change = max(change, abs(new - f[m]) * weight)
            f[m] = new
        if change <= 1e-16:
            break


MOST_FRICTION_SWEEPS = 1000
ENOUGH_FRICTION = 1e-13  # of A


@jit
def solve_friction(near, count, free, old, eta, f, coupling, diagonal, most, slip):
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
    for _ in range(MOST_FRICTION_SWEEPS):
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
        if diagonal or touching == 1 or change <= ENOUGH_FRICTION * most:
            break
    return touching


NEVER = float(1 << 60)


@jit
def height(op, pool, m):
    return pool[op.start + OP_HEIGHT * ROW + m]


@jit
def suspicious(op, w, pool, o, m, step, end, way, n):
    """Whether point m, its shape at pool[o], may touch between `step` and `end`; CLEARANCE_NOW tells of the end."""
    clear = rows.displacement(w, pool, o, n) - height(op, pool, m)
    w.clearance_now[m] = clear
    known = w.known_at[m]
    if 0 <= known < step and w.clearance[m] + clear > way * (end - known):
        return False
    if known < step:
        w.clearance[m] = rows.displacement_old(w, pool, o, n) - height(op, pool, m)
        w.known_at[m] = step
    held = w.solved_at[m] == step and (w.eta[m] > 0.0 or w.eta_before[m] > 0.0)
    return held or w.clearance[m] <= 0.0 or w.clearance[m] + clear <= way * (end - step)


@jit
def stayed_clear(w, looked, count, end, way):
    """The points in `looked` did not touch up to `end`."""
    for i in range(count):
        m = looked[i]
        w.clearance[m] = w.clearance_now[m]
        w.known_at[m] = end
        w.due[m] = end + np.floor(w.clearance_now[m] / way)


@jit
def before_contact(w, suspects, count, step):
    """Of a point that was solved for up to `step` the penetration is known."""
    for i in range(count):
        m = suspects[i]
        if w.solved_at[m] == step:
            w.clearance[m] = -w.eta[m]


@jit
def after_contact(w, suspects, count, end, way):
    """The clearances of all suspects are those at `end`."""
    for i in range(count):
        m = suspects[i]
        w.known_at[m] = end
        w.due[m] = end
        if w.clearance[m] > 0.0:
            w.due[m] = end + np.floor(w.clearance[m] / way)
