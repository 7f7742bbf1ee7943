"""What the string of a preset can touch: the crowns of its frets, a whole profile, or the bare board of a fretless."""

from __future__ import annotations

from typing import Any

from livebass.obstacle import Surface, fretted_surface, height_at, wooden_surface
from livebass.preset_admittance import Misfit
from livebass.units import format_quantity

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
