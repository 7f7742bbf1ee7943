"""Powers of 2 are the nearest floats: 2^n lies between the twelfth powers of the values half a unit below and above."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from livebass.model.exact import exp2
from livebass.model.instrument import frets_from_geometry, note_frequency


@pytest.mark.parametrize("n", range(-69, 60))
def test_semitones_are_rounded_once(n: int) -> None:
    """n / 12 is no float: the test allows for its rounding, 2^-53 of it times ln 2."""
    found = exp2(n / 12)
    slack = Fraction(abs(n), 12) * Fraction(7, 10) / 2**53 * Fraction(found)
    half = Fraction(math.ulp(found)) / 2 + slack
    assert (Fraction(found) - half) ** 12 <= Fraction(2) ** n <= (Fraction(found) + half) ** 12
    assert n % 12 or found == 2.0 ** (n // 12)


def test_notes_and_frets_are_made_of_them() -> None:
    assert [note_frequency(note) for note in (57, 69, 81)] == [220.0, 440.0, 880.0]
    positions, _ = frets_from_geometry(0.8636, 24, 2e-3, 0.0, 5e-4)
    assert positions[11] == 0.4318 and positions[23] == 0.6477
