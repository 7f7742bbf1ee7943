"""Lossy contact: engine and brute force agree, energy only falls, and no result depends on grid or tier."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from support.agreement import assert_agree
from support.costs import quick
from support.motion import energies
from support.quiet import without_noise
from support.strings import case_b, g_neck, g_string, losing, oblique, random_trial, with_own_across

from livebass.engine.solve import solve_trial
from livebass.kernels.string.records import MAX_NEAR
from livebass.lab.reference.solver import solve
from livebass.model.instrument import Pluck, speaking
from livebass.model.quality import QUALITIES, quality_with
from livebass.model.trial import Trial
from livebass.rows.arrays import Floats

# K, SI; c, s/m; share of the energy left after 80 ms of case B, which has no other loss
LEFT = (
    (1e13, 0.01, 0.990), (1e13, 3.0, 0.806), (1e11, 10.0, 0.632), (1e10, 30.0, 0.519), (1e9, 100.0, 0.452),
    (3e8, 50.0, 0.378), (1e8, 100.0, 0.385), (1e8, 1e5, 0.684),
)  # fmt: skip
LOSSES = tuple(pair[:2] for pair in LEFT[1:-1])


@pytest.mark.parametrize(("stiffness", "loss"), quick(LOSSES, [LOSSES[0], LOSSES[-1]]))
def test_engine_and_brute_force_agree(stiffness: float, loss: float) -> None:
    trial = losing(case_b(duration=0.015), stiffness, loss)
    assert assert_agree(trial, f"K {stiffness:g}, c {loss:g}"), "contact that loses is not chaotic"
    slant = losing(oblique(case_b(duration=0.012), 0.7, 5e-3), stiffness, loss)
    assert_agree(slant, f"K {stiffness:g}, c {loss:g}, oblique", minimum=0.5)


def random_losing_trial(seed: int) -> Trial:
    """A random string over frets of K 1e8 to 1e13 with K c of 1e9 to 1e11 (SI)."""
    rng = np.random.default_rng(seed)
    stiffness = 10 ** rng.uniform(8, 13)
    return losing(random_trial(seed, 0.02), stiffness, 10 ** rng.uniform(9, 11) / stiffness)


@pytest.mark.parametrize("seed", quick(range(60), range(0, 10, 5)))
def test_random_losses(seed: int) -> None:
    """With friction, and with an own law for v."""
    trial, rng = random_losing_trial(seed), np.random.default_rng(seed)
    assert_agree(trial, f"seed {seed}", minimum=0.1)
    law = {"friction": 10 ** rng.uniform(1, 3.5), "friction_speed": 10 ** rng.uniform(-6, -2)}
    s = dataclasses.replace(with_own_across(trial.speaking), **law)
    trial = oblique(dataclasses.replace(trial, speaking=s), rng.uniform(0.2, 1.2), 1.5 * trial.pluck.apex)
    assert_agree(trial, f"seed {seed}, v of its own", minimum=0.1, touches=False)


@pytest.mark.parametrize(("stiffness", "loss", "left"), quick(LEFT, LEFT[::6]))
def test_frets_only_take_energy(stiffness: float, loss: float, left: float) -> None:
    trial = losing(case_b(duration=0.08, lossless=True, contact_rate=2e6), stiffness, loss)
    motion = solve(trial, energy_every=4)
    assert motion.energy_j is not None and motion.contact_step.size > 0
    assert np.max(np.diff(motion.energy_j)) <= 1e-12 * motion.energy_j[0]
    assert motion.energy_j[-1] / motion.energy_j[0] == pytest.approx(left, abs=0.02)


@pytest.mark.parametrize("seed", quick(range(0, 40, 4), range(0, 40, 16)))
def test_energy_never_rises_on_random_strings(seed: int) -> None:
    """Not even at the cut-off: a string that returns faster than the fret is free of it."""
    rng = np.random.default_rng(seed)
    trial = random_losing_trial(seed)
    s = dataclasses.replace(with_own_across(trial.speaking), contact_loss=10 ** rng.uniform(-2, 5))
    trial = oblique(dataclasses.replace(trial, speaking=s), rng.uniform(0.2, 1.2), 1.5 * trial.pluck.apex)
    energy = solve(trial, energy_every=4).energy_j
    assert energy is not None and np.max(np.diff(energy)) <= 1e-13 * energy[0]


@pytest.mark.parametrize("modes", [862, 400])
@pytest.mark.parametrize(("stiffness", "loss"), [(1e13, 3.0), (3e8, 50.0), (1e8, 1e4)])
def test_energy_never_rises_in_the_engine(stiffness: float, loss: float, modes: int) -> None:
    trial = losing(case_b(modes, 8e6 if modes == 862 else 800e3, duration=0.05, output_rate=50000), stiffness, loss)
    for played in (trial, oblique(dataclasses.replace(trial, speaking=with_own_across(trial.speaking)), 0.6, 5e-3)):
        values, pushed = energies(played)
        assert pushed > 20
        assert np.max(np.diff(values)) <= 1e-13 * values[0]
        assert values[-1] < 0.8 * values[0]


# ---- a property of the fret


def pluck(step: float, stiffness: float, loss: float = 50.0) -> Floats:
    """u (n,) over frets pushing on `step` (m) of string with K and c (s/m), which 15 N s/m must imply."""
    neck = dataclasses.replace(g_neck(stiffness), grid_step=step, contact_loss=15.0 * loss / 50.0)
    assert neck.loss == pytest.approx(loss * 3e8 * 1e-3 / (stiffness * step), rel=1e-12)
    trial = dataclasses.replace(case_b(200, 4e6, duration=0.04), speaking=speaking(g_string(), neck, 0))
    return solve_trial(trial).displacement_m


def apart(a: Floats, b: Floats) -> float:
    """The root mean square difference of two motions, relative to the second."""
    return float(np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2)))


def test_a_fret_loses_alike_on_every_grid() -> None:
    """A fret with a given K dx and loss, whatever string length it pushes on; every grid contains all frets."""
    default = pluck(0.5e-3, 6e8)
    for step in (0.25e-3, 1e-3):
        assert apart(pluck(step, 3e8 * 1e-3 / step), default) < 3e-4, step
        assert apart(pluck(step, 6e8), default) > 0.03, "another fret"
    assert apart(pluck(0.5e-3, 6e8, loss=25.0), default) > 0.1


@pytest.mark.parametrize(("stiffness", "exponent"), [(1e13, 1.5), (3e8, 1.5), (1e10, 1.0), (1e10, 2.3)])
def test_contact_loss_is_the_resistance_at_a_tenth_of_a_millimetre(stiffness: float, exponent: float) -> None:
    neck = dataclasses.replace(g_neck(stiffness), contact_exponent=exponent, contact_loss=7.0)
    s, pressed, speed = speaking(g_string(), neck, 0), 1e-4, 1e-3
    force = s.contact_stiffness * pressed**exponent * s.step  # N
    assert s.step == pytest.approx(neck.grid_step, rel=1e-3)
    assert force * s.contact_loss * speed == pytest.approx(7.0 * speed, rel=2e-3)


def far_from_reference(stiffness: float, loss: float) -> list[float]:
    """dB between 450 modes at 672 kHz and all modes at 8 MHz, for waveforms of hard plucks of the paper's G."""
    found = []
    for fret in (0, 2, 5, 9):
        s = speaking(g_string(), dataclasses.replace(g_neck(stiffness), contact_loss=loss), fret)
        pluck = Pluck(4e-3, 0.75 * s.length, 7e-3)
        few, all_modes = round(450 * s.length / s.string.length), s.grid_points - 1
        coarse, fine = (
            solve_trial(Trial(s, pluck, n, rate, 48_000.0, 0.3, s.length - 0.09)).displacement_m
            for n, rate in ((few, 672e3), (all_modes, 8.016e6))
        )
        found.append(20 * math.log10(apart(coarse, fine)))
    return found


def test_contact_that_loses_needs_few_modes_and_steps() -> None:
    """Stiff lossless frets are chaotic: at another rate the same pluck moves differently."""
    assert max(far_from_reference(3e8, 15.0)) < -50.0  # -57 to -62
    assert min(far_from_reference(1e13, 0.0)) > -30.0  # -16 to -21


def test_the_loss_says_how_finely_contact_is_computed() -> None:
    """The string of least loss decides: lossless boards need all modes and megahertz; lossy contact ends soon."""
    bass, live = without_noise("fretless"), QUALITIES["live"]
    for loss, modes, rate in ((0.0, None, 2.5e6), (1.0, 450, 672e3), (45.0, 450, 240e3)):
        last = dataclasses.replace(bass.necks[-1], contact_loss=loss)
        assert last.loss == pytest.approx(loss / 2.0)  # 2e9 on a grid of 1 mm, here 0.1 mm
        other = dataclasses.replace(bass, necks=(*bass.necks[:-1], last))
        assert other.loss == last.loss and other.over_board
        quality = live.for_contact(other.loss, board=True)
        assert (quality.name, quality.modes, quality.contact_rate) == ("live", modes, rate)
        assert len(speaking(bass.strings[-1], last, 0).contact_fret) > MAX_NEAR
    for name, rate in (("fretless", 240e3), ("upright", 240e3), ("slap", 336e3), ("muted", 336e3), ("paper-g", 672e3)):
        bass = without_noise(name)
        assert live.for_contact(bass.loss, bass.over_board).contact_rate == rate
    assert quality_with("live", contact_rate=400e3).for_contact(22.5, board=True).contact_rate == 400e3
    studio, reference = QUALITIES["studio"], QUALITIES["reference"]
    assert [studio.for_contact(22.5, board).contact_rate for board in (False, True)] == [1.344e6, 672e3]
    assert studio.for_contact(0.0, board=False) == studio
    assert reference.for_contact(22.5, board=True) == reference.for_contact(22.5, board=False) == reference
