"""The basses that a take names: `play` writes them into the take, `render` and `play` load them.

A take may come from anybody. Its texts choose only presets by name, existing preset files, and values that the
command-line options allow. What it kept of a preset file may name only responses and key maps that exist.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.hands import SOUND, Loader
from livebass.cli.tuning import FILE

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument
    from livebass.score.score import Score, TakenBass

RESPONSES = (".wav", ".flac", ".ogg", ".aif", ".aiff")
LONGEST_SHOWN = 200  # characters to show of a bass, in a line


def take_options(options: Mapping[str, Any]) -> dict[str, str]:
    """The `options` that change a bass, as a take stores them: as on the command line, with absolute paths."""
    from livebass.preset.source import is_path

    found = {name: value for name in SOUND if (value := options[name]) is not None and value is not False}
    for name, value in found.items():
        if name == "response" or (name == "keys" and is_path(value)):
            found[name] = os.path.abspath(value)
        elif isinstance(value, tuple):  # a curve
            found[name] = ",".join(f"{x!r}:{y!r}" for x, y in value)
    return {name: str(value) for name, value in found.items()}


def load_take_basses(
    score: Score, load: Loader, default: str, command: click.Command
) -> tuple[Score, Callable[[str], Instrument]]:
    """The score with basses that can be loaded, and a function that loads each as the take names it.

    A bass that cannot be loaded is replaced by the one of its program, or the `default` one, with a remark. `load` has
    the options of the command line, which override the take's; `command` has all options.
    """
    if not score.basses:
        return score, load
    made: dict[str, Instrument] = {}
    instead: dict[str, str] = {}
    lines = list(score.remarks)
    for bass in score.basses:
        if bass.preset in made or bass.preset in instead:
            continue
        given, left_out = _known_options(bass, command)
        try:
            text, line = _kept_preset(bass)
            made[bass.preset] = load(bass.preset if text else _check_preset(bass.preset), given, text)
            lines += [*line, *left_out]
        except ValueError as error:
            from livebass.preset.programs import PROGRAMS

            instead[bass.preset] = PROGRAMS.get(bass.program + 1, default)
            lines.append(f"was played on {bass.preset}, {error}: {instead[bass.preset]} plays instead")
    basses = tuple(
        replace(bass, preset=instead[bass.preset], given={}) if bass.preset in instead else bass
        for bass in score.basses
    )

    def loaded(preset: str) -> Instrument:
        if preset not in made:
            made[preset] = load(preset)
        return made[preset]

    return replace(score, basses=basses, remarks=tuple(lines)), loaded


def bass_line(bass: TakenBass) -> str:
    """A bass of a take with its options, for a line."""
    values = (name.replace("_", "-") if value == "True" else f"{name} {value}" for name, value in bass.given.items())
    line = f"{bass.preset} ({', '.join(values)})" if bass.given else bass.preset
    return line if len(line) <= LONGEST_SHOWN else f"{line[: LONGEST_SHOWN - 3]}..."


def _check_preset(preset: str) -> str:
    """`preset`, if it is a known name or the absolute path of a preset file. Raises ValueError with the reason."""
    from livebass.preset.load import laboratory_names, preset_names
    from livebass.preset.revisions import split
    from livebass.preset.source import is_path

    if not is_path(preset):
        try:
            name, _ = split(preset)
        except ValueError as error:
            raise ValueError(f"which this livebass does not have ({error})") from None
        if name not in (*preset_names(), *laboratory_names()):
            raise ValueError("which this livebass does not have")
    elif not _is_file(preset, (".toml",)):
        raise ValueError("which is not there" if preset.endswith(".toml") else "which is no preset file, .toml")
    return preset


def _kept_preset(bass: TakenBass) -> tuple[str, list[str]]:
    """The text of a preset file as the take kept it, and a line that says so; "" and none if the file is the same.

    Files that it names are left out if they could be no response or key map. Raises PresetError.
    """
    from livebass.preset.like import PATHS
    from livebass.preset.load import kept_text, parsed_text
    from livebass.preset.revisions import toml_of
    from livebass.preset.source import PresetError, is_path

    if not bass.file or not is_path(bass.preset):
        return "", []
    why = "is not there any more"
    if _is_file(bass.preset, (".toml",)):
        why = "has changed since"
        with suppress(PresetError):
            if kept_text(bass.preset) == bass.file:
                return "", []
    tables = parsed_text(bass.preset, bass.file)
    lines = [f"{bass.preset} {why}: the take plays on the bass that it kept"]
    for section, key in PATHS:
        table = tables.get(section)
        path = table.get(key) if isinstance(table, dict) else None
        named = isinstance(path, str) and (key == "response" or is_path(path))
        if table and named and not _is_file(str(path), RESPONSES if key == "response" else (".toml",)):
            tables = tables | {section: {name: value for name, value in table.items() if name != key}}
            lines.append(f"its {key}, {str(path)[:LONGEST_SHOWN]}, is left out: there is no such file")
    return toml_of(tables), lines


def _is_file(path: str, endings: tuple[str, ...]) -> bool:
    """True for the absolute path of a file on this machine with one of the `endings`."""
    whole = os.path.isabs(path) and not path.startswith(("//", "\\\\"))  # these name another machine
    return whole and path.lower().endswith(endings) and Path(path).is_file()


def _known_options(bass: TakenBass, command: click.Command) -> tuple[dict[str, Any], list[str]]:
    """The options of a bass that `command` accepts, and a line about each other one."""
    from livebass.model.keymap import MAPS

    kinds = {parameter.name: parameter for parameter in command.params if parameter.name in SOUND}
    found, lines = dict[str, Any](), list[str]()
    for name, value in bass.given.items():
        try:
            fits = {
                "keys": value in MAPS or _is_file(value, (".toml",)),
                "response": _is_file(value, RESPONSES),
                "temperament": not FILE.search(value),  # a take stores cents
            }.get(name, name in kinds)
            if not fits:
                raise ValueError
            found[name] = kinds[name].type.convert(value, kinds[name], None)
        except (ValueError, click.UsageError):
            lines.append(f"was played on {bass.preset} with {name} {value}, which is left out")
    return found, lines
