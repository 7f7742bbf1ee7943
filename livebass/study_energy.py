"""Case B from within: the string's shape over the neck (figure 8), its energy, that of its modes, their T60."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from livebass import modal_motion, modes, motion_analysis
from livebass import study_draw as draw
from livebass import study_measure as measure
from livebass.motion import Floats, Trial
from livebass.paper_cases import CASES
from livebass.study_cases import case_findings
from livebass.study_parts import Findings, Picture, Solved, Table, curve

SHAPE_TIMES = (0.0, 3.5e-3, 3.9e-3, 4.1e-3, 4.3e-3, 4.7e-3)  # s, of figure 8
SHAPE_RATE = 50_000  # Hz, of which they are whole samples
SHOWN_MODES = (1, 2, 3, 5, 10, 20, 45)  # 45: around the 4.5 kHz that section 4.1.1 names
T60_MODES = 60  # drawn
DECADES = 10  # of energy, in which a decay is fitted


def trials(duration: float | None) -> dict[str, Trial]:
    """Case B, and its first 5 ms with whole samples at the times of figure 8."""
    short = replace(CASES["b"], duration=SHAPE_TIMES[-1]).trial(SHAPE_RATE)
    looked = motion_analysis.looked_at(short, 1, SHAPE_TIMES)
    return {"b": measure.case_trial("b", duration), "shapes": replace(short, states=looked)}


def report(motions: Mapping[str, Solved]) -> Findings:
    """All of case B."""
    solved = motions["b"]
    found = case_findings("b", "Case B", solved)
    _shapes(found, motions["shapes"])
    time_s, each, total = motion_analysis.energies(solved.trial, solved.motion)
    found.arrays |= {"energy_time_s": time_s, "energy_j": total, "modal_energies_j": each}
    found.tables.append(curve("energy", "Energy of the string and its contacts", time_s=time_s, energy_j=total))
    found.numbers["energy_j"] = {"initial": float(total[0]), "final": float(total[-1])}
    found.pictures.append(_energies(time_s, each, total))
    _decays(found, solved, time_s, each)
    return found


def _shapes(found: Findings, solved: Solved) -> None:
    """Figure 8."""
    s = solved.speaking
    _, x, (shapes,) = motion_analysis.shapes(solved.trial, solved.motion, SHAPE_TIMES)
    drawn = draw.figure(11, 5.5)
    axes = np.ravel(drawn.subplots(2, 3, sharex=True, sharey=True))
    for axis, t, shape in zip(axes, SHAPE_TIMES, shapes, strict=True):
        draw.neck_panel(axis, s, [shape])
        axis.set(title=f"t = {t * 1e3:g} ms", ylim=(-4.5, 4.5))
    caption = "The string over the neck during the first set of contacts (figure 8)"
    found.pictures.append(Picture("shapes", caption, drawn))
    columns = {f"u_m_at_{t * 1e3:g}_ms": shape for t, shape in zip(SHAPE_TIMES, shapes, strict=True)}
    found.tables.append(curve("shapes", "The string's shape", x_m=x, **columns))
    found.arrays |= {"shape_time_s": np.asarray(SHAPE_TIMES), "shape_x_m": x, "shapes_m": shapes}


def _energies(time_s: Floats, each: Floats, total: Floats) -> Picture:
    """Total at the left, modes at the right."""
    drawn = draw.figure(11, 4.5)
    left, right = drawn.subplots(1, 2)
    left.semilogy(time_s, total, color="black")
    left.set(xlabel="time (s)", ylabel="energy of string and contacts (J)")
    for k, mode in enumerate(SHOWN_MODES):
        right.semilogy(time_s, np.maximum(each[:, mode - 1], 1e-30), color=f"C{k}", label=f"mode {mode}", linewidth=1)
    right.set(xlabel="time (s)", ylabel="energy of a mode (J)")
    right.set_ylim(float(total[0]) * 1e-9, float(total[0]) * 2)
    right.legend(fontsize="small", ncols=2)
    return Picture("energy", "Energy over time: of all, and of some modes, which contacts feed", drawn)


def _decays(found: Findings, solved: Solved, time_s: Floats, each: Floats) -> None:
    """T60 of each mode: as its damping says, and as its energy fell after the last contact."""
    s, count = solved.speaking, solved.trial.modes
    sigma = modes.dampings(s, count)
    model = modal_motion.t60(sigma)
    contacts = solved.contacts.time_s
    free = time_s > (contacts[-1] if contacts.size else 0.0)
    fitted = np.full(count, np.nan)
    if np.count_nonzero(free) > 2:
        rest = each[free]
        rest = np.where(rest > rest.max() * 10.0**-DECADES, rest, 0.0)  # the rest is rounding, or a mode laid to rest
        rates = modal_motion.decay_rates(time_s[free], rest)
        fitted = np.where(np.isnan(rates), np.nan, modal_motion.t60(rates))
    drawn = draw.figure(9, 4.5)
    axis = drawn.subplots()
    j = np.arange(1, count + 1)
    shown = slice(0, T60_MODES)
    axis.semilogy(j[shown], model[shown], "o", markerfacecolor="none", label="3 ln 10 / sigma", color="tab:blue")
    axis.semilogy(j[shown], fitted[shown], "x", label="from its energy after the last contact", color="tab:red")
    axis.set(xlabel="mode number", ylabel="T60 (s)")
    axis.legend()
    found.pictures.append(Picture("t60", "Time in which each mode falls by 60 dB", drawn))
    nu = modes.frequencies(s, count)
    columns = {"frequency_hz": nu, "damping_per_s": sigma, "t60_s": model, "t60_from_energy_s": fitted}
    found.tables.append(curve("t60", "T60 by mode", mode=j, **columns))
    first = [tuple(float(column[k]) for column in (j, nu, model, fitted)) for k in range(10)]
    heads = "mode", "frequency (Hz)", "T60 (s)", "from its energy (s)"
    found.tables.append(Table("t60-first-modes", "T60 of the first ten modes", heads, first))
    found.arrays |= {"t60_s": model, "t60_from_energy_s": fitted}
