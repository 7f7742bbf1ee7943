"""Fingers that touch a string, and hands that end its note.

`string` is a STRING, `ops` the operators of its frets. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands.fretting import GENTLY, change_fret
from livebass.kernels.hands.noise import haste_of_ending, knock_string
from livebass.kernels.hands.pulling import end_pull
from livebass.kernels.machine.elementary import exp
from livebass.kernels.string import glide, handover, touch
from livebass.kernels.string.records import TOUCHES
from livebass.kernels.string.slot import remove_thumb

DEFAULT_DAMPING = 90.0  # 1/s: how firmly hands end a note
# The fingers that end a note: places from the stop towards the nut, m, and firmness, in impedances of the string. The
# distances are uneven, or modes with nodes at all of them would ring; the last is another finger, farther back.
EASED, EASING = (0.0, -21e-3, -58e-3, 95e-3), (1.8, 1.25, 1.25, 1.25)
PRESSED, EASING_OFF = 150.0, 25e-3  # firmness of the finger as it leaves the fret; s
# The same for an open string, parts of its length from the saddle: a right-hand finger, then the left hand's
RESTED, RESTING = (0.17, 0.56, 0.665, 0.75), (0.7, 0.5, 0.5, 0.5)
FINGER_WIDTH, FRET_WIDTH = 3.5e-3, 1.2e-3  # m, half; the second for the finger that eases off
ENDING = 12e-3  # s: landing time of these fingers
ALL_OVER = 12.0  # 1/s for all modes, from the rest of the hands nearby


@jit
def lay_finger(string, ops, event):
    """Lays a finger on the string, or lifts it: touch.begin_touch."""
    voice = string.voice
    touch.begin_touch(voice, event.finger, event.place, event.resistance, event.width, event.seconds, touch.LANDING)
    slot = string.slots[voice.slot]
    if slot.on:
        touch.note_landing(voice, slot, glide.current_operator(string, ops, voice.slot))


@jit
def end_note(string, ops, damping):
    """Ends the note: the finger eases off its fret but stays on the string; both hands damp an open string.

    `damping` (1/s) sets the firmness: DEFAULT_DAMPING is a player's fingers, 0 lets the string ring on. Hands differ
    from note to note as the player's `release_spread` says.
    """
    voice = string.voice
    slot = string.slots[voice.slot]
    if damping <= 0.0 or not slot.on:
        return
    voice.slide_to = -1
    end_pull(string, ops)
    if not slot.on:
        return
    remove_thumb(slot)
    haste = haste_of_ending(voice)
    knock_string(voice, slot, glide.current_operator(string, ops, voice.slot), haste)
    damping *= haste
    firm = damping / DEFAULT_DAMPING * touch.characteristic_impedance(ops[0])
    stopped = glide.current_operator(string, ops, voice.slot).length
    x = ops[0].length - stopped
    voice.striking = 0
    if x > handover.CLOSE or slot.between:
        firm *= np.sqrt(stopped / ops[0].length)  # fingers cover more of a short string
        change_fret(string, ops, np.int64(0), GENTLY, 0.0)
        for i in range(TOUCHES):
            place = min(max(stopped + EASED[i], 0.0), 0.98 * ops[0].length)
            touch.begin_touch(voice, i, place, EASING[i] * firm, FINGER_WIDTH if i > 0 else FRET_WIDTH, 0.0, ENDING)
        touch.ramp_touch(voice, 0, PRESSED * firm, EASING_OFF)
    else:
        for i in range(TOUCHES):
            touch.begin_touch(voice, i, RESTED[i] * ops[0].length, RESTING[i] * firm, FINGER_WIDTH, 0.0, ENDING)
    slot = string.slots[voice.slot]
    slot.hand = exp(-ALL_OVER / DEFAULT_DAMPING * damping / voice.rate)
    touch.note_landing(voice, slot, ops[slot.fret])
