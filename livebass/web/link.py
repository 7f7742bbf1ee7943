"""Checks links to a page before it is made, by the rules of static/bench.js (`fromLink`) and static/app.js (cases)."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any
from urllib.parse import parse_qsl

from livebass.model.instrument import Instrument
from livebass.units import DIMENSIONS
from livebass.web.bench import UNITS, Source, bench
from livebass.web.export import shown_cases

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
SYMBOL = re.compile(r"([a-z_]+?)([1-9]\d?)?")
AS_IT_IS = {"gauge": 1.0, "tension": 1.0, "damping": 1.0, "mute": 0.0, "height": 0.0}  # of every bass


def check_link(link: str, basses: Mapping[str, Instrument], sources: Mapping[str, Source]) -> None:
    """Raises ValueError, one line, for a link that a page with `basses`, by short name, cannot follow.

    link: "case=b", "bass=slap&action=2", or a page's address with either behind its #.
    """
    said = parse_qsl(link.rpartition("#")[2], keep_blank_values=True)
    if not said:
        raise ValueError("allowed are case=b, or a link that the bench of a page copied")
    (key, name), *values = said
    if key == "case":
        cases = [case["symbol"] for short, bass in basses.items() for case in shown_cases(bass, sources.get(short))]
        if name not in cases:
            there = f"allowed are {', '.join(cases)}" if cases else "none of its basses has cases, as paper-g does"
            raise ValueError(f"the link names no case of this page: case={name[:20]}; {there}")
        return
    known = bench(basses[name], sources[name]) if key == "bass" and name in basses else None
    if known is None:
        raise ValueError(f"the link names no bass of this page that can be changed: {f'{key}={name}'[:40]}")
    frets = min(len(neck.fret_positions) for neck in basses[name].necks)
    controls = {control["symbol"]: control for control in known["controls"]}
    for symbol, value in values:
        kind, number = found.groups() if (found := SYMBOL.fullmatch(symbol)) else ("", None)
        lift = kind == "lift" and number is not None and int(number) <= frets
        control = controls.get("lift" if lift else symbol)
        if control is None or symbol == "lift":
            raise ValueError(f"the link changes what this bass does not have: {symbol[:40]}")
        least, most, unit = control["least"], control["most"], control["unit"]
        size = DIMENSIONS[UNITS[unit]].units[unit] if unit in UNITS else 1.0
        usual = float(f"{_usual(kind, int(number or 0), known) / size:.6g}")
        given = float(value) if NUMBER.fullmatch(value.strip()) else math.nan
        if not min(least, usual) <= given <= max(most, usual):
            raise ValueError(
                f"the link says {symbol} = {value[:20]}: allowed are {least:.6g} to {most:.6g} {unit}".rstrip()
            )


def _usual(kind: str, number: int, known: Mapping[str, Any]) -> float:
    """The preset's own value of a control, in SI; `kind` is its symbol without the number of a fret or pickup."""
    if kind in AS_IT_IS:
        return AS_IT_IS[kind]
    if kind == "lift":
        return float(known["neck"]["lift"].get(number, 0.0))
    if kind == "contact_loss":
        return float(known["contact"]["loss"][0])
    if kind in ("resonance", "resonance_mass"):
        resonance = known["resonance"]
        return float(resonance["frequencies" if kind == "resonance" else "masses"][resonance["lowest"]])
    if kind == "pickup":
        return float(known["pickups"][number - 1]["position"])
    if kind in ("tone", "cable"):
        return float(known["coil"]["tone" if kind == "tone" else "capacitance"])
    return float(known["player"][kind] if kind in known["player"] else known["neck"][kind][0])
