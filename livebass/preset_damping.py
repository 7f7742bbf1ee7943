"""Whether every mode of a string can ring, and if not, what in the preset keeps it from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from livebass import modes
from livebass.instrument import Neck, String, speaking
from livebass.quality import MOST_MODES

MOST_DAMPING = 0.999  # of critical
KEYS = (
    "extra_damping", "extra_damping_slope", "viscoelastic_angle", "thermoelastic", "conductance_values",
    "measured_dampings",
)  # fmt: skip


@dataclass(frozen=True)
class Overdamped:
    """A mode damped beyond `MOST_DAMPING`, and the key of the preset that takes the largest part in it."""

    fret: int
    mode: int
    key: str
    value: float  # of the key, SI; of its item `mode` for measured_dampings, the greatest for conductance_values
    allowed: float  # with all else as it is; 0: that key alone cannot help


def overdamped(string: String, neck: Neck) -> Overdamped | None:
    """The first mode that is damped too much, at the first fret there is one."""
    found = _first(string, neck)
    if found is None:
        return None
    fret, j = found
    parts = {key: _part(string, neck, key, fret, j) for key in KEYS}
    key = max(parts, key=parts.__getitem__)
    low, high = 0.0, 1.0  # of the value; the tuning depends on the mute, so that this is no straight line
    if _first(*_scaled(string, neck, key, j, low)) is None:
        for _ in range(20):
            middle = (low + high) / 2
            if _first(*_scaled(string, neck, key, j, middle)) is None:
                low = middle
            else:
                high = middle
    value = _value(string, neck, key, j)
    return Overdamped(fret, j + 1, key, value, low * value)


def _first(string: String, neck: Neck) -> tuple[int, int] | None:
    """(fret, index of the mode)."""
    for fret in range(len(neck.fret_positions) + 1):
        s = speaking(string, neck, fret)
        count = min(s.grid_points - 1, MOST_MODES)
        over = modes.dampings(s, count) > MOST_DAMPING * 2 * math.pi * modes.frequencies(s, count)
        if over.any():
            return fret, int(np.argmax(over))
    return None


def _part(string: String, neck: Neck, key: str, fret: int, j: int) -> float:
    """What `key` adds to the damping of mode j + 1, 1/s."""
    with_it, without = (
        modes.dampings(speaking(*_scaled(string, neck, key, j, by), fret), j + 1)[j] for by in (1.0, 0.0)
    )
    return float(with_it - without)


def _value(string: String, neck: Neck, key: str, j: int) -> float:
    if key == "conductance_values":
        return max((y for _, y in neck.conductance), default=0.0)
    if key == "measured_dampings":
        return string.measured_dampings[j] if j < len(string.measured_dampings) else 0.0
    return float(getattr(string, key))


def _scaled(string: String, neck: Neck, key: str, j: int, by: float) -> tuple[String, Neck]:
    """The same with the value of `key` (its item j) times `by`."""
    if key == "conductance_values":
        return string, replace(neck, conductance=tuple((nu, y * by) for nu, y in neck.conductance))
    if key == "measured_dampings":
        known = string.measured_dampings
        known = (*known[:j], *(x * by for x in known[j : j + 1]), *known[j + 1 :])
        return replace(string, measured_dampings=known), neck
    changed: dict[str, Any] = {key: getattr(string, key) * by}
    return replace(string, **changed), neck
