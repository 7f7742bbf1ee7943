"""Converts quantities between text and SI; note names, cents and decibels. Fast to import."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache


@dataclass(frozen=True)
class Dimension:
    """The units of one physical dimension; the first is the usual one, shown by default."""

    name: str
    units: dict[str, float]  # unit -> its size in SI units
    signed: bool = False  # may be negative
    off: float | None = None  # what the word "off" stands for; None: nothing

    @property
    def indefinite(self) -> str:
        """Its name with "a" or "an"."""
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"


OFF = -200.0  # dB: nothing at all
INCH, POUND, GRAVITY = 0.0254, 0.45359237, 9.80665  # m, kg, m/s2: exact by definition

DIMENSIONS: dict[str, Dimension] = {
    d.name: d
    for d in (
        Dimension("length", {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "um": 1e-6, "in": INCH}, signed=True),
        Dimension("linear density", {"g/m": 1e-3, "kg/m": 1.0, "lb/in": POUND / INCH}),
        Dimension("force", {"N": 1.0, "lbf": POUND * GRAVITY, "kgf": GRAVITY}),
        Dimension("time", {"ms": 1e-3, "s": 1.0, "us": 1e-6}),
        Dimension("frequency", {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6}),
        Dimension("decay rate", {"/s": 1.0, "1/s": 1.0}),
        Dimension("angle", {"deg": math.pi / 180, "rad": 1.0}, signed=True),
        Dimension("speed", {"um/s": 1e-6, "mm/s": 1e-3, "m/s": 1.0}),
        Dimension("force per length", {"N/m": 1.0}),
        Dimension("modulus", {"GPa": 1e9, "MPa": 1e6, "Pa": 1.0}),
        Dimension("conductance", {"m/s/N": 1.0, "mm/s/N": 1e-3, "s/kg": 1.0}),
        Dimension("susceptance", {"m/s/N": 1.0, "mm/s/N": 1e-3, "s/kg": 1.0}, signed=True),
        Dimension("mass", {"kg": 1.0, "g": 1e-3}),
        Dimension("inductance", {"H": 1.0, "mH": 1e-3}),
        Dimension("level", {"dB": 1.0}, signed=True, off=OFF),
        Dimension("mechanical resistance", {"N s/m": 1.0, "kg/s": 1.0}),
        Dimension("resistance", {"kohm": 1e3, "ohm": 1.0, "Mohm": 1e6}),
        Dimension("capacitance", {"pF": 1e-12, "nF": 1e-9, "uF": 1e-6, "F": 1.0}),
    )
}
_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S.*?)?\s*", re.ASCII)
# Micro, ohm and minus signs of other keyboards.
_SAME = str.maketrans({"\u00b5": "u", "\u03bc": "u", "\u03a9": "ohm", "\u2126": "ohm", "\u2212": "-"})
_STEPS = {"C": 0, "D": 2, "E": 4, "F": 5, "G": 7, "A": 9, "B": 11}
_SHARPS = ("C", "C#", "D", "D#", "E", "F", "F#", "G", "G#", "A", "A#", "B")
_NOTE = re.compile(r"([A-G])([#b\u266f\u266d]?)(-1|\d)", re.ASCII)


def allowed_units(dimension: str) -> str:
    """Lists the units of `dimension` for a message: "mm, m, cm, um or in"."""
    *first, last = DIMENSIONS[dimension].units
    return f"{', '.join(first)} or {last}" if first else last


_COMMA = re.compile(r",\d")  # in place of a decimal point


@lru_cache(maxsize=4096)  # files and limits repeat the same few hundred
def split_quantity(text: str, dimension: str) -> tuple[float, str]:
    """Number and unit of a text such as "34 in". The number is finite, and not negative unless the dimension is signed.

    Raises ValueError that says what is allowed, and KeyError for an unknown dimension.
    """
    known, units = DIMENSIONS[dimension], allowed_units(dimension)
    example = f'"{2 if dimension != "force" else 180} {next(iter(known.units))}"'
    if known.off is not None and text.strip() == "off":
        return known.off, next(iter(known.units))
    match = _QUANTITY.fullmatch(text.translate(_SAME))
    if not match:
        or_off = ', or "off"' if known.off is not None else ""
        raise ValueError(f"{known.indefinite} is a number and a unit such as {example}; units: {units}{or_off}")
    number, unit = float(match[1]), match[2] or ""
    if _COMMA.match(unit):
        raise ValueError(f"{known.indefinite} needs a decimal point, not a comma; units: {units}")
    if unit not in known.units:
        missing = "has no unit" if not unit else f"has the unit {unit!r}"
        raise ValueError(f"{known.indefinite} {missing}; units: {units}")
    if not math.isfinite(number):
        raise ValueError(f"{known.indefinite} must be finite")
    if number < 0 and not known.signed:
        raise ValueError(f"{known.indefinite} cannot be negative")
    return number, unit


def quantity(text: str, dimension: str) -> float:
    """SI value of a text such as "48.6 lbf"; `dimension` is a key of DIMENSIONS.

    Raises ValueError as `split_quantity` does.
    """
    number, unit = split_quantity(text, dimension)
    known = DIMENSIONS[dimension]
    value = number * known.units[unit]
    if not math.isfinite(value):
        raise ValueError(f"{known.indefinite} must be finite")
    return value


def unit_of(text: str, dimension: str) -> str:
    """The unit of `text`, or the usual one of `dimension` if `text` is not valid."""
    try:
        return split_quantity(text, dimension)[1]
    except ValueError:
        return next(iter(DIMENSIONS[dimension].units))


def format_quantity(value: float, dimension: str, unit: str | None = None) -> str:
    """`value` (SI) with four digits in `unit`, or in the usual unit of `dimension`: "34 in", or "off"."""
    if value == DIMENSIONS[dimension].off:
        return "off"
    unit = unit or next(iter(DIMENSIONS[dimension].units))
    rounded = float(f"{value / DIMENSIONS[dimension].units[unit]:.4g}")
    return f"{rounded:.12g} {unit}"


def readable_quantity(value: float, dimension: str) -> str:
    """`value` (SI) with four digits in the unit that suits its size: "4.5 mm", "47 nF"; never in inches or cm."""
    sizes = DIMENSIONS[dimension].units
    default = [unit for unit, size in sizes.items() if size <= value and unit not in ("in", "cm")]
    fitting = [unit for unit in default if value / sizes[unit] < 1000]
    return format_quantity(
        value, dimension, fitting[0] if fitting else max(default, key=sizes.__getitem__, default=None)
    )


def decibels(ratio: float) -> float:
    """20 log10 of an amplitude ratio. Raises ValueError unless it is positive and finite."""
    return 20 * math.log10(_positive(ratio, "an amplitude ratio"))


def cents(ratio: float) -> float:
    """Interval of a frequency ratio, 1200 to the octave. Raises ValueError unless it is positive and finite."""
    return 1200 * math.log2(_positive(ratio, "a frequency ratio"))


def note_number(note: str | int) -> int:
    """MIDI note number of "G2" (43), "C#1", "Bb0", "60" or 60; C4 is 60.

    Raises ValueError, which says what is allowed, for anything else and for a note outside 0 (C-1) to 127 (G9).
    """
    allowed = 'a note is a name such as "E1", "C#2" or "Bb0" (C4 is 60), or a MIDI number from 0 to 127'
    if isinstance(note, bool) or not isinstance(note, (str, int)):
        raise ValueError(allowed)
    if isinstance(note, str):
        text = note.strip()
        match = _NOTE.fullmatch(text[:1].upper() + text[1:])
        if match:
            number = _STEPS[match[1]] + 12 * (int(match[3]) + 1)
            number += {"": 0, "#": 1, "\u266f": 1, "b": -1, "\u266d": -1}[match[2]]
        elif re.fullmatch(r"\d{1,3}", text, re.ASCII):
            number = int(text)
        else:
            raise ValueError(allowed)
    else:
        number = note
    if not 0 <= number <= 127:
        raise ValueError(allowed)
    return number


def note_name(number: int) -> str:
    """Name of a MIDI note number, with sharps: 43 is "G2". Raises ValueError outside 0 to 127."""
    number = note_number(number)
    return f"{_SHARPS[number % 12]}{number // 12 - 1}"


def pitch_name(number: int) -> str:
    """Name, without octave, of a MIDI note number or of a pitch class (0 is C)."""
    return _SHARPS[number % 12]


def _positive(value: float, what: str) -> float:
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{what} must be positive and finite")
    return value


def is_number(text: str) -> bool:
    """True for a whole number of up to nine digits, such as a port: no fraction, power or sign."""
    return re.fullmatch(r"\d{1,9}", text, re.ASCII) is not None


def one_line(text: str) -> str:
    """`text` in one line for a terminal: unprintable characters, as in a file's name, become escapes (\\n)."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
