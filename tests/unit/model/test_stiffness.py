"""The two laws of bending stiffness, tested on a string of beams: partials, losses and the shape held by a finger."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.costs import quick
from support.own_basses import load_preset
from support.strings import g_neck, g_string

from livebass import preset_names
from livebass.model.instrument import Pluck, Speaking, speaking
from livebass.model.modes import dampings, frequencies, loss_factor, pluck_amplitudes
from livebass.model.neck import Admittance
from livebass.rows.units import cents


def low_e(law: str, fret: int = 0) -> Speaking:
    """The E of jazz-finger on a rigid neck."""
    bass = load_preset("jazz-finger")
    string = replace(bass.strings[0], stiffness_law=law)
    return speaking(string, replace(bass.necks[0], admittance=Admittance()), fret)


@pytest.mark.parametrize("name", preset_names())
def test_only_the_papers_own_presets_have_its_law(name: str) -> None:
    laws = {string.stiffness_law for string in load_preset(name).strings}
    assert laws == {"paper" if name.startswith("paper-") else "hinged"}


def beam(s: Speaking, nodes: int = 800) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Finite differences of a stiff string on hinges: x (m), T k^2 and E I k^4 as matrices, N/m."""
    step = s.length / nodes
    tension = 4 * s.string.linear_density * (s.length * s.fundamental) ** 2  # N, from the tuned f0
    bending = s.inharmonicity * tension * s.length**2 / math.pi**2  # N m^2
    second = (np.diag(np.full(nodes - 2, 1.0), 1) + np.diag(np.full(nodes - 2, 1.0), -1) - 2 * np.eye(nodes - 1)) / step
    return np.arange(1, nodes) * step, -tension * second, bending / step * second @ second


@pytest.mark.parametrize("fret", quick([0, 7, 19], [7]))
def test_partials_and_losses_of_a_stiff_string(fret: int) -> None:
    """Eigenvalues of the beam, and the bending share of a mode's elastic energy."""
    s = low_e("hinged", fret)
    x, pulled, bent = beam(s)
    mass = s.string.linear_density * (x[1] - x[0])
    square, shape = np.linalg.eigh((pulled + bent) / mass)
    nu = np.sqrt(square[:40]) / (2 * math.pi)
    np.testing.assert_allclose(frequencies(s, 40), nu, rtol=2e-3)  # the beam's step causes 0.18 %
    angle = replace(s, thermoelastic=0.0, viscoelastic_angle=0.02)
    none = replace(s, thermoelastic=0.0, viscoelastic_angle=0.0)
    lost = loss_factor(angle, frequencies(s, 40)) - loss_factor(none, frequencies(s, 40))
    part = np.einsum("ij,ik,kj->j", shape[:, :40], bent, shape[:, :40]) / (mass * square[:40])
    np.testing.assert_allclose(lost, 0.02 * part, rtol=2e-2)
    assert part[-1] > 0.1 or fret == 0


@pytest.mark.parametrize("fret", [0, 7, 19])
def test_held_shape_of_a_stiff_string(fret: int) -> None:
    """The static shape under a force at one point, by solving the beam."""
    s = low_e("hinged", fret)
    x, pulled, bent = beam(s)
    at = 600
    force = np.zeros(x.size)
    force[at] = 1.0
    bow = np.linalg.solve(pulled + bent, force)
    q = pluck_amplitudes(s, 3000, Pluck(1.0, float(x[at]), 1e-9))
    k = np.arange(1, 3001) * math.pi / s.length
    made = np.sin(np.outer(x, k)) @ q * math.sqrt(2 / s.length)
    apex = float(np.linalg.solve(pulled, force)[at])  # of the triangle under the same force
    np.testing.assert_allclose(made * apex, bow, atol=2e-3 * apex)
    assert made.max() < 0.995


def test_the_figures_that_the_handbook_gives() -> None:
    """The paper's law compared with the stiff string on an E: partials in cents, plucks in dB."""
    stiff, paper = low_e("hinged"), low_e("paper")
    nu, fit = frequencies(stiff, 200), frequencies(paper, 200)
    for hertz, sharp in ((2000, 16), (3000, 44), (5000, 117)):
        j = int(np.argmin(np.abs(fit - hertz)))
        assert cents(fit[j] / nu[j]) == pytest.approx(sharp, rel=0.02), hertz
    pluck = Pluck(1e-3, 0.6, 7e-3)
    part = 20 * np.log10(np.abs(pluck_amplitudes(paper, 200, pluck) / pluck_amplitudes(stiff, 200, pluck)))
    for hertz, bright in ((2000, 2.4), (4000, 5.5), (8000, 9.9)):
        assert part[np.argmin(np.abs(nu - hertz))] == pytest.approx(bright, abs=0.2), hertz


def test_the_highest_modes_are_lower() -> None:
    assert frequencies(low_e("paper"), 400)[-1] > 249e3 and frequencies(low_e("hinged"), 400)[-1] < 90e3


def test_the_papers_string_keeps_its_law() -> None:
    """Eqs. 8 and 11 as printed, and a triangle."""
    s = speaking(replace(g_string(), measured_frequencies=(), measured_dampings=()), g_neck(), 0)
    j = np.arange(1, 863)
    np.testing.assert_allclose(frequencies(s, 862), j * 97.976 * (1 + 3.5e-5 * j**2 / 2), rtol=1e-14)
    assert dampings(s, 862)[-1] == pytest.approx(55176, rel=1e-3)  # published
    k = j * math.pi / s.length
    q = pluck_amplitudes(s, 862, Pluck(1e-3, 0.64, 0.0))
    triangle = math.sqrt(2 / s.length) * 1e-3 * s.length / (0.64 * 0.223) * np.sin(k * 0.64) / k**2
    np.testing.assert_allclose(q, triangle, rtol=1e-9)
