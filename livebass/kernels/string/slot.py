"""A slot, one sounding note of a string: loads, tunes, switches operators, drops dead modes.

frame.py, frets.py and board.py move it from frame to frame. [any thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import square
from livebass.kernels.string import draped, modal, turning
from livebass.kernels.string.frame import invalidate_contact
from livebass.kernels.string.operators import heights, is_exact
from livebass.kernels.string.preparing import FADE_TO
from livebass.kernels.string.records import BLOCK, MAX_NEAR, NONE, TOUCHES, UNKNOWN

FOR_EVER = 1 << 60  # a fine step
# Fastest point over the root mean square velocity from the string's energy: plucks reached 3.8 (hard, near the bridge),
# strings stopped at a higher fret 4.8, the narrow pulse of a thumb more.
SAFETY, SAFETY_HANDED, SAFETY_STRUCK = 5.0, 6.5, 10.0
SLACK = 0.02  # m/s
STEADY = 1e-7  # of the tension, 1e-4 cents: a motion that adds less is ignored
LOOSE = 4e-3  # of the tension: where the motion may add more, a long run, which takes its middle for all, errs too much
REST_EVERY = 64  # frames between checks for dead modes
STEEPEST = 0.1  # rms velocity over wave speed above which a motion is scaled back: no playing reaches a third of it


@jit
def until_rest(voice):
    """Frames until the next look for dead modes: 1 to REST_EVERY, and REST_EVERY when it is time for one.

    They count from the event that moved the string: so it always sounds the same.
    """
    return REST_EVERY - (voice.frame - voice.woken) % REST_EVERY


@jit
def load(slot, op, step):
    """Makes the silent `slot` ready to play operator `op`."""
    modal.take_coefficients(slot.u, op, op.coefficients)
    modal.clear_motion(slot.u, op.padded)
    slot.ratio = 1.0
    slot.heard = op.tap_modes
    slot.v_ready = 0
    slot.v_active = 0
    slot.fourth = 0
    slot.owed = 0
    slot.gentle = 0
    slot.safety = SAFETY
    slot.active = 0
    slot.still = 0
    slot.touching = 0
    slot.between = 0
    slot.moving = 0
    rest_stop(slot.stop_u)
    rest_stop(slot.stop_v)
    slot.offset = 0.0
    slot.offset_speed = 0.0
    reset_obstacles(slot, op)
    slot.hand = 1.0
    remove_thumb(slot)
    invalidate_contact(slot.u, op)
    if op.turned > 0:
        wake_v(slot, op)
    wake_slot(slot, op, step)


@jit
def load_tuned(slot, op, voice):
    """Makes the silent slot ready for operator `op`, in tune with the bend, at rest."""
    load(slot, op, voice.step)
    if voice.tuned != 1.0:
        tune_slot(slot, op, voice.tuned, highest_frequency(voice))
    elif op.draped:
        draped.settle(slot, op)  # as tune_slot does
    if op.draped:
        draped.lay(slot, op)
        slot.fastest = slot.safety * rms_velocity(slot.u, op, op.padded) + SLACK


@jit
def highest_frequency(voice):
    """Highest frequency (rad/s) that the audio rate carries: modes that a bend takes above it are dropped."""
    return 2 * np.pi * FADE_TO * voice.rate


@jit
def rest_stop(stop):
    """Puts the string's end to rest on its stop."""
    stop.place = 0.0
    stop.speed = 0.0


@jit
def reset_obstacles(slot, op):
    """Gives the obstacles the operator's heights."""
    modal.copy_row(slot.u.height, heights(op), op.points)
    slot.sunk = 0


@jit
def remove_thumb(slot):
    """Removes the striking mass, wherever it is."""
    slot.thumb.on = NONE


@jit
def wake_v(slot, op):
    """Makes the second polarisation ready to move, if it is not yet."""
    if slot.v_ready:
        return
    modal.take_coefficients(slot.v, op, op.coefficients_v)
    modal.clear_motion(slot.v, op.padded)
    invalidate_contact(slot.v, op)
    if slot.ratio != 1.0:
        modal.retune(slot.v, op, op.coefficients_v, slot.ratio)
    slot.v_ready = 1


@jit
def wake_slot(slot, op, step):
    """Makes all modes active and all contact points due after an event at `step`."""
    u = slot.u
    if slot.on:
        slot.active = op.padded
        slot.fastest = slot.safety * rms_velocity_with_answers(slot, op, op.padded) + SLACK
    slot.due = step
    slot.quiet = UNKNOWN
    slot.doubted = UNKNOWN
    slot.doubtful = 0
    slot.steady = 0
    u.due[: op.points] = UNKNOWN
    u.known_at[: op.points] = UNKNOWN
    if op.points > MAX_NEAR:
        u.group_due[:] = UNKNOWN
        u.group_known_at[:] = UNKNOWN


@jit
def rms_velocity(w, op, n):
    """Root mean square velocity (m/s) along the string if all energy of `n` modes were kinetic."""
    return np.sqrt(modal.speed_square(w, n) / op.length)


@jit
def rms_velocity_with_answers(slot, op, n):
    """`rms_velocity` of u if it also had all energy that it can get from answering strings and, if turned, from v."""
    v = rms_velocity(slot.u, op, n)
    if slot.answer_speed > 0.0:
        v = np.sqrt(v * v + slot.answer_speed / op.length)
    if op.turned > 0 and slot.v_ready:
        v = np.sqrt(v * v + modal.speed_square(slot.v, op.turned) / op.length)
    return v


@jit
def allow_exchange(slot, op):
    """Raises `fastest` to the speed that u can reach if it gets all energy of v."""
    slot.fastest = max(slot.fastest, slot.safety * rms_velocity_with_answers(slot, op, slot.active) + SLACK)


@jit
def tune_slot(slot, op, ratio, maximum):
    """Tunes the slot to `ratio` times the operator's frequencies without a jump of displacement or velocity.

    Modes above `maximum` (rad/s) are no longer heard.
    """
    modal.retune(slot.u, op, op.coefficients, ratio)
    if slot.v_ready:
        modal.retune(slot.v, op, op.coefficients_v, ratio)
    slot.ratio = ratio
    if op.draped:
        draped.settle(slot, op)
    slot.heard = op.tap_modes
    if ratio > 1.0:
        while slot.heard > 0 and slot.u.omega[min(slot.heard, op.modes) - 1] > maximum:
            slot.heard -= BLOCK


@jit
def change_operator(slot, old, op):
    """Switches the sounding slot from `old` to `op`, untuned."""
    modal.change_coefficients(slot.u, old, op, op.coefficients)
    reset_obstacles(slot, op)
    invalidate_contact(slot.u, op)
    if slot.v_ready:
        modal.change_coefficients(slot.v, old, op, op.coefficients_v)
        invalidate_contact(slot.v, op)
        slot.v_active = op.padded
    slot.ratio = 1.0
    if op.draped:
        draped.settle(slot, op)
    slot.heard = op.tap_modes
    slot.active = op.padded


@jit
def limit_motion(slot, op, factor):
    """Scales the motion by `factor`, the limit over its steepness; silences the slot if that is NaN."""
    if factor > 0.0:
        modal.scale(slot.u, slot.active, factor)
        modal.scale(slot.v, slot.v_active, factor)
        invalidate_contact(slot.u, op)
        invalidate_contact(slot.v, op)
    else:
        modal.clear_motion(slot.u, op.padded)
        modal.clear_motion(slot.v, op.padded)
        slot.active = 0
        slot.v_active = 0
        slot.on = 0


@jit
def steepness(w, op, n):
    """Root mean square velocity from the scheme's own invariant, over wave speed.

    Only hands raise it, never contact, friction or losses: a healthy string stays below STEEPEST whatever it hits.
    """
    return np.sqrt(modal.invariant(w, n) / op.length) / (op.fine * op.speed)


@jit
def silences_of(slot, op):
    """Velocities (m^1.5/s) below which a mode is silent, and one that no pickup senses; a hand that ends a note stays
    there until the next note.
    """
    if not is_exact(op):
        return modal.UNHEARD, modal.UNSENSED
    silence = modal.FAINT if slot.hand < 1.0 else modal.DEAD
    return silence, silence


@jit
def tightening(voice, op, steepest):
    """The most that a motion of that steepness in u and v adds to the tension, relative to the tension.

    The integral of the squared slope is at most steepness^2 times the length, in u and in v (tension.py).
    """
    maximum = voice.stretch * 2.0 * steepest * steepest * op.length
    return maximum * op.weight / square(op.fine * op.speed)


@jit
def is_touched(voice):
    """True if a finger lies on the string, comes or leaves."""
    touched = False
    for i in range(TOUCHES):
        touched = touched or voice.touches[i].resistance > 0.0 or voice.touches[i].wanted > 0.0
    return touched


@jit
def rest_slot(slot, op, voice):
    """Drops dead modes, limits the motion, and marks the string as quiet if it can no longer touch.

    Called every REST_EVERY frames.
    """
    u, step = slot.u, voice.step
    silences = silences_of(slot, op)
    if not op.draped:
        slot.active = modal.drop_dead_modes(u, slot.active, silences, slot.heard)
    if slot.v_active:
        slot.v_active = modal.drop_dead_modes(slot.v, slot.v_active, silences, slot.heard)
    if op.draped and draped.is_over(voice, slot, op):
        slot.active = 0
        slot.v_active = 0
    if slot.active == 0 and slot.v_active == 0:
        slot.on = 0
        return
    steepest = steepness(u, op, slot.active)
    if slot.v_active:
        steepest = max(steepest, steepness(slot.v, op, slot.v_active))
    if not steepest < STEEPEST:
        limit_motion(slot, op, STEEPEST / steepest)
        voice.weakened += 1
        return
    tighter = tightening(voice, op, steepest)
    slot.steady = np.int64(1 if tighter < STEADY and not is_exact(op) else 0)
    slot.gentle = np.int64(1 if tighter < LOOSE and turning.is_gentle(voice, slot, op) else 0)
    if op.draped:
        pressed = draped.speed_square_of_contact(slot, op, step) / op.length
        rms = np.sqrt(square(rms_velocity_with_answers(slot, op, slot.active)) + pressed)
        slot.fastest = min(slot.fastest, slot.safety * rms + SLACK)
    if op.points == 0 or slot.moving or slot.quiet > step:
        return
    held, height = False, heights(op)
    lowest = np.inf
    for m in range(op.points):
        held = held or (u.solved_at[m] == step and (u.eta[m] > 0.0 or u.eta_before[m] > 0.0))
        lowest = min(lowest, -height[m])
    if held:
        return
    if op.turned > 0:
        slot.fastest = slot.safety * turning.rms_velocity_soon(voice, slot, op, REST_EVERY) + SLACK
    else:
        slot.fastest = min(slot.fastest, slot.safety * rms_velocity_with_answers(slot, op, slot.active) + SLACK)
    fingers = is_touched(voice)  # these may pass motion on to other modes
    still = voice.depth == 0.0 and voice.depth_wanted == 0.0  # a vibrato widens the motion
    widest = modal.amplitude_sum(u, slot.active) + slot.answer_sum
    reach = np.sqrt(2.0 / op.length)
    if not still or fingers or not reach * widest < lowest:
        return
    if op.turned == 0 or reach * (widest + modal.amplitude_sum(slot.v, op.turned)) < lowest:
        slot.quiet = FOR_EVER
    elif reach * (widest + turning.amplitude_soon(voice, slot, op, REST_EVERY)) < lowest:
        slot.quiet = step + REST_EVERY * op.steps
