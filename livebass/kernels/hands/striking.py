"""The right hand: plucks, strikes, and a thrown thumb.

`string` is a STRING, `ops` the operators of its frets. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands import thumb
from livebass.kernels.hands.fretting import prepare_string
from livebass.kernels.hands.noise import begin_click, begin_skin
from livebass.kernels.hands.pulling import MAX_NEPERS, grip, release_held_shape, shape_of_strike, shapes_of_pluck
from livebass.kernels.machine.elementary import cos, sin
from livebass.kernels.string import modal, touch
from livebass.kernels.string.operators import tap_row
from livebass.kernels.string.slot import SAFETY, SAFETY_STRUCK, remove_thumb, wake_slot, wake_v

TOUCHED_BEFORE = 0.5e-3  # s from touching a sounding string to the strike
NARROW = 1.6  # `safety` times sqrt(p (1 - p)) of a pluck at the part p of the length: pulses reached 1.4 on a board


@jit
def lift_fingers(string, frames):
    """Lifts all fingers off the string within `frames`; at once if it is at rest."""
    voice, slot = string.voice, string.slots[string.voice.slot]
    if slot.on:
        touch.lift_touches(voice, frames / voice.rate)
    else:
        touch.clear_touches(voice)


@jit
def begin_stroke(string, ops, event, frames):
    """Prepares the string for a stroke's event; returns its slot.

    Fingers on the string lift within `frames` frames after the stroke's wait; a striking thumb is removed.
    """
    voice = string.voice
    prepare_string(string, ops, event.fret)
    voice.wait = np.int64(np.rint(event.wait * voice.rate))
    voice.waiting = voice.wait
    lift_fingers(string, voice.wait + frames)
    slot = string.slots[voice.slot]
    slot.on = 1
    slot.touching = 0
    remove_thumb(slot)
    voice.striking = 0
    return slot


@jit
def begin_pluck(string, ops, event):
    """Grips the string with a finger, which waits, pulls it for voice.pull frames and lets go.

    If the event has no width, release or angle, the string's own applies.
    """
    voice, slots = string.voice, string.slots
    sounding = slots[voice.slot].on
    op = ops[event.fret]
    slot = begin_stroke(string, ops, event, voice.pull)
    apex, position = event.apex, event.place
    rounding = event.width if event.width != 0.0 else voice.rounding
    release = event.seconds if event.seconds != 0.0 else voice.release
    angle = event.angle if event.angle != 0.0 else voice.angle
    part = position / op.length
    voice.pulse = max(SAFETY, NARROW / np.sqrt(max(part * (1.0 - part), 1e-4)))
    if angle != 0.0:
        wake_v(slot, op)
    shapes_of_pluck(slot, op, cos(angle) * apex, sin(angle) * apex, position, rounding, release)
    if sounding and (slot.active > 0 or slot.v_active > 0):
        grip(voice, slot, op, position, max(voice.pull, 1), MAX_NEPERS, 0.0)
    for i in range(max(voice.pickups, 1)):
        voice.held[i] = modal.dot_of_row(op, tap_row(op, i), slot.u.held, op.tap_modes)
        voice.held_across[i] = 0.0
        if slot.v_ready:
            row = i if voice.pickups > 0 else 2 * voice.denominator
            voice.held_across[i] = modal.dot_of_row(op, tap_row(op, row), slot.v.held, op.tap_modes)
    begin_skin(voice, event.speed)
    begin_click(voice, event.value)
    voice.pulling = voice.pull + 1 if voice.pull > 0 else 0  # this frame counts one down already
    if voice.pull == 0:
        voice.waiting = 0
        release_held_shape(voice, slot, op, voice.follow)


@jit
def begin_strike(string, ops, event):
    """Throws the string down with the thumb, over voice.strike frames."""
    voice, slots = string.voice, string.slots
    sounding = slots[voice.slot].on
    op, position = ops[event.fret], event.place
    slot = begin_stroke(string, ops, event, voice.strike)
    if sounding and (slot.active > 0 or slot.v_active > 0):
        # the thumb lies on the string, then throws it
        grip(voice, slot, op, position, max(voice.strike // 2, 1), MAX_NEPERS, 0.0)
    shape_of_strike(slot.u, op, event.apex, position, voice.strike_width)
    voice.striking = voice.strike
    slot.safety = SAFETY_STRUCK
    wake_slot(slot, op, voice.step)


@jit
def throw_mass(string, ops, event):
    """Throws the thumb, or the event's mass, on the string; touches a sounding string 0.5 ms before.

    If the string must get to another fret first, the thumb waits for it.
    """
    voice, op = string.voice, ops[event.fret]
    if not 0.0 < event.speed < np.inf:
        return
    sounding = string.slots[voice.slot].on
    slot = begin_stroke(string, ops, event, np.int64(np.rint(TOUCHED_BEFORE * voice.rate)))
    voice.fingering = 0
    thumb.set_out(slot.thumb, voice, op, event)
    if sounding and (slot.active > 0 or slot.v_active > 0):
        slot.thumb.wait = max(np.int64(np.rint(TOUCHED_BEFORE * voice.rate)), 1)
        grip(voice, slot, op, event.place, slot.thumb.wait, MAX_NEPERS, 0.0)
    slot.safety = SAFETY_STRUCK
    wake_slot(slot, op, voice.step)
