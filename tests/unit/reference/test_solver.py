"""The brute-force solver against the equations, against plainer code, and against the paper."""

from __future__ import annotations

import csv
import dataclasses
import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from support import strings
from support.costs import quick
from support.motion import free_modes
from support.places import SHARED

from livebass.lab.reference.plan import make_plan, static_compliance
from livebass.lab.reference.solver import solve
from livebass.model import modes
from livebass.model.instrument import Pluck
from livebass.model.trial import Motion, Trial, initial_amplitudes, initial_amplitudes_across
from livebass.rows.arrays import Floats, Ints

PUBLISHED = SHARED / "fretted_modes.csv"


@pytest.fixture(scope="module")
def case_b() -> Motion:
    """Case B at 8 MHz with all 862 modes, first 60 ms, energy at every step."""
    return solve(strings.case_b(), energy_every=1)


def contact_sets(motion: Motion, gap: float = 2e-3) -> list[set[int]]:
    """The frets of each set of contacts; sets are at least `gap` s apart."""
    cuts = np.flatnonzero(np.diff(motion.contact_time_s) > gap) + 1
    return [set((part + 1).tolist()) for part in np.split(motion.contact_index, cuts)]


def test_case_b_contacts_as_published(case_b: Motion) -> None:
    assert 3.8e-3 <= case_b.contact_time_s[0] <= 4.0e-3
    assert case_b.contact_index[0] + 1 == 12
    sets = contact_sets(case_b)
    assert sets[0] == set(range(1, 13))
    assert sets[1] == set(range(2, 12))
    again = case_b.contact_time_s[case_b.contact_index == 0]
    assert again[again > 8e-3][0] == pytest.approx(0.049, abs=1e-3)


def test_energy_constant_without_losses() -> None:
    motion = solve(strings.case_b(duration=0.05, lossless=True), energy_every=16)
    energy = motion.energy_j
    assert energy is not None and motion.contact_step.size > 300
    drift = np.max(np.abs(energy / energy[0] - 1))
    assert drift < 1e-11, f"energy drifts by {drift:.1e}, allowed 1e-11"  # measured 9e-14


@pytest.mark.parametrize("exponent", [1.3, 1.5, 2.0])
@pytest.mark.parametrize("rate", [1e5, 1e6])
def test_energy_constant_on_a_coarse_string(exponent: float, rate: float) -> None:
    motion = solve(strings.tiny(contact_rate=rate, exponent=exponent, lossless=True, duration=0.05), 1)
    assert motion.energy_j is not None and motion.contact_step.size > 10
    assert np.max(np.abs(motion.energy_j / motion.energy_j[0] - 1)) < 1e-11


def test_energy_is_that_of_the_pluck() -> None:
    trial = strings.case_b(duration=1e-4, contact_rate=64e6, lossless=True)
    energy = solve(trial, energy_every=1).energy_j
    omega = 2 * math.pi * modes.frequencies(trial.speaking, trial.modes)
    expected = np.sum(trial.speaking.string.linear_density / 2 * omega**2 * initial_amplitudes(trial) ** 2)
    assert energy is not None and energy[0] == pytest.approx(expected, rel=1e-6)


def test_energy_never_rises_with_losses(case_b: Motion) -> None:
    assert case_b.energy_j is not None
    assert np.max(np.diff(case_b.energy_j)) <= 1e-13 * case_b.energy_j[0]
    assert case_b.energy_j[-1] < 0.5 * case_b.energy_j[0]


@pytest.mark.parametrize("seed", quick(range(12), range(0, 12, 6)))
def test_energy_never_rises_on_random_strings(seed: int) -> None:
    motion = solve(strings.random_trial(seed), energy_every=1)
    assert motion.energy_j is not None and motion.contact_step.size > 0
    assert np.max(np.diff(motion.energy_j)) <= 1e-13 * motion.energy_j[0]


def test_static_spring_only_takes_energy() -> None:
    trial = strings.case_b(modes=400, contact_rate=768e3, duration=0.02, lossless=True)
    energy = solve(trial, energy_every=1).energy_j
    assert energy is not None and np.max(np.diff(energy)) <= 1e-13 * energy[0]


@pytest.mark.parametrize(("contact_rate", "output_rate"), [(8e6, 48000.0), (8e6, 51234.5), (768e3, 44100.0)])
def test_free_motion_is_the_exact_modal_solution(contact_rate: float, output_rate: float) -> None:
    trial = dataclasses.replace(
        strings.case_b(40, contact_rate, 0.25, output_rate), pluck=Pluck(0.5e-3, 0.64)
    )  # too soft to touch a fret
    motion = solve(trial)
    s, t = trial.speaking, np.arange(trial.samples) / output_rate
    exact = free_modes(s, initial_amplitudes(trial), t) @ modes.shapes(s, 40, np.array([trial.sensor]))[0]
    assert motion.contact_step.size == 0
    np.testing.assert_array_equal(motion.time_s, t)
    error = np.max(np.abs(motion.displacement_m - exact)) / np.max(np.abs(exact))
    # the sum of 2e6 roundings of d, each 1e-16 of a step: 1e-10 of the motion would be a wrong frequency
    assert error < 1e-10, f"{error:.1e} of the peak, allowed 1e-10"


def plain_modes(trial: Trial, phi: Floats, across: bool) -> tuple[Floats, Floats, Floats, Floats]:
    """For u, or v if `across`: eq. 12's two matrices on the grid, and the displacements at 0 and one dt before.

    phi: the modes at the points of the grid, (N-1, N-1).
    """
    s, count, dt = trial.speaking, len(phi), 1 / trial.contact_rate
    sigma = np.zeros(count) if trial.lossless else modes.dampings(s, count, across=across)
    omega = np.sqrt((2 * math.pi * modes.frequencies(s, count, across=across)) ** 2 - sigma**2)
    kept, inverse = np.arange(count) < trial.modes, s.step * phi.T
    one = phi @ np.diag(kept * 2 * np.exp(-sigma * dt) * np.cos(omega * dt)) @ inverse
    two = phi @ np.diag(kept * np.exp(-2 * sigma * dt)) @ inverse
    q = np.zeros(count)
    q[: trial.modes] = initial_amplitudes_across(trial) if across else initial_amplitudes(trial)
    swing = np.cos(omega * dt) - sigma / omega * np.sin(omega * dt)
    return one, two, phi @ q, phi @ (q * np.exp(sigma * dt) * swing)


def bisect(law: Callable[[float], float], low: float, high: float) -> float:
    """The x between `low` and `high` with law(x) = x; law falls."""
    for _ in range(70):
        middle = (low + high) / 2
        if law(middle) > middle:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def in_turn(points: Ints, coupling: Floats, alone: Floats, solved: Callable[[int, float], float]) -> Floats:
    """Forces (P,), zero except at `points`, by Gauss-Seidel: solved(m, x) is the force at m, moved to x by the others.

    alone: positions of the points without forces, (P,).
    """
    force = np.zeros(alone.size)
    for _ in range(200):
        last = force.copy()
        for m in points:
            others = coupling[m] @ force - coupling[m, m] * force[m]
            force[m] = solved(m, alone[m] + others)
        if np.array_equal(force, last):
            break
    return force


def plain_solution(trial: Trial) -> tuple[Floats, Floats, list[tuple[int, int]]]:
    """Solves eqs. 12 and 7 as printed, with dense matrices on the grid and forces by bisection.

    Contact loses by Hunt and Crossley's law. Returns u and v, (n, N-1) each, and the contacts.
    """
    s, count = trial.speaking, trial.speaking.grid_points - 1
    dt, mu = 1 / trial.contact_rate, s.string.linear_density
    phi = modes.shapes(s, count, np.arange(1, count + 1) * s.step)  # (grid, modes)
    inverse, kept = s.step * phi.T, np.arange(count) < trial.modes
    push = phi @ np.diag(kept * dt**2 / mu) @ inverse
    at_once = phi @ np.diag(~kept / (mu * (2 * math.pi * modes.frequencies(s, count)) ** 2)) @ inverse
    where = np.round(np.asarray(s.contact_position) / s.step).astype(int) - 1
    height, k, alpha = np.asarray(s.contact_height), s.contact_stiffness, s.contact_exponent
    both, everywhere = (push + at_once)[np.ix_(where, where)], np.arange(where.size)

    def psi(eta: float) -> float:
        return k / (alpha + 1) * max(eta, 0.0) ** (alpha + 1)

    def quotient(after: float, before: float) -> float:
        if abs(after - before) < 1e-7 * (abs(after) + abs(before)):
            return k * max((after + before) / 2, 0.0) ** alpha
        return (psi(after) - psi(before)) / (after - before)

    def contact(m: int, below: float) -> float:
        def pushed(f: float) -> float:
            after = height[m] - below - both[m, m] * f
            return quotient(after, eta_before[m]) * max(0.0, 1 + s.contact_loss * (after - eta_before[m]) / (2 * dt))

        return bisect(pushed, 0.0, pushed(0.0) + 1e-30)

    def friction(m: int, place: float) -> float:
        def rubbed(f: float) -> float:
            speed = (place + both[m, m] * f - at_before[m]) / (2 * dt)
            return -s.friction * min(max(speed / s.friction_speed, -1.0), 1.0)

        return bisect(rubbed, -s.friction, s.friction)

    one, two, u, u_before = plain_modes(trial, phi, across=False)
    one_v, two_v, v, v_before = plain_modes(trial, phi, across=True)
    eta, eta_before = height - u[where], height - u_before[where]
    at, at_before = v[where], v_before[where]
    result, across, contacts = [u], [v], []
    for n in range(trial.steps):
        free = one_v @ v - two_v @ v_before
        force = in_turn(np.flatnonzero(eta > 0), both, free[where], friction)
        at_before, at = at, free[where] + both @ force
        v_before, v = v, free + push[:, where] @ force
        free = one @ u - two @ u_before
        after, force = height - free[where], np.zeros(where.size)
        if np.any(after > 0) or np.any(eta_before > 0):
            force = in_turn(everywhere, both, free[where], contact)
            after = after - both @ force
        contacts += [(n + 1, m) for m in range(where.size) if after[m] > 0 and eta[m] <= 0]
        u_before, u = u, free + push[:, where] @ force
        eta_before, eta = eta, after
        result.append(u)
        across.append(v)
    return np.array(result), np.array(across), contacts


def losing(trial: Trial, loss: float) -> Trial:
    """`trial` over frets that lose `loss` s/m, plucked obliquely, with an own law for v."""
    s = strings.with_own_across(dataclasses.replace(trial.speaking, contact_loss=loss))
    return strings.oblique(dataclasses.replace(trial, speaking=s), 0.7, 4e-3)


@pytest.mark.parametrize(
    "trial",
    [
        pytest.param(strings.tiny(), marks=pytest.mark.slow),
        strings.tiny(stiffness=1e9, duration=0.02),
        strings.tiny(stiffness=1e10, exponent=2.0),
        pytest.param(strings.tiny(modes=9, duration=0.004), marks=pytest.mark.slow),
        strings.oblique(strings.tiny(), 0.7, 4e-3),
        losing(strings.tiny(), 0.1),
        pytest.param(losing(strings.tiny(stiffness=1e9, duration=0.02), 3.0), marks=pytest.mark.slow),
        losing(strings.tiny(stiffness=1e8, duration=0.02), 100.0),
        losing(strings.tiny(stiffness=1e10, exponent=2.0), 10.0),
        pytest.param(losing(strings.tiny(modes=9, stiffness=1e10, duration=0.004), 1.0), marks=pytest.mark.slow),
    ],
    ids=[
        "hard", "soft", "square", "nine modes", "oblique", "hard, loses", "soft, loses", "lets go", "square, loses",
        "nine modes, lose",
    ],
)  # fmt: skip
def test_agrees_with_the_equations_as_printed(trial: Trial) -> None:
    motion = solve(trial)
    u, v, contacts = plain_solution(trial)
    s = trial.speaking
    inside = modes.shapes(s, trial.modes, np.arange(1, s.grid_points) * s.step)
    sensor = modes.shapes(s, trial.modes, np.array([trial.sensor]))[0]
    assert contacts, "the case should touch"
    assert list(zip(motion.contact_step.tolist(), motion.contact_index.tolist(), strict=True)) == contacts
    for solved, plain in ((motion.displacement_m, u), (motion.across_m, v)):
        if solved is not None:
            expected = plain @ (s.step * inside) @ sensor
            error = np.max(np.abs(solved - expected)) / np.max(np.abs(expected))
            assert error < 1e-7, f"{error:.1e} of the peak, allowed 1e-7"


def test_full_set_uncouples_the_points() -> None:
    trial = strings.case_b(contact_rate=8e6)
    plan, mu = make_plan(trial), trial.speaking.string.linear_density
    expected = np.eye(20) * plan.dt**2 / mu
    np.testing.assert_allclose(plan.coupling, expected, rtol=1e-12, atol=1e-13 * expected[0, 0])
    np.testing.assert_array_equal(static_compliance(trial), 0.0)


def test_second_order_in_the_time_step() -> None:
    def at_rate(rate: float) -> Floats:
        return solve(
            strings.tiny(contact_rate=rate, output_rate=1e4, duration=0.004, stiffness=1e8, lossless=True)
        ).displacement_m

    exact = at_rate(64e5)
    errors = [np.max(np.abs(at_rate(rate) - exact)) for rate in (1e5, 2e5, 4e5)]
    assert errors[0] > 1e-9
    for coarse, fine in pairwise(errors):
        assert 3.5 < coarse / fine < 4.5, errors


def test_string_above_the_last_fret_swings_free() -> None:
    trial = dataclasses.replace(
        strings.case_b(100, 4e5, 0.01), speaking=strings.speaking(strings.g_string(), strings.g_neck(), 20)
    )
    trial = dataclasses.replace(trial, pluck=Pluck(3e-3, 0.1), sensor=0.2)
    motion = solve(trial)
    assert motion.contact_step.size == 0 and np.all(np.isfinite(motion.displacement_m))


def test_same_trial_same_bits() -> None:
    first, second = (solve(strings.random_trial(5)) for _ in range(2))
    np.testing.assert_array_equal(first.displacement_m, second.displacement_m)
    np.testing.assert_array_equal(first.contact_step, second.contact_step)


@pytest.mark.skipif(not PUBLISHED.exists(), reason="published modes not here")
def test_laws_and_pluck_match_the_published_modes() -> None:
    with open(PUBLISHED, newline="") as table:
        rows = list(csv.DictReader(table))
    s = strings.paper_g()
    nu = np.array([float(r["frequency_hz"]) for r in rows])
    sigma = np.array([float(r["damping_per_s"]) for r in rows])
    np.testing.assert_allclose(modes.frequencies(s, 862), nu, rtol=3e-5)
    # the published ones start from sqrt(T/mu)/2L, 0.08 % above the measured fundamental, and sigma grows as its cube
    np.testing.assert_allclose(modes.dampings(s, 862)[119:], sigma[119:], rtol=3e-3)
    np.testing.assert_allclose(modes.dampings(s, 862)[:34], sigma[:34], rtol=1e-9)
