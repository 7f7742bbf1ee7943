"""Fingers that touch a sounding string: palm, ghost notes, harmonics. [audio thread]

Fingers are numbered (records.TOUCHES): the palm has the first three, harmonics the last, ghost notes the last two. Half
widths are standard deviations (touch.py): 2.3 and 3.5 mm match fingertips that touch 8 and 12 mm evenly. Resistances
are multiples of the string's impedance. `damping.lay_finger` lays them on the string; `string/touch.py` damps by them.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp2, power
from livebass.kernels.player.events import send_touch
from livebass.kernels.player.performer import FREE, HELD
from livebass.kernels.string.touch import characteristic_impedance
from livebass.rows.techniques import PALM

PALM_FINGERS, GHOST_FINGERS, NODE_FINGER = (0, 1, 2), (2, 3), 3
PALM_PLACES = (12e-3, 25e-3, 38e-3)  # m from the saddle
PALM_WIDTH = 5e-3  # m, half
# Of all three. By the damped string's eigenvalues the tight palm ends the fundamental soonest; a firmer one clamps the
# string and lets it ring up to the clamp.
LIGHT_PALM, TIGHT_PALM = 0.4, 13.0
KEY_PALM = 0.6  # the key switch's amount between them
GHOST_FRETS = (-0.6, 1.6)  # a ghost note's fingers, from the fret
GHOST_RESISTANCE, GHOST_WIDTH, GHOST_FORCE = 1.5, 3.5e-3, 0.7  # ; m, half; part of the force
GHOST_PLACE = 5  # fret where an open string is damped for a ghost note
# A harmonic's finger on its node: just firm enough to end the partials without a node there soonest, by the damped
# string's eigenvalues (at the middle, 2 absorbs everything), until they are down 60 dB, and at least NODE_TIME
NODE_RESISTANCE, NODE_PERIODS = (2.0, 1.7, 1.7, 1.8, 1.6, 1.4, 1.4), (2.0, 3.0, 6.0, 9.0, 13.0, 20.0, 26.0)
NODE_WIDTH, NODE_TIME = 2.3e-3, 65e-3  # m, half; s


@jit
def touch_node(p, op, i, number):
    """Lays a finger on the node of harmonic `number` nearest to the stop."""
    resistance = NODE_RESISTANCE[number - 2] * characteristic_impedance(op)
    seconds = max(NODE_TIME, NODE_PERIODS[number - 2] * 2.0 * op.length / op.speed)
    place = op.length - op.length / number
    send_touch(p, i, np.int64(NODE_FINGER), place, resistance, NODE_WIDTH, seconds + p.hands.late)


@jit
def touch_ghost(p, ops, i, stop, fret):
    """Lays two fingers around `fret` on a string stopped at `stop`."""
    for k in range(2):
        place = ops[i, 0].length * exp2(-(fret + GHOST_FRETS[k]) / 12.0)
        send_touch(
            p, i, GHOST_FINGERS[k], place, GHOST_RESISTANCE * characteristic_impedance(ops[i, stop]), GHOST_WIDTH, 0.0
        )


@jit
def palm_is_pressed(p):
    """True if the player palm-mutes."""
    return p.controls.palm > 0.0 or p.switched[PALM] > 0


@jit
def palm_is_on(p):
    """True if the player palm-mutes, or a palm always rests on the strings."""
    return p.player.palm_resistance > 0.0 or palm_is_pressed(p)


@jit
def touch_palm(p, ops, i):
    """Lays the palm on string `i` as firmly as asked for, or lifts it.

    A palm that always rests on the strings is one wide finger, from its own resistance to that pressed hardest.
    """
    amount, player = max(p.controls.palm, KEY_PALM if p.switched[PALM] > 0 else 0.0), p.player
    if player.palm_resistance > 0.0:
        resistance = player.palm_resistance * power(player.palm_pressed / player.palm_resistance, amount)
        send_touch(p, i, PALM_FINGERS[0], player.palm_place, resistance, player.palm_width, 0.0)
        return
    firm = LIGHT_PALM * power(TIGHT_PALM / LIGHT_PALM, amount) if amount > 0.0 else 0.0
    resistance = firm / 3.0 * characteristic_impedance(ops[i, 0])
    for k in range(3):
        send_touch(p, i, PALM_FINGERS[k], PALM_PLACES[k], resistance, PALM_WIDTH, 0.0)


@jit
def leave_string(p, i):
    """Records that all fingers, and the palm of a tablature's stroke, lift off string `i`."""
    p.hands.palmed &= ~(1 << i)
    p.hands.ghosted &= ~(1 << i)


@jit
def hand_lies_across(p):
    """True while a hand mutes the idle strings, too: a pressed palm, or the left hand, flat for a ghost note.

    They lie there as long as the note is held. A palm that always rests on the strings damps the idle ones as the
    player's resting hand does.
    """
    lying = p.hands.palmed | p.hands.ghosted
    for i in range(p.strings):
        if p.hands.state[i] == HELD and (lying >> i) & 1:
            return True
    return palm_is_pressed(p)


@jit
def touch_palms(p, ops):
    """Lays the palm on every played string, or lifts it."""
    for i in range(p.strings):
        if p.hands.state[i] != FREE:
            touch_palm(p, ops, i)
