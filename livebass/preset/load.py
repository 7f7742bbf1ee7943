"""Preset files (TOML) by name or path: loads one as an instrument, shows its text, lists the allowed keys."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from livebass.files.formats import rename_keys
from livebass.model.instrument import Instrument
from livebass.preset import revisions
from livebass.preset.build import Builder
from livebass.preset.keys import KEYS, Key, limits_of, unknown_name
from livebass.preset.like import whole, with_paths
from livebass.preset.sounds import sound_names, sound_text
from livebass.preset.source import decode, file_bytes, is_path, parse, shipped_folder
from livebass.rows.row import REQUIRED

LABORATORY = "laboratory"  # folder of presets for experiments, not basses


def preset_names() -> list[str]:
    """Returns the names of the shipped basses, sorted.

    Example:
        >>> "slap" in preset_names()
        True
    """
    return _names_in(shipped_folder())


def laboratory_names() -> list[str]:
    """Names of the presets for experiments, not basses, sorted: for `simulate` and studies."""
    return _names_in(shipped_folder() / LABORATORY)


def _names_in(folder: Path) -> list[str]:
    return sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml"))


def load_preset(
    name_or_path: str | os.PathLike[str],
    *,
    tuning: str | Sequence[int | str] | None = None,
    capo: int | None = None,
    a4: float | str | None = None,
    temperament: str | Sequence[float] | None = None,
) -> Instrument:
    """Loads a bass: a shipped one by its name, or your own from a TOML file.

    Args:
        name_or_path: Name of a shipped bass, see `preset_names`, perhaps in an earlier revision, "slap@1"; or a path,
            which ends in .toml or has a "/".
        tuning: Replaces the file's key: a name such as "drop-d", or the notes of the strings, lowest first.
        capo: Replaces the file's key: the capo's fret.
        a4: Replaces the file's key: frequency of the A above middle C, Hz.
        temperament: Replaces the file's key: a name such as "just", or cents off equal temperament.

    Raises:
        PresetError: The file cannot be read, or something in it is wrong; or an argument is.

    Example:
        >>> bass = load_preset("jazz-finger", tuning="drop-d")
        >>> len(bass.strings), bass.frets, bass.note_range
        (4, 20, (26, 63))
    """
    listed = temperament if temperament is None or isinstance(temperament, str) else list(temperament)
    given = {"tuning": tuning, "capo": capo, "a4": a4, "temperament": listed}
    given = {name: value for name, value in given.items() if value is not None}
    if not given and not is_path(os.fspath(name_or_path)):
        return _as_shipped(os.fspath(name_or_path))
    label, data = preset_tables(name_or_path)
    return Builder(label).instrument(data | given)


def load_kept(path: str, text: str, **tuning: Any) -> Instrument:
    """Loads a bass from the `text` that its file had (`kept_text`); `path` is where that was. Raises PresetError."""
    return Builder(path).instrument(parsed_text(path, text) | tuning)


def kept_text(path: str) -> str:
    """The text of a preset file with the tables of its base, and absolute paths. Raises PresetError."""
    return revisions.toml_of(with_paths(*preset_tables(path)))


@cache
def _as_shipped(name: str) -> Instrument:
    """The bass of a shipped preset, made once."""
    label, data = preset_tables(name)
    return Builder(label, ships=True).instrument(data)


def preset_with(note: int, default: str) -> str | None:
    """The name of a shipped bass that has `note`: the one with the least room below it; in a tie, `default`.

    None if no bass has it.
    """
    ranges = _ranges()
    having = [name for name, (lowest, highest) in ranges.items() if lowest <= note <= highest]
    return max(having, key=lambda name: (ranges[name][0], name == default), default=None)


@cache
def _ranges() -> dict[str, tuple[int, int]]:
    """The lowest and the highest note of every shipped bass."""
    return {name: load_preset(name).note_range for name in preset_names()}


def preset_tables(name_or_path: str | os.PathLike[str]) -> tuple[str, dict[str, Any]]:
    """The file's name for messages, and its tables, parsed but not checked. Raises PresetError.

    They include the tables of the base preset, without the key `like`.
    """
    label, own = own_tables(name_or_path)
    return label, whole(label, own, own_tables)


def own_tables(name_or_path: str | os.PathLike[str]) -> tuple[str, dict[str, Any]]:
    """The file's name for messages, and its own tables only, parsed but not checked. Raises PresetError."""
    label, text = preset_source(name_or_path)
    return label, parsed_text(label, text)


def renamed_keys(name_or_path: str | os.PathLike[str]) -> list[str]:
    """A line for each key of a preset file that has another name now. Raises PresetError."""
    _, text = preset_source(name_or_path)
    return rename_keys("preset", tomllib.loads(text))[1]


def preset_text(name_or_path: str | os.PathLike[str]) -> str:
    """The text of a preset file, then comments with the keys left at their defaults. Raises PresetError."""
    _, text = preset_source(name_or_path)
    label, data = preset_tables(name_or_path)
    Builder(label).instrument(data)
    lines = []
    for key in KEYS:
        tables = data.get(key.section, []) if key.section else data
        given = any(key.name in table for table in (tables if isinstance(tables, list) else [tables]))
        if not given and key.default not in (None, REQUIRED, ""):
            default = f'"{key.default}"' if isinstance(key.default, str) else _default(key)
            lines.append(f"#   {_place(key)} = {default}  ({limits_of(key)}: {key.meaning})\n")
    return text.rstrip("\n") + "\n\n# Not set above, so at the default:\n" + "".join(lines)


def preset_reference() -> str:
    """All keys of a preset file with limits, default and meaning, as a Markdown table."""
    rows = ["| key | allowed | default | meaning |", "|---|---|---|---|"]
    for key in KEYS:
        default = "required" if key.default is REQUIRED else _default(key)
        rows.append(f"| `{_place(key)}` | {limits_of(key).replace('|', ', ')} | {default} | {key.meaning} |")
    return "\n".join(rows) + "\n"


def _place(key: Key) -> str:
    """The name of `key` with its section."""
    return f"{key.section}.{key.name}" if key.section else key.name


def _default(key: Key) -> str:
    """The default of `key` as text, empty if none."""
    return f"{key.default:g}" if isinstance(key.default, float) else "" if key.default is None else f"{key.default}"


def preset_source(name_or_path: str | os.PathLike[str]) -> tuple[str, str]:
    """The file's name for messages, and its text. Raises PresetError."""
    name, number = revisions.split(os.fspath(name_or_path))
    if number is not None and number < revisions.present(name):
        tables = revisions.earlier(name, number, preset_tables(name)[1])
        return os.fspath(name_or_path), revisions.toml_of(tables)
    if not is_path(name):
        folder = shipped_folder() / LABORATORY if name in laboratory_names() else shipped_folder()
        if name not in _names_in(folder):
            if name in sound_names():
                return f"{name}.toml", sound_text(name)
            raise unknown_name("preset", name, [*preset_names(), *laboratory_names(), *sound_names()])
        label, raw = f"{name}.toml", (folder / f"{name}.toml").read_bytes()
    else:
        label, raw = name, file_bytes(name, "preset", preset_names())
    return label, decode(label, raw, "preset")


def parsed_text(label: str, text: str) -> dict[str, Any]:
    """The tables of a preset's text, parsed but not checked; `label`: its file. Raises PresetError."""
    return parse(label, text, "preset", "name, [neck] and [[string]], or like")
