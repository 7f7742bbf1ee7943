"""The steps of the brute-force solver: eq. 12 in the summed form of reference.py. Numba only.

No step, mode or point is skipped. Two liberties touch rounding alone: the dot products may be summed in any
order, which lets them run four numbers at a time, and modes under 1e-200 are set to zero, because arithmetic
on denormal numbers would cost a factor of 20.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from livebass.kernels import compiled, jit
from livebass.motion import Floats, Ints
from livebass.reference_contact import potential, solve_contact

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


class State(NamedTuple):
    """What a run remembers at step n."""

    q: Floats  # (N,) q^n
    d: Floats  # (N,) q^n - q^{n-1}
    eta: Floats  # (P,) eta^n
    eta_before: Floats  # (P,) eta^{n-1}
    force: Floats  # (P,) f^{n-1}, N/m
    force_before: Floats  # (P,) f^{n-2}


@compiled(fastmath={"reassoc", "contract"})
def _dot(a: Floats, b: Floats) -> float:
    total = 0.0
    for j in range(a.size):
        total += a[j] * b[j]
    return total


@jit
def _between(plan: Plan, before: Floats, after: Floats, offset: float) -> float:
    """Sensor displacement `offset` s after q^n = before: the free motion through q^n and q^{n+1} = after."""
    total = 0.0
    for j in range(before.size):
        s, w = plan.sigma[j], plan.omega[j]
        late = before[j] * math.exp(-s * offset) * math.sin(w * (plan.dt - offset))
        early = after[j] * math.exp(s * (plan.dt - offset)) * math.sin(w * offset)
        total += plan.sensor[j] * (late + early) / math.sin(w * plan.dt)
    return total


@jit
def _energy(plan: Plan, state: State) -> float:
    """H at n - 1/2 for a state at n, J."""
    total = 0.0
    for j in range(state.q.size):
        q, d = state.q[j], state.d[j]
        total += (1 + plan.decay[j]) / 2 * d * d + plan.pull[j] * q * (q - d)
    total *= plan.density / (2 * plan.dt**2)
    for m in range(plan.height.size):
        stored = potential(state.eta[m], plan.stiffness, plan.exponent)
        stored += potential(state.eta_before[m], plan.stiffness, plan.exponent)
        spring = state.force[m] * _dot(plan.compliance[m], state.force)
        spring += state.force_before[m] * _dot(plan.compliance[m], state.force_before)
        total += plan.dx * (stored / 2 + spring / 4)
    return total


@jit
def run(
    plan: Plan,
    state: State,
    first: int,
    last: int,
    sample_step: Ints,
    offset: Floats,
    displacement: Floats,
    energy_every: int,
    energy: Floats,
    onset: Ints,
) -> int:
    """Steps n -> n + 1 for n = first ... last - 1; returns how many contacts (step, index) are in `onset`.

    Minus the step number where Newton fails. Fills `displacement` and `energy` where they are due.
    """
    q, d, eta, eta_before, force, force_before = state
    modes_count, points = q.size, eta.size
    q_before, free, solved = np.empty(modes_count), np.empty(points), np.empty(points)
    i = np.searchsorted(sample_step, first)
    found = 0
    for n in range(first, last):
        due = i < sample_step.size and sample_step[i] == n
        if due:
            q_before[:] = q
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
            else:
                displacement[i] = _between(plan, q_before, q, offset[i] * plan.dt)
            i += 1
            due = i < sample_step.size and sample_step[i] == n
        if energy_every and n % energy_every == 0:
            energy[n // energy_every] = _energy(plan, state)
        if n % FLUSH_EVERY == 0:
            for j in range(modes_count):
                if abs(q[j]) < FLUSH_BELOW and abs(d[j]) < FLUSH_BELOW:
                    q[j] = 0.0
                    d[j] = 0.0
    return found
