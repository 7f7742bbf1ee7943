"""The brute-force solver with hands on the string: every fine step of eq. 12, with every mode, contact point and hand.

A hand (livebass.reference.hands) is one more contact point. Its row of Phi is s_j = phi_j(x) exp(-(k_j a)^2 / 2), its
"height" y moves, and eta = y - u below the string or u - y above it (sign 1 or -1). Forces are per m of string as those
of the frets, so that a point force is f dx. With r = eta^{n+1} - eta^{n-1}, all forces at once solve eq. 6 of
livebass.reference.laws, r = r* - (W + R) f(r), where a hand's law is

    finger:  f = (R / dx) r / (2 dt), y = 0, in both polarisations;
    stop:    f = (K / dx) (eta^{n+1} + eta^{n-1}) / 2, or one-sided as in eq. 6 with alpha = 1; y = b^{n+1} is given;
    mass:    eq. 6 with K / dx, plus beta (K / dx) [(eta^{n+1} + eta^{n-1}) / 2]_+^alpha r / (2 dt), f not below 0; W
             has dt^2 dx / m more on its diagonal, as the mass gives way:
             y^{n+1} = 2 y^n - y^{n-1} + dt^2 (F + f^n dx) / m, F the force of the hand that holds it.

A string of N modes alone is too stiff where a hand lies: for 862 modes as if the hand were a spring of 2e6 N/m, through
which a tenth of the waves at 10 kHz would pass a stop. So hands feel the static compliance of all modes that do not
swing, far beyond those of the grid.

All are implicit, so none adds energy at any time step. For a step of eq. 12, with H that of livebass.reference.solver,

    H + sum over hands of dx [psi(eta^{n+1}) + psi(eta^n)] / 2 + m ((y^{n+1} - y^n) / dt)^2 / 2

changes by minus what damping and friction (both there) and each hand take, R r^2 / (4 dt) a finger and
dx [f r - psi(eta^{n+1}) + psi(eta^{n-1})] / 2 >= 0 a mass, plus what each hand puts in, the force it gives (sign f dx a
stop, F a mass) times (y^{n+1} - y^{n-1}) / 2. When a hand begins or ends, it brings or takes with it what its spring,
contact and motion hold. `Balance` keeps count.

The second polarisation feels fingers and, where they have a path in it, stops. Both are linear there: they are
eliminated, and friction is solved for what is left.

Equation numbers: Issanchou et al. (2018).
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from livebass.arrays import Floats, Ints
from livebass.compiling.by_numba import counted
from livebass.model import modes
from livebass.model.trial import Trial, initial_amplitudes, initial_amplitudes_across
from livebass.reference.hands import Finger, Hand, Mass, Stop
from livebass.reference.laws import (
    ABSENT,
    CONTACT,
    LINEAR,
    Laws,
    eliminate,
    solve_forces,
    solve_friction,
    stored,
    taken,
)
from livebass.reference.solver import (
    CHUNK,
    FLUSH_BELOW,
    FLUSH_EVERY,
    Plan,
    State,
    dot,
    linear_energy,
    make_plan,
    make_state,
)

FINGER, STOP, MASS = 0, 1, 2  # kinds of hand
YIELDING = 200_000  # modes of the string that a hand feels: those that do not swing follow its force at once


class Grips(NamedTuple):
    """H hands, at the points P, P + 1 ... after the P contact points; `_run` moves them on in place."""

    kind: Ints  # (H,)
    sign: Floats  # (H,) 1: below the string, -1: above
    mass: Floats  # (H,) kg
    y: Floats  # (H,) y^n, m; 0 of a finger, and while the hand is not there
    move: Floats  # (H,) y^n - y^{n-1}, m, kept apart for the reason that d of the modes is
    across: Floats  # (H,) y^n of v, m
    across_before: Floats  # (H,)
    taken: Floats  # (H,) J so far
    put_in: Floats  # (H,) J so far
    lost: Floats  # (2,) J so far, to damping and to friction


class Sheets(NamedTuple):
    """What `_run` writes of n samples, p places of listening, H hands and c states; second axes are polarisations."""

    displacement: Floats  # (p, 2, n) m
    velocity: Floats  # (p, 2, n) m/s
    force: Floats  # (H, n) N on the string, upwards
    height: Floats  # (H, n) m
    stored: Floats  # (2 + H, n) J: string, frets, hands
    lost: Floats  # (2, n) J: damping, friction
    taken: Floats  # (H, n) J
    put_in: Floats  # (H, n) J
    states: Floats  # (c, 2, 2, N)


class Ears(NamedTuple):
    """What `_run` listens to, and how it makes the velocity of a mode: by q^n, d^{n+1} and d^n."""

    every: int  # fine steps a sample
    place: Floats  # (p, N) phi_j at the places of u
    place_across: Floats  # (p, N) and of v
    by_q: Floats  # (N,) 1/s
    by_next: Floats  # (N,) 1/s
    by_last: Floats  # (N,) 1/s
    states: Ints  # (c,) samples


@dataclasses.dataclass(frozen=True)
class Balance:
    """The energy of a string with H hands at n times, J; all that is taken and put in is counted from the beginning."""

    time_s: Floats  # (n,), half a fine step after the samples
    string_j: Floats  # (n,), stored in both polarisations
    frets_j: Floats  # (n,), stored in contact with the frets
    hands_j: Floats  # (H, n), stored in the spring or contact of a hand, and in the motion of a mass
    damping_j: Floats  # (n,), taken by the string's own losses (and by the static compliance of modes left out)
    friction_j: Floats  # (n,), taken by friction on the frets
    taken_j: Floats  # (H, n), taken by a finger, or by the loss of a mass's contact
    put_in_j: Floats  # (H, n), work done by a hand, with what it brought when it came, less what it took when it left

    @property
    def stored_j(self) -> Floats:
        """All energy there is, (n,)."""
        return self.string_j + self.frets_j + self.hands_j.sum(0)

    @property
    def closing_j(self) -> Floats:
        """Stored + taken - put in, (n,): constant."""
        return self.stored_j + self.damping_j + self.friction_j + self.taken_j.sum(0) - self.put_in_j.sum(0)

    @property
    def error(self) -> float:
        """How far `closing_j` strays from its first value, relative to the greatest of what is stored and taken."""
        closing, most = self.closing_j, self.stored_j + self.damping_j + self.friction_j + self.taken_j.sum(0)
        return float(np.abs(closing - closing[0]).max() / most.max())


@dataclasses.dataclass(frozen=True)
class Played:
    """How a string with H hands moved: n samples at p places, and k contacts with frets sorted by step, then index."""

    time_s: Floats  # (n,)
    displacement_m: Floats  # (p, n), u
    velocity_m_s: Floats  # (p, n), du/dt
    across_m: Floats | None  # (p, n), v; None: the string never leaves its plane
    across_velocity_m_s: Floats | None  # (p, n)
    hand_force_n: Floats  # (H, n), N on the string, upwards
    hand_height_m: Floats  # (H, n), of the point that a stop follows, and of a mass; NaN while it is not there
    balance: Balance
    contact_step: Ints  # (k,), as in livebass.model.trial.Motion
    contact_index: Ints  # (k,)
    contact_rate_hz: float
    wall_s: float  # s of the solver, without compilation
    states: Floats | None = None  # (len(Trial.states), polarisations, 2, modes), as in livebass.model.trial.Motion


@counted
def _freely(plan: Plan, q: Floats, d: Floats, d_before: Floats) -> None:
    """Moves the modes of one polarisation a step without forces; keeps d^n."""
    for j in range(q.size):
        d_before[j] = d[j]
        d[j] = plan.decay[j] * d[j] - plan.pull[j] * q[j]
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
def _damped(plan: Plan, d: Floats, d_before: Floats, change: Floats) -> float:
    """J that one polarisation loses in a step to its damping and to static compliance; change: f^n - f^{n-2}, N/m."""
    total = 0.0
    for j in range(d.size):
        both = d[j] + d_before[j]  # q^{n+1} - q^{n-1}
        total += (1 - plan.decay[j]) * both * both
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
    _freely(plan, q, d, d_before)
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
    grips.lost[0] += _damped(plan, d, d_before, change)
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
def _stored(plan: Plan, laws: Laws, across: Laws, state: State, grips: Grips, energy: Floats) -> None:
    """Writes the energy at n - 1/2 of a state at step n, (2 + H,) J: of the string, the frets, and each hand."""
    hands = grips.kind.size
    contacts = plan.height.size - hands
    energy[0] = linear_energy(plan, state.q, state.d, state.force, state.force_before)
    energy[0] += linear_energy(plan, state.q_across, state.d_across, state.friction, state.friction_before)
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
def _sample(plan: Plan, ears: Ears, q: Floats, d: Floats, d_before: Floats, velocity: Floats) -> None:
    """Writes dq/dt at step n, (N,), of a string that has moved on to n + 1: the mean of before and after its forces."""
    for j in range(q.size):
        now = q[j] - d[j]
        velocity[j] = ears.by_q[j] * now + ears.by_next[j] * d[j] + ears.by_last[j] * d_before[j]


@counted
def _run(
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
        _freely(plan, q, d, d_before)
        touch = False
        for m in range(points):
            height = plan.height[m] if m < contacts else grips.sign[m - contacts] * y[m - contacts]
            free[m] = height - dot(plan.shape[m], q)
            touch = touch or laws.kind[m] == LINEAR
            touch = touch or (laws.kind[m] == CONTACT and (free[m] > 0 or eta_before[m] > 0))
        change = -force_before
        force_before[:] = force
        force[:] = 0.0
        solved[:] = free
        if touch:
            if not solve_forces(plan.coupling, free, eta_before, laws, force, solved):
                return -(n + 1)
            _push(plan, q, d, force)
        change += force
        grips.lost[0] += _damped(plan, d, d_before, change)
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
            if m < contacts and solved[m] > 0 and eta[m] <= 0:
                onset[found, 0] = n + 1
                onset[found, 1] = m
                found += 1
            eta_before[m] = eta[m]
            eta[m] = solved[m]
        if due:
            wanted = s < ears.states.size and ears.states[s] == i
            _sample(plan, ears, q, d, d_before, velocity)
            for k in range(ears.place.shape[0]):
                sheets.velocity[k, 0, i] = dot(ears.place[k], velocity)
            if wanted:
                sheets.states[s, 0, 0] = q - d
                sheets.states[s, 0, 1] = velocity
            if oblique:
                _sample(plan, ears, state.q_across, state.d_across, e_before, velocity)
                for k in range(ears.place.shape[0]):
                    sheets.velocity[k, 1, i] = dot(ears.place_across[k], velocity)
                if wanted:
                    sheets.states[s, 1, 0] = state.q_across - state.d_across
                    sheets.states[s, 1, 1] = velocity
            s += 1 if wanted else 0
            _stored(plan, laws, across, state, grips, energy)
            sheets.stored[:, i] = energy
            sheets.lost[:, i] = grips.lost
            sheets.taken[:, i] = grips.taken
            sheets.put_in[:, i] = grips.put_in
            for h in range(hands):
                sheets.force[h, i] = grips.sign[h] * plan.dx * force[contacts + h]
        if n % FLUSH_EVERY == 0:
            for j in range(q.size):
                if abs(q[j]) < FLUSH_BELOW and abs(d[j]) < FLUSH_BELOW:
                    q[j] = 0.0
                    d[j] = 0.0
            for j in range(state.q_across.size):
                if abs(state.q_across[j]) < FLUSH_BELOW and abs(state.d_across[j]) < FLUSH_BELOW:
                    state.q_across[j] = 0.0
                    state.d_across[j] = 0.0
    return found


def hand_shape(trial: Trial, hand: Hand, count: int) -> Floats:
    """s_j = phi_j(x) exp(-(k_j a)^2 / 2) of a hand of half-width a at x, modes 1 to `count`, (count,), m^-0.5."""
    k = np.arange(1, count + 1) * (math.pi / trial.speaking.length)
    shape = modes.shapes(trial.speaking, count, np.array([hand.place]))[0]
    return np.asarray(shape * np.exp(-((k * hand.width) ** 2) / 2))


def _plan(trial: Trial, hands: Sequence[Hand], sign: Floats) -> Plan:
    """The plan of `trial` with a point more for each hand, after the contact points."""
    plan, s, count = make_plan(trial), trial.speaking, trial.modes
    full = s.grid_points - 1
    rows = np.array([hand_shape(trial, hand, full) for hand in hands]).reshape(len(hands), full) * sign[:, None]
    places = modes.shapes(s, full, np.asarray(s.contact_position))
    omega = 2 * math.pi * modes.frequencies(s, full)
    every = np.vstack([places, rows])
    left_out = every[:, count:] / omega[count:]
    compliance = s.step / s.string.linear_density * left_out @ left_out.T
    coupling = plan.dt**2 / s.string.linear_density * s.step * (every[:, :count] @ every[:, :count].T) + compliance
    points = plan.height.size  # for these everything is as without hands
    compliance[:points, :points], coupling[:points, :points] = plan.compliance, plan.coupling
    finest = max(full, YIELDING)
    finer = np.array([hand_shape(trial, hand, finest)[full:] for hand in hands]).reshape(len(hands), finest - full)
    finer /= 2 * math.pi * modes.frequencies(s, finest)[full:]
    yields = s.step / s.string.linear_density * (finer @ finer.T) * np.outer(sign, sign)
    compliance[points:, points:] += yields
    coupling[points:, points:] += yields
    for h, hand in enumerate(hands):
        if isinstance(hand, Mass):
            coupling[points + h, points + h] += plan.dt**2 * plan.dx / hand.mass
    return plan._replace(
        shape=np.ascontiguousarray(np.vstack([plan.shape, rows[:, :count]])),
        height=np.concatenate([plan.height, np.zeros(len(hands))]),
        coupling=coupling,
        compliance=compliance,
    )


def _state(plan: Plan, points: int, amplitudes: Floats) -> State:
    """The state at step 0 by q and dq/dt, (polarisations, 2, N); only the last rows of `plan` are hands."""
    second = amplitudes[1] if plan.across.size else np.zeros((2, 0))
    frets = plan._replace(shape=plan.shape[:points], height=plan.height[:points])
    state = make_state(frets, amplitudes[0, 0], second[0], amplitudes[0, 1], second[1])
    row, zero = plan.shape[points:], np.zeros(plan.height.size - points)

    def joined(contacts: Floats, hands: Floats) -> Floats:
        return np.concatenate([contacts, hands])

    q, d, e, f = state.q, state.d, state.q_across, state.d_across
    v = (row @ e, row @ (e - f)) if plan.across.size else (zero, zero)
    return state._replace(
        eta=joined(state.eta, -row @ q),
        eta_before=joined(state.eta_before, -row @ (q - d)),
        force=joined(state.force, zero),
        force_before=joined(state.force_before, zero),
        v=joined(state.v, v[0]),
        v_before=joined(state.v_before, v[1]),
        friction=joined(state.friction, zero),
        friction_before=joined(state.friction_before, zero),
    )


class _Player:
    """A string and its hands while they are played: brings hands and takes them away between runs of fine steps."""

    def __init__(self, trial: Trial, hands: Sequence[Hand], begin: Floats | None) -> None:
        count, points = len(hands), len(trial.speaking.contact_position)
        sign = np.array([1.0 if isinstance(h, Stop) and h.side < 0 else -1.0 for h in hands])
        self.hands, self.points = hands, points
        self.plan = _plan(trial, hands, sign)
        if begin is None:
            begin = np.zeros((2, 2, trial.modes))
            begin[0, 0], begin[1, 0] = initial_amplitudes(trial), initial_amplitudes_across(trial)
        self.state = _state(self.plan, points, begin)
        room = points + count
        frets = np.arange(room) < points
        self.laws = Laws(
            np.where(frets, CONTACT, ABSENT), np.where(frets, self.plan.stiffness, 0.0),
            np.where(frets, self.plan.exponent, 1.0), np.zeros(room),
        )  # fmt: skip
        self.across = Laws(np.full(room, ABSENT), np.zeros(room), np.ones(room), np.zeros(room))
        kind = [FINGER if isinstance(h, Finger) else STOP if isinstance(h, Stop) else MASS for h in hands]
        mass = np.array([h.mass if isinstance(h, Mass) else 0.0 for h in hands])
        y, move, across, across_before, taken, put_in = np.zeros((6, count))
        kinds = np.array(kind, dtype=np.int64)
        self.grips = Grips(kinds, sign, mass, y, move, across, across_before, taken, put_in, np.zeros(2))
        rate = trial.contact_rate
        self.on = [round(h.start * rate) for h in hands]
        ends = [h.end + h.lifting if isinstance(h, Finger) else h.end for h in hands]
        self.off = [round(end * rate) if math.isfinite(end) else None for end in ends]
        self.begun = [(0.0, 0.0, 0.0, 0.0)] * count  # u and du/dt, v and dv/dt where a hand came

    def next_turn(self, step: int) -> int:
        """The first step after `step` at which a hand comes or leaves; far away if there is none."""
        return min((n for n in (*self.on, *self.off) if n is not None and n > step), default=2**62)

    def turn(self, step: int) -> None:
        """Takes away the hands that end at `step` and brings those that begin there, with the energy that they hold."""
        for h, hand in enumerate(self.hands):
            if step == self.off[h]:
                before = self._energy()
                self._leave(h)
                self.grips.put_in[h] += self._energy() - before
            if step == self.on[h]:
                before = self._energy()
                self._come(h, hand)
                self.grips.put_in[h] += self._energy() - before

    def _energy(self) -> float:
        """All that is stored half a step ago, J."""
        energy = np.empty(2 + len(self.hands))
        _stored(self.plan, self.laws, self.across, self.state, self.grips, energy)
        return float(energy.sum())

    def _leave(self, h: int) -> None:
        m, state, grips = self.points + h, self.state, self.grips
        self.laws.kind[m] = self.across.kind[m] = ABSENT
        state.eta[m] -= grips.sign[h] * grips.y[h]
        state.eta_before[m] -= grips.sign[h] * (grips.y[h] - grips.move[h])
        grips.y[h] = grips.move[h] = grips.across[h] = grips.across_before[h] = 0.0

    def _come(self, h: int, hand: Hand) -> None:
        m, dt, state, grips = self.points + h, self.plan.dt, self.state, self.grips
        sign = grips.sign[h]
        u, before = -sign * state.eta[m], -sign * state.eta_before[m]
        v, v_before = sign * state.v[m], sign * state.v_before[m]
        self.begun[h] = (u, (u - before) / dt, v, (v - v_before) / dt)
        oblique = self.plan.across.size > 0
        law, dx = self.laws, self.plan.dx
        law.loss[m], law.exponent[m] = 0.0, 1.0
        if isinstance(hand, Finger):
            law.kind[m], law.stiffness[m] = LINEAR, 0.0
            self.across.kind[m] = LINEAR if oblique else ABSENT
            return
        law.stiffness[m] = hand.stiffness / dx
        if isinstance(hand, Stop):
            law.kind[m] = LINEAR if hand.side == 0 else CONTACT
            y = float(hand.path(np.zeros(1), *self.begun[h][:2])[0])
            move = u - before  # its spring is neither strained nor relieved when it comes
            if hand.across is not None and oblique:
                self.across.kind[m], self.across.stiffness[m] = LINEAR, hand.stiffness / dx
                grips.across[h] = float(hand.across(np.zeros(1), *self.begun[h][2:])[0])
                grips.across_before[h] = grips.across[h] - (v - v_before)
        else:
            law.kind[m], law.exponent[m], law.loss[m] = CONTACT, hand.exponent, hand.loss / (2 * dt)
            y = u if hand.height is None else hand.height
            move = -hand.speed * dt
            if y < u:
                raise ValueError(f"height of a Mass: {y * 1e3:g} mm; allowed is from the string up, {u * 1e3:g} mm")
        grips.y[h], grips.move[h] = y, move
        state.eta[m] += sign * y
        state.eta_before[m] += sign * (y - move)

    def drive(self, first: int, last: int) -> tuple[Floats, Floats]:
        """What the hands are told for steps `first` to `last` - 1, for u and for v: see `_run`."""
        instants = np.arange(first, last, dtype=np.float64) * self.plan.dt
        told = np.zeros((2, last - first, len(self.hands)))
        for h, hand in enumerate(self.hands):
            if not self.on[h] <= first:
                continue
            since = instants - self.on[h] * self.plan.dt
            if isinstance(hand, Finger):
                told[0, :, h] = hand.resistances(instants)
            elif isinstance(hand, Stop):
                u, speed, v, v_speed = self.begun[h]
                told[0, :, h] = hand.path(since + self.plan.dt, u, speed)
                if hand.across is not None:
                    told[1, :, h] = hand.across(since + self.plan.dt, v, v_speed)
            elif hand.force is not None:
                told[0, :, h] = hand.force(since)
        return told[0], told[1]


def _ears(trial: Trial, plan: Plan, listen: Sequence[float] | None) -> Ears:
    """What is heard of `trial`. Raises ValueError for a place that is not on the string, or rates that do not fit."""
    s, every = trial.speaking, round(trial.contact_rate / trial.output_rate)
    if abs(every * trial.output_rate - trial.contact_rate) > 1e-9 * trial.contact_rate:
        rates = f"allowed are multiples of the output rate, {trial.output_rate:g} Hz"
        raise ValueError(f"contact rate {trial.contact_rate:g} Hz: {rates}")
    across = trial.sensor if trial.sensor_v is None else trial.sensor_v
    places = [trial.sensor] if listen is None else list(listen)
    over = [across] if listen is None else places
    for place in (*places, *over):
        if not 0 <= place <= s.length:
            raise ValueError(f"listening at {place * 1e3:g} mm: allowed are 0 to {s.length * 1e3:g} mm")
    turn, shrink = plan.omega * plan.dt, plan.sigma * plan.dt
    pace = plan.omega / (2 * np.sin(turn))
    return Ears(
        every=every,
        place=modes.shapes(s, trial.modes, np.array(places)),
        place_across=modes.shapes(s, trial.modes, np.array(over)),
        by_q=2 * pace * np.sinh(shrink) - plan.sigma,
        by_next=pace * np.exp(shrink),
        by_last=pace * np.exp(-shrink),
        states=np.array(trial.states, dtype=np.int64),
    )


def play(
    trial: Trial,
    hands: Sequence[Hand] = (),
    listen: Sequence[float] | None = None,
    frets: bool = True,
    begin: Floats | None = None,
) -> Played:
    """The motion of `trial` under `hands` by brute force, with the energy of all, each sample.

    listen: places, m from the stop; None: the sensors of `trial`. frets: False takes the obstacles away. begin: q and
    dq/dt at time 0, (polarisations, 2, modes), as `states` of `Motion` and `Played` has them; None: plucked, at rest.
    The second polarisation is there if the pluck of `trial` has an angle, whatever begins.

    Raises ValueError for a hand, place or rate that is not allowed, for a mass that would begin inside the string, and
    for a mode that is damped beyond critical; ArithmeticError if the equation of the forces does not converge.
    """
    s = trial.speaking
    if not frets:
        s = dataclasses.replace(s, contact_fret=(), contact_position=(), contact_height=())
        trial = dataclasses.replace(trial, speaking=s)
    for hand in hands:
        if not 0 < hand.place < s.length:
            kind, length = type(hand).__name__, s.length * 1e3
            raise ValueError(f"place of a {kind}: {hand.place * 1e3:g} mm; allowed is between 0 and {length:g} mm")
    polarisations = 2 if trial.pluck.angle else 1
    if begin is not None and begin.shape != (polarisations, 2, trial.modes):
        raise ValueError(f"begin: shape {begin.shape}; allowed is {(polarisations, 2, trial.modes)}")
    player = _Player(trial, hands, begin)
    ears, samples, count = _ears(trial, player.plan, listen), trial.samples, len(hands)
    heard, per_hand = (ears.place.shape[0], 2, samples), (count, samples)
    sheets = Sheets(
        np.zeros(heard), np.zeros(heard), np.zeros(per_hand), np.zeros(per_hand), np.zeros((2 + count, samples)),
        np.zeros((2, samples)), np.zeros(per_hand), np.zeros(per_hand),
        np.zeros((len(trial.states), 2, 2, trial.modes)),
    )  # fmt: skip
    onset = np.zeros((CHUNK * player.points // 2 + player.points, 2), dtype=np.int64)
    found: list[Ints] = []

    def run(first: int, last: int) -> None:
        arguments = player.plan, player.laws, player.across, player.state, player.grips
        number = _run(*arguments, *player.drive(first, last), first, last, ears, sheets, onset)
        if number < 0:
            raise ArithmeticError(f"the forces at step {-number} did not converge")
        found.append(onset[:number].copy())

    run(0, 0)  # compiles, so that wall_s does not count it
    start, first, end = time.perf_counter(), 0, trial.steps + 1
    while first < end:
        player.turn(first)
        last = min(first + CHUNK, player.next_turn(first), end)
        run(first, last)
        first = last
    contacts = np.concatenate(found)
    contacts = contacts[contacts[:, 0] <= trial.steps]
    instants = np.arange(samples) / trial.output_rate
    return Played(
        time_s=instants,
        displacement_m=sheets.displacement[:, 0],
        velocity_m_s=sheets.velocity[:, 0],
        across_m=sheets.displacement[:, 1] if polarisations == 2 else None,
        across_velocity_m_s=sheets.velocity[:, 1] if polarisations == 2 else None,
        hand_force_n=sheets.force,
        hand_height_m=sheets.height,
        balance=Balance(
            instants + player.plan.dt / 2, sheets.stored[0], sheets.stored[1], sheets.stored[2:],
            sheets.lost[0], sheets.lost[1], sheets.taken, sheets.put_in,
        ),
        contact_step=contacts[:, 0].copy(),
        contact_index=contacts[:, 1].copy(),
        contact_rate_hz=trial.contact_rate,
        wall_s=time.perf_counter() - start,
        states=sheets.states[:, :polarisations] if trial.states else None,
    )  # fmt: skip
