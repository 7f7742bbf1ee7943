"""The brute-force solver: every fine step of eq. 12, with every mode and every contact point, from the equations.

It shares nothing with the engine but the description of the string and the modal laws, so that agreement of the two
means something. Equation numbers: Issanchou et al. (2018).

Eq. 12 for one mode is q^{n+1} = C q^n - Ct q^{n-1} + F with, for theta = omega_d dt,

    C = 2 exp(-sigma dt) cos(theta),   Ct = exp(-2 sigma dt),   F = (dt^2/mu) dx sum_m phi(x_m) f_m^n.

Computed like that, C near 2 hides the frequency behind a rounding error of 1e-16 / theta^2 (2e-8 for mode 1 at 8 MHz).
With d^n = q^n - q^{n-1} the same recursion reads

    d^{n+1} = Ct d^n - (1 - C + Ct) q^n + F,   q^{n+1} = q^n + d^{n+1},

and 1 - C + Ct = (1 - exp(-sigma dt))^2 + 4 exp(-sigma dt) sin^2(theta / 2) is a sum of squares, in which nothing
cancels.

Contact (eq. 6), with eta = g - u, psi = K/(alpha+1) [eta]_+^(alpha+1), r = eta^{n+1} - eta^{n-1}:

    f^n = (psi(eta^{n+1}) - psi(eta^{n-1})) / r,   r = r* - (W + R) f^n,   W = (dt^2/mu) dx Phi Phi^T.

Here r* is r without force, and R the static compliance of the modes left out (zero for a full set), which follow the
force at once: u^{n+1} = Phi^T q^{n+1} + R f^n. Frets that lose, after Hunt and Crossley, multiply this f by
max(0, 1 + c r / (2 dt)).

The second polarisation v is the same string without obstacle, or one with C and Ct of its own. Where u^n < g it feels
the friction of eq. 7, ff = -A sat((v^{n+1} - v^{n-1}) / (2 dt s)); u does not feel v.

Energy at n + 1/2, from eq. 12 times (q^{n+1} - q^{n-1}) / 2:

    H = mu/(2 dt^2) sum_j [(1 + Ct)/2 d^2 + (1 - C + Ct) q^{n+1} q^n]
        + dx sum_m [psi(eta^{n+1}) + psi(eta^n)]/2 + dx/4 [f^n R f^n + f^{n-1} R f^{n-1}].

A step changes H by

    -(mu/dt^2) sum_j (1 - Ct)/4 (q^{n+1} - q^{n-1})^2 - dx/4 (f^n - f^{n-2}) R (f^n - f^{n-2}),

so H is constant without losses for a full set of modes, and otherwise never rises. Frets that lose take
dx/2 (f r - psi(eta^{n+1}) + psi(eta^{n-1})) >= 0 each more. Without losses its first line is
mu/(2 dt^2) sum [q1^2 - 2 cos(theta) q1 q0 + q0^2]. For v the first line and the term with R of its own forces are
added, and friction changes H by dx sum_m ff (v^{n+1} - v^{n-1}) / 2 <= 0 more a step.

No step, mode or point is skipped. Two liberties touch rounding alone: dot products may be summed in any order, so that
they run four numbers at a time, and modes below 1e-200 are set to zero, as arithmetic on denormal numbers would cost a
factor of 20.
"""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebass.arrays import Floats, Ints
from livebass.compiling.by_numba import compiled, counted
from livebass.model import modes
from livebass.model.trial import Motion, Trial, initial_amplitudes, initial_amplitudes_across
from livebass.reference.laws import contacts, potential, solve_forces, solve_friction

CHUNK = 16384  # steps between two returns to Python, which then notices Ctrl-C
FLUSH_EVERY = 64  # steps
FLUSH_BELOW = 1e-200  # of both q and d: far below the rounding of any sum over modes


class Modes(NamedTuple):
    """Coefficients of the N modes of one polarisation."""

    decay: Floats  # (N,) Ct
    pull: Floats  # (N,) 1 - C + Ct
    sigma: Floats  # (N,) 1/s
    omega: Floats  # (N,) rad/s, damped


class Plan(NamedTuple):
    """Constants of a run with N modes and P contact points; symbols as in the head of this file."""

    dt: float  # s
    density: float  # mu, kg/m
    dx: float  # m
    u: Modes  # of both polarisations; the same, unless v has a law of its own
    v: Modes
    shape: Floats  # (P, N) Phi: phi_j(x_m), m^-0.5
    sensor: Floats  # (N,) phi_j at the sensor of u, m^-0.5
    height: Floats  # (P,) g, m
    coupling: Floats  # (P, P) W + R, m per N/m
    compliance: Floats  # (P, P) R, m per N/m
    stiffness: float  # K, SI
    exponent: float  # alpha
    loss: float  # c / (2 dt), 1/m
    across: Floats  # (N,) phi_j at the sensor of v, m^-0.5; (0,) without a second polarisation
    friction: float  # A, N/m
    slip: float  # 2 dt s, m


class State(NamedTuple):
    """The state of a run at step n; `run` moves it on in place."""

    q: Floats  # (N,) q^n, m^1.5
    d: Floats  # (N,) q^n - q^{n-1}, m^1.5
    eta: Floats  # (P,) eta^n, m
    eta_before: Floats  # (P,) eta^{n-1}, m
    force: Floats  # (P,) f^{n-1}, N/m
    force_before: Floats  # (P,) f^{n-2}, N/m
    q_across: Floats  # (N,) q^n of v; (0,) without a second polarisation
    d_across: Floats  # (N,) d^n of v, likewise
    v: Floats  # (P,) v^n, m
    v_before: Floats  # (P,) v^{n-1}, m
    friction: Floats  # (P,) ff^{n-1}, N/m
    friction_before: Floats  # (P,) ff^{n-2}, N/m


def static_compliance(trial: Trial) -> Floats:
    """R (P, P), m per N/m: (dx/mu) sum over the modes left out of phi_j(x_m) phi_j(x_k) / omega_j^2."""
    s = trial.speaking
    shape = modes.shapes(s, s.grid_points - 1, np.asarray(s.contact_position))[:, trial.modes :]
    omega = 2 * math.pi * modes.frequencies(s, s.grid_points - 1)[trial.modes :]
    return np.asarray(s.step / s.string.linear_density * (shape / omega**2) @ shape.T)


def make_modes(trial: Trial, across: bool) -> Modes:
    """The modes of u, or of v. Raises ValueError for one that is damped beyond critical."""
    s, count, dt = trial.speaking, trial.modes, 1 / trial.contact_rate
    sigma = np.zeros(count) if trial.lossless else modes.dampings(s, count, across=across)
    natural = 2 * math.pi * modes.frequencies(s, count, across=across)
    if np.any(sigma >= natural):
        raise ValueError(f"mode {int(np.argmax(sigma >= natural)) + 1} does not swing: damping above 2 pi frequency")
    omega = np.sqrt((natural - sigma) * (natural + sigma))
    pull = np.expm1(-sigma * dt) ** 2 + 4 * np.exp(-sigma * dt) * np.sin(omega * dt / 2) ** 2
    return Modes(np.exp(-2 * sigma * dt), pull, sigma, omega)


def make_plan(trial: Trial) -> Plan:
    """Coefficients of eq. 12 for `trial`. Raises ValueError for a mode that is damped beyond critical."""
    s, count, dt = trial.speaking, trial.modes, 1 / trial.contact_rate
    shape = modes.shapes(s, count, np.asarray(s.contact_position))
    compliance = static_compliance(trial)
    place = trial.sensor if trial.sensor_v is None else trial.sensor_v
    return Plan(
        dt=dt,
        density=s.string.linear_density,
        dx=s.step,
        u=make_modes(trial, across=False),
        v=make_modes(trial, across=True),
        shape=np.ascontiguousarray(shape),
        sensor=modes.shapes(s, count, np.array([trial.sensor]))[0],
        height=np.asarray(s.contact_height, dtype=np.float64),
        coupling=dt**2 / s.string.linear_density * s.step * (shape @ shape.T) + compliance,
        compliance=compliance,
        stiffness=float(s.contact_stiffness),
        exponent=float(s.contact_exponent),
        loss=s.contact_loss / (2 * dt),
        across=modes.shapes(s, count, np.array([place]))[0] if trial.pluck.angle else np.zeros(0),
        friction=s.friction,
        slip=2 * dt * s.friction_speed,
    )


def _step_before(plan: Plan, of: Modes, q: Floats, pace: Floats | None) -> Floats:
    """d^0, (N,), of the modes `of` a polarisation with the amplitudes `q`; see `make_state`."""
    s, theta = of.sigma * plan.dt, of.omega * plan.dt
    d = q * (-np.expm1(s) + np.exp(s) * (2 * np.sin(theta / 2) ** 2 + of.sigma / of.omega * np.sin(theta)))
    return d if pace is None else d + pace * (np.exp(s) * np.sin(theta) / of.omega)


def make_state(
    plan: Plan, q: Floats, across: Floats, pace: Floats | None = None, pace_across: Floats | None = None
) -> State:
    """State at step 0 of a string with the amplitudes `q` of u and `across` of v, each (N,), m^1.5.

    pace and pace_across: dq/dt of u and v, (N,), m^1.5/s; None: released at rest. The free damped motion through q(0)
    and dq/dt(0), followed back to -dt, gives d^0.
    """
    d, points = _step_before(plan, plan.u, q, pace), plan.height.size
    if not plan.across.size:
        second = [np.zeros(0)] * 2 + [np.zeros(points) for _ in range(4)]
    else:
        e = _step_before(plan, plan.v, across, pace_across)
        v = plan.shape @ across, plan.shape @ (across - e)
        second = [across.copy(), e, *v, np.zeros(points), np.zeros(points)]
    heights = plan.height - plan.shape @ q, plan.height - plan.shape @ (q - d)
    return State(q.copy(), d, *heights, np.zeros(points), np.zeros(points), *second)


@compiled(fastmath={"reassoc", "contract"})
def dot(a: Floats, b: Floats) -> float:
    """Dot product, summed in any order."""
    total = 0.0
    for j in range(a.size):
        total += a[j] * b[j]
    return total


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
def linear_energy(plan: Plan, of: Modes, q: Floats, d: Floats, force: Floats, force_before: Floats) -> float:
    """Energy of one polarisation, with the modes `of`, without the potential of the contact, J."""
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
def _energy(plan: Plan, state: State) -> float:
    """H at n - 1/2 of a state at step n, J."""
    total = linear_energy(plan, plan.u, state.q, state.d, state.force, state.force_before)
    total += linear_energy(plan, plan.v, state.q_across, state.d_across, state.friction, state.friction_before)
    for m in range(plan.height.size):
        stored = potential(state.eta[m], plan.stiffness, plan.exponent)
        stored += potential(state.eta_before[m], plan.stiffness, plan.exponent)
        total += plan.dx * stored / 2
    return total


@counted
def flush(q: Floats, d: Floats) -> None:
    """Sets modes to zero that are too weak for any sum, in place: denormal numbers would cost a factor of 20."""
    for j in range(q.size):
        if abs(q[j]) < FLUSH_BELOW and abs(d[j]) < FLUSH_BELOW:
            q[j] = 0.0
            d[j] = 0.0


@counted
def _slide(plan: Plan, state: State) -> bool:
    """Moves v from step n to n + 1, with friction (eq. 7) at the points that touch at n. Call it before eta moves.

    Returns False if the friction does not converge.
    """
    q, d, of = state.q_across, state.d_across, plan.v
    for j in range(q.size):
        d[j] = of.decay[j] * d[j] - of.pull[j] * q[j]
        q[j] += d[j]
    points = plan.height.size
    free = np.empty(points)
    for m in range(points):
        free[m] = dot(plan.shape[m], q)
    state.friction_before[:] = state.friction
    if not solve_friction(plan.coupling, free - state.v_before, state.eta, plan.friction, plan.slip, state.friction):
        return False
    scale = plan.dt**2 / plan.density * plan.dx
    for m in range(points):
        if state.friction[m] != 0:
            for j in range(q.size):
                push = scale * state.friction[m] * plan.shape[m, j]
                d[j] += push
                q[j] += push
    for m in range(points):
        state.v_before[m] = state.v[m]
        state.v[m] = free[m] + dot(plan.coupling[m], state.friction)
    return True


@counted
def run(
    plan: Plan,
    state: State,
    first: int,
    last: int,
    sample_step: Ints,
    offset: Floats,
    displacement: Floats,
    across: Floats,
    energy_every: int,
    energy: Floats,
    onset: Ints,
) -> int:
    """Steps from n to n + 1 for n = first ... last - 1; fills `displacement`, `across` and `energy` as they are due.

    Output sample i lies offset[i] of a step after step sample_step[i]. Returns the number of new contacts (step, index)
    in `onset`, (room, 2); or minus the number of the step at which an implicit equation could not be solved.
    """
    q, d, eta, eta_before = state.q, state.d, state.eta, state.eta_before
    force, force_before = state.force, state.force_before
    oblique = plan.across.size > 0
    modes_count, points = q.size, eta.size
    laws = contacts(points, plan.stiffness, plan.exponent, plan.loss)
    q_before, free, solved = np.empty(modes_count), np.empty(points), np.empty(points)
    v_before = np.empty(state.q_across.size)
    i = np.searchsorted(sample_step, first)
    found = 0
    for n in range(first, last):
        due = i < sample_step.size and sample_step[i] == n
        if due:
            q_before[:] = q
            v_before[:] = state.q_across
        if oblique and not _slide(plan, state):
            return -(n + 1)
        for j in range(modes_count):
            d[j] = plan.u.decay[j] * d[j] - plan.u.pull[j] * q[j]
            q[j] += d[j]
        touch = False
        for m in range(points):
            free[m] = plan.height[m] - dot(plan.shape[m], q)
            touch = touch or free[m] > 0 or eta_before[m] > 0
        force_before[:] = force
        force[:] = 0.0
        solved[:] = free
        if touch:
            if not solve_forces(plan.coupling, free, eta_before, laws, force, solved):
                return -(n + 1)
            scale = plan.dt**2 / plan.density * plan.dx
            for m in range(points):
                if force[m] > 0:
                    for j in range(modes_count):
                        push = scale * force[m] * plan.shape[m, j]
                        d[j] += push
                        q[j] += push
        for m in range(points):
            if solved[m] > 0 and eta[m] <= 0:
                onset[found, 0] = n + 1
                onset[found, 1] = m
                found += 1
            eta_before[m] = eta[m]
            eta[m] = solved[m]
        while due:
            if offset[i] < 1e-9:
                displacement[i] = dot(plan.sensor, q_before)
                across[i] = dot(plan.across, v_before)
            else:
                displacement[i] = _between(plan, plan.u, plan.sensor, q_before, q, offset[i] * plan.dt)
                across[i] = _between(plan, plan.v, plan.across, v_before, state.q_across, offset[i] * plan.dt)
            i += 1
            due = i < sample_step.size and sample_step[i] == n
        if energy_every and n % energy_every == 0:
            energy[n // energy_every] = _energy(plan, state)
        if n % FLUSH_EVERY == 0:
            flush(q, d)
            flush(state.q_across, state.d_across)
    return found


def solve(trial: Trial, energy_every: int = 0) -> Motion:
    """The motion of `trial` by brute force, with the energy at every `energy_every`-th half step, or none if 0.

    Raises ValueError for a mode that is damped beyond critical, and ArithmeticError if the equation of a contact does
    not converge.
    """
    plan = make_plan(trial)
    u, v = initial_amplitudes(trial), initial_amplitudes_across(trial)
    state = make_state(plan, u, v, trial.follow * u, trial.follow * v)
    place = np.arange(trial.samples) * trial.contact_rate / trial.output_rate  # in fine steps
    sample_step = np.floor(place + 1e-9).astype(np.int64)
    offset = np.maximum(place - sample_step, 0.0)
    displacement, across = np.zeros(trial.samples), np.zeros(trial.samples)
    last = trial.steps + 1  # one more than contacts are listed for: a sample may lie just after step trial.steps
    energy = np.zeros((last - 1) // energy_every + 1 if energy_every else 0)
    room = CHUNK * plan.height.size // 2 + plan.height.size
    onset = np.zeros((room, 2), dtype=np.int64)
    found: list[NDArray[np.int64]] = []
    arguments = (sample_step, offset, displacement, across, energy_every, energy, onset)
    run(plan, state, 0, 0, *arguments)  # compiles, so that wall_s does not count it
    start = time.perf_counter()
    for first in range(0, last, CHUNK):
        count = run(plan, state, first, min(first + CHUNK, last), *arguments)
        if count < 0:
            raise ArithmeticError(f"contact at step {-count} did not converge")
        found.append(onset[:count].copy())
    contacts = np.concatenate(found)
    contacts = contacts[contacts[:, 0] <= trial.steps]
    moments: Floats = (np.arange(energy.size, dtype=np.float64) * energy_every + 0.5) * plan.dt
    return Motion(
        time_s=np.arange(trial.samples) / trial.output_rate,
        displacement_m=displacement,
        contact_step=contacts[:, 0].copy(),
        contact_index=contacts[:, 1].copy(),
        contact_rate_hz=trial.contact_rate,
        wall_s=time.perf_counter() - start,
        energy_j=energy if energy_every else None,
        energy_time_s=moments if energy_every else None,
        across_m=across if plan.across.size else None,
    )
