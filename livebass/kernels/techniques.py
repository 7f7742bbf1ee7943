"""What fingers, thumb and arm do to one string: plucks, strikes, bends, the change to another fret.

A string has two slots. A new note on the fret that sounds already goes into the same motion; on another fret it
starts in the other slot while the old one is damped out by the finger, a few milliseconds, without a click.
[audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels import modal as rows
from livebass.kernels import slot as stepping
from livebass.kernels.records import OP_HEIGHT, OP_POSITION, OP_TAP, ROW, VOICE_SLOTS

FADE_RATE = 450.0  # 1/s of the finger that leaves a note for another fret
FINGER_NEPERS = 5.0  # damping, at an antinode, of a finger that takes hold of a sounding string
BEND_FRAMES = 128  # pitch bend is followed so often, one string after the other ...
BEND_SPEED = 400.0  # semitones/s, ... and not faster
HEARD = 0.46  # of the audio rate: what a bend takes above is left out (operators.TAPER)


@jit
def shape_of_pluck(w, op, apex, position, rounding):
    """Fills SHAPE with the modal amplitudes of a rounded triangle (modes.pluck_amplitudes)."""
    length = op.length
    k1 = np.pi / length
    corner = np.sqrt(2 / length) * apex * length / (position * (length - position))
    for j in range(op.padded):
        w.held[j] = 0.0
    for j in range(op.modes):
        k = (j + 1) * k1
        w.held[j] = corner * np.sin(k * position) / (k * k) * np.exp(-0.5 * (k * rounding) ** 2)


@jit
def shape_of_strike(w, op, depth, position, width):
    """Fills STRIKE with modal velocities: an impulse that pushes an endless string down by `depth`."""
    k1 = np.pi / op.length
    for j in range(op.padded):
        w.strike[j] = 0.0
    for j in range(op.modes):
        k = (j + 1) * k1
        smooth = np.exp(-0.5 * (k * width) ** 2)
        w.strike[j] = -2 * op.speed * depth * np.sqrt(2 / op.length) * np.sin(k * position) * smooth


@jit
def grazing(op, pool, position):
    """The apex of a pluck at `position` (m) that just reaches a fret: modes.grazing_apex."""
    a = op.length - position
    least = np.inf
    for m in range(op.points):
        x = pool[op.start + OP_POSITION * ROW + m]
        shape = x / a if x < a else (op.length - x) / (op.length - a)
        least = min(least, -pool[op.start + OP_HEIGHT * ROW + m] / shape)
    if np.isinf(least):
        return op.graze
    return least


@jit
def touch(v, s, w, across, op, position, frames):
    """The plucking finger lies on the string at `position`: modes with a node there go on."""
    k1 = np.pi / op.length
    for j in range(op.padded):
        shape = np.sin((j + 1) * k1 * position)
        w.finger[j] = np.exp(-FINGER_NEPERS / frames * shape * shape)
    if s.across:
        rows.copy_row(across.finger, w.finger, 0, op.padded)
    v.fingering = frames


@jit
def pulled(v, left):
    """How much of the held shape there is with `left` frames of the pull to go, and its change a second."""
    t = (v.pull - left) / v.pull
    return 0.5 - 0.5 * np.cos(np.pi * t), 0.5 * np.pi * np.sin(np.pi * t) / v.pull * v.rate


@jit
def interrupt(string, ops):
    """A finger in the middle of its pull leaves: the string goes on from where it is, as fast as it is."""
    v, slots, w2 = string.voice, string.slots, string.work
    if 0 < v.pulling <= v.pull:
        s = slots[v.slot]
        op = ops[s.fret]
        w = w2[v.slot]
        up, moving = pulled(v, v.pulling - 1)
        leave(op, w, up, moving)
        if s.across:
            leave(op, w2[VOICE_SLOTS + v.slot], up, moving)
            s.swaying = op.padded
        stepping.disturb(s, op, w, v.step)
    v.pulling = 0


@jit
def leave(op, w, up, moving):
    """Adds `up` times the held shape, moving by `moving` times it a second."""
    for j in range(op.padded):
        x = w.held[j]
        w.q[j] += up * x
        w.p[j] += w.kappa[j] * (moving + w.sigma[j] * up) * x


@jit
def take_string(string, ops, pool, fret):
    """The slot in which `fret` is to sound; what sounds on another fret begins to fade."""
    v, slots, w2 = string.voice, string.slots, string.work
    interrupt(string, ops)
    s = slots[v.slot]
    if s.on and (s.fret != fret or s.fading):
        if not s.fading:
            s.fading = 1
        s.hand = min(s.hand, np.exp(-FADE_RATE / v.rate))
        v.striking = 0
        v.fingering = 0
        v.slot = 1 - v.slot
        s = slots[v.slot]
        s.on = 0
    if not s.on:
        s.fret = fret
        stepping.load(s, ops[fret], w2[v.slot], pool, v.step)
        if v.tuned != 1.0:
            stepping.bend(s, ops[fret], w2[v.slot], w2[VOICE_SLOTS + v.slot], pool, v.tuned, highest(v))
    s.hand = 1.0
    return v.slot


@jit
def pluck(string, ops, pool, fret, apex, position, rounding, angle):
    """A finger takes the string, pulls it for `v.pull` frames and lets go. Lengths in m from the stop.

    It pulls at `angle` (rad) from u, away from the neck, towards v, across.
    """
    v, slots, w2 = string.voice, string.slots, string.work
    sounding = slots[v.slot].on
    k = take_string(string, ops, pool, fret)
    s = slots[k]
    op = ops[fret]
    w = w2[k]
    s.on = 1
    s.touching = 0
    v.striking = 0
    across = w2[VOICE_SLOTS + k]
    if angle != 0.0:
        stepping.open_across(s, op, across, pool)
    shape_of_pluck(w, op, np.cos(angle) * apex, position, rounding)
    if s.across:
        shape_of_pluck(across, op, np.sin(angle) * apex, position, rounding)
    if sounding and (s.active > 0 or s.swaying > 0):
        touch(v, s, w, across, op, position, max(v.pull, 1))
    for i in range(max(v.pickups, 1)):
        v.held[i] = rows.tap_shape(w, pool, op.start + (OP_TAP + i) * ROW, op.tap_modes)
        v.held_across[i] = 0.0
        if s.across:
            row = OP_TAP + (i if v.pickups > 0 else 2 * v.denominator)
            v.held_across[i] = rows.tap_shape(across, pool, op.start + row * ROW, op.tap_modes)
    v.pulling = v.pull + 1 if v.pull > 0 else 0  # this frame counts one down already
    if v.pull == 0:
        let_go(v, s, op, w, across)


@jit
def let_go(v, s, op, w, across):
    rows.release(w, op.padded)
    if s.across:
        rows.release(across, op.padded)
        s.swaying = op.padded
        for m in range(op.points):
            across.solved_at[m] = -1.0
    stepping.disturb(s, op, w, v.step)


@jit
def strike(string, ops, pool, fret, depth, position, width):
    """The thumb throws the string down at `position` over `v.strike` frames."""
    v, slots, w2 = string.voice, string.slots, string.work
    sounding = slots[v.slot].on
    k = take_string(string, ops, pool, fret)
    s = slots[k]
    s.on = 1
    s.touching = 0
    if sounding and (s.active > 0 or s.swaying > 0):
        # it lies on the string, then throws it
        touch(v, s, w2[k], w2[VOICE_SLOTS + k], ops[fret], position, max(v.strike // 2, 1))
    shape_of_strike(w2[k], ops[fret], depth, position, width)
    v.striking = v.strike
    s.safety = stepping.SAFETY_STRUCK
    stepping.disturb(s, ops[fret], w2[k], v.step)


@jit
def highest(v):
    """rad/s that the audio rate still carries."""
    return 2 * np.pi * HEARD * v.rate


@jit
def follow_bend(string, ops, pool):
    """Tunes the string a little nearer to the bend: so fast as an arm can, or a string would gain energy by it."""
    v, slots, w2 = string.voice, string.slots, string.work
    most = 2.0 ** (BEND_SPEED * BEND_FRAMES / (12.0 * v.rate))
    v.tuned = min(max(v.bend, v.tuned / most), v.tuned * most)
    for k in range(2):
        s = slots[k]
        if s.on:
            stepping.bend(s, ops[s.fret], w2[k], w2[VOICE_SLOTS + k], pool, v.tuned, highest(v))
            stepping.disturb(s, ops[s.fret], w2[k], v.step)


@jit
def excite(v, s, op, w, across):
    """What finger or thumb do to the string before this frame's motion."""
    n = op.padded
    if v.fingering > 0:
        rows.finger(w, n)
        rows.finger(across, s.swaying)
        v.fingering -= 1
    if v.pulling > 0:
        v.pulling -= 1
        if v.pulling == 0:
            let_go(v, s, op, w, across)
    if v.striking > 0 and v.fingering == 0:
        # a raised cosine of force whose sum over the frames is one
        t = (v.strike - v.striking) / v.strike
        rows.push(w, (1 - np.cos(2 * np.pi * t)) / v.strike, n)
        v.striking -= 1
        stepping.disturb(s, op, w, v.step)


@jit
def exchange(string, old, ops, pool):
    """The string goes on with operators `ops` in place of `old`: other modes, another contact rate.

    Both have whole fine steps in a frame. Displacement and velocity of the modes they share stay.
    """
    v, slots, w2 = string.voice, string.slots, string.work
    v.numerator = ops[0].steps
    v.step = v.frame * v.numerator
    for k in range(2):
        s = slots[k]
        if s.on:
            stepping.exchange(s, old[s.fret], ops[s.fret], w2[k], w2[VOICE_SLOTS + k], pool)
            if v.tuned != 1.0:
                stepping.bend(s, ops[s.fret], w2[k], w2[VOICE_SLOTS + k], pool, v.tuned, highest(v))
            stepping.disturb(s, ops[s.fret], w2[k], v.step)
