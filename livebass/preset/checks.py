"""Checks of a preset that involve several keys: the neck's admittance, its surface, and damping.

preset/keys.py has checked each value. `neck_admittance` and `neck_surface` raise `Conflict` for keys that do not go
together; `overdamped_mode` finds a mode that cannot ring and the key that causes it. preset/build.py turns both into
messages. `wolves` finds notes that no tuning brings to their pitch, which a bass may have.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.string import law
from livebass.kernels.string.note import MAX_DETUNING
from livebass.model import modes
from livebass.model.instrument import Instrument, Neck, Speaking, String, speaking
from livebass.model.neck import MAX_SHAPE, Admittance, Resonance, Surface, fretted_surface, height_at, wooden_surface
from livebass.model.quality import MAX_MODES
from livebass.rows.units import DIMENSIONS, format_quantity

TABLE_KEYS = {"conductance_frequencies", "conductance_values", "susceptance_values"}
RESONANCE_KEYS = {"resonance_frequencies", "resonance_qualities", "resonance_masses", "resonance_shapes"}
PROFILE_KEYS = {"profile_positions", "profile_heights"}
FRET_KEYS = ("lift", "fret_heights", "height_scale", "height_offset", "fret_height")  # without meaning for a bare board
HEIGHTS_BY_GEOMETRY = ("action", "relief", "nut_height")
COLUMNS = {"conductance_values": 1, "susceptance_values": 2}  # columns of Admittance.table
DAMPING_KEYS = (
    "extra_damping", "extra_damping_slope", "viscoelastic_angle", "thermoelastic", "relaxation", *COLUMNS,
    "resonance_masses", "measured_dampings", "stop_conductance",
)  # fmt: skip
BEYOND = 0.02  # m of board beyond the last fret, by default
MAX_DAMPING = 0.999  # of critical
WOLF = 1.0  # cents off its pitch from which a note is a wolf; all others are in tune to the last digits

Numbers = tuple[float, ...]


class Conflict(ValueError):
    """Keys that do not go together: the key at fault, why, and its value if the message shows it."""

    def __init__(self, key: str, why: str, *raw: object) -> None:
        super().__init__(f"{key}: {why}")
        self.key, self.why, self.raw = key, why, raw


def replaced_keys(own: set[str]) -> set[str]:
    """The shared neck's admittance keys that do not apply to a string whose own neck has the keys `own`."""
    void: set[str] = set()
    for kind, other in ((TABLE_KEYS, RESONANCE_KEYS), (RESONANCE_KEYS, TABLE_KEYS)):
        if own & kind:
            void |= other
        if own & kind & {"conductance_frequencies", "resonance_frequencies"}:
            void |= kind
    return void


def neck_admittance(values: dict[str, Any]) -> Admittance:
    """The admittance at the nut from a neck's checked values (SI); rigid if they give none. Raises Conflict."""
    if values.keys() & TABLE_KEYS and values.keys() & RESONANCE_KEYS:
        key = sorted(values.keys() & RESONANCE_KEYS)[0]
        raise Conflict(key, "resonances are not allowed together with a table of conductances")
    nu, real = _pair_up(values, "conductance_frequencies", "conductance_values")
    _, imaginary = _pair_up(values, "conductance_frequencies", "susceptance_values", (0.0,) * len(nu))
    hertz, quality = _pair_up(values, "resonance_frequencies", "resonance_qualities")
    _, mass = _pair_up(values, "resonance_frequencies", "resonance_masses")
    in_order = tuple(min(k, MAX_SHAPE) for k in range(1, len(hertz) + 1))
    _, shapes = _pair_up(values, "resonance_frequencies", "resonance_shapes", in_order)
    resonances = tuple(Resonance(*row) for row in zip(hertz, quality, mass, shapes, strict=True))
    return Admittance(resonances, tuple(zip(nu, real, imaginary, strict=True)))


def _pair_up(
    values: dict[str, Any], first: str, second: str, default: Numbers = ()
) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """The lists of two keys; a missing second one is `default`. Raises Conflict if one is longer."""
    a, b = values.get(first, ()), values.get(second, default)
    if len(a) != len(b):
        raise Conflict(second, f"{len(b)} for {len(a)} {first}; there must be one for each")
    return a, b


def neck_surface(given: set[str], v: dict[str, Any], x: Numbers, h: Numbers) -> tuple[Numbers, Surface]:
    """Heights (m) at the places `x` (m from the nut) of stopped notes, and the surface of the neck.

    The surface is empty if the string can only touch crowns. given: the keys in the file; v: all values of the neck,
    checked, in SI; h: heights of the crowns, (len(x),), m. Raises Conflict.
    """
    kind = v["obstacle"]
    measured = _measured_profile(v)
    _check_surface_keys(given, kind, measured)
    if kind == "frets":
        return h, ()
    end = _board_end(v, x, measured)
    if measured:
        if measured[0][0] > x[0]:
            why = f"must begin before the place of the first note, {mm(x[0])}"
            raise Conflict("profile_positions", why, mm(measured[0][0]))
        return (tuple(height_at(measured, place) for place in x) if kind == "board" else h), measured
    if kind == "board":
        return h, wooden_surface(x, h, end, bowed="fret_heights" not in given)
    return h, fretted_surface(x, h, v["fret_height"], end)


def _check_surface_keys(given: set[str], kind: str, measured: Surface) -> None:
    """Raises Conflict for a key without effect, and for a missing one."""
    if kind == "frets" and (void := sorted(given & (PROFILE_KEYS | {"board_end", "fret_height"}))):
        raise Conflict(void[0], "allowed only if neck.obstacle is profile or board")
    if kind == "board" and (void := [k for k in FRET_KEYS if k in given]):
        raise Conflict(void[0], "not allowed if neck.obstacle is board: a board has no frets")
    if measured:
        if "board_end" in given:
            raise Conflict("board_end", "not allowed together with a measured profile, whose end is that of the board")
        if kind == "board" and (void := [k for k in HEIGHTS_BY_GEOMETRY if k in given]):
            raise Conflict(void[0], "not allowed together with a measured profile")
        if kind == "profile" and "fret_heights" not in given:
            raise Conflict("fret_heights", "missing; a measured profile needs the heights of its crowns")


def _measured_profile(v: dict[str, Any]) -> Surface:
    x, h = _pair_up(v, "profile_positions", "profile_heights")
    if len(x) == 1:
        raise Conflict("profile_positions", "1 place; a profile needs at least 2")
    return tuple(zip(x, h, strict=True))


def _board_end(v: dict[str, Any], x: Numbers, measured: Surface) -> float:
    """End of the board, m from the nut: beyond the last note's place in `x`, and before the saddle."""
    length = v["scale_length"]
    end = measured[-1][0] if measured else v.get("board_end", min(x[-1] + BEYOND, 0.98 * length))
    if not x[-1] <= end < length:
        key = "profile_positions" if measured else "board_end"
        why = f"the board must end beyond the last note's place, {mm(x[-1])}, and before the saddle, {mm(length)}"
        raise Conflict(key, why, mm(end))
    return float(end)


def mm(length: float) -> str:
    """A length (m) in mm for a message."""
    return format_quantity(length, "length", "mm")


@dataclass(frozen=True)
class Overdamped:
    """A mode that cannot ring, and the preset key that contributes most.

    The mode is damped beyond `MAX_DAMPING`, or, in u, shifted by the neck beyond `MAX_DETUNING`.
    """

    fret: int
    where: str  # its words: "at fret 5", or the place on a board without frets
    mode: int
    detuned: bool  # shifted, not damped
    across: bool  # a mode of v, which has a law of its own
    key: str
    item: int  # in the key's list, from 1; 0: the key is not a list, or all items count
    value: float  # of the key or its item, SI; the greatest of conductance_values and susceptance_values
    allowed: float  # all else equal: at most, or at least for resonance_masses; 0: no value of this key helps

    def why(self, kind: str) -> str:
        """Describes the key's effect on the mode, and the allowed value; kind: of the key, as in keys.py."""
        item = f"item {self.item}: " if self.item else ""
        verb, how_far = ("shifts", "by more than 5 %") if self.detuned else ("damps", "beyond critical")
        heavier = self.key == "resonance_masses"
        if self.allowed == 0:
            cure = f"{'raising' if heavier else 'lowering'} this key alone is not enough"
        else:
            # Three digits, rounded to the safe side: a value in the message must be allowed.
            digit = 10.0 ** (math.floor(math.log10(self.allowed)) - 2)
            value = digit * (math.ceil if heavier else math.floor)(self.allowed / digit)
            shown = format_quantity(value, kind) if kind in DIMENSIONS else f"{value:.4g}"
            cure = f"allowed {'from' if heavier else 'up to'} {shown} with all else as it is"
        whose = " of the motion across" if self.across else ""
        return f"{item}{verb} mode {self.mode}{whose} {self.where} {how_far}; {cure}"


def overdamped_mode(string: String, neck: Neck) -> Overdamped | None:
    """The first mode that is damped or shifted too much, at the first fret that has one; None if every mode rings."""
    found = _first_fault(string, neck)
    if found is None:
        return None
    fret, j, detuned, across = found
    keys = [*COLUMNS, "resonance_masses"] if detuned else DAMPING_KEYS
    items = {key: _item(string, neck, key, fret, j) for key in keys}
    parts = {key: _part(string, neck, key, fret, j, items[key], detuned, across) for key in keys}
    key = max(parts, key=parts.__getitem__)
    # Bisection, as damping is not linear in the value: the tuning depends on the mute.
    item, low, high = items[key], 0.0, 1.0  # of the value
    if _first_fault(*_scale_value(string, neck, key, item, low)) is None:
        for _ in range(20):
            middle = (low + high) / 2
            if _first_fault(*_scale_value(string, neck, key, item, middle)) is None:
                low = middle
            else:
                high = middle
    value = _value(string, neck, key, item)
    allowed = (value / low if low else 0.0) if key == "resonance_masses" else low * value
    return Overdamped(fret, f"at {neck.fret_text(fret, board='')}", j + 1, detuned, across, key, item, value, allowed)


@lru_cache(maxsize=256)  # tuning and rebuilding a preset meets the same strings
def _first_fault(string: String, neck: Neck) -> tuple[int, int, bool, bool] | None:
    """The first mode shifted or damped too much: (fret, index of the mode, whether shifted, whether of v)."""
    for fret in range(len(neck.fret_positions) + 1):
        s = speaking(string, neck, fret)
        if not (count := _modes_in_doubt(s)):
            continue
        shifted = np.abs(modes.neck_detuning(s, count)) > MAX_DETUNING
        over = shifted | _cannot_ring(s, count, False)
        if over.any():
            j = int(np.argmax(over))
            return fret, j, bool(shifted[j]), False
        if s.own_across and (over := _cannot_ring(s, count, True)).any():
            return fret, int(np.argmax(over)), False, True
    return None


def _modes_in_doubt(s: Speaking) -> int:
    """The number of modes from the first that may be shifted or damped too much: bounds clear all higher ones.

    The neck shifts or damps no mode by more than twice what its greatest admittance at any frequency would: by the law
    "hinged", which takes it at a complex frequency, nearer to the pole; by the law "paper", not even by more than once.
    """
    j = np.arange(1.0, min(s.grid_points - 1, MAX_MODES) + 1)
    yielding = 2 * max(_greatest(s.felt(across)) for across in (False, True))
    shift = modes.impedance(s) * yielding / (math.pi * j)
    # A frequency of v has three shifts: u's own, and the two that tell v from u. Turned axes lie between the two.
    lowest = (
        j * s.fundamental * (law.stretch_ratio(s.paper_law, s.inharmonicity, j) - 3 * shift) / (1 + s.longer_across)
    )
    nu = modes.law_frequencies(s, j)
    highest = math.pi * nu * modes.loss_factor(s, nu) + law.neck_damping(yielding, modes.impedance(s), s.fundamental)
    highest += s.extra_damping + s.extra_damping_slope * 2 * math.pi * nu
    doubtful = (shift > MAX_DETUNING) | (highest > MAX_DAMPING * 2 * math.pi * lowest)
    return min(j.size, max(modes.measured_modes(s), int(np.max(j, where=doubtful, initial=0))))


def _greatest(y: Admittance) -> float:
    """A bound of |Y|, m/s/N, at any frequency."""
    peaks = sum(r.quality / (2 * math.pi * r.frequency * r.mass) for r in y.resonances)
    return y.stop + peaks + max((math.hypot(*row[1:]) for row in y.table), default=0.0)


def _cannot_ring(s: Speaking, count: int, across: bool) -> NDArray[np.bool_]:
    """Returns whether each mode from 1 to `count` of u, or of v, if `across`, is damped beyond `MAX_DAMPING`, (n,)."""
    nu, sigma = modes.frequencies(s, count, across), modes.dampings(s, count, across)
    return np.asarray(sigma > MAX_DAMPING * 2 * math.pi * nu)


def _item(string: String, neck: Neck, key: str, fret: int, j: int) -> int:
    """The item of `key` that matters most to mode j + 1: the resonance that yields most, or the mode's own."""
    if key == "resonance_masses" and neck.admittance.resonances:
        nu = modes.frequencies(speaking(string, neck, fret), j + 1)[j]
        each = [abs(replace(neck.admittance, resonances=(r,)).at(nu)) for r in neck.admittance.resonances]
        return int(np.argmax(each)) + 1
    return j + 1 if key == "measured_dampings" else 0


def _part(string: String, neck: Neck, key: str, fret: int, j: int, item: int, detuned: bool, across: bool) -> float:
    """The share of `key` in the damping of mode j + 1, 1/s, or in its relative shift."""

    def amount(by: float) -> float:
        s = speaking(*_scale_value(string, neck, key, item, by), fret)
        return float(abs(modes.neck_detuning(s, j + 1)[j]) if detuned else modes.dampings(s, j + 1, across=across)[j])

    return amount(1.0) - amount(0.0)


def _value(string: String, neck: Neck, key: str, item: int) -> float:
    """The value of `key` or of its item, SI; 0 if missing."""
    if key in COLUMNS:
        return max((abs(row[COLUMNS[key]]) for row in neck.admittance.table), default=0.0)
    if key == "resonance_masses":
        return neck.admittance.resonances[item - 1].mass if item else 0.0
    if key == "measured_dampings":
        return string.measured_dampings[item - 1] if item <= len(string.measured_dampings) else 0.0
    if key == "stop_conductance":
        return neck.stop_conductance
    return float(getattr(string, key))


def _scale_value(string: String, neck: Neck, key: str, item: int, by: float) -> tuple[String, Neck]:
    """String and neck with the value of `key`, or of its item, times `by`; a mass is divided by it."""
    y = neck.admittance
    if key in COLUMNS:
        real, imaginary = (by if COLUMNS[key] == column else 1.0 for column in (1, 2))
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
    if key == "stop_conductance":
        return string, replace(neck, stop_conductance=neck.stop_conductance * by)
    changed: dict[str, Any] = {key: getattr(string, key) * by}
    return replace(string, **changed), neck


def wolves(bass: Instrument) -> list[tuple[str, int, float]]:
    """The notes whose fundamental has no strong line at the pitch: (string, fret, cents off), sharp if positive.

    There string and neck move alike, and the fundamental splits into two lines of about equal strength.
    """
    found = []
    for string, neck in zip(bass.strings, bass.necks, strict=True):
        for fret in range(len(neck.fret_positions) + 1):
            s = speaking(string, neck, fret)
            if s.stop != fret or s.paper_law or modes.measured_modes(s):
                continue  # choked, or tuned by eq. 8 as printed
            straight = replace(s, axes_turned=0.0)
            nu, decay = modes.frequencies(straight, 1)[0], modes.dampings(straight, 1)[0] / (2 * math.pi)
            off = 1200 * math.log2(math.sqrt(nu**2 - decay**2) / string.frequency(string.open_note + fret))
            if abs(off) > WOLF:
                found.append((string.name, fret, off))
    return found
