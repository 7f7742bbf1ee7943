"""Section 4, convergence: how the errors of cases B and C fall with the contact rate, and of case B with more modes.

The paper asks for a relative error of the displacement at the sensor below 0.1 during contacts. Here that error is the
norm of the difference from the finest solution, over the norm of the finest, from the release on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from livebass.lab.analysis.motion import Solved
from livebass.lab.paper.cases import CASES
from livebass.lab.paper.figures.study import Findings, Picture, Table
from livebass.lab.paper.solving import Job
from livebass.model.trial import Trial
from livebass.report.picture import figure
from livebass.rows.arrays import Floats
from livebass.sound.analysis import PAPER_RATE

CRITERION = 0.1
SECONDS = 0.12  # s, beyond the last of the usual contacts in case B
TIMES = (0.01, 0.03, 0.06, 0.1, SECONDS)  # s, up to which errors are listed
RATES = (0.5e6, 1e6, 2e6, 4e6, 8e6, 16e6, 32e6)  # Hz, compared with the finest
FINEST_RATE = 64e6 - 64e6 % PAPER_RATE  # Hz, the maximum of the engine, in whole steps per sample
MODES = (100, 200, 300, 400, 500, 600, 700, 800)  # compared with all
MODES_RATE = 8e6  # Hz
TITLES = {"b": "case B", "c": "case C", "modes": "case B at 8 MHz"}


def convergence_jobs(duration: float | None) -> dict[str, Job]:
    """The motions "b 8" (MHz), "c 8", "modes 400" and so on, and the finest, "b", "c" and "modes"."""
    trials: dict[str, Trial] = {}
    for name in ("b", "c"):
        trial = replace(CASES[name], duration=min(SECONDS, duration or SECONDS), contact_rate=MODES_RATE).trial()
        trials[name] = replace(trial, contact_rate=FINEST_RATE)
        for rate in RATES:
            trials[f"{name} {rate / 1e6:g}"] = replace(trial, contact_rate=PAPER_RATE * np.ceil(rate / PAPER_RATE))
        if name == "b":
            trials["modes"] = trial
            trials |= {f"modes {count}": replace(trial, modes=count) for count in MODES}
    return {key: Job(trial) for key, trial in trials.items()}


def convergence(motions: Mapping[str, Solved]) -> Findings:
    """The study `convergence`: errors against the finest solution, as curves and tables."""
    found = Findings()
    drawn = figure(11, 7)
    axes = drawn.subplots(2, 2)
    for kind, column, name in (("b", 0, "rates-b"), ("c", 0, "rates-c"), ("modes", 1, "modes")):
        values = MODES if kind == "modes" else tuple(rate / 1e6 for rate in RATES)
        solved = [motions[f"{kind} {value:g}"] for value in values]
        u, nu = zip(*(errors(one, motions[kind]) for one in solved), strict=True)
        label = "modes" if kind == "modes" else "contact rate (MHz)"
        for axis, error in zip(axes[:, column], ([e[-1] for e in u], nu), strict=True):
            axis.semilogy(values, error, marker="o", label=TITLES[kind])
            axis.set(xlabel=label, xscale="linear" if kind == "modes" else "log")  # with room for its ticks
            axis.set_xticks(values, [f"{v:g}" for v in values])
            axis.minorticks_off()
            axis.legend(fontsize="small")
        against = f"all {motions[kind].trial.modes} modes" if kind == "modes" else f"{FINEST_RATE / 1e6:g} MHz"
        times = times_of(motions[kind])
        columns = label, *(f"error of u up to {t:g} s" for t in times), "median error of nu_c", "contacts"
        rows = [(v, *map(float, e), n, one.motion.contact_step.size)
                for v, e, n, one in zip(values, u, nu, solved, strict=True)]  # fmt: skip
        found.tables.append(Table(name, f"{TITLES[kind].capitalize()} against {against}", columns, rows))
        found.numbers[name] = {"values": values, "error_of_u": [e[-1] for e in u], "median_error_of_nu_c": nu}
        found.arrays |= {
            f"{name}_values": np.asarray(values, np.float64), f"{name}_errors_of_u": np.array(u),
            f"{name}_errors_until_s": np.asarray(times),
        }  # fmt: skip
    for above, below in axes.T:
        above.axhline(CRITERION, color="grey", linestyle="--", linewidth=0.8)
        above.set_ylabel("relative error of u")
        below.set_ylabel("median error of nu_c")
    seconds = motions["b"].trial.duration
    caption = f"Errors against the finest solution in the first {seconds:g} s; dashed: the paper's criterion, 0.1"
    found.pictures.append(Picture("convergence", caption, drawn))
    return found


def errors(solved: Solved, finest: Solved) -> tuple[Floats, float]:
    """Relative errors of u up to each of `times_of`, and the median error of eq. 14 over the frames."""
    u, exact = solved.displacement(), finest.displacement()
    ends = [round(t * solved.rate) + 1 for t in times_of(finest)]
    nu, true = solved.characteristic()[1], finest.characteristic()[1]
    of_u = [np.linalg.norm((u - exact)[:n]) / np.linalg.norm(exact[:n]) for n in ends]
    return np.array(of_u), float(np.median(np.abs(nu - true) / true))


def times_of(solved: Solved) -> list[float]:
    """The `TIMES` within the duration of a motion, s."""
    return [t for t in TIMES if t <= solved.trial.duration]
