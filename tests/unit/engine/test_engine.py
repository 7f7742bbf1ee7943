"""The engine against brute force: the same contacts at the same steps, the same motion; and its energy."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from support.agreement import assert_agree
from support.costs import quick
from support.motion import energies
from support.strings import case_b, oblique, random_trial

from livebass import load_preset
from livebass.engine.solve import solve_trial
from livebass.model import modes
from livebass.model.instrument import speaking
from livebass.model.trial import Trial


def test_case_b_at_8_mhz() -> None:
    trial = case_b(duration=0.06)
    assert_agree(trial, "case B")
    assert solve_trial(trial).contact_step.size > 200


def test_case_b_hits_the_frets_of_the_paper_in_time() -> None:
    """First contact at fret 12 after 3.8 to 4.0 ms; frets 1 to 12 in the first set, 2 to 11 in the second."""
    motion = solve_trial(case_b(duration=0.2))
    time, fret = motion.contact_step / 8e6, motion.contact_index + 1
    assert fret[0] == 12
    assert 3.8e-3 < time[0] < 4.0e-3
    assert set(fret[time < 9e-3]) == set(range(1, 13))
    second = (time > 9e-3) & (time < 18e-3)
    assert {min(fret[second]), max(fret[second])} == {2, 11}
    assert time[-1] < 0.15


def fives(first: int, quick: int, end: int) -> list[Any]:
    """The first seed of each group of five from `first` to `end`; groups from `quick` on are slow tests."""
    return [pytest.param(k, marks=[pytest.mark.slow] if k >= quick else []) for k in range(first, end, 5)]


@pytest.mark.parametrize("first", fives(0, 10, 130))
def test_random_setups(first: int) -> None:
    """Of five motions at most one is chaotic, and even that is predictable for a tenth of its length."""
    regular = [assert_agree(random_trial(seed), f"seed {seed}", minimum=0.1) for seed in range(first, first + 5)]
    assert sum(regular) >= 4


PLAYED = (
    "slap", "precision-pick", "jazz-finger", "flatwound", "short-scale", "six-string", "five-string-active",
    "precision-finger", "jazz-bright", "muted",
)  # fmt: skip


def played_trial(seed: int) -> Trial:
    """A seeded pluck of a preset that people play: string, fret, place, angle and rates at random."""
    rng = np.random.default_rng(seed)
    bass = load_preset(PLAYED[seed % len(PLAYED)])
    i, fret = int(rng.integers(len(bass.strings))), int(rng.integers(0, 20))
    s = speaking(bass.strings[i], bass.necks[i], fret)
    place = s.length * rng.uniform(0.6, 0.95)
    apex = min(modes.grazing_apex(s, place) * rng.uniform(1.2, 4), 0.008)
    pluck = modes.Pluck(apex, place, rng.uniform(3e-3, 8e-3), angle=rng.uniform(-1.2, 1.2))
    count = int(rng.integers(60, min(220, s.grid_points - 1)))
    output = float(rng.choice([44100.0, 48000.0, 96000.0, 192000.0]))
    minimum = max(float(rng.choice([1e6, 2e6])), 2.1 * modes.frequencies(s, count)[-1])
    rate = output * np.ceil(minimum / output)
    return Trial(s, pluck, count, rate, output, 0.02, s.length * rng.uniform(0.85, 0.98))


@pytest.mark.parametrize("seed", quick(range(60), range(10)))
def test_random_plucks_of_presets(seed: int) -> None:
    """With turned axes, losses, friction and dead spots, as presets have them; most hit frets. Within a millionth."""
    assert_agree(played_trial(seed), f"seed {seed}", minimum=0.1, within=1e-6, touches=False)


def heard_across(trial: Trial, angle: float, apex: float, **friction: float) -> Trial:
    """`trial` plucked at `angle` (rad), sensed across 30 mm from the saddle, with other values of `friction`."""
    speaking = dataclasses.replace(trial.speaking, **friction)
    return dataclasses.replace(oblique(trial, angle, apex), speaking=speaking, sensor_v=speaking.length - 0.03)


def test_oblique_pluck_of_the_paper_at_8_mhz() -> None:
    """Section 4.1.3 of the paper: 3.1 mm up, 2.2 mm across."""
    trial = heard_across(case_b(duration=0.02), np.arctan2(2.2, 3.1), np.hypot(3.1e-3, 2.2e-3))
    assert_agree(trial, "3.1 mm and 2.2 mm")


@pytest.mark.parametrize("first", fives(1, 6, 31))
def test_random_setups_with_friction(first: int) -> None:
    for seed in range(first, first + 5):
        trial, rng = random_trial(seed, 0.02), np.random.default_rng(seed)
        law = {"friction": 10 ** rng.uniform(1, 3.5), "friction_speed": 10 ** rng.uniform(-6, -2)}
        assert_agree(heard_across(trial, rng.uniform(0.1, 1.0), trial.pluck.apex, **law), f"seed {seed}")


def test_energy_is_constant_without_losses() -> None:
    values, pushed = energies(case_b(duration=0.05, lossless=True, output_rate=50000))
    assert pushed > 20
    assert np.max(np.abs(values / values[0] - 1)) < 1e-10


@pytest.mark.parametrize("modes", [862, 400])
def test_energy_never_rises_with_losses(modes: int) -> None:
    rate = 8e6 if modes == 862 else 800e3
    values, pushed = energies(case_b(modes, rate, duration=0.05, output_rate=50000))
    assert pushed > 20
    assert np.max(np.diff(values)) <= 1e-13 * values[0]
    assert values[-1] < 0.9 * values[0]


def test_modal_states_are_those_of_the_displacement() -> None:
    """Asking for states leaves the motion alone; their sum at the sensor is the displacement and its velocity."""
    trial = oblique(case_b(862, 84 * 96e3, 8e-3, 96e3), 0.6, 3.6e-3)
    requested = dataclasses.replace(trial, states=(0, 1, 333, 766, 767, 768))
    plain, motion = solve_trial(trial), solve_trial(requested)
    assert np.array_equal(plain.displacement_m, motion.displacement_m) and plain.states is None
    assert motion.states is not None and motion.across_m is not None
    assert motion.states.shape == (6, 2, 2, trial.modes)
    sensor = modes.shapes(trial.speaking, trial.modes, np.array([trial.sensor]))[0]
    seen = motion.states @ sensor
    for k, moved in enumerate((motion.displacement_m, motion.across_m)):
        assert np.abs(seen[:, k, 0] - moved[list(requested.states)]).max() < 1e-6 * np.abs(moved).max()
        before, after = moved[332], moved[334]  # before any contact: smooth enough to differentiate
        assert seen[2, k, 1] == pytest.approx((after - before) * 96000 / 2, rel=0.02)
    with pytest.raises(ValueError, match="sample"):
        solve_trial(dataclasses.replace(trial, states=(10**6,)))
