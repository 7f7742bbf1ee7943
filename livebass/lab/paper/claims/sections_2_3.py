"""Claims of sections 2 and 3, and of 4 on convergence: the string's modes, the neck's effect on them, the scheme."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from livebass.lab.analysis.motion import Solved, modal_energies, shape_at, states_of
from livebass.lab.paper.cases import CASES
from livebass.lab.paper.claims import expect
from livebass.lab.paper.claims.expect import Claim, Value, each
from livebass.lab.paper.claims.runs import difference, energy_drift, energy_steps
from livebass.model import modes
from livebass.model.neck import Admittance, neck_damping
from livebass.rows.arrays import Floats

FIT = slice(19, 34)  # modes 20 to 34
SHOWN_HZ = 8000.0  # of figure 3c
LOW, HIGH = slice(0, 20), slice(30, 60)  # up to 2000 Hz; beyond the 30th mode


STRING = CASES["a"].speaking()  # the paper's string over its neck
# The same with the models' frequencies and dampings instead of the measured ones.
LAW = replace(STRING, string=replace(STRING.string, measured_frequencies=(), measured_dampings=()))
NU, SIGMA = np.array(STRING.string.measured_frequencies), np.array(STRING.string.measured_dampings)  # Hz, 1/s, (34,)


def _neck_dampings(count: int) -> Floats:
    """The neck's part of the model's dampings, 1/s, (count,): the last term of eq. 9."""
    return neck_damping(
        STRING.admittance.at(modes.frequencies(LAW, count)), modes.impedance(STRING), STRING.fundamental
    )


def tension() -> Value:
    return 4 * STRING.length**2 * STRING.string.linear_density * STRING.fundamental**2


def inharmonicity() -> Value:
    """B of eq. 8 by least squares over modes 20 to 34, with c / 2L of table 1."""
    j = np.arange(1, 35)[FIT]
    ideal = j * STRING.string.nominal_fundamental
    bend = ideal * j**2 / 2
    return float(bend @ (NU[FIT] - ideal) / (bend @ bend))


def frequency_error(part: slice = slice(None)) -> Value:
    """Greatest relative error of eq. 8 over some of the 34 measured modes."""
    return float(np.abs(modes.frequencies(LAW, 34) / NU - 1)[part].max())


def quality_error() -> Value:
    quality = modes.frequencies(LAW, 34) / modes.dampings(LAW, 34)
    return float(np.median(np.abs(quality / (NU / SIGMA) - 1)[FIT]))


def quality_without_neck() -> Value:
    """Q of the model without the neck over the measured Q: medians up to 2 kHz and from 3 to 3.4 kHz."""
    bare = modes.dampings(LAW, 34) - _neck_dampings(34)
    ratio = modes.frequencies(LAW, 34) / bare / (NU / SIGMA)
    return [float(np.median(ratio[LOW])), float(np.median(ratio[30:]))]


def neck_share() -> Value:
    """The neck's part of the model's damping: means up to 2 kHz and over modes 31 to 60."""
    share = _neck_dampings(60) / modes.dampings(LAW, 60)
    return [float(share[LOW].mean()), float(share[HIGH].mean())]


def neck_detuning() -> Value:
    """Greatest relative effect of the neck on the model's frequencies, over 100 modes."""
    rigid = replace(LAW, admittance=Admittance())
    return float(np.abs(modes.frequencies(LAW, 100) / modes.frequencies(rigid, 100) - 1).max())


def damping_bands() -> Value:
    """Mean damping of modes 1 to 10, 11 to 34, 35 to 100 and above."""
    sigma = modes.dampings(STRING, 862)
    return [float(part.mean()) for part in np.split(sigma, [10, 34, 100])]


def conductance() -> Value:
    """The greatest conductance of the neck at the nut up to 8 kHz, the range of figure 3c, m/s/N."""
    return float(STRING.admittance.at(np.linspace(20.0, SHOWN_HZ, 8000)).real.max())


def modes_to_grid() -> Value:
    """Greatest entry of dx S S^T - 1, with S for all modes at all interior grid points."""
    shape = modes.shapes(STRING, STRING.grid_points - 1, STRING.step * np.arange(1.0, STRING.grid_points))
    return float(np.abs(STRING.step * shape @ shape.T - np.eye(len(shape))).max())


def exactness(run: Solved) -> Value:
    """Greatest error of case A every 10 ms against eq. 4 in closed form, relative to the greatest displacement."""
    every = np.asarray(run.trial.states)
    q, rate = states_of(run)[0, 0]
    exact = shape_at(run.trial.speaking, q, rate, run.motion.time_s[every], np.array([run.trial.sensor]))[:, 0]
    return float(np.abs(run.motion.displacement_m[every] - exact).max() / np.abs(exact).max())


def friction_work(run: Solved, free: Solved) -> Value:
    """Energy of v at the end with friction over that without, and the relative difference of u due to friction."""
    last = (states_of(solved)[-1, 1] for solved in (run, free))
    v, v_free = (float(modal_energies(run.trial.speaking, q, rate).sum()) for q, rate in last)
    return [v / v_free, difference(run, free, 0, run.trial.duration)]


CLAIMS = (
    Claim(
        "g-fundamental", "3", "The G string sounds at 98 Hz",
        "first eigenfrequency", "Hz", expect.Near(98, 0.005), expect.SETUP, (),
        lambda: float(modes.frequencies(STRING, 1)[0]),
    ),
    Claim(
        "g-tension", "3, table 1", "Length, mass and pitch give a tension of 191.6 N",
        "4 L^2 mu f0^2", "N", expect.Near(191.6, 0.005), expect.SETUP, (), tension,
    ),
    Claim(
        "g-inharmonicity", "3.2, table 2", "B = 3.5e-5 describes the measured modes from 20 to 34 best",
        "B fitted to the measured modes 20 to 34", "", expect.Near(3.5e-5, 0.1), expect.PAPER, (), inharmonicity,
    ),
    Claim(
        "g-frequencies", "3.2, fig. 3a",
        "Eq. 8 gives the measured frequencies, best those of the modes 20 to 34, to which it is fitted",
        "greatest relative error of modes 20 to 34", "", expect.AtMost(2e-3), expect.OURS, (),
        lambda: frequency_error(FIT),
    ),
    Claim(
        "g-error-axis", "3.2, fig. 3a", "The errors of eq. 8 stay on the figure's axis, whose last mark is 0.006",
        "greatest relative error of modes 1 to 34", "", expect.AtMost(6e-3), expect.AXIS, (), frequency_error,
    ),
    Claim(
        "g-qualities", "3.2, fig. 3b", "Eqs. 9 to 11 give the measured quality factors, those of modes 20 to 34 best",
        "median relative error of Q, modes 20 to 34", "", expect.AtMost(0.5), expect.OURS, (), quality_error,
    ),
    Claim(
        "g-mode-34", "3.2", "The last mode whose measured values are used, the 34th, is near 3400 Hz",
        "frequency of mode 34", "Hz", expect.Near(3400, 0.01), expect.SETUP, (),
        lambda: float(modes.frequencies(STRING, 34)[-1]),
    ),
    Claim(
        "g-damping-rises", "4.1.1", "High modes are damped more than low ones",
        "mean damping of modes 1-10, 11-34, 35-100, 101-862", "1/s", expect.Rising(0.5), expect.DIRECTION, (),
        damping_bands,
    ),
    Claim(
        "neck-measured", "3.2, fig. 3b", "Below about 2 kHz the neck's mobility lowers the quality factors much",
        "Q of the model without mobility over the measured Q, medians of modes 1 to 20 and 31 to 34",
        "", expect.Each((expect.AtLeast(2), expect.AtMost(1.5))), expect.OURS, (), quality_without_neck,
    ),
    Claim(
        "neck-damping", "3.2, fig. 3b", "What the neck adds to the damping falls with frequency: from mode 30 on it "
        "matters no more", "part of the mobility in the damping of the model, means of modes 1 to 20 and 31 to 60",
        "", expect.Each((expect.AtLeast(0.3), expect.AtMost(0.15))), expect.OURS, (), neck_share,
    ),
    Claim(
        "neck-frequencies", "3.2", "The neck hardly moves the frequencies of the modes",
        "greatest relative change of modes 1 to 100 by the mobility", "", expect.Between(1e-9, 5e-3), expect.OURS, (),
        neck_detuning,
    ),
    Claim(
        "neck-conductance", "3.2, fig. 3c", "The conductance at the nut stays on the figure's axis, up to 0.04 m/s/N",
        "greatest conductance from 20 Hz to 8 kHz", "m/s/N", expect.AtMost(0.04), expect.AXIS, (), conductance,
    ),
    Claim(
        "friction-v", "2.1, eq. 7", "Friction at the frets takes energy from v, and leaves u alone",
        "oblique pluck: energy of v after 1 s with friction over that without; relative difference of u",
        "", expect.Each((expect.AtMost(0.9), expect.AtMost(1e-12))), expect.OURS, ("oblique", "oblique-free"),
        friction_work,
    ),
    Claim(
        "scheme-grid", "2.3", "With a mode for each point inside the grid, modes and displacements give each other",
        "greatest entry of dx S S^T - 1", "", expect.AtMost(1e-10), expect.ROUNDING, (), modes_to_grid,
    ),
    Claim(
        "scheme-exact", "2.3, eq. 12", "Without contacts the scheme is exact",
        "case A against the closed form of eq. 4, relative", "", expect.AtMost(1e-8), expect.ROUNDING, ("a",),
        exactness,
    ),
    Claim(
        "scheme-conserves", "2.3", "Without damping the scheme keeps its energy",
        "greatest change of the energy, case B without losses, 20 ms", "", expect.AtMost(1e-9), expect.ROUNDING,
        ("energy",), energy_drift,
    ),
    Claim(
        "scheme-dissipates", "2.3", "With damping the energy of the scheme never grows",
        "greatest rise of the energy in a step, case B, 20 ms", "", expect.AtMost(1e-12), expect.ROUNDING,
        ("energy-losses",), lambda run: float(energy_steps(run).max()),
    ),
    Claim(
        "scheme-stable", "2.3", "The scheme is stable at any time step",
        "greatest change of the energy without losses at 8 MHz, 1 MHz and 102.4 kHz", "", expect.AtMost(1e-9),
        expect.ROUNDING, ("energy", "energy-1MHz", "energy-102kHz"), each(energy_drift),
    ),
    Claim(
        "converged-b", "4", "At 8 MHz case B is converged: over the time of its contacts it is within a tenth",
        "case B, 8 MHz against 16 MHz, 0 to 0.12 s", "", expect.AtMost(0.1), expect.PAPER,
        ("b", "b-twice"), lambda run, finer: difference(run, finer, 0, 0.12),
    ),
    Claim(
        "converged-c", "4", "At 16 MHz case C is converged: over the time of its contacts it is within a tenth",
        "case C, 16 MHz against 32 MHz, 0 to 0.2 s", "", expect.AtMost(0.1), expect.PAPER,
        ("c", "c-twice"), lambda run, finer: difference(run, finer, 0, 0.2),
    ),
    Claim(
        "converged-needed", "4", "That criterion needs high rates",
        "case B, 512 kHz against 8 MHz, 0 to 0.12 s", "", expect.AtLeast(0.1), expect.PAPER,
        ("b-coarse", "b"), lambda coarse, run: difference(coarse, run, 0, 0.12),
    ),
)  # fmt: skip
