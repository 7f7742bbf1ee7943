"""The contact force of eqs. 6 and 12: one implicit scalar equation a point, weakly coupled points.

At point m, r = eta^{n+1} - eta^{n-1} solves r + sum_k W_mk f_k = r*, where r* is what r would be without
force and f = (psi(eta^{n+1}) - psi(eta^{n-1})) / r. f is convex and grows with r, so Newton from r* comes down
to the root without overshoot. [any thread]
"""

import numpy as np

from livebass.kernels import jit

MOST_ITERATIONS = 60
MOST_SWEEPS = 400
SMALL = 1e-17  # m
ENOUGH = 1e-9


@jit
def force(new, old, r, stiffness, exponent):
    """(f, df/dr): the divided difference of psi between penetrations `old` and `new` = old + r."""
    a = max(new, 0.0)
    b = max(old, 0.0)
    if a == 0.0 and b == 0.0:
        return 0.0, 0.0
    e = exponent + 1.0
    if a > 0.0 and b > 0.0 and abs(r) < 1e-4 * b:
        mid = b + 0.5 * r
        f = stiffness * mid**exponent
        return f, 0.5 * stiffness * exponent * mid ** (exponent - 1.0)
    f = stiffness / e * (a**e - b**e) / r
    return f, (stiffness * a**exponent - f) / r


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
    if exponent == 1.5:
        r = root_of_three_halves(r, wanted, old, weight, stiffness / 2.5)
    else:
        for _ in range(MOST_ITERATIONS):
            if r == 0.0:
                r = 1e-30
            f, slope = force(old + r, old, r, stiffness, exponent)
            step = (r + weight * f - wanted) / (1.0 + weight * slope)
            r -= step
            if abs(step) <= ENOUGH * abs(r) + SMALL:  # converges quadratically: the next is far below rounding
                break
    # from the equation itself: smoother than the force law where that is steep
    return (wanted - r) / weight


@jit
def root_of_three_halves(r, wanted, old, weight, k):
    """Newton from r for alpha = 1.5, k = K / 2.5: `force` with one root and one division a step.

    Where both penetrations are positive f = k (x^5 - y^5) / (x^2 - y^2), x and y their roots: no cancellation.
    """
    b = max(old, 0.0)
    y = np.sqrt(b)
    for _ in range(MOST_ITERATIONS):
        a = old + r
        if a > 0.0:
            x = np.sqrt(a)
            if b > 0.0:
                s = x + y
                top = a * a + (a + b) * x * y + a * b + b * b
                part = k / (2.0 * x * s * s)
                f = part * top * 2.0 * x * s
                slope = part * ((4.0 * a * x + 3.0 * a * y + 2.0 * x * b + y * b) * s - top)
            else:
                part = k * a * x / r
                f = part * a
                slope = (2.5 * part * r - f) / r
        elif b > 0.0:
            f = -k * b * b * y / r
            slope = -f / r
        else:
            f = 0.0
            slope = 0.0
        step = (r + weight * f - wanted) / (1.0 + weight * slope)
        r -= step
        if abs(step) <= ENOUGH * abs(r) + SMALL:
            break
    return r


@jit
def solve_points(near, count, wanted, old, f, coupling, compliance, ratio, stride, diagonal, stiffness, exponent):
    """Forces f (kept in place, also as the first guess) at `count` points, and how many are not zero.

    near: indices of the points; wanted, old: r* and eta^{n-1} by point index; coupling and compliance: flat
    matrices W and R with rows of `stride`; R counts 1/ratio^2 (modes tuned higher are stiffer).
    """
    soft = 1.0 / (ratio * ratio)
    for _ in range(MOST_SWEEPS):
        change = 0.0
        for i in range(count):
            m = near[i]
            rest = wanted[m]
            if not diagonal:
                for k in range(count):
                    c = near[k]
                    if k != i and f[c] != 0.0:
                        rest -= (coupling[m * stride + c] + soft * compliance[m * stride + c]) * f[c]
            weight = coupling[m * stride + m] + soft * compliance[m * stride + m]
            new = solve_point(rest, old[m], weight, stiffness, exponent, f[m])
            change = max(change, abs(new - f[m]) * weight)
            f[m] = new
        if diagonal or count == 1 or change <= 1e-16:
            break
    touching = 0
    for i in range(count):
        if f[near[i]] != 0.0:
            touching += 1
    return touching
