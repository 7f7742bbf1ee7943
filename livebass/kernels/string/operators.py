"""An operator's rows in the pool, as arrays.

An operator holds their addresses (records.py): the coefficients of its modes, the weights of taps and the mode shapes
at contact points, a row of `padded` numbers each; heights and positions of the contact points; W and R between them, a
row of `points` each, which boards do not need. In rows read every frame the first `split` numbers are float64, the
others float32: `low_part` and `high_part` return the two arrays of such a mixed row; the second begins with mode
`split`. Only preparing.py, which fills the pool, also knows its layout. [any thread]
"""

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.machine.elementary import exp
from livebass.kernels.machine.native import floats_at, samples_at
from livebass.kernels.string.records import DOUBLE, LONGER, MAX_NEAR, PART, SINGLE

# The coefficient rows in order; LEAPS: rows a, b and g of each leap
KAPPA, OMEGA, SIGMA = 0, 1, 2  # all float64 ...
WIDE_ROWS = 3
KEPT, SPRING, PACE, LEAPS = 0, 1, 2, 3  # ... these are mixed
EXCHANGE_ROWS = 4


@jit
def is_exact(op):
    """True if all modes of the operator are float64."""
    return op.split == op.padded


@jit
def fine_coefficients(decay, half_sine):
    """Returns E^2, s and E of a mode that decays by exp(-`decay`) per fine step; `half_sine`: sin(omega dt / 2)."""
    left = exp(-decay)
    gone = 1.0 - left
    return left * left, gone * gone + 4.0 * left * (half_sine * half_sine), left


@jit
def leap_steps(op, which):
    """Number of fine steps in the leap WHOLE, LONGER or PART."""
    if which == LONGER:
        return op.steps + 1
    return op.part_steps if which == PART else op.steps


@jit
def mixed_bytes(op):
    """Bytes of a row that is float32 from mode op.split on."""
    return DOUBLE * op.split + SINGLE * (op.padded - op.split)


@jit
def coefficient_bytes(op):
    """Bytes of all coefficients of a polarisation."""
    return mixed_coefficient(np.int64(0), op, LEAPS + 3 * op.leaps)


@inlined
def low_part(address, op):
    """The float64 part of a mixed row at an address, (split,)."""
    return floats_at(address, op.split)


@inlined
def high_part(address, op):
    """The float32 part of a mixed row at an address, from mode `split` on, (padded - split,)."""
    return samples_at(address + DOUBLE * op.split, op.padded - op.split)


@jit
def number_at(address, op, j):
    """Number `j` of a mixed row at an address."""
    if j < op.split:
        return low_part(address, op)[j]
    return np.float64(high_part(address, op)[j - op.split])


# The largest part of a float32 mode's motion that a leap keeps. Each coefficient, product and sum is rounded by at most
# 2^-24 of itself: with |cos| + |sin| <= 2^0.5 that adds 3.9 2^-24 of the amplitude. The limit allows for 4 2^-24.
MAX_LEFT = 1.0 - 2.0**-22


@jit
def put_number(address, op, j, x):
    """Sets number `j` of a mixed row at an address, rounded if it is float32."""
    if j < op.split:
        low_part(address, op)[j] = x
    else:
        high_part(address, op)[j - op.split] = x


@inlined
def coefficient(op, row):
    """Row KAPPA, OMEGA or SIGMA of u's coefficients, (padded,)."""
    return coefficient_at(op.coefficients, op, row)


@inlined
def coefficient_at(address, op, row):
    """Row KAPPA, OMEGA or SIGMA of the coefficients at `address`, u's or v's, (padded,)."""
    return floats_at(address + DOUBLE * row * op.padded, op.padded)


@jit
def mixed_coefficient(address, op, row):
    """Address of row KEPT, SPRING, PACE or one from LEAPS on of the coefficients at `address`."""
    return address + WIDE_ROWS * DOUBLE * op.padded + row * mixed_bytes(op)


@jit
def shape_row(op, m):
    """Address of the mode shapes at contact point `m`, m^-0.5."""
    return op.shapes + m * mixed_bytes(op)


@jit
def tap_row(op, row):
    """Address of the modes' weights in tap `row`."""
    return op.taps + row * mixed_bytes(op)


@inlined
def heights(op):
    """Heights of the contact points, (points,), m."""
    return floats_at(op.heights, op.points)


@inlined
def hand_heights(op):
    """Heights of the contact points on the neck that the hand measures its force by, (points,), m."""
    return floats_at(op.hand_heights, op.points)


@inlined
def positions(op):
    """Positions of the contact points, (points,), m from the stop."""
    return floats_at(op.positions, op.points)


@jit
def place_of(contact, ops):
    """Returns the place of a CONTACT: its fret, or m from the nut over a board. `ops`: its string's operators."""
    op = ops[contact.fret]
    if ops[0].points <= MAX_NEAR:  # frets, of which those beyond the one that the string lies on are its points
        return np.float64(ops[0].points - op.points + 1 + contact.point)
    return ops[0].length - op.length + positions(op)[min(contact.point, op.points - 1)]


@inlined
def exchange_row(op, row):
    """Row e, or u, v or d of Delta, of the exchange between u and v, (turned,): law.exchange."""
    return floats_at(op.turning + DOUBLE * row * op.turned, op.turned)


@inlined
def coupling(op, m):
    """Row `m` of W, (points,): m of u at contact point `m` per unit f at each; not for boards."""
    return floats_at(op.coupling + DOUBLE * m * op.points, op.points)


@inlined
def yields(op, m):
    """Row `m` of the static compliance of a draped string, (points,): m of u at point `m` per unit f at each."""
    return floats_at(op.yields + DOUBLE * m * op.points, op.points)


@inlined
def left_out(op, m):
    """Row `m` of R, (points,): like `coupling`, but static, by the omitted modes; not for boards."""
    return floats_at(op.left_out + DOUBLE * m * op.points, op.points)
