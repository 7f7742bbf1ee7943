"""How fine is fine enough: cases B and C over contact rates, case B over numbers of modes (section 4).

The paper asks for a relative error of the displacement at the sensor below 0.1 while there are contacts. Here that is
the norm of the difference to the finest solution over the norm of that, from the release on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from livebass import study_draw as draw
from livebass.analysis import PAPER_RATE
from livebass.motion import Floats, Trial
from livebass.motion_analysis import characteristic
from livebass.paper_cases import CASES
from livebass.study_parts import Findings, Picture, Solved, Table

CRITERION = 0.1
SECONDS = 0.12  # s, past the last of the usual contacts in case B
TIMES = (0.01, 0.03, 0.06, 0.1, SECONDS)  # s, up to which errors are told
RATES = (0.5e6, 1e6, 2e6, 4e6, 8e6, 16e6, 32e6)  # Hz, against the finest
FINEST_RATE = 64e6 - 64e6 % PAPER_RATE  # Hz, the most the engine takes, in whole steps a sample
MODES = (100, 200, 300, 400, 500, 600, 700, 800)  # against all
MODES_RATE = 8e6  # Hz
WHAT = {"b": "case B", "c": "case C", "modes": "case B at 8 MHz"}


def trials(duration: float | None) -> dict[str, Trial]:
    """By "b 8" (MHz), "c 8" and "modes 400"; "b", "c" and "modes" are what they are held against."""
    out: dict[str, Trial] = {}
    for name in ("b", "c"):
        trial = replace(CASES[name], duration=min(SECONDS, duration or SECONDS), contact_rate=MODES_RATE).trial()
        out[name] = replace(trial, contact_rate=FINEST_RATE)
        for rate in RATES:
            out[f"{name} {rate / 1e6:g}"] = replace(trial, contact_rate=PAPER_RATE * np.ceil(rate / PAPER_RATE))
        if name == "b":
            out["modes"] = trial
            out |= {f"modes {count}": replace(trial, modes=count) for count in MODES}
    return out


def report(motions: Mapping[str, Solved]) -> Findings:
    """Errors against the finest, as curves and tables."""
    found = Findings()
    drawn = draw.figure(11, 7)
    axes = drawn.subplots(2, 2)
    for kind, column, name in (("b", 0, "rates-b"), ("c", 0, "rates-c"), ("modes", 1, "modes")):
        values = MODES if kind == "modes" else tuple(rate / 1e6 for rate in RATES)
        rows = [errors(motions[f"{kind} {value:g}"], motions[kind]) for value in values]
        label = "modes" if kind == "modes" else "contact rate (MHz)"
        for row, key in enumerate(("displacement", "characteristic frequency")):
            told = [np.nanmax(r[key]) if row == 0 else np.nanmedian(r[key]) for r in rows]
            axes[row][column].loglog(values, told, marker="o", label=WHAT[kind])
            axes[row][column].set(xlabel=label)
            axes[row][column].set_xticks(values, [f"{v:g}" for v in values])
            axes[row][column].minorticks_off()
            axes[row][column].legend(fontsize="small")
        columns = label, *(f"error of u up to {t:g} s" for t in TIMES), "median error of nu_c", "contacts"
        against = f"all {motions[kind].trial.modes} modes" if kind == "modes" else f"{FINEST_RATE / 1e6:g} MHz"
        found.tables.append(Table(
            name, f"{WHAT[kind].capitalize()} against {against}", columns,
            [(v, *map(float, r["displacement"]), float(np.nanmedian(r["characteristic frequency"])),
              motions[f"{kind} {v:g}"].motion.contact_step.size) for v, r in zip(values, rows, strict=True)],
        ))  # fmt: skip
        found.numbers[name] = {
            "values": list(values), "error_of_u": [float(r["displacement"][-1]) for r in rows],
            "median_error_of_nu_c": [float(np.nanmedian(r["characteristic frequency"])) for r in rows],
        }  # fmt: skip
        found.arrays[f"{name}_values"] = np.asarray(values, np.float64)
        found.arrays[f"{name}_errors_of_u"] = np.array([r["displacement"] for r in rows])
    found.arrays["error_until_s"] = np.asarray(TIMES)
    for axis in axes[0]:
        axis.axhline(CRITERION, color="grey", linestyle="--", linewidth=0.8)
        axis.set_ylabel("relative error of u")
    for axis in axes[1]:
        axis.set_ylabel("median error of nu_c")
    caption = f"Errors against the finest solution in the first {motions['b'].trial.duration:g} s; dashed: the paper's"
    found.pictures.append(Picture("convergence", f"{caption} criterion, 0.1", drawn))
    return found


def errors(solved: Solved, finest: Solved) -> dict[str, Floats]:
    """Of u up to each of `TIMES`, and of eq. 14 frame by frame."""
    u, exact = solved.motion.displacement_m, finest.motion.displacement_m
    ends = [min(u.size, round(t * solved.trial.output_rate) + 1) for t in TIMES]
    nu, true = (characteristic(solved.trial, m)[1] for m in (u, exact))
    return {
        "displacement": np.array([np.linalg.norm((u - exact)[:n]) / np.linalg.norm(exact[:n]) for n in ends]),
        "characteristic frequency": np.abs(nu - true) / true,
    }
