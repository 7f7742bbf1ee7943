"""The fine steps of a brute-force string, with or without hands: every step of eq. 12, mode, contact point and hand.

solver.py has the equations of the string. A hand (hands.py) is one more contact point. Its row of Phi
is s_j = phi_j(x) exp(-(k_j a)^2 / 2), its "height" y moves, and eta = y - u below the string or u - y above it (sign 1
or -1). Forces are per m of string, as at the frets: a point force is f dx. With r = eta^{n+1} - eta^{n-1}, all forces
together solve eq. 6 of livebass.lab.reference.laws, r = r* - (W + R) f(r), where a hand's law is

    finger:  f = (R / dx) r / (2 dt), y = 0, in both polarisations;
    stop:    f = (K / dx) (eta^{n+1} + eta^{n-1}) / 2, or one-sided as in eq. 6 with alpha = 1; y = b^{n+1} is given;
    mass:    eq. 6 with K / dx, plus beta (K / dx) [(eta^{n+1} + eta^{n-1}) / 2]_+^alpha r / (2 dt), f not below 0; W
             gets dt^2 dx / m added on its diagonal, as the mass yields:
             y^{n+1} = 2 y^n - y^{n-1} + dt^2 (F + f^n dx) / m, F the force of the hand that holds it.

All are implicit, so none adds energy at any time step. In a step of eq. 12, with H from livebass.lab.reference.solver,

    H + sum over hands of dx [psi(eta^{n+1}) + psi(eta^n)] / 2 + m ((y^{n+1} - y^n) / dt)^2 / 2

loses the energy that damping, friction and frets (see there) and each hand take, for a finger R r^2 / (4 dt), for a
mass dx [f r - psi(eta^{n+1}) + psi(eta^{n-1})] / 2 >= 0, and gains the work of each hand, its force (stop: sign f dx,
mass: F) times (y^{n+1} - y^{n-1}) / 2. A hand that begins or ends brings or takes the energy of its spring, contact and
motion (livebass.lab.reference.playing).

The second polarisation feels fingers and, if they have a path in it, stops. Both are linear there: they are eliminated
before solving for friction.

Equation numbers: Issanchou et al. (2018).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from livebass.compiling.by_numba import compiled, counted
from livebass.lab.reference.laws import (
    ABSENT,
    LINEAR,
    Laws,
    eliminate,
    law_energy,
    lost_energy,
    solve_forces,
    solve_friction,
)
from livebass.lab.reference.plan import Modes, Plan, State
from livebass.rows.arrays import Floats, Ints
from livebass.rows.parts import EXCHANGES_AT_ONCE, MAX_OWED

FLUSH_EVERY = 64  # steps
FLUSH_BELOW = 1e-200  # of both q and d: far below the rounding of any sum over modes
FINGER, STOP, MASS = 0, 1, 2  # kinds of hand


class Grips(NamedTuple):
    """H hands, at the points P, P + 1 ... after the P contact points; `run` advances them in place."""

    kind: Ints  # (H,)
    sign: Floats  # (H,) 1: below the string, -1: above
    mass: Floats  # (H,) kg
    y: Floats  # (H,) y^n, m; 0 for a finger, and while the hand is absent
    move: Floats  # (H,) y^n - y^{n-1}, m, stored separately for the same reason as d
    across: Floats  # (H,) y^n of v, m
    across_before: Floats  # (H,)
    taken: Floats  # (H,) J so far
    put_in: Floats  # (H,) J so far
    lost: Floats  # (3,) J so far, to damping, to friction and to frets


class Held(NamedTuple):
    """A string with hands on it."""

    plan: Plan
    laws: Laws  # of u: contact points, then hands
    across: Laws  # of v, where only hands have any
    state: State
    grips: Grips


class Pace(NamedTuple):
    """Coefficients of N modal velocities, from q^n, d^{n+1} and d^n."""

    by_q: Floats  # (N,) 1/s
    by_next: Floats  # (N,) 1/s
    by_last: Floats  # (N,) 1/s


class Ears(NamedTuple):
    """Times and p places at which `run` listens, and the pace of the modes of u and v."""

    step: Ints  # (n,) a sample lies `offset` of a step ...
    offset: Floats  # (n,) ... after this one
    place: Floats  # (p, N) phi_j at the places of u
    place_across: Floats  # (p, N) and of v
    u: Pace
    v: Pace
    states: Ints  # (c,) samples
    every: int  # fine steps between accounts of energy; 0: no account


class Sheets(NamedTuple):
    """Arrays that `run` fills: n samples, p places, H hands, c states, e accounts; an axis of 2 counts polarisations.

    With e = 0 in `lost`, losses are not counted.
    """

    displacement: Floats  # (p, 2, n) m
    velocity: Floats  # (p, 2, n) m/s; (0, 2, n): not needed
    states: Floats  # (c, 2, 2, N)
    force: Floats  # (H, e) N on the string, upwards
    height: Floats  # (H, e) m
    total: Floats  # (e,) J stored
    stored: Floats  # (2 + H, e) J: string, frets, each hand
    lost: Floats  # (3, e) J: damping, friction, frets
    taken: Floats  # (H, e) J
    put_in: Floats  # (H, e) J
    onset: Ints  # (room, 2), new contacts: step, index


@counted
def no_hands() -> Grips:
    none = np.zeros(0)
    return Grips(np.zeros(0, dtype=np.int64), none, none, none, none, none, none, none, none, np.zeros(3))


@compiled(fastmath={"reassoc", "contract"})
def dot(a: Floats, b: Floats) -> float:
    """Dot product, summed in any order."""
    total = 0.0
    for j in range(a.size):
        total += a[j] * b[j]
    return total


@counted
def _freely(of: Modes, q: Floats, d: Floats, d_before: Floats) -> None:
    """Moves the modes of one polarisation a step without forces; keeps d^n."""
    for j in range(q.size):
        d_before[j] = d[j]
        d[j] = of.decay[j] * d[j] - of.pull[j] * q[j]
        q[j] += d[j]


@counted
def _push(plan: Plan, q: Floats, d: Floats, force: Floats) -> None:
    """Adds the motion by the forces (P + H,), N/m, to the step."""
    scale = plan.dt**2 / plan.density * plan.dx
    for m in range(force.size):
        if force[m] != 0:
            for j in range(q.size):
                push = scale * force[m] * plan.shape[m, j]
                d[j] += push
                q[j] += push


@counted
def _damping_loss(plan: Plan, of: Modes, d: Floats, d_before: Floats, change: Floats) -> float:
    """J that one polarisation loses per step to damping and static compliance; change: f^n - f^{n-2}, N/m."""
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
def _hands_across(string: Held, drive: Floats, wanted: Floats, reduced: Floats) -> tuple[Ints, Floats, Floats, Floats]:
    """Eliminates the hands on v. Writes friction's `wanted` (P + H,) and `reduced` (P, P) with the hands on the string.

    Returns the hands there, as points (L,), gain and offset (L,) of their f = -(gain w + offset), and their w
    (L, 1 + P): without friction, and for 1 N/m of it at each contact point.
    """
    plan, laws, state, grips = string.plan, string.across, string.state, string.grips
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
def _step_across(string: Held, drive: Floats, d_before: Floats, counts: bool) -> bool:
    """Moves v from step n to n + 1 with friction (eq. 7) and hands. Call it before eta moves.

    drive: y^{n+1}, (H,) m; counts: count losses. Returns False if the friction does not converge.
    """
    plan, laws, state, grips = string.plan, string.across, string.state, string.grips
    q, d, points, hands = state.q_across, state.d_across, plan.height.size, grips.kind.size
    contacts = points - hands
    _freely(plan.v, q, d, d_before)
    free, wanted = np.empty(points), np.empty(points)
    for m in range(points):
        free[m] = dot(plan.shape[m], q)
        wanted[m] = free[m] - state.v_before[m]
    earlier = state.friction_before.copy()
    state.friction_before[:] = state.friction
    force = state.friction
    reduced = plan.coupling[:contacts, :contacts].copy()
    held, gain, offset, w = _hands_across(string, drive, wanted, reduced)
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
    if counts:
        grips.lost[0] += _damping_loss(plan, plan.v, d, d_before, force - earlier)
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
            grips.taken[h] += plan.dx * lost_energy(LINEAR, force[m], state.v_before[m] - before, new - after, *law) / 2
        state.v_before[m] = state.v[m]
        state.v[m] = new
    for h in range(hands):
        if laws.kind[contacts + h] == LINEAR:
            grips.across_before[h] = grips.across[h]
            grips.across[h] = drive[h]
    return True


@counted
def linear_energy(plan: Plan, of: Modes, q: Floats, d: Floats, force: Floats, force_before: Floats) -> float:
    """Energy of one polarisation, with its modes `of`, without the contact potential, J."""
    total = 0.0
    for j in range(q.size):
        total += (1 + of.decay[j]) / 2 * d[j] * d[j] + of.pull[j] * q[j] * (q[j] - d[j])
    total *= plan.density / (2 * plan.dt**2)
    for m in range(plan.height.size):
        spring = force[m] * dot(plan.compliance[m], force)
        spring += force_before[m] * dot(plan.compliance[m], force_before)
        total += plan.dx * spring / 4
    return total


@counted
def stored_energy(string: Held, energy: Floats) -> float:
    """Writes the energy at n - 1/2 of a state at step n, (2 + H,) J: string, frets, each hand. Returns the sum."""
    plan, laws, across, state, grips = string
    hands = grips.kind.size
    contacts = plan.height.size - hands
    energy[0] = linear_energy(plan, plan.u, state.q, state.d, state.force, state.force_before)
    energy[0] += linear_energy(plan, plan.v, state.q_across, state.d_across, state.friction, state.friction_before)
    energy[1] = 0.0
    total = energy[0]
    for m in range(plan.height.size):
        h = m - contacts
        held = law_energy(laws.kind[m], state.eta[m], laws.stiffness[m], laws.exponent[m])
        held += law_energy(laws.kind[m], state.eta_before[m], laws.stiffness[m], laws.exponent[m])
        if h < 0:
            energy[1] += plan.dx * held / 2
            total += plan.dx * held / 2
            continue
        stretch = state.v[m] - grips.sign[h] * grips.across[h]
        stretch_before = state.v_before[m] - grips.sign[h] * grips.across_before[h]
        held += law_energy(across.kind[m], stretch, across.stiffness[m], 1.0)
        held += law_energy(across.kind[m], stretch_before, across.stiffness[m], 1.0)
        speed = grips.move[h] / plan.dt
        energy[2 + h] = plan.dx * held / 2 + grips.mass[h] * speed * speed / 2
        total += energy[2 + h]
    return total


@counted
def _amplitude(of: Modes, dt: float, j: int, q: float, d: float) -> complex:
    """W of mode `j` from (q^n, d^n): its square is the mode's energy without losses, in units of mu / (2 dt^2)."""
    momentum = of.decay[j] * d - (of.pull[j] - (1 - of.decay[j])) / 2 * q
    return complex(math.sqrt(of.decay[j]) * math.sin(of.omega[j] * dt) * q, -momentum)


@counted
def _put(of: Modes, dt: float, j: int, w: complex, q: Floats, d: Floats) -> None:
    """Sets (q^n, d^n) of mode `j` from W."""
    q[j] = w.real / (math.sqrt(of.decay[j]) * math.sin(of.omega[j] * dt))
    d[j] = (-w.imag + (of.pull[j] - (1 - of.decay[j])) / 2 * q[j]) / of.decay[j]


@counted
def _presses(string: Held) -> bool:
    """True if the string presses on a fret or on a mass."""
    contacts = string.state.eta.size - string.grips.kind.size
    for m in range(contacts):
        if string.state.eta[m] > 0 or string.state.eta_before[m] > 0:
            return True
    for h in range(string.grips.kind.size):
        if string.grips.kind[h] == MASS and string.laws.kind[contacts + h] != ABSENT:
            return True
    return False


@counted
def _exchange(string: Held, frame: int) -> bool:
    """Exchanges energy between u and v at the end of a frame, if it is time; returns whether it did: solver.py."""
    plan, state, turn = string.plan, string.state, string.plan.turn
    if frame % turn.every == 0:
        state.owed[0] = min(state.owed[0] + 1, MAX_OWED)
    if state.owed[0] == 0 or _presses(string):
        return False
    n, dt = turn.flow.shape[0], plan.dt
    u_before, u_step = state.q[:n].copy(), state.d[:n].copy()
    v_before, v_step = state.q_across[:n].copy(), state.d_across[:n].copy()
    times = min(state.owed[0], EXCHANGES_AT_ONCE)
    state.owed[0] -= times
    for _ in range(times):
        for j in range(n):
            u = _amplitude(plan.u, dt, j, state.q[j], state.d[j])
            v = _amplitude(plan.v, dt, j, state.q_across[j], state.d_across[j])
            flow = turn.flow[j]
            _put(plan.u, dt, j, flow[0, 0] * u + flow[0, 1] * v, state.q, state.d)
            _put(plan.v, dt, j, flow[1, 0] * u + flow[1, 1] * v, state.q_across, state.d_across)
    u_moved, v_moved = state.q[:n] - u_before, state.q_across[:n] - v_before
    for m in range(state.eta.size):
        shape = plan.shape[m, :n]
        state.eta[m] -= dot(shape, u_moved)
        state.eta_before[m] -= dot(shape, u_moved - (state.d[:n] - u_step))
        state.v[m] += dot(shape, v_moved)
        state.v_before[m] += dot(shape, v_moved - (state.d_across[:n] - v_step))
    return True


@counted
def _flush(q: Floats, d: Floats) -> None:
    """Zeroes modes too weak for any sum, in place: denormal numbers would cost a factor of 20."""
    for j in range(q.size):
        if abs(q[j]) < FLUSH_BELOW and abs(d[j]) < FLUSH_BELOW:
            q[j] = 0.0
            d[j] = 0.0


@counted
def _take_hold(string: Held, given: Floats, y: Floats, move: Floats) -> None:
    """Sets the laws of fingers, and writes y^{n+1} of all hands, without the force on a mass, and a mass's move."""
    plan, laws, across, _, grips = string
    contacts = plan.height.size - y.size
    for h in range(y.size):
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


@counted
def _move_hands(string: Held, given: Floats, y: Floats, move: Floats, eta_next: Floats) -> None:
    """Moves the hands to n + 1 after the forces, and counts their energy; eta_next: eta^{n+1}, (P + H,)."""
    plan, laws, _, state, grips = string
    contacts = plan.height.size - y.size
    for h in range(y.size):
        m = contacts + h
        if laws.kind[m] == ABSENT:
            continue
        hand = grips.sign[h] * plan.dx * state.force[m]  # on the string, upwards
        if grips.kind[h] == MASS:
            move[h] -= plan.dt**2 / grips.mass[h] * hand
            y[h] = grips.y[h] + move[h]
            hand = given[h]
        else:
            move[h] = y[h] - grips.y[h]
        grips.put_in[h] += hand * (move[h] + grips.move[h]) / 2
        law = laws.stiffness[m], laws.exponent[m], laws.loss[m]
        grips.taken[h] += (
            plan.dx * lost_energy(laws.kind[m], state.force[m], state.eta_before[m], eta_next[m], *law) / 2
        )
        grips.y[h], grips.move[h] = y[h], move[h]


@counted
def _between(plan: Plan, of: Modes, sensor: Floats, before: Floats, after: Floats, offset: float) -> float:
    """Displacement (m) at `sensor`, `offset` s after step n: the free motion through q^n = before, q^{n+1} = after."""
    total = 0.0
    for j in range(before.size):
        s, w = of.sigma[j], of.omega[j]
        late = before[j] * math.exp(-s * offset) * math.sin(w * (plan.dt - offset))
        early = after[j] * math.exp(s * (plan.dt - offset)) * math.sin(w * offset)
        total += sensor[j] * (late + early) / math.sin(w * plan.dt)
    return total


@counted
def _sample(pace: Pace, q: Floats, d: Floats, d_before: Floats, velocity: Floats) -> None:
    """Writes dq/dt at step n, (N,), of a string already at n + 1: the mean of before and after its forces."""
    for j in range(q.size):
        now = q[j] - d[j]
        velocity[j] = pace.by_q[j] * now + pace.by_next[j] * d[j] + pace.by_last[j] * d_before[j]


@counted
def _listen(string: Held, ears: Ears, i: int, before: tuple[Floats, Floats, Floats, Floats], sheets: Sheets) -> None:
    """Fills in sample `i`, between n and n + 1, of a string at n + 1; before: q^n and d^n of u, then of v."""
    plan, state = string.plan, string.state
    requested = np.searchsorted(ears.states, i)
    wanted = requested < ears.states.size and ears.states[requested] == i
    velocity = np.empty(state.q.size)
    for side in range(2 if plan.across.size > 0 else 1):
        of, place, pace = (plan.u, ears.place, ears.u) if side == 0 else (plan.v, ears.place_across, ears.v)
        q, d = (state.q, state.d) if side == 0 else (state.q_across, state.d_across)
        q_before, d_before = (before[0], before[1]) if side == 0 else (before[2], before[3])
        for k in range(place.shape[0]):
            if ears.offset[i] < 1e-9:
                sheets.displacement[k, side, i] = dot(place[k], q_before)
            else:
                u = _between(plan, of, place[k], q_before, q, ears.offset[i] * plan.dt)
                sheets.displacement[k, side, i] = u
        if sheets.velocity.shape[0] > 0 or wanted:
            _sample(pace, q, d, d_before, velocity)
            for k in range(sheets.velocity.shape[0]):
                sheets.velocity[k, side, i] = dot(place[k], velocity)
        if wanted:
            sheets.states[requested, side, 0] = q - d
            sheets.states[requested, side, 1] = velocity


@counted
def _account(string: Held, at: int, sheets: Sheets) -> None:
    """Records the energy stored and lost after step n, in account `at`."""
    grips = string.grips
    contacts = string.plan.height.size - grips.kind.size
    energy = np.empty(sheets.stored.shape[0])
    sheets.total[at] = stored_energy(string, energy)
    sheets.stored[:, at] = energy
    if sheets.lost.shape[1] > 0:
        sheets.lost[:, at] = grips.lost
    for h in range(grips.kind.size):
        sheets.taken[h, at], sheets.put_in[h, at] = grips.taken[h], grips.put_in[h]
        sheets.force[h, at] = grips.sign[h] * string.plan.dx * string.state.force[contacts + h]


@counted
def run(string: Held, drive: Floats, first: int, last: int, ears: Ears, sheets: Sheets) -> int:
    """Steps from n to n + 1 for n = first ... last - 1, and writes the due samples and accounts.

    drive: (2, last - first, H), for u and for v: a finger's R (N s/m) at n, a stop's y (m) at n + 1, the force (N) on a
    mass at n. Returns the number of new contacts in sheets.onset, or minus the number of the step whose implicit
    equation has no solution.
    """
    plan, laws, _, state, grips = string
    q, d, eta, eta_before = state.q, state.d, state.eta, state.eta_before
    force, force_before = state.force, state.force_before
    points, hands = eta.size, grips.kind.size
    contacts, counts = points - hands, sheets.lost.shape[1] > 0
    q_before, d_before = np.zeros(q.size), np.zeros(q.size)
    across_before, e_before = np.zeros(state.q_across.size), np.zeros(state.q_across.size)
    free, solved, earlier = np.empty(points), np.empty(points), np.empty(points)
    y, move = np.zeros(hands), np.zeros(hands)
    energy = np.empty(2 + hands)
    i = np.searchsorted(ears.step, first)
    frame = np.searchsorted(plan.turn.frames, first, side="right")
    found = 0
    for n in range(first, last):
        given = drive[0, n - first]
        at = n // ears.every if ears.every and n % ears.every == 0 else sheets.total.size
        due = i < ears.step.size and ears.step[i] == n
        if due:
            q_before[:] = q
            across_before[:] = state.q_across
        if at < sheets.total.size:
            for h in range(hands):
                there = laws.kind[contacts + h] != ABSENT and grips.kind[h] != FINGER
                sheets.height[h, at] = grips.y[h] if there else np.nan
        _take_hold(string, given, y, move)
        if plan.across.size > 0 and not _step_across(string, drive[1, n - first], e_before, counts):
            return -(n + 1)
        _freely(plan.u, q, d, d_before)
        touch = False
        for m in range(points):
            height = plan.height[m] if m < contacts else grips.sign[m - contacts] * y[m - contacts]
            free[m] = height - dot(plan.shape[m], q)
            touch = touch or laws.kind[m] == LINEAR
            touch = touch or (laws.kind[m] != ABSENT and (free[m] > 0 or eta_before[m] > 0))
        earlier[:] = force_before
        force_before[:] = force
        force[:] = 0.0
        solved[:] = free
        if touch:
            if not solve_forces(plan.coupling, free, eta_before, laws, force, solved):
                return -(n + 1)
            _push(plan, q, d, force)
        if counts:
            grips.lost[0] += _damping_loss(plan, plan.u, d, d_before, force - earlier)
        _move_hands(string, given, y, move, solved)
        for m in range(points):
            if m < contacts and counts:
                law = laws.stiffness[m], laws.exponent[m], laws.loss[m]
                grips.lost[2] += plan.dx * lost_energy(laws.kind[m], force[m], eta_before[m], solved[m], *law) / 2
            if m < contacts and solved[m] > 0 and eta[m] <= 0:
                sheets.onset[found, 0] = n + 1
                sheets.onset[found, 1] = m
                found += 1
            eta_before[m] = eta[m]
            eta[m] = solved[m]
        if frame < plan.turn.frames.size and plan.turn.frames[frame] == n + 1:
            frame += 1
            before = stored_energy(string, energy) if counts else 0.0
            if _exchange(string, frame):
                grips.lost[0] += before - stored_energy(string, energy) if counts else 0.0
                if due:  # a sample between two steps belongs to the motion after the exchange
                    q_before[:] = q - d
                    across_before[:] = state.q_across - state.d_across
        while due:
            _listen(string, ears, i, (q_before, d_before, across_before, e_before), sheets)
            i += 1
            due = i < ears.step.size and ears.step[i] == n
        if at < sheets.total.size:
            _account(string, at, sheets)
        if n % FLUSH_EVERY == 0:
            _flush(q, d)
            _flush(state.q_across, state.d_across)
    return found
