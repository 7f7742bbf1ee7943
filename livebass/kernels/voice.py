"""One string of the bass: from events and motion to a signal.

`run` is the whole life of a string: per frame events, output, then one frame of motion. It allocates nothing and
touches only what it is handed. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels import modal as rows
from livebass.kernels import slot as frame_call
from livebass.kernels import slot as stepping
from livebass.kernels import techniques as hands
from livebass.kernels.records import (
    BEND,
    CUT,
    GAIN,
    HAND,
    LONGER,
    MOST_NEAR,
    OP_TAP,
    PLUCK,
    ROW,
    STRIKE_EVENT,
    VOICE_SLOTS,
    WHOLE,
)

CUT_RATE = 900.0  # 1/s of all-sound-off
DEEPEST = 8e-3  # m: a string cannot dip farther into a magnet's field
INAUDIBLE = 1e-17  # of the signal of a string at rest: what the filters still hold below it is silence


@jit
def happen(string, ops, pool, event, settings):
    """One event. `settings`: rounding (m), strike width (m), angle of plucks (rad)."""
    v, slots = string.voice, string.slots
    if event.kind == PLUCK:
        hands.pluck(string, ops, pool, event.fret, event.x, event.y, settings[0], settings[2])
    elif event.kind == STRIKE_EVENT:
        hands.strike(string, ops, pool, event.fret, event.x, event.y, settings[1])
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
        hands.interrupt(string, ops)
        v.striking = 0
        for k in range(2):
            slots[k].hand = min(slots[k].hand, np.exp(-CUT_RATE / v.rate))


@jit
def listen(string, ops, pool, y):
    """Fills y with what is sensed at this frame, both slots and the held shape together.

    Displacement and velocity at each pickup; without one, the displacement alone.
    """
    v, slots, w2 = string.voice, string.slots, string.work
    for i in range(2 * max(v.pickups, 1)):
        y[i] = 0.0
    for k in range(2):
        s = slots[k]
        if s.on:
            op = ops[s.fret]
            n = min(s.active, s.heard)
            o = op.start + OP_TAP * ROW
            if v.pickups == 0:
                phase = v.frame % v.denominator if v.denominator > 1 else 0
                y[0] += rows.tap(w2[k], pool, o + 2 * phase * ROW, n)
            if s.swaying > 0:
                listen_across(v, op, w2[VOICE_SLOTS + k], pool, min(s.swaying, s.heard), y)
            i = 0
            while i + 1 < v.pickups:
                u, moving, other, other_moving = rows.sense_2(w2[k], pool, o + i * ROW, n)
                y[2 * i] += u
                y[2 * i + 1] += moving
                y[2 * i + 2] += other
                y[2 * i + 3] += other_moving
                i += 2
            if i < v.pickups:
                u, moving = rows.sense_1(w2[k], pool, o + i * ROW, n)
                y[2 * i] += u
                y[2 * i + 1] += moving
    if v.pulling > 0:
        up, moving = hands.pulled(v, v.pulling)
        if v.pickups == 0:
            y[0] += up * v.held[0]
            y[1] += up * v.held_across[0]
        for i in range(v.pickups):
            y[2 * i] += up * v.held[i]
            y[2 * i + 1] += moving * (v.held[i] + v.across[i] * v.held_across[i])


@jit
def listen_across(v, op, across, pool, n, y):
    """Adds what is sensed of v: to the velocities, or as a displacement of its own, at its own sensor."""
    o = op.start + OP_TAP * ROW
    if v.pickups == 0:
        phase = v.frame % v.denominator if v.denominator > 1 else 0
        y[1] += rows.tap(across, pool, o + 2 * (v.denominator + phase) * ROW, n)
    for i in range(v.pickups):
        _, moving = rows.sense_1(across, pool, o + i * ROW, n)
        y[2 * i + 1] += v.across[i] * moving


@jit
def signal(v, y):
    """Taps to one sample: flux of each pickup, coil and tone circuit, volume."""
    x = 0.0
    if v.pickups == 0:
        x = y[0] + v.across[0] * y[1]
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
def move(string, ops, pool, log):
    """One frame of motion of both slots."""
    v, slots, w2 = string.voice, string.slots, string.work
    after = (v.frame + 1) * v.numerator
    if v.denominator > 1:
        after = -(-after // v.denominator)  # rounded up: a tap may look back, not ahead
    steps = after - v.step
    for k in range(2):
        s = slots[k]
        if not s.on:
            continue
        op = ops[s.fret]
        w = w2[k]
        across = w2[VOICE_SLOTS + k]
        if s.active == 0 or op.points == 0 or s.fading or after <= s.quiet or after <= s.due:
            leap = LONGER if steps > op.steps else WHOLE
            rows.leap(w, leap, s.active)
            rows.leap(across, leap, s.swaying)
        else:
            player = v.over_board if op.points > MOST_NEAR else v.over_frets
            frame_call.call(player, string, ops, pool, log, k, steps)
        if s.hand < 1.0:
            rows.scale(w, s.hand, s.active)
            rows.scale(across, s.hand, s.swaying)
    v.step = after
    v.frame += 1
    if v.frame % stepping.HOUSEKEEPING == 0:
        for k in range(2):
            s = slots[k]
            if s.on and not (k == v.slot and (v.pulling > 0 or v.striking > 0)):
                stepping.keep_house(s, ops[s.fret], w2[k], w2[VOICE_SLOTS + k], pool, v.step)
        if not (slots[0].on or slots[1].on) or not abs(v.block_out) < np.inf:
            settle(v)


@jit
def run(string, ops, pool, events, count, settings, log, raw, out, across):
    """Plays out.shape[0] frames. `events[:count]`: this string's, by frame, none before v.frame.

    string, ops: records (records.py); pool: operators; log (n, 2) receives fine step and point of each contact; with
    `raw` out holds u, and `across` (as long, or empty) v. Returns the events used.
    """
    v, slots, w2 = string.voice, string.slots, string.work
    taps = string.taps
    used = 0
    for i in range(out.shape[0]):
        while used < count and events[used].frame <= v.frame:
            happen(string, ops, pool, events[used], settings)
            used += 1
        if v.tuned != v.bend and (v.frame + v.turn) % hands.BEND_FRAMES == 0:
            hands.follow_bend(string, ops, pool)
        s = slots[v.slot]
        if s.on:
            hands.excite(v, s, ops[s.fret], w2[v.slot], w2[VOICE_SLOTS + v.slot])
        listen(string, ops, pool, taps)
        if raw:
            out[i] = taps[0]
            if i < across.shape[0]:
                across[i] = taps[1]
        else:
            out[i] = signal(v, taps)
        move(string, ops, pool, log)
    return used
