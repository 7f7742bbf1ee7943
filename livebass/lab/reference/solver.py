"""The brute-force solver: every fine step of eq. 12, with every mode and every contact point, from the equations.

It shares only the description of the string and the modal laws with the engine: agreement of the two means something.
Equation numbers: Issanchou et al. (2018).

Eq. 12 for one mode is q^{n+1} = C q^n - Ct q^{n-1} + F with, for theta = omega_d dt,

    C = 2 exp(-sigma dt) cos(theta),   Ct = exp(-2 sigma dt),   F = (dt^2/mu) dx sum_m phi(x_m) f_m^n.

Computed like that, C near 2 hides the frequency behind a rounding error of 1e-16 / theta^2 (2e-8 for mode 1 at 8 MHz).
With d^n = q^n - q^{n-1} the same recursion reads

    d^{n+1} = Ct d^n - (1 - C + Ct) q^n + F,   q^{n+1} = q^n + d^{n+1},

and 1 - C + Ct = (1 - exp(-sigma dt))^2 + 4 exp(-sigma dt) sin^2(theta / 2) is a sum of squares without cancellation.

Contact (eq. 6), with eta = g - u, psi = K/(alpha+1) [eta]_+^(alpha+1), r = eta^{n+1} - eta^{n-1}:

    f^n = (psi(eta^{n+1}) - psi(eta^{n-1})) / r,   r = r* - (W + R) f^n,   W = (dt^2/mu) dx Phi Phi^T.

Here r* is r without force, and R the static compliance of the omitted modes (zero for a full set), which follow the
force at once: u^{n+1} = Phi^T q^{n+1} + R f^n. Frets with loss, after Hunt and Crossley, multiply this f by
max(0, 1 + c r / (2 dt)).

The second polarisation v is the same string without obstacle, or with its own C and Ct. Where u^n < g it feels the
friction of eq. 7, ff = -A sat((v^{n+1} - v^{n-1}) / (2 dt s)); u does not feel v.

Energy at n + 1/2, from eq. 12 times (q^{n+1} - q^{n-1}) / 2:

    H = mu/(2 dt^2) sum_j [(1 + Ct)/2 d^2 + (1 - C + Ct) q^{n+1} q^n]
        + dx sum_m [psi(eta^{n+1}) + psi(eta^n)]/2 + dx/4 [f^n R f^n + f^{n-1} R f^{n-1}].

A step changes H by

    -(mu/dt^2) sum_j (1 - Ct)/4 (q^{n+1} - q^{n-1})^2 - dx/4 (f^n - f^{n-2}) R (f^n - f^{n-2}),

so H is constant without losses for a full set of modes, and otherwise never rises. Each fret with loss takes another
dx/2 (f r - psi(eta^{n+1}) + psi(eta^{n-1})) >= 0. Without losses the first line of H is
mu/(2 dt^2) sum [q1^2 - 2 cos(theta) q1 q0 + q0^2]. v adds the first line and the term with R for its own forces, and
friction changes H by another dx sum_m ff (v^{n+1} - v^{n-1}) / 2 <= 0 per step.

On turned axes u and v exchange energy: kernels/string/turning.py has the equations. A mode's W = E sin(theta) q - i P,
P = Ct d - (Ct - C / 2) q, advances by their flow at the end of every fourth frame, or as soon as no obstacle or mass
touches the string. |W|^2 is the mode's energy in units of mu / (2 dt^2), but for its losses within a step.

No step, mode or point is skipped. Two liberties affect only rounding: dot products sum in any order, four numbers at a
time, and modes below 1e-200 are set to zero, as arithmetic on denormal numbers would cost a factor of 20.
"""

from __future__ import annotations

import time

import numpy as np

from livebass.lab.reference.laws import absent, contacts
from livebass.lab.reference.plan import at_rest, lay, make_plan, make_state
from livebass.lab.reference.stepping import Ears, Held, Pace, Sheets, no_hands, run
from livebass.model.trial import Motion, Trial, initial_amplitudes, initial_amplitudes_across
from livebass.rows.arrays import Floats, Ints

CHUNK = 16384  # steps between two returns to Python, which then notices Ctrl-C


def solve(trial: Trial, energy_every: int = 0) -> Motion:
    """The motion of `trial` by brute force, with the energy at every `energy_every`-th half step, or none if 0.

    Raises ValueError for an overdamped mode, and ArithmeticError if the equation of a contact does not converge.
    """
    plan = make_plan(trial)
    u, v = initial_amplitudes(trial), initial_amplitudes_across(trial)
    state = make_state(plan, u, v, trial.follow * u, trial.follow * v)
    lay(plan, state, at_rest(plan))
    points, samples = plan.height.size, trial.samples
    laws = contacts(points, plan.stiffness, plan.exponent, plan.loss)
    string = Held(plan, laws, absent(points), state, no_hands())
    place = np.arange(samples) * trial.contact_rate / trial.output_rate  # in fine steps
    step = np.floor(place + 1e-9).astype(np.int64)
    none = np.zeros(0)
    unused = Pace(none, none, none)
    last = trial.steps + 1  # one more than for contacts: a sample may lie just after step trial.steps
    accounts = (last - 1) // energy_every + 1 if energy_every else 0
    ears = Ears(
        step, np.maximum(place - step, 0.0), plan.sensor[None, :], plan.across[None, :], unused, unused,
        np.zeros(0, dtype=np.int64), energy_every,
    )  # fmt: skip
    sheets = Sheets(
        displacement=np.zeros((1, 2, samples)), velocity=np.zeros((0, 2, samples)), states=np.zeros((0, 2, 2, 0)),
        force=np.zeros((0, 0)), height=np.zeros((0, 0)), total=np.zeros(accounts), stored=np.zeros((2, accounts)),
        lost=np.zeros((3, 0)), taken=np.zeros((0, 0)), put_in=np.zeros((0, 0)),
        onset=np.zeros((CHUNK * points // 2 + points, 2), dtype=np.int64),
    )  # fmt: skip
    found: list[Ints] = []
    free = np.zeros((2, CHUNK, 0))
    run(string, free, 0, 0, ears, sheets)  # compiles now: wall_s does not count it
    start = time.perf_counter()
    for first in range(0, last, CHUNK):
        count = run(string, free, first, min(first + CHUNK, last), ears, sheets)
        if count < 0:
            raise ArithmeticError(f"contact at step {-count} did not converge")
        found.append(sheets.onset[:count].copy())
    touched = np.concatenate(found)
    touched = touched[touched[:, 0] <= trial.steps]
    moments: Floats = (np.arange(accounts, dtype=np.float64) * energy_every + 0.5) * plan.dt
    return Motion(
        time_s=np.arange(samples) / trial.output_rate,
        displacement_m=sheets.displacement[0, 0],
        contact_step=touched[:, 0].copy(),
        contact_index=touched[:, 1].copy(),
        contact_rate_hz=trial.contact_rate,
        wall_s=time.perf_counter() - start,
        energy_j=sheets.total if energy_every else None,
        energy_time_s=moments if energy_every else None,
        across_m=sheets.displacement[0, 1] if plan.across.size else None,
    )
