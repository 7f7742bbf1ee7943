"""A string that frets out: at rest it lies on crowns that stand above the line from the pressed fret to the saddle.

Its modes count from that line, as everywhere, and the crowns that carry it are contact points above it: eq. 12 needs
nothing new. At rest each crown m presses with f_m, which holds mode j at q_j = push sum_m f_m phi_mj / spring_j: in the
terms of modal.py, where a fine step ends in (q, d), the fixed point under constant forces is d = 0 after they act. The
penetrations solve

    eta_m + sum_k Y_mk K [eta_k]_+^alpha = g_m,   Y_mk = push sum_j phi_mj phi_kj / spring_j + R_mk,

by Newton's method, halving steps that overshoot; Y is the operator's, for a tuned string over the square of the ratio.

A string plucked from rest lies there first. What hands take from a motion they take from its distance to rest: the
energy of string and contact together is convex and least at rest, so that never adds to it. A string that presses on
crowns never becomes zero; once it stands still (modal.UNHEARD, in every quality) at LOOKS looks in a row its note is
over. A sensor of displacement would feel that as a step: there it lies on. `slot` is a SLOT, `op` its OPERATOR. [any
thread]
"""

import numpy as np

from livebass.compiling import apart, jit
from livebass.kernels.machine.elementary import power, square
from livebass.kernels.string import contact, modal
from livebass.kernels.string.frame import invalidate_contact
from livebass.kernels.string.operators import heights, number_at, shape_row, tap_row, yields

START = 10e-6  # m of penetration
FOUND = 1e-15  # m, of the equation's residual
MAX_STEPS, SHORTEST = 60, 1e-3  # of Newton's method; the shortest part of one
LOOKS = 6  # slot.REST_EVERY frames apart


@jit
def residual_at_rest(solver, op, height, soft, count):
    """Fills solver.residual and solver.law for the penetrations solver.r; returns the greatest residual (m)."""
    eta, f, left = solver.r, solver.law, solver.residual
    for m in range(count):
        f[m] = op.stiffness * power(eta[m], op.exponent) if eta[m] > 0.0 else 0.0
    greatest = 0.0
    for m in range(count):
        row = yields(op, m)
        x = eta[m] - height[m]
        for k in range(count):
            x += soft * row[k] * f[k]
        left[m] = x
        greatest = max(greatest, abs(x))
    return greatest


@jit
def find_forces(solver, op, soft):
    """Solves for the penetrations at rest, solver.r, and the forces, solver.law (N/m)."""
    height, count = heights(op), op.points
    eta, before, matrix = solver.r, solver.old, solver.matrix
    for m in range(count):
        eta[m] = min(height[m], START)
    greatest = residual_at_rest(solver, op, height, soft, count)
    for _ in range(MAX_STEPS):
        if greatest < FOUND:
            break
        for k in range(count):
            slope = op.exponent * solver.law[k] / eta[k] if eta[k] > 0.0 else 0.0
            for m in range(count):
                matrix[m, k] = soft * yields(op, m)[k] * slope
            matrix[k, k] += 1.0
        contact.eliminate(matrix, solver.residual, count)
        for m in range(count):
            before[m] = eta[m]
            solver.wanted[m] = solver.residual[m]
        part, last = 1.0, greatest
        while True:
            for m in range(count):
                eta[m] = before[m] - part * solver.wanted[m]
            greatest = residual_at_rest(solver, op, height, soft, count)
            if greatest < last or part < SHORTEST:
                break
            part *= 0.5
        if not greatest < last:
            break


@apart
def settle(slot, op):
    """Computes slot.rest for the slot's tuning."""
    solver, rest = slot.u.solver, slot.rest
    find_forces(solver, op, 1.0 / square(slot.ratio))
    rest[: op.padded] = 0.0
    for m in range(op.points):
        if solver.law[m] > 0.0:
            row = shape_row(op, m)
            for j in range(op.modes):
                rest[j] += op.push * solver.law[m] * number_at(row, op, j) / modal.spring_of(slot.u, j)


@jit
def lies_on(slot, ops):
    """The fret that the string of a slot, not between two frets, lies on at rest, beyond its own; 0: on its own.

    Over a board the string ends there. `ops`: its string's operators.
    """
    op, on = ops[slot.fret], np.int64(0)
    if op.draped:
        return ops[0].points - op.points + op.draped
    for fret in range(slot.fret + 1, ops.shape[0]):
        if slot.fret > 0 and ops[fret].length == op.length:
            on = np.int64(fret)
    return on


@jit
def lay(slot, op):
    """Lays a string without motion on the crowns."""
    modal.add_rest(slot.u, op.padded, slot.rest, 1.0)
    slot.active = op.padded
    slot.still = 0


@jit
def hide_step(voice, slot, op):
    """Spreads the step from a silent string to a draped one over a millisecond, at a sensor of displacement."""
    if op.draped and voice.pickups == 0 and not voice.raw:
        high = modal.dot_of_row(op, tap_row(op, 0), slot.rest, op.tap_modes)
        slot.offset = -high * op.length / voice.saddle[0]


@jit
def leave_rest(slot, op):
    """Makes u's motion count from rest, for hands that take part of it."""
    if op.draped:
        modal.add_rest(slot.u, op.padded, slot.rest, -1.0)


@jit
def return_to_rest(slot, op):
    """Makes u's motion count from the line again."""
    if op.draped:
        modal.add_rest(slot.u, op.padded, slot.rest, 1.0)
        slot.active = op.padded
        invalidate_contact(slot.v, op)  # where friction holds it is stale


@jit
def is_over(voice, slot, op):
    """True if the string, over crowns that carry it, has stood still for LOOKS looks; friction may hold it aside."""
    fastest = modal.fastest_mode(slot.u, op.padded)
    if slot.v_active > 0:
        fastest = max(fastest, modal.fastest_mode(slot.v, op.padded))
    felt = voice.pickups == 0 and slot.hand == 1.0
    if felt or slot.moving or slot.sunk > 0 or fastest > square(modal.UNHEARD * op.fine):
        slot.still = 0
        return False
    slot.still += 1
    return slot.still >= LOOKS


@jit
def speed_square_of_contact(slot, op, step):
    """Returns the maximum that the energy in contacts at fine step `step` can add to modal.speed_square, m^3/s^2."""
    u, x = slot.u, 0.0
    for m in range(op.points):
        if u.solved_at[m] == step and u.eta[m] > 0.0:
            x += u.eta[m] * power(u.eta[m], op.exponent)
    over_mass = op.push / square(op.fine)  # dx / mu
    return 2.0 * over_mass * op.stiffness / (op.exponent + 1.0) * x
