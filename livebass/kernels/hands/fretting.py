"""The left hand at the frets: stopping the string, hammer-ons and pull-offs.

`string` is a STRING, `ops` the operators of its frets. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands.pulling import end_pull, grip, release_held_shape, shapes_of_pluck
from livebass.kernels.machine.native import copy_record
from livebass.kernels.string import draped, glide, handover, modal, runs, stop
from livebass.kernels.string.slot import (
    SAFETY,
    SAFETY_HANDED,
    change_operator,
    highest_frequency,
    load_tuned,
    tune_slot,
    wake_slot,
    wake_v,
)

PULLING_FINGER = 4e-3  # m, half width of the left-hand finger that plucks as it leaves a fret
GENTLY = 0.0  # a finger's speed
# Damping by a hammering finger (pulling.grip), and the part of it at a node: a fingertip is no point
HAMMER_NEPERS, HAMMER_SPARES = 80.0, 0.3


@jit
def prepare_string(string, ops, fret):
    """Prepares the string to sound at `fret`; gently presses down a string that sounds at another fret."""
    voice, slots = string.voice, string.slots
    voice.slide_to = -1
    end_pull(string, ops)
    slot = slots[voice.slot]
    if slot.on and not stands_at(slot, fret):
        change_fret(string, ops, fret, GENTLY, 0.0)
    elif not slot.on:
        load_slot(string, ops, voice.slot, fret)
        draped.hide_step(voice, slot, ops[fret])
    slots[voice.slot].hand = 1.0


@jit
def stands_at(slot, fret):
    """True if the slot plays `fret`."""
    return slot.fret == fret and not slot.between


@jit
def load_slot(string, ops, k, fret):
    """Makes the silent slot `k` ready for `fret`, in tune with the bend."""
    slot, voice = string.slots[k], string.voice
    if not string.slots[0].on and not string.slots[1].on:
        voice.begun = voice.frame
    slot.fret = fret
    load_tuned(slot, ops[fret], voice)


@jit
def change_fret(string, ops, fret, finger, held):
    """Hands the motion of a sounding string over to another fret (handover.py).

    On the way to a lower fret the string leaves its own at once, which sounds in proportion to `held`, 0 to 1; a finger
    that eases off lets it down silently.
    """
    voice = string.voice
    k = 1 - voice.slot
    old, new = string.slots[voice.slot], string.slots[k]
    op, to = glide.current_operator(string, ops, voice.slot), ops[fret]
    voice.striking = 0
    voice.fingering = 0
    voice.landing = 0
    load_slot(string, ops, k, fret)
    new.on = 1
    new.hand = old.hand
    new.fourth, new.owed = old.fourth, old.owed
    new.safety = max(old.safety, SAFETY_HANDED if op.length > to.length else SAFETY)
    if old.v_active > 0 or old.stop_v.place != 0.0:
        wake_v(new, to)
    shorter = op.length - to.length
    if abs(shorter) < handover.CLOSE:  # one high place of a board stops both
        copy_motion(old, op, new, to)
        if old.between:
            stop.begin_path(new.stop_u, old.stop_u.place, old.stop_u.speed, GENTLY, voice)
            stop.begin_path(new.stop_v, old.stop_v.place, old.stop_v.speed, GENTLY, voice)
    elif shorter > 0.0:
        # a gentle finger has pressed already: it only stops the string's motion
        crown = handover.crown_height(op, shorter) if finger > 0.0 else 0.0
        part = to.length / op.length  # of the line from a stop that still moves
        x, v, x_v, v_v = handover.to_shorter(old, op, new, to)
        u_stop, v_stop = old.stop_u, old.stop_v
        stop.begin_path(new.stop_u, x + part * u_stop.place - crown, v + part * u_stop.speed, finger, voice)
        if new.v_ready:
            stop.begin_path(new.stop_v, x_v + part * v_stop.place, v_v + part * v_stop.speed, finger, voice)
        new.moving = 1
        new.offset = crown + part * old.offset
        new.offset_speed = part * old.offset_speed
    else:
        crown = handover.crown_height(to, -shorter)
        new.offset = to.length / op.length * (old.offset - held * crown)
        new.offset_speed = to.length / op.length * old.offset_speed
        end = 1.0 if old.between else held  # a gliding finger moves the string but holds no shape
        at = held * crown + end * old.stop_u.place, end * old.stop_u.speed
        at_v = end * old.stop_v.place, end * old.stop_v.speed
        handover.to_longer(old, op, new, to, at, at_v)
    new.active = to.padded
    if new.v_ready:
        new.v_active = to.padded
    old.on = 0
    voice.slot = k
    if not new.moving:
        stop.lower_obstacles(new, to)
    wake_slot(new, to, voice.step)


@jit
def copy_motion(old, op, new, to):
    """Hands over a motion when the length stays the same."""
    n = min(op.modes, to.modes)
    handover.velocities(old.u, n)
    for j in range(n):
        handover.set_mode_state(new.u, j, old.u.q_before[j], old.u.p_before[j])
    modal.narrow(new.u, n)
    if new.v_ready:
        handover.velocities(old.v, n)
        for j in range(n):
            handover.set_mode_state(new.v, j, old.v.q_before[j], old.v.p_before[j])
        modal.narrow(new.v, n)
    copy_record(new.stop_u, old.stop_u)
    copy_record(new.stop_v, old.stop_v)
    new.moving = old.moving
    new.offset = old.offset
    new.offset_speed = old.offset_speed


@jit
def hammer_on(string, ops, event):
    """Presses the string down to the event's fret, without a pluck; a string at rest starts from the open position.

    The approaching finger damps a sounding string first.
    """
    voice = string.voice
    voice.slide_to = -1
    end_pull(string, ops)
    slot = string.slots[voice.slot]
    op = glide.current_operator(string, ops, voice.slot)
    x = op.length - ops[event.fret].length
    frames = np.int64(np.rint(event.seconds * voice.rate))
    if frames > 0 and slot.on and not slot.moving and x > handover.CLOSE:
        grip(voice, slot, op, x, frames, HAMMER_NEPERS, HAMMER_SPARES)
        voice.landing = frames
        voice.hammer_to = event.fret
        voice.hammer = event.speed
    else:
        press_down(string, ops, event.fret, event.speed)


@jit
def follow_hammer(string, ops):
    """Counts down a hammering finger's landing, then presses the string down."""
    voice = string.voice
    voice.landing -= 1
    if voice.landing == 0:
        press_down(string, ops, voice.hammer_to, voice.hammer)


@jit
def press_down(string, ops, fret, finger):
    """Presses the string down to `fret` at `finger` m/s."""
    voice = string.voice
    slot = string.slots[voice.slot]
    if not slot.on:
        load_slot(string, ops, voice.slot, np.int64(0))
        slot.on = 1
        slot.active = ops[0].padded
    slot.hand = 1.0
    if not stands_at(slot, fret):
        change_fret(string, ops, fret, finger, 1.0)
    string.slots[voice.slot].touching = 0


@jit
def pull_off(string, ops, event):
    """Pulls the finger off: it plucks the string where it was, and the string sounds on at the event's lower fret.

    The finger pulls the string sideways across the neck: the fret under it blocks the way down.
    """
    fret, apex = event.fret, event.apex
    voice = string.voice
    voice.slide_to = -1
    end_pull(string, ops)
    slot = string.slots[voice.slot]
    if not slot.on:
        return
    before = glide.current_operator(string, ops, voice.slot).length
    if not stands_at(slot, fret):
        change_fret(string, ops, fret, GENTLY, 1.0)
    slot = string.slots[voice.slot]
    op = ops[fret]
    x = op.length - before
    if x > handover.CLOSE and apex != 0.0:
        wake_v(slot, op)
        shapes_of_pluck(slot, op, 0.0, apex, x, PULLING_FINGER, 0.0)
        voice.pulse = SAFETY
        release_held_shape(voice, slot, op, 0.0)
    slot.touching = 0


@jit
def change_operators(string, old, ops):
    """Switches the string from operators `old` to `ops`: other modes, another contact rate.

    Both have whole fine steps per frame. Shared modes keep displacement and velocity.
    """
    runs.stop(string, old)
    voice = string.voice
    voice.numerator = ops[0].steps
    voice.step = voice.frame * voice.numerator
    if string.slots[voice.slot].on and string.slots[voice.slot].between:
        change_fret(string, old, string.slots[voice.slot].fret, GENTLY, 0.0)
        voice.slide_to = -1
    for k in range(2):
        slot = string.slots[k]
        if slot.on:
            change_operator(slot, old[slot.fret], ops[slot.fret])
            if voice.tuned != 1.0:
                tune_slot(slot, ops[slot.fret], voice.tuned, highest_frequency(voice))
            wake_slot(slot, ops[slot.fret], voice.step)
