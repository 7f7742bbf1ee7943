"""Fingers that lie on a string while it sounds: palm, ghost notes, harmonics. [audio thread]

Fingers go by number (records.TOUCHES): the palm has the first three, harmonics the last, ghost notes the last two. Half
their widths are standard deviations (touch.py): 2.3 and 3.5 mm those of fingertips that touch 8 and 12 mm evenly.
Resistances are in impedances of the string.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp2, power
from livebass.kernels.player.events import send_touch
from livebass.kernels.player.performer import FREE
from livebass.kernels.string.touch import characteristic_impedance
from livebass.techniques import PALM

PALM_FINGERS, GHOST_FINGERS, NODE_FINGER = (0, 1, 2), (2, 3), 3
PALM_PLACES = (12e-3, 25e-3, 38e-3)  # m from the saddle
PALM_WIDTH = 5e-3  # m, half
# Of all three. By the eigenvalues of the damped string the fundamental dies soonest under the tight one; a firmer palm
# clamps the string, and lets it ring before the clamp.
LIGHT_PALM, TIGHT_PALM = 0.4, 13.0
KEY_PALM = 0.6  # of the way between them, by the key switch
GHOST_FRETS = (-0.6, 1.6)  # from the fret: where the fingers of a ghost note lie
GHOST_RESISTANCE, GHOST_WIDTH, GHOST_FORCE = 1.5, 3.5e-3, 0.7  # ; m, half; part of the force
GHOST_PLACE = 5  # fret at which an open string is damped for a ghost note
# The finger on a node of theirs: firm enough to end what has no node there soonest, by the eigenvalues of the damped
# string (at the middle 2 takes all that comes), for so many periods that 60 dB of it are gone, and at least NODE_TIME
NODE_RESISTANCE, NODE_PERIODS = (2.0, 1.7, 1.7, 1.8, 1.6), (2.0, 3.0, 6.0, 9.0, 13.0)
NODE_WIDTH, NODE_TIME = 2.3e-3, 65e-3  # m, half; s


@jit
def touch_node(p, op, i, number):
    """Lays a finger on the node of harmonic `number` that is nearest to the stop."""
    resistance = NODE_RESISTANCE[number - 2] * characteristic_impedance(op)
    seconds = max(NODE_TIME, NODE_PERIODS[number - 2] * 2.0 * op.length / op.speed)
    send_touch(p, i, np.int64(NODE_FINGER), op.length - op.length / number, resistance, NODE_WIDTH, seconds)


@jit
def touch_ghost(p, ops, i, stop, fret):
    """Lays two fingers about `fret` on a string that is stopped at `stop`."""
    for k in range(2):
        place = ops[i, 0].length * exp2(-(fret + GHOST_FRETS[k]) / 12.0)
        send_touch(
            p, i, GHOST_FINGERS[k], place, GHOST_RESISTANCE * characteristic_impedance(ops[i, stop]), GHOST_WIDTH, 0.0
        )


@jit
def palm_is_on(p):
    """True if the player mutes by the palm."""
    return p.controls.palm > 0.0 or p.switched[PALM] > 0


@jit
def touch_palm(p, ops, i):
    """Lays the palm on string `i` as firmly as it is wanted, or lifts it."""
    amount = max(p.controls.palm, KEY_PALM if p.switched[PALM] > 0 else 0.0)
    firm = LIGHT_PALM * power(TIGHT_PALM / LIGHT_PALM, amount) if amount > 0.0 else 0.0
    resistance = firm / 3.0 * characteristic_impedance(ops[i, 0])
    for k in range(3):
        send_touch(p, i, PALM_FINGERS[k], PALM_PLACES[k], resistance, PALM_WIDTH, 0.0)


@jit
def touch_palms(p, ops):
    """Lays the palm on every string that is played, or lifts it."""
    for i in range(p.strings):
        if p.hands.state[i] != FREE:
            touch_palm(p, ops, i)
