"""Looks ahead: can a string over frets touch one of them within the next frames: those of a long run, or of a quartet?

The speed of the string bounds the time until a contact only roughly. This bound knows the motion. The float64 modes are
computed half way and at the end. Between two such times T apart a displacement whose acceleration is at most A
is nowhere lower than the lower of the two, less A T^2 / 8; A is the sum of the modes' amplitudes of acceleration. The
modes above count by the sum of their amplitudes. Tension that is greater by the part t turns a mode ahead by at most
omega t / 2 times the time, so the sum of the velocities bounds what it moves; t follows from the string's energy. ROOM
allows for what exchanges move.

The string is then clear until the last of these frames, whatever was known before. Where a long look is in doubt, short
ones find most of the quartets between two contacts. `slot` is a SLOT, `op` its OPERATOR, `voice` its string's VOICE.
[audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import square
from livebass.kernels.string import quartet
from livebass.kernels.string.operators import low_part, shape_row
from livebass.kernels.string.records import FOUR, LONG_RUN, MANY, QUARTET
from livebass.kernels.string.tension import MAXIMUM
from livebass.kernels.string.touch import linear_density

AGAIN = 8  # frames from a long look in doubt to the next
ROOM = 10e-6  # m


@jit
def greatest_tension(voice, slot, op):
    """The most that the string's motion can add to its tension, relative to the tension."""
    c = op.speed * slot.ratio
    slope = square(slot.fastest / (slot.safety * c)) * op.length
    return min(voice.stretch * slope / (linear_density(op) * c * c), MAXIMUM)


@jit
def is_clear_ahead(voice, slot, op, which):
    """True if the string, over frets, is clear of all points for the span `which` (quartet.py) from now."""
    u = slot.u
    n = min(u.split, slot.active)
    lasts = (LONG_RUN if which == MANY else QUARTET) * op.steps * op.fine
    fast, faster = quartet.foresee(u, n, which)
    bent = 0.03125 * lasts * lasts * faster + 0.5 * lasts * greatest_tension(voice, slot, op) * fast
    away = ROOM + np.sqrt(2.0 / op.length) * (bent + quartet.amplitudes_above(u, slot.active))
    for k in range(op.points):
        m = slot.doubtful + k
        m = m if m < op.points else m - op.points
        now, then, last = quartet.displacements(u, low_part(shape_row(op, m), op), n)
        if not min(now, min(then, last)) > u.height[m] + away:
            slot.doubtful = m
            return False
    return True


@jit
def look_far(voice, slot, op):
    """Looks a long run ahead; puts off the next check of the points if the string is clear."""
    step = voice.step
    if step < slot.doubted:
        return False
    if is_clear_ahead(voice, slot, op, MANY):
        slot.due = step + LONG_RUN * op.steps
        return True
    slot.doubted = step + AGAIN * op.steps
    return False


@jit
def look_near(voice, slot, op):
    """Looks a quartet ahead; puts off the next check of the points if the string is clear."""
    if not is_clear_ahead(voice, slot, op, FOUR):
        return False
    slot.due = voice.step + QUARTET * op.steps
    return True
