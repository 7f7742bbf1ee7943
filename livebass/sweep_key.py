"""Dotted keys such as `neck.lift.6` or `string.G.tension`: which row of the presets' keys, and where in a preset.

A preset is its parsed TOML here, as `preset.preset_tables` gives it, of a file that has been checked as a whole.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

from livebass import limits
from livebass.preset_build import nearest
from livebass.preset_keys import KEYS, Key
from livebass.units import DIMENSIONS

SINGLE = ("neck", "output", "coil", "player")  # sections there is one of
MEASURED, GEOMETRY = ("height_scale", "height_offset"), ("frets", "action", "relief", "nut_height")


def _limited(name: str, least_to_most: limits.Limits, meaning: str) -> Key:
    unit = next(unit for unit, size in DIMENSIONS[least_to_most.dimension].units.items() if size == 1.0)
    least, most = (f"{end!r} {unit}" for end in (least_to_most.least, least_to_most.most))
    return Key("pluck", name, least_to_most.dimension, least, most, None, meaning)


PLUCK = {
    key.name: key
    for key in (
        _limited("apex", limits.APEX, "height of the plucked corner"),
        _limited("at", limits.AT, "where it is, from the stop"),
        _limited("angle", limits.ANGLE, "of the pull, from straight up"),
        Key("pluck", "fret", "integer", "0", "36", None, "where the string is stopped"),
    )
}


@dataclass(frozen=True)
class Target:
    """Where a dotted key points to."""

    dotted: str
    key: Key  # of one number
    section: str  # "pluck", or a section of the file
    which: str = ""  # name of the string, or number of the pickup; "": all of them
    neck: bool = False  # the string's own neck
    fret: str = ""  # of neck.lift

    def tables(self, data: dict[str, Any]) -> list[dict[str, Any]]:
        """The tables of `data` that hold the key; made where it may be left out. ValueError where there is none."""
        if self.section in SINGLE:
            found = [data.setdefault(self.section, {})]
        elif self.section == "string":
            strings = data["string"]
            found = [t for t in strings if self.which.casefold() in ("", t["name"].casefold())]
            if not found:
                raise ValueError(f"{self.dotted}: this bass has strings {', '.join(t['name'] for t in strings)}")
        else:
            pickups = data.get("pickup", [])
            found = [t for i, t in enumerate(pickups, 1) if self.which in ("", str(i))]
            if not found:
                raise ValueError(f"{self.dotted}: this bass has {len(pickups)} pickups")
        return [table.setdefault("neck", {}) for table in found] if self.neck else found

    def put(self, data: dict[str, Any], raw: Any) -> None:
        """Change `data` in place: `raw` as the file would hold it."""
        for table in self.tables(data):
            if self.fret:
                table.setdefault("lift", {})[self.fret] = raw
            else:
                table[self.key.name] = raw


def target(dotted: str) -> Target:
    """Where `dotted` points to. ValueError for what is no key of a preset or of a pluck, or not a number."""
    section, *rest = dotted.strip().split(".")
    which, neck, fret = "", False, ""
    if section in ("string", "pickup") and len(rest) > 1 and rest[0] != "neck":
        which, *rest = rest
    home = section
    if section == "string" and rest[:1] == ["neck"]:
        neck, home, rest = True, "neck", rest[1:]
    if home == "neck" and rest[:1] == ["lift"] and len(rest) == 2 and re.fullmatch("[1-9][0-9]?", rest[1]):
        rest, fret = rest[:1], rest[1]
    key = _row(home, rest[0]) if len(rest) == 1 else None
    if key is None:
        raise ValueError(f"{dotted}: unknown key; {nearest(dotted, names())}")
    if key.name == "lift":
        if not fret:
            raise ValueError(f"{dotted}: needs the number of a fret, such as {dotted}.6")
        key = replace(key, kind="length")
    if not _one_number(key):
        raise ValueError(f"{dotted}: is {_what(key)}; a sweep varies one number")
    return Target(dotted, key, section, which, neck, fret)


def names() -> list[str]:
    """All keys that can be varied, of strings and pickups for all of them at once."""
    keys = [f"{key.section}.{key.name}" for key in (*KEYS, *PLUCK.values()) if key.section and _one_number(key)]
    return [*keys, "neck.lift.1"]


def hidden(at: Target, data: dict[str, Any], string: str) -> str:
    """Why changing `at` does nothing for `string` of `data`, with what would; "" where no reason is seen here."""
    if at.section != "neck" and not at.neck:
        return ""
    mine = next((t for t in data["string"] if t["name"].casefold() == string.casefold()), None)
    if mine is None or (at.neck and at.which.casefold() not in ("", string.casefold())):
        return ""
    own, shared = mine.get("neck", {}), data.get("neck", {})
    where = own if own.keys() & {"fret_positions", "fret_heights", *GEOMETRY} else shared
    prefix = f"string.{mine['name']}.neck"
    name = at.key.name
    if not at.neck and name in own:
        return f"string {mine['name']} has {name} of its own; vary {prefix}.{name}"
    if name in GEOMETRY and "fret_heights" in where:
        return "its frets are measured; vary neck.height_scale, neck.height_offset or neck.lift.6"
    if name in MEASURED and "fret_heights" not in where:
        return "its frets are not measured; vary neck.action, neck.relief or neck.nut_height"
    return ""


def _row(section: str, name: str) -> Key | None:
    if section == "pluck":
        return PLUCK.get(name)
    return next((key for key in KEYS if section and (key.section, key.name) == (section, name)), None)


def _one_number(key: Key) -> bool:
    return key.kind in (*DIMENSIONS, "number", "integer", "note")


def _what(key: Key) -> str:
    if key.kind.endswith("[]"):
        return "a list"
    return {"text": "a text", "controller": "the number of a controller"}.get(key.kind, "a choice")
