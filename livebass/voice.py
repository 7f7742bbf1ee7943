"""One string of the bass: plucks, strikes, hands, bends, and the way from motion to a signal.

A string has two slots. A new note on the fret that sounds already goes into the same motion; on another fret it
starts in the other slot while the old one is damped out by the finger, a few milliseconds, without a click.
`run` is the whole life of a string: per frame events, output, then one frame of motion. It allocates nothing and
touches only what it is handed. [audio thread]
"""

import numpy as np

from livebass import rows, stepping
from livebass.kernels import jit
from livebass.layout import (
    BEND,
    CUT,
    FINGER,
    GAIN,
    HAND,
    KAPPA,
    OP_DISPLACEMENT_TAP,
    OP_HEIGHT,
    OP_POSITION,
    PLUCK,
    ROW,
    SHAPE,
    SIGMA,
    STRIKE,
    STRIKE_EVENT,
    P,
    Q,
)

FADE_RATE = 450.0  # 1/s of the finger that leaves a note for another fret
CUT_RATE = 900.0  # 1/s of all-sound-off
FINGER_NEPERS = 5.0  # damping, at an antinode, of a finger that takes hold of a sounding string
BEND_FRAMES = 128  # pitch bend is followed at every such frame number ...
BEND_SPEED = 400.0  # semitones/s, ... and not faster
HEARD = 0.46  # of the audio rate: what a bend takes above is left out (operators.TAPER)
DEEPEST = 8e-3  # m: a string cannot dip farther into a magnet's field
INAUDIBLE = 1e-17  # of the signal of a string at rest: what the filters still hold below it is silence


@jit
def shape_of_pluck(w, op, apex, position, rounding):
    """Fills SHAPE with the modal amplitudes of a rounded triangle (modes.pluck_amplitudes)."""
    length = op.length
    k1 = np.pi / length
    corner = np.sqrt(2 / length) * apex * length / (position * (length - position))
    for j in range(op.padded):
        w[SHAPE * ROW + j] = 0.0
    for j in range(op.modes):
        k = (j + 1) * k1
        w[SHAPE * ROW + j] = corner * np.sin(k * position) / (k * k) * np.exp(-0.5 * (k * rounding) ** 2)


@jit
def shape_of_strike(w, op, depth, position, width):
    """Fills STRIKE with modal velocities: an impulse that pushes an endless string down by `depth`."""
    k1 = np.pi / op.length
    for j in range(op.padded):
        w[STRIKE * ROW + j] = 0.0
    for j in range(op.modes):
        k = (j + 1) * k1
        smooth = np.exp(-0.5 * (k * width) ** 2)
        w[STRIKE * ROW + j] = -2 * op.speed * depth * np.sqrt(2 / op.length) * np.sin(k * position) * smooth


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
def touch(v, w, op, position, frames):
    """The plucking finger lies on the string at `position`: modes with a node there go on."""
    k1 = np.pi / op.length
    for j in range(op.padded):
        s = np.sin((j + 1) * k1 * position)
        w[FINGER * ROW + j] = np.exp(-FINGER_NEPERS / frames * s * s)
    v.fingering = frames


@jit
def pulled(v, left):
    """How much of the held shape there is with `left` frames of the pull to go, and its change a second."""
    t = (v.pull - left) / v.pull
    return 0.5 - 0.5 * np.cos(np.pi * t), 0.5 * np.pi * np.sin(np.pi * t) / v.pull * v.rate


@jit
def interrupt(v, slots, ops, w2):
    """A finger in the middle of its pull leaves: the string goes on from where it is, as fast as it is."""
    if 0 < v.pulling <= v.pull:
        s = slots[v.slot]
        op = ops[s.fret]
        w = w2[v.slot]
        up, moving = pulled(v, v.pulling - 1)
        for j in range(op.padded):
            x = w[SHAPE * ROW + j]
            w[Q * ROW + j] += up * x
            w[P * ROW + j] += w[KAPPA * ROW + j] * (moving + w[SIGMA * ROW + j] * up) * x
        stepping.disturb(s, op, w, v.step)
    v.pulling = 0


@jit
def take_string(v, slots, ops, w2, pool, fret):
    """The slot in which `fret` is to sound; what sounds on another fret begins to fade."""
    interrupt(v, slots, ops, w2)
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
            stepping.bend(s, ops[fret], w2[v.slot], pool, v.tuned, highest(v))
    s.hand = 1.0
    return v.slot


@jit
def pluck(v, slots, ops, w2, pool, fret, apex, position, rounding):
    """A finger takes the string, pulls it up for `v.pull` frames and lets go. Lengths in m from the stop."""
    sounding = slots[v.slot].on
    k = take_string(v, slots, ops, w2, pool, fret)
    s = slots[k]
    op = ops[fret]
    w = w2[k]
    s.on = 1
    s.touching = 0
    v.striking = 0
    shape_of_pluck(w, op, apex, position, rounding)
    if sounding and s.active > 0:
        touch(v, w, op, position, max(v.pull, 1))
    for i in range(v.taps):
        v.held[i] = rows.tap_shape(w, pool, op.start + (OP_DISPLACEMENT_TAP + 2 * i) * ROW, op.tap_modes)
    v.pulling = v.pull + 1 if v.pull > 0 else 0  # this frame counts one down already
    if v.pull == 0:
        let_go(v, s, op, w)


@jit
def let_go(v, s, op, w):
    rows.release(w, op.padded)
    stepping.disturb(s, op, w, v.step)


@jit
def strike(v, slots, ops, w2, pool, fret, depth, position, width):
    """The thumb throws the string down at `position` over `v.strike` frames."""
    sounding = slots[v.slot].on
    k = take_string(v, slots, ops, w2, pool, fret)
    s = slots[k]
    s.on = 1
    s.touching = 0
    if sounding and s.active > 0:
        touch(v, w2[k], ops[fret], position, max(v.strike // 2, 1))  # it lies on the string, then throws it
    shape_of_strike(w2[k], ops[fret], depth, position, width)
    v.striking = v.strike
    s.safety = stepping.SAFETY_STRUCK
    stepping.disturb(s, ops[fret], w2[k], v.step)


@jit
def happen(v, slots, ops, w2, pool, event, settings):
    """One event. `settings`: rounding (m), strike width (m)."""
    if event.kind == PLUCK:
        pluck(v, slots, ops, w2, pool, event.fret, event.x, event.y, settings[0])
    elif event.kind == STRIKE_EVENT:
        strike(v, slots, ops, w2, pool, event.fret, event.x, event.y, settings[1])
    elif event.kind == HAND:
        slots[v.slot].hand = np.exp(-event.x / v.rate)
    elif event.kind == BEND:
        v.bend = event.x
        if not (slots[0].on or slots[1].on) or not abs(v.block_out) < np.inf:
            v.tuned = v.bend
    elif event.kind == GAIN:
        v.gain_wanted = event.x
        if not (slots[0].on or slots[1].on) or not abs(v.block_out) < np.inf:
            v.gain = event.x  # nothing to hear that could jump
    elif event.kind == CUT:
        interrupt(v, slots, ops, w2)
        v.striking = 0
        for k in range(2):
            slots[k].hand = min(slots[k].hand, np.exp(-CUT_RATE / v.rate))


@jit
def highest(v):
    """rad/s that the audio rate still carries."""
    return 2 * np.pi * HEARD * v.rate


@jit
def follow_bend(v, slots, ops, w2, pool):
    """Tunes the string a little nearer to the bend: so fast as an arm can, or a string would gain energy by it."""
    most = 2.0 ** (BEND_SPEED * BEND_FRAMES / (12.0 * v.rate))
    v.tuned = min(max(v.bend, v.tuned / most), v.tuned * most)
    for k in range(2):
        s = slots[k]
        if s.on:
            stepping.bend(s, ops[s.fret], w2[k], pool, v.tuned, highest(v))
            stepping.disturb(s, ops[s.fret], w2[k], v.step)


@jit
def excite(v, s, op, w):
    """What finger or thumb do to the string before this frame's motion."""
    n = op.padded
    if v.fingering > 0:
        rows.finger(w, n)
        v.fingering -= 1
    if v.pulling > 0:
        v.pulling -= 1
        if v.pulling == 0:
            let_go(v, s, op, w)
    if v.striking > 0 and v.fingering == 0:
        # a raised cosine of force whose sum over the frames is one
        t = (v.strike - v.striking) / v.strike
        rows.push(w, (1 - np.cos(2 * np.pi * t)) / v.strike, n)
        v.striking -= 1
        stepping.disturb(s, op, w, v.step)


@jit
def listen(v, slots, ops, w2, pool, y):
    """Fills y with the taps of this frame, both slots and the held shape together."""
    phase = 0
    if v.denominator > 1:
        phase = v.frame % v.denominator
    for i in range(v.taps):
        y[i] = 0.0
    for k in range(2):
        s = slots[k]
        if s.on:
            op = ops[s.fret]
            n = min(s.active, s.heard)
            for i in range(v.taps):
                o = op.start + (OP_DISPLACEMENT_TAP + 2 * (phase * v.taps + i)) * ROW
                y[i] += rows.tap(w2[k], pool, o, n)
    if v.pulling > 0:
        up, moving = pulled(v, v.pulling)
        if v.pickups == 0:
            y[0] += up * v.held[0]
        for i in range(v.pickups):
            y[2 * i] += up * v.held[2 * i]
            y[2 * i + 1] += moving * v.held[2 * i]


@jit
def signal(v, y):
    """Taps to one sample: flux of each pickup, coil and tone circuit, volume."""
    x = 0.0
    if v.pickups == 0:
        x = y[0]
    for i in range(v.pickups):
        # the flux gradient falls exponentially with the distance between string and magnet
        x += v.mix[i] * np.exp(-v.decay[i] * max(y[2 * i], -DEEPEST)) * y[2 * i + 1]
    out = v.b[0] * x + v.z[0]
    v.z[0] = v.b[1] * x - v.a[1] * out + v.z[1]
    v.z[1] = v.b[2] * x - v.a[2] * out + v.z[2]
    v.z[2] = v.b[3] * x - v.a[3] * out
    high = out - v.block_in + v.block * v.block_out
    v.block_in = out
    v.block_out = high
    v.gain += v.gain_pole * (v.gain_wanted - v.gain)
    return high * v.gain


@jit
def settle(v):
    """Filters run out to an exact zero, where left alone they would never get; what is no number ends there too."""
    most = abs(v.block_in) + abs(v.block_out)
    for i in range(3):
        most += abs(v.z[i])
    if most < INAUDIBLE or not most < np.inf:
        v.block_in = 0.0
        v.block_out = 0.0
        for i in range(3):
            v.z[i] = 0.0


@jit
def move(v, slots, ops, w2, pool, scratch, log):
    """One frame of motion of both slots."""
    after = -((-(v.frame + 1) * v.numerator) // v.denominator)  # rounded up: a tap may look back, not ahead
    steps = after - v.step
    for k in range(2):
        s = slots[k]
        if not s.on:
            continue
        op = ops[s.fret]
        w = w2[k]
        stepping.advance(s, op, w, pool, scratch[0], scratch[1], steps, v.step, log, v)
        if s.hand < 1.0:
            rows.scale(w, s.hand, s.active)
    v.step = after
    v.frame += 1
    if v.frame % stepping.HOUSEKEEPING == 0:
        for k in range(2):
            s = slots[k]
            if s.on and not (k == v.slot and (v.pulling > 0 or v.striking > 0)):
                stepping.keep_house(s, ops[s.fret], w2[k], pool, v.step)
        if not (slots[0].on or slots[1].on) or not abs(v.block_out) < np.inf:
            settle(v)


@jit
def exchange(v, slots, old, ops, w2, pool):
    """The string goes on with operators `ops` in place of `old`: other modes, another contact rate.

    Both have whole fine steps in a frame. Displacement and velocity of the modes they share stay.
    """
    v.numerator = ops[0].steps
    v.step = v.frame * v.numerator
    for k in range(2):
        s = slots[k]
        if s.on:
            stepping.exchange(s, old[s.fret], ops[s.fret], w2[k], pool, v.step)
            if v.tuned != 1.0:
                stepping.bend(s, ops[s.fret], w2[k], pool, v.tuned, highest(v))
            stepping.disturb(s, ops[s.fret], w2[k], v.step)


@jit
def run(v, slots, ops, w2, pool, events, count, settings, scratch, taps, log, raw, out):
    """Plays out.shape[0] frames. `events[:count]`: this string's, by frame, none before v.frame.

    v, slots, ops: records (layout.py); w2 (2, WORK_ROWS * ROW); pool: operators; scratch (2, ROW) int64 and taps (8,)
    are workspace; log (n, 2) receives fine step and point of each contact; with `raw` out holds the first tap.
    Returns the events used.
    """
    used = 0
    for i in range(out.shape[0]):
        while used < count and events[used].frame <= v.frame:
            happen(v, slots, ops, w2, pool, events[used], settings)
            used += 1
        if v.frame % BEND_FRAMES == 0 and v.tuned != v.bend:
            follow_bend(v, slots, ops, w2, pool)
        s = slots[v.slot]
        if s.on:
            excite(v, s, ops[s.fret], w2[v.slot])
        listen(v, slots, ops, w2, pool, taps)
        if raw:
            out[i] = taps[0]
        else:
            out[i] = signal(v, taps)
        move(v, slots, ops, w2, pool, scratch, log)
    return used
