"""A string over frets: up to MAX_NEAR contact points, coupled by their forces.

A fine step is one pass over a polarisation's modes: it adds the previous step's forces, advances, and sums the
displacements at the watched points (watch.py). Then it solves for the forces at these points only. v feels the friction
of eq. 7 where u touches; u does not feel v. [any thread]
"""

from livebass.compiling import entry, jit
from livebass.kernels.string import contact, frame
from livebass.kernels.string.operators import coupling, left_out
from livebass.kernels.string.watch import fine_steps, schedule


@entry("void(int64, int64, int64, int64)")
def over_frets(string, k, op, steps):
    """Moves slot `k` of the string at an address over a frame of `steps` fine steps; `op`: address of its operator."""
    frame.advance_frame(string, k, op, steps, suspect_frets, next_check_frets, fine_steps_frets)


@jit
def suspect_frets(slot, op, step, end):
    """Checks every point that is due; returns as `frame.advance_frame` wants."""
    return frame.suspect_between(slot, op, step, end, 0, op.points, 0, 0)


@jit
def next_check_frets(slot, op, end):
    """Returns the fine step before which no point needs a check."""
    minimum = frame.NEVER
    for m in range(op.points):
        minimum = min(minimum, slot.u.due[m])
    return minimum


@jit
def couple(slot, op):
    """Sets u.coupling to W between the points, including the omitted modes, unless it is up to date."""
    if slot.coupled == op.coupling and slot.coupled_ratio == slot.ratio:
        return
    slot.coupled = op.coupling
    slot.coupled_ratio = slot.ratio
    soft = 1.0 / (slot.ratio * slot.ratio)  # modes tuned higher are stiffer
    for m in range(op.points):
        w, r = coupling(op, m), left_out(op, m)
        for k in range(op.points):
            slot.u.coupling[m, k] = w[k] + soft * r[k]


@jit
def solve_contact_on_frets(slot, op, voice, watched, count, step):
    """Solves contact at `step`, which `move` has made, and schedules the next check of each point."""
    u, travel, height = slot.u, frame.max_travel(slot, op), slot.u.height
    hit = False
    for i in range(count):
        m = watched[i]
        free = height[m] - u.free[m]
        hit = hit or free > 0.0 or u.eta_before[m] > 0.0
        u.wanted[m] = free - u.eta_before[m]
    if not hit:
        for i in range(count):
            m = watched[i]
            eta = u.eta_before[m] + u.wanted[m]
            u.eta_before[m] = u.eta[m]
            u.eta[m] = eta
            u.force[m] = 0.0
            u.force_before[m] = 0.0
            u.pending[m] = 0.0
            schedule(u, m, travel, step)
        return
    for i in range(count):  # first guesses extrapolate the forces
        m = watched[i]
        last = u.force[m]
        u.force[m] = max(2.0 * last - u.force_before[m], 0.0)
        u.force_before[m] = last
    touching = contact.solve_points(u, op, watched, count)
    for i in range(count):
        m = watched[i]
        eta = u.eta_before[m] + u.wanted[m] - contact.displacement_at(op, u.coupling, u.force, watched, count, m)
        if eta > 0.0 and u.eta[m] <= 0.0:
            frame.log_contact(slot, voice, step, m, (eta - u.eta[m]) / op.fine)
        u.eta_before[m] = u.eta[m]
        u.eta[m] = eta
        u.pending[m] = op.push * u.force[m]
        schedule(u, m, travel, step)
    if touching > 0:
        slot.active = op.padded


@jit
def solve_friction_on_frets(slot, op, watched, count):
    """Solves friction for v's fine step; call it before `solve_contact_on_frets`: u.eta must be that at its start."""
    v = slot.v
    if contact.solve_friction(slot, op, watched, count):
        slot.v_active = op.padded
    for i in range(count):
        m = watched[i]
        v.moved_before[m] = v.moved[m]
        v.moved[m] = v.free[m] + contact.displacement_at(op, slot.u.coupling, v.force, watched, count, m)
        v.pending[m] = op.push * v.force[m]


steps_over_frets = fine_steps(solve_friction_on_frets, solve_contact_on_frets)


@jit
def fine_steps_frets(slot, op, voice, near, count, steps, step):
    """`watch.fine_steps` over frets, which the forces couple."""
    couple(slot, op)
    steps_over_frets(slot, op, voice, near, count, steps, step)
