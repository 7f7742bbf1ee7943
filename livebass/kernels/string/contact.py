"""Forces at the contact points of a fine step: contact by eqs. 6 and 12, friction by eq. 7.

Contact. At point m, r = eta^{n+1} - eta^{n-1} solves r + sum_k W_mk f_k = r*, where r* is r without force and
f = f_c max(0, 1 + c r / (2 dt)), with f_c = (psi(eta^{n+1}) - psi(eta^{n-1})) / r, which conserves energy, and c, s/m,
the loss of Hunt and Crossley (1975). The loss takes f_c c r^2 / (2 dt) per fine step; where it holds the obstacle back,
f = 0, it takes all that psi gives up. f is convex and grows with r, so Newton's method from r* converges to the root
without overshoot. Points that W couples are solved together: usually only one or two may touch and are solved alone,
else Newton's method solves all, or one point after another until nothing changes.

Friction. At a touching point, x = v^{n+1} - v^{n-1} solves x + sum_k W_mk A sat(x_k / slip) = x*, slip = 2 dt s: the
point sticks (|x| < slip) or slides. A single point has a formula, f = -A sat(x* / (slip + W_mm A)). Of coupled points,
those that stick solve (slip + A W) g = -x*, f = A g, by elimination, the others have g = -1 or 1: both sets begin as
they were and change until they fit. Exact operators, and sets that do not settle, let the points take turns.

w is the working set of u, op the operator; `near` lists `count` contact points, and w.coupling is W between points.
[any thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import power
from livebass.kernels.string.operators import is_exact

MAX_ITERATIONS = 60
MAX_TOGETHER = 12  # iterations of coupled points; they need 3 or 4
MAX_SWEEPS = 400
SMALL = 1e-17  # m
ENOUGH = 1e-6  # of r: Newton converges quadratically, so the remaining error is near rounding ...
ENOUGH_SINGLE = 1e-4  # ... also where most modes have 32 bits
SETTLED = 1e-16  # m, change of a displacement at which points solved in turn count as solved
MAX_FRICTION_SETS = 8
MAX_FRICTION_SWEEPS = 1000
FRICTION_ENOUGH = 1e-13  # of A


@jit
def tolerance(op):
    """The change of r, of r itself, at which Newton's method ends."""
    return ENOUGH if is_exact(op) else ENOUGH_SINGLE


@jit
def force(r, old, op):
    """Contact force f and df/dr as the penetration goes from `old` to `old` + r (m)."""
    f, slope = lossless_force(r, old, op.stiffness, op.exponent)
    if op.loss != 0.0:
        part = 1.0 + op.loss * r
        if part <= 0.0:
            return 0.0, 0.0
        return f * part, slope * part + f * op.loss
    return f, slope


@jit
def lossless_force(r, old, stiffness, exponent):
    """f_c and df_c/dr: the divided difference of psi between penetrations `old` and `old` + r."""
    if exponent == 1.5:
        return force_of_three_halves(r, old, stiffness / 2.5)
    a = max(old + r, 0.0)
    b = max(old, 0.0)
    if a == 0.0 and b == 0.0:
        return 0.0, 0.0
    if r == 0.0:
        r = 1e-30
    if a > 0.0 and b > 0.0 and abs(r) < 1e-4 * b:
        mid = b + 0.5 * r
        f = stiffness * power(mid, exponent)
        return f, 0.5 * exponent * f / mid
    after = power(a, exponent) if a > 0.0 else 0.0
    before = power(b, exponent) if b > 0.0 else 0.0
    f = stiffness / (exponent + 1.0) * (a * after - b * before) / r
    return f, (stiffness * after - f) / r


@jit
def force_of_three_halves(r, old, k):
    """`lossless_force` for alpha = 1.5, k = K / 2.5.

    If both penetrations are positive, f = k (x^5 - y^5) / (x^2 - y^2), x and y their roots: no cancellation.
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
def solve_point(wanted, old, weight, op, guess):
    """Force f at one point: r + weight f(r) = wanted. Zero if nothing touches. `guess`: of f."""
    if old <= 0.0 and old + wanted <= 0.0:
        return 0.0
    # from the left of the root the first step leads to its right, and from there down to it; but without contact
    # there is no slope to follow
    r = wanted - weight * guess
    if old <= 0.0 and old + r <= 0.0:
        r = wanted
    enough = tolerance(op)
    for _ in range(MAX_ITERATIONS):
        f, slope = force(r, old, op)
        step = (r + weight * f - wanted) / (1.0 + weight * slope)
        r -= step
        if abs(step) <= enough * abs(r) + SMALL:
            break
    # from the equation itself: smoother than a steep force law
    return (wanted - r) / weight


@jit
def solve_points(w, op, near, count):
    """Solves contact (eq. 12) at the points in `near` and returns the number of nonzero forces.

    Takes w.wanted (r*), w.eta_before and w.coupling; w.force holds first guesses and receives the forces.
    """
    if op.diagonal or count == 1:
        for i in range(count):
            m = near[i]
            w.force[m] = solve_point(w.wanted[m], w.eta_before[m], w.coupling[m, m], op, w.force[m])
    elif not solve_few(w, op, near, count) and not solve_together(w, op, near, count):
        solve_in_turn(w, op, near, count)
    touching = 0
    for i in range(count):
        if w.force[near[i]] != 0.0:
            touching += 1
    return touching


@jit
def solve_few(w, op, near, count):
    """Solves the usual case: only one or two points could touch without force. Otherwise False, forces kept.

    Also False if the forces at those two bring another point into contact.
    """
    first = second = -1
    for i in range(count):
        m = near[i]
        if w.eta_before[m] > 0.0 or w.eta_before[m] + w.wanted[m] > 0.0:
            if first < 0:
                first = m
            elif second < 0:
                second = m
            else:
                return False
    if first < 0:
        return False
    if second < 0:
        second = first
        g = 0.0
        h = solve_point(w.wanted[first], w.eta_before[first], w.coupling[first, first], op, w.force[first])
    else:
        g, h, good = solve_two(w, op, first, second)
        if not good:
            return False
    for i in range(count):
        m = near[i]
        felt = w.coupling[m, first] * g + w.coupling[m, second] * h
        if m != first and m != second and w.eta_before[m] + w.wanted[m] - felt > 0.0:
            return False
    for i in range(count):
        w.force[near[i]] = 0.0
    w.force[first] = g
    w.force[second] = h
    return True


@jit
def solve_two(w, op, a, b):
    """`solve_together` for the points `a` and `b`: their forces, and whether it converged."""
    wanted, old, guess = w.wanted[a], w.eta_before[a], w.force[a]
    wanted_2, old_2, guess_2 = w.wanted[b], w.eta_before[b], w.force[b]
    w11, w12, w21, w22 = w.coupling[a, a], w.coupling[a, b], w.coupling[b, a], w.coupling[b, b]
    r = wanted - w11 * guess - w12 * guess_2
    if old <= 0.0 and old + r <= 0.0:
        r = wanted
    s = wanted_2 - w21 * guess - w22 * guess_2
    if old_2 <= 0.0 and old_2 + s <= 0.0:
        s = wanted_2
    enough = tolerance(op)
    for _ in range(MAX_TOGETHER):
        f, slope = force(r, old, op)
        g, slope_2 = force(s, old_2, op)
        rest = wanted - r - w11 * f - w12 * g
        rest_2 = wanted_2 - s - w21 * f - w22 * g
        # the inverse of 1 + W D, a 2 by 2 matrix
        p, q, t, u = 1.0 + w11 * slope, w12 * slope_2, w21 * slope, 1.0 + w22 * slope_2
        inverse = 1.0 / (p * u - q * t)
        step = (rest * u - q * rest_2) * inverse
        step_2 = (p * rest_2 - t * rest) * inverse
        r += step
        s += step_2
        if abs(step) <= enough * abs(r) + SMALL and abs(step_2) <= enough * abs(s) + SMALL:
            return f + slope * step, g + slope_2 * step_2, True
    return 0.0, 0.0, False


@jit
def solve_together(w, op, near, count):
    """Newton's method for the points that could touch without force. False if it does not converge.

    If these forces would make other points touch, it solves all points.
    """
    place, law, n = w.solver.place, w.solver.law, 0
    for i in range(count):
        m = near[i]
        if w.eta_before[m] > 0.0 or w.eta_before[m] + w.wanted[m] > 0.0:
            place[n] = i
            n += 1
    solved = newton(w, op, near, n)
    if solved and n < count:
        k = 0
        for i in range(count):
            if k < n and place[k] == i:
                k += 1
                continue
            m = near[i]
            felt = 0.0
            for c in range(n):
                felt += w.coupling[m, near[place[c]]] * law[c]
            solved = solved and not w.eta_before[m] + w.wanted[m] - felt > 0.0
        if solved:
            for i in range(count):
                w.force[near[i]] = 0.0
    if not solved:
        if n == count:
            return False
        for i in range(count):
            place[i] = i
        n = count
        if not newton(w, op, near, n):
            return False
    for i in range(n):
        w.force[near[place[i]]] = law[i]
    return True


@jit
def newton(w, op, near, count):
    """Solves for the forces at `count` points alone, `near` at w.solver.place; w.solver.law receives the forces.

    With D the slopes of the law, a step solves (1 + W D) dr = -residual; the forces are f + D dr of the last step,
    which satisfies the equation to rounding. w.force has first guesses. False if it does not converge.
    """
    residual, slope, law, r = w.solver.residual, w.solver.slope, w.solver.law, w.solver.r
    matrix, place = w.solver.matrix, w.solver.place
    coupling, wanted, old = w.solver.coupling, w.solver.wanted, w.solver.old
    for i in range(count):
        m = near[place[i]]
        wanted[i] = w.wanted[m]
        old[i] = w.eta_before[m]
        law[i] = w.force[m]
        for k in range(i + 1):
            coupling[i, k] = w.coupling[m, near[place[k]]]
            coupling[k, i] = coupling[i, k]
    for i in range(count):
        x = wanted[i]
        for k in range(count):
            x -= coupling[i, k] * law[k]
        if old[i] <= 0.0 and old[i] + x <= 0.0:
            x = wanted[i]
        r[i] = x
    enough = tolerance(op)
    for _ in range(MAX_TOGETHER):
        for i in range(count):
            law[i], slope[i] = force(r[i], old[i], op)
        for i in range(count):
            x = wanted[i] - r[i]
            for k in range(count):
                c = coupling[i, k]
                x -= c * law[k]
                matrix[i, k] = c * slope[k]
            residual[i] = x
            matrix[i, i] += 1.0
        eliminate(matrix, residual, count)
        done = True
        for i in range(count):
            step = residual[i]
            r[i] += step
            law[i] += slope[i] * step
            done = done and abs(step) <= enough * abs(r[i]) + SMALL
        if done:
            return True
    return False


@jit
def eliminate(matrix, x, count):
    """Solves matrix y = x in place; 1 + W D and slip + A W need no pivoting, as W is positive and D >= 0."""
    for i in range(count):
        inverse = 1.0 / matrix[i, i]
        for k in range(i + 1, count):
            factor = matrix[k, i] * inverse
            if factor != 0.0:
                for c in range(i + 1, count):
                    matrix[k, c] -= factor * matrix[i, c]
                x[k] -= factor * x[i]
    for i in range(count - 1, -1, -1):
        y = x[i]
        for k in range(i + 1, count):
            y -= matrix[i, k] * x[k]
        x[i] = y / matrix[i, i]


@jit
def solve_in_turn(w, op, near, count):
    """Solves one point after another until nothing changes: slow, but it always converges."""
    for _ in range(MAX_SWEEPS):
        change = 0.0
        for i in range(count):
            m = near[i]
            rest = w.wanted[m]
            for k in range(count):
                if k != i:
                    rest -= w.coupling[m, near[k]] * w.force[near[k]]
            weight = w.coupling[m, m]
            new = solve_point(rest, w.eta_before[m], weight, op, w.force[m])
            change = max(change, abs(new - w.force[m]) * weight)
            w.force[m] = new
        if change <= SETTLED:
            break


@jit
def displacement_at(op, coupling, force, near, count, m):
    """Displacement (m) that the forces at the points in `near` give point `m`, one of them, immediately."""
    if op.diagonal:
        return coupling[m, m] * force[m]
    x = 0.0
    for k in range(count):
        x += coupling[m, near[k]] * force[near[k]]
    return x


@jit
def friction_alone(op, wanted, weight):
    """Friction (N/m) at one touching point that would move by `wanted` (m) in two steps without friction."""
    return -op.friction * min(max(wanted / (op.slip + weight * op.friction), -1.0), 1.0)


@jit
def solve_friction(slot, op, near, count):
    """Solves friction (eq. 7) at the points in `near` with positive penetration slot.u.eta; zero at the others.

    Takes v.free, v.moved_before and u.coupling; v.force (N/m) holds first guesses and receives the friction.
    Returns the number of touching points.
    """
    u, v = slot.u, slot.v
    points, touching = v.solver.place, np.int64(0)  # a constant would have its own type
    for i in range(count):
        m = near[i]
        if u.eta[m] > 0.0:
            points[touching] = m
            touching += 1
        else:
            v.force[m] = 0.0
    if touching == 1 or op.diagonal:
        for i in range(touching):
            m = points[i]
            v.force[m] = friction_alone(op, v.free[m] - v.moved_before[m], u.coupling[m, m])
    elif touching > 1 and (is_exact(op) or not solve_friction_together(u, v, op, touching)):
        solve_friction_in_turn(u, v, op, touching)
    return touching


@jit
def stick_both(u, v, op, a, b):
    """`solve_friction_together` for points `a` and `b` that stick. False, and forces as they were, if one slides."""
    most, wanted, wanted_2 = op.friction, v.free[a] - v.moved_before[a], v.free[b] - v.moved_before[b]
    p, q, r = op.slip + most * u.coupling[a, a], most * u.coupling[a, b], op.slip + most * u.coupling[b, b]
    inverse = 1.0 / (p * r - q * q)
    g, h = (q * wanted_2 - r * wanted) * inverse, (q * wanted - p * wanted_2) * inverse
    if abs(g) > 1.0 or abs(h) > 1.0:
        return False
    v.force[a] = most * g
    v.force[b] = most * h
    return True


@jit
def solve_friction_together(u, v, op, count):
    """Solves friction at `count` points, v.solver.place. False, and forces as they were, if the sets do not settle.

    Puts the points that stick before those that slide.
    """
    points, wanted, g, x, matrix = v.solver.place, v.solver.wanted, v.solver.law, v.solver.residual, v.solver.matrix
    most, slip, coupling = op.friction, op.slip, u.coupling
    stuck = np.int64(0)
    for i in range(count):
        m = points[i]
        wanted[m] = v.free[m] - v.moved_before[m]
        g[m] = 1.0 if v.force[m] > 0.0 else -1.0  # if it slides
        if abs(v.force[m]) < most:
            swap(points, i, stuck)
            stuck += 1
    if count == 2 and stuck == 2 and stick_both(u, v, op, points[0], points[1]):
        return True
    for _ in range(MAX_FRICTION_SETS):
        for i in range(stuck):
            m = points[i]
            x[i] = -wanted[m]
            for k in range(stuck, count):
                x[i] -= most * coupling[m, points[k]] * g[points[k]]
            for k in range(stuck):
                matrix[i, k] = most * coupling[m, points[k]]
            matrix[i, i] += slip
        eliminate(matrix, x, stuck)
        settled, before = True, stuck
        for i in range(stuck - 1, -1, -1):
            m = points[i]
            g[m] = x[i]
            if abs(x[i]) > 1.0:
                g[m] = 1.0 if x[i] > 0.0 else -1.0
                stuck -= 1
                swap(points, i, stuck)
                settled = False
        for i in range(before, count):
            m = points[i]
            moved = wanted[m]
            for k in range(count):
                moved += most * coupling[m, points[k]] * g[points[k]]
            if -g[m] * moved < slip:
                swap(points, i, stuck)
                stuck += 1
                settled = False
        if settled:
            for i in range(count):
                v.force[points[i]] = most * g[points[i]]
            return True
    return False


@jit
def swap(row, i, k):
    """Swaps two numbers of a row."""
    row[i], row[k] = row[k], row[i]


@jit
def solve_friction_in_turn(u, v, op, count):
    """Solves one of `count` points, v.solver.place, after another until nothing changes: it always converges."""
    points = v.solver.place
    for _ in range(MAX_FRICTION_SWEEPS):
        change = 0.0
        for i in range(count):
            m = points[i]
            wanted = v.free[m] - v.moved_before[m]
            for k in range(count):
                if k != i:
                    wanted += u.coupling[m, points[k]] * v.force[points[k]]
            new = friction_alone(op, wanted, u.coupling[m, m])
            change = max(change, abs(new - v.force[m]))
            v.force[m] = new
        if change <= FRICTION_ENOUGH * op.friction:
            break
