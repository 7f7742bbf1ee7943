"""Fine steps with contact: chooses the near contact points to watch in each, for frets and boards alike.

Eq. 12 needs a point's penetration at n - 1, n and n + 1. So a point is watched in every step from EARLY steps before
the string could touch it: of a dozen near frets, or a hundred near points of a board, only a few are watched per step.
frets.py and board.py solve for the forces at these, and `schedule` their next watch. [any thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.string import modal
from livebass.kernels.string.frame import max_travel, steps_clear

EARLY = 2  # steps that a point is watched before it could touch
FAR = EARLY + 2  # steps: a point that cannot touch within these is skipped for a while


def fine_steps(solve_friction, solve_contact):
    """Makes the kernel for fine steps that solves contact and friction with these two functions.

    solve_friction(slot, op, points, count) solves friction for v's latest step, solve_contact(slot, op, voice, points,
    count, step) contact for u's latest step.
    """

    def take(slot, op, voice, near, count, steps, step):
        """Takes `steps` fine steps from `step` on, solving for the forces at the `count` points in `near`.

        u starts where its last modal.try_leap started. u.clearance is a lower bound, before and after.
        """
        u, v, watched = slot.u, slot.v, slot.watched
        load_points(slot, op, near, count, step)
        for k in range(steps):
            step += 1
            watching = find_watched(slot, near, count, step)
            if slot.v_active > 0:
                friction_points = find_friction_points(slot, op, watching)
                if k == 0:
                    modal.first_step(v, slot.v_active)
                    read_displacements(v, op, slot.friction_points, friction_points, slot.v_active)
                else:
                    fine_step(v, op, slot.friction_points, friction_points, slot.v_active)
                solve_friction(slot, op, slot.friction_points, friction_points)
            if k == 0:
                modal.first_step_before_leap(u, slot.active)
                read_displacements(u, op, watched, watching, slot.active)
            else:
                fine_step(u, op, watched, watching, slot.active)
            solve_contact(slot, op, voice, watched, watching, step)
        save_points(slot, op, near, count, step)
        end_fine_steps(u, op, near, count, slot.active)
        end_fine_steps(v, op, near, count, slot.v_active)

    take.__qualname__ = f"fine_steps.{solve_contact.__name__}"
    return jit(take)


@jit
def end_fine_steps(w, op, near, count, n):
    """Applies the last step's forces at the points in `near` to `n` modes, which return to (q, P)."""
    last = np.int64(-1)
    for i in range(count):
        m = near[i]
        if w.pending[m] != 0.0:
            if last >= 0:
                modal.kick(w, n, op, last, w.pending[last])
            last = m
    if last >= 0:
        modal.to_momenta_after(w, n, op, last, w.pending[last])
    else:
        modal.to_momenta(w, n)


@jit
def load_points(slot, op, near, count, step):
    """Loads the penetrations of the points in `near` at `step` and before, or marks points as clear for a while."""
    u, v, travel, height = slot.u, slot.v, max_travel(slot, op), slot.u.height
    for i in range(count):
        m = near[i]
        u.force[m] = 0.0
        u.force_before[m] = 0.0
        u.pending[m] = 0.0
        v.force[m] = 0.0
        v.pending[m] = 0.0
        u.last_watched[m] = step
        u.watched_steps[m] = 2
        u.next_watch[m] = step + 1
        if u.solved_at[m] != step:
            if u.clearance[m] <= FAR * travel:
                u.clearance[m] = modal.displacement_before_leap(u, slot.active, op, m) - height[m]
            u.eta[m] = -u.clearance[m]
            if u.clearance[m] > FAR * travel:
                u.eta_before[m] = -u.clearance[m]
                u.next_watch[m] = step + steps_clear(u.clearance[m], travel) - EARLY
                u.watched_steps[m] = 0
                continue
            u.eta_before[m] = height[m] - modal.displacement_step_before_leap(u, slot.active, op, m)
        if slot.v_active > 0 and v.solved_at[m] != step and u.eta[m] > -EARLY * travel:
            v.moved[m] = modal.displacement(v, slot.v_active, op, m)
            if u.eta[m] > 0.0:
                v.moved_before[m] = modal.displacement_step_before(v, slot.v_active, op, m)


@jit
def find_watched(slot, near, count, step):
    """Fills slot.watched with the points in `near` to watch in fine step `step`; returns their number."""
    watching = np.int64(0)  # a constant would have its own type
    for i in range(count):
        if slot.u.next_watch[near[i]] <= step:
            slot.watched[watching] = near[i]
            watching += 1
    return watching


@jit
def find_friction_points(slot, op, count):
    """Fills slot.friction_points with the points in slot.watched[:count] that sense v; returns their number.

    Friction at n + 1 acts where u touches at n, and needs v at n - 1 and n: v is sensed if u could touch within EARLY
    steps.
    """
    u, v, travel = slot.u, slot.v, max_travel(slot, op)
    friction_points = np.int64(0)
    for i in range(count):
        m = slot.watched[i]
        if u.eta[m] > -EARLY * travel or v.pending[m] != 0.0:
            slot.friction_points[friction_points] = m
            friction_points += 1
    return friction_points


@jit
def fine_step(w, op, watched, count, n):
    """Takes one fine step of `n` modes after the pending forces; w.free receives the points' displacements."""
    if count == 0:
        modal.fine(w, n)
    elif count == 1:
        w.free[watched[0]] = modal.fine_1(w, n, op, watched[0], w.pending[watched[0]])
    elif count == 2:
        a, b = watched[0], watched[1]
        w.free[a], w.free[b] = modal.fine_2(w, n, op, (a, b), (w.pending[a], w.pending[b]))
    elif count <= 4:
        a, b, c, d = watched[0], watched[1], watched[2], watched[count - 1]
        forces = w.pending[a], w.pending[b], w.pending[c], w.pending[d] if count > 3 else 0.0
        w.free[a], w.free[b], w.free[c], w.free[d] = modal.fine_4(w, n, op, (a, b, c, d), forces)
    else:
        fine_step_with_forces(w, op, watched, count, n)
        read_displacements(w, op, watched, count, n)


@jit
def fine_step_with_forces(w, op, watched, count, n):
    """`fine_step` without the displacements; up to four forces share the step's pass."""
    pending = np.int64(0)
    a = b = c = d = np.int64(0)
    for i in range(count):
        m = watched[i]
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
            modal.kick(w, n, op, m, w.pending[m])
        pending += 1
    if pending == 0:
        modal.fine(w, n)
    elif pending <= 2:
        modal.fine_kicked_2(w, n, op, (a, b), (w.pending[a], w.pending[b] if pending > 1 else 0.0))
    else:
        forces = w.pending[a], w.pending[b], w.pending[c], w.pending[d] if pending > 3 else 0.0
        modal.fine_kicked_4(w, n, op, (a, b, c, d), forces)


@jit
def read_displacements(w, op, watched, count, n):
    """Reads the displacements at the points in `watched` into w.free."""
    i = 0
    while i + 3 < count:
        a, b, c, d = watched[i], watched[i + 1], watched[i + 2], watched[i + 3]
        u0, u1, u2, u3 = modal.displacement_4(w, n, op, (a, b, c, d))
        w.free[a] = u0
        w.free[b] = u1
        w.free[c] = u2
        w.free[d] = u3
        i += 4
    while i < count:
        w.free[watched[i]] = modal.displacement(w, n, op, watched[i])
        i += 1


@jit
def schedule(u, m, travel, step):
    """Marks point `m` as solved in fine step `step`, and schedules its next watch."""
    u.watched_steps[m] = u.watched_steps[m] + 1 if u.last_watched[m] == step - 1 else 1
    u.last_watched[m] = step
    u.next_watch[m] = step + 1
    if u.eta[m] < 0.0 and u.eta_before[m] <= 0.0 and u.force[m] == 0.0:
        u.next_watch[m] = step + max(steps_clear(-u.eta[m], travel) - EARLY, 1)


@jit
def save_points(slot, op, near, count, step):
    """Saves the solved points at `step`, and lower bounds of all clearances."""
    u, v, travel = slot.u, slot.v, max_travel(slot, op)
    v_moves = slot.v_active > 0
    for i in range(count):
        m = near[i]
        known = u.last_watched[m] == step and u.watched_steps[m] > 1
        u.solved_at[m] = step if known else -1
        v.solved_at[m] = u.solved_at[m] if v_moves else -1
        u.clearance[m] = -u.eta[m] if u.last_watched[m] == step else (u.next_watch[m] + EARLY - step) * travel
