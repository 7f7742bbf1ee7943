"""Fine steps near contact points: which of them are looked at in each, over frets and over a board alike.

Eq. 12 needs a point's penetration at n - 1, n and n + 1. So a point is looked at when it could be reached, from EARLY
steps before it could touch in every one: of a dozen frets, or a hundred points of a board, near the string some few are
looked at in a step. frets.py and board.py solve for the forces at these, and note by `plan` when each is next. [any
thread]
"""

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.string import modal
from livebass.kernels.string.frame import steps_clear, way_of_step
from livebass.kernels.string.operators import shape

EARLY = 2  # steps that a point is looked at before it could touch
FAR = EARLY + 2  # steps: a point that could not touch in so many is left alone for a while


@inlined
def take_steps(slot, op, voice, near, count, steps, step, slide, press):
    """Takes `steps` fine steps from `step` on, with contact and friction solved at the `count` points in `near`.

    slide(slot, op, points, count) solves friction of the step just made of v, press(slot, op, voice, points, count,
    step) contact of that of u. u.clearance is that of the points, at least, before and after.
    """
    u, v, seen = slot.u, slot.v, slot.seen
    recall(slot, op, near, count, step)
    for _ in range(steps):
        step += 1
        looks = find_seen(slot, near, count, step)
        if slot.v_active > 0:
            rubbing = find_rubbing(slot, op, looks)
            move(v, op, slot.rubbing, rubbing, slot.v_active)
            slide(slot, op, slot.rubbing, rubbing)
        move(u, op, seen, looks, slot.active)
        press(slot, op, voice, seen, looks, step)
    finish(slot, op, near, count, step)


@jit
def recall(slot, op, near, count, step):
    """Gets the points in `near` ready for fine steps: their penetrations at `step`, or that they are clear."""
    u, v, way, height = slot.u, slot.v, way_of_step(slot, op), slot.u.height
    for i in range(count):
        m = near[i]
        u.force[m] = 0.0
        u.force_before[m] = 0.0
        u.pending[m] = 0.0
        v.force[m] = 0.0
        v.pending[m] = 0.0
        u.last_look[m] = step
        u.streak[m] = 2
        u.next_look[m] = step + 1
        if u.solved_at[m] != step:
            if u.clearance[m] <= FAR * way:
                u.clearance[m] = modal.displacement(u, shape(op, m), slot.active) - height[m]
            u.eta[m] = -u.clearance[m]
            if u.clearance[m] > FAR * way:
                u.eta_before[m] = -u.clearance[m]
                u.next_look[m] = step + steps_clear(u.clearance[m], way) - EARLY
                u.streak[m] = 0
                continue
            u.eta_before[m] = height[m] - modal.displacement_step_before(u, shape(op, m), slot.active)
        if slot.v_active > 0 and v.solved_at[m] != step and u.eta[m] > -EARLY * way:
            v.moved[m] = modal.displacement(v, shape(op, m), slot.v_active)
            if u.eta[m] > 0.0:
                v.moved_before[m] = modal.displacement_step_before(v, shape(op, m), slot.v_active)


@jit
def find_seen(slot, near, count, step):
    """Fills slot.seen with the points in `near` that are looked at in fine step `step`; returns how many."""
    looks = np.int64(0)  # a constant would be a type of its own
    for i in range(count):
        if slot.u.next_look[near[i]] <= step:
            slot.seen[looks] = near[i]
            looks += 1
    return looks


@jit
def find_rubbing(slot, op, count):
    """Fills slot.rubbing with those of the `count` points in slot.seen that v is sensed at; returns how many.

    Friction at n + 1 acts where u touches at n, and needs v at n - 1 and n: v is sensed while u could touch in EARLY
    steps.
    """
    u, v, way = slot.u, slot.v, way_of_step(slot, op)
    rubbing = np.int64(0)
    for i in range(count):
        m = slot.seen[i]
        if u.eta[m] > -EARLY * way or v.pending[m] != 0.0:
            slot.rubbing[rubbing] = m
            rubbing += 1
    return rubbing


@jit
def move(w, op, seen, count, n):
    """Takes one fine step of `n` modes after the pending forces; w.free receives the displacements at the points."""
    if count == 0:
        modal.fine(w, n)
    elif count == 1:
        w.free[seen[0]] = modal.fine_1(w, op, seen[0], w.pending[seen[0]], n)
    elif count == 2:
        a, b = seen[0], seen[1]
        w.free[a], w.free[b] = modal.fine_2(w, op, (a, b), (w.pending[a], w.pending[b]), n)
    elif count <= 4:
        a, b, c, d = seen[0], seen[1], seen[2], seen[count - 1]
        forces = w.pending[a], w.pending[b], w.pending[c], w.pending[d] if count > 3 else 0.0
        w.free[a], w.free[b], w.free[c], w.free[d] = modal.fine_4(w, op, (a, b, c, d), forces, n)
    else:
        kick_and_move(w, op, seen, count, n)
        sense(w, op, seen, count, n)


@jit
def kick_and_move(w, op, seen, count, n):
    """`move` without the displacements; four forces go in the same pass as the step."""
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
            modal.kick(w, shape(op, m), w.pending[m], n)
        pending += 1
    if pending == 0:
        modal.fine(w, n)
    elif pending <= 2:
        modal.kicked_2(w, op, (a, b), (w.pending[a], w.pending[b] if pending > 1 else 0.0), n)
    else:
        forces = w.pending[a], w.pending[b], w.pending[c], w.pending[d] if pending > 3 else 0.0
        modal.kicked_4(w, op, (a, b, c, d), forces, n)


@jit
def sense(w, op, seen, count, n):
    """Gives w.free the displacements at the points in `seen`."""
    i = 0
    while i + 3 < count:
        a, b, c, d = seen[i], seen[i + 1], seen[i + 2], seen[i + 3]
        u0, u1, u2, u3 = modal.displacement_4(w, op, (a, b, c, d), n)
        w.free[a] = u0
        w.free[b] = u1
        w.free[c] = u2
        w.free[d] = u3
        i += 4
    while i < count:
        w.free[seen[i]] = modal.displacement(w, shape(op, seen[i]), n)
        i += 1


@jit
def plan(u, m, way, step):
    """Notes that point `m` was looked at and solved for in fine step `step`, and when it is to be looked at again."""
    u.streak[m] = u.streak[m] + 1 if u.last_look[m] == step - 1 else 1
    u.last_look[m] = step
    u.next_look[m] = step + 1
    if u.eta[m] < 0.0 and u.eta_before[m] <= 0.0 and u.force[m] == 0.0:
        u.next_look[m] = step + max(steps_clear(-u.eta[m], way) - EARLY, 1)


@jit
def finish(slot, op, near, count, step):
    """Adds the forces of the last step; notes which points are known at `step`, and how clear all are at least."""
    u, v, way = slot.u, slot.v, way_of_step(slot, op)
    swaying = slot.v_active > 0
    for i in range(count):
        m = near[i]
        if u.pending[m] != 0.0:
            modal.kick(u, shape(op, m), u.pending[m], slot.active)
        if swaying and v.pending[m] != 0.0:
            modal.kick(v, shape(op, m), v.pending[m], slot.v_active)
        known = u.last_look[m] == step and u.streak[m] > 1
        u.solved_at[m] = step if known else -1
        v.solved_at[m] = u.solved_at[m] if swaying else -1
        u.clearance[m] = -u.eta[m] if u.last_look[m] == step else (u.next_look[m] + EARLY - step) * way
