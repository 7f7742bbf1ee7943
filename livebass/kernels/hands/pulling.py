"""The finger that pulls the string: shapes, grips, the pluck in progress, and the release.

`string` is a STRING, `ops` the operators of its frets. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands import thumb
from livebass.kernels.hands.noise import is_pulling
from livebass.kernels.machine.elementary import cos, exp, sin, square
from livebass.kernels.string import draped, glide, modal
from livebass.kernels.string.frame import invalidate_contact
from livebass.kernels.string.operators import hand_heights, heights, positions
from livebass.kernels.string.records import COMING
from livebass.kernels.string.slot import SAFETY, rms_velocity, wake_slot

FINGER_NEPERS = 5.0  # damping, at an antinode, by a finger that grips a sounding string
MIN_GRAZE = 1e-4  # m, where a string lies on a fret
GRIPPED, MAX_NEPERS = 2.35, 12.0  # at least, for the fundamental: near the saddle the grip is firmer, up to the most


@jit
def shape_of_pluck(w, op, apex, position, rounding, release):
    """Fills w.held with a pluck's modal amplitudes (model.modes.pluck_amplitudes)."""
    length = op.length
    k1 = np.pi / length
    corner = np.sqrt(2 / length) * apex * length / (position * (length - position))
    w.held[: op.padded] = 0.0
    if apex == 0.0:
        return
    for j in range(op.modes):
        k = modal.mode_number(j) * k1
        smooth = exp(-0.5 * square(k * rounding)) / (1 + op.held_stiffness * (k * k))
        smooth /= 1 + (w.omega[j] * w.omega[j] + w.sigma[j] * w.sigma[j]) * (release * release)
        w.held[j] = corner * sin(k * position) / (k * k) * smooth


@jit
def shapes_of_pluck(slot, op, apex, across, position, rounding, release):
    """`shape_of_pluck` of u, with an `apex`, and of v, if it is ready, with the apex `across`."""
    u, v = slot.u, slot.v
    shape_of_pluck(u, op, apex, position, rounding, release)
    if not slot.v_ready:
        return
    if op.coefficients_v != op.coefficients or apex == 0.0:
        shape_of_pluck(v, op, across, position, rounding, release)
        return
    part = across / apex  # the modes of both have the same law
    for j in range(op.padded):
        v.held[j] = part * u.held[j]


@jit
def shape_of_strike(w, op, depth, position, width):
    """Fills w.strike with modal velocities: an impulse that pushes an endless string down by `depth`."""
    k1 = np.pi / op.length
    w.strike[: op.padded] = 0.0
    for j in range(op.modes):
        k = modal.mode_number(j) * k1
        smooth = exp(-0.5 * square(k * width))
        w.strike[j] = -2 * op.speed * depth * np.sqrt(2 / op.length) * sin(k * position) * smooth


@jit
def grazing(op, position):
    """Apex (m) of a pluck at `position` (m) that just reaches a fret: model.modes.grazing_apex."""
    return grazing_over(op, position, heights(op))


@jit
def unit_apex(op, position):
    """Apex (m) of an open-string pluck at `position` (m) with a force of 1: it grazes the hand's heights."""
    return max(grazing_over(op, position, hand_heights(op)), MIN_GRAZE)


@jit
def grazing_over(op, position, height):
    """`grazing` for contact points with other heights, (points,)."""
    a = op.length - position
    place = positions(op)
    minimum = np.inf
    for m in range(op.points):
        x = place[m]
        shape = x / a if x < a else (op.length - x) / (op.length - a)
        minimum = min(minimum, -height[m] / shape)
    if np.isinf(minimum):
        return op.graze
    return minimum


@jit
def grip(voice, slot, op, position, frames, maximum, minimum):
    """Lays a finger on the string at `position` for `frames` frames; modes with a node there survive.

    It damps an antinode by at most `maximum` nepers, a node by the part `minimum` of that.
    """
    u = slot.u
    k1 = np.pi / op.length
    first = sin(k1 * position)
    nepers = max(FINGER_NEPERS, GRIPPED / max(first * first, GRIPPED / maximum))
    for j in range(op.padded):
        shape = sin(modal.mode_number(j) * k1 * position)
        u.finger[j] = exp(-nepers / frames * max(shape * shape, minimum))
    if slot.v_ready:
        modal.copy_row(slot.v.finger, u.finger, op.padded)
    voice.fingering = frames


@jit
def pull_profile(voice, left):
    """Returns the fraction of the held shape with `left` frames to go, and its rate of change (1/s).

    At the end of the pull that rate is voice.follow: the finger still moves as it lets go.
    """
    t = (voice.pull - left) / voice.pull
    seconds = voice.pull / voice.rate
    up = 0.5 - 0.5 * cos(np.pi * t) + voice.follow * seconds * (t * t * (t - 1.0))
    return up, 0.5 * np.pi * sin(np.pi * t) / voice.pull * voice.rate + voice.follow * (t * (3.0 * t - 2.0))


@jit
def end_pull(string, ops):
    """Ends a pull early: the string continues from its present displacement and velocity."""
    voice = string.voice
    if is_pulling(voice):
        slot = string.slots[voice.slot]
        op = glide.current_operator(string, ops, voice.slot)
        up, moving = pull_profile(voice, voice.pulling - 1)
        modal.add_shape(slot.u, up, moving, op.padded)
        if slot.v_ready:
            modal.add_shape(slot.v, up, moving, op.padded)
            slot.v_active = op.padded
        wake_slot(slot, op, voice.step)
    voice.pulling = 0
    voice.waiting = 0
    voice.landing = 0
    slot = string.slots[voice.slot]
    if slot.active == 0 and slot.v_active == 0:
        slot.on = 0  # the finger had not pulled it yet


@jit
def release_held_shape(voice, slot, op, follow):
    """Releases the held shape, which grows by `follow` times itself per second."""
    u, n = slot.u, op.padded
    own = np.sqrt(modal.held_speed_square(u, follow, n) / op.length)
    fastest = slot.safety * rms_velocity(u, op, n) + voice.pulse * own
    modal.add_shape(u, 1.0, follow, n)
    whole = rms_velocity(u, op, n)
    if whole > 0.0:  # the earlier sound and the pluck each need their own
        slot.safety = max(SAFETY, min(max(slot.safety, voice.pulse), fastest / whole))
    if slot.v_ready:
        modal.add_shape(slot.v, 1.0, follow, op.padded)
        slot.v_active = op.padded
        invalidate_contact(slot.v, op)
    wake_slot(slot, op, voice.step)


@jit
def excite(voice, slot, op):
    """Applies finger and thumb to the string before this frame's motion."""
    n = op.padded
    if voice.fingering > 0:
        draped.leave_rest(slot, op)
        modal.damp_by_finger(slot.u, n, slot.u.finger)
        draped.return_to_rest(slot, op)
        modal.damp_by_finger(slot.v, slot.v_active, slot.v.finger)
        invalidate_contact(slot.u, op)  # the finger moves the string, so the earlier penetration is stale
        invalidate_contact(slot.v, op)
        voice.fingering -= 1
    if voice.waiting > 0:
        voice.waiting -= 1
        return
    if voice.pulling > 0:
        voice.pulling -= 1
        if voice.pulling == 0:
            release_held_shape(voice, slot, op, voice.follow)
    if voice.striking > 0 and voice.fingering == 0:
        # a raised cosine of force that sums to one over the frames
        t = (voice.strike - voice.striking) / voice.strike
        modal.add_strike(slot.u, n, slot.u.strike, (1 - cos(2 * np.pi * t)) / voice.strike)
        voice.striking -= 1
        wake_slot(slot, op, voice.step)
    if slot.thumb.on == COMING and not slot.moving:
        thumb.approach_string(slot, op)
