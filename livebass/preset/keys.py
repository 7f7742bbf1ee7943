"""The keys of a preset file, a row each: kind, limits, default and meaning.

The rows define the checks of a value, the messages about it and the output of `livebass presets keys`. Most rows are in
the model's dataclasses (rows.py).
"""

from __future__ import annotations

import difflib
import functools
import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from livebass.files.formats import FORMATS
from livebass.kernels.effects.records import LONGEST, MAX_RATE, MIN_RATE
from livebass.model.instrument import Coil, Effects, Neck, Output, Pick, Pickup, Player, String
from livebass.model.keymap import CURVES, MAPS
from livebass.preset import tuning
from livebass.preset.source import SCALE, PresetError, is_scale
from livebass.rows import units
from livebass.rows.bounds import between, complaint
from livebass.rows.row import REQUIRED, rows
from livebass.rows.techniques import FUNCTION_ROWS, PARAMETER_ROWS, RPN, SLIDER_ROWS
from livebass.rows.units import DIMENSIONS, format_quantity, quantity, readable_quantity

DATACLASSES = {
    "neck": Neck,
    "string": String,
    "output": Output,
    "pickup": Pickup,
    "coil": Coil,
    "player": Player,
    "pick": Pick,
    "effects": Effects,
}
MAX_POINTS = 16  # of a curve
# MIDI controllers with a fixed meaning; from 120 on they are channel mode messages.
RESERVED = (*RPN, *(n for name in ("volume", "expression", "let_ring") for n in FUNCTION_ROWS[name].controllers))


@dataclass(frozen=True)
class Key:
    """One key of a preset file. Limits and default read as in a file."""

    section: str
    name: str
    kind: str  # a dimension of `units`, choices "a|b", number, integer, text, note, tuning ...; with "[]": a list
    minimum: str
    maximum: str
    default: Any  # or REQUIRED, or None: optional, see `meaning`
    meaning: str


def _rows(section: str, after: str = "", last: str = "") -> list[Key]:
    """The keys from rows of the section's dataclass, if given only those after `after` and up to `last`."""
    cls, made = DATACLASSES[section], []
    for name, row in rows(cls).items():
        value = None if row.optional else getattr(cls, name, REQUIRED)
        if row.kind in DIMENSIONS and isinstance(value, float):
            value = readable_quantity(value, row.kind)
        made.append(Key(section, name, row.kind, row.minimum, row.maximum, value, row.meaning))
    names = [key.name for key in made]
    return made[names.index(after) + 1 if after else 0 : names.index(last) + 1 if last else None]


def _parameters() -> list[Key]:
    """The keys of [bench] and [plugin]: numbers in the unit of each parameter, as in links and plugins."""
    made = []
    for symbol, p in PARAMETER_ROWS.items():
        slider = SLIDER_ROWS.get(symbol)
        if symbol != "bass" and p.group != "Processor":
            section, does = ("bench", slider.help) if slider else ("plugin", f"{p.name} of plugins and page")
            kind, meaning = "integer" if p.whole else "number", f"{p.unit}: {does}" if p.unit else does
            made.append(Key(section, symbol, kind, f"{p.minimum:g}", f"{p.maximum:g}", None, meaning))
    return sorted(made, key=lambda key: key.section)


KEYS = (
    Key("", "like", "text", "1", "1000", None, "name or path of a preset: everything else is inherited from it"),
    Key("", "format", "integer", "1", str(FORMATS["preset"]), 1, "of the file: later versions may need another"),
    Key("", "name", "text", "1", "80", REQUIRED, "what the bass is called"),
    Key("", "description", "text", "0", "500", "", "one sentence about it"),
    Key("", "tuning", "tuning", "", "", "standard", "of the open strings; standard: as string.open_note says"),
    Key("", "capo", "integer", "0", "31", 0, "fret of a capo: it removes the notes below; frets count from it"),
    Key("", "a4", "pitch", "", "", 440, "Hz of the A above middle C"),
    Key(
        "",
        "temperament",
        "temperament",
        "-100",
        "100",
        None,
        "name, or cents off equal for 12 notes from C on or for each string",
    ),
    Key("neck", "scale_length", "length", "300 mm", "1500 mm", REQUIRED, "nut to saddle"),
    Key("neck", "frets", "integer", "1", "32", 20, "number of frets"),
    Key("neck", "action", "length", "0 mm", "20 mm", "2 mm", "gap under the open string at fret 12; or a list"),
    Key("neck", "relief", "length", "0 mm", "5 mm", "0.3 mm", "hollow of the neck at its middle"),
    Key("neck", "nut_height", "length", "0 mm", "10 mm", "0.5 mm", "gap under the open string at fret 1"),
    Key("neck", "lift", "lift", "-5 mm", "5 mm", None, 'frets that stand proud: {6 = "0.5 mm"}'),
    Key("neck", "fret_positions", "length[]", "0 mm", "1500 mm", None, "measured places of the frets, from the nut"),
    Key("neck", "fret_heights", "length[]", "-30 mm", "10 mm", None, "measured heights; negative: below the string"),
    Key("neck", "height_scale", "number", "0", "5", 1.0, "measured heights times this ..."),
    Key("neck", "height_offset", "length", "-10 mm", "10 mm", "0 mm", "... plus this"),
    Key("neck", "obstacle", "frets|profile|board", "", "", "frets", "frets, frets and wood (profile), or a bare board"),
    Key("neck", "fret_height", "length", "0.1 mm", "5 mm", "1 mm", "height of the frets over the wood of a profile"),
    Key("neck", "board_end", "length", "50 mm", "1500 mm", None, "end of the wood; left out: 20 mm past the last fret"),
    Key("neck", "profile_positions", "length[]", "0 mm", "1500 mm", None, "places on a measured surface, from the nut"),
    Key("neck", "profile_heights", "length[]", "-30 mm", "10 mm", None, "heights there; negative: below the string"),
    *_rows("neck"),
    Key("neck", "resonance_frequencies", "frequency[]", "1 Hz", "20 kHz", None, "resonances of the neck, ascending"),
    Key("neck", "resonance_qualities", "number[]", "0.5", "1000", None, "Q of each"),
    Key("neck", "resonance_masses", "mass[]", "0.001 kg", "1000 kg", None, "effective mass of each at the nut"),
    Key("neck", "resonance_shapes", "integer[]", "0", "40", None, "bending modes, 0: none; left out: 1, 2, 3 ..."),
    Key("neck", "conductance_frequencies", "frequency[]", "0 Hz", "100 kHz", None, "measured, instead of resonances"),
    Key("neck", "conductance_values", "conductance[]", "0 m/s/N", "10 m/s/N", None, "Re Y of eq. 9 there, at the nut"),
    Key("neck", "susceptance_values", "susceptance[]", "-10 m/s/N", "10 m/s/N", None, "Im Y of eq. 8; left out: 0"),
    Key("string", "name", "text", "1", "20", REQUIRED, "different for each string"),
    Key("string", "open_note", "note", "0", "127", REQUIRED, "pitch of the open string"),
    *_rows("string"),
    Key("string", "core_diameter", "length", "0.05 mm", "5 mm", None, "diameter of the core; or give inharmonicity"),
    Key("string", "core_modulus", "modulus", "1 GPa", "500 GPa", "200 GPa", "E of the core; steel: 200 GPa"),
    Key("string", "stiffness_ratio", "number", "1", "10", 1.5, "bending stiffness of the string, relative to its core"),
    Key("string", "measured_frequencies", "frequency[]", "5 Hz", "100 kHz", None, "first modes of the open string"),
    Key("string", "measured_dampings", "decay rate[]", "0 /s", "100000 /s", None, "dampings of the same modes"),
    *_rows("output"),
    Key("pickup", "position", "length", "1 mm", "800 mm", REQUIRED, "centre, from the saddle"),
    *_rows("pickup"),
    Key("pickup", "strings", "text[]", "1", "20", None, "names of the strings it senses; left out: all"),
    *_rows("coil"),
    *_rows("player", last="position_controller"),
    Key("player", "keys", "key map", "", "", "modo", "what MIDI keys and controllers do"),
    Key(
        "player",
        "velocity_curve",
        "curve",
        "0.2",
        "5",
        Player.velocity_curve,
        "soft: soft keys sound harder, hard: softer",
    ),
    *_rows("player", after="position_controller"),
    Key("player", "graze_action", "length", "0.1 mm", "20 mm", None, "the action that force 1 grazes; or a list"),
    Key("player", "graze_relief", "length", "0 mm", "5 mm", None, "its relief; or a list"),
    Key("player", "graze_nut_height", "length", "0 mm", "10 mm", None, "its gap at fret 1; or a list"),
    *_rows("pick"),
    *_rows("effects"),
    Key("effects", "response", "sound file", "", "", None, "impulse response of a cabinet or a room; left out: none"),
    Key("effects", "response_level", "normalized|file", "", "", "file", "as loud as without it, or as in the file"),
    *_parameters(),
)
HAND = "graze_"  # prefix to a [neck] key: the neck that sets the hand's unit of force
SECTIONS = tuple(dict.fromkeys(key.section for key in KEYS if key.section))


def each_string(key: Key) -> bool:
    """True for a key of [neck], or of the hand's neck, that may list one number per string."""
    return (key.section == "neck" and (key.kind in DIMENSIONS or key.kind == "number")) or key.name.startswith(HAND)


@functools.cache
def keys_of(section: str) -> tuple[Key, ...]:
    """The keys of `section`, in the order of KEYS."""
    return tuple(key for key in KEYS if key.section == section)


@functools.cache
def key_names(section: str) -> tuple[str, ...]:
    """The names of the keys of `section`, in the order of KEYS."""
    return tuple(key.name for key in keys_of(section))


def limits_of(key: Key, unit: str | None = None) -> str:
    """Describes the allowed values of `key` for a message, with quantities in `unit` if given."""
    kind = key.kind.removesuffix("[]")
    if "|" in kind:
        return " or ".join(kind.split("|"))
    if kind == "note":
        return 'a note such as "E1" or "Bb0", or a MIDI number from 0 to 127'
    if kind == "text":
        lines = " in one line" if _has_one_line(key) else ""
        return f"text of {key.minimum} to {key.maximum} characters{lines}" + (", several" if key.kind != kind else "")
    if kind == "tuning":
        return tuning.ALLOWED
    if kind == "temperament":
        return f"{', '.join(tuning.TEMPERAMENTS)}, or a list of {tuning.CENTS_ALLOWED}"
    if kind == "pitch":
        return between(tuning.LOWEST_A4, tuning.HIGHEST_A4, "Hz")
    if kind == "lift":
        return f'{{6 = "0.5 mm"}} with fret numbers and lengths from {key.minimum} to {key.maximum}'
    if kind in DIMENSIONS:
        ends = [(quantity(text, kind), unit or units.unit_of(text, kind)) for text in (key.minimum, key.maximum)]
        minimum, maximum = (format_quantity(value, kind, shown) for value, shown in ends)
        return f"from {minimum} to {maximum}" + (", several" if key.kind != kind else "")
    if kind == "controller":
        return f"a whole number from {key.minimum} to {key.maximum} except {', '.join(map(str, sorted(RESERVED)))}"
    if kind == "key map":
        return f"{', '.join(MAPS)}, or a TOML file, see `livebass presets keymap`"
    if kind == "sound file":
        return f"a sound file such as WAV of at most {LONGEST:g} s, {MIN_RATE} to {MAX_RATE} Hz"
    if kind == "curve":
        points = f"or points of velocities, at most {MAX_POINTS}, such as [[1, 1], [64, 90], [127, 127]]"
        return f"{', '.join(CURVES)}, an exponent from {key.minimum} to {key.maximum}, {points}"
    one = f"{'a whole number' if kind == 'integer' else 'a number'} from {key.minimum} to {key.maximum}"
    return one + (", several" if key.kind != kind else "")


def check_value(key: Key, raw: Any) -> Any:
    """Checks a value `raw` from a file and returns it in SI. Raises ValueError that says what is allowed."""
    kind = key.kind
    if kind.endswith("[]"):
        return _several(key, raw)
    if kind == "lift":
        if not isinstance(raw, dict) or not all(re.fullmatch("[1-9][0-9]?", fret) for fret in raw):
            raise ValueError(f"must be {limits_of(key)}")
        return {int(fret): check_value(replace(key, kind="length"), height) for fret, height in raw.items()}
    if kind == "note":
        return units.note_number(raw)
    if kind == "tuning":
        return tuning.tuning_of(raw)
    if kind == "temperament":
        return tuning.temperament_of(raw) if isinstance(raw, str) else _several(replace(key, kind="number[]"), raw)
    if kind == "pitch":
        return tuning.reference_of(raw)
    if kind in DIMENSIONS:
        if not isinstance(raw, str):
            raise ValueError(f'must be a text with a unit such as "{key.minimum}" (units: {units.allowed_units(kind)})')
        value = quantity(raw, kind)
        good = quantity(key.minimum, kind) <= value <= quantity(key.maximum, kind)
    elif kind == "curve":
        value, good = _curve(key, raw)
    elif kind in ("key map", "sound file"):
        value, good = raw, isinstance(raw, str) and bool(raw.strip())
    elif kind == "text":
        value, good = raw, isinstance(raw, str) and int(key.minimum) <= len(raw.strip()) <= int(key.maximum)
        good = good and not (_has_one_line(key) and any(unicodedata.category(c) == "Cc" for c in raw))
    elif "|" in kind:
        value, good = raw, isinstance(raw, str) and raw in kind.split("|")
    else:
        types = (int,) if kind in ("integer", "controller") else (int, float)
        numeric = isinstance(raw, types) and not isinstance(raw, bool)
        value, good = raw, numeric and float(key.minimum) <= raw <= float(key.maximum)
        good = good and not (kind == "controller" and raw in RESERVED)
    if not good:
        raise ValueError(f"must be {limits_of(key, units.unit_of(raw, kind) if kind in DIMENSIONS else None)}")
    return float(value) if kind == "number" or (kind == "curve" and isinstance(value, int)) else value


def _has_one_line(key: Key) -> bool:
    """True for a name: lists show one per line, so it has no tab, line break or other control character."""
    return key.name != "description"


def _curve(key: Key, raw: Any) -> tuple[Any, bool]:
    """A velocity curve, and True if it is valid."""
    if isinstance(raw, str):
        return raw, raw in CURVES
    if not isinstance(raw, (list, tuple)):
        number = isinstance(raw, (int, float)) and not isinstance(raw, bool)
        return raw, number and float(key.minimum) <= raw <= float(key.maximum)
    for point in raw:
        if not isinstance(point, (list, tuple)) or len(point) != 2:
            return raw, False
        if any(isinstance(v, bool) or not isinstance(v, (int, float)) or not 1 <= v <= 127 for v in point):
            return raw, False
    points = tuple((float(x), float(y)) for x, y in raw)
    return points, 1 <= len(points) <= MAX_POINTS and all(a[0] < b[0] for a, b in pairwise(points))


def items(raw: Any) -> list[Any] | None:
    """The items of a list in a file, [1, 2] or {unit = "mm", values = [1, 2]}, unparsed; None for no list."""
    if isinstance(raw, dict) and set(raw) == {"unit", "values"} and isinstance(raw["values"], list):
        return [f"{quote(v)} {raw['unit']}" if isinstance(v, (int, float)) else v for v in raw["values"]]
    return raw if isinstance(raw, list) else None


def _several(key: Key, raw: Any) -> tuple[Any, ...]:
    """Checks a list of values, or of numbers with a common unit."""
    one = replace(key, kind=key.kind.removesuffix("[]"))
    example = 'a list such as ["E", "A"]' if one.kind == "text" else "a list such as [1, 2]"
    if one.kind in DIMENSIONS:
        unit = next(iter(DIMENSIONS[one.kind].units))
        example = f'a list such as ["1 {unit}", "2 {unit}"] or {{unit = "{unit}", values = [1, 2]}}'
    listed = None if isinstance(raw, dict) and one.kind not in DIMENSIONS else items(raw)
    if not listed:
        raise ValueError(f"must be {example}")
    values = []
    for number, item in enumerate(listed, 1):
        try:
            values.append(check_value(one, item))
        except ValueError as error:
            raise ValueError(complaint(f"item {number}", error, quote(item))) from None
    return tuple(values)


def quote(raw: Any) -> str:
    """Quotes a value of a file for a message: one line of 60 characters at most."""
    try:
        text = f'"{raw}"' if isinstance(raw, str) else repr(raw)
    except ValueError:  # an integer with thousands of digits
        text = "a huge number"
    return text if len(text) <= 60 else f"{text[:57]}..."


def fault(label: str, where: str, why: object, *raw: Any) -> PresetError:
    """An error of the file `label` at `where`, a section and key, with the value `raw` if given."""
    return PresetError(f"{label}: {complaint(where, why, *map(quote, raw))}")


def unknown_name(kind: str, name: str, names: list[str]) -> PresetError:
    """An error about the `name` of a `kind` of file that livebass does not come with."""
    if is_scale(name):
        return PresetError(f"{name}: {SCALE}")
    return PresetError(f"{kind} {quote(name)}: unknown; {nearest(name, names)}; a file needs a path with .toml or /")


def nearest(name: str, names: Sequence[str]) -> str:
    """Advice for an unknown name: similar `names`, or all of them."""
    near = difflib.get_close_matches(name[:40], names, 3, 0.5)
    return f"nearest: {', '.join(near)}" if near else f"there is {', '.join(names)}"
