"""The neck gives way: eqs. 8 and 9 against exact solutions, dead spots, and notes that stay in tune."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from support.costs import quick
from support.strings import g_neck, g_string

from livebass import load_preset, preset_names
from livebass.lab.analysis.motion import t60
from livebass.model.instrument import Instrument, note_frequency, speaking
from livebass.model.modes import dampings, frequencies, impedance, neck_detuning
from livebass.model.neck import Admittance, Resonance, bending_shape, detuning, neck_damping

LENGTH, TENSION, DENSITY = 0.863, 191.6, 6.69e-3
SPEED = math.sqrt(TENSION / DENSITY)
MODES = np.arange(1, 9)
NECK = (Resonance(150.0, 20.0, 0.9), Resonance(290.0, 30.0, 1.4), Resonance(1200.0, 15.0, 0.5))


def couple(resonance: Resonance, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (Hz) and dampings (1/s) of a string's first modes when it ends on a mass, a spring and a damper.

    Uses eigenvalues of real matrices, which need no sign convention of complex numbers. u = w (1 - x / L) + sum q_j
    sin(j pi x / L), where w is the displacement of the mass.
    """
    j = np.arange(1, count + 1)
    m, w0 = resonance.mass, 2 * math.pi * resonance.frequency
    mass = np.diag(np.append(np.full(count, DENSITY * LENGTH / 2), DENSITY * LENGTH / 3 + m))
    mass[:-1, -1] = mass[-1, :-1] = DENSITY * LENGTH / (j * math.pi)
    stiffness = np.diag(np.append(TENSION * (j * math.pi / LENGTH) ** 2 * LENGTH / 2, TENSION / LENGTH + m * w0**2))
    damper = np.zeros_like(mass)
    damper[-1, -1] = m * w0 / resonance.quality
    system = np.block([
        [np.zeros_like(mass), np.eye(count + 1)],
        [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damper)],
    ])  # fmt: skip
    values = np.linalg.eigvals(system)
    # without the neck's own mode, which decays much faster
    mine = values[(values.imag > 0) & (-values.real < w0 / (4 * resonance.quality))]
    first = mine[np.argsort(mine.imag)][: MODES.size]
    return np.abs(first) / (2 * math.pi), -first.real


@pytest.mark.parametrize("frequency", quick([60.0, 150.0, 440.0, 700.0], [150.0]))
def test_a_string_on_a_mass_a_spring_and_a_damper(frequency: float) -> None:
    """Between the string's resonances the neck acts as a spring above and as a mass below it: both signs of eq. 8."""
    neck = Resonance(frequency, 8.0, 3.0)
    nu, sigma = couple(neck)
    y = Admittance((neck,)).at(MODES * SPEED / (2 * LENGTH))
    aside = detuning(y, DENSITY * SPEED, MODES)
    found = nu / (MODES * SPEED / (2 * LENGTH)) - 1
    assert {-1.0, 1.0} <= set(np.sign(aside)) or frequency < 98
    np.testing.assert_allclose(found, aside, rtol=0.03, atol=2e-6)
    np.testing.assert_allclose(sigma, neck_damping(y, DENSITY * SPEED, SPEED / (2 * LENGTH)), rtol=0.03, atol=1e-3)


def exact(neck: Admittance, j: int) -> complex:
    """Angular frequency (rad/s) of mode j where i omega u(0) = Y T u'(0), u = sin k (L - x), by Newton's method."""

    def off(omega: complex) -> complex:
        k, nu = omega / SPEED, omega / (2 * math.pi)
        y = sum(1j * nu / (2 * math.pi * r.mass) / (r.frequency**2 - nu**2 + 1j * nu * r.frequency / r.quality)
                for r in neck.resonances)  # fmt: skip
        return 1j * omega * np.sin(k * LENGTH) + y * TENSION * k * np.cos(k * LENGTH)

    omega = complex(j * math.pi * SPEED / LENGTH)
    for _ in range(30):
        h = 1e-4
        omega -= off(omega) * 2 * h / (off(omega + h) - off(omega - h))
    return omega


def test_the_exact_equation_is_met_the_better_the_weaker_the_coupling() -> None:
    wrong = []
    for heavier in (1.0, 10.0, 100.0):
        neck = Admittance(tuple(replace(r, mass=r.mass * heavier) for r in NECK))
        f0 = SPEED / (2 * LENGTH)
        y = neck.at(MODES * f0)
        shift = np.array([exact(neck, j) for j in MODES.tolist()]) / (2 * math.pi * f0 * MODES) - 1
        law = detuning(y, DENSITY * SPEED, MODES)
        law = law + 1j * neck_damping(y, DENSITY * SPEED, f0) / (2 * math.pi * f0 * MODES)
        wrong.append(float(np.max(np.abs(shift - law) / np.abs(law))))
        printed = -law.real + 1j * law.imag  # eq. 8 with a plus, for exp(+i omega t)
        assert np.max(np.abs(shift - printed) / np.abs(law)) > 1
    assert wrong[0] < 0.05 and wrong[1] < wrong[0] / 8 and wrong[2] < wrong[1] / 8, wrong


def test_modes_of_a_string_on_a_neck() -> None:
    """modes.py adds eqs. 8 and 9 to the law of a rigid neck; measured modes stay as measured."""
    string = replace(g_string(), measured_frequencies=(), measured_dampings=())
    still = speaking(string, g_neck(), 0)
    s = speaking(string, replace(g_neck(), admittance=Admittance(NECK)), 0)
    assert s.fundamental == still.fundamental == 97.976  # measured: not tuned
    f0, j = s.fundamental, np.arange(1, 41)
    y8, y9 = (Admittance(NECK).at(nu) for nu in (j * f0, frequencies(s, 40)))
    z = DENSITY * 2 * LENGTH * f0
    np.testing.assert_allclose(frequencies(s, 40) - frequencies(still, 40), -f0 * z / math.pi * y8.imag, atol=1e-9)
    np.testing.assert_allclose(dampings(s, 40) - dampings(still, 40), 2 * f0 * z * y9.real, atol=1e-9)
    measured = speaking(g_string(), replace(g_neck(), admittance=Admittance(NECK)), 0)
    assert tuple(frequencies(measured, 34)) == g_string().measured_frequencies
    assert tuple(dampings(measured, 34)) == g_string().measured_dampings


def test_resonance() -> None:
    """A resonance peaks at Q / (m omega), acts as a spring far below and a mass far above, and never gains energy."""
    (r,) = neck = (Resonance(200.0, 25.0, 0.7),)
    y = Admittance(neck)
    omega = 2 * math.pi * np.array([2.0, 200.0, 20_000.0])
    low, peak, high = y.at(omega / (2 * math.pi))
    assert peak == pytest.approx(25 / (0.7 * omega[1]))
    assert low.imag == pytest.approx(omega[0] / (0.7 * omega[1] ** 2), rel=1e-3)
    assert high.imag == pytest.approx(-1 / (0.7 * omega[2]), rel=1e-3)
    nu = np.geomspace(1, 1e5, 500)
    assert np.all(y.at(nu).real > 0)
    table = Admittance(table=tuple((f, v.real, v.imag) for f, v in zip(nu.tolist(), y.at(nu).tolist(), strict=True)))
    np.testing.assert_allclose(table.at(nu), y.at(nu))
    assert table.at(0.5) == table.at(2e5) == 0 and not Admittance() and Admittance().at(100.0) == 0
    assert replace(y, resonances=(replace(r, mass=1.4),)).at(200.0) == pytest.approx(peak / 2)


def test_bending_shapes() -> None:
    """Clamped at the body, free at the nut: orthogonal, mean square a quarter of the tip's, nodes where known."""
    x = (np.arange(4000) + 0.5) / 4000
    shapes = np.array([[bending_shape(k, p) for p in x.tolist()] for k in (1, 2, 3, 4, 12)])
    np.testing.assert_allclose(shapes @ shapes.T / 4000, np.eye(5) / 4, atol=1e-6)
    assert [bending_shape(k, 0.0) for k in (1, 2, 40)] == pytest.approx([1, 1, 1])
    assert [bending_shape(k, p) for k in (1, 2, 40) for p in (1.0, 1.2)] == [0] * 6
    assert bending_shape(2, 1 - 0.7834) == pytest.approx(0, abs=1e-3) and bending_shape(0, 1.5) == 1
    for k in (1, 2, 5):
        assert abs(bending_shape(k, 1 - 1e-4)) < 2e-6 * k**2  # neither displacement nor slope at the clamp
    assert np.count_nonzero(np.diff(np.sign(shapes[4]))) == 11


def test_a_table_follows_the_first_bending_mode() -> None:
    y = Admittance(table=((50.0, 1e-3, 2e-3), (500.0, 2e-3, -1e-3)))
    neck = replace(g_neck(), admittance=y, free_length=0.5, stop_conductance=0.0)
    for fret, place in enumerate((0.0, *neck.fret_positions)):
        part = bending_shape(1, place / 0.5) ** 2
        found = speaking(g_string(), neck, fret).admittance
        assert found.at(50.0) == pytest.approx(part * (1e-3 + 2e-3j)) and bool(found) == (place < 0.5)
    assert speaking(g_string(), neck, 0).admittance == y and place > 0.5


def decay(bass: Instrument, string: int) -> list[float]:
    """T60 (s) of the fundamental by fret."""
    own, neck = bass.strings[string], bass.necks[string]
    return [float(t60(dampings(speaking(own, neck, k), 1))[0]) for k in range(len(neck.fret_positions) + 1)]


def with_resonances(bass: Instrument, change: dict[int, Resonance], free_length: float = 0.0) -> Instrument:
    necks = []
    for neck in bass.necks:
        own = tuple(change.get(k, r) for k, r in enumerate(neck.admittance.resonances))
        necks.append(replace(neck, admittance=Admittance(own), free_length=free_length))
    return replace(bass, necks=tuple(necks))


def test_dead_spots_follow_the_neck() -> None:
    """On the G of paper-bass notes near a resonance decay fast; they move with it, and other strings have them too."""
    bass = load_preset("paper-bass")
    default = decay(bass, 3)
    dead = int(np.argmin(default[1:])) + 1
    assert dead in (2, 3) and default[dead] < 5 and min(default[5:]) > 20, default
    second = bass.necks[3].admittance.resonances[1]
    assert note_frequency(43 + dead) == pytest.approx(second.frequency, rel=0.04)
    for up in (2, 4, 6):
        moved = replace(second, frequency=note_frequency(43 + dead + up))
        assert int(np.argmin(decay(with_resonances(bass, {1: moved}), 3)[1:])) + 1 == dead + up
    on_d = decay(bass, 2)  # tuned five frets lower
    assert int(np.argmin(on_d[1:])) + 1 in (dead + 4, dead + 5) and min(on_d) > default[dead], on_d  # nearer the body
    short = decay(with_resonances(bass, {}, free_length=0.05), 3)  # fret 2 is on the body, and feels no resonance
    assert min(short[2:]) > 20, short


@pytest.mark.parametrize("name", preset_names())
def test_tuned_with_the_neck(name: str) -> None:
    """The neck shifts the first mode, yet the note is in tune, as a string is tuned by ear: along u's own axis."""
    bass, aside = load_preset(name), 0.0
    for string, neck in zip(bass.strings, bass.necks, strict=True):
        for fret in range(1, len(neck.fret_positions) + 1):
            s = speaking(string, replace(neck, axes_turned=0.0), fret)
            nu, sigma = frequencies(s, 1)[0], dampings(s, 1)[0] / (2 * math.pi)
            cents = 1200 * math.log2(math.sqrt(nu**2 - sigma**2) / note_frequency(string.open_note + fret))
            assert abs(cents) < 0.1, (string.name, fret, cents)
            aside = max(aside, float(np.max(np.abs(neck_detuning(s, 12)))))
    gives_way = any(neck.admittance for neck in bass.necks)
    assert 1e-4 < aside < 1e-2 if gives_way else aside == 0, "upper partials are drawn aside"


def test_a_stop_is_a_loss() -> None:
    """sigma = 2 f0 Z Re Y (1 + B j^2) at all frequencies, on stopped notes only; pitch and open string stay."""
    bass = load_preset("slap-impulse")
    string, neck = bass.strings[1], bass.necks[1]
    for fret in (0, 5, 19):
        free, held = (speaking(string, replace(neck, stop_conductance=y), fret) for y in (0.0, 2e-3))
        np.testing.assert_allclose(frequencies(held, 300), frequencies(free, 300), rtol=1e-5)  # a hair for the tuning
        more = dampings(held, 300) - dampings(free, 300)
        stiff = 1 + free.inharmonicity * np.arange(1, 301) ** 2  # pulls the harder
        wanted = 2 * free.fundamental * impedance(free) * 2e-3 * stiff
        np.testing.assert_allclose(more, wanted if fret else 0.0, rtol=2e-2)  # beside a resonance a little more or less
    y = Admittance((Resonance(100.0, 10.0, 1.0),), stop=2e-3)
    assert y.at(50.0) == replace(y, stop=0.0).at(50.0) + 2e-3 and Admittance(stop=1e-3)
    assert Admittance(table=((50.0, 1e-3, 0.0),), stop=2e-3).at(50.0) == pytest.approx(3e-3)


@pytest.mark.parametrize("name", preset_names())
def test_the_papers_presets_have_no_stop(name: str) -> None:
    assert all((neck.stop_conductance == 0) == name.startswith("paper-") for neck in load_preset(name).necks)


def test_impedance() -> None:
    assert impedance(speaking(g_string(), g_neck(), 0)) == pytest.approx(DENSITY * 2 * LENGTH * 97.976)
