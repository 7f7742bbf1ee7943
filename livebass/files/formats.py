"""The numbers of livebass's sound and file formats, and the names that have changed in them.

A file says its number as `format`; a file without it has format 1. A new number is for what older versions must not
read. States of plugins and instrument files have theirs in plugin/state.py and kernels/bass/kept.py.
"""

from __future__ import annotations

from typing import Any

from livebass import __version__
from livebass.rows.bounds import refusal
from livebass.rows.techniques import RENAMED as SYMBOLS

SOUND = 2  # of the engine: a new number, and a line under "Sound" in the changelog, if a bass sounds otherwise
FORMATS: dict[str, int] = {"preset": 1, "key map": 1, "settings": 1, "take": 1, "link": 1}
KEY = "format"
# By kind, keys that had another name in older versions: {old: new}, places such as "neck.relief"
RENAMED: dict[str, dict[str, str]] = {
    "preset": {f"{table}.{old}": f"{table}.{new}" for table in ("bench", "plugin") for old, new in SYMBOLS.items()},
    "key map": {},
    "settings": {},
}


def check_format(kind: str, data: dict[str, Any]) -> dict[str, Any]:
    """The tables of a file without its format. Raises ValueError if this version does not read that."""
    number, last = data.get(KEY, 1), FORMATS[kind]
    if not isinstance(number, int) or isinstance(number, bool) or number < 1:
        raise refusal(KEY, f"a whole number from 1 to {last}", repr(number))
    if number > last:
        raise ValueError(f"{KEY} = {number}: made for a later livebass; this one, {__version__}, reads format {last}")
    return {key: value for key, value in data.items() if key != KEY}


def rename_keys(kind: str, data: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The tables of a file with today's names, and a line for each old name, with the one to write."""
    made, lines = data, list[str]()
    for old, new in RENAMED[kind].items():
        section, _, name = old.rpartition(".")
        table = made.get(section) if section else made
        if not isinstance(table, dict) or name not in table:
            continue
        moved = {(new.rpartition(".")[2] if key == name else key): value for key, value in table.items()}
        made = made | {section: moved} if section else moved
        lines.append(f"{old} is called {new} now")
    return made, lines
