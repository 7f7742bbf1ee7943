"""Revisions of the shipped presets: each one that was ever released loads under its number, as `slap@1`.

presets/revisions.json has, for each preset, the number and the digest of its present revision, and of each earlier one
its digest and the values in which it differs from the next: {place: value}, null for one that it did not have. A place
is a path through the preset's tables, merged into those of its `like`: "neck.relief", "string.0.level". tools/revise
writes the file.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from functools import cache
from typing import Any

from livebass.preset.keys import nearest
from livebass.preset.source import PresetError, is_path, shipped_folder

FILE = "revisions.json"  # in the folder of the presets
MARK = "@"  # between a name and a revision
TITLES = ("name", "description")  # keys without a sound

Tables = dict[str, Any]
Places = dict[str, Any]


def split(name: str) -> tuple[str, int | None]:
    """The preset of a `name`, and its revision; None: the present one. Raises PresetError for what is no revision."""
    preset, mark, number = name.partition(MARK)
    if not mark or is_path(name):
        return name, None
    if preset not in revisions():
        known = [f"{one}{MARK}1" for one in revisions()]
        raise PresetError(f"{name}: no shipped preset has this name; {nearest(name, known)}")
    last = present(preset)
    if not re.fullmatch(r"[0-9]{1,9}", number) or not 1 <= int(number) <= last:
        found = f"revisions 1 to {last}" if last > 1 else "revision 1 only"
        raise PresetError(f"{name}: {preset} has {found}")
    return preset, int(number)


def present(preset: str) -> int:
    """The number of a shipped preset's present revision."""
    return int(revisions()[preset]["revision"])


def with_revision(preset: str) -> str:
    """A shipped preset with the number of its present revision, `slap@2`; any other name as it is."""
    return f"{preset}{MARK}{present(preset)}" if preset in revisions() else preset


def earlier(preset: str, number: int, tables: Tables) -> Tables:
    """The tables of an earlier revision, from the present `tables`."""
    places = places_of(tables)
    for k in range(present(preset) - 1, number - 1, -1):
        changed = revisions()[preset]["before"][str(k)]["changed"]
        places = {place: value for place, value in (places | changed).items() if value is not None}
    return tables_of(places)


def digest(tables: Tables) -> str:
    """A digest of what sounds in a preset's tables."""
    heard = {place: value for place, value in places_of(tables).items() if place not in TITLES}
    return hashlib.sha256(json.dumps(heard, sort_keys=True).encode()).hexdigest()[:16]


def changes(before: Tables, after: Tables) -> Places:
    """The values in which the tables `before` differ from those `after`."""
    old, new = places_of(before), places_of(after)
    return {place: old.get(place) for place in sorted(old.keys() | new.keys()) if old.get(place) != new.get(place)}


def places_of(tables: Any, inside: str = "") -> Places:
    """The values in tables, by place."""
    items: Mapping[Any, Any] | None = None
    if isinstance(tables, dict) and "unit" not in tables:
        items = tables
    elif isinstance(tables, list) and tables and all(isinstance(one, dict) for one in tables):
        items = dict(enumerate(tables))
    if items is None:
        return {inside: tables}
    return {
        place: value
        for key, one in items.items()
        for place, value in places_of(one, f"{inside}.{key}".lstrip(".")).items()
    }


def tables_of(places: Places) -> Tables:
    """The tables with these values."""
    made: Tables = {}
    for place, value in places.items():
        *tables, key = place.split(".")
        at: Any = made
        for name in tables:
            at = at.setdefault(name, {})
        at[key] = value
    return _with_lists(made)


def _with_lists(tables: Any) -> Any:
    """Tables in which those with numbers for keys are lists."""
    if not isinstance(tables, dict) or "unit" in tables:
        return tables
    made = {key: _with_lists(value) for key, value in tables.items()}
    if made and all(key.isdigit() for key in made):
        return [made[key] for key in sorted(made, key=int)]
    return made


def toml_of(tables: Tables) -> str:
    """The text of a preset with these tables."""
    lines = [f"{key} = {_value(value)}" for key, value in tables.items() if not _is_section(value)]
    for name, section in tables.items():
        if isinstance(section, list) and _is_section(section):
            lines += [line for table in section for line in _section(f"[[{name}]]", name, table)]
        elif _is_section(section):
            lines += _section(f"[{name}]", name, section)
    return "\n".join(lines) + "\n"


def _section(head: str, name: str, table: Tables) -> list[str]:
    own = [f"{key} = {_value(value)}" for key, value in table.items() if not _is_section(value)]
    inner = [
        line for key, value in table.items() if _is_section(value) for line in _section(f"[{name}.{key}]", name, value)
    ]
    return ["", head, *own, *inner]


def _is_section(value: Any) -> bool:
    if isinstance(value, list):
        return bool(value) and all(isinstance(one, dict) for one in value)
    return isinstance(value, dict) and "unit" not in value


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_value(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def revision_table() -> str:
    """The revisions of all presets, and in which values each earlier one differs from the next, as text."""
    lines = []
    for preset, kept in revisions().items():
        lines.append(f"{preset}{MARK}{kept['revision']}  the present one\n")
        for number in range(kept["revision"] - 1, 0, -1):
            changed = kept["before"][str(number)]["changed"]
            lines.append(f"{preset}{MARK}{number}  differed in {', '.join(changed)}\n")
    return "".join(lines)


@cache
def revisions() -> dict[str, Any]:
    """The file's content."""
    found: dict[str, Any] = json.loads((shipped_folder() / FILE).read_text("utf-8"))
    return found
