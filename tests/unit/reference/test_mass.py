"""A mass that strikes the brute-force string (thumb): against its equations of motion, and as a slap."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from support import strings
from support.modal import modal

from livebass.lab.reference import playing
from livebass.lab.reference.hands import Mass
from livebass.lab.reference.playing import Played, play
from livebass.model.instrument import Pluck, for_modes, speaking
from livebass.model.trial import Trial, initial_amplitudes
from livebass.preset.load import load_preset
from livebass.rows.arrays import Floats


def growth(time: Floats) -> Floats:
    """A force (N) that grows smoothly from 2 to 6 ms, to show the order of convergence."""
    return 6 * np.sin(math.pi / 2 * np.clip((time - 2e-3) / 4e-3, 0, 1)) ** 2


THUMB = Mass(0.2, 1.5, mass=8e-3, stiffness=3e5, height=4e-3, width=4e-3, loss=0.5, force=growth)


def equations_of_motion(trial: Trial, thumb: Mass, step: float, every: int) -> tuple[Floats, Floats]:
    """u at the sensor and the mass's height every `every` steps, by Runge-Kutta, with frets and both losses."""
    s, count = trial.speaking, trial.modes
    string = modal(s, count, trial.lossless)
    frets = np.array([string.shape(x) for x in s.contact_position]).reshape(-1, count)
    crowns, hard = np.asarray(s.contact_height), s.contact_stiffness * s.step
    row, hand = string.shape(thumb.place, thumb.width), thumb.force
    assert thumb.height is not None and hand is not None
    square = string.natural**2

    def slope(time: float, y: Floats) -> Floats:
        q, v, z, w = y[:count], y[count:-2], y[-2], y[-1]
        fret = hard * np.maximum(crowns - frets @ q, 0) ** s.contact_exponent
        eta, eta_t = row @ q - z, row @ v - w
        touch = thumb.stiffness * max(eta, 0.0) ** thumb.exponent * max(1 + thumb.loss * eta_t, 0.0)
        force = fret @ frets - touch * row
        free = -square * q - 2 * string.sigma * v
        up = (touch + float(hand(np.array([time]))[0])) / thumb.mass
        return np.concatenate([v, free + force / string.density, [w, up]])

    y = np.concatenate([initial_amplitudes(trial), np.zeros(count), [thumb.height, -thumb.speed]])
    sensor, heard = string.shape(trial.sensor), []
    for n in range(every * (trial.samples - 1) + 1):
        if n % every == 0:
            heard.append((sensor @ y[:count], y[-2]))
        t = n * step
        k1 = slope(t, y)
        k2 = slope(t + step / 2, y + step / 2 * k1)
        k3 = slope(t + step / 2, y + step / 2 * k2)
        k4 = slope(t + step, y + step * k3)
        y = y + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    u, z = np.array(heard).T
    return u, z


@pytest.mark.parametrize("loss", [0.0, 0.5])
def test_string_mass_and_frets_move_by_their_equations(loss: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The thumb presses the string on soft frets and bounces off; of second order in the time step."""
    monkeypatch.setattr(playing, "YIELDING", 0)  # as many equations as the string has modes

    def trial(rate: float) -> Trial:
        trial = strings.tiny(contact_rate=rate, output_rate=1e4, duration=8e-3, stiffness=1e8, lossless=True)
        return dataclasses.replace(trial, pluck=Pluck(1e-3, 0.2))

    thumb = dataclasses.replace(THUMB, loss=loss)
    u, z = equations_of_motion(trial(1e5), thumb, 1e-6, 100)
    errors, heights = [], []
    for rate in (2e5, 4e5, 8e5, 32e5):
        played = play(trial(rate), [thumb])
        errors.append(np.abs(played.displacement_m[0] - u).max() / np.abs(u).max())
        heights.append(np.abs(played.hand_height_m[0] - z).max() / np.abs(z).max())
    assert played.hand_force_n.min() < -1 and played.contact_step.size and played.hand_height_m[0, -1] > 0
    assert errors[-1] < 1e-5 and heights[-1] < 1e-6, (errors, heights)
    for coarse, fine in (*pairwise(errors[:3]), *pairwise(heights[:3])):
        assert 3.8 < coarse / fine < 4.2, (errors, heights)


def test_a_mass_that_meets_nothing_flies_as_it_is_thrown() -> None:
    trial = strings.tiny(contact_rate=4e5, output_rate=1e4)
    mass = Mass(0.1, 0.5, height=30e-3, start=1e-3, end=9e-3, force=lambda time: np.full(time.shape, -0.2))
    played = play(trial, [mass])
    time = played.time_s - 1e-3
    there = (time >= 0) & (time < 8e-3)
    flight = 30e-3 - 0.5 * time - 0.2 / 0.03 * time**2 / 2
    np.testing.assert_allclose(played.hand_height_m[0, there], flight[there], rtol=0, atol=1e-7)
    assert np.isnan(played.hand_height_m[0, ~there]).all()
    still = play(trial, [])
    np.testing.assert_array_equal(played.displacement_m, still.displacement_m)
    assert played.balance.put_in_j[0, 50] == pytest.approx(
        0.03 / 2 * 0.5**2 + 0.2 * (30e-3 - played.hand_height_m[0, 50]), rel=1e-3
    )


def slap(speed: float, modes: int = 400, rate: float = 384e3, lossless: bool = False, **values: float) -> Played:
    """A thumb of 30 g on the resting E string, at 0.7 of its length, 2.5 mm beyond the last frets."""
    bass = load_preset("slap-impulse")
    i = bass.string_index("E")
    s = for_modes(speaking(bass.strings[i], bass.necks[i], 0), modes)
    trial = Trial(s, Pluck(0.0, 0.5), modes, rate, 48000.0, 0.03, s.length - 0.15, lossless)
    return play(trial, [Mass(0.7 * s.length, speed, **values)])


@pytest.mark.parametrize("speed, minimum, maximum, force", [(2.0, 6.0, 6.5, 30), (3.5, 5.2, 5.7, 60)])
def test_a_thumb_is_on_the_string_for_some_milliseconds(
    speed: float, minimum: float, maximum: float, force: float
) -> None:
    """It presses the string on the frets, and leaves by itself, as fast as it can."""
    played = slap(speed)
    pressing = -played.hand_force_n[0]
    touching = np.flatnonzero(pressing > 0) / 48
    assert minimum < touching[-1] < maximum and touching[0] < 0.1
    assert np.diff(touching).max() < 0.03, "one contact"
    assert pressing.max() == pytest.approx(force, rel=0.03)
    assert played.contact_step.size > 50
    leaves = np.diff(played.hand_height_m[0])[-1] * 48000
    assert 0.6 * speed < leaves < 0.8 * speed
    assert played.balance.error < 1e-11
    taken = played.balance.taken_j[0, -1] / played.balance.put_in_j[0, -1]
    assert 0.05 < taken < 0.15


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 3.5])
def test_a_slap_does_not_hang_on_modes_and_rate(speed: float) -> None:
    coarse, fine = slap(speed), slap(speed, 600, 3.84e6)
    a, b = (-played.hand_force_n[0] for played in (coarse, fine))
    assert np.flatnonzero(a)[-1] == pytest.approx(np.flatnonzero(b)[-1], abs=3)
    assert a.max() == pytest.approx(b.max(), rel=0.01)
    energies = [played.balance.string_j[-1] for played in (coarse, fine)]
    assert energies[0] == pytest.approx(energies[1], rel=0.03)


def test_without_loss_nothing_is_taken() -> None:
    played = slap(2.5, lossless=True, loss=0.0)
    balance = played.balance
    assert balance.error < 1e-12
    assert not balance.taken_j.any() and balance.damping_j[-1] < 0.03 * balance.put_in_j[0, -1]
    assert 0.38 < balance.string_j[-1] / balance.put_in_j[0, -1] < 0.47


def test_a_softer_thumb_presses_less() -> None:
    forces = [-slap(2.0, stiffness=k).hand_force_n.min() for k in (7e5, 7e3, 7e1, 0.0)]
    assert forces[0] > forces[1] > forces[2] > forces[3] == 0
