"""A string over frets: up to MOST_NEAR contact points, whose forces move each other.

A fine step is one pass over the modes of a polarisation: it adds the forces of the step before, moves on, and sums the
displacements at the points near. Then the forces are solved for at these points alone. v feels the friction of eq. 7
where u touches; u does not feel v. [any thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels import contact, modal
from livebass.kernels.frame import NEVER, advance, begin_contact, operator_at, string_at, suspicious
from livebass.kernels.operators import coupling, left_out, shape
from livebass.kernels.records import NEAR


@entry("void(int64, int64, int64, int64)")
def over_frets(string, k, op, steps):
    """Moves slot `k` of the string at an address over a frame of `steps` fine steps; `op`: address of its operator."""
    s = string_at(string)
    advance(s.slots[k], operator_at(op), s.voice, steps, find_suspects, next_look, fine_steps)


@jit
def find_suspects(slot, op, step, end):
    """Looks at every point that is due; `frame.advance` says what it returns."""
    suspects = looks = np.int64(0)  # a constant would be a type of its own
    for m in range(op.points):
        if end <= slot.u.due[m]:
            continue
        slot.looked[looks] = m
        looks += 1
        if suspicious(slot, op, m, step, end):
            slot.suspects[suspects] = m
            suspects += 1
    return suspects, looks


@jit
def next_look(slot, op, end):
    """Returns the fine step before which no point needs a look."""
    least = NEVER
    for m in range(op.points):
        least = min(least, slot.u.due[m])
    return least


@jit
def fine_steps(slot, op, voice, near, count, steps, step):
    """Takes `steps` fine steps from `step` on, with contact and friction solved at the `count` points in `near`."""
    u, v, swaying, height = slot.u, slot.v, slot.v_active > 0, slot.u.height
    gather(u, op, near, count)
    for i in range(count):
        m = near[i]
        if u.solved_at[m] != step:
            u.eta[m] = height[m] - modal.displacement(u, shape(op, m), slot.active)
            u.eta_before[m] = height[m] - modal.displacement_step_before(u, shape(op, m), slot.active)
    if swaying:
        gather(v, op, near, count)
        for i in range(count):
            m = near[i]
            if v.solved_at[m] != step:
                v.moved[m] = modal.displacement(v, shape(op, m), slot.v_active)
                v.moved_before[m] = modal.displacement_step_before(v, shape(op, m), slot.v_active)
    couple(slot, op, near, count)
    for _ in range(steps):
        step += 1
        if swaying:
            move(v, near, count, slot.v_active)
            slide(slot, op, near, count)
        move(u, near, count, slot.active)
        press(slot, op, voice, near, count, step)
    finish(u, near, count, slot.active, step)
    if swaying:
        finish(v, near, count, slot.v_active, step)
    for i in range(count):
        u.clearance[near[i]] = -u.eta[near[i]]


@jit
def gather(w, op, near, count):
    """Copies the mode shapes at the points in `near` into the working set, where no force acts yet."""
    for i in range(count):
        modal.copy(w.near_shape[i], shape(op, near[i]), op.padded)
        w.force[near[i]] = 0.0
        w.force_before[near[i]] = 0.0
    for i in range(count + NEAR):
        w.pending[i] = 0.0


@jit
def couple(slot, op, near, count):
    """Gathers W between the points in `near`, the modes left out included."""
    soft = 1.0 / (slot.ratio * slot.ratio)  # modes tuned higher are stiffer
    for i in range(count):
        w, r = coupling(op, near[i]), left_out(op, near[i])
        for k in range(count):
            slot.u.coupling[i, k] = w[near[k]] + soft * r[near[k]]


@jit
def move(w, near, count, n):
    """Takes one fine step of `n` modes after the pending forces; w.free receives the displacements at the points."""
    for i in range(NEAR, count):
        if w.pending[i] != 0.0:
            modal.kick_near(w, i, w.pending[i], n)
    if count == 1:
        w.free[near[0]] = modal.fine_1(w, w.pending[0], n)
    elif count == 2:
        u0, u1 = modal.fine_2(w, w.pending[0], w.pending[1], n)
        w.free[near[0]] = u0
        w.free[near[1]] = u1
    elif count == 3:
        u0, u1, u2 = modal.fine_3(w, w.pending[0], w.pending[1], w.pending[2], n)
        w.free[near[0]] = u0
        w.free[near[1]] = u1
        w.free[near[2]] = u2
    else:
        u0, u1, u2, u3 = modal.fine_4(w, w.pending[0], w.pending[1], w.pending[2], w.pending[3], n)
        w.free[near[0]] = u0
        w.free[near[1]] = u1
        w.free[near[2]] = u2
        w.free[near[3]] = u3
        for i in range(NEAR, count):
            w.free[near[i]] = modal.displacement_near(w, i, n)


@jit
def press(slot, op, voice, near, count, step):
    """Solves contact at `step`, the one that `move` made."""
    u, height = slot.u, slot.u.height
    hit = False
    for i in range(count):
        m = near[i]
        free = height[m] - u.free[m]
        hit = hit or free > 0.0 or u.eta_before[m] > 0.0
        u.wanted[m] = free - u.eta_before[m]
    if not hit:
        for i in range(count):
            m = near[i]
            eta = u.eta_before[m] + u.wanted[m]
            u.eta_before[m] = u.eta[m]
            u.eta[m] = eta
            u.force[m] = 0.0
            u.force_before[m] = 0.0
            u.pending[i] = 0.0
        return
    for i in range(count):  # first guesses: the forces go on as they went
        m = near[i]
        last = u.force[m]
        u.force[m] = max(2.0 * last - u.force_before[m], 0.0)
        u.force_before[m] = last
    touching = contact.solve_points(u, op, near, count)
    for i in range(count):
        m = near[i]
        eta = u.eta_before[m] + u.wanted[m] - contact.felt(op, u.coupling, u.force, near, count, i)
        if eta > 0.0 and u.eta[m] <= 0.0:
            begin_contact(slot, voice, step, m)
        u.eta_before[m] = u.eta[m]
        u.eta[m] = eta
        u.pending[i] = op.push * u.force[m]
    if touching > 0:
        slot.active = op.padded


@jit
def slide(slot, op, near, count):
    """Solves friction of the step that `move` made of v; before `press`, while u.eta is that at its start."""
    v = slot.v
    if contact.solve_friction(slot, op, near, count):
        slot.v_active = op.padded
    for i in range(count):
        m = near[i]
        v.moved_before[m] = v.moved[m]
        v.moved[m] = v.free[m] + contact.felt(op, slot.u.coupling, v.force, near, count, i)
        v.pending[i] = op.push * v.force[m]


@jit
def finish(w, near, count, n, step):
    """Adds the forces of the last step, and notes which step it was."""
    for i in range(count):
        if w.pending[i] != 0.0:
            modal.kick_near(w, i, w.pending[i], n)
        w.solved_at[near[i]] = step
