"""One string over frets from one audio frame to the next.

The step over a frame is tried first. A contact point needs a look only where it could have been reached: it moved
at most `fastest` metres a second since it was last known to be clear. Looked at, it is safe if its clearances at
both ends of the step add up to more than the way it can make in between. Otherwise the step is taken back, and
the frame is cut into parts, and the parts with a point in doubt into fine steps that solve the contact. Both
ways are the same exact solution; the choice depends on frame numbers and on the string alone, never on blocks.
[any thread]
"""

import numpy as np

from livebass import clearance, frame_call, rows
from livebass.clearance import NEVER, height, suspicious
from livebass.fine import fine_steps
from livebass.kernels import callback, jit
from livebass.layout import (
    LONGER,
    PART,
    ROW,
    VOICE_SLOTS,
    WHOLE,
)


@jit
def shape(op, m):
    """Where in the pool the shape at point m starts."""
    return op.start + (op.phi + m) * ROW


@jit
def contact_frame(s, op, w, across, pool, suspects, near, count, steps, step, log, voice):
    """A frame in which some of the `count` suspects may touch: parts, and fine steps where needed."""
    way = s.fastest * op.fine
    clearance.before_contact(w, suspects, count, step)
    end = step + steps
    for _ in range(op.parts):
        n = s.active
        rows.try_leap(w, PART, n)
        close = np.int64(0)
        for i in range(count):
            m = suspects[i]
            clear = rows.displacement(w, pool, shape(op, m), n) - height(op, pool, m)
            now = w.clearance[m]
            w.clearance_now[m] = clear
            held = w.solved_at[m] == step and w.eta_before[m] > 0.0
            if held or now <= 0.0 or now + clear <= way * op.part_steps:
                near[close] = m
                close += 1
        if close == 0:
            rows.leap(across, PART, s.swaying)
            for i in range(count):
                w.clearance[suspects[i]] = w.clearance_now[suspects[i]]
        else:
            rows.take_back(w, n)
            fine_steps(s, op, w, across, pool, near, close, op.part_steps, step, log, voice)
            for i in range(count):
                m = suspects[i]
                if w.solved_at[m] == step + op.part_steps:
                    w.clearance[m] = -w.eta[m]
                else:
                    w.clearance[m] = rows.displacement(w, pool, shape(op, m), s.active) - height(op, pool, m)
        step += op.part_steps
    if step < end:
        fine_steps(s, op, w, across, pool, suspects, count, end - step, step, log, voice)
        for i in range(count):
            w.clearance[suspects[i]] = -w.eta[suspects[i]]
    clearance.after_contact(w, suspects, count, end, way)
    s.due = end


@jit
def advance(s, op, w, across, pool, suspects, near, steps, step, log, voice):
    """Moves a slot from fine step `step` over one frame of `steps` fine steps in which something may touch."""
    n = s.active
    leap = LONGER if steps > op.steps else WHOLE
    end = step + steps
    rows.try_leap(w, leap, n)
    way = s.fastest * op.fine
    count = np.int64(0)  # a constant would be a type of its own
    looked = np.int64(0)
    least = NEVER
    for m in range(op.points):
        if end <= w.due[m]:
            least = min(least, w.due[m])
            continue
        near[looked] = m
        looked += 1
        if suspicious(op, w, pool, shape(op, m), m, step, end, way, n):
            suspects[count] = m
            count += 1
    if count > 0:
        rows.take_back(w, n)
        contact_frame(s, op, w, across, pool, suspects, near, count, steps, step, log, voice)
        return
    rows.leap(across, leap, s.swaying)
    clearance.stayed_clear(w, near, looked, end, way)
    for i in range(looked):
        least = min(least, w.due[near[i]])
    s.due = np.int64(least)


@callback("void(int64, int64, int64)")
def player(address, _, __):
    """`advance` as a C function, of what lies at `address`: frame_call.call put it there."""
    strings, ops, pool, log, k, steps = frame_call.arguments(address)
    string = strings[0]
    s, w, across, v, scratch = string.slots[k], string.work[k], string.work[VOICE_SLOTS + k], string.voice, string.scratch
    advance(s, ops[s.fret], w, across, pool, scratch[0], scratch[1], steps, v.step, log, v)
