"""The bass at rest: fret crowns under the string (figure 1), frequencies and quality factors of modes (figure 3).

How fine is fine enough: cases B and C over contact rates, case B over numbers of modes (section 4).

The paper asks for a relative error of the displacement at the sensor below 0.1 while there are contacts. Here that is
the norm of the difference to the finest solution over the norm of that, from the release on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from livebass.analysis.motion import characteristic
from livebass.analysis.sound import PAPER_RATE
from livebass.arrays import Floats
from livebass.model import modes
from livebass.model.instrument import Speaking, speaking
from livebass.model.neck import Admittance
from livebass.model.trial import Trial
from livebass.paper.cases import CASES, PRESET
from livebass.paper.figures import draw
from livebass.paper.figures.measure import Findings, Picture, Solved, Table
from livebass.preset.load import load_preset
from livebass.report.picture import figure

TOP_HZ = 8000.0  # of figure 3c


def linear_trials(duration: float | None) -> dict[str, Trial]:
    """Nothing moves."""
    return {}


def linear_report(motions: Mapping[str, Solved]) -> Findings:
    """Figures 1 and 3, and what they are drawn from."""
    bass = load_preset(PRESET)
    string = bass.strings[0]
    s = speaking(replace(string, measured_frequencies=(), measured_dampings=()), bass.necks[0], 0)
    count = len(string.measured_frequencies)
    measured = np.asarray(string.measured_frequencies)
    measured_q = math.pi * measured / np.asarray(string.measured_dampings)
    nu, q = modes.frequencies(s, count), quality_factors(s, count)
    without = quality_factors(replace(s, admittance=Admittance()), count)
    rows = {
        "mode": np.arange(1, count + 1), "measured (Hz)": measured, "model (Hz)": nu,
        "error": np.abs(nu - measured) / measured, "measured Q": measured_q, "model Q": q,
        "error of Q": np.abs(q - measured_q) / measured_q, "Q without the neck": without,
    }  # fmt: skip
    found = Findings(
        pictures=[_neck(s), _modes(s, rows)],
        tables=[
            Table("modes", "The first modes: measured, and by eqs. 8 to 11", tuple(rows),
                  list(zip(*(column.tolist() for column in rows.values()), strict=True))),
            _frets(s),
        ],
        numbers={
            "modes": count,
            "greatest_frequency_error": float(rows["error"].max()),
            "median_q_error": float(np.median(rows["error of Q"])),
            "neck_mobility": bool(s.admittance),
        },
    )  # fmt: skip
    found.arrays |= {
        "measured_frequencies_hz": measured, "model_frequencies_hz": nu, "measured_q": measured_q, "model_q": q,
        "model_q_without_neck": without, "fret_positions_m": np.asarray(s.contact_position),
        "fret_heights_m": np.asarray(s.contact_height),
    }  # fmt: skip
    return found


def quality_factors(s: Speaking, count: int) -> Floats:
    """Q_j = pi nu_j / sigma_j of the first modes (section 2.2)."""
    return math.pi * modes.frequencies(s, count) / modes.dampings(s, count)


def _neck(s: Speaking) -> Picture:
    """Figure 1."""
    drawn = figure(9, 3.5)
    axis = drawn.subplots()
    draw.neck_panel(axis, s)
    for k in (0, 11, len(s.contact_fret) - 1):
        if k < len(s.contact_fret):
            place = s.contact_position[k], s.contact_height[k] * 1e3
            axis.annotate(f"fret {s.contact_fret[k]}", place, xytext=(0, 6), textcoords="offset points",
                          fontsize="small", ha="center")  # fmt: skip
    axis.set_ylim(-5, 5)
    return Picture("neck", "Fret crowns under the string at rest (figure 1)", drawn)


def _modes(s: Speaking, rows: Mapping[str, Floats]) -> Picture:
    """Figure 3."""
    drawn = figure(11, 7)
    fine = np.linspace(20.0, TOP_HZ, 4000)
    conductance = s.admittance.at(fine).real
    rows_of_axes = [["frequency", "q"], *([["conductance"] * 2] if conductance.any() else [])]
    axes = drawn.subplot_mosaic(rows_of_axes, height_ratios=(3, 2)[: len(rows_of_axes)])
    _frequencies(axes["frequency"], rows)
    _quality_factors(axes["q"], s, rows)
    if conductance.any():
        axes["conductance"].plot(fine, conductance, color="tab:blue", linewidth=0.9)
        axes["conductance"].set(xlabel="frequency (Hz)", ylabel="conductance (m/s/N)", xlim=(0, TOP_HZ))
    neck = ", conductance of the neck" if conductance.any() else "; the preset has no mobility of the neck"
    return Picture("modes", f"Modes measured and by the model: frequencies, quality factors{neck} (figure 3)", drawn)


def _frequencies(axis: Any, rows: Mapping[str, Floats]) -> None:
    """Figure 3a."""
    j, nu = rows["mode"], rows["measured (Hz)"]
    axis.plot(j, nu, "x", color="tab:red", label="measured")
    axis.plot(j, rows["model (Hz)"], "o", color="tab:blue", markerfacecolor="none", label="eq. 8")
    axis.set(xlabel="mode number", ylabel="frequency (Hz)")
    error = axis.twinx()
    error.plot(j, rows["error"] * 1e3, "D", color="tab:orange", markersize=3, label="relative error")
    error.set(ylabel="relative error (1e-3)", ylim=(0, None))
    draw.legend(axis, error)


def _quality_factors(axis: Any, s: Speaking, rows: Mapping[str, Floats]) -> None:
    """Figure 3b."""
    axis.loglog(rows["measured (Hz)"], rows["measured Q"], "x", color="tab:red", label="measured")
    axis.loglog(rows["model (Hz)"], rows["model Q"], "o", color="tab:blue", markerfacecolor="none",
                label="eqs. 9 to 11")  # fmt: skip
    alone = replace(s, admittance=Admittance())
    many = int(TOP_HZ / s.fundamental)
    axis.loglog(
        modes.frequencies(alone, many), quality_factors(alone, many), "k--", label="without the neck's mobility"
    )
    axis.set(xlabel="frequency (Hz)", ylabel="Q")
    axis.legend(fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False)


def _frets(s: Speaking) -> Table:
    """Where the crowns are."""
    rows = [
        (fret, round(x * 1e3, 3), round(-height * 1e3, 4))
        for fret, x, height in zip(s.contact_fret, s.contact_position, s.contact_height, strict=True)
    ]
    return Table("frets", "Fret crowns", ("fret", "from the nut (mm)", "under the string (mm)"), rows)


CRITERION = 0.1
SECONDS = 0.12  # s, past the last of the usual contacts in case B
TIMES = (0.01, 0.03, 0.06, 0.1, SECONDS)  # s, up to which errors are told
RATES = (0.5e6, 1e6, 2e6, 4e6, 8e6, 16e6, 32e6)  # Hz, against the finest
FINEST_RATE = 64e6 - 64e6 % PAPER_RATE  # Hz, the most the engine takes, in whole steps a sample
MODES = (100, 200, 300, 400, 500, 600, 700, 800)  # against all
MODES_RATE = 8e6  # Hz
WHAT = {"b": "case B", "c": "case C", "modes": "case B at 8 MHz"}


def convergence_trials(duration: float | None) -> dict[str, Trial]:
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


def convergence_report(motions: Mapping[str, Solved]) -> Findings:
    """Errors against the finest, as curves and tables."""
    found = Findings()
    drawn = figure(11, 7)
    axes = drawn.subplots(2, 2)
    for kind, column, name in (("b", 0, "rates-b"), ("c", 0, "rates-c"), ("modes", 1, "modes")):
        values = MODES if kind == "modes" else tuple(rate / 1e6 for rate in RATES)
        solved = [motions[f"{kind} {value:g}"] for value in values]
        u, nu = zip(*(errors(one, motions[kind]) for one in solved), strict=True)
        label = "modes" if kind == "modes" else "contact rate (MHz)"
        for axis, told in zip(axes[:, column], ([e[-1] for e in u], nu), strict=True):
            axis.loglog(values, told, marker="o", label=WHAT[kind])
            axis.set(xlabel=label)
            axis.set_xticks(values, [f"{v:g}" for v in values])
            axis.minorticks_off()
            axis.legend(fontsize="small")
        against = f"all {motions[kind].trial.modes} modes" if kind == "modes" else f"{FINEST_RATE / 1e6:g} MHz"
        times = times_of(motions[kind])
        columns = label, *(f"error of u up to {t:g} s" for t in times), "median error of nu_c", "contacts"
        rows = [(v, *map(float, e), n, one.motion.contact_step.size)
                for v, e, n, one in zip(values, u, nu, solved, strict=True)]  # fmt: skip
        found.tables.append(Table(name, f"{WHAT[kind].capitalize()} against {against}", columns, rows))
        found.numbers[name] = {"values": values, "error_of_u": [e[-1] for e in u], "median_error_of_nu_c": nu}
        found.arrays |= {
            f"{name}_values": np.asarray(values, np.float64), f"{name}_errors_of_u": np.array(u),
            f"{name}_errors_until_s": np.asarray(times),
        }  # fmt: skip
    found.pictures.append(_finished(drawn, axes, motions["b"].trial.duration))
    return found


def errors(solved: Solved, finest: Solved) -> tuple[Floats, float]:
    """Of u up to each of `times_of`, and the median over the frames of eq. 14."""
    u, exact = solved.motion.displacement_m, finest.motion.displacement_m
    ends = [round(t * solved.trial.output_rate) + 1 for t in times_of(finest)]
    nu, true = (characteristic(solved.trial, m)[1] for m in (u, exact))
    of_u = [np.linalg.norm((u - exact)[:n]) / np.linalg.norm(exact[:n]) for n in ends]
    return np.array(of_u), float(np.median(np.abs(nu - true) / true))


def times_of(solved: Solved) -> list[float]:
    """Those of `TIMES` that a motion lasts, s."""
    return [t for t in TIMES if t <= solved.trial.duration]


def _finished(drawn: Any, axes: Any, seconds: float) -> Picture:
    """What is common to the panels."""
    for above, below in axes.T:
        above.axhline(CRITERION, color="grey", linestyle="--", linewidth=0.8)
        above.set_ylabel("relative error of u")
        below.set_ylabel("median error of nu_c")
    caption = f"Errors against the finest solution in the first {seconds:g} s; dashed: the paper's criterion, 0.1"
    return Picture("convergence", caption, drawn)
