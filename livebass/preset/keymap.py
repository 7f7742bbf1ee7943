"""Key maps by name or from a TOML file: the technique of each MIDI key, and the function of each controller.

A file has up to three tables and a switch:

    over_notes = true           # keys switch even if the bass has their notes; false: notes go first
    [strings]                   # keys that force a string, by its open note
    E = 28
    [keys]                      # keys of the other techniques; hand: of fret 1, with 23 more above it
    ghost = 22
    [controllers]
    place = [3, 16]

Without [strings] and [keys] it takes the keys of `modo`, and without [controllers] the controllers of `modo`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from livebass.model.keymap import COUNTING, KEYS, MAPS, MODO, KeyMap
from livebass.preset.keys import fault, nearest, unknown_name
from livebass.preset.source import PresetError, decode, file_bytes, is_path, parse
from livebass.rows.techniques import CHANNEL_MODES, FRETS, FUNCTION_ROWS, RESERVED, TECHNIQUE_ROWS
from livebass.rows.units import note_name, note_number, one_line, pitch_name

KEY_RULE = f"a key from 0 to {KEYS - 1}, or a list of them"
CONTROLLER_RULE = f"a controller from 0 to {CHANNEL_MODES - 1} except 6, 38 and 96 to 101, or a list of them"
SECTIONS = ("strings", "keys", "controllers")


def load_key_map(name_or_path: str) -> KeyMap:
    """Loads a shipped key map by name, or a file: a path ends in .toml or has a /.

    Raises PresetError with a one-line message if the file cannot be read or anything in it is wrong.
    """
    if not is_path(name_or_path):
        if name_or_path not in MAPS:
            raise unknown_name("key map", name_or_path, list(MAPS))
        return MAPS[name_or_path]
    text = decode(name_or_path, file_bytes(name_or_path, "key map", MAPS), "key map")
    return _Reader(name_or_path).key_map(parse(name_or_path, text, "key map", "[strings], [keys] or [controllers]"))


def keys_of_player(name_or_path: str, preset: str) -> KeyMap:
    """The key map named in the file called `preset`; a path is relative to that file. Raises PresetError."""
    if is_path(name_or_path):
        name_or_path = str(Path(preset).parent / name_or_path)
    return load_key_map(name_or_path)


def key_map_text(keys: KeyMap) -> str:
    """The text of a file with this key map and the meaning of each entry: a start for custom maps."""
    lines = [
        f"# The key map {one_line(keys.name)}. {COUNTING}.",
        f"over_notes = {str(keys.over_notes).lower()}  # true: keys switch although the bass has their notes",
    ]
    strings = [(pitch_name(value), key) for key, name, value in keys.keys if name == "string"]
    lines += ["", "[strings]  # hold: notes are played on this string, by its open note"]
    lines += [f"{_toml_key(name)} = {key}  # {note_name(key)}" for name, key in strings]
    lines += ["", "[keys]"]
    switched = {row.symbol: f"{row.trigger}: {row.help}" for row in TECHNIQUE_ROWS.values()}
    entries = [(key, name) for key, name, value in keys.keys if value in (0, 1) and name != "string"]
    lines += _entries(entries, switched, lambda keys: f"{' '.join(map(note_name, keys))}, ")
    lines += ["", "[controllers]"]
    lines += _entries(list(keys.controllers), {row.symbol: row.help for row in FUNCTION_ROWS.values()}, lambda _: "")
    return "\n".join(lines) + "\n"


def _entries(rows: list[tuple[int, str]], meanings: dict[str, str], named: Callable[[list[int]], str]) -> Iterator[str]:
    """A line for each name: its numbers, how they are `named`, and its meaning."""
    for name, meaning in meanings.items():
        numbers = [number for number, other in rows if other == name]
        if numbers:
            yield f"{name} = {numbers[0] if len(numbers) == 1 else numbers}  # {named(numbers)}{meaning}"


def _toml_key(name: str) -> str:
    return name if name.isalpha() else f'"{name}"'


class _Reader:
    """Reads the tables of one file, and names that file in every error."""

    def __init__(self, label: str) -> None:
        self.label = label

    def error(self, where: str, why: str, *raw: Any) -> PresetError:
        return fault(self.label, where, why, *raw)

    def key_map(self, data: dict[str, Any]) -> KeyMap:
        """The key map of these tables. Raises PresetError."""
        known = ["over_notes", *SECTIONS]
        for name in data:
            if name not in known:
                raise self.error(name[:40], f"unknown; {nearest(name, known)}")
        over_notes = data.get("over_notes", True)
        if not isinstance(over_notes, bool):
            raise self.error("over_notes", "must be true or false", over_notes)
        own_keys = "strings" in data or "keys" in data
        keys = (*self.strings(data.get("strings", {})), *self.switches(data.get("keys", {})))
        controllers = tuple(self.controllers(data["controllers"])) if "controllers" in data else MODO.controllers
        places: dict[int, str] = {}
        for key, place, *_ in keys:
            if key in places:
                raise self.error(place, f"is {places[key]} already; a key does one thing", key)
            places[key] = place
        if not own_keys:
            return KeyMap(self.label, MODO.keys, controllers, bool(data.get("over_notes", MODO.over_notes)))
        return KeyMap(self.label, tuple((key, name, value) for key, _, name, value in keys), controllers, over_notes)

    def table(self, section: str, raw: Any) -> dict[str, Any]:
        if not isinstance(raw, dict):
            raise self.error(section, f"must be a table, [{section}]", raw)
        return raw

    def numbers(self, place: str, raw: Any, maximum: int, rule: str) -> list[int]:
        """The numbers 0 to `maximum` of an entry, one or a list."""
        listed = raw if isinstance(raw, list) else [raw]
        for number in listed:
            if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= maximum:
                raise self.error(place, f"must be {rule}", raw)
        return listed

    def strings(self, raw: Any) -> Iterator[tuple[int, str, str, int]]:
        """Keys of [strings]: key, place in the file, technique, pitch class."""
        for name, keys in self.table("strings", raw).items():
            place = f"strings.{name[:40]}"
            try:
                pitch_class = note_number(f"{name}4") % 12
            except ValueError:
                raise self.error(place, "unknown string; strings are open notes such as E or Bb", keys) from None
            for key in self.numbers(place, keys, KEYS - 1, KEY_RULE):
                yield key, place, "string", pitch_class

    def switches(self, raw: Any) -> Iterator[tuple[int, str, str, int]]:
        """Keys of [keys]: key, place in the file, technique, its value."""
        known = [name for name in TECHNIQUE_ROWS if name != "string"]
        for name, keys in self.table("keys", raw).items():
            place = f"keys.{name[:40]}"
            if name not in known:
                raise self.error(place, f"unknown technique; {nearest(name, known)}", keys)
            for key in self.numbers(place, keys, KEYS - 1, KEY_RULE):
                if name != "hand":
                    yield key, place, name, 0
                    continue
                yield from ((k, place, name, k - key + 1) for k in range(key, min(key + FRETS, KEYS)))

    def controllers(self, raw: Any) -> Iterator[tuple[int, str]]:
        """Controllers of [controllers], and their functions."""
        places: dict[int, str] = {}
        for name, given in self.table("controllers", raw).items():
            place = f"controllers.{name[:40]}"
            if name not in FUNCTION_ROWS:
                raise self.error(place, f"unknown function; {nearest(name, list(FUNCTION_ROWS))}", given)
            for number in self.numbers(place, given, CHANNEL_MODES - 1, CONTROLLER_RULE):
                if number in RESERVED:
                    raise self.error(place, f"must be {CONTROLLER_RULE}", number)
                if number in places:
                    raise self.error(place, f"is {places[number]} already; a controller does one thing", number)
                places[number] = place
                yield number, name
