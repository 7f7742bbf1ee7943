"""Data of the brute-force solver: the constants of a run and its state. solver.py has the equations."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebass.model import modes
from livebass.model.trial import Trial
from livebass.rows.arrays import Floats, Ints
from livebass.rows.parts import EXCHANGE_EVERY, TURNED_MODES

NEAR_REST, MAX_NEWTON = 10e-6, 100  # m of penetration to begin with; steps
TERMS = 12  # of a power series of matrices below 0.1


class Modes(NamedTuple):
    """Coefficients of the N modes of one polarisation."""

    decay: Floats  # (N,) Ct
    pull: Floats  # (N,) 1 - C + Ct
    sigma: Floats  # (N,) 1/s
    omega: Floats  # (N,) rad/s, damped


class Turn(NamedTuple):
    """The exchange of u and v over turned axes, in the first T modes: solver.py."""

    frames: Ints  # (F,) the fine step at the end of each frame; empty: the axes are not turned
    every: int  # frames between two exchanges
    flow: NDArray[np.complex128]  # (T, 2, 2) of (W_u, W_v)


class Plan(NamedTuple):
    """Constants of a run with N modes and P contact points; symbols as in solver.py."""

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
    turn: Turn


class State(NamedTuple):
    """The state of a run at step n; `stepping.run` advances it in place."""

    q: Floats  # (N,) q^n, m^1.5
    d: Floats  # (N,) q^n - q^{n-1}, m^1.5
    eta: Floats  # (P,) eta^n, m
    eta_before: Floats  # (P,) eta^{n-1}, m
    force: Floats  # (P,) f^{n-1}, N/m
    force_before: Floats  # (P,) f^{n-2}, N/m
    q_across: Floats  # (N,) q^n of v; (0,) without a second polarisation
    d_across: Floats  # (N,) d^n of v, or (0,)
    v: Floats  # (P,) v^n, m
    v_before: Floats  # (P,) v^{n-1}, m
    friction: Floats  # (P,) ff^{n-1}, N/m
    friction_before: Floats  # (P,) ff^{n-2}, N/m
    owed: Ints  # (1,) exchanges of u and v that wait for the string to be clear


def static_compliance(trial: Trial) -> Floats:
    """R (P, P), m per N/m: (dx/mu) sum over the omitted modes of phi_j(x_m) phi_j(x_k) / omega_j^2."""
    s = trial.speaking
    shape = modes.shapes(s, s.grid_points - 1, np.asarray(s.contact_position))[:, trial.modes :]
    omega = 2 * math.pi * modes.frequencies(s, s.grid_points - 1)[trial.modes :]
    return np.asarray(s.step / s.string.linear_density * (shape / omega**2) @ shape.T)


def make_modes(trial: Trial, across: bool) -> Modes:
    """The modes of u, or of v. Raises ValueError for an overdamped mode."""
    s, count, dt = trial.speaking, trial.modes, 1 / trial.contact_rate
    sigma = np.zeros(count) if trial.lossless else modes.dampings_alone(s, count, across)
    natural = 2 * math.pi * modes.frequencies(s, count, across=across)
    if np.any(sigma >= natural):
        raise ValueError(f"mode {int(np.argmax(sigma >= natural)) + 1} does not swing: damping above 2 pi frequency")
    omega = np.sqrt((natural - sigma) * (natural + sigma))
    pull = np.expm1(-sigma * dt) ** 2 + 4 * np.exp(-sigma * dt) * np.sin(omega * dt / 2) ** 2
    return Modes(np.exp(-2 * sigma * dt), pull, sigma, omega)


def make_turn(trial: Trial) -> Turn:
    """The exchange of u and v in `trial`, in the modes and at the frames that the engine takes."""
    rate, more = modes.exchange(trial.speaking, min(trial.modes, TURNED_MODES))
    swap = np.array([[0.0, 1.0], [1.0, 0.0]])
    z = (1j * rate[:, None, None] * swap - more * (not trial.lossless)) * (EXCHANGE_EVERY / trial.output_rate)
    flow = term = np.tile(np.eye(2, dtype=complex), (rate.size, 1, 1))
    for k in range(1, TERMS):
        term = term @ z / k
        flow = flow + term
    count = trial.samples if rate.any() else 0
    frames = np.arange(1, count + 1) * trial.contact_rate / trial.output_rate
    return Turn(np.ceil(frames - 1e-9).astype(np.int64), EXCHANGE_EVERY, flow)


def make_plan(trial: Trial) -> Plan:
    """Coefficients of eq. 12 for `trial`. Raises ValueError for an overdamped mode."""
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
        across=modes.shapes(s, count, np.array([place]))[0] if trial.oblique else np.zeros(0),
        friction=s.friction,
        slip=2 * dt * s.friction_speed,
        turn=make_turn(trial),
    )


def at_rest(plan: Plan) -> Floats:
    """The amplitudes of u at rest, (N,), m^1.5: 0, unless crowns above the line from stop to saddle carry the string.

    A constant f moves mode j by (dt^2/mu) dx phi_j f / (1 - C + Ct). The penetrations solve eta + S psi'(eta) = g by
    Newton's method with halved steps.
    """
    if not np.any(plan.height > 0):
        return np.zeros(plan.u.pull.size)
    moved = plan.dt**2 / plan.density * plan.dx * plan.shape / plan.u.pull
    gives = moved @ plan.shape.T + plan.compliance

    def missed(eta: Floats) -> Floats:
        return eta + gives @ (plan.stiffness * np.maximum(eta, 0) ** plan.exponent) - plan.height

    eta: Floats = np.minimum(plan.height, NEAR_REST)
    for _ in range(MAX_NEWTON):
        left = missed(eta)
        slope = plan.stiffness * plan.exponent * np.maximum(eta, 0) ** (plan.exponent - 1)
        step = np.linalg.solve(np.eye(eta.size) + gives * slope, left)
        part = next((part for part in 0.5 ** np.arange(20) if _worst(missed(eta - part * step)) < _worst(left)), 0.0)
        if part == 0:
            break
        eta = eta - part * step
    force = plan.stiffness * np.maximum(eta, 0) ** plan.exponent
    return np.asarray(force @ moved)


def lay(plan: Plan, state: State, rest: Floats) -> None:
    """Adds the amplitudes `rest`, (N,), to a state, without motion, at all of the plan's points."""
    moved = plan.shape @ rest
    state.q[:] += rest
    state.eta[:] -= moved
    state.eta_before[:] -= moved


def _worst(missed: Floats) -> float:
    return float(np.abs(missed).max())


def _step_before(plan: Plan, of: Modes, q: Floats, pace: Floats | None) -> Floats:
    """d^0, (N,), of a polarisation's modes `of` with the amplitudes `q`; see `make_state`."""
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
    zeros, owed = np.zeros((4, points)), np.zeros(1, dtype=np.int64)
    second = np.zeros(0), np.zeros(0), np.zeros(points), np.zeros(points)
    if plan.across.size:
        e = _step_before(plan, plan.v, across, pace_across)
        second = across.copy(), e, plan.shape @ across, plan.shape @ (across - e)
    heights = plan.height - plan.shape @ q, plan.height - plan.shape @ (q - d)
    return State(q.copy(), d, *heights, zeros[0], zeros[1], *second, zeros[2], zeros[3], owed)
