"""The pickup's circuit: its resonance, its pots, and its digital filter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from support.circuit import digital, response

from livebass.model.instrument import Coil

RATES = [22050, 44100, 48000, 96000, 192000]
COILS = [Coil(), Coil(inductance=1.8, resistance=3750, capacitance=700e-12, tone=0.8), Coil(tone=0.3)]


def band_pass(coil: Coil, rate: int, frequency: np.ndarray) -> np.ndarray:
    b, a = digital(coil, rate)
    z = np.exp(-2j * math.pi * frequency / rate)
    return np.polyval(b[::-1], z) / np.polyval(a[::-1], z)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("coil", COILS)
def test_filter_follows_the_circuit(coil: Coil, rate: int) -> None:
    frequency = np.linspace(0, min(20e3, 0.42 * rate), 300)
    error = 20 * np.log10(np.abs(band_pass(coil, rate, frequency) / response(coil, frequency)))
    assert np.max(np.abs(error)) < 0.7
    assert abs(error[0]) < 0.5
    assert np.max(np.abs(np.roots(digital(coil, rate)[1]))) < 1


def test_resonance_is_where_coil_and_cable_put_it() -> None:
    coil = Coil(inductance=3.6, capacitance=500e-12, tone=1.0, volume_pot=1e6, tone_pot=1e6)
    frequency = np.linspace(500, 8000, 4000)
    peak = frequency[np.argmax(np.abs(response(coil, frequency)))]
    assert peak == pytest.approx(1 / (2 * math.pi * math.sqrt(3.6 * 500e-12)), rel=0.03)


def test_tone_pot_takes_the_highs() -> None:
    at = np.array([100.0, 3000.0])
    low_open, high_open = np.abs(response(Coil(tone=1.0), at))
    low_closed, high_closed = np.abs(response(Coil(tone=0.0), at))
    assert low_closed == pytest.approx(low_open, rel=0.15)
    assert high_closed < 0.02 * high_open
