"""The result of identification as text, CSV and JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

import numpy as np

from livebass.lab.analysis.motion import t60
from livebass.lab.identification.across import Across, Own
from livebass.lab.identification.fit import FEW, NeckFit
from livebass.lab.identification.lines import Line
from livebass.lab.identification.onset import Onset
from livebass.lab.identification.partials import Found
from livebass.lab.identification.result import Identified
from livebass.model.neck import Resonance
from livebass.report.text import columns, csv_text, json_text, plain
from livebass.rows.units import cents, note_name

DOUBLES = (  # of the fields of a Double
    "partial", "frequency_hz", "detuning", "damping_per_s", "conductance_m_per_s_per_n", "susceptance_m_per_s_per_n",
)  # fmt: skip
COLUMNS = (
    "partial", "frequency_hz", "frequency_u95_hz", "damping_per_s", "damping_u95_per_s", "q", "t60_s", "level_db",
    "takes", "law_frequency_hz", "u_frequency_hz", "u_damping_per_s", "u_t60_s", "v_frequency_hz", "v_damping_per_s",
    "v_t60_s", "v_over_u_db",
)  # fmt: skip


def rows(result: Identified) -> list[dict[str, float | None]]:
    """Returns a row for each partial, by `COLUMNS`; None is no value. u95: expanded uncertainty, 95 %."""
    law = result.law.frequency(np.array([p.number for p in result.partials]))
    return [
        dict(zip(COLUMNS, plain(_row(p, float(nu))), strict=True)) for p, nu in zip(result.partials, law, strict=True)
    ]


def _row(p: Found, law: float) -> tuple[float, ...]:
    q = math.pi * p.frequency / p.damping  # section 2.2
    v = p.v or Line(math.nan, math.nan, math.nan)
    return (
        p.number, p.frequency, p.frequency_u, p.damping, p.damping_u, q, p.t60, p.level_db, p.takes, law,
        p.u.frequency, p.u.damping, float(t60(p.u.damping)), v.frequency, v.damping, float(t60(v.damping)),
        20 * math.log10(v.amplitude / p.u.amplitude),
    )  # fmt: skip


def partials_csv(result: Identified) -> str:
    """Returns the partials as comma-separated values with a header."""
    return csv_text(COLUMNS, ([None if v is None else f"{v:.9g}" for v in row.values()] for row in rows(result)))


def identified_json(result: Identified, resonances: Sequence[Resonance] = ()) -> str:
    """Returns everything as JSON; keys carry their units."""
    s, law = result.string, result.law
    data = {
        "string": s.name,
        "open_note": note_name(s.open_note),
        "f0_hz": law.fundamental,
        "inharmonicity": law.inharmonicity,
        "stiffness_law": law.stiffness_law,
        "law_deviation": law.deviation,
        "law_from_partial": law.first,
        "law_misfit": law.misfit,
        "other_law_misfit": result.other.misfit,
        "tension_n": s.tension,
        "linear_density_kg_per_m": s.linear_density,
        "diameter_m": s.diameter,
        "viscoelastic_angle": s.viscoelastic_angle,
        "thermoelastic": s.thermoelastic,
        "conductance": [{"frequency_hz": nu, "conductance_m_per_s_per_n": y} for nu, y in result.conductance],
        "resonances": [{"frequency_hz": r.frequency, "q": r.quality, "mass_kg": r.mass} for r in resonances],
        "onset": _onset_data(result.onset) if result.onset else None,
        "across": _across_data(result.across, result.own) if result.across else None,
        "glides": [
            [{"part": part, "time_s": time} for part, time in glide.parts] if glide else [] for glide in result.glides
        ],
        "missing_partials": list(result.missing),
        "rejected_takes": result.rejected,
        "doubts": list(result.doubts),
        "takes": [{"file": t.name, "start_s": t.start_s, "duration_s": t.duration_s} for t in result.takes],
        "partials": rows(result),
    }
    return json_text(data)


def _onset_data(found: Onset) -> dict[str, Any]:
    """Pluck, pickups and tone, for JSON."""
    return {
        "pluck_from_saddle_m": found.place,
        "rounding_m": found.rounding,
        "release_s": found.release,
        "pickups": [{"position_m": p.position, "level": p.level} for p in found.pickups],
        "tone": found.tone,
        "misfit_db": found.misfit,
        "preset_misfit_db": found.before,
        "doubts": list(found.doubts),
    }


def _across_data(v: Across, own: Own | None) -> dict[str, Any]:
    """Returns the law of v for JSON: v minus u in each key, and the keys of a preset."""
    return {
        "detuning": v.detuning,
        "detuning_spread": v.detuning_spread,
        "damping_per_s": v.damping,
        "damping_spread_per_s": v.damping_spread,
        "stiffness_across": own.stiffness if own else None,
        "longer_across_m": own.longer if own else None,
        "misfit": own.misfit if own else None,
        "partials": [dict(zip(DOUBLES, astuple(double), strict=True)) for double in v.partials],
    }


def table(result: Identified) -> str:
    """Returns the partials and their laws as text."""
    several = len(result.takes) > 1
    shown = [("partial", "Hz", "+-", "1/s", "+-", "T60 s", "dB", "off law", *(["takes"] if several else []))]
    beside = ["its two lines"]
    for row, p in zip(rows(result), result.partials, strict=True):
        off = 1e6 * (p.frequency / (row["law_frequency_hz"] or math.nan) - 1)
        shown.append(
            (
                str(p.number), f"{p.frequency:.4f}", f"{p.frequency_u:.2g}", f"{p.damping:.4g}", f"{p.damping_u:.2g}",
                f"{p.t60:.3g}", f"{p.level_db:.1f}", f"{off:+.0f} ppm", *([str(p.takes)] if several else []),
            )
        )  # fmt: skip
        beside.append("" if p.v is None else f"u {_line(p.u)}; v {_line(p.v)}")
    lines = [f"{line}  {twin}".rstrip() for line, twin in zip(columns(shown, left=0), beside, strict=True)]
    s = result.string
    lines += [
        "+-: 95 %, " + ("scatter over the takes" if several else "from the noise in this one take"),
        f"f0 {result.law.fundamental:.4f} Hz, B {s.inharmonicity:.3g}, from partial {result.law.first} on, "
        f"to {1e6 * result.law.deviation:.0f} ppm; tension {s.tension:.1f} N at {s.linear_density * 1e3:.4g} g/m",
        _which_law(result),
        f"losses: air as diameter {s.diameter * 1e3:.3g} mm, viscoelastic angle {s.viscoelastic_angle:.3g}, "
        f"thermoelastic {s.thermoelastic:.2g}, " + _neck(result),
    ]
    lines += _motion(result)
    if result.missing:
        lines.append(f"not measured: {', '.join(map(str, result.missing))}; the preset takes them from the laws")
    choices = result.onset.doubts if result.onset else ()
    lines += [f"doubt: {doubt}" for doubt in (*result.doubts, *choices)]
    return "\n".join(lines) + "\n"


def _onset(found: Onset) -> str:
    """Describes where the string was plucked and heard, and how well that fits the levels."""
    pickups = ", ".join(f"{p.position * 1e3:.0f} mm (level {p.level:.2f})" for p in found.pickups)
    return (
        f"plucked {found.place * 1e3:.0f} mm from the saddle, finger {found.rounding * 1e3:.2g} mm, let go in "
        f"{found.release * 1e6:.0f} us; pickups at {pickups}; tone {found.tone:.2f}: the levels are "
        f"{found.misfit:.1f} dB off, {found.before:.1f} dB by the preset"
    )


def _line(line: Line) -> str:
    return f"{line.frequency:.3f} Hz, {float(t60(line.damping)):.3g} s"


def _motion(result: Identified) -> list[str]:
    """Describes the takes' initial sharpness, and v against u."""
    lines = []
    sharp = [glide.cents for glide in result.glides if glide]
    if sharp:
        of = f"{len(sharp)} of {len(result.glides)} takes begin" if len(result.glides) > 1 else "the note begins"
        lines.append(f"{of} {max(sharp):.1f} cents sharp, all partials alike, as its tension falls: taken out")
    if result.onset is not None:
        lines.append(_onset(result.onset))
    if (v := result.across) is not None:
        lines.append(
            f"{len(v.partials)} partials are two lines: v, across the neck, is {cents(1 + v.detuning):+.2f} cents "
            f"(+- {cents(1 + v.detuning_spread):.2f}) off u, and loses {-v.damping:.3g} /s "
            f"(+- {v.damping_spread:.2g}) less, medians; T60 is that heard of both"
        )
        lines.append(_own(result.own))
    return lines


def _own(own: Own | None) -> str:
    """Describes the law of v for the preset."""
    if own is None:
        return "v of its own: these lines tell no law, or v is not heard; the preset keeps what it has"
    return (
        f"v of its own: neck {own.stiffness:.3g} times as stiff, string {own.longer * 1e3:+.2f} mm longer across; that "
        f"leaves {100 * own.misfit:.0f} % of detunings and dampings unexplained"
    )


def neck_table(fit: NeckFit) -> str:
    """Returns the resonances, and how well they fit the partials, as text."""
    cells = [(f"{r.frequency:.2f}", f"{r.quality:.1f}", f"{r.mass:.3g}") for r in fit.resonances]
    lines = columns([("neck Hz", "Q", "kg"), *cells], left=0)
    lines.append(
        f"these resonances meet the dampings to {100 * fit.deviation:.1f} % rms; with them the partials lie "
        f"{1e6 * fit.left:.0f} ppm off their law, without {1e6 * fit.scatter:.0f} ppm"
    )
    if fit.below:
        numbers = ", ".join(map(str, fit.below))
        lines.append(f"partials damped less than by the laws of the string alone, which no neck can do: {numbers}")
    return "\n".join(lines) + "\n"


def _which_law(result: Identified) -> str:
    """Names the chosen law of partials, and the distance of all partials from it and from the other."""
    better, other = result.law, result.other
    if len(result.partials) <= FEW:
        return f"law of partials: {better.stiffness_law}, as in the preset, {len(result.partials)} partials do not tell"
    of = f"{1e6 * better.misfit:.0f} ppm off on average, by {other.stiffness_law} {1e6 * other.misfit:.0f}"
    return f"law of partials: {better.stiffness_law}, all partials {of}"


def _neck(result: Identified) -> str:
    if not result.conductance:
        return "nothing left for the neck"
    nu, maximum = max(result.conductance, key=lambda pair: pair[1])
    return f"the neck takes most at {nu:.0f} Hz, {maximum * 1e3:.3g} mm/s/N"
