"""The neck's admittance of a preset: a measured table or resonances, for the open string.

What the string of a preset can touch: the crowns of its frets, a whole profile, or the bare board of a fretless.

Whether every mode of a string can ring, and if not, what in the preset keeps it from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from livebass.model import modes
from livebass.model.instrument import MOST_DETUNING, Neck, String, speaking
from livebass.model.neck import MOST_SHAPE, Admittance, Resonance, Surface, fretted_surface, height_at, wooden_surface
from livebass.model.quality import MOST_MODES
from livebass.units import DIMENSIONS, format_quantity

TABLE = {"conductance_frequencies", "conductance_values", "susceptance_values"}
RESONANCES = {"resonance_frequencies", "resonance_qualities", "resonance_masses", "resonance_shapes"}


class Misfit(ValueError):
    """Keys that do not go together: the one at fault, and why."""

    def __init__(self, key: str, why: str, *raw: object) -> None:
        super().__init__(f"{key}: {why}")
        self.key, self.why, self.raw = key, why, raw


def replaced(own: set[str]) -> set[str]:
    """Which of the shared neck's keys are void where the neck of one string has the keys `own`."""
    void: set[str] = set()
    for kind, other in ((TABLE, RESONANCES), (RESONANCES, TABLE)):
        if own & kind:
            void |= other
        if own & kind & {"conductance_frequencies", "resonance_frequencies"}:
            void |= kind
    return void


def neck_admittance(values: dict[str, Any]) -> Admittance:
    """What the checked values of a neck, in SI, say; nothing gives way where they say nothing. Raises Misfit."""
    if values.keys() & TABLE and values.keys() & RESONANCES:
        key = sorted(values.keys() & RESONANCES)[0]
        raise Misfit(key, "resonances are not allowed together with a table of conductances")
    nu, real = _columns(values, "conductance_frequencies", "conductance_values")
    imaginary = values.get("susceptance_values", (0.0,) * len(nu))
    _as_many("susceptance_values", imaginary, "conductance_frequencies", nu)
    hertz, quality = _columns(values, "resonance_frequencies", "resonance_qualities")
    _, mass = _columns(values, "resonance_frequencies", "resonance_masses")
    shapes = values.get("resonance_shapes", tuple(min(k, MOST_SHAPE) for k in range(1, len(hertz) + 1)))
    _as_many("resonance_shapes", shapes, "resonance_frequencies", hertz)
    resonances = tuple(Resonance(*row) for row in zip(hertz, quality, mass, shapes, strict=True))
    return Admittance(resonances, tuple(zip(nu, real, imaginary, strict=True)))


def _columns(values: dict[str, Any], first: str, second: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    a, b = values.get(first, ()), values.get(second, ())
    _as_many(second, b, first, a)
    return a, b


def _as_many(key: str, given: tuple[Any, ...], first: str, wanted: tuple[Any, ...]) -> None:
    if len(given) != len(wanted):
        raise Misfit(key, f"{len(given)} for {len(wanted)} {first}, must be as many")


BEYOND = 0.02  # m of wood after the last fret, where a preset does not say
PROFILE = {"profile_positions", "profile_heights"}
_NO_BOARD = ("lift", "fret_heights", "height_scale", "height_offset")
_GEOMETRY = ("action", "relief", "nut_height")

Numbers = tuple[float, ...]


def neck_surface(given: set[str], v: dict[str, Any], x: Numbers, h: Numbers) -> tuple[Numbers, Surface]:
    """Heights (m) of the places `x` (m) where notes are stopped, and the surface; none where only crowns are touched.

    given: keys that the file has; v: all values of the neck, checked, in SI; h: heights of the crowns. Raises Misfit.
    """
    kind = v["obstacle"]
    measured = _measured(v)
    _check(given, kind, measured)
    if kind == "frets":
        return h, ()
    end = _end(v, x, measured)
    if measured:
        if measured[0][0] > x[0]:
            why = f"must begin before the first place of a note, {_mm(x[0])}"
            raise Misfit("profile_positions", why, _mm(measured[0][0]))
        return (tuple(height_at(measured, place) for place in x) if kind == "board" else h), measured
    if kind == "board":
        return h, wooden_surface(x, h, end, bowed="fret_heights" not in given)
    return h, fretted_surface(x, h, v["fret_height"], end)


def _check(given: set[str], kind: str, measured: Surface) -> None:
    """Raises Misfit for a key that would mean nothing."""
    if kind == "frets" and (void := sorted(given & (PROFILE | {"board_end", "fret_height"}))):
        raise Misfit(void[0], "only where neck.obstacle is profile or board")
    if kind == "board" and (void := [k for k in (*_NO_BOARD, "fret_height") if k in given]):
        raise Misfit(void[0], "a board has no frets: neck.obstacle is board")
    if measured:
        if "board_end" in given:
            raise Misfit("board_end", "not together with a measured profile, which ends the board")
        if kind == "board" and (void := [k for k in _GEOMETRY if k in given]):
            raise Misfit(void[0], "not together with a measured profile")
        if kind == "profile" and "fret_heights" not in given:
            raise Misfit("fret_heights", "missing; a measured profile needs to know its crowns")


def _measured(v: dict[str, Any]) -> Surface:
    x, h = (v.get(f"profile_{k}", ()) for k in ("positions", "heights"))
    if len(x) != len(h) or len(x) == 1:
        raise Misfit("profile_heights", f"{len(h)} for {len(x)} profile_positions, must be as many, at least 2")
    return tuple(zip(x, h, strict=True))


def _end(v: dict[str, Any], x: Numbers, measured: Surface) -> float:
    """m from the nut."""
    length = v["scale_length"]
    end = measured[-1][0] if measured else v.get("board_end", min(x[-1] + BEYOND, 0.98 * length))
    if not x[-1] <= end < length:
        key = "profile_positions" if measured else "board_end"
        raise Misfit(key, f"the board ends from the last note's place, {_mm(x[-1])}, to below {_mm(length)}", _mm(end))
    return float(end)


def _mm(length: float) -> str:
    return format_quantity(length, "length", "mm")


MOST_DAMPING = 0.999  # of critical
COLUMN = {"conductance_values": 1, "susceptance_values": 2}  # and their columns
DAMPING_KEYS = (
    "extra_damping", "extra_damping_slope", "viscoelastic_angle", "thermoelastic", *COLUMN, "resonance_masses",
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
    keys = [*COLUMN, "resonance_masses"] if detuned else DAMPING_KEYS
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
    if key in COLUMN:
        return max((abs(row[COLUMN[key]]) for row in neck.admittance.table), default=0.0)
    if key == "resonance_masses":
        return neck.admittance.resonances[item - 1].mass if item else 0.0
    if key == "measured_dampings":
        return string.measured_dampings[item - 1] if item <= len(string.measured_dampings) else 0.0
    return float(getattr(string, key))


def _scaled(string: String, neck: Neck, key: str, item: int, by: float) -> tuple[String, Neck]:
    """The same with the value of `key` (its item) times `by`; a mass divided by it."""
    y = neck.admittance
    if key in COLUMN:
        real, imaginary = (by if COLUMN[key] == column else 1.0 for column in (1, 2))
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
