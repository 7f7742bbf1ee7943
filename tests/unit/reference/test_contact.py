"""The contact law of the brute-force solver and the implicit equation for its force."""

from __future__ import annotations

import math

import numpy as np
import pytest

from livebass.lab.reference.laws import (
    CONTACT,
    _force_of_powers,
    _force_of_roots,
    contact_force,
    contacts,
    law_force,
    lost_energy,
    potential,
    solve_forces,
)


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
    assert solve_forces(coupling, free, before, contacts(2, 1e13, 1.5, 0.0), force, after)
    np.testing.assert_allclose(after, free - coupling @ force, rtol=0, atol=1e-16)
    assert force[1] > 0 and after[1] > 0


@pytest.mark.parametrize("loss", [3e4, 1e6, 1e8])  # 1/m
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.3])
@pytest.mark.parametrize("before, after", [(-1e-6, 3e-6), (2e-6, -5e-6), (1e-6, 4e-6), (4e-6, 1e-6), (2e-6, 1.9e-6)])
def test_contact_that_loses_takes_its_part_of_the_work(
    exponent: float, before: float, after: float, loss: float
) -> None:
    r = after - before
    force, slope = law_force(CONTACT, before, r, 1e13, exponent, loss)
    elastic = contact_force(before, r, 1e13, exponent)[0]
    gone = lost_energy(CONTACT, force, before, after, 1e13, exponent, loss)
    if 1 + loss * r > 0:
        assert force == pytest.approx(elastic * (1 + loss * r), rel=1e-12)
        assert gone == pytest.approx(elastic * loss * r * r, rel=1e-9) and gone > 0
    else:  # the obstacle returns more slowly than the string: its stored energy is lost, and it never pulls
        assert force == slope == 0
        assert gone == potential(before, 1e13, exponent) - potential(after, 1e13, exponent) > 0
    h = 1e-11
    up, down = (law_force(CONTACT, before, r + e, 1e13, exponent, loss)[0] for e in (h, -h))
    assert slope == pytest.approx((up - down) / (2 * h), rel=1e-5)


def test_a_mass_bounces_as_hunt_and_crossley_say() -> None:
    """It keeps 1 - 2/3 c v of its speed v for small c v, whatever mass, K and alpha; more if thrown softly.

    The energy lost in a bounce, the integral of K eta^alpha c eta'^2, is 2/3 c v of m v^2 to first order (Hunt and
    Crossley 1975: their restitution is 1 - alpha v, with their loss 3/2 alpha). The scheme runs step by step.
    """
    mass, dt = 0.02, 2e-8
    for stiffness, exponent, speed, c in ((1e9, 1.5, 1.0, 0.02), (1e7, 1.5, 0.25, 0.08), (1e9, 2.2, 0.1, 0.05)):
        laws = contacts(1, stiffness, exponent, c / (2 * dt))
        coupling = np.array([[dt**2 / mass]])
        last, now = np.array([-1.5 * speed * dt]), np.array([-0.5 * speed * dt])
        force, after = np.zeros(1), np.zeros(1)
        while now[0] > 0 or now[0] >= last[0]:
            force[:] = 0
            assert solve_forces(coupling, 2 * now - last, last, laws, force, after)
            last, now = now.copy(), after.copy()
        kept = (last[0] - now[0]) / dt / speed
        assert kept == pytest.approx(1 - 2 / 3 * c * speed, abs=0.6 * (c * speed) ** 2 + 2e-6), (stiffness, exponent)
