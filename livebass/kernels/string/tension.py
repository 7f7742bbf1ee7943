"""Tension follows the motion: a widely swinging string is longer, so hard notes start sharp.

The tension grows by dT = E A / (2 l) S, S = sum_j k_j^2 (q_j^2 + r_j^2) over the modes of u and v, the integral of the
squared slope, and l the stretching length (Kirchhoff 1876, Carrier 1945). Each frame the modes get its force as a kick,
v_j <- v_j - (h dT / mu) k_j^2 q_j, after their free motion: a symplectic step. On average its energy neither grows nor
falls; S is limited so dT never exceeds a fifth of the tension. Only modes that turn by less than one radian per frame
take part: a kick on modes near half the audio rate would resonate, and their effect is inaudible. If some modes are
float32, a motion that adds less than STEADY of the tension (slot.py) is ignored.

A hand in vibrato tightens the string in the same way, by a part of its tension. This glides from frame to frame;
frequencies reset now and then would cause sidebands.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.string import modal, quartet
from livebass.kernels.string.records import BLOCK
from livebass.kernels.string.touch import linear_density

MAXIMUM = 0.2  # of the tension: its largest growth
MAX_TURN, FEW = 2.0, 8  # rad per frame, and modes, of a string in vibrato


@jit
def modes_below(slot, op, h, turn, maximum):
    """Number of modes, `maximum` or fewer by BLOCKs, that turn by at most `turn` rad in `h` s.

    A stiff string has fewer such modes than an ideal one.
    """
    n = min(np.int64(turn * op.length / (np.pi * op.speed * h)) // BLOCK * BLOCK, maximum)
    while n > 0 and slot.u.omega[min(n, op.modes) - 1] * h > turn:
        n -= BLOCK
    return max(n, 0)


@jit
def tighten_by_motion(voice, slot, op, h):
    """Applies the tension that the slot's motion adds, for a frame of `h` s."""
    n = modes_below(slot, op, h, 1.0, slot.active)
    if n <= 0:
        return
    k1 = np.pi / op.length
    if slot.v_active > 0:
        total = k1 * k1 * modal.slope_square_of_both(slot.u, slot.v, n)
    else:
        total = k1 * k1 * modal.slope_square(slot.u, n)
    push = push_by(voice, op, h, total)
    modal.tighten(slot.u, n, push)
    modal.tighten(slot.v, min(n, slot.v_active), push)


@jit
def push_by(voice, op, h, total):
    """Kick of a velocity in `h` s, per j^2 q_j, by the tension that motion adds; `total` (m): its squared slope."""
    mu, k1 = linear_density(op), np.pi / op.length
    return h / mu * k1 * k1 * min(voice.stretch * total, MAXIMUM * mu * op.speed * op.speed)


@jit
def push_ahead(voice, slot, op, which):
    """The same for a frame of the span `which` (quartet.py), by the slope in its middle."""
    h, k1 = op.steps * op.fine, np.pi / op.length
    n = modes_below(slot, op, h, 1.0, slot.active)
    return push_by(voice, op, h, k1 * k1 * quartet.slope_square_ahead(slot.u, slot.v, n, which)) if n > 0 else 0.0


@jit
def tighten_by_vibrato(slot, op, h, tighter):
    """Raises the tension by the part `tighter`, as a hand in vibrato does, for a frame of `h` s.

    Only modes that the audio rate carries and that turn by at most MAX_TURN per frame take part.
    """
    n = modes_below(slot, op, h, MAX_TURN, max(slot.heard - BLOCK, FEW))
    k = np.pi / op.length * op.speed * slot.ratio
    push = h * tighter * k * k
    modal.tighten(slot.u, min(n, slot.active), push)
    modal.tighten(slot.v, min(n, slot.v_active), push)
