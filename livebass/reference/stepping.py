"""The fine steps of a brute-force string with hands on it: every step of eq. 12, mode, contact point and hand.

A hand (livebass.reference.hands) is one more contact point. Its row of Phi is s_j = phi_j(x) exp(-(k_j a)^2 / 2), its
"height" y moves, and eta = y - u below the string or u - y above it (sign 1 or -1). Forces are per m of string as those
of the frets, so that a point force is f dx. With r = eta^{n+1} - eta^{n-1}, all forces at once solve eq. 6 of
livebass.reference.laws, r = r* - (W + R) f(r), where a hand's law is

    finger:  f = (R / dx) r / (2 dt), y = 0, in both polarisations;
    stop:    f = (K / dx) (eta^{n+1} + eta^{n-1}) / 2, or one-sided as in eq. 6 with alpha = 1; y = b^{n+1} is given;
    mass:    eq. 6 with K / dx, plus beta (K / dx) [(eta^{n+1} + eta^{n-1}) / 2]_+^alpha r / (2 dt), f not below 0; W
             has dt^2 dx / m more on its diagonal, as the mass gives way:
             y^{n+1} = 2 y^n - y^{n-1} + dt^2 (F + f^n dx) / m, F the force of the hand that holds it.

All are implicit, so none adds energy at any time step. For a step of eq. 12, with H that of livebass.reference.solver,

    H + sum over hands of dx [psi(eta^{n+1}) + psi(eta^n)] / 2 + m ((y^{n+1} - y^n) / dt)^2 / 2

changes by minus what damping, friction and frets (all there) and each hand take, R r^2 / (4 dt) a finger and
dx [f r - psi(eta^{n+1}) + psi(eta^{n-1})] / 2 >= 0 a mass, plus what each hand puts in, the force it gives (sign f dx a
stop, F a mass) times (y^{n+1} - y^{n-1}) / 2. When a hand begins or ends, it brings or takes with it what its spring,
contact and motion hold (livebass.reference.playing).

The second polarisation feels fingers and, where they have a path in it, stops. Both are linear there: they are
eliminated, and friction is solved for what is left.

Equation numbers: Issanchou et al. (2018).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from livebass.arrays import Floats, Ints
from livebass.compiling.by_numba import counted
from livebass.reference.laws import (
    ABSENT,
    LINEAR,
    Laws,
    eliminate,
    solve_forces,
    solve_friction,
    stored,
    taken,
)
from livebass.reference.solver import FLUSH_EVERY, Modes, Plan, State, dot, flush, linear_energy

FINGER, STOP, MASS = 0, 1, 2  # kinds of hand


class Grips(NamedTuple):
    """H hands, at the points P, P + 1 ... after the P contact points; `run_held` moves them on in place."""

    kind: Ints  # (H,)
    sign: Floats  # (H,) 1: below the string, -1: above
    mass: Floats  # (H,) kg
    y: Floats  # (H,) y^n, m; 0 of a finger, and while the hand is not there
    move: Floats  # (H,) y^n - y^{n-1}, m, kept apart for the reason that d of the modes is
    across: Floats  # (H,) y^n of v, m
    across_before: Floats  # (H,)
    taken: Floats  # (H,) J so far
    put_in: Floats  # (H,) J so far
    lost: Floats  # (3,) J so far, to damping, to friction and to frets


class Sheets(NamedTuple):
    """Arrays that `run_held` fills: n samples, p places, H hands, c states; an axis of 2 counts polarisations."""

    displacement: Floats  # (p, 2, n) m
    velocity: Floats  # (p, 2, n) m/s
    force: Floats  # (H, n) N on the string, upwards
    height: Floats  # (H, n) m
    stored: Floats  # (2 + H, n) J: string, frets, each hand
    lost: Floats  # (3, n) J: damping, friction, frets
    taken: Floats  # (H, n) J
    put_in: Floats  # (H, n) J
    states: Floats  # (c, 2, 2, N)


class Pace(NamedTuple):
    """How the velocity of N modes follows from q^n, d^{n+1} and d^n."""

    by_q: Floats  # (N,) 1/s
    by_next: Floats  # (N,) 1/s
    by_last: Floats  # (N,) 1/s


class Ears(NamedTuple):
    """Places where `run_held` listens, and the pace of the modes of u and v."""

    every: int  # fine steps a sample
    place: Floats  # (p, N) phi_j at the places of u
    place_across: Floats  # (p, N) and of v
    u: Pace
    v: Pace
    states: Ints  # (c,) samples


@counted
def _freely(of: Modes, q: Floats, d: Floats, d_before: Floats) -> None:
    """Moves the modes of one polarisation a step without forces; keeps d^n."""
    for j in range(q.size):
        d_before[j] = d[j]
        d[j] = of.decay[j] * d[j] - of.pull[j] * q[j]
        q[j] += d[j]


@counted
def _push(plan: Plan, q: Floats, d: Floats, force: Floats) -> None:
    """Adds to the step what the forces (P + H,), N/m, move."""
    scale = plan.dt**2 / plan.density * plan.dx
    for m in range(force.size):
        if force[m] != 0:
            for j in range(q.size):
                push = scale * force[m] * plan.shape[m, j]
                d[j] += push
                q[j] += push


@counted
def _damped(plan: Plan, of: Modes, d: Floats, d_before: Floats, change: Floats) -> float:
    """J that one polarisation loses in a step to its damping and to static compliance; change: f^n - f^{n-2}, N/m."""
    total = 0.0
    for j in range(d.size):
        both = d[j] + d_before[j]  # q^{n+1} - q^{n-1}
        total += (1 - of.decay[j]) * both * both
    total *= plan.density / (4 * plan.dt**2)
    for m in range(change.size):
        if change[m] != 0:
            total += plan.dx / 4 * change[m] * dot(plan.compliance[m], change)
    return total


@counted
def _hands_across(
    plan: Plan, laws: Laws, state: State, grips: Grips, drive: Floats, wanted: Floats, reduced: Floats
) -> tuple[Ints, Floats, Floats, Floats]:
    """Eliminates the hands on v. Writes friction's `wanted` (P + H,) and `reduced` (P, P) with the hands on the string.

    Returns the hands there, as points (L,), their f = -(gain w + offset), both (L,), and their w (L, 1 + P): without
    friction, and for 1 N/m of it at each contact point.
    """
    contacts = reduced.shape[0]
    held = np.empty(grips.kind.size, dtype=np.int64)
    count = 0
    for m in range(contacts, laws.kind.size):
        if laws.kind[m] == LINEAR:
            held[count] = m
            count += 1
    held = held[:count]
    gain, offset = np.empty(count), np.empty(count)
    for a in range(count):
        m = held[a]
        h = m - contacts
        gain[a] = laws.stiffness[m] / 2 + laws.loss[m]
        target = grips.sign[h] * (drive[h] - grips.across_before[h])  # from n - 1 to n + 1
        stretch = state.v_before[m] - grips.sign[h] * grips.across_before[h]
        offset[a] = laws.stiffness[m] * (stretch - target / 2)
    w, matrix, x = np.empty((count, 1 + contacts)), np.empty((count, count)), np.empty(count)
    for column in range(1 + contacts):
        for a in range(count):
            m = held[a]
            x[a] = wanted[m] if column == 0 else plan.coupling[m, column - 1]
            for b in range(count):
                c = plan.coupling[m, held[b]]
                matrix[a, b] = (1.0 if a == b else 0.0) + c * gain[b]
                x[a] -= c * offset[b] if column == 0 else 0.0
        eliminate(matrix, x)
        w[:, column] = x
    for i in range(contacts):
        for a in range(count):
            c = plan.coupling[i, held[a]]
            wanted[i] -= c * (gain[a] * w[a, 0] + offset[a])
            for k in range(contacts):
                reduced[i, k] -= c * gain[a] * w[a, 1 + k]
    return held, gain, offset, w


@counted
def _step_across(plan: Plan, laws: Laws, state: State, grips: Grips, drive: Floats, d_before: Floats) -> bool:
    """Moves v from step n to n + 1 with friction (eq. 7) and hands, and counts the energy. Call it before eta moves.

    laws: of the hands on v; drive: y^{n+1}, (H,) m. Returns False if the friction does not converge.
    """
    q, d, points, hands = state.q_across, state.d_across, plan.height.size, grips.kind.size
    contacts = points - hands
    _freely(plan.v, q, d, d_before)
    free, wanted = np.empty(points), np.empty(points)
    for m in range(points):
        free[m] = dot(plan.shape[m], q)
        wanted[m] = free[m] - state.v_before[m]
    change = -state.friction_before
    state.friction_before[:] = state.friction
    force = state.friction
    reduced = plan.coupling[:contacts, :contacts].copy()
    held, gain, offset, w = _hands_across(plan, laws, state, grips, drive, wanted, reduced)
    touching = state.eta[:contacts]
    if not solve_friction(reduced, wanted[:contacts], touching, plan.friction, plan.slip, force[:contacts]):
        return False
    force[contacts:] = 0.0
    for a in range(held.size):
        moved = w[a, 0]
        for k in range(contacts):
            moved += w[a, 1 + k] * force[k]
        force[held[a]] = -(gain[a] * moved + offset[a])
    _push(plan, q, d, force)
    change += force
    grips.lost[0] += _damped(plan, plan.v, d, d_before, change)
    for m in range(points):
        new = free[m] + dot(plan.coupling[m], force)
        moved = new - state.v_before[m]
        h = m - contacts
        if h < 0:
            grips.lost[1] -= plan.dx * force[m] * moved / 2
        elif laws.kind[m] == LINEAR:
            before, after = grips.sign[h] * grips.across_before[h], grips.sign[h] * drive[h]
            grips.put_in[h] += plan.dx * force[m] * (after - before) / 2
            law = laws.stiffness[m], laws.exponent[m], laws.loss[m]
            grips.taken[h] += plan.dx * taken(LINEAR, force[m], state.v_before[m] - before, new - after, *law) / 2
        state.v_before[m] = state.v[m]
        state.v[m] = new
    for h in range(hands):
        if laws.kind[contacts + h] == LINEAR:
            grips.across_before[h] = grips.across[h]
            grips.across[h] = drive[h]
    return True


@counted
def stored_energy(plan: Plan, laws: Laws, across: Laws, state: State, grips: Grips, energy: Floats) -> None:
    """Writes the energy at n - 1/2 of a state at step n, (2 + H,) J: of the string, the frets, and each hand."""
    hands = grips.kind.size
    contacts = plan.height.size - hands
    energy[0] = linear_energy(plan, plan.u, state.q, state.d, state.force, state.force_before)
    energy[0] += linear_energy(plan, plan.v, state.q_across, state.d_across, state.friction, state.friction_before)
    energy[1] = 0.0
    for m in range(plan.height.size):
        h = m - contacts
        held = stored(laws.kind[m], state.eta[m], laws.stiffness[m], laws.exponent[m])
        held += stored(laws.kind[m], state.eta_before[m], laws.stiffness[m], laws.exponent[m])
        if h < 0:
            energy[1] += plan.dx * held / 2
            continue
        stretch = state.v[m] - grips.sign[h] * grips.across[h]
        stretch_before = state.v_before[m] - grips.sign[h] * grips.across_before[h]
        held += stored(across.kind[m], stretch, across.stiffness[m], 1.0)
        held += stored(across.kind[m], stretch_before, across.stiffness[m], 1.0)
        speed = grips.move[h] / plan.dt
        energy[2 + h] = plan.dx * held / 2 + grips.mass[h] * speed * speed / 2


@counted
def _sample(pace: Pace, q: Floats, d: Floats, d_before: Floats, velocity: Floats) -> None:
    """Writes dq/dt at step n, (N,), of a string that has moved on to n + 1: the mean of before and after its forces."""
    for j in range(q.size):
        now = q[j] - d[j]
        velocity[j] = pace.by_q[j] * now + pace.by_next[j] * d[j] + pace.by_last[j] * d_before[j]


@counted
def run_held(
    plan: Plan,
    laws: Laws,
    across: Laws,
    state: State,
    grips: Grips,
    drive: Floats,
    drive_across: Floats,
    first: int,
    last: int,
    ears: Ears,
    sheets: Sheets,
    onset: Ints,
) -> int:
    """Steps from n to n + 1 for n = first ... last - 1, and writes the samples that are due.

    drive: (last - first, H): a finger's R (N s/m) at n, a stop's y (m) at n + 1, the force (N) on a mass at n;
    drive_across: the same for v. Returns as livebass.reference.solver.run does.
    """
    q, d, eta, eta_before = state.q, state.d, state.eta, state.eta_before
    force, force_before = state.force, state.force_before
    oblique = plan.across.size > 0
    points, hands = eta.size, grips.kind.size
    contacts = points - hands
    d_before, e_before = np.zeros(q.size), np.zeros(state.q_across.size)
    free, solved, energy = np.empty(points), np.empty(points), np.empty(2 + hands)
    y, move = np.zeros(hands), np.zeros(hands)
    velocity = np.empty(q.size)
    s = np.searchsorted(ears.states, -(-first // ears.every))
    found = 0
    for n in range(first, last):
        given, given_across = drive[n - first], drive_across[n - first]
        for h in range(hands):
            m = contacts + h
            if laws.kind[m] == ABSENT:
                y[h] = 0.0
            elif grips.kind[h] == FINGER:
                laws.loss[m] = given[h] / (2 * plan.dt * plan.dx)
                across.loss[m] = laws.loss[m]
            elif grips.kind[h] == STOP:
                y[h] = given[h]
            else:
                move[h] = grips.move[h] + plan.dt**2 / grips.mass[h] * given[h]
                y[h] = grips.y[h] + move[h]
        i = n // ears.every
        due = n % ears.every == 0 and i < sheets.force.shape[1]
        if due:
            for k in range(ears.place.shape[0]):
                sheets.displacement[k, 0, i] = dot(ears.place[k], q)
                if oblique:
                    sheets.displacement[k, 1, i] = dot(ears.place_across[k], state.q_across)
            for h in range(hands):
                there = laws.kind[contacts + h] != ABSENT and grips.kind[h] != FINGER
                sheets.height[h, i] = grips.y[h] if there else np.nan
        if oblique and not _step_across(plan, across, state, grips, given_across, e_before):
            return -(n + 1)
        _freely(plan.u, q, d, d_before)
        touch = False
        for m in range(points):
            height = plan.height[m] if m < contacts else grips.sign[m - contacts] * y[m - contacts]
            free[m] = height - dot(plan.shape[m], q)
            touch = touch or laws.kind[m] == LINEAR
            touch = touch or (laws.kind[m] != ABSENT and (free[m] > 0 or eta_before[m] > 0))
        change = -force_before
        force_before[:] = force
        force[:] = 0.0
        solved[:] = free
        if touch:
            if not solve_forces(plan.coupling, free, eta_before, laws, force, solved):
                return -(n + 1)
            _push(plan, q, d, force)
        change += force
        grips.lost[0] += _damped(plan, plan.u, d, d_before, change)
        for h in range(hands):
            m = contacts + h
            if laws.kind[m] == ABSENT:
                continue
            hand = grips.sign[h] * plan.dx * force[m]  # on the string, upwards
            if grips.kind[h] == MASS:
                move[h] -= plan.dt**2 / grips.mass[h] * hand
                y[h] = grips.y[h] + move[h]
                hand = given[h]
            else:
                move[h] = y[h] - grips.y[h]
            grips.put_in[h] += hand * (move[h] + grips.move[h]) / 2
            law = laws.stiffness[m], laws.exponent[m], laws.loss[m]
            grips.taken[h] += plan.dx * taken(laws.kind[m], force[m], eta_before[m], solved[m], *law) / 2
            grips.y[h], grips.move[h] = y[h], move[h]
        for m in range(points):
            if m < contacts:
                law = laws.stiffness[m], laws.exponent[m], laws.loss[m]
                grips.lost[2] += plan.dx * taken(laws.kind[m], force[m], eta_before[m], solved[m], *law) / 2
                if solved[m] > 0 and eta[m] <= 0:
                    onset[found, 0] = n + 1
                    onset[found, 1] = m
                    found += 1
            eta_before[m] = eta[m]
            eta[m] = solved[m]
        if due:
            wanted = s < ears.states.size and ears.states[s] == i
            _sample(ears.u, q, d, d_before, velocity)
            for k in range(ears.place.shape[0]):
                sheets.velocity[k, 0, i] = dot(ears.place[k], velocity)
            if wanted:
                sheets.states[s, 0, 0] = q - d
                sheets.states[s, 0, 1] = velocity
            if oblique:
                _sample(ears.v, state.q_across, state.d_across, e_before, velocity)
                for k in range(ears.place.shape[0]):
                    sheets.velocity[k, 1, i] = dot(ears.place_across[k], velocity)
                if wanted:
                    sheets.states[s, 1, 0] = state.q_across - state.d_across
                    sheets.states[s, 1, 1] = velocity
            s += 1 if wanted else 0
            stored_energy(plan, laws, across, state, grips, energy)
            sheets.stored[:, i] = energy
            sheets.lost[:, i] = grips.lost
            sheets.taken[:, i] = grips.taken
            sheets.put_in[:, i] = grips.put_in
            for h in range(hands):
                sheets.force[h, i] = grips.sign[h] * plan.dx * force[contacts + h]
        if n % FLUSH_EVERY == 0:
            flush(q, d)
            flush(state.q_across, state.d_across)
    return found
