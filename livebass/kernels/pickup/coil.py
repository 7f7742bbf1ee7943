"""Fits the digital filter that models a pickup's circuit: coil, cable, volume and tone pot.

The coil (L, R) feeds three loads in parallel: the volume pot, the cable's capacitance, and the tone branch, which is
the open part of the tone pot in series with its capacitor. The filter has the circuit's poles. Its numerator minimises
the squared relative error up to `FITTED` of the rate: there the response is within 0.7 dB of the circuit's (1.2 dB with
the tone closed, far below the low notes) and `LATE` samples late; a bilinear transform would be 18 dB off.

`fit_coil` takes the address of one record, COIL: circuit parts in, filter coefficients out. The poles are the roots of
the circuit's cubic; Givens rotations solve the fit row by row, so 800 equations need the room of 4. [any thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.machine.elementary import cos, exp, sin
from livebass.kernels.machine.native import record_at
from livebass.rows.parts import Coil
from livebass.rows.row import record, words

ORDER = 3  # poles of the circuit
FITTED = 0.45  # of the sampling rate: upper limit of the fit
LATE = 0.25  # samples of delay allowed to the fit
FREQUENCIES = 400  # number of fitted frequencies
ROOT_STEPS = 500  # at most

CIRCUIT_WORDS = words(Coil)
CIRCUIT = record(CIRCUIT_WORDS)
COIL = np.dtype(
    [
        *((word.name, word.type) for word in CIRCUIT_WORDS),  # first: a CIRCUIT
        ("rate", "f8"),  # Hz
        ("b", "f8", (ORDER + 1,)),  # the filter's numerator ...
        ("a", "f8", (ORDER + 1,)),  # ... and denominator, a[0] = 1
        ("circuit", "f8", (ORDER + 1,)),  # the circuit's denominator in ascending powers of s
        ("real", "f8", (ORDER,)),  # of its poles, 1/s
        ("imaginary", "f8", (ORDER,)),
        ("product", "f8", (2, ORDER + 1)),  # workspace: a product of complex factors, ...
        ("triangle", "f8", (ORDER + 1, ORDER + 2)),  # ... the equations solved so far, ...
        ("row", "f8", (ORDER + 2,)),  # ... and the next equation
    ],
    align=True,
)

coil_at = record_at(COIL)


@entry("void(int64)")
def fit_coil(address):
    """Sets b and a of the COIL at an address."""
    fit(coil_at(address))


@jit
def fit(coil):
    """`fit_coil` for a record."""
    time = coil.tone_capacitor * coil.tone_pot * coil.tone  # s
    set_circuit(coil, time)
    order = set_poles(coil)
    set_denominator(coil, order)
    coil.triangle[:] = 0.0
    for k in range(FREQUENCIES):
        add_equations(coil, time, FITTED * k / (FREQUENCIES - 1))
    for i in range(ORDER, -1, -1):
        x = coil.triangle[i, ORDER + 1]
        for k in range(i + 1, ORDER + 1):
            x -= coil.triangle[i, k] * coil.b[k]
        coil.b[i] = x / coil.triangle[i, i]


@jit
def set_circuit(coil, time):
    """Sets the circuit's denominator; its numerator is 1 + s time."""
    loss = 1.0 / coil.volume_pot
    first = coil.capacitance + loss * time + coil.tone_capacitor
    second = coil.capacitance * time
    coil.circuit[0] = coil.resistance * loss + 1.0
    coil.circuit[1] = coil.resistance * first + coil.inductance * loss + time
    coil.circuit[2] = coil.resistance * second + coil.inductance * first
    coil.circuit[3] = coil.inductance * second


@jit
def set_poles(coil):
    """Sets the poles, all left of the imaginary axis; returns their number: one less with the tone pot closed."""
    d = coil.circuit
    c, b, a, order = d[0], d[1], d[2], 2
    if d[3] > 0.0:
        order = 3
        x = real_root(d)
        coil.real[2] = x
        coil.imaginary[2] = 0.0
        # the remaining factor is a s^2 + b s + c; b comes from the end where no digits cancel
        a = d[3]
        c = -d[0] / x
        b = (c - d[1]) / x if a * abs(x) * x * x > d[0] else d[2] + a * x
    inside = b * b - 4.0 * a * c
    if inside < 0.0:
        coil.real[0] = -b / (2.0 * a)
        coil.real[1] = coil.real[0]
        coil.imaginary[0] = np.sqrt(-inside) / (2.0 * a)
        coil.imaginary[1] = -coil.imaginary[0]
    else:
        q = -0.5 * (b + np.sqrt(inside))
        coil.real[0] = q / a
        coil.real[1] = c / q
        coil.imaginary[0] = 0.0
        coil.imaginary[1] = 0.0
    return order


@jit
def real_root(d):
    """A real root of the cubic with ascending positive coefficients `d`: Newton's method between two bounds."""
    low, high = -(1.0 + max(d[0], d[1], d[2]) / d[3]), 0.0  # Cauchy's bound
    x = -d[0] / d[1]
    for _ in range(ROOT_STEPS):
        value = ((d[3] * x + d[2]) * x + d[1]) * x + d[0]
        if value > 0.0:
            high = x
        else:
            low = x
        after = x - value / ((3.0 * d[3] * x + 2.0 * d[2]) * x + d[1])
        if not low < after < high:
            after = 0.5 * (low + high)
        if after == x or after in (low, high):
            break
        x = after
    return x


@jit
def set_denominator(coil, order):
    """Sets a: the product of 1 - exp(pole / rate) / z over the poles."""
    real, imaginary = coil.product[0], coil.product[1]
    real[: ORDER + 1] = 0.0
    imaginary[: ORDER + 1] = 0.0
    real[0] = 1.0
    for k in range(order):
        size = exp(coil.real[k] / coil.rate)
        x = size * cos(coil.imaginary[k] / coil.rate)
        y = size * sin(coil.imaginary[k] / coil.rate)
        for i in range(k + 1, 0, -1):
            u, v = real[i - 1], imaginary[i - 1]
            real[i] -= u * x - v * y
            imaginary[i] -= u * y + v * x
    for i in range(ORDER + 1):
        coil.a[i] = real[i]


@jit
def add_equations(coil, time, part):
    """Adds the two equations, real and imaginary, for the relative response at `part` of the rate."""
    turn = 2.0 * np.pi * part
    s = turn * coil.rate  # rad/s, on the imaginary axis
    d = coil.circuit
    below = complex(d[0] - d[2] * s * s, (d[1] - d[3] * s * s) * s)
    wanted = quotient(complex(1.0, time * s), below) * complex(cos(turn * LATE), -sin(turn * LATE))
    filtered = complex(0.0, 0.0)
    for i in range(ORDER + 1):
        filtered += coil.a[i] * complex(cos(turn * i), -sin(turn * i))
    inverse = quotient(complex(1.0, 0.0), filtered * wanted)
    for which in range(2):
        for i in range(ORDER + 1):
            x = complex(cos(turn * i), -sin(turn * i)) * inverse
            coil.row[i] = x.imag if which else x.real
        coil.row[ORDER + 1] = 0.0 if which else 1.0
        add_row(coil)


@jit
def quotient(a, b):
    """a / b by Smith's algorithm. Python's operator would carry an exception for b = 0 into the compiled code."""
    if abs(b.real) >= abs(b.imag):
        ratio = b.imag / b.real
        below = b.real + b.imag * ratio
        return complex((a.real + a.imag * ratio) / below, (a.imag - a.real * ratio) / below)
    ratio = b.real / b.imag
    below = b.real * ratio + b.imag
    return complex((a.real * ratio + a.imag) / below, (a.imag * ratio - a.real) / below)


@jit
def add_row(coil):
    """Rotates the next equation into the triangle, column by column."""
    for i in range(ORDER + 1):
        x, y = coil.triangle[i, i], coil.row[i]
        if y == 0.0:
            continue
        size = np.sqrt(x * x + y * y)
        c, s = x / size, y / size
        for k in range(i, ORDER + 2):
            above, row = coil.triangle[i, k], coil.row[k]
            coil.triangle[i, k] = c * above + s * row
            coil.row[k] = c * row - s * above
