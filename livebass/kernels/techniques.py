"""How fingers, thumb and arm act on one string: plucks, strikes, bends, the change to another fret.

A string has two slots. A new note on the fret that sounds already goes into the same motion; on another fret it starts
in the other slot while the finger damps the old one, in a few milliseconds, without a click. `string` is a STRING,
`ops` the operators of its frets. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels import modal
from livebass.kernels.elementary import cos, exp, exp2, sin
from livebass.kernels.operators import heights, positions, tap
from livebass.kernels.preparing import FADE_TO
from livebass.kernels.slot import SAFETY_STRUCK, bend, change_operator, disturb, forget_contact, load, open_v

FADE_RATE = 450.0  # 1/s of the finger that leaves a note for another fret
FINGER_NEPERS = 5.0  # damping, at an antinode, of a finger that takes hold of a sounding string
BEND_FRAMES = 128  # pitch bend is followed so often, one string after the other ...
BEND_SPEED = 400.0  # semitones/s, ... and not faster


@jit
def shape_of_pluck(w, op, apex, position, rounding):
    """Fills w.held with the modal amplitudes of the shape a finger holds (model.modes.pluck_amplitudes)."""
    length = op.length
    k1 = np.pi / length
    corner = np.sqrt(2 / length) * apex * length / (position * (length - position))
    for j in range(op.padded):
        w.held[j] = 0.0
    for j in range(op.modes):
        k = (j + 1) * k1
        smooth = exp(-0.5 * (k * rounding) ** 2) / (1 + op.held_stiffness * (k * k))
        w.held[j] = corner * sin(k * position) / (k * k) * smooth


@jit
def shape_of_strike(w, op, depth, position, width):
    """Fills w.strike with modal velocities: an impulse that pushes an endless string down by `depth`."""
    k1 = np.pi / op.length
    for j in range(op.padded):
        w.strike[j] = 0.0
    for j in range(op.modes):
        k = (j + 1) * k1
        smooth = exp(-0.5 * (k * width) ** 2)
        w.strike[j] = -2 * op.speed * depth * np.sqrt(2 / op.length) * sin(k * position) * smooth


@jit
def grazing(op, position):
    """Apex (m) of a pluck at `position` (m) that just reaches a fret: model.modes.grazing_apex."""
    a = op.length - position
    place, height = positions(op), heights(op)
    least = np.inf
    for m in range(op.points):
        x = place[m]
        shape = x / a if x < a else (op.length - x) / (op.length - a)
        least = min(least, -height[m] / shape)
    if np.isinf(least):
        return op.graze
    return least


@jit
def touch(voice, slot, op, position, frames):
    """Lays the plucking finger on the string at `position` for some frames: modes with a node there go on."""
    u = slot.u
    k1 = np.pi / op.length
    for j in range(op.padded):
        shape = sin((j + 1) * k1 * position)
        u.finger[j] = exp(-FINGER_NEPERS / frames * shape * shape)
    if slot.v_ready:
        modal.copy(slot.v.finger, u.finger, op.padded)
    voice.fingering = frames


@jit
def pulled(voice, left):
    """Part of the held shape there is with `left` frames of the pull to go, and its change a second."""
    t = (voice.pull - left) / voice.pull
    return 0.5 - 0.5 * cos(np.pi * t), 0.5 * np.pi * sin(np.pi * t) / voice.pull * voice.rate


@jit
def interrupt(string, ops):
    """Takes away a finger in the middle of its pull: the string goes on from where it is, as fast as it is."""
    voice = string.voice
    if 0 < voice.pulling <= voice.pull:
        slot = string.slots[voice.slot]
        op = ops[slot.fret]
        up, moving = pulled(voice, voice.pulling - 1)
        leave(slot.u, op, up, moving)
        if slot.v_ready:
            leave(slot.v, op, up, moving)
            slot.v_active = op.padded
        disturb(slot, op, voice.step)
    voice.pulling = 0


@jit
def leave(w, op, up, moving):
    """Adds `up` times the held shape, moving by `moving` times it a second."""
    for j in range(op.padded):
        x = w.held[j]
        w.q[j] += up * x
        w.p[j] += w.kappa[j] * (moving + w.sigma[j] * up) * x


@jit
def take_string(string, ops, fret):
    """Returns the slot in which `fret` is to sound; a note on another fret begins to fade."""
    voice, slots = string.voice, string.slots
    interrupt(string, ops)
    slot = slots[voice.slot]
    if slot.on and (slot.fret != fret or slot.fading):
        if not slot.fading:
            slot.fading = 1
        slot.hand = min(slot.hand, exp(-FADE_RATE / voice.rate))
        voice.striking = 0
        voice.fingering = 0
        voice.slot = 1 - voice.slot
        slot = slots[voice.slot]
        slot.on = 0
    if not slot.on:
        slot.fret = fret
        load(slot, ops[fret], voice.step)
        if voice.tuned != 1.0:
            bend(slot, ops[fret], voice.tuned, highest(voice))
    slot.hand = 1.0
    return voice.slot


@jit
def pluck(string, ops, fret, apex, position):
    """Takes the string with a finger, which pulls it for voice.pull frames and lets go. Lengths in m from the stop.

    It pulls at voice.angle from u, away from the neck, towards v, across.
    """
    voice, slots = string.voice, string.slots
    sounding = slots[voice.slot].on
    k = take_string(string, ops, fret)
    slot = slots[k]
    op = ops[fret]
    slot.on = 1
    slot.touching = 0
    voice.striking = 0
    if voice.angle != 0.0:
        open_v(slot, op)
    shape_of_pluck(slot.u, op, cos(voice.angle) * apex, position, voice.rounding)
    if slot.v_ready:
        shape_of_pluck(slot.v, op, sin(voice.angle) * apex, position, voice.rounding)
    if sounding and (slot.active > 0 or slot.v_active > 0):
        touch(voice, slot, op, position, max(voice.pull, 1))
    for i in range(max(voice.pickups, 1)):
        voice.held[i] = modal.tap_held(slot.u, tap(op, i), op.tap_modes)
        voice.held_across[i] = 0.0
        if slot.v_ready:
            row = i if voice.pickups > 0 else 2 * voice.denominator
            voice.held_across[i] = modal.tap_held(slot.v, tap(op, row), op.tap_modes)
    voice.pulling = voice.pull + 1 if voice.pull > 0 else 0  # this frame counts one down already
    if voice.pull == 0:
        let_go(voice, slot, op)


@jit
def let_go(voice, slot, op):
    """Releases the held shape."""
    modal.release(slot.u, op.padded)
    if slot.v_ready:
        modal.release(slot.v, op.padded)
        slot.v_active = op.padded
        forget_contact(slot.v, op)
    disturb(slot, op, voice.step)


@jit
def strike(string, ops, fret, depth, position):
    """Throws the string down at `position` (m from the stop) with the thumb, over voice.strike frames."""
    voice, slots = string.voice, string.slots
    sounding = slots[voice.slot].on
    k = take_string(string, ops, fret)
    slot = slots[k]
    op = ops[fret]
    slot.on = 1
    slot.touching = 0
    if sounding and (slot.active > 0 or slot.v_active > 0):
        # it lies on the string, then throws it
        touch(voice, slot, op, position, max(voice.strike // 2, 1))
    shape_of_strike(slot.u, op, depth, position, voice.strike_width)
    voice.striking = voice.strike
    slot.safety = SAFETY_STRUCK
    disturb(slot, op, voice.step)


@jit
def highest(voice):
    """Highest frequency (rad/s) that the audio rate carries: what a bend takes above is left out."""
    return 2 * np.pi * FADE_TO * voice.rate


@jit
def follow_bend(string, ops):
    """Tunes the string a little nearer to the bend: no faster than an arm can, or a string would gain energy by it."""
    voice = string.voice
    most = exp2(BEND_SPEED * BEND_FRAMES / (12.0 * voice.rate))
    voice.tuned = min(max(voice.bend, voice.tuned / most), voice.tuned * most)
    for k in range(2):
        slot = string.slots[k]
        if slot.on:
            bend(slot, ops[slot.fret], voice.tuned, highest(voice))
            disturb(slot, ops[slot.fret], voice.step)


@jit
def excite(voice, slot, op):
    """Applies finger and thumb to the string before this frame's motion."""
    n = op.padded
    if voice.fingering > 0:
        modal.finger(slot.u, n)
        modal.finger(slot.v, slot.v_active)
        voice.fingering -= 1
    if voice.pulling > 0:
        voice.pulling -= 1
        if voice.pulling == 0:
            let_go(voice, slot, op)
    if voice.striking > 0 and voice.fingering == 0:
        # a raised cosine of force whose sum over the frames is one
        t = (voice.strike - voice.striking) / voice.strike
        modal.push(slot.u, (1 - cos(2 * np.pi * t)) / voice.strike, n)
        voice.striking -= 1
        disturb(slot, op, voice.step)


@jit
def change_operators(string, old, ops):
    """Makes the string go on with operators `ops` in place of `old`: other modes, another contact rate.

    Both have whole fine steps in a frame. Displacement and velocity of the modes they share stay.
    """
    voice = string.voice
    voice.numerator = ops[0].steps
    voice.step = voice.frame * voice.numerator
    for k in range(2):
        slot = string.slots[k]
        if slot.on:
            change_operator(slot, old[slot.fret], ops[slot.fret])
            if voice.tuned != 1.0:
                bend(slot, ops[slot.fret], voice.tuned, highest(voice))
            disturb(slot, ops[slot.fret], voice.step)
