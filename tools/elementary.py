"""Derives the constants of kernels/machine/elementary.py and prints them. Exact fractions; the standard library only.

Each polynomial is a Taylor series, cut where its remainder is negligible, written in Chebyshev polynomials over the
range of its argument. Dropping those above the desired degree leaves an error near the smallest possible (C. Lanczos,
Applied Analysis, 1956, "telescoping"). pi and ln 2 come from Machin's formula and from atanh(1/3).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from fractions import Fraction

TERMS = 24  # of each Taylor series
LONG = 80  # terms for pi and ln 2: 250 binary digits
QUARTER = Fraction(785399, 1_000_000)  # just above pi / 4
HALF_OCTAVE = Fraction(346575, 1_000_000)  # just above ln 2 / 2
SQUARE = Fraction(29438, 1_000_000)  # just above (3 - sqrt 8)^2, the square of (m - 1) / (m + 1) at m = sqrt 2


def arctangent(x: Fraction, sign: int) -> Fraction:
    """Returns atan(x) for sign -1, atanh(x) for sign 1."""
    return sum((Fraction(sign**i) * x ** (2 * i + 1) / (2 * i + 1) for i in range(LONG)), Fraction(0))


PI = 16 * arctangent(Fraction(1, 5), -1) - 4 * arctangent(Fraction(1, 239), -1)
LN2 = 2 * arctangent(Fraction(1, 3), 1)


def shifted_chebyshev(n: int, low: Fraction, high: Fraction) -> list[list[Fraction]]:
    """Returns the coefficients of T_0 ... T_n over `low` to `high`, in ascending powers of x."""
    a, b = 2 / (high - low), -(high + low) / (high - low)  # to -1 ... 1
    rows = [[Fraction(1)], [b, a]]
    while len(rows) <= n:
        row = [Fraction(0)] * (len(rows) + 1)
        for i, c in enumerate(rows[-1]):
            row[i] += 2 * b * c
            row[i + 1] += 2 * a * c
        for i, c in enumerate(rows[-2]):
            row[i] -= c
        rows.append(row)
    return rows


def economised(term: Callable[[int], Fraction], degree: int, low: Fraction, high: Fraction) -> list[Fraction]:
    """Returns the polynomial of `degree` near the sum of term(i) x^i over `low` to `high`, in ascending powers."""
    series = [term(i) for i in range(TERMS)]
    bases = shifted_chebyshev(TERMS - 1, low, high)
    for n in range(TERMS - 1, degree, -1):
        part = series[n] / bases[n][n]
        for i, c in enumerate(bases[n]):
            series[i] -= part * c
    return series[: degree + 1]


def cut(x: Fraction, bits: int) -> Fraction:
    """Returns `x` rounded towards zero to `bits` binary digits."""
    scale = Fraction(2) ** (bits - 1 - math.floor(math.log2(x)))
    return Fraction(math.floor(x * scale)) / scale


def parts(x: Fraction, *bits: int) -> list[float]:
    """Splits `x` into numbers of `bits` bits each, and a float64 for the rest."""
    found = []
    for count in bits:
        found.append(cut(x, count))
        x -= found[-1]
    return [float(part) for part in (*found, x)]


def constants() -> dict[str, list[float]]:
    """Returns the constants by name; see elementary.py."""
    zero = Fraction(0)
    sine = economised(lambda i: Fraction((-1) ** (i + 1), math.factorial(2 * i + 3)), 5, zero, QUARTER**2)
    cosine = economised(lambda i: Fraction((-1) ** i, math.factorial(2 * i + 4)), 5, zero, QUARTER**2)
    power = economised(lambda i: Fraction(1, math.factorial(i + 2)), 10, -HALF_OCTAVE, HALF_OCTAVE)
    logarithm = economised(lambda i: Fraction(1, 2 * i + 5), 7, zero, SQUARE)
    return {
        "QUARTER": parts(PI / 2, 33, 33, 33),
        "TURNS": [float(2 / PI)],
        "LN2": parts(LN2, 42),
        "OCTAVES": parts(1 / LN2, 53),
        "LN2_WHOLE": parts(LN2, 53),
        "THIRD": parts(Fraction(1, 3), 53),
        "S": [float(c) for c in sine],
        "C": [float(c) for c in cosine],
        "E": [float(c) for c in power],
        "L": [float(c) for c in logarithm],
    }


if __name__ == "__main__":
    for name, values in constants().items():
        for i, value in enumerate(values):
            sys.stdout.write(f"{name}{i if len(values) > 1 else ''} = {value!r}\n")
