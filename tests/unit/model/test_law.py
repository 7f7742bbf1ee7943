"""The modes follow their laws, written out again: eqs. 8 to 11 as printed, or string and neck as one system.

Both with the loss of a standard linear solid.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.own_basses import load_preset
from support.strings import g_neck, g_string

from livebass.model.instrument import Neck, String, speaking
from livebass.model.modes import dampings, frequencies
from livebass.model.neck import Admittance, Resonance

VISCOSITY, AIR = 1.8e-5, 1.2  # kg/m/s, kg/m3
PAPER_LENGTH = 0.863  # m, of the string with 800 published dampings
NECK = Admittance((Resonance(70.0, 6.0, 2.0), Resonance(312.0, 20.0, 0.5)), stop=0.0)


def g(law: str) -> tuple[String, Neck]:
    """The measured G string on a neck that yields, by the law alone."""
    string = replace(g_string(), measured_frequencies=(), measured_dampings=(), law_fundamental=0.0)
    string = replace(string, stiffness_law=law, extra_damping=0.7, extra_damping_slope=1e-4)
    string = replace(string, relaxation=3e-3, relaxation_frequency=1700.0)
    return string, replace(g_neck(), admittance=NECK, stop_conductance=1e-4)


@pytest.mark.parametrize("law", ["hinged", "paper"])
@pytest.mark.parametrize("fret", [0, 7])
def test_frequencies_and_dampings_follow_their_law(law: str, fret: int) -> None:
    """The law "paper" as printed, with Y at real frequencies; "hinged" with Y at the frequency and decay of the mode.

    The latter fulfils s = s_j - 2 f0 mu c (1 + B j^2) Y(s), but for its stop, which adds to the string's own loss.
    """
    string, neck = g(law)
    s, count = speaking(string, neck, fret), 850
    j, f0, mu, c = np.arange(1, count + 1), s.fundamental, string.linear_density, 2 * s.length * s.fundamental
    b = string.inharmonicity * (string.length / s.length) ** 2
    rigid = 1 + b * j**2 / 2 if law == "paper" else np.sqrt(1 + b * j**2)
    nu = j * f0 * rigid
    if law == "paper":
        nu -= f0 * mu * c / math.pi * s.admittance.at(j * f0).imag
    at = np.minimum(j, math.floor(800 * s.length / PAPER_LENGTH)) * f0 if law == "paper" else j * f0 * rigid
    friction = 2 * math.pi * VISCOSITY + 2 * math.pi * string.diameter * np.sqrt(math.pi * VISCOSITY * AIR * at)
    stiffness = math.pi**2 * string.tension**-2 * mu * s.bending * 4 * at**2
    if law == "hinged":  # the bending share of a mode's elastic energy
        stiffness = 1 - 1 / ((np.sqrt(1 + 4 * stiffness) + 1) / 2)
    quality = friction / (2 * math.pi * mu * at) + string.viscoelastic_angle * stiffness + string.thermoelastic
    quality += 3e-3 * (at / 1700) / (1 + (at / 1700) ** 2)  # a standard linear solid
    sigma = math.pi * at * quality + string.extra_damping + 2 * math.pi * at * string.extra_damping_slope
    found = 2 * math.pi * frequencies(s, count), dampings(s, count)
    if law == "paper":
        sigma += mu * c**2 / s.length * s.admittance.at(nu).real
        np.testing.assert_allclose(found[0], 2 * math.pi * nu, rtol=1e-13)
        np.testing.assert_allclose(found[1], sigma, rtol=1e-11)
    else:
        pull = 2 * f0 * mu * c * rigid**2
        sigma += pull * s.admittance.stop
        moves = 1j * np.sqrt(found[0] ** 2 - found[1] ** 2) - found[1]
        felt = [(2 * math.pi * r.frequency, r.quality, r.mass) for r in s.admittance.resonances]
        y = sum(moves / m / (moves**2 + moves * w / q + w**2) for w, q, m in felt)
        wanted = 1j * np.sqrt((2 * math.pi * nu) ** 2 - sigma**2) - sigma - pull * y
        np.testing.assert_allclose(moves, wanted, rtol=1e-11)
    assert found[1][-1] > 10 * found[1][0]


def test_an_end_too_short_for_the_law_has_the_damping_of_its_first_mode() -> None:
    """The paper's law is constant from mode 800 L / 0.863 m on: here from mode 0.7, so from the first."""
    string, neck = g("paper")
    last = (*neck.fret_positions[:-1], string.length - 0.8e-3)
    neck = replace(neck, fret_positions=last, admittance=Admittance((), stop=0.0), stop_conductance=0.0)
    sigma = dampings(speaking(string, neck, len(last)), 5)
    np.testing.assert_allclose(sigma, sigma[0], rtol=1e-14)


def test_bending_is_that_of_the_core() -> None:
    """B = pi^2 E I / (T L^2), whatever the tuning."""
    for name in ("jazz-finger", "paper-bass"):
        bass = load_preset(name)
        for string, neck in zip(bass.strings, bass.necks, strict=True):
            ei = string.inharmonicity * string.tension * string.length**2 / math.pi**2
            assert speaking(string, neck, 5).bending == pytest.approx(ei, rel=1e-14)
