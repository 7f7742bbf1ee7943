"""The published method's step: products with full matrices, timed on one thread of the linear algebra."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np

from livebass.arrays import Floats
from livebass.bench.measure import CASE_B, RATES, Clock, Row, case_trial, row
from livebass.model import modes
from livebass.model.trial import Trial, initial_amplitudes

# Read by the libraries behind numpy's products when they are loaded.
ONE_THREAD = {
    "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "BLIS_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
}  # fmt: skip


def dense_row(steps: int, runs: int) -> Row:
    """Returns the cost of a dense step, measured in a process of its own where linear algebra has one thread."""
    program = f"import json, livebass.bench.dense as d; print(json.dumps(d.dense_steps({steps}, {runs})))"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(p or os.curdir for p in sys.path)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"dense products: {(done.stderr.splitlines() or ['no reason given'])[-1]}")
    result = json.loads(done.stdout)
    clock = Clock()
    clock.wall, clock.processor = result["step_s"], result["processor_s"]
    return row(
        "dense step, as published",
        1 / CASE_B.contact_rate,
        clock,
        modes=result["modes"],
        contact_rate_hz=int(CASE_B.contact_rate),
        rate_hz=None,
        cores=1,
    )


def dense_steps(steps: int, runs: int) -> dict[str, Any]:
    """Times eq. 12 with full matrices, u^{n+1} = D u^n - D~ u^{n-1} on the points of the grid, without contact force.

    "step_s" and "processor_s" hold the mean over `steps` steps of each run; a first run is not counted. [main thread]
    """
    trial = case_trial("b", "reference", RATES[0], 1.0)
    forward, backward, u = dense_matrices(trial)
    before, after, taken = u.copy(), np.empty_like(u), np.empty_like(u)
    clock = Clock()
    for _ in range(runs + 1):
        with clock:
            for _ in range(steps):
                np.dot(forward, u, out=after)
                np.dot(backward, before, out=taken)
                after -= taken
                before, u, after = u, after, before
    if not np.abs(u).max() < 2 * CASE_B.apex:
        raise ArithmeticError("the dense products do not swing like a string")
    each = np.array([clock.wall[1:], clock.processor[1:]]) / steps
    return {"modes": len(u), "step_s": each[0].tolist(), "processor_s": each[1].tolist()}


def dense_matrices(trial: Trial) -> tuple[Floats, Floats, Floats]:
    """Returns D = S C S^-1 and D~ of eq. 12, (points, points), and the pluck's u, (points,), m."""
    s, count, dt = trial.speaking, trial.modes, 1 / trial.contact_rate
    sigma = modes.dampings(s, count)
    omega = np.sqrt((2 * np.pi * modes.frequencies(s, count)) ** 2 - sigma**2)
    shape = modes.shapes(s, count, s.step * np.arange(1.0, count + 1))
    inverse = s.step * shape.T
    forward = (shape * (2 * np.exp(-sigma * dt) * np.cos(omega * dt))) @ inverse
    return forward, (shape * np.exp(-2 * sigma * dt)) @ inverse, shape @ initial_amplitudes(trial)
