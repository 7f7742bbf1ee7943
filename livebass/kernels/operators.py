"""The rows of an operator that lie in the pool, as arrays: mode shapes at contact points, weights of taps.

An operator holds their addresses (records.py). No other file knows how the pool is laid out, but
engine/prepare.py, which fills it. [any thread]
"""

from livebass.compiling import inlined
from livebass.kernels.native import floats_at

DOUBLE = 8  # bytes


@inlined
def shape(op, m):
    """Mode shapes at contact point `m`, (padded,), m^-0.5."""
    return floats_at(op.shapes + DOUBLE * m * op.padded, op.padded)


@inlined
def tap(op, row):
    """Weights of the modes in tap `row`, (padded,)."""
    return floats_at(op.taps + DOUBLE * row * op.padded, op.padded)
