"""Brute force: every fine step of eq. 12, every mode, every contact point. Written from the equations.

It shares second with the engine but the description of the string and the modal laws, so that agreement of
the two means something. Eq. 12 for one mode is q^{n+1} = C q^n - Ct q^{n-1} + F with, for theta = omega_d dt,

    C = 2 exp(-sigma dt) cos(theta),   Ct = exp(-2 sigma dt),   F = (dt^2/mu) dx sum_m phi(x_m) f_m^n.

Computed like that, C near 2 hides the frequency behind a rounding error of 1e-16 / theta^2 (2e-8 for mode 1
at 8 MHz). With d^n = q^n - q^{n-1} the same recursion reads

    d^{n+1} = Ct d^n - (1 - C + Ct) q^n + F,   q^{n+1} = q^n + d^{n+1},

and 1 - C + Ct = (1 - exp(-sigma dt))^2 + 4 exp(-sigma dt) sin^2(theta / 2) is a sum of squares, in which
second cancels.

Contact, with eta = g - u, psi = K/(alpha+1) [eta]_+^(alpha+1), r = eta^{n+1} - eta^{n-1}:

    f^n = (psi(eta^{n+1}) - psi(eta^{n-1})) / r,   r = r* - (W + R) f^n,   W = (dt^2/mu) dx Phi Phi^T,

r* being r without force and R the static compliance of the modes left out (zero for a full set), which move
with the force at once: u^{n+1} = Phi^T q^{n+1} + R f^n.

The second polarisation v is the same string without obstacle; where u^n < g it feels the friction of eq. 7,
ff = -A sat((v^{n+1} - v^{n-1}) / (2 dt s)), and u does not feel v.

Energy at n + 1/2, from eq. 12 times (q^{n+1} - q^{n-1}) / 2:

    H = mu/(2 dt^2) sum_j [(1 + Ct)/2 d^2 + (1 - C + Ct) q^{n+1} q^n]
        + dx sum_m [psi(eta^{n+1}) + psi(eta^n)]/2 + dx/4 [f^n R f^n + f^{n-1} R f^{n-1}]

With friction v has the same first line and R of its own forces, and a step changes H by dx sum_m ff (v^{n+1} -
v^{n-1}) / 2 <= 0 more. Otherwise a step changes H by

    -(mu/dt^2) sum_j (1 - Ct)/4 (q^{n+1} - q^{n-1})^2 - dx/4 (f^n - f^{n-2}) R (f^n - f^{n-2}),

so it is constant without losses for a full set of modes and otherwise never rises. Without losses its first
line is mu/(2 dt^2) sum [q1^2 - 2 cos(theta) q1 q0 + q0^2].
"""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from livebass import modes
from livebass.motion import Floats, Motion, Trial, initial_amplitudes, initial_amplitudes_across
from livebass.reference_steps import Plan, State, run

CHUNK = 16384  # steps between two returns to Python: where Ctrl-C is noticed


def static_compliance(trial: Trial) -> Floats:
    """R (P, P), m per N/m: (dx/mu) sum over the modes left out of phi_j(x_m) phi_j(x_k) / omega_j^2."""
    s = trial.speaking
    shape = modes.shapes(s, s.grid_points - 1, np.asarray(s.contact_position))[:, trial.modes :]
    omega = 2 * math.pi * modes.frequencies(s, s.grid_points - 1)[trial.modes :]
    return np.asarray(s.step / s.string.linear_density * (shape / omega**2) @ shape.T)


def make_plan(trial: Trial) -> Plan:
    """Coefficients of eq. 12 for `trial`. Raises ValueError for a mode too damped to swing."""
    s, count, dt = trial.speaking, trial.modes, 1 / trial.contact_rate
    sigma = np.zeros(count) if trial.lossless else modes.dampings(s, count)
    natural = 2 * math.pi * modes.frequencies(s, count)
    if np.any(sigma >= natural):
        raise ValueError(
            f"mode {int(np.argmax(sigma >= natural)) + 1} does not swing: damping above 2 pi frequency"
        )
    omega = np.sqrt((natural - sigma) * (natural + sigma))
    shape = modes.shapes(s, count, np.asarray(s.contact_position))
    compliance = static_compliance(trial)
    place = trial.sensor if trial.sensor_v is None else trial.sensor_v
    return Plan(
        dt=dt,
        density=s.string.linear_density,
        dx=s.step,
        decay=np.exp(-2 * sigma * dt),
        pull=np.expm1(-sigma * dt) ** 2 + 4 * np.exp(-sigma * dt) * np.sin(omega * dt / 2) ** 2,
        sigma=sigma,
        omega=omega,
        shape=np.ascontiguousarray(shape),
        sensor=modes.shapes(s, count, np.array([trial.sensor]))[0],
        height=np.asarray(s.contact_height, dtype=np.float64),
        coupling=dt**2 / s.string.linear_density * s.step * (shape @ shape.T) + compliance,
        compliance=compliance,
        stiffness=float(s.contact_stiffness),
        exponent=float(s.contact_exponent),
        across=modes.shapes(s, count, np.array([place]))[0] if trial.pluck.angle else np.zeros(0),
        friction=s.friction,
        slip=2 * dt * s.friction_speed,
    )


def make_state(plan: Plan, q: Floats, across: Floats) -> State:
    """State at step 0 of a string released at rest from the amplitudes `q` (N,) of u, `across` of v.

    The free damped motion with q(0) = q, dq/dt(0) = 0, followed back to -dt, gives d^0.
    """
    s, theta = plan.sigma * plan.dt, plan.omega * plan.dt
    back = -np.expm1(s) + np.exp(s) * (2 * np.sin(theta / 2) ** 2 + plan.sigma / plan.omega * np.sin(theta))
    d, points = q * back, plan.height.size
    if not plan.across.size:
        second = [np.zeros(0)] * 2 + [np.zeros(points) for _ in range(4)]
    else:
        e = across * back
        v = plan.shape @ across, plan.shape @ (across - e)
        second = [across.copy(), e, *v, np.zeros(points), np.zeros(points)]
    heights = plan.height - plan.shape @ q, plan.height - plan.shape @ (q - d)
    return State(q.copy(), d, *heights, np.zeros(points), np.zeros(points), *second)


def solve(trial: Trial, energy_every: int = 0) -> Motion:
    """Brute-force solution of `trial`; energy at every `energy_every`-th half step, none if 0.

    Raises ArithmeticError should Newton's method ever fail.
    """
    plan = make_plan(trial)
    state = make_state(plan, initial_amplitudes(trial), initial_amplitudes_across(trial))
    place = np.arange(trial.samples) * trial.contact_rate / trial.output_rate  # in fine steps
    sample_step = np.floor(place + 1e-9).astype(np.int64)
    offset = np.maximum(place - sample_step, 0.0)
    displacement, across = np.zeros(trial.samples), np.zeros(trial.samples)
    last = trial.steps + 1  # one more than listed: a sample may lie just after step trial.steps
    energy = np.zeros((last - 1) // energy_every + 1 if energy_every else 0)
    room = CHUNK * plan.height.size // 2 + plan.height.size
    onset = np.zeros((room, 2), dtype=np.int64)
    found: list[NDArray[np.int64]] = []
    arguments = (sample_step, offset, displacement, across, energy_every, energy, onset)
    run(plan, state, 0, 0, *arguments)  # compiles
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
