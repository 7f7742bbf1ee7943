"""Claims of sections 2 and 3, and of 4 on convergence: the string's modes, the neck in them, and the scheme.

The scheme is exact without contacts, conservative without losses, dissipative with them, stable, and converged.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from livebass.analysis.motion import Solved, shape_at
from livebass.arrays import Floats
from livebass.model import modes
from livebass.model.instrument import Speaking
from livebass.model.neck import neck_damping
from livebass.paper.cases import CASES
from livebass.paper.claims.expect import AtLeast, AtMost, Between, Claim, Each, Near, Rising, Value
from livebass.paper.claims.runs import difference, energy_drift, energy_steps

FIT = slice(19, 34)  # the 20th to the 34th mode
LOW, HIGH = slice(0, 20), slice(30, 60)  # up to 2000 Hz; beyond the 30th mode


def _string() -> Speaking:
    """The paper's string over its neck."""
    return CASES["a"].speaking()


def _law(s: Speaking) -> Speaking:
    """`s` with the frequencies and dampings of the models in place of the measured ones."""
    return replace(s, string=replace(s.string, measured_frequencies=(), measured_dampings=()))


def _measured(s: Speaking) -> tuple[Floats, Floats]:
    """Frequencies (Hz) and dampings (1/s) of the 34 measured modes."""
    return np.array(s.string.measured_frequencies), np.array(s.string.measured_dampings)


def _neck_dampings(s: Speaking, count: int) -> Floats:
    """The neck's part of the dampings of the model, 1/s, (count,): the last term of eq. 9."""
    return neck_damping(s.admittance.at(modes.frequencies(_law(s), count)), modes.impedance(s), s.fundamental)


def tension() -> Value:
    s = _string()
    return 4 * s.length**2 * s.string.linear_density * s.fundamental**2


def inharmonicity() -> Value:
    """B of eq. 8 by least squares over the 20th to the 34th mode, with c / 2L of table 1."""
    s = _string()
    j = np.arange(1, 35)[FIT]
    ideal = j * s.string.nominal_fundamental
    bend = ideal * j**2 / 2
    return float(bend @ (_measured(s)[0][FIT] - ideal) / (bend @ bend))


def frequency_error() -> Value:
    s = _string()
    nu = _measured(s)[0]
    error = np.abs(modes.frequencies(_law(s), 34) / nu - 1)
    return [float(error.max()), float(error[FIT].max())]


def quality_error() -> Value:
    s = _string()
    nu, sigma = _measured(s)
    quality = modes.frequencies(_law(s), 34) / modes.dampings(_law(s), 34)
    return float(np.median(np.abs(quality / (nu / sigma) - 1)[FIT]))


def quality_without_neck() -> Value:
    """Q of the model without the neck over the measured Q: medians up to 2 kHz and from 3 to 3.4 kHz."""
    s = _string()
    nu, sigma = _measured(s)
    bare = modes.dampings(_law(s), 34) - _neck_dampings(s, 34)
    ratio = modes.frequencies(_law(s), 34) / bare / (nu / sigma)
    return [float(np.median(ratio[LOW])), float(np.median(ratio[30:]))]


def neck_share() -> Value:
    """The neck's part of the damping of the model: means up to 2 kHz and over modes 31 to 60."""
    s = _string()
    share = _neck_dampings(s, 60) / modes.dampings(_law(s), 60)
    return [float(share[LOW].mean()), float(share[HIGH].mean())]


def neck_detuning() -> Value:
    """Greatest relative change that the neck makes to the frequencies of the model, over 100 modes."""
    s = _law(_string())
    j = np.arange(1, 101)
    without = j * s.fundamental * (1 + s.inharmonicity * j**2 / 2)
    return float(np.abs(modes.frequencies(s, 100) / without - 1).max())


def damping_bands() -> Value:
    """Mean damping of modes 1 to 10, 11 to 34, 35 to 100 and above."""
    sigma = modes.dampings(_string(), 862)
    return [float(part.mean()) for part in np.split(sigma, [10, 34, 100])]


def modes_to_grid() -> Value:
    """Greatest entry of dx S S^T - 1, S of all modes at all interior grid points."""
    s = CASES["a"].speaking()
    shape = modes.shapes(s, s.grid_points - 1, s.step * np.arange(1.0, s.grid_points))
    return float(np.abs(s.step * shape @ shape.T - np.eye(len(shape))).max())


def exactness(run: Solved) -> Value:
    """Greatest error of case A every 10 ms against eq. 4 in closed form, relative to the greatest displacement."""
    if run.motion.states is None:
        return math.nan
    every = np.asarray(run.trial.states)
    q, rate = run.motion.states[0, 0]
    exact = shape_at(run.trial.speaking, q, rate, run.motion.time_s[every], np.array([run.trial.sensor]))[:, 0]
    return float(np.abs(run.motion.displacement_m[every] - exact).max() / np.abs(exact).max())


CLAIMS = (
    Claim(
        "g-fundamental", "3",
        "The G-string of an electric bass with fundamental frequency 98 Hz is considered",
        "first eigenfrequency of the model",
        "Hz", Near(98, 0.005), (), lambda: float(modes.frequencies(_string(), 1)[0]),
    ),
    Claim(
        "g-tension", "3",
        "[table 1: T = 191.6 N,] T being deduced from the other parameters",
        "4 L^2 mu f0^2",
        "N", Near(191.6, 0.005), (), tension,
    ),
    Claim(
        "g-inharmonicity", "3.2",
        "[table 2: B = 3.5e-5,] selected in order to obtain the best fit with measurements, in particular for highest "
        "frequencies, from the 20th to the 34th mode",
        "B fitted to the measured modes 20 to 34",
        "", Near(3.5e-5, 0.1), (), inharmonicity,
    ),
    Claim(
        "g-frequencies", "3.2",
        "parameters of the eigenfrequencies [...] models [...] are selected in order to obtain the best fit with"
        " measurements, in particular for highest frequencies, from the 20th to the 34th mode",
        "greatest relative error of modes 1 to 34, and of 20 to 34",
        "", Each((AtMost(6e-3), AtMost(2e-3))), (), frequency_error,
    ),
    Claim(
        "g-qualities", "3.2",
        "[parameters of the] damping models [...] are selected in order to obtain the best fit with measurements,"
        " in particular for highest frequencies, from the 20th to the 34th mode",
        "median relative error of Q, modes 20 to 34",
        "", AtMost(0.5), (), quality_error,
    ),
    Claim(
        "g-mode-34", "3.2",
        "measured values of the linear characteristics are directly included up to the 34th mode, i.e. around 3400 Hz",
        "frequency of mode 34",
        "Hz", Near(3400, 0.01), (), lambda: float(modes.frequencies(_string(), 34)[-1]),
    ),
    Claim(
        "g-damping-rises", "4.1",
        "the larger damping coefficients of high frequency modes",
        "mean damping of modes 1-10, 11-34, 35-100, 101-862",
        "1/s", Rising(0.5), (), damping_bands,
    ),
    Claim(
        "neck-measured", "3.2",
        "the mobility substantially affects the quality factor of the string in the low frequency range (from about "
        "100 to 2000 Hz)",
        "Q of the model without mobility over the measured Q, medians of modes 1 to 20 and 31 to 34",
        "", Each((AtLeast(2), AtMost(1.5))), (), quality_without_neck,
    ),
    Claim(
        "neck-damping", "3.2",
        "its contribution to damping decreases with frequency and becomes negligible beyond the 30th mode",
        "part of the mobility in the damping of the model, modes 1 to 20 and 31 to 60",
        "", Each((AtLeast(0.3), AtMost(0.15))), (), neck_share,
    ),
    Claim(
        "neck-frequencies", "3.2",
        "The mobility at the nut is included in the models up to about 10000 Hz; note that its contribution to "
        "eigenfrequencies is negligible",
        "greatest relative change of modes 1 to 100 by the mobility",
        "", Between(1e-9, 5e-3), (), neck_detuning,
    ),
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
