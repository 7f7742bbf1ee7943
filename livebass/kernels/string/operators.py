"""The rows of an operator that lie in the pool, as arrays.

An operator holds their addresses (records.py): the coefficients of its modes, the weights of taps and the mode shapes
at contact points, a row of `padded` float64 each; heights and positions of the contact points; W and R between them, a
row of `points` each, which a board does without. No other file knows how the pool is laid out, but preparing.py, which
fills it. [any thread]
"""

from livebass.compiling import inlined
from livebass.kernels.machine.native import floats_at

DOUBLE = 8  # bytes

# The rows of coefficients in their order; LEAPS: rows a, b and g of each of the three leaps
LOSS, SPRING, LEAPS = 0, 1, 2
KAPPA, OMEGA, SIGMA, PACE = 11, 12, 13, 14
COEFFICIENT_ROWS = 15


@inlined
def coefficient(op, row):
    """Row LOSS to PACE of the coefficients of the modes of u, (padded,)."""
    return coefficient_at(op.coefficients, op, row)


@inlined
def coefficient_at(address, op, row):
    """Row LOSS to PACE of the coefficients at `address`, those of u or of v, (padded,)."""
    return floats_at(address + DOUBLE * row * op.padded, op.padded)


@inlined
def shape(op, m):
    """Mode shapes at contact point `m`, (padded,), m^-0.5."""
    return floats_at(op.shapes + DOUBLE * m * op.padded, op.padded)


@inlined
def tap_weights(op, row):
    """Weights of the modes in tap `row`, (padded,)."""
    return floats_at(op.taps + DOUBLE * row * op.padded, op.padded)


@inlined
def heights(op):
    """Heights of the contact points, (points,), m."""
    return floats_at(op.heights, op.points)


@inlined
def positions(op):
    """Positions of the contact points, (points,), m from the stop."""
    return floats_at(op.positions, op.points)


@inlined
def coupling(op, m):
    """Row `m` of W, (points,): m of u at contact point `m` per unit f at each; not of a board."""
    return floats_at(op.coupling + DOUBLE * m * op.points, op.points)


@inlined
def left_out(op, m):
    """Row `m` of R, (points,): the same as `coupling` by the modes left out, static; not of a board."""
    return floats_at(op.left_out + DOUBLE * m * op.points, op.points)
