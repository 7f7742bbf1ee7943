"""Resonances of a neck from measured modes: it recovers known ones, and meets the paper's saw-tooth."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from support.command import python_output
from support.own_basses import load_preset
from support.places import SHARED, TOOLS
from support.strings import g_neck, g_string

from livebass.lab.identification.fit import NeckFit, fit_neck
from livebass.model.instrument import String, speaking
from livebass.model.modes import dampings, frequencies, impedance, loss_factor
from livebass.model.neck import Admittance, Resonance, detuning, neck_damping

PUBLISHED = SHARED / "fretted_modes.csv"


@pytest.fixture(scope="module")
def paper() -> NeckFit:
    return fit_neck(g_string())


def on_a_neck(resonances: tuple[Resonance, ...], count: int = 24) -> String:
    """Returns the G string as it would measure on a neck with these resonances."""
    law = replace(g_string(), measured_frequencies=(), measured_dampings=())
    s = speaking(law, replace(g_neck(), admittance=Admittance(resonances)), 0)
    nu, sigma = frequencies(s, count).tolist(), dampings(s, count).tolist()
    return replace(law, measured_frequencies=tuple(nu), measured_dampings=tuple(sigma))


def test_known_resonances_are_found() -> None:
    put = (Resonance(215.0, 20.0, 0.8, 1), Resonance(690.0, 25.0, 0.4, 2), Resonance(1480.0, 30.0, 0.5, 3))
    fit = fit_neck(on_a_neck(put), close=0.02)
    assert fit.below == () and fit.deviation < 0.02 and fit.left < fit.scatter / 3
    assert len(fit.resonances) <= 5
    for r in put:
        near = min(fit.resonances, key=lambda found: abs(found.frequency - r.frequency))
        assert near.frequency == pytest.approx(r.frequency, rel=0.02)
        # Q and mass trade off if no mode is inside the peak; the flanks give their ratio
        assert near.quality * near.mass == pytest.approx(r.quality * r.mass, rel=0.4)


@pytest.mark.slow  # the command reproduces the shipped data, with these figures
def test_the_saw_tooth_of_the_paper(paper: NeckFit) -> None:
    """At most 14 resonances explain 34 dampings between 0.14 and 5.5 1/s, and the frequencies with them."""
    law = np.sqrt(np.mean((paper.law / paper.damping - 1) ** 2))
    assert law > 0.4 and paper.deviation < 0.066 and len(paper.resonances) <= 14 and paper.below == ()
    np.testing.assert_allclose(paper.fitted, paper.damping, rtol=0.25)
    assert paper.left < 0.45 * paper.scatter and paper.scatter == pytest.approx(5e-4, rel=0.1)
    assert all(1e-3 < r.mass < 10 for r in paper.resonances)


@pytest.mark.slow  # the paper's claims include the sign too: tests/unit/model/test_neck.py
def test_the_sign_of_eq_8_is_in_the_data(paper: NeckFit, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the sign as printed, and exp(+i omega t), the resonances explain the frequencies much worse."""
    monkeypatch.setattr("livebass.lab.identification.fit.detuning", lambda *given: -detuning(*given))
    printed = fit_neck(g_string(), maximum=len(paper.resonances))
    assert printed.left > 1.3 * paper.left


@pytest.mark.parametrize("name", ["paper-g", "paper-bass"])
def test_the_presets_have_that_neck(name: str) -> None:
    shipped = [r for r in load_preset(name).necks[-1].admittance.resonances if r.shape]
    assert len(shipped) == 13 and [r.shape for r in shipped] == list(range(1, 14))
    assert saw_tooth(Admittance(tuple(shipped)), np.array(g_string().measured_dampings)) < 0.066


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper-g", "paper-bass"])
def test_the_command_gives_back_what_ships(name: str) -> None:
    """Its resonances to the letter, and the figures in preset and notes."""
    tool = TOOLS / "fit_neck.py"
    printed = python_output(tool, name)
    said = tomllib.loads(printed)
    shipped = [r for r in load_preset(name).necks[-1].admittance.resonances if r.shape]
    assert said["resonance_frequencies"]["values"] == [r.frequency for r in shipped]
    assert said["resonance_qualities"] == [r.quality for r in shipped]
    assert said["resonance_masses"]["values"] == [r.mass for r in shipped]
    for figure in (
        "13 resonances; dampings to 6.0% rms, 19% at worst", "7.8% rms, 25% at worst", "501 ppm rms, 179 with",
        "1936 ppm, 2014 with",
    ):  # fmt: skip
        assert figure in printed


@pytest.mark.slow  # with the usual rounding, the command reproduces the shipped data
def test_as_many_are_found_whatever_the_rounding(paper: NeckFit) -> None:
    """Another last digit of the string leads elsewhere, but to 13 that fit as well."""
    again = fit_neck(replace(g_string(), linear_density=np.nextafter(g_string().linear_density, 1)))
    for fit in (paper, again):
        assert len(fit.resonances) == 13 and fit.deviation < 0.065 and 160e-6 < fit.left < 200e-6


def saw_tooth(neck: Admittance, sigma: np.ndarray) -> float:
    """Returns the relative rms misfit of the law with `neck` to the dampings of the G's first modes."""
    s = speaking(g_string(), g_neck(), 0)
    nominal = np.arange(1.0, sigma.size + 1) * s.string.nominal_fundamental
    law = np.pi * nominal * loss_factor(s, nominal)
    law = law + neck_damping(neck.at(frequencies(s, sigma.size)), impedance(s), s.fundamental)
    return float(np.sqrt(np.mean((law / sigma - 1) ** 2)))


@pytest.mark.skipif(not PUBLISHED.exists(), reason="published modes not here")
def test_the_published_modes_with_the_shipped_neck() -> None:
    """The resonances are fitted to modes up to 34; beyond, the published law has the conductance measured to 9 kHz."""
    sigma = np.genfromtxt(PUBLISHED, delimiter=",", names=True)["damping_per_s"]
    neck = load_preset("paper-g").necks[0].admittance
    assert saw_tooth(neck, sigma[:34]) < 0.066 < 0.4 < saw_tooth(Admittance(), sigma[:34])
    string = replace(g_string(), measured_dampings=(), measured_frequencies=())
    off = dampings(speaking(string, replace(g_neck(), admittance=neck), 0), 120)[34:] / sigma[34:120] - 1
    assert np.all(np.abs(off) < 0.35) and np.all(np.abs(off[66:]) < 0.003), off


def test_modes_below_the_law_are_listed() -> None:
    string = g_string()
    sigma = (string.measured_dampings[0], 0.05, *string.measured_dampings[2:12])
    fit = fit_neck(replace(string, measured_frequencies=string.measured_frequencies[:12], measured_dampings=sigma))
    assert fit.below == (2,) and fit.deviation < 0.1
    with pytest.raises(ValueError, match="string G: 2 measured modes, 4 are needed"):
        fit_neck(replace(string, measured_frequencies=(98.0, 196.0), measured_dampings=(1.0, 1.0)))
