"""The steps of the brute-force solver: eq. 12 in the summed form of reference.py. Numba only.

No step, mode or point is skipped. Two liberties touch rounding alone: the dot products may be summed in any
order, which lets them run four numbers at a time, and modes under 1e-200 are set to zero, because arithmetic
on denormal numbers would cost a factor of 20.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from livebass.kernels import compiled, counted
from livebass.motion import Floats, Ints
from livebass.reference_contact import potential, solve_contact
from livebass.reference_friction import solve_friction

FLUSH_EVERY = 64  # steps
FLUSH_BELOW = 1e-200  # of both q and d: the sums over modes cannot feel it


class Plan(NamedTuple):
    """Constants of a run; N modes, P contact points."""

    dt: float  # s
    density: float  # mu, kg/m
    dx: float  # m
    decay: Floats  # (N,) Ct
    pull: Floats  # (N,) 1 - C + Ct
    sigma: Floats  # (N,) 1/s
    omega: Floats  # (N,) rad/s, damped
    shape: Floats  # (P, N) phi_j(x_m)
    sensor: Floats  # (N,) phi_j at the sensor
    height: Floats  # (P,) g, m
    coupling: Floats  # (P, P) W + R, m per N/m
    compliance: Floats  # (P, P) R
    stiffness: float  # K
    exponent: float  # alpha
    across: Floats  # (N,) phi_j at the sensor of v; empty: no second polarisation
    friction: float  # A, N/m
    slip: float  # 2 dt s, m


class State(NamedTuple):
    """What a run remembers at step n."""

    q: Floats  # (N,) q^n
    d: Floats  # (N,) q^n - q^{n-1}
    eta: Floats  # (P,) eta^n
    eta_before: Floats  # (P,) eta^{n-1}
    force: Floats  # (P,) f^{n-1}, N/m
    force_before: Floats  # (P,) f^{n-2}
    q_across: Floats  # (N,) of v, as q; empty without it
    d_across: Floats  # (N,)
    v: Floats  # (P,) v^n
    v_before: Floats  # (P,) v^{n-1}
    friction: Floats  # (P,) ff^{n-1}, N/m
    friction_before: Floats  # (P,) ff^{n-2}


@compiled(fastmath={"reassoc", "contract"})
def _dot(a: Floats, b: Floats) -> float:
    total = 0.0
    for j in range(a.size):
        total += a[j] * b[j]
    return total


@counted
def _between(plan: Plan, sensor: Floats, before: Floats, after: Floats, offset: float) -> float:
    """Displacement at `sensor` `offset` s after q^n = before: the free motion through q^n and q^{n+1} = after."""
    total = 0.0
    for j in range(before.size):
        s, w = plan.sigma[j], plan.omega[j]
        late = before[j] * math.exp(-s * offset) * math.sin(w * (plan.dt - offset))
        early = after[j] * math.exp(s * (plan.dt - offset)) * math.sin(w * offset)
        total += sensor[j] * (late + early) / math.sin(w * plan.dt)
    return total


@counted
def _linear_energy(plan: Plan, q: Floats, d: Floats, force: Floats, force_before: Floats) -> float:
    """What one polarisation stores without the potential of the contact."""
    total = 0.0
    for j in range(q.size):
        total += (1 + plan.decay[j]) / 2 * d[j] * d[j] + plan.pull[j] * q[j] * (q[j] - d[j])
    total *= plan.density / (2 * plan.dt**2)
    for m in range(plan.height.size):
        spring = force[m] * _dot(plan.compliance[m], force)
        spring += force_before[m] * _dot(plan.compliance[m], force_before)
        total += plan.dx * spring / 4
    return total


@counted
def _energy(plan: Plan, state: State) -> float:
    """H at n - 1/2 for a state at n, J."""
    total = _linear_energy(plan, state.q, state.d, state.force, state.force_before)
    total += _linear_energy(plan, state.q_across, state.d_across, state.friction, state.friction_before)
    for m in range(plan.height.size):
        stored = potential(state.eta[m], plan.stiffness, plan.exponent)
        stored += potential(state.eta_before[m], plan.stiffness, plan.exponent)
        total += plan.dx * stored / 2
    return total


@counted
def _slide(plan: Plan, state: State) -> bool:
    """v from n to n + 1, before eta does: eq. 7 with the points that touch at n."""
    q, d = state.q_across, state.d_across
    for j in range(q.size):
        d[j] = plan.decay[j] * d[j] - plan.pull[j] * q[j]
        q[j] += d[j]
    points = plan.height.size
    free = np.empty(points)
    for m in range(points):
        free[m] = _dot(plan.shape[m], q)
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
        state.v[m] = free[m] + _dot(plan.coupling[m], state.friction)
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
    """Steps n -> n + 1 for n = first ... last - 1; returns how many contacts (step, index) are in `onset`.

    Minus the step number where Newton fails. Fills `displacement`, `across` and `energy` where they are due.
    """
    q, d, eta, eta_before = state.q, state.d, state.eta, state.eta_before
    force, force_before = state.force, state.force_before
    oblique = plan.across.size > 0
    modes_count, points = q.size, eta.size
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
            d[j] = plan.decay[j] * d[j] - plan.pull[j] * q[j]
            q[j] += d[j]
        touch = False
        for m in range(points):
            free[m] = plan.height[m] - _dot(plan.shape[m], q)
            touch = touch or free[m] > 0 or eta_before[m] > 0
        force_before[:] = force
        force[:] = 0.0
        solved[:] = free
        if touch:
            if not solve_contact(
                plan.coupling, free, eta_before, plan.stiffness, plan.exponent, force, solved
            ):
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
                displacement[i] = _dot(plan.sensor, q_before)
                across[i] = _dot(plan.across, v_before)
            else:
                displacement[i] = _between(plan, plan.sensor, q_before, q, offset[i] * plan.dt)
                across[i] = _between(plan, plan.across, v_before, state.q_across, offset[i] * plan.dt)
            i += 1
            due = i < sample_step.size and sample_step[i] == n
        if energy_every and n % energy_every == 0:
            energy[n // energy_every] = _energy(plan, state)
        if n % FLUSH_EVERY == 0:
            for j in range(modes_count):
                if abs(q[j]) < FLUSH_BELOW and abs(d[j]) < FLUSH_BELOW:
                    q[j] = 0.0
                    d[j] = 0.0
            for j in range(state.q_across.size):
                if abs(state.q_across[j]) < FLUSH_BELOW and abs(state.d_across[j]) < FLUSH_BELOW:
                    state.q_across[j] = 0.0
                    state.d_across[j] = 0.0
    return found
