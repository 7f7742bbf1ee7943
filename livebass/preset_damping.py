"""Whether every mode of a string can ring, and if not, what in the preset keeps it from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from livebass import modes
from livebass.instrument import MOST_DETUNING, Neck, String, speaking
from livebass.quality import MOST_MODES
from livebass.units import DIMENSIONS, format_quantity

MOST_DAMPING = 0.999  # of critical
TABLE = {"conductance_values": 1, "susceptance_values": 2}  # and their columns
KEYS = (
    "extra_damping", "extra_damping_slope", "viscoelastic_angle", "thermoelastic", *TABLE, "resonance_masses",
    "measured_dampings",
)  # fmt: skip


@dataclass(frozen=True)
class Overdamped:
    """A mode damped beyond `MOST_DAMPING` or drawn aside by the neck beyond `MOST_DETUNING`.

    `key` of the preset takes the largest part in it.
    """

    fret: int
    mode: int
    detuned: bool  # drawn aside, not damped
    key: str
    item: int  # of `key`, from 1; 0 where it has none, or all count
    value: float  # of the key, SI; of its item; the greatest for conductance_values and susceptance_values
    allowed: float  # with all else as it is, at most, or for resonance_masses at least; 0: that key alone cannot help

    def why(self, kind: str) -> str:
        """What it does, and what would be allowed; `kind` of the key, a dimension or not."""
        item = f"item {self.item}: " if self.item else ""
        verb, end = ("draws", "aside by more than 5 %") if self.detuned else ("damps", "beyond critical")
        heavier = self.key == "resonance_masses"
        if self.allowed == 0:
            rest = f"is {'more' if heavier else 'less'}, and of the others too"
        else:
            # three digits, rounded to the safe side: what a message allows must be allowed
            digit = 10.0 ** (math.floor(math.log10(self.allowed)) - 2)
            value = digit * (math.ceil if heavier else math.floor)(self.allowed / digit)
            shown = format_quantity(value, kind) if kind in DIMENSIONS else f"{value:.4g}"
            rest = f"{'from' if heavier else 'up to'} {shown} with all else as it is"
        return f"{item}{verb} mode {self.mode} at fret {self.fret} {end}; allowed {rest}"


def overdamped(string: String, neck: Neck) -> Overdamped | None:
    """The first mode that is damped or drawn aside too much, at the first fret there is one."""
    found = _first(string, neck)
    if found is None:
        return None
    fret, j, detuned = found
    keys = [*TABLE, "resonance_masses"] if detuned else KEYS
    items = {key: _item(string, neck, key, fret, j) for key in keys}
    parts = {key: _part(string, neck, key, fret, j, items[key], detuned) for key in keys}
    key = max(parts, key=parts.__getitem__)
    item, low, high = items[key], 0.0, 1.0  # of the value; the tuning depends on the mute, so this is no straight line
    if _first(*_scaled(string, neck, key, item, low)) is None:
        for _ in range(20):
            middle = (low + high) / 2
            if _first(*_scaled(string, neck, key, item, middle)) is None:
                low = middle
            else:
                high = middle
    value = _value(string, neck, key, item)
    allowed = (value / low if low else 0.0) if key == "resonance_masses" else low * value
    return Overdamped(fret, j + 1, detuned, key, item, value, allowed)


def _first(string: String, neck: Neck) -> tuple[int, int, bool] | None:
    """(fret, index of the mode, whether it is drawn aside rather than damped)."""
    for fret in range(len(neck.fret_positions) + 1):
        s = speaking(string, neck, fret)
        count = min(s.grid_points - 1, MOST_MODES)
        aside = np.abs(modes.neck_detuning(s, count)) > MOST_DETUNING if s.admittance else np.zeros(count, bool)
        over = aside | (modes.dampings(s, count) > MOST_DAMPING * 2 * math.pi * modes.frequencies(s, count))
        if over.any():
            j = int(np.argmax(over))
            return fret, j, bool(aside[j])
    return None


def _item(string: String, neck: Neck, key: str, fret: int, j: int) -> int:
    """Which item of `key` matters to mode j + 1: the resonance that gives way most, the mode itself."""
    if key == "resonance_masses" and neck.admittance.resonances:
        nu = modes.frequencies(speaking(string, neck, fret), j + 1)[j]
        each = [abs(replace(neck.admittance, resonances=(r,)).at(nu)) for r in neck.admittance.resonances]
        return int(np.argmax(each)) + 1
    return j + 1 if key == "measured_dampings" else 0


def _part(string: String, neck: Neck, key: str, fret: int, j: int, item: int, detuned: bool) -> float:
    """What `key` adds to the damping of mode j + 1, 1/s, or to what draws it aside."""

    def amount(by: float) -> float:
        s = speaking(*_scaled(string, neck, key, item, by), fret)
        return float(abs(modes.neck_detuning(s, j + 1)[j]) if detuned else modes.dampings(s, j + 1)[j])

    return amount(1.0) - amount(0.0)


def _value(string: String, neck: Neck, key: str, item: int) -> float:
    if key in TABLE:
        return max((abs(row[TABLE[key]]) for row in neck.admittance.table), default=0.0)
    if key == "resonance_masses":
        return neck.admittance.resonances[item - 1].mass if item else 0.0
    if key == "measured_dampings":
        return string.measured_dampings[item - 1] if item <= len(string.measured_dampings) else 0.0
    return float(getattr(string, key))


def _scaled(string: String, neck: Neck, key: str, item: int, by: float) -> tuple[String, Neck]:
    """The same with the value of `key` (its item) times `by`; a mass divided by it."""
    y = neck.admittance
    if key in TABLE:
        real, imaginary = (by if TABLE[key] == column else 1.0 for column in (1, 2))
        rows = tuple((nu, g * real, b * imaginary) for nu, g, b in y.table)
        return string, replace(neck, admittance=replace(y, table=rows))
    if key == "resonance_masses":
        heavy = tuple(replace(r, mass=r.mass / by if by else math.inf) if k == item else r
                      for k, r in enumerate(y.resonances, 1))  # fmt: skip
        return string, replace(neck, admittance=replace(y, resonances=heavy))
    if key == "measured_dampings":
        known = string.measured_dampings
        known = (*known[: item - 1], *(x * by for x in known[item - 1 : item]), *known[item:])
        return replace(string, measured_dampings=known), neck
    changed: dict[str, Any] = {key: getattr(string, key) * by}
    return replace(string, **changed), neck
