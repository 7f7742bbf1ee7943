"""A string over a board, or over frets and the wood between: contact points by the hundred, each on its own.

The grid has one step more than there are modes, so that W couples no points (eq. 12) and each force is one scalar
equation.

Points are looked at in groups of GROUP first. The string is nowhere steeper than `fastest` over the speed of its waves,
so that the displacement at a group's middle and its highest point tell how clear all of it is at least. Only groups
that this leaves in doubt are looked at point by point.

In fine steps a point is looked at when it could be reached, from EARLY steps before it could touch in every one:
eq. 12 needs its penetration at n - 1, n and n + 1. Of a hundred points near the string some ten are looked at in a
step, and some five touch. v, across the board, feels friction where u touches; it is sensed at the same points.
[any thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels import modal
from livebass.kernels.contact import friction_alone, solve_point
from livebass.kernels.frame import (
    NEVER,
    advance,
    begin_contact,
    operator_at,
    steps_clear,
    string_at,
    suspicious,
    way_of_step,
)
from livebass.kernels.operators import positions, shape
from livebass.kernels.records import GROUP

EARLY = 2  # steps that a point is looked at before it could touch


@entry("void(int64, int64, int64, int64)")
def over_board(string, k, op, steps):
    """Moves slot `k` of the string at an address over a frame of `steps` fine steps; `op`: address of its operator."""
    s = string_at(string)
    advance(s.slots[k], operator_at(op), s.voice, steps, find_suspects, next_look, fine_steps)


@jit
def groups_of(op):
    """Number of groups of contact points."""
    return (op.points + GROUP - 1) // GROUP


@jit
def find_suspects(slot, op, step, end):
    """Looks at groups that are due, then at points of those in doubt; `frame.advance` says what it returns."""
    suspects = looks = np.int64(0)  # a constant would be a type of its own
    for g in range(groups_of(op)):
        slot.u.group_clearance_now[g] = 0.0
        if end <= slot.u.group_due[g] or not doubtful(slot, op, g, step, end):
            continue
        for m in range(g * GROUP, min((g + 1) * GROUP, op.points)):
            if end <= slot.u.due[m]:
                continue
            slot.looked[looks] = m
            looks += 1
            if suspicious(slot, op, m, step, end):
                slot.suspects[suspects] = m
                suspects += 1
    return suspects, looks


@jit
def doubtful(slot, op, g, step, end):
    """Looks at group `g`; True if a point of it may touch between `step` and `end`."""
    u, way = slot.u, way_of_step(slot, op)
    first = g * GROUP
    last = min(first + GROUP, op.points) - 1
    middle = (first + last) // 2
    height, x = u.height, positions(op)
    top = height[first]
    for m in range(first + 1, last + 1):
        top = max(top, height[m])
    top += slot.fastest / (op.speed * slot.ratio) * max(x[last] - x[middle], x[middle] - x[first])
    clearance = modal.displacement(u, shape(op, middle), slot.active) - top
    known = u.group_known_at[g]
    before = u.group_clearance[g]
    if known < 0 or known >= step or before + clearance <= way * (end - known):
        before = modal.displacement_before_leap(u, shape(op, middle), slot.active) - top
        known = step
        u.group_clearance[g] = before
        u.group_known_at[g] = known
    if before <= 0.0 or clearance <= 0.0 or before + clearance <= way * (end - known):
        return True
    u.group_clearance_now[g] = clearance
    return False


@jit
def next_look(slot, op, end):
    """Notes the clearance of the groups after a frame without contact; returns the fine step of the next look."""
    u, way = slot.u, way_of_step(slot, op)
    least = NEVER
    for g in range(groups_of(op)):
        if u.group_clearance_now[g] > 0.0:
            u.group_clearance[g] = u.group_clearance_now[g]
            u.group_known_at[g] = end
            u.group_due[g] = end + steps_clear(u.group_clearance_now[g], way)
        if u.group_due[g] > end:
            least = min(least, u.group_due[g])
            continue
        for m in range(g * GROUP, min((g + 1) * GROUP, op.points)):
            least = min(least, max(u.due[m], end))
    return least


@jit
def fine_steps(slot, op, voice, near, count, steps, step):
    """Takes `steps` fine steps from `step` on, with contact and friction solved at the `count` points in `near`.

    u.clearance is that of the points, at least, before and after.
    """
    u, v, seen = slot.u, slot.v, slot.seen
    recall(slot, op, near, count, step)
    for _ in range(steps):
        step += 1
        looks = np.int64(0)
        for i in range(count):
            if u.next_look[near[i]] <= step:
                seen[looks] = near[i]
                looks += 1
        if slot.v_active > 0:
            move(v, op, seen, looks, slot.v_active)
            sense(v, op, seen, looks, slot.v_active)
            slide(slot, op, seen, looks)
        move(u, op, seen, looks, slot.active)
        sense(u, op, seen, looks, slot.active)
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
        v.pending[m] = 0.0
        u.last_look[m] = step
        u.streak[m] = 2
        u.next_look[m] = step + 1
        if u.solved_at[m] != step:
            if u.clearance[m] > (EARLY + 2) * way:
                u.eta[m] = -u.clearance[m]
                u.eta_before[m] = -u.clearance[m]
                u.next_look[m] = step + steps_clear(u.clearance[m], way) - EARLY
                u.streak[m] = 0
                continue
            u.eta[m] = height[m] - modal.displacement(u, shape(op, m), slot.active)
            u.eta_before[m] = height[m] - modal.displacement_step_before(u, shape(op, m), slot.active)
        if slot.v_active > 0 and v.solved_at[m] != step:
            v.moved[m] = modal.displacement(v, shape(op, m), slot.v_active)
            v.moved_before[m] = modal.displacement_step_before(v, shape(op, m), slot.v_active)


@jit
def move(w, op, seen, count, n):
    """Takes one fine step of `n` modes after the pending forces; four forces go in the same pass."""
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
def press(slot, op, voice, seen, count, step):
    """Solves contact at `step`, and notes when each point is to be looked at again."""
    u, way, height = slot.u, way_of_step(slot, op), slot.u.height
    touching = False
    for i in range(count):
        m = seen[i]
        old, before = u.eta_before[m], u.eta[m]
        free = height[m] - u.free[m]
        eta = free
        f = 0.0
        if free > 0.0 or old > 0.0:
            guess = max(2.0 * u.force[m] - u.force_before[m], 0.0)
            f = solve_point(free - old, old, op.weight, op, guess)
            eta = free - op.weight * f
            touching = touching or f != 0.0
        if eta > 0.0 and before <= 0.0:
            begin_contact(slot, voice, step, m)
        u.force_before[m] = u.force[m]
        u.force[m] = f
        u.eta_before[m] = before
        u.eta[m] = eta
        u.pending[m] = op.push * f
        u.streak[m] = u.streak[m] + 1 if u.last_look[m] == step - 1 else 1
        u.last_look[m] = step
        u.next_look[m] = step + 1
        if eta < 0.0 and before <= 0.0 and f == 0.0:
            u.next_look[m] = step + max(steps_clear(-eta, way) - EARLY, 1)
    if touching:
        slot.active = op.padded


@jit
def slide(slot, op, seen, count):
    """Solves friction (eq. 7) of the step just made of v; u still has the penetration at its start."""
    u, v = slot.u, slot.v
    touching = False
    for i in range(count):
        m = seen[i]
        f = 0.0
        if u.eta[m] > 0.0:
            f = friction_alone(op, v.free[m] - v.moved_before[m], op.weight)
            touching = True
        v.moved_before[m] = v.moved[m]
        v.moved[m] = v.free[m] + op.weight * f
        v.pending[m] = op.push * f
    if touching:
        slot.v_active = op.padded


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
