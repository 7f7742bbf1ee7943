"""A dashpot on the brute-force string against the eigenvalues of the continuous system."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
import scipy.integrate
from support import strings
from support.costs import slow
from support.modal import Modal, bare_string, from_rest, modal

from livebass.lab.reference.hands import Finger
from livebass.lab.reference.playing import hand_shape, play
from livebass.model.instrument import Pluck, on_grid
from livebass.model.trial import Trial, initial_amplitudes
from livebass.rows.arrays import Floats

SECONDS = 0.02


def damp(s: Modal, fingers: list[Finger]) -> Floats:
    """d/dt (q, v) of a string under permanent fingers."""
    rows = [s.shape(finger.place, finger.width) for finger in fingers]
    damping = sum(finger.resistance * np.outer(row, row) for finger, row in zip(fingers, rows, strict=True))
    return s.matrix(np.asarray(damping), np.zeros((s.k.size, s.k.size)))


def settle(place: float, resistance: float, width: float = 5e-3) -> Finger:
    """A finger that lies on the string from the first step on."""
    return Finger(place, resistance, width, landing=0.0)


def tiny(rate: float) -> Trial:
    return strings.tiny(contact_rate=rate, output_rate=1e4, duration=SECONDS, lossless=True)


@pytest.mark.parametrize(
    "fingers",
    [
        [settle(0.15, 0.3)],
        [settle(0.15, 3.0, 0.0)],
        [settle(0.07, 30.0)],
        [settle(0.288, 1.0), settle(0.275, 1.0), settle(0.262, 1.0)],
    ],
    ids=["node", "point", "firm", "palm"],
)
@pytest.mark.usefixtures("discrete")
def test_the_motion_is_that_of_the_continuous_system(fingers: list[Finger]) -> None:
    """Of second order in the time step, and within 2e-5 of the peak at 1.6 MHz, without other losses."""
    s = modal(tiny(1e5).speaking, 23, lossless=True)
    matrix, times = damp(s, fingers), np.arange(tiny(1e5).samples) / 1e4
    errors = []
    for rate in (1e5, 2e5, 4e5, 16e5):
        played = play(tiny(rate), fingers, frets=False)
        exact = from_rest(s, matrix, initial_amplitudes(tiny(rate)), 1 / rate, times)
        u, velocity = (part @ s.shape(0.28) for part in exact)
        errors.append(np.abs(played.displacement_m[0] - u).max() / np.abs(u).max())
    assert np.abs(played.velocity_m_s[0] - velocity).max() < 1e-4 * np.abs(velocity).max()
    assert errors[-1] < 2e-5, errors
    for coarse, fine in pairwise(errors[:3]):
        assert 3.5 < coarse / fine < 4.5, errors


@pytest.mark.parametrize("resistance", [slow(0.5), 2.0, 8.0])
@pytest.mark.usefixtures("discrete")
def test_modes_decay_as_the_eigenvalues_say(resistance: float) -> None:
    """The first 5 eigenmodes of a G string under a finger at its third, each released alone."""
    count, rate = 60, 4e5
    s = on_grid(bare_string(), count + 1)
    finger = settle(s.length / 3.1, resistance)
    string = modal(s, count)
    values, vectors = np.linalg.eig(damp(string, [finger]))
    slowest = [k for k in np.argsort(values.imag) if values[k].imag > 0][:5]
    for k in slowest:
        trial = Trial(s, Pluck(0.0, s.length / 2), count, rate, 8000.0, 0.01, s.length / 5, states=(80,))
        amplitude = 1e-3 / np.abs(vectors[:count, k]).max()
        state = amplitude * vectors[:, k]
        begin = string.after(*np.split(state.real, 2), 0.5 / rate)  # the finger's first force acts from -dt / 2 on
        played = play(trial, [finger], frets=False, begin=np.array([begin]))
        assert played.states is not None
        expected = (state * np.exp(values[k] * (0.01 + 0.5 / rate))).real[:count]
        minimum = 0.1 * amplitude * np.abs(vectors[:count, k]).max()
        error = np.abs(played.states[0, 0, 0] - expected).max() / max(np.abs(expected).max(), minimum)
        assert error < 1e-3, f"{values[k]:.1f}: {error:.1e}"


def test_a_finger_takes_what_it_resists() -> None:
    """The energy taken is the integral of R times the square of the velocity under the finger."""
    finger = Finger(0.1, 2.0, width=0.02, start=2e-3, end=12e-3, landing=3e-3, lifting=5e-3)
    trial = strings.tiny(contact_rate=4e5, output_rate=1e5, duration=SECONDS)
    trial = dataclasses.replace(trial, states=tuple(range(trial.samples)))
    played = play(trial, [finger], frets=False)
    assert played.states is not None
    under = played.states[:, 0, 1] @ hand_shape(trial, finger, trial.modes)
    power = finger.resistances(played.time_s) * under**2
    assert played.balance.taken_j[0, -1] == pytest.approx(scipy.integrate.trapezoid(power, played.time_s), rel=1e-3)
    force = -finger.resistances(played.time_s) * under
    np.testing.assert_allclose(played.hand_force_n[0], force, rtol=0, atol=5e-3 * np.abs(force).max())
    assert not played.hand_force_n[0, played.time_s < 2e-3].any()
    assert not played.hand_force_n[0, played.time_s > 17.1e-3].any()


def test_a_firm_finger_clamps_and_a_wide_one_spares_short_waves() -> None:
    def left(resistance: float, width: float) -> Floats:
        trial = strings.tiny(contact_rate=4e5, output_rate=1e4, duration=SECONDS)
        return play(trial, [settle(0.1, resistance, width)], frets=False).balance.stored_j[[0, -1]]

    soft, firm, clamped = (left(r, 1e-3)[1] for r in (0.01, 1.0, 1e4))
    assert firm < soft and firm < clamped
    trial = strings.tiny()
    shape = hand_shape(trial, settle(0.1, 1.0, 0.02), 23)
    assert np.abs(shape[20:]).max() < 1e-3 * np.abs(shape).max()


@pytest.mark.parametrize("fret, kept", [(12, 2), (7, 3), (5, 4)])
def test_a_finger_on_a_node_leaves_its_harmonic(fret: int, kept: int) -> None:
    """Every `kept`-th partial rings on under a finger at L / `kept`; the others are 40 dB down after 60 ms."""
    s = bare_string()
    trial = Trial(s, Pluck(3e-3, 0.77 * s.length), 100, 4e5, 1000.0, 0.06, s.length / 5, states=(0, 60))
    finger = Finger(s.length / kept, 1.2, width=4e-3, landing=5e-3)
    states = play(trial, [finger], frets=False).states
    assert states is not None
    energy = (states[:, 0, 1] / (2 * np.pi * 98 * np.arange(1, 101))) ** 2 + states[:, 0, 0] ** 2
    change = 10 * np.log10(energy[1] / energy[0])[: 2 * kept]
    rings = np.arange(1, 2 * kept + 1) % kept == 0
    assert change[rings].min() > -2 and change[~rings].max() < -40, change
