"""A preset like another: `like` names the base, and the keys of the file replace the base's.

Tables merge key by key, [[string]] by name, [[pickup]] by order. A key of [neck] applies to every string, even if the
base gives a string its own. A [[string]] of a new name with an open_note is a new string: the file then lists all
strings of the bass, those of the base by their names alone.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from livebass.preset.build import merged_neck
from livebass.preset.keys import SECTIONS, fault
from livebass.preset.source import PresetError, is_path

MAXIMUM = 8  # presets, each like the next
PITCH = "open_note"
PATHS = (("effects", "response"), ("player", "keys"))  # keys with paths relative to their file
# In a string: keys that a key replaces
INSTEAD = {"inharmonicity": ("core_diameter", "core_modulus", "stiffness_ratio"), "core_diameter": ("inharmonicity",)}

Tables = dict[str, Any]


def whole(label: str, data: Tables, read: Callable[[str], tuple[str, Tables]], deep: int = 1) -> Tables:
    """The tables of a preset, merged into its base's tables, if any.

    label: its file; `read` returns the label and the tables of a preset by its name or path. Raises PresetError.
    """
    if "like" not in data:
        return data
    name = data["like"]
    if not isinstance(name, str) or not name.strip():
        raise fault(label, "like", 'must be the name of a preset, or the path of one, "x.toml"', name)
    if deep == MAXIMUM:
        raise fault(label, "like", f"a chain of more than {MAXIMUM} presets", name)
    try:
        base_label, base = read(str(Path(label).parent / name) if is_path(name) else name)
    except PresetError as error:
        raise fault(label, "like", error, name) from None
    base = whole(base_label, base, read, deep + 1)
    own = {key: value for key, value in data.items() if key != "like"}
    return _merge(label, with_paths(base_label, base), own)


def with_paths(label: str, base: Tables) -> Tables:
    """`base`, of a file, with absolute paths."""
    for section, key in PATHS:
        table = base.get(section)
        if not isinstance(table, dict):
            continue
        path = table.get(key)
        if isinstance(path, str) and (key == "response" or is_path(path)):
            base = base | {section: table | {key: str((Path(label).parent / path).absolute())}}
    return base


def _merge(label: str, base: Tables, own: Tables) -> Tables:
    """The tables of `base`, with the `own` tables of a file merged in."""
    made = base | {key: value for key, value in own.items() if key not in SECTIONS}
    for section in (section for section in SECTIONS if section in own):
        given, there = own[section], base.get(section, {})
        if section == "string":
            made[section] = _strings(label, base.get(section), given, own.get("neck"))
        elif section == "pickup":
            made[section] = _pickups(label, base.get(section), given)
        elif isinstance(given, dict) and isinstance(there, dict):
            made[section] = merged_neck(there, given) if section == "neck" else there | given
        else:
            made[section] = given  # an error, reported by the later check
    if "neck" in own and "string" not in own:
        made["string"] = _strings(label, base.get("string"), [], own["neck"])
    return made


def _strings(label: str, base: Any, own: Any, neck: Any) -> Any:
    """The [[string]] tables of `base` with `own` keys merged in by name, without neck keys that `neck` replaces.

    With a new string among them, `own` is the list of all strings.
    """
    if not _are_tables(base) or not _are_tables(own):
        return own
    made = {_name(string): _under(string, neck) for string in base}
    found = dict(made)
    for number, given in enumerate(own, 1):
        there = found.get(_name(given))
        if there is None and not ("name" in given and PITCH in given):
            known = [str(string.get("name", "")) for string in base]
            why = f"the preset named by like has {', '.join(known)}" + ("" if "name" in given else "; say which one")
            raise fault(label, f"string[{number}].name", why, *([given["name"]] if "name" in given else []))
        found[_name(given)] = given if there is None else _join(there, given)
    return [found[_name(string)] for string in (own if len(found) > len(made) else base)]


def _name(string: Tables) -> str:
    return str(string.get("name", "")).casefold()


def _join(there: Tables, given: Tables) -> Tables:
    """A [[string]] table with the keys of `given` in place of its own."""
    void = {key for said, others in INSTEAD.items() if said in given for key in others}
    there = {key: value for key, value in there.items() if key not in void}
    joined = there | given
    if isinstance(there.get("neck"), dict) and isinstance(given.get("neck"), dict):
        joined["neck"] = merged_neck(there["neck"], given["neck"])
    return joined


def _under(string: Tables, neck: Any) -> Tables:
    """A [[string]] table without the keys of its own neck that the file's [neck] replaces."""
    if not isinstance(neck, dict) or not isinstance(string.get("neck"), dict):
        return string
    left = {key: value for key, value in merged_neck(string["neck"], neck).items() if key not in neck}
    return string | {"neck": left} if left else {key: value for key, value in string.items() if key != "neck"}


def _pickups(label: str, base: Any, own: Any) -> Any:
    """The [[pickup]] tables of `base` with `own` keys merged in, by order."""
    if not _are_tables(base) or not _are_tables(own):
        return own
    if len(own) > len(base):
        raise PresetError(f"{label}: pickup: {len(own)} of them; the preset named by like has {len(base)}")
    return [there | given for there, given in zip(base, own, strict=False)] + base[len(own) :]


def _are_tables(raw: Any) -> bool:
    return isinstance(raw, list) and all(isinstance(one, dict) for one in raw)
