"""The contact law of the brute-force solver and the implicit equation for its force."""

from __future__ import annotations

import math

import numpy as np
import pytest

from livebass.reference.laws import _force_of_powers, _force_of_roots, contact_force, potential, solve_contact


def test_force_of_powers_matches_force_of_roots() -> None:
    rng = np.random.default_rng(1)
    for _ in range(500):
        before = 10 ** rng.uniform(-9, -4)
        after = before * (1 + 10 ** rng.uniform(-14, 2) * rng.choice([-0.009, 1]))
        r = after - before
        powers = _force_of_powers(before, after, r, 1e13, 1.5)
        roots = _force_of_roots(math.sqrt(after), math.sqrt(before), 1e13)
        assert powers[0] == pytest.approx(roots[0], rel=1e-12)
        assert powers[1] == pytest.approx(roots[1], rel=1e-8)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.3])
@pytest.mark.parametrize("before, after", [(-1e-6, 3e-6), (2e-6, -5e-6), (1e-6, 4e-6), (0.0, 1e-6), (2e-6, 2e-6)])
def test_force_is_the_quotient_and_slope_its_derivative(exponent: float, before: float, after: float) -> None:
    force, slope = contact_force(before, after - before, 1e13, exponent)
    if after != before:
        change = potential(after, 1e13, exponent) - potential(before, 1e13, exponent)
        assert force == pytest.approx(change / (after - before), rel=1e-12)
    else:
        assert force == pytest.approx(1e13 * after**exponent, rel=1e-12)
    h = 1e-11
    up, down = (contact_force(before, after - before + e, 1e13, exponent)[0] for e in (h, -h))
    assert slope == pytest.approx((up - down) / (2 * h), rel=1e-5)


def test_point_pushed_in_by_its_neighbour_gets_its_force() -> None:
    coupling = np.array([[2e-12, -1.5e-12], [-1.5e-12, 2e-12]])
    free, before = np.array([1e-5, -1e-8]), np.array([-1e-6, -2e-6])
    force, after = np.zeros(2), free.copy()
    assert solve_contact(coupling, free, before, 1e13, 1.5, force, after)
    np.testing.assert_allclose(after, free - coupling @ force, rtol=0, atol=1e-16)
    assert force[1] > 0 and after[1] > 0
