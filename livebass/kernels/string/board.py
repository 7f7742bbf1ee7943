"""A string over a board, or over frets and the wood between: hundreds of independent contact points.

The grid has one step more than modes, so W couples no points (eq. 12) and each force is one scalar equation.

Points are first checked in groups of GROUP. The string is nowhere steeper than `fastest` over its wave speed, so the
displacement at a group's middle and the group's highest point bound the clearance of all its points. Only groups that
remain in doubt are checked point by point.

Of a hundred points near the string about ten are checked per fine step (watch.py), and about five touch. v, across the
board, feels friction where u touches; it is sensed at the same points. [any thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.string import frame, modal
from livebass.kernels.string.contact import friction_alone, solve_point
from livebass.kernels.string.operators import positions
from livebass.kernels.string.records import GROUP
from livebass.kernels.string.watch import fine_steps, schedule


@entry("void(int64, int64, int64, int64)")
def over_board(string, k, op, steps):
    """Moves slot `k` of the string at an address over a frame of `steps` fine steps; `op`: address of its operator."""
    frame.advance_frame(string, k, op, steps, suspect_points, next_check_board, fine_steps_board)


@jit
def groups_of(op):
    """Number of groups of contact points."""
    return (op.points + GROUP - 1) // GROUP


@jit
def suspect_points(slot, op, step, end):
    """Checks the groups that are due, then the points of doubtful groups; returns as `frame.advance_frame` wants."""
    suspects = checks = np.int64(0)  # a constant would have its own type
    for g in range(groups_of(op)):
        slot.u.group_clearance_now[g] = 0.0
        if end <= slot.u.group_due[g] or not doubtful(slot, op, g, step, end):
            continue
        last = min((g + 1) * GROUP, op.points)
        suspects, checks = frame.suspect_between(slot, op, step, end, g * GROUP, last, suspects, checks)
    return suspects, checks


@jit
def doubtful(slot, op, g, step, end):
    """Checks group `g`; True if one of its points may touch between `step` and `end`."""
    u, travel = slot.u, frame.max_travel(slot, op)
    first = g * GROUP
    last = min(first + GROUP, op.points) - 1
    middle = (first + last) // 2
    height, x = u.height, positions(op)
    top = height[first]
    for m in range(first + 1, last + 1):
        top = max(top, height[m])
    top += slot.fastest / (op.speed * slot.ratio) * max(x[last] - x[middle], x[middle] - x[first])
    clearance = modal.displacement(u, slot.active, op, middle) - top
    known = u.group_known_at[g]
    before = u.group_clearance[g]
    if known < 0 or known >= step or before + clearance <= travel * (end - known):
        before = modal.displacement_before_leap(u, slot.active, op, middle) - top
        known = step
        u.group_clearance[g] = before
        u.group_known_at[g] = known
    if before <= 0.0 or clearance <= 0.0 or before + clearance <= travel * (end - known):
        return True
    u.group_clearance_now[g] = clearance
    return False


@jit
def next_check_board(slot, op, end):
    """Saves the groups' clearances after a frame without contact; returns the fine step of the next check."""
    u, travel = slot.u, frame.max_travel(slot, op)
    minimum = frame.NEVER
    for g in range(groups_of(op)):
        if u.group_clearance_now[g] > 0.0:
            u.group_clearance[g] = u.group_clearance_now[g]
            u.group_known_at[g] = end
            u.group_due[g] = end + frame.steps_clear(u.group_clearance_now[g], travel)
        if u.group_due[g] > end:
            minimum = min(minimum, u.group_due[g])
            continue
        for m in range(g * GROUP, min((g + 1) * GROUP, op.points)):
            minimum = min(minimum, max(u.due[m], end))
    return minimum


@jit
def solve_contact_on_board(slot, op, voice, watched, count, step):
    """Solves contact at `step`, and schedules the next check of each point."""
    u, travel, height = slot.u, frame.max_travel(slot, op), slot.u.height
    for i in range(count):
        m = watched[i]
        old, before = u.eta_before[m], u.eta[m]
        free = height[m] - u.free[m]
        eta = free
        f = 0.0
        if free > 0.0 or old > 0.0:
            guess = max(2.0 * u.force[m] - u.force_before[m], 0.0)
            f = solve_point(free - old, old, op.weight, op, guess)
            eta = free - op.weight * f
            if f != 0.0:
                slot.active = op.padded
        if eta > 0.0 and before <= 0.0:
            frame.log_contact(slot, voice, step, m, (eta - before) / op.fine)
        u.force_before[m] = u.force[m]
        u.force[m] = f
        u.eta_before[m] = before
        u.eta[m] = eta
        u.pending[m] = op.push * f
        schedule(u, m, travel, step)


@jit
def solve_friction_on_board(slot, op, watched, count):
    """Solves friction (eq. 7) for v's latest step; u still has the penetration at its start."""
    u, v = slot.u, slot.v
    for i in range(count):
        m = watched[i]
        f = 0.0
        if u.eta[m] > 0.0:
            f = friction_alone(op, v.free[m] - v.moved_before[m], op.weight)
            slot.v_active = op.padded
        v.moved_before[m] = v.moved[m]
        v.moved[m] = v.free[m] + op.weight * f
        v.pending[m] = op.push * f


fine_steps_board = fine_steps(solve_friction_on_board, solve_contact_on_board)
