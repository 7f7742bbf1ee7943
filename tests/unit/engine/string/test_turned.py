"""Turned axes: u and v exchange energy. The motion is that of the coupled modes, and no exchange adds energy."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from support.agreement import assert_agree
from support.costs import quick
from support.motion import free_modes
from support.strings import case_b, g_neck, g_string, oblique, with_own_across

from livebass.engine.solve import solve_trial
from livebass.lab.reference.solver import solve
from livebass.model import modes
from livebass.model.instrument import Speaking, speaking
from livebass.model.trial import Trial
from livebass.rows.arrays import Floats

MODES = 60


def turn(s: Speaking, degrees: float) -> Speaking:
    return dataclasses.replace(with_own_across(s), axes_turned=np.radians(degrees))


def turned_trial(degrees: float, angle: float, duration: float, apex: float = 1e-3, **numbers: Any) -> Trial:
    """A pluck of the paper's G string at `angle` (rad), its axes turned."""
    trial = oblique(case_b(duration=duration, **numbers), angle, apex)
    return dataclasses.replace(trial, speaking=turn(speaking(g_string(), g_neck(3e8), 0), degrees))


def coupled_motion(trial: Trial, t: Floats) -> tuple[Floats, Floats]:
    """u and v at their sensors from the free motion along the axes of the neck."""
    s, n = trial.speaking, trial.modes
    plain = dataclasses.replace(s, axes_turned=0.0)
    c, e = np.cos(s.axes_turned), np.sin(s.axes_turned)
    u = np.cos(trial.pluck.angle) * modes.pluck_amplitudes(s, n, trial.pluck)
    v = np.sin(trial.pluck.angle) * modes.pluck_amplitudes(s, n, trial.pluck, across=True)
    a, b = free_modes(plain, c * u + e * v, t), free_modes(plain, c * v - e * u, t, across=True)
    place = trial.sensor if trial.sensor_v is None else trial.sensor_v
    of_u, of_v = modes.shapes(s, n, np.array([trial.sensor, place]))
    return (c * a - e * b) @ of_u, (e * a + c * b) @ of_v


@pytest.mark.parametrize("degrees", [35.0, -55.0, 90.0])
def test_the_motion_is_that_along_the_axes(degrees: float) -> None:
    """Free motion over several beats; with the axes turned the other way it is another motion."""
    trial = turned_trial(degrees, 0.3, 1.5, modes=MODES)
    motion = solve_trial(trial)
    assert motion.contact_step.size == 0 and motion.across_m is not None
    u, v = coupled_motion(trial, motion.time_s)
    assert np.abs(motion.displacement_m - u).max() < 2e-3 * np.abs(u).max()
    assert np.abs(motion.across_m - v).max() < 2e-3 * np.abs(v).max()
    if degrees != 90.0:
        back = dataclasses.replace(trial, speaking=turn(trial.speaking, -degrees))
        assert np.abs(coupled_motion(back, motion.time_s)[0] - u).max() > 0.1 * np.abs(u).max()


def test_a_pluck_along_an_axis_stays_on_it() -> None:
    """Along axis a, u and v keep their ratio: no beat."""
    trial = turned_trial(35.0, np.radians(35.0), 1.0, modes=MODES)
    motion = solve_trial(dataclasses.replace(trial, sensor_v=trial.sensor))
    assert motion.across_m is not None
    assert np.abs(motion.across_m - np.tan(trial.pluck.angle) * motion.displacement_m).max() < 3e-3 * 1e-3


@pytest.mark.parametrize(("degrees", "angle"), quick([(35.0, 0.0), (35.0, 1.2), (-55.0, 0.4)], [(-55.0, 0.4)]))
def test_brute_force_agrees_where_it_touches(degrees: float, angle: float) -> None:
    """Also at a rate at which samples lie between two fine steps, and where nothing but the exchange moves v."""
    trial = turned_trial(degrees, angle, 0.02, apex=6e-3, contact_rate=4e6)
    assert assert_agree(dataclasses.replace(trial, sensor_v=trial.speaking.length - 0.03), f"{degrees} deg, {angle}")


@pytest.mark.parametrize("lossless", [False, True])
def test_no_exchange_adds_energy(lossless: bool) -> None:
    """Hard contact included. Without losses only friction takes energy, and plucked up hardly any."""
    trial = turned_trial(-55.0, 0.0 if lossless else 0.4, 0.02, apex=6e-3, contact_rate=2e6, lossless=lossless)
    motion = solve(trial, energy_every=16)
    assert motion.contact_step.size > 50 and motion.energy_j is not None
    energy = motion.energy_j / motion.energy_j[0]
    assert np.diff(energy).max() < 1e-11
    assert energy[-1] > (0.9999 if lossless else 0.5)
