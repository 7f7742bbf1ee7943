"""Fine steps over a board, where a string may touch anywhere: contact points by the hundred, each on its own.

The grid has one step more than there are modes, so that W couples no points (eq. 12) and each force is one scalar
equation. A point is looked at only when it could be reached: it moves at most `fastest` m/s, and from two steps before
it could touch on it is looked at in every one, because eq. 12 needs its penetration at n - 1, n and n + 1. Of a hundred
points near the string some ten are looked at in a step, and some five touch.

v, across the board, feels friction where u touches; it is sensed at the same points. [any thread]

One string over a board from one audio frame to the next: what frets.py does, for contact points by the hundred.

Points are looked at in groups of GROUP first. The string is nowhere steeper than `fastest` over the speed of its waves,
so that the displacement at a group's middle and its highest point tell how clear all of it is at least. Only groups
that this leaves in doubt are looked at point by point. [any thread]
"""

import numpy as np

from livebass.compiling import callback, jit
from livebass.kernels import contact
from livebass.kernels import contact as clearance
from livebass.kernels import modal as rows
from livebass.kernels import slot as frame_call
from livebass.kernels.contact import NEVER, height, suspicious
from livebass.kernels.records import GROUP, LONGER, OP_HEIGHT, OP_POSITION, PART, ROW, VOICE_SLOTS, WHOLE

EARLY = 2  # steps that a point is looked at before it could touch


@jit
def shape(op, m):
    """Where the shapes at point m begin in the pool."""
    return op.start + op.phi * ROW + m * op.padded


@jit
def look_back(s, op, w, across, pool, near, count, step, way):
    """What is known of the points in `near` before the first step: penetrations, or that they are clear."""
    for i in range(count):
        m = near[i]
        w.force[m] = 0.0
        w.force_before[m] = 0.0
        w.pending[m] = 0.0
        across.pending[m] = 0.0
        w.last_look[m] = step
        w.streak[m] = 2.0
        w.next_look[m] = step + 1
        if w.solved_at[m] != step:
            if w.clearance[m] > (EARLY + 2) * way:
                w.eta[m] = -w.clearance[m]
                w.eta_before[m] = -w.clearance[m]
                w.next_look[m] = step + np.floor(w.clearance[m] / way) - EARLY
                w.streak[m] = 0.0
                continue
            height = pool[op.start + OP_HEIGHT * ROW + m]
            w.eta[m] = height - rows.displacement(w, pool, shape(op, m), s.active)
            w.eta_before[m] = height - rows.displacement_before(w, pool, shape(op, m), s.active)
        if s.swaying > 0 and across.solved_at[m] != step:
            across.eta[m] = rows.displacement(across, pool, shape(op, m), s.swaying)
            across.eta_before[m] = rows.displacement_before(across, pool, shape(op, m), s.swaying)


@jit
def push(op, w, pool, seen, count, n):
    """The pending forces, and one fine step; four forces go in the same pass."""
    pending = np.int64(0)
    a = b = c = d = np.int64(0)
    for i in range(count):
        m = seen[i]
        if w.pending[m] == 0.0:
            continue
        if pending == 0:
            a = b = c = d = m
        elif pending == 1:
            b = m
        elif pending == 2:
            c = m
        elif pending == 3:
            d = m
        else:
            rows.kick_from(w, pool, shape(op, m), w.pending[m], n)
        pending += 1
    if pending == 0:
        rows.fine(w, n)
    elif pending <= 2:
        rows.kicked_2(w, pool, shape(op, a), shape(op, b), w.pending[a], w.pending[b] if pending > 1 else 0.0, n)
    else:
        rows.kicked_4(
            w, pool, shape(op, a), shape(op, b), shape(op, c), shape(op, d),
            w.pending[a], w.pending[b], w.pending[c], w.pending[d] if pending > 3 else 0.0, n,
        )  # fmt: skip


@jit
def sense(op, w, pool, seen, count, n):
    """Displacements at the points in `seen` into CLEARANCE_NOW."""
    i = 0
    while i + 3 < count:
        a, b, c, d = seen[i], seen[i + 1], seen[i + 2], seen[i + 3]
        u0, u1, u2, u3 = rows.displacement_4(w, pool, shape(op, a), shape(op, b), shape(op, c), shape(op, d), n)
        w.clearance_now[a] = u0
        w.clearance_now[b] = u1
        w.clearance_now[c] = u2
        w.clearance_now[d] = u3
        i += 4
    while i < count:
        w.clearance_now[seen[i]] = rows.displacement(w, pool, shape(op, seen[i]), n)
        i += 1


@jit
def press(s, op, w, pool, seen, count, step, way, log, voice):
    """Contact at `step`, and when each point is to be looked at again."""
    touching = False
    for i in range(count):
        m = seen[i]
        old, before = w.eta_before[m], w.eta[m]
        free = pool[op.start + OP_HEIGHT * ROW + m] - w.clearance_now[m]
        eta = free
        f = 0.0
        if free > 0.0 or old > 0.0:
            guess = max(2.0 * w.force[m] - w.force_before[m], 0.0)
            f = contact.solve_point(free - old, old, op.weight, op.stiffness, op.exponent, guess)
            eta = free - op.weight * f
            touching = touching or f != 0.0
        if eta > 0.0 and before <= 0.0:
            s.touching += 1
            if voice.logged < log.shape[0]:
                log[voice.logged, 0] = step
                log[voice.logged, 1] = m
            voice.logged += 1
        w.force_before[m] = w.force[m]
        w.force[m] = f
        w.eta_before[m] = before
        w.eta[m] = eta
        w.pending[m] = op.push * f
        w.streak[m] = w.streak[m] + 1.0 if w.last_look[m] == step - 1 else 1.0
        w.last_look[m] = step
        w.next_look[m] = step + 1
        if eta < 0.0 and before <= 0.0 and f == 0.0:
            w.next_look[m] = step + max(np.floor(-eta / way) - EARLY, 1.0)
    if touching:
        s.active = op.padded


@jit
def slide(s, op, w, across, seen, count):
    """Friction (eq. 7) of the step just made in `across`; `w` still has the penetration at its start."""
    touching = False
    for i in range(count):
        m = seen[i]
        f = 0.0
        if w.eta[m] > 0.0:
            wanted = across.clearance_now[m] - across.eta_before[m]
            f = -op.friction * min(max(wanted / (op.slip + op.weight * op.friction), -1.0), 1.0)
            touching = True
        across.eta_before[m] = across.eta[m]
        across.eta[m] = across.clearance_now[m] + op.weight * f
        across.pending[m] = op.push * f
    if touching:
        s.swaying = op.padded


@jit
def get_done(op, w, across, pool, near, count, n, swaying, step, way):
    """The forces of the last step; which points are known at `step`, and how clear the others are at least."""
    for i in range(count):
        m = near[i]
        if w.pending[m] != 0.0:
            rows.kick_from(w, pool, shape(op, m), w.pending[m], n)
        if swaying > 0 and across.pending[m] != 0.0:
            rows.kick_from(across, pool, shape(op, m), across.pending[m], swaying)
        known = w.last_look[m] == step and w.streak[m] > 1.0
        w.solved_at[m] = step if known else -1.0
        across.solved_at[m] = w.solved_at[m] if swaying > 0 else -1.0
        w.clearance[m] = -w.eta[m] if w.last_look[m] == step else (w.next_look[m] + EARLY - step) * way


@jit
def fine_steps(s, op, w, across, pool, near, count, seen, steps, step, log, voice):
    """Takes `steps` fine steps with contact and friction solved for at the `count` points in `near`.

    CLEARANCE is that of the points, at least, before and after. seen (ROW,): workspace.
    """
    way = s.fastest * op.fine
    look_back(s, op, w, across, pool, near, count, step, way)
    for _ in range(steps):
        step += 1
        looks = np.int64(0)
        for i in range(count):
            if w.next_look[near[i]] <= step:
                seen[looks] = near[i]
                looks += 1
        if s.swaying > 0:
            push(op, across, pool, seen, looks, s.swaying)
            sense(op, across, pool, seen, looks, s.swaying)
            slide(s, op, w, across, seen, looks)
        push(op, w, pool, seen, looks, s.active)
        sense(op, w, pool, seen, looks, s.active)
        press(s, op, w, pool, seen, looks, step, way, log, voice)
    get_done(op, w, across, pool, near, count, s.active, s.swaying, step, way)


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
    s, w, across, v, scratch = (
        string.slots[k],
        string.work[k],
        string.work[VOICE_SLOTS + k],
        string.voice,
        string.scratch,
    )
    advance(s, ops[s.fret], w, across, pool, scratch, steps, v.step, log, v)
