"""One string over a board from one audio frame to the next: what frets.py does, for contact points by the hundred.

Points are looked at in groups of GROUP first. The string is nowhere steeper than `fastest` over the speed of its waves,
so that the displacement at a group's middle and its highest point tell how clear all of it is at least. Only groups
that this leaves in doubt are looked at point by point. [any thread]
"""

import numpy as np

from livebass import clearance, frame_call, rows
from livebass.board_fine import fine_steps, shape
from livebass.clearance import NEVER, height, suspicious
from livebass.kernels import callback, jit
from livebass.layout import (
    GROUP,
    OP_POSITION,
    ROW,
    LONGER,
    PART,
    VOICE_SLOTS,
    WHOLE,
)

# Of a group: fine step before which none of its points can touch; step at which it was looked at; how clear it was, m,
# and is at the end of the frame on trial


@jit
def doubtful(s, op, w, pool, g, step, end, way, n):
    """Whether a point of group g may touch between `step` and `end`; GN tells how clear it is in the end, or 0."""
    first = g * GROUP
    last = min(first + GROUP, op.points) - 1
    middle = (first + last) // 2
    x = op.start + OP_POSITION * ROW
    top = height(op, pool, first)
    for m in range(first + 1, last + 1):
        top = max(top, height(op, pool, m))
    top += s.fastest / (op.speed * s.ratio) * max(pool[x + last] - pool[x + middle], pool[x + middle] - pool[x + first])
    clear = rows.displacement(w, pool, shape(op, middle), n) - top
    known = w.group_known_at[g]
    before = w.group_clear[g]
    w.group_clear_now[g] = 0.0
    if known < 0 or known >= step or before + clear <= way * (end - known):
        before = rows.displacement_old(w, pool, shape(op, middle), n) - top
        known = float(step)
        w.group_clear[g] = before
        w.group_known_at[g] = known
    if before <= 0.0 or clear <= 0.0 or before + clear <= way * (end - known):
        return True
    w.group_clear_now[g] = clear
    return False


@jit
def advance(s, op, w, across, pool, scratch, steps, step, log, voice):
    """Moves a slot from fine step `step` over one frame of `steps` fine steps in which something may touch.

    scratch (4, ROW) int64.
    """
    n = s.active
    leap = LONGER if steps > op.steps else WHOLE
    end = step + steps
    rows.try_leap(w, leap, n)
    way = s.fastest * op.fine
    suspects, looked = scratch[0], scratch[1]
    groups = (op.points + GROUP - 1) // GROUP
    count = np.int64(0)
    looks = np.int64(0)
    for g in range(groups):
        w.group_clear_now[g] = 0.0
        if end <= w.group_due[g] or not doubtful(s, op, w, pool, g, step, end, way, n):
            continue
        for m in range(g * GROUP, min((g + 1) * GROUP, op.points)):
            if end <= w.due[m]:
                continue
            looked[looks] = m
            looks += 1
            if suspicious(op, w, pool, shape(op, m), m, step, end, way, n):
                suspects[count] = m
                count += 1
    if count > 0:
        rows.take_back(w, n)
        contact_frame(s, op, w, across, pool, scratch, count, steps, step, log, voice)
        return
    rows.leap(across, leap, s.swaying)
    clearance.stayed_clear(w, looked, looks, end, way)
    s.due = np.int64(note_groups(op, w, groups, end, way))


@jit
def note_groups(op, w, groups, end, way):
    """What the frame up to `end`, free of contact, told of the groups; the fine step of the next look."""
    least = NEVER
    for g in range(groups):
        if w.group_clear_now[g] > 0.0:
            w.group_clear[g] = w.group_clear_now[g]
            w.group_known_at[g] = end
            w.group_due[g] = end + np.floor(w.group_clear_now[g] / way)
        if w.group_due[g] > end:
            least = min(least, w.group_due[g])
            continue
        for m in range(g * GROUP, min((g + 1) * GROUP, op.points)):
            least = min(least, max(w.due[m], float(end)))
    return least


@jit
def contact_frame(s, op, w, across, pool, scratch, count, steps, step, log, voice):
    """A frame in which some of the `count` suspects may touch: parts, and fine steps where needed."""
    suspects, near, seen = scratch[0], scratch[1], scratch[2]
    way = s.fastest * op.fine
    reach = way * op.part_steps
    clearance.before_contact(w, suspects, count, step)
    end = step + steps
    for _ in range(op.parts):
        n = s.active
        rows.try_leap(w, PART, n)
        close = np.int64(0)
        for i in range(count):
            m = suspects[i]
            now = w.clearance[m]
            w.clearance_now[m] = now - reach  # at least, without a look
            held = w.solved_at[m] == step and w.eta_before[m] > 0.0
            if held or now <= reach:
                clear = rows.displacement(w, pool, shape(op, m), n) - height(op, pool, m)
                w.clearance_now[m] = clear
                if held or now <= 0.0 or now + clear <= reach:
                    near[close] = m
                    close += 1
        if close == 0:
            rows.leap(across, PART, s.swaying)
            for i in range(count):
                w.clearance[suspects[i]] = w.clearance_now[suspects[i]]
        else:
            rows.take_back(w, n)
            fine_steps(s, op, w, across, pool, near, close, seen, op.part_steps, step, log, voice)
            go_on(s, op, w, pool, suspects, count, near, close, reach)
        step += op.part_steps
    if step < end:
        fine_steps(s, op, w, across, pool, suspects, count, seen, end - step, step, log, voice)
    clearance.after_contact(w, suspects, count, end, way)
    s.due = end


@jit
def go_on(s, op, w, pool, suspects, count, near, close, reach):
    """How clear the suspects are that were not among the `close` ones of the fine steps: `reach` less, or a look."""
    k = 0
    for i in range(count):
        m = suspects[i]
        if k < close and near[k] == m:
            k += 1
            continue
        w.clearance[m] -= reach
        if w.clearance[m] <= 0.0:
            w.clearance[m] = rows.displacement(w, pool, shape(op, m), s.active) - height(op, pool, m)


@callback("void(int64, int64, int64)")
def player(address, _, __):
    """`advance` as a C function, of what lies at `address`: frame_call.call put it there."""
    strings, ops, pool, log, k, steps = frame_call.arguments(address)
    string = strings[0]
    s, w, across, v, scratch = string.slots[k], string.work[k], string.work[VOICE_SLOTS + k], string.voice, string.scratch
    advance(s, ops[s.fret], w, across, pool, scratch, steps, v.step, log, v)
