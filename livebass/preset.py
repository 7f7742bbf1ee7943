"""Preset files (TOML) to instruments: one table of keys makes parser, limits, messages and reference."""

from __future__ import annotations

import difflib
import math
import os
import re
import stat
import tomllib
from dataclasses import dataclass, replace
from importlib import resources
from importlib.resources.abc import Traversable
from itertools import pairwise
from pathlib import Path
from typing import Any

from livebass import units
from livebass.instrument import (
    Coil,
    Instrument,
    Neck,
    Output,
    Pickup,
    Player,
    String,
    frets_from_geometry,
    note_frequency,
    speaking,
)
from livebass.units import DIMENSIONS, format_quantity, note_name, quantity

LARGEST_FILE = 1_000_000  # bytes
LARGEST_COUNTS = {"string": 12, "pickup": 8}
REQUIRED = object()


class PresetError(ValueError):
    """A preset that cannot be used. One line: file, section.key, value, and what is allowed."""

    def __init__(self, message: str) -> None:
        super().__init__("".join(c if c.isprintable() else " " for c in message))


@dataclass(frozen=True)
class Key:
    """One key of a preset file. Limits and default are written as a file would write them."""

    section: str
    name: str
    kind: str  # a dimension of `units`, number, integer, text, note, choices "a|b"; "[]" after it: several
    least: str
    most: str
    default: Any  # REQUIRED; None: may be left out, see `meaning`
    meaning: str


KEYS = (
    Key("", "name", "text", "1", "80", REQUIRED, "what the bass is called"),
    Key("", "description", "text", "0", "500", "", "one sentence about it"),
    Key("neck", "scale_length", "length", "300 mm", "1500 mm", REQUIRED, "nut to saddle"),
    Key("neck", "frets", "integer", "1", "36", 20, "how many, by geometry"),
    Key("neck", "action", "length", "0 mm", "20 mm", "2 mm", "gap under the open string at fret 12"),
    Key("neck", "relief", "length", "0 mm", "5 mm", "0.3 mm", "hollow of the neck at its middle"),
    Key("neck", "nut_height", "length", "0 mm", "10 mm", "0.5 mm", "gap under the open string at fret 1"),
    Key("neck", "lift", "lift", "-5 mm", "5 mm", None, 'frets that stand proud: {6 = "0.5 mm"}'),
    Key("neck", "fret_positions", "length[]", "0 mm", "1500 mm", None, "measured, from the nut"),
    Key("neck", "fret_heights", "length[]", "-30 mm", "10 mm", None, "measured; negative: below the string"),
    Key("neck", "height_scale", "number", "0", "5", 1.0, "measured heights times this ..."),
    Key("neck", "height_offset", "length", "-10 mm", "10 mm", "0 mm", "... plus this"),
    Key("neck", "contact_stiffness", "number", "1e5", "1e15", 1e13, "K of eq. 6, SI"),
    Key("neck", "contact_exponent", "number", "1", "3", 1.5, "alpha of eq. 6"),
    Key("neck", "grid_step", "length", "0.2 mm", "10 mm", "1 mm", "length of string that a fret pushes on"),
    Key("neck", "conductance_frequencies", "frequency[]", "0 Hz", "100 kHz", None, "of the neck, ascending"),
    Key("neck", "conductance_values", "conductance[]", "0 m/s/N", "10 m/s/N", None, "Re Y of eq. 9 there"),
    Key("string", "name", "text", "1", "20", REQUIRED, "unlike the other strings' names"),
    Key("string", "open_note", "note", "0", "127", REQUIRED, "pitch of the open string"),
    Key("string", "linear_density", "linear density", "0.1 g/m", "200 g/m", REQUIRED, "mass per length"),
    Key("string", "tension", "force", "5 N", "1000 N", None, "left out: what the pitch needs"),
    Key("string", "diameter", "length", "0.1 mm", "10 mm", REQUIRED, "outside"),
    Key("string", "inharmonicity", "number", "0", "0.01", None, "B of eq. 8; or give core_diameter"),
    Key("string", "core_diameter", "length", "0.05 mm", "5 mm", None, "of the core; or give inharmonicity"),
    Key("string", "core_modulus", "modulus", "1 GPa", "500 GPa", "200 GPa", "E of the core; steel: 200 GPa"),
    Key("string", "stiffness_ratio", "number", "1", "10", 1.5, "bending stiffness over that of the core"),
    Key("string", "viscoelastic_angle", "number", "0", "0.5", 0.01, "delta_ve of eq. 11"),
    Key("string", "thermoelastic", "number", "0", "0.01", 6e-6, "1/Q_te of eq. 9"),
    Key("string", "extra_damping", "decay rate", "0 /s", "10000 /s", "0 /s", "a mute, on every mode"),
    Key("string", "extra_damping_slope", "number", "0", "1", 0.0, "1/s added per rad/s of the mode"),
    Key("string", "law_fundamental", "frequency", "5 Hz", "5000 Hz", None, "f0 of eq. 8 if measured"),
    Key("string", "measured_frequencies", "frequency[]", "5 Hz", "100 kHz", None, "first modes, open string"),
    Key("string", "measured_dampings", "decay rate[]", "0 /s", "100000 /s", None, "of the same modes"),
    Key("output", "kind", "pickups|displacement", "", "", "pickups", "magnetic, or the string at the sensor"),
    Key("output", "sensor", "length", "1 mm", "500 mm", "9 mm", "displacement sensor, from the saddle"),
    Key("output", "gain", "number", "0", "1e9", 1.0, "signal per volt, or per metre of displacement"),
    Key("pickup", "position", "length", "1 mm", "800 mm", REQUIRED, "centre, from the saddle"),
    Key("pickup", "aperture", "length", "0 mm", "100 mm", "20 mm", "length of string it senses"),
    Key("pickup", "decay_length", "length", "0.5 mm", "50 mm", "4 mm", "rise that weakens the flux e times"),
    Key("pickup", "level", "number", "-10", "10", 1.0, "in the mix; negative: reversed"),
    Key("coil", "inductance", "inductance", "0.01 H", "50 H", "4 H", "pickup"),
    Key("coil", "resistance", "resistance", "1 ohm", "100 kohm", "7.5 kohm", "pickup"),
    Key("coil", "capacitance", "capacitance", "1 pF", "100 nF", "600 pF", "winding and cable"),
    Key("coil", "volume_pot", "resistance", "1 kohm", "10 Mohm", "250 kohm", "whole track"),
    Key("coil", "tone_pot", "resistance", "1 kohm", "10 Mohm", "250 kohm", "whole track"),
    Key("coil", "tone_capacitor", "capacitance", "10 pF", "10 uF", "47 nF", "behind the tone pot"),
    Key("coil", "tone", "number", "0", "1", 1.0, "0 closed, 1 open"),
    Key("player", "technique", "pluck|slap", "", "", "pluck", "slap: thumb below, pops above"),
    Key("player", "slapped_strings", "integer", "0", "12", 0, "how many the thumb strikes, lowest first"),
    Key("player", "pluck_position", "number", "0.01", "0.99", 0.74, "part of the length, from the stop"),
    Key("player", "pluck_nearest", "number", "0.01", "0.99", 0.55, "the same at controller value 0 ..."),
    Key("player", "pluck_farthest", "number", "0.01", "0.99", 0.93, "... and at 127"),
    Key("player", "rounding", "length", "0.5 mm", "50 mm", "5 mm", "of the corner, standard deviation"),
    Key("player", "softest", "number", "0", "100", 0.08, "apex at velocity 1, in grazing apexes"),
    Key("player", "hardest", "number", "0", "100", 4.5, "apex at velocity 127"),
    Key("player", "greatest_apex", "length", "0.1 mm", "30 mm", "10 mm", "whatever the velocity"),
    Key("player", "strike_position", "number", "0.01", "0.99", 0.32, "of the thumb, part of the length"),
    Key("player", "strike_width", "length", "1 mm", "100 mm", "20 mm", "of the thumb"),
    Key("player", "strike_time", "time", "0.1 ms", "20 ms", "1.5 ms", "the thumb stays on the string"),
    Key("player", "pull_time", "time", "0.1 ms", "100 ms", "2 ms", "finger pulls before it lets go"),
    Key("player", "hand_damping", "decay rate", "0 /s", "10000 /s", "90 /s", "hand that stops a note"),
    Key("player", "bend_range", "number", "0", "24", 2.0, "semitones"),
    Key("player", "out_of_range", "transpose|drop", "", "", "transpose", "notes the bass does not have"),
    Key("player", "position_controller", "integer", "0", "127", 16, "MIDI controller of the pluck position"),
)
_SECTIONS = tuple(dict.fromkeys(key.section for key in KEYS if key.section))
_FRETS = {"fret_positions", "fret_heights"}
_MEASURED = _FRETS | {"height_scale", "height_offset"}
_GEOMETRY = {"frets", "action", "relief", "nut_height"}


def preset_reference() -> str:
    """Every key of a preset file as a markdown table."""
    rows = ["| key | allowed | default | meaning |", "|---|---|---|---|"]
    for key in KEYS:
        default = "required" if key.default is REQUIRED else _default(key)
        name = f"{key.section}.{key.name}" if key.section else key.name
        rows.append(f"| `{name}` | {allowed(key).replace('|', ', ')} | {default} | {key.meaning} |")
    return "\n".join(rows) + "\n"


def allowed(key: Key, unit: str | None = None) -> str:
    """What `key` may be, for people; quantities in `unit` where one is given."""
    kind = key.kind.removesuffix("[]")
    if "|" in kind:
        return " or ".join(kind.split("|"))
    if kind == "note":
        return 'a note such as "E1" or "Bb0", or a MIDI number from 0 to 127'
    if kind == "text":
        return f"text of {key.least} to {key.most} characters"
    if kind == "lift":
        return f'{{6 = "0.5 mm"}} with fret numbers and {key.least} to {key.most} each'
    if kind in DIMENSIONS:
        ends = [(quantity(text, kind), unit or units.unit_of(text, kind)) for text in (key.least, key.most)]
        least, most = (format_quantity(value, kind, shown) for value, shown in ends)
        return f"{least} to {most}" + (", several" if key.kind != kind else "")
    return f"{'a whole number' if kind == 'integer' else 'a number'} from {key.least} to {key.most}"


def _value(key: Key, raw: Any) -> Any:
    """`raw` of the file checked and in SI. Raises ValueError that says what is allowed."""
    kind = key.kind
    if kind.endswith("[]"):
        return _several(key, raw)
    if kind == "lift":
        if not isinstance(raw, dict) or not all(re.fullmatch("[1-9][0-9]?", fret) for fret in raw):
            raise ValueError(allowed(key))
        return {int(fret): _value(replace(key, kind="length"), height) for fret, height in raw.items()}
    if kind == "note":
        return units.note_number(raw)
    if kind in DIMENSIONS:
        if not isinstance(raw, str):
            raise ValueError(
                f'needs a text with a unit such as "{key.least}"; units: {units.allowed_units(kind)}'
            )
        value = quantity(raw, kind)
        good = quantity(key.least, kind) <= value <= quantity(key.most, kind)
    elif kind == "text":
        value, good = raw, isinstance(raw, str) and int(key.least) <= len(raw.strip()) <= int(key.most)
    elif "|" in kind:
        value, good = raw, isinstance(raw, str) and raw in kind.split("|")
    else:
        types = (int,) if kind == "integer" else (int, float)
        numeric = isinstance(raw, types) and not isinstance(raw, bool)
        value, good = raw, numeric and float(key.least) <= raw <= float(key.most)
    if not good:
        raise ValueError(f"allowed: {allowed(key, units.unit_of(raw, kind) if kind in DIMENSIONS else None)}")
    return float(value) if kind == "number" else value


def _several(key: Key, raw: Any) -> tuple[Any, ...]:
    one = replace(key, kind=key.kind.removesuffix("[]"))
    unit = next(iter(DIMENSIONS[one.kind].units))
    if isinstance(raw, dict) and set(raw) == {"unit", "values"} and isinstance(raw["values"], list):
        raw = [f"{_show(v)} {raw['unit']}" if isinstance(v, (int, float)) else v for v in raw["values"]]
    if not isinstance(raw, list) or not raw:
        raise ValueError(f'allowed: ["1 {unit}", "2 {unit}"] or {{unit = "{unit}", values = [1, 2]}}')
    values = []
    for number, item in enumerate(raw, 1):
        try:
            values.append(_value(one, item))
        except ValueError as error:
            raise ValueError(f"item {number}, {_show(item)}: {error}") from None
    return tuple(values)


@dataclass(frozen=True)
class _File:
    """Builds an instrument from the tables of one file; every error names that file."""

    label: str

    def error(self, where: str, why: str, *raw: Any) -> PresetError:
        return PresetError(f"{self.label}: {where}{''.join(f' = {_show(r)}' for r in raw)}: {why}")

    def unknown(self, where: str, name: str, names: list[str]) -> PresetError:
        return self.error(f"{where}{name[:40]}", f"unknown key; {_nearest(name, names)}")

    def table(self, section: str, raw: Any, where: str, defaults: bool = True) -> dict[str, Any]:
        """Checked values of one table in SI, with those it leaves out if `defaults`."""
        if not isinstance(raw, dict):
            raise self.error(where, f"must be a table of keys such as {section}.{_names(section)[0]}", raw)
        values = {}
        for name in raw:
            if name not in _names(section):
                raise self.unknown(f"{where}." if section else "", name, _names(section))
        for key in (k for k in KEYS if k.section == section):
            place = f"{where}.{key.name}" if section else key.name
            if key.name not in raw:
                if not defaults or key.default is None:
                    continue
                if key.default is REQUIRED:
                    raise self.error(place, f"missing; {allowed(key)} ({key.meaning})")
            item = raw.get(key.name, key.default)
            try:
                values[key.name] = _value(key, item)
            except ValueError as error:
                raise self.error(place, str(error), item) from None
        return values

    def tables(self, data: dict[str, Any], section: str) -> list[Any]:
        """The [[section]] tables, at least none and at most LARGEST_COUNTS."""
        raw, most = data.get(section, []), LARGEST_COUNTS[section]
        if not isinstance(raw, list) or len(raw) > most:
            raise self.error(section, f"must be [[{section}]] tables, at most {most}", raw)
        return raw

    def instrument(self, data: dict[str, Any]) -> Instrument:
        top = _names("") + list(_SECTIONS)
        for name in data:
            if name not in top:
                raise self.unknown("", name, top)
        head = self.table("", {k: v for k, v in data.items() if k not in _SECTIONS}, "")
        shared = data.get("neck", {})
        self.table("neck", shared, "neck", defaults=False)
        pairs = [self.string_and_neck(raw, i, shared) for i, raw in enumerate(self.tables(data, "string"), 1)]
        if not pairs:
            raise self.error("string", "missing; at least one [[string]]")
        names = [s.name.casefold() for s, _ in pairs]
        for i, (string, _) in enumerate(pairs):
            if names[i] in names[:i]:
                raise self.error(f"string[{string.name}].name", "two strings have this name", string.name)
            if i and string.open_note <= pairs[i - 1][0].open_note:
                place, note = f"string[{string.name}].open_note", note_name(string.open_note)
                raise self.error(place, "strings go from the lowest to the highest", note)
        player = Player(**self.table("player", data.get("player", {}), "player"))
        for low, high in (("pluck_nearest", "pluck_farthest"), ("softest", "hardest")):
            below, above = getattr(player, low), getattr(player, high)
            if below > above:
                raise self.error(f"player.{low}", f"at most player.{high}, {above}", below)
        if player.slapped_strings > len(pairs):
            raise self.error("player.slapped_strings", f"this bass has {len(pairs)}", player.slapped_strings)
        strings, necks = zip(*pairs, strict=True)
        output = self.output(data, pairs)
        return Instrument(**head, strings=strings, necks=necks, output=output, player=player)

    def output(self, data: dict[str, Any], pairs: list[tuple[String, Neck]]) -> Output:
        coil = Coil(**self.table("coil", data.get("coil", {}), "coil"))
        raws = self.tables(data, "pickup")
        pickups = tuple(Pickup(**self.table("pickup", raw, f"pickup[{i}]")) for i, raw in enumerate(raws, 1))
        output = Output(**self.table("output", data.get("output", {}), "output"), pickups=pickups, coil=coil)
        if output.kind == "pickups" and not pickups:
            raise self.error("pickup", "missing; at least one [[pickup]] where output.kind is pickups")
        room = min(string.length - neck.fret_positions[-1] for string, neck in pairs)
        ends = f"allowed: between the saddle and the last fret, 0 mm to {room * 1e3:.4g} mm"
        for i, p in enumerate(pickups, 1):
            if not p.aperture / 2 <= p.position <= room - p.aperture / 2:
                raise self.error(f"pickup[{i}].position", f"with its aperture, {ends}", _mm(p.position))
        if not output.sensor < room:
            raise self.error("output.sensor", ends, _mm(output.sensor))
        return output

    def string_and_neck(self, raw: Any, number: int, shared: dict[str, Any]) -> tuple[String, Neck]:
        where = f"string[{number}]"
        if isinstance(raw, dict) and isinstance(raw.get("name"), str):
            where = f"string[{raw['name'][:20]}]"
        own = raw.get("neck", {}) if isinstance(raw, dict) else {}
        rest = {k: v for k, v in raw.items() if k != "neck"} if isinstance(raw, dict) else raw
        values = self.table("string", rest, where)
        self.table("neck", own, f"{where}.neck", defaults=False)
        drop = _GEOMETRY if own.keys() & _FRETS else _MEASURED if own.keys() & _GEOMETRY else ()
        merged = {k: v for k, v in shared.items() if k not in drop} | own
        length, neck = self.neck(merged, f"{where}.neck" if own else "neck")
        string = self.string(values, length, where)
        for fret in range(len(neck.fret_positions) + 1):
            try:
                speaking(string, neck, fret)
            except ValueError as error:
                raise self.error(f"{where}.neck", f"{error}; lower the frets or raise the action") from None
        return string, neck

    def string(self, values: dict[str, Any], length: float, where: str) -> String:
        pitch = note_frequency(values["open_note"])  # Hz
        mu = values["linear_density"]
        tension = values.setdefault("tension", mu * (2 * length * pitch) ** 2)
        core = values.pop("core_diameter", None)
        modulus, ratio = values.pop("core_modulus"), values.pop("stiffness_ratio")
        if (core is None) == ("inharmonicity" not in values):
            raise self.error(f"{where}.inharmonicity", "give either this or core_diameter")
        if core is not None:
            if core > values["diameter"]:
                why = f"at most the diameter, {_mm(values['diameter'])}"
                raise self.error(f"{where}.core_diameter", why, _mm(core))
            bending = ratio * modulus * math.pi * core**4 / 64  # N m2
            values["inharmonicity"] = math.pi**2 * bending / (tension * length**2)
            if values["inharmonicity"] > 0.01:
                why = f"gives B = {values['inharmonicity']:.3g}, allowed up to 0.01"
                raise self.error(f"{where}.core_diameter", why, _mm(core))
        natural, law = math.sqrt(tension / mu) / (2 * length), values.get("law_fundamental", pitch)  # Hz
        name, hertz = ("law_fundamental", law)
        if abs(units.cents(natural / pitch)) > 100:
            name, hertz = ("tension", natural)
        if abs(units.cents(hertz / pitch)) > 100:
            note = note_name(values["open_note"])
            why = f"sounds {hertz:.2f} Hz, more than a semitone off {note}, {pitch:.2f} Hz"
            would = mu * (2 * length * pitch) ** 2 if name == "tension" else pitch
            dimension = "force" if name == "tension" else "frequency"
            shown = format_quantity(values[name], dimension)
            raise self.error(f"{where}.{name}", f"{why}; {format_quantity(would, dimension)} would do", shown)
        modes, dampings = (values.get(f"measured_{k}", ()) for k in ("frequencies", "dampings"))
        self.ascending(f"{where}.measured_frequencies", modes, "frequency")
        if len(modes) != len(dampings):
            why = f"{len(dampings)} for {len(modes)} measured_frequencies, must be as many"
            raise self.error(f"{where}.measured_dampings", why)
        return String(**values, length=length)

    def neck(self, raw: dict[str, Any], where: str) -> tuple[float, Neck]:
        """Scale length and neck of one string, from measured frets or by geometry."""
        v = self.table("neck", raw, where)
        length, lift = v["scale_length"], v.get("lift", {})
        if raw.keys() & _MEASURED:
            if raw.keys() & _GEOMETRY:
                both = sorted(raw.keys() & _GEOMETRY)[0]
                raise self.error(f"{where}.{both}", "not together with measured frets", raw[both])
            x, h = (v.get(k, ()) for k in ("fret_positions", "fret_heights"))
            if not x or len(x) != len(h):
                why = f"{len(h)} for {len(x)} fret_positions, must be as many, at least 1"
                raise self.error(f"{where}.fret_heights", why)
            self.ascending(f"{where}.fret_positions", x, "length", v["grid_step"])
            if not 0 < x[0] <= x[-1] < length:
                off = _mm(x[0] if x[0] <= 0 else x[-1])
                raise self.error(f"{where}.fret_positions", f"allowed: between 0 mm and {_mm(length)}", off)
            h = tuple(v["height_scale"] * height + v["height_offset"] for height in h)
            h = tuple(height + lift.get(k, 0.0) for k, height in enumerate(h, 1))
        else:
            x, h = frets_from_geometry(length, v["frets"], v["action"], v["relief"], v["nut_height"], lift)
        if lift and max(lift) > len(x):
            raise self.error(f"{where}.lift", f"this neck has frets 1 to {len(x)}", raw["lift"])
        nu, re_y = (v.get(f"conductance_{k}", ()) for k in ("frequencies", "values"))
        self.ascending(f"{where}.conductance_frequencies", nu, "frequency")
        if len(nu) != len(re_y):
            why = f"{len(re_y)} for {len(nu)} conductance_frequencies, must be as many"
            raise self.error(f"{where}.conductance_values", why)
        same = {k: v[k] for k in ("contact_stiffness", "contact_exponent", "grid_step")}
        return length, Neck(x, h, conductance=tuple(zip(nu, re_y, strict=True)), **same)

    def ascending(self, where: str, values: tuple[float, ...], dimension: str, least: float = 0.0) -> None:
        """Each of `values` must be above the one before, by `least` or more (a rounding error aside)."""
        for number, (a, b) in enumerate(pairwise(values), 2):
            if b <= a or b - a < least * (1 - 1e-9):
                why = (
                    f"must ascend, by at least {format_quantity(least, dimension)}"
                    if least
                    else "must ascend"
                )
                raise self.error(where, f"item {number}, {format_quantity(b, dimension)}: {why}")


def preset_names() -> list[str]:
    """Names of the presets that come with livebass, sorted."""
    return sorted(f.name.removesuffix(".toml") for f in _shipped().iterdir() if f.name.endswith(".toml"))


def load_preset(name_or_path: str | os.PathLike[str]) -> Instrument:
    """The instrument of a preset that comes with livebass, or of a file (a path ends in .toml or has a /).

    Raises PresetError, one line, for whatever is wrong with the file or what it says.
    """
    label, text = _read(name_or_path)
    return _File(label).instrument(_parse(label, text))


def preset_text(name_or_path: str | os.PathLike[str]) -> str:
    """The preset file as it is, then as comments the keys it leaves to their defaults. Raises PresetError."""
    label, text = _read(name_or_path)
    data = _parse(label, text)
    _File(label).instrument(data)
    lines = []
    for key in KEYS:
        tables = data.get(key.section, []) if key.section else data
        given = any(key.name in table for table in (tables if isinstance(tables, list) else [tables]))
        if not given and key.default not in (None, REQUIRED, ""):
            default = f'"{key.default}"' if isinstance(key.default, str) else _default(key)
            lines.append(f"#   {key.section}.{key.name} = {default}  ({allowed(key)}: {key.meaning})\n")
    return text.rstrip("\n") + "\n\n# Not set above, so at the default:\n" + "".join(lines)


def _default(key: Key) -> str:
    return (
        f"{key.default:g}"
        if isinstance(key.default, float)
        else ""
        if key.default is None
        else f"{key.default}"
    )


def _names(section: str) -> list[str]:
    return [key.name for key in KEYS if key.section == section]


def _nearest(name: str, names: list[str]) -> str:
    near = difflib.get_close_matches(name[:40], names, 3, 0.5)
    return f"nearest: {', '.join(near)}" if near else f"allowed: {', '.join(names)}"


def _mm(length: float) -> str:
    return f"{length * 1e3:.4g} mm"


def _show(raw: Any) -> str:
    try:
        text = f'"{raw}"' if isinstance(raw, str) else repr(raw)
    except ValueError:  # an integer of thousands of digits
        text = "a huge number"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _shipped() -> Traversable:
    """The folder of the presets that come with livebass: in the package, or next to it in a checkout."""
    installed = resources.files("livebass") / "presets"
    return installed if installed.is_dir() else Path(__file__).resolve().parent.parent / "presets"


def _read(name_or_path: str | os.PathLike[str]) -> tuple[str, str]:
    """File name for messages, and the text. Raises PresetError."""
    name = os.fspath(name_or_path)
    if not (name.endswith(".toml") or "/" in name or os.sep in name):
        if name not in preset_names():
            known = _nearest(name, preset_names())
            raise PresetError(f"preset {_show(name)}: unknown; {known}; a file needs a path with .toml or /")
        label, raw = f"{name}.toml", (_shipped() / f"{name}.toml").read_bytes()
    else:
        label, raw = name, _bytes(name)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PresetError(f"{label}: not UTF-8 (byte {error.start}); a preset is a TOML text file") from None
    return label, text


def _bytes(path: str) -> bytes:
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode):
            what = "a directory" if stat.S_ISDIR(found.st_mode) else "not a regular file"
            raise PresetError(f"{path}: is {what}; a preset is a TOML text file")
        if found.st_size > LARGEST_FILE:
            raise PresetError(f"{path}: {found.st_size} bytes; a preset has at most {LARGEST_FILE}")
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise PresetError(f"{path}: no such file; shipped presets: {', '.join(preset_names())}") from None
    except PermissionError:
        raise PresetError(f"{path}: no permission to read it") from None
    except OSError as error:
        raise PresetError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise error if isinstance(error, PresetError) else PresetError(f"{path}: not a file name") from None


def _parse(label: str, text: str) -> dict[str, Any]:
    if not text.strip():
        raise PresetError(f"{label}: empty; a preset needs name, [neck] and [[string]]")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        why = "nested too deep" if isinstance(error, RecursionError) else str(error)
        raise PresetError(f"{label}: not TOML: {why}") from None
