"""Figures 1 and 3: the neck under the string at rest; frequencies and quality factors of the string's modes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from livebass.lab.analysis.motion import Solved
from livebass.lab.paper.claims.sections_2_3 import LAW, NU, SIGMA
from livebass.lab.paper.figures import panels
from livebass.lab.paper.figures.study import Findings, Picture, Table
from livebass.model.instrument import Speaking
from livebass.model.modes import dampings, frequencies
from livebass.model.neck import Admittance
from livebass.report.picture import figure
from livebass.rows.arrays import Floats

TOP_HZ = 8000.0  # of figure 3c


def linear(motions: Mapping[str, Solved]) -> Findings:
    """The study `linear`: figures 1 and 3 and the data in them. Nothing moves."""
    s, count, measured, measured_q = LAW, NU.size, NU, math.pi * NU / SIGMA
    nu, q = frequencies(s, count), quality_factors(s, count)
    without = quality_factors(replace(s, admittance=Admittance()), count)
    rows = {
        "mode": np.arange(1, count + 1), "measured (Hz)": measured, "model (Hz)": nu,
        "error": np.abs(nu - measured) / measured, "measured Q": measured_q, "model Q": q,
        "error of Q": np.abs(q - measured_q) / measured_q, "Q without the neck": without,
    }  # fmt: skip
    found = Findings(
        pictures=[figure_1(s), figure_3(s, rows)],
        tables=[
            Table("modes", "The first modes: measured, and by eqs. 8 to 11", tuple(rows),
                  list(zip(*(column.tolist() for column in rows.values()), strict=True))),
            _fret_table(s),
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
    """Q_j = pi nu_j / sigma_j of the first `count` modes, (count,) (section 2.2)."""
    return math.pi * frequencies(s, count) / dampings(s, count)


def figure_1(s: Speaking) -> Picture:
    """Figure 1: fret crowns under the string at rest."""
    drawn = figure(9, 3.5)
    axis = drawn.subplots()
    panels.neck(axis, s)
    for k in (0, 11, len(s.contact_fret) - 1):
        if k < len(s.contact_fret):
            place = s.contact_position[k], s.contact_height[k] * 1e3
            axis.annotate(f"fret {s.contact_fret[k]}", place, xytext=(0, 6), textcoords="offset points",
                          fontsize="small", ha="center")  # fmt: skip
    axis.set_ylim(-5, 5)
    return Picture("neck", "Fret crowns under the string at rest (figure 1)", drawn)


def figure_3(s: Speaking, rows: Mapping[str, Floats]) -> Picture:
    """Figure 3: modes measured and modelled; 3c, the conductance of the neck, if the preset has one."""
    drawn = figure(11, 7)
    fine = np.linspace(20.0, TOP_HZ, 4000)
    conductance = s.admittance.at(fine).real
    rows_of_axes = [["frequency", "q"], *([["conductance"] * 2] if conductance.any() else [])]
    axes = drawn.subplot_mosaic(rows_of_axes, height_ratios=(3, 2)[: len(rows_of_axes)])
    _figure_3a(axes["frequency"], rows)
    _figure_3b(axes["q"], s, rows)
    if conductance.any():
        axes["conductance"].plot(fine, conductance, color="tab:blue", linewidth=0.9)
        axes["conductance"].set(xlabel="frequency (Hz)", ylabel="conductance (m/s/N)", xlim=(0, TOP_HZ))
    neck = ", conductance of the neck" if conductance.any() else "; the preset has no mobility of the neck"
    return Picture("modes", f"Modes measured and by the model: frequencies, quality factors{neck} (figure 3)", drawn)


def _figure_3a(axis: Any, rows: Mapping[str, Floats]) -> None:
    """Draw the frequencies of the modes, and the relative error of the model."""
    j, nu = rows["mode"], rows["measured (Hz)"]
    axis.plot(j, nu, "x", color="tab:red", label="measured")
    axis.plot(j, rows["model (Hz)"], "o", color="tab:blue", markerfacecolor="none", label="eq. 8")
    axis.set(xlabel="mode number", ylabel="frequency (Hz)")
    error = axis.twinx()
    error.plot(j, rows["error"] * 1e3, "D", color="tab:orange", markersize=3, label="relative error")
    error.set(ylabel="relative error (1e-3)", ylim=(0, None))
    panels.legend(axis, error)


def _figure_3b(axis: Any, s: Speaking, rows: Mapping[str, Floats]) -> None:
    """Draw the quality factors of the modes, with and without the neck's mobility."""
    axis.loglog(rows["measured (Hz)"], rows["measured Q"], "x", color="tab:red", label="measured")
    axis.loglog(rows["model (Hz)"], rows["model Q"], "o", color="tab:blue", markerfacecolor="none",
                label="eqs. 9 to 11")  # fmt: skip
    alone = replace(s, admittance=Admittance())
    many = int(TOP_HZ / s.fundamental)
    axis.loglog(frequencies(alone, many), quality_factors(alone, many), "k--", label="without the neck's mobility")
    axis.set(xlabel="frequency (Hz)", ylabel="Q")
    axis.legend(fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False)


def _fret_table(s: Speaking) -> Table:
    """The places of the fret crowns."""
    rows = [
        (fret, round(x * 1e3, 3), round(-height * 1e3, 4))
        for fret, x, height in zip(s.contact_fret, s.contact_position, s.contact_height, strict=True)
    ]
    return Table("frets", "Fret crowns", ("fret", "from the nut (mm)", "under the string (mm)"), rows)
