"""Claims of sections 2.3 and 4 about the scheme: exact, conservative, dissipative, stable, converged."""

from __future__ import annotations

import math

import numpy as np

from livebass import modes
from livebass.claims_expect import AtLeast, AtMost, Claim, Value
from livebass.claims_measure import difference, energy_drift, energy_steps
from livebass.claims_runs import Run
from livebass.modal_motion import shape_at
from livebass.paper_cases import CASES


def modes_to_grid() -> Value:
    """How far dx S S^T is from one: S of all modes at all interior grid points."""
    s = CASES["a"].speaking()
    shape = modes.shapes(s, s.grid_points - 1, s.step * np.arange(1.0, s.grid_points))
    return float(np.abs(s.step * shape @ shape.T - np.eye(len(shape))).max())


def exactness(run: Run) -> Value:
    """The displacement of case A every 10 ms against eq. 4 solved in closed form, part of its greatest."""
    if run.motion.states is None:
        return math.nan
    every = np.asarray(run.trial.states)
    q, rate = run.motion.states[0, 0]
    exact = shape_at(run.trial.speaking, q, rate, run.motion.time_s[every], np.array([run.trial.sensor]))[:, 0]
    return float(np.abs(run.motion.displacement_m[every] - exact).max() / np.abs(exact).max())


CLAIMS = (
    Claim(
        "scheme-grid", "2.3",
        "Assuming a number of modes equal to the number of interior points of the spatial grid, i.e. Nm = N - 1, a "
        "simple relationship exists between u and the vector of modal coefficients q",
        "greatest entry of dx S S^T - 1",
        "", AtMost(1e-10), (), modes_to_grid,
    ),
    Claim(
        "scheme-exact", "2.3",
        "an exact solution for the linear part (when no contact occurs)",
        "case A against the closed form of eq. 4, relative",
        "", AtMost(1e-8), ("a",), exactness,
    ),
    Claim(
        "scheme-conserves", "2.3",
        "This scheme is conservative if there is no damping",
        "greatest change of the energy, case B without losses, 20 ms",
        "", AtMost(1e-9), ("energy",), energy_drift,
    ),
    Claim(
        "scheme-dissipates", "2.3",
        "[the scheme is] dissipative otherwise",
        "greatest rise of the energy in a step, case B, 20 ms",
        "", AtMost(1e-12), ("energy-losses",), lambda run: float(energy_steps(run).max()),
    ),
    Claim(
        "scheme-stable", "2.3",
        "and unconditionally stable",
        "greatest change of the energy without losses at 8 MHz, 1 MHz and 102.4 kHz",
        "", AtMost(1e-9), ("energy", "energy-1MHz", "energy-102kHz"), lambda *runs: [energy_drift(run) for run in runs],
    ),
    Claim(
        "converged-b", "4",
        "a relative error of the signal evaluated at the measurement point smaller than 0.1, on a simulation duration "
        "that encompasses all contact times at least",
        "case B, 8 MHz against 16 MHz, 0 to 0.12 s",
        "", AtMost(0.1), ("b", "b-twice"), lambda run, finer: difference(run, finer, 0, 0.12),
    ),
    Claim(
        "converged-c", "4",
        "a relative error of the signal evaluated at the measurement point smaller than 0.1 [case C, F_s = 16 MHz]",
        "case C, 16 MHz against 32 MHz, 0 to 0.2 s",
        "", AtMost(0.1), ("c", "c-twice"), lambda run, finer: difference(run, finer, 0, 0.2),
    ),
    Claim(
        "converged-needed", "4",
        "this stringent criterion is necessary and leads to use large values of the sampling frequency",
        "case B, 512 kHz against 8 MHz, 0 to 0.12 s",
        "", AtLeast(0.1), ("b-coarse", "b"), lambda coarse, run: difference(coarse, run, 0, 0.12),
    ),
)  # fmt: skip
