"""Tension follows the motion: a string that swings widely is longer, so that hard notes begin sharp.

The tension grows by dT = E A / (2 l) S, S = sum_j k_j^2 (q_j^2 + r_j^2) over the modes of u and v, the integral of the
squared slope, and l the length that stretches (Kirchhoff 1876, Carrier 1945). Each frame the modes get the force of it
as a kick, v_j <- v_j - (h dT / mu) k_j^2 q_j, after their free motion: a symplectic step. Its energy neither grows nor
falls in the mean; S is held within what makes dT a fifth of the tension. Only modes that turn by less than one radian a
frame take part: a kick on those near half the audio rate would resonate, and what they add cannot be heard. Where modes
are float32 in part, a motion that adds less than STEADY of the tension (slot.py) is left alone.

A hand in vibrato pulls the string tighter in the same manner, by a part of its tension. That glides from frame to
frame; frequencies that were set anew now and then would bring sidebands.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.string import modal
from livebass.kernels.string.records import BLOCK
from livebass.kernels.string.touch import linear_density

MOST = 0.2  # of the tension, by which it grows
MOST_TURN, FEW = 2.0, 8  # rad a frame, and modes, of a string in vibrato


@jit
def modes_below(slot, op, h, turn, most):
    """Number of modes, `most` or fewer by BLOCKs, of which none turns by more than `turn` rad in `h` s.

    A stiff string has fewer of them than one that is only tight.
    """
    n = min(np.int64(turn * op.length / (np.pi * op.speed * h)) // BLOCK * BLOCK, most)
    while n > 0 and slot.u.omega[min(n, op.modes) - 1] * h > turn:
        n -= BLOCK
    return max(n, 0)


@jit
def tighten_by_motion(voice, slot, op, h):
    """Applies the tension that the motion adds to the slot, for a frame of `h` s."""
    n = modes_below(slot, op, h, 1.0, slot.active)
    if n <= 0:
        return
    k1 = np.pi / op.length
    across = min(n, slot.v_active)
    total = k1 * k1 * (modal.slope_square(slot.u, n) + modal.slope_square(slot.v, across))
    mu = linear_density(op)
    more = min(voice.stretch * total, MOST * mu * op.speed * op.speed)
    push = h * more / mu * k1 * k1
    modal.tighten(slot.u, n, push)
    modal.tighten(slot.v, across, push)


@jit
def tighten_by_vibrato(slot, op, h, tighter):
    """Raises the tension by the part `tighter`, as a hand in vibrato does, for a frame of `h` s.

    Only modes that the audio rate carries take part, and no more than turn by MOST_TURN a frame.
    """
    n = modes_below(slot, op, h, MOST_TURN, max(slot.heard - BLOCK, FEW))
    k = np.pi / op.length * op.speed * slot.ratio
    push = h * tighter * k * k
    modal.tighten(slot.u, min(n, slot.active), push)
    modal.tighten(slot.v, min(n, slot.v_active), push)
