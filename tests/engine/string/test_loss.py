"""Contact that loses, and a second polarisation with a law of its own: engine, brute force and energy agree."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from support.agreement import assert_agree
from support.strings import case_b, g_neck, g_string, oblique, random_trial

from livebass.engine.solve import solve_trial
from livebass.model import modes
from livebass.model.instrument import Speaking, speaking
from livebass.model.neck import Admittance, Resonance
from livebass.model.trial import Trial
from livebass.preset.load import load_preset
from livebass.reference.playing import play
from livebass.reference.solver import solve

LOSSES = ((1e13, 3.0), (1e10, 30.0), (3e8, 50.0), (1e8, 100.0))  # K, SI, and c, s/m


def losing(trial: Trial, stiffness: float, loss: float) -> Trial:
    """`trial` over frets of `stiffness` that lose `loss` s/m."""
    s = dataclasses.replace(trial.speaking, contact_stiffness=stiffness, contact_loss=loss)
    return dataclasses.replace(trial, speaking=s)


def with_own_across(s: Speaking) -> Speaking:
    """`s` with a neck that gives way otherwise across."""
    back = Admittance((Resonance(110.0, 20.0, 0.4), Resonance(730.0, 30.0, 0.3)), (), 1e-3)
    across = Admittance((Resonance(180.0, 20.0, 0.4), Resonance(1210.0, 30.0, 0.3)), (), 4e-4)
    string = dataclasses.replace(s.string, measured_frequencies=(), measured_dampings=())
    return dataclasses.replace(
        s, string=string, admittance=back, own_across=True, admittance_across=across, longer_across=4e-4
    )


@pytest.mark.parametrize(("stiffness", "loss"), LOSSES)
def test_engine_and_brute_force_agree(stiffness: float, loss: float) -> None:
    trial = losing(case_b(duration=0.04), stiffness, loss)
    assert assert_agree(trial, f"K {stiffness:g}, c {loss:g}"), "contact that loses is not chaotic"
    slant = losing(oblique(case_b(duration=0.03), 0.7, 5e-3), stiffness, loss)
    assert_agree(slant, f"K {stiffness:g}, c {loss:g}, oblique", least=0.5)


@pytest.mark.parametrize("seed", range(6))
def test_random_losses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    trial = losing(random_trial(seed, 0.02), 10 ** rng.uniform(8, 12), 10 ** rng.uniform(-1, 3))
    assert_agree(trial, f"seed {seed}", least=0.1)
    assert solve(trial).contact_step.size > 0
    s = with_own_across(trial.speaking)
    trial = oblique(dataclasses.replace(trial, speaking=s), rng.uniform(0.2, 1.2), trial.pluck.apex)
    assert_agree(trial, f"seed {seed}, v of its own", least=0.1, touches=False)


@pytest.mark.parametrize(("stiffness", "loss"), LOSSES)
def test_energy_never_rises_and_is_lost_to_the_frets(stiffness: float, loss: float) -> None:
    trial = losing(case_b(duration=0.08, lossless=True, contact_rate=4e6), stiffness, loss)
    motion = solve(trial, energy_every=1)
    assert motion.energy_j is not None and motion.contact_step.size > 0
    assert np.max(np.diff(motion.energy_j)) <= 1e-12 * motion.energy_j[0]
    assert 0.3 * motion.energy_j[0] < motion.energy_j[-1] < 0.97 * motion.energy_j[0]


def test_what_frets_take_closes_the_balance() -> None:
    trial = losing(oblique(case_b(modes=400, contact_rate=44100 * 40, duration=0.03), 0.5, 5e-3), 3e8, 50.0)
    trial = dataclasses.replace(trial, speaking=with_own_across(trial.speaking))
    balance = play(trial).balance
    assert balance.error < 1e-11
    assert np.all(np.diff(balance.contact_j) >= -1e-12 * balance.stored_j[0])
    assert balance.contact_j[-1] > 0.02 * balance.stored_j[0]


def test_a_fret_loses_alike_on_every_grid() -> None:
    """Neck.contact_loss is that of a fret: K dx and R stay, whatever the length of string that a fret pushes on."""
    heard = []
    for step in (1e-3, 2e-3):
        neck = dataclasses.replace(g_neck(3e8 * 1e-3 / step), grid_step=step, contact_loss=15.0)
        assert neck.loss == pytest.approx(50.0, rel=1e-12)
        trial = case_b(modes=300, contact_rate=4e6, duration=0.03)
        moved = solve_trial(dataclasses.replace(trial, speaking=speaking(g_string(), neck, 0)))
        heard.append(moved.displacement_m)
    # what the modes left out of the coarser grid yield is all that differs, and places of frets on the grid
    assert np.sqrt(np.mean((heard[0] - heard[1]) ** 2) / np.mean(heard[0] ** 2)) < 0.05


def far_from_reference(stiffness: float, loss: float) -> float:
    """Worst distance (dB) of the waveforms of three hard plucks by 450 modes at 672 kHz from all modes at 8 MHz."""
    bass, worst = load_preset("jazz-finger"), -300.0
    for i, fret in ((0, 1), (1, 5), (3, 4)):
        neck = dataclasses.replace(bass.necks[i], contact_stiffness=stiffness, contact_loss=loss)
        s = speaking(bass.strings[i], neck, fret)
        trial = case_b(duration=0.3, output_rate=48_000.0)
        pluck = dataclasses.replace(trial.pluck, position=0.75 * s.length, apex=4e-3, rounding=7e-3)
        few, all_modes = round(450 * s.length / s.string.length), s.grid_points - 1
        coarse, fine = (
            dataclasses.replace(trial, speaking=s, pluck=pluck, modes=n, contact_rate=rate, sensor=s.length - 0.09)
            for n, rate in ((few, 672e3), (all_modes, 8.016e6))
        )
        a, b = solve_trial(coarse).displacement_m, solve_trial(fine).displacement_m
        worst = max(worst, 10 * np.log10(np.sum((a - b) ** 2) / np.sum(b**2)))
    return worst


def test_contact_that_loses_needs_few_modes_and_steps() -> None:
    """Stiff frets that lose nothing are chaotic: the same pluck is another motion at another rate."""
    assert far_from_reference(3e8, 15.0) < -45.0
    assert far_from_reference(1e13, 0.0) > -20.0


def test_v_has_the_frequencies_and_dampings_of_its_own_neck() -> None:
    """An oblique pluck that touches nothing: v is the free motion by `modes` across."""
    s = with_own_across(speaking(g_string(), g_neck(), 0))
    trial = dataclasses.replace(oblique(case_b(modes=60, duration=0.3), 1.2, 1e-3), speaking=s)
    motion, t = solve_trial(trial), np.arange(trial.samples) / trial.output_rate
    nu, sigma = modes.frequencies(s, 60, across=True), modes.dampings(s, 60, across=True)
    assert np.all(np.abs(nu / modes.frequencies(s, 60) - 1) > 1e-5) and np.all(sigma != modes.dampings(s, 60))
    omega = np.sqrt((2 * np.pi * nu) ** 2 - sigma**2)
    swing = np.cos(np.outer(t, omega)) + sigma / omega * np.sin(np.outer(t, omega))
    q = np.sin(1.2) * modes.pluck_amplitudes(s, 60, trial.pluck)
    place = trial.sensor if trial.sensor_v is None else trial.sensor_v
    exact = (np.exp(-np.outer(t, sigma)) * swing * q) @ modes.shapes(s, 60, np.array([place]))[0]
    assert motion.across_m is not None and motion.contact_step.size == 0
    assert np.abs(motion.across_m - exact).max() < 1e-6 * np.abs(exact).max()
