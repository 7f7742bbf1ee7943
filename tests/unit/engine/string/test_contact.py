"""The contact solver satisfies r_i + sum_k W_ik f_k = r*_i, f of eq. 6, for any number of points and any guess.

Covers the loss of Hunt and Crossley too, and friction, eq. 7.
"""

from __future__ import annotations

import numpy as np
import pytest

from livebass.compiling import jit
from livebass.kernels.machine.native import record_at
from livebass.kernels.string import contact
from livebass.kernels.string.records import OPERATOR, STRING, WORK
from livebass.lab.reference.laws import CONTACT, law_force, sat

STIFFNESS, DEPTH, COMPLIANCE = 1e13, 1e-7, 3e-10  # N/m^2.5; m; m per N/m

work_at = record_at(WORK)
string_at = record_at(STRING)


@jit
def solve_points(work, op, near, count):  # type: ignore[no-untyped-def]
    """`contact.solve_points` for the address of a WORK, whose rows share memory."""
    return contact.solve_points(work_at(work), op, near, count)


@jit
def solve_friction(string, op, near, count):  # type: ignore[no-untyped-def]
    """`contact.solve_friction` for the first slot of the STRING at an address."""
    return contact.solve_friction(string_at(string).slots[0], op, near, count)


def residuals(
    wanted: np.ndarray, old: np.ndarray, coupling: np.ndarray, exponent: float, guess: np.ndarray, loss: float = 0.0,
    exact: bool = True,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """The residual of each equation relative to DEPTH, and the forces found; `exact`: by an operator of float64."""
    count = len(wanted)
    near = np.random.default_rng(count).permutation(20)[:count].astype(np.int64)
    work, op = np.zeros(1, WORK), np.zeros(1, OPERATOR)
    w = work[0]
    w["wanted"][near], w["eta_before"][near], w["force"][near] = wanted, old, guess
    w["coupling"][np.ix_(near, near)] = coupling
    op["stiffness"], op["exponent"], op["loss"], op["padded"] = STIFFNESS, exponent, loss, not exact
    touching = solve_points(work.ctypes.data, op[0], near, count)
    f = w["force"][near]
    r = wanted - coupling @ f
    law = np.array([law_force(CONTACT, y, x, STIFFNESS, exponent, loss)[0] for x, y in zip(r, old, strict=True)])
    assert touching == np.count_nonzero(f)
    return (coupling @ (law - f)) / DEPTH, f


@pytest.mark.parametrize("loss", [0.0, 0.2, 1.0, 10.0, 100.0])  # of 1 / DEPTH
@pytest.mark.parametrize("exponent", [1.5, 1.3])
@pytest.mark.parametrize("seed", range(40))
def test_the_equations_hold(seed: int, exponent: float, loss: float) -> None:
    rng = np.random.default_rng(seed)
    count = 2 + seed % 5
    a = rng.standard_normal((count, 3 * count))
    coupling = COMPLIANCE * (a @ a.T / (3 * count) + np.eye(count))
    wanted, old = DEPTH * rng.standard_normal((2, count))
    guess = np.maximum(rng.standard_normal(count), 0.0) * STIFFNESS * DEPTH**1.5
    left, f = residuals(wanted, old, coupling, exponent, guess, loss / DEPTH)
    assert np.abs(left).max() < 1e-9
    again, g = residuals(wanted, old, coupling, exponent, 0.0 * guess, loss / DEPTH)
    assert np.abs(again).max() < 1e-9
    np.testing.assert_allclose(coupling @ f, coupling @ g, rtol=0, atol=1e-9 * DEPTH)
    rough, _ = residuals(wanted, old, coupling, exponent, guess, loss / DEPTH, exact=False)
    assert np.abs(rough).max() < 3e-6, "far below the rounding of a displacement of 32 bits"


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("seed", range(140))
def test_friction_solves_eq_7(seed: int, exact: bool) -> None:
    """At each touching point, whatever the last forces were: none, or of points that stuck or slid either way."""
    rng = np.random.default_rng(seed)
    count, most = 1 + seed % 7, 10.0 ** rng.uniform(0, 4)
    root = rng.standard_normal((count, 3 * count))
    coupling = COMPLIANCE * (root @ root.T / (3 * count) + np.eye(count))
    slip = most * COMPLIANCE * 10.0 ** rng.uniform(-3, 1)
    wanted = most * COMPLIANCE * rng.standard_normal(count) * 10.0 ** rng.uniform(-1, 1)
    touching = rng.random(count) < 0.8
    near = rng.permutation(20)[:count].astype(np.int64)
    string, op = np.zeros(1, STRING), np.zeros(1, OPERATOR)
    u, v = string["slots"][0, 0]["u"], string["slots"][0, 0]["v"]
    u["coupling"][np.ix_(near, near)], u["eta"][near] = coupling, np.where(touching, 1.0, -1.0) * DEPTH
    v["free"][near], v["moved_before"][near] = wanted + DEPTH, DEPTH
    v["force"][near] = most * np.clip(rng.standard_normal(count), -1, 1)
    op["friction"], op["slip"], op["padded"] = most, slip, not exact
    assert solve_friction(string.ctypes.data, op[0], near, count) == np.count_nonzero(touching)
    f = v["force"][near]
    law = np.array([-most * sat(x / slip) for x in v["free"][near] - DEPTH + coupling @ f])
    assert not f[~touching].any() and np.abs(f).max(initial=0.0) <= most
    # where sat is steep the law magnifies the rounding of x
    np.testing.assert_allclose(f[touching], law[touching], rtol=0, atol=most * (1e-9 + 1e-14 * DEPTH / slip))


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_of_two_points_that_stuck_one_may_slide(first: int, way: float) -> None:
    """It feels A and no more, if to stick it would need half as much again; the other goes on sticking."""
    most, near, step = 100.0, np.array([4, 9]), 100.0 * COMPLIANCE
    coupling, slip = COMPLIANCE * np.array([[1.0, 0.2], [0.2, 1.0]]), 0.1 * step
    string, op = np.zeros(1, STRING), np.zeros(1, OPERATOR)
    u, v = string["slots"][0, 0]["u"], string["slots"][0, 0]["v"]
    u["coupling"][np.ix_(near, near)], u["eta"][near] = coupling, DEPTH
    v["free"][near[first]], v["free"][near[1 - first]] = 1.7 * way * step, 0.3 * way * step
    op["friction"], op["slip"], op["padded"] = most, slip, 1
    assert solve_friction(string.ctypes.data, op[0], near, 2) == 2
    f = v["force"][near]
    assert f[first] == -way * most and 0.0 < -way * f[1 - first] < most
    wanted = [-most * sat(x / slip) for x in v["free"][near] + coupling @ f]
    np.testing.assert_allclose(f, wanted, rtol=0, atol=1e-9 * most)


@pytest.mark.parametrize("loss", [0.0, 3.0])  # of 1 / DEPTH
@pytest.mark.parametrize("touching", [1, 2])
def test_a_force_may_press_another_point_on(touching: int, loss: float) -> None:
    """With truncated modes some W are negative, so a force may press down a point that would not touch alone."""
    coupling = COMPLIANCE * (1.3 * np.eye(3) - 0.4 * (1 - np.eye(3)))
    old = np.full(3, -0.1 * DEPTH)
    wanted = np.array([2.0, 2.0 if touching == 2 else -0.5, 0.05]) * DEPTH
    left, f = residuals(wanted, old, coupling, 1.5, np.zeros(3), loss / DEPTH)
    assert np.abs(left).max() < 1e-9 and f[0] > 0 and f[2] > 0


def test_nobody_touches() -> None:
    left, f = residuals(np.full(3, -DEPTH), np.full(3, -DEPTH), COMPLIANCE * np.eye(3), 1.5, np.ones(3))
    assert not f.any() and not left.any()
