"""Fingers that lie on a string while it sounds: palm, ghost notes, harmonics. [audio thread]"""

from livebass.compiling import jit
from livebass.kernels.machine.elementary import power
from livebass.kernels.player.events import lay
from livebass.kernels.player.performer import FREE
from livebass.kernels.string.touch import impedance
from livebass.techniques import PALM

# Fingers by number (records.TOUCHES): the palm has the first three, harmonics the last, ghost notes the last two. Half
# their widths are standard deviations (touch.py): 2.3 and 3.5 mm those of fingertips that touch 8 and 12 mm evenly.
PALM_PLACES = (12e-3, 25e-3, 38e-3)  # m from the saddle
PALM_WIDTH = 5e-3  # m, half
# In all, in impedances of the string, as those that follow. By the eigenvalues of the damped string the fundamental
# dies soonest under the tight one; a firmer palm clamps the string, and lets it ring before the clamp.
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
def lay_on_node(op, i, number, frame, events, count):
    """Lays a finger on the node of harmonic `number` that is nearest to the stop; returns the new count."""
    place, resistance = op.length - op.length / number, NODE_RESISTANCE[number - 2] * impedance(op)
    seconds = max(NODE_TIME, NODE_PERIODS[number - 2] * 2.0 * op.length / op.speed)
    return lay(events, count, frame, i, 3, place, resistance, NODE_WIDTH, seconds)


@jit
def lay_palm(p, ops, i, frame, events, count):
    """Lays the palm on string `i` as firmly as it is wanted, or lifts it."""
    amount = max(p.palm, KEY_PALM if p.switched[PALM] > 0 else 0.0)
    firm = LIGHT_PALM * power(TIGHT_PALM / LIGHT_PALM, amount) if amount > 0.0 else 0.0
    resistance = firm / 3.0 * impedance(ops[i, 0])
    for k in range(3):
        count = lay(events, count, frame, i, k, PALM_PLACES[k], resistance, PALM_WIDTH, 0.0)
    return count


@jit
def tell_palm(p, ops, frame, events, count):
    """Lays the palm on every string that is played, or lifts it."""
    for i in range(p.strings):
        if p.state[i] != FREE:
            count = lay_palm(p, ops, i, frame, events, count)
    return count
