"""Units, notes, cents and decibels: accepted texts, and texts refused with a clear message."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from livebass.rows import units


@pytest.mark.parametrize(
    ("text", "dimension", "si"),
    [
        ("34 in", "length", 0.8636), ("0.43 mm", "length", 0.43e-3), ("-2.33 mm", "length", -2.33e-3),
        ("5\u00b5m", "length", 5e-6), ("191.6 N", "force", 191.6), ("48.6 lbf", "force", 216.18357),
        ("1 kgf", "force", 9.80665), ("24.3 kHz", "frequency", 24300.0), ("1.2 ms", "time", 1.2e-3),
        ("35.43 g/m", "linear density", 35.43e-3), ("0.001984 lb/in", "linear density", 35.43e-3),
        ("7.5 kohm", "resistance", 7500.0), ("7.5k\u03a9", "resistance", 7500.0), ("600 pF", "capacitance", 600e-12),
        ("4 H", "inductance", 4.0), ("90 /s", "decay rate", 90.0), ("90 1/s", "decay rate", 90.0),
        ("0.64 mm/s/N", "conductance", 0.64e-3), ("200 GPa", "modulus", 200e9), ("  +1.5e-3   m ", "length", 1.5e-3),
        (".5 in", "length", 0.0127), ("-14 dB", "level", -14.0), (" off", "level", units.OFF),
    ],
)  # fmt: skip
def test_quantity(text: str, dimension: str, si: float) -> None:
    assert units.quantity(text, dimension) == pytest.approx(si, rel=2e-4 if "lb/in" in text else 1e-6)


@pytest.mark.parametrize(
    ("text", "dimension", "says"),
    [
        ("quiet", "level", 'units: dB, or "off"'), ("off", "length", "a number and a unit"),
        ("2", "length", "units: mm, m, cm, um or in"), ("2 parsec", "length", "units: mm, m, cm, um or in"),
        ("2 MM", "length", "'MM'"), ("", "force", "units: N, lbf or kgf"), ("N 5", "force", "a number and a unit"),
        ("nan N", "force", "a number and a unit"), ("inf N", "force", "a number and a unit"),
        ("1e999 N", "force", "finite"), ("1e308 kHz", "frequency", "finite"), ("-1 N", "force", "negative"),
        ("-1 /s", "decay rate", "negative"), ("1_0 mm", "length", "units"), ("1 N 2 N", "force", "units"),
        ("\u0663 mm", "length", "a number and a unit"),
    ],
)  # fmt: skip
def test_quantity_refuses(text: str, dimension: str, says: str) -> None:
    with pytest.raises(ValueError) as caught:
        units.quantity(text, dimension)
    assert says in str(caught.value)


@pytest.mark.parametrize("dimension", units.DIMENSIONS)
def test_a_refusal_begins_with_the_right_article(dimension: str) -> None:
    known = units.DIMENSIONS[dimension]
    unit, size = max(known.units.items(), key=lambda item: item[1])
    wrong = ["much", "2", "2 parsec", f"1e999 {unit}", f"2,5 {unit}"]
    wrong += [f"-1 {unit}"] * (not known.signed) + [f"1e308 {unit}"] * (size >= 10)
    for text in wrong:
        with pytest.raises(ValueError, match=rf"^(an (?=[aeiou])|a (?![aeiou])){dimension} "):
            units.quantity(text, dimension)


@pytest.mark.parametrize(
    ("value", "dimension", "text"),
    [
        (0.0045, "length", "4.5 mm"),
        (2.0, "length", "2 m"),
        (47e-9, "capacitance", "47 nF"),
        (8e6, "frequency", "8 MHz"),
        (3600.0, "time", "3600 s"),
        (1e-9, "length", "1e-06 mm"),
        (0.0, "angle", "0 deg"),
        (-14.0, "level", "-14 dB"),
        (units.OFF, "level", "off"),
    ],
)
def test_readable_quantity(value: float, dimension: str, text: str) -> None:
    assert units.readable_quantity(value, dimension) == text


@pytest.mark.parametrize(
    ("name", "number"),
    [
        *[("G2", 43), ("E1", 28), ("C#1", 25), ("Bb0", 22), ("C4", 60), ("a4", 69), ("bb0", 22), ("C-1", 0)],
        *[("G9", 127), ("B#3", 60), ("Cb4", 59), ("60", 60), (60, 60), (0, 0), (127, 127), (" D2 ", 38)],
        ("F\u266f2", 42),
    ],
)
def test_note_number(name: str | int, number: int) -> None:
    assert units.note_number(name) == number


@pytest.mark.parametrize(
    "name", ["", "H2", "G", "G#9", "Cb-1", "128", "-1", -1, 128, True, 60.0, None, "E 1", "G22", "C##1", "2G"]
)
def test_note_number_refuses(name: object) -> None:
    with pytest.raises(ValueError, match="0 to 127"):
        units.note_number(name)  # type: ignore[arg-type]


@pytest.mark.parametrize("number", range(128))
def test_note_name_is_the_inverse(number: int) -> None:
    assert units.note_number(units.note_name(number)) == number


def test_cents_and_decibels() -> None:
    assert units.cents(2.0) == 1200.0
    assert units.cents(2 ** (1 / 12)) == pytest.approx(100.0)
    assert units.decibels(10.0) == 20.0


@pytest.mark.parametrize("function", [units.cents, units.decibels])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_logarithms_refuse(function: object, value: float) -> None:
    with pytest.raises(ValueError, match="positive and finite"):
        function(value)  # type: ignore[operator]


@pytest.mark.parametrize("dimension", sorted(units.DIMENSIONS))
def test_format_reads_back(dimension: str) -> None:
    for unit in units.DIMENSIONS[dimension].units:
        text = units.format_quantity(0.25, dimension, unit)
        assert text.endswith(f" {unit}")
        assert units.quantity(text, dimension) == pytest.approx(0.25, rel=1e-3)


def test_format_has_no_exponent_in_plain_figures() -> None:
    assert units.format_quantity(1e4, "decay rate") == "10000 /s"
    assert units.format_quantity(0.8636, "length", "in") == "34 in"


@given(st.text(max_size=30), st.sampled_from(sorted(units.DIMENSIONS)))
def test_garbage_gives_a_finite_number_or_valueerror(text: str, dimension: str) -> None:
    try:
        value = units.quantity(text, dimension)
    except ValueError:
        return
    assert math.isfinite(value)
