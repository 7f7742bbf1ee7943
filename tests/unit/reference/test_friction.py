"""The second polarisation by brute force: eq. 7 is solved exactly, energy never rises, and u does not feel v."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from support import strings
from support.motion import free_modes
from support.strings import oblique

from livebass.lab.reference.laws import sat, solve_friction
from livebass.lab.reference.solver import solve
from livebass.model import modes
from livebass.model.trial import initial_amplitudes_across


@pytest.mark.parametrize("seed", range(30))
def test_friction_solves_eq_7(seed: int) -> None:
    """w + C A sat(w / delta) = w* at every point that touches, nothing elsewhere."""
    rng = np.random.default_rng(seed)
    points = int(rng.integers(1, 9))
    root = rng.standard_normal((points, points))
    coupling = 1e-14 * (root @ root.T + 0.1 * np.eye(points))
    maximum, delta = 10 ** rng.uniform(0, 4), 10 ** rng.uniform(-14, -10)
    wanted = rng.standard_normal(points) * 10 ** rng.uniform(-13, -9)
    touching = rng.choice([-1e-6, 1e-6], points)
    force = np.full(points, np.nan)
    assert solve_friction(coupling, wanted, touching, maximum, delta, force)
    assert not force[touching <= 0].any()
    w = wanted + coupling @ force
    held = touching > 0
    law = np.array([-maximum * sat(x / delta) for x in w])
    # where sat is steep the law magnifies the rounding of w
    assert np.abs(law - force)[held].max(initial=0.0) <= 1e-9 * maximum + maximum * 1e-14 * np.abs(wanted).max() / delta


def test_v_swings_freely_where_nothing_touches() -> None:
    trial = oblique(strings.case_b(40, 8e6, 0.02), 0.7, 0.5e-3)
    motion = solve(trial)
    assert motion.contact_step.size == 0 and motion.across_m is not None
    s, q = trial.speaking, initial_amplitudes_across(trial)
    exact = free_modes(s, q, motion.time_s) @ modes.shapes(s, 40, np.array([trial.sensor]))[0]
    assert np.abs(motion.across_m - exact).max() < 1e-10 * np.abs(exact).max()


@pytest.mark.parametrize("angle", [0.3, 1.0])
def test_u_does_not_feel_v(angle: float) -> None:
    trial = strings.tiny(duration=0.02)
    alone = solve(oblique(trial, 0.0, 3e-3 * math.cos(angle)))
    both = solve(oblique(trial, angle, 3e-3))
    assert both.contact_step.size > 5
    np.testing.assert_allclose(both.displacement_m, alone.displacement_m, rtol=0, atol=1e-12)
    assert alone.across_m is None


@pytest.mark.parametrize("count", [23, 12])
@pytest.mark.parametrize("friction", [0.5, 50.0, 900.0])
@pytest.mark.parametrize("speed", [1e-5, 1e-2])
def test_energy_never_rises_with_friction(count: int, friction: float, speed: float) -> None:
    trial = oblique(strings.tiny(duration=0.05, lossless=True), 0.8, 4e-3)
    speaking = dataclasses.replace(trial.speaking, friction=friction, friction_speed=speed)
    motion = solve(dataclasses.replace(trial, speaking=speaking, modes=count), energy_every=1)
    energy = motion.energy_j
    assert energy is not None and motion.contact_step.size > 10
    assert np.max(np.diff(energy)) <= 1e-13 * energy[0]
    assert energy[-1] < 0.999 * energy[0], "friction takes energy"


def test_oblique_pluck_of_the_paper_loses_v_at_the_frets() -> None:
    """Section 4.1.3: a pluck of 3.1 mm up and 2.2 mm across."""
    trial = oblique(strings.case_b(duration=0.02), math.atan2(2.2, 3.1), math.hypot(2.2e-3, 3.1e-3))
    motion = solve(dataclasses.replace(trial, sensor_v=trial.speaking.length - 18e-3), energy_every=8)
    assert motion.energy_j is not None and motion.across_m is not None
    assert motion.contact_step.size > 50
    assert np.max(np.diff(motion.energy_j)) <= 1e-13 * motion.energy_j[0]
    period = 450  # samples
    assert np.abs(motion.across_m[-period:]).max() < 0.9 * np.abs(motion.across_m[:period]).max()
