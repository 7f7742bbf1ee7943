"""Builds an instrument from the parsed tables of a preset file, and reports errors in one line.

`Builder.instrument` reads the tables, `string_and_neck` a [[string]] with its neck, `output` the pickups.
preset/keys.py checks single values, preset/checks.py their combinations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from livebass.model.bench import change_bass
from livebass.model.instrument import (
    Coil,
    Effects,
    Instrument,
    Neck,
    Output,
    Pick,
    Pickup,
    Player,
    String,
    frets_from_geometry,
    note_frequency,
    speaking,
    tilt,
)
from livebass.model.tuning import over_same_body, tune_string, with_capo
from livebass.preset import checks, keys
from livebass.preset.keymap import keys_of_player
from livebass.preset.response import load_response
from livebass.preset.source import PresetError
from livebass.preset.tuning import open_strings
from livebass.rows import units
from livebass.rows.row import REQUIRED, rows
from livebass.rows.techniques import EFFECTS, PARAMETER_ROWS, knob_of
from livebass.rows.units import format_quantity, note_name

# The engine's limits.
LARGEST_COUNTS = {"string": 8, "pickup": 8}  # tables of a section
MAX_SENSING = 4  # pickups that sense one string
MAX_FRETS = 32
TENSION = next(key for key in keys.KEYS if (key.section, key.name) == ("string", "tension"))
MIN_TENSION, MAX_TENSION = rows(String)["tension"].limits  # N
_FRETS = {"fret_positions", "fret_heights"}
MEASURED = _FRETS | {"height_scale", "height_offset"}
GEOMETRY = {"frets", *checks.HEIGHTS_BY_GEOMETRY}


@dataclass(frozen=True)
class Builder:
    """Builds an instrument from the tables of one file, and names that file in every error."""

    label: str
    ships: bool = False  # the file comes with livebass: its notes are known to ring, which takes long to check

    def error(self, where: str, why: str, *raw: Any) -> PresetError:
        """An error at `where`, a section and key, with the value `raw` if given."""
        return keys.fault(self.label, where, why, *raw)

    def unknown(self, where: str, name: str, names: Sequence[str]) -> PresetError:
        return self.error(f"{where}{name[:40]}", f"unknown key; {keys.nearest(name, names)}")

    def table(self, section: str, raw: Any, where: str, defaults: bool = True) -> dict[str, Any]:
        """The checked values of one table, in SI, by key; `defaults` fills in missing keys."""
        if not isinstance(raw, dict):
            raise self.error(where, f"must be a table of keys such as {section}.{keys.key_names(section)[0]}", raw)
        values = {}
        for name in raw:
            if name not in keys.key_names(section):
                raise self.unknown(f"{where}." if section else "", name, keys.key_names(section))
        for key in keys.keys_of(section):
            place = f"{where}.{key.name}" if section else key.name
            if key.name not in raw:
                if not defaults or key.default is None:
                    continue
                if key.default is REQUIRED:
                    raise self.error(place, f"missing; {keys.limits_of(key)} ({key.meaning})")
            item = raw.get(key.name, key.default)
            try:
                values[key.name] = keys.check_value(key, item)
            except ValueError as error:
                raise self.error(place, str(error), item) from None
        return values

    def tables(self, data: dict[str, Any], section: str) -> list[Any]:
        """The [[section]] tables as parsed, at most LARGEST_COUNTS of them."""
        raw, maximum = data.get(section, []), LARGEST_COUNTS[section]
        if not isinstance(raw, list) or len(raw) > maximum:
            raise self.error(section, f"must be [[{section}]] tables, at most {maximum}", raw)
        return raw

    def instrument(self, data: dict[str, Any]) -> Instrument:
        """The bass that `data`, a parsed preset file, describes. Raises PresetError."""
        top = (*keys.key_names(""), *keys.SECTIONS)
        for name in data:
            if name not in top:
                raise self.unknown("", name, top)
        head = self.table("", {k: v for k, v in data.items() if k not in keys.SECTIONS}, "")
        raws = self.tables(data, "string")
        necks = self.for_each_string("neck", data.get("neck", {}), len(raws))
        if not raws:
            raise self.error("string", "missing; at least one [[string]]")
        players = self.for_each_string("player", data.get("player", {}), len(raws))
        made = [self.string_and_neck(raw, i, neck) for i, (raw, neck) in enumerate(zip(raws, necks, strict=True), 1)]
        hands = [self.hand_neck(*given) for given in zip(raws, necks, players, strict=True)]
        names = [s.name.casefold() for s, *_ in made]
        for i, (string, *_) in enumerate(made):
            if names[i] in names[:i]:
                raise self.error(f"string[{string.name}].name", "two strings have this name", string.name)
            if i and string.open_note <= made[i - 1][0].open_note:
                place, note = f"string[{string.name}].open_note", note_name(string.open_note)
                raise self.error(place, "strings go from the lowest to the highest", note)
        pairs = self.tuned(made, head, data)
        own = {name: raw for name, raw in players[0].items() if not name.startswith(keys.HAND)}
        values = self.table("player", own, "player")
        if values["technique"] == "slap":
            values.setdefault("slapped_strings", (len(pairs) + 1) // 2)
        try:
            values["keys"] = keys_of_player(values["keys"], self.label)
        except ValueError as error:
            raise self.error("player.keys", str(error)) from None
        given = data.get("pick", {})
        pick = Pick(**{name: value for name, value in self.table("pick", given, "pick").items() if name in given})
        player = over_same_body(Player(**values, pick=pick), pairs[0][0].length / made[0][0].length)
        for low, high in (
            ("pluck_nearest", "pluck_farthest"),
            ("softest", "hardest"),
            ("strike_softest", "strike_hardest"),
        ):
            below, above = getattr(player, low), getattr(player, high)
            if below > above:
                raise self.error(f"player.{low}", f"must be at most player.{high}, {above}", below)
        if player.slapped_strings > len(pairs):
            raise self.error("player.slapped_strings", f"this bass has {len(pairs)} strings", player.slapped_strings)
        output = self.output(data, pairs)
        grazed = tuple(
            with_capo(string, hand, head["capo"])[1] for (string, *_), hand in zip(made, hands, strict=True) if hand
        )
        for (string, _), neck, given in zip(pairs, grazed, players, strict=False):
            try:
                speaking(string, neck, 0)
            except ValueError as error:
                key = next(name for name in given if name.startswith(keys.HAND))
                raise self.error(f"player.{key}", str(error), given[key]) from None
        bass = Instrument(
            name=head["name"],
            description=head["description"],
            a4=head["a4"],
            strings=tuple(string for string, _ in pairs),
            necks=tuple(neck for _, neck in pairs),
            output=output,
            player=player,
            effects=self.effects(data.get("effects", {})),
            grazed=grazed,
        )
        bass = self.played(bass, self.table("plugin", data.get("plugin", {}), "plugin"))
        return self.on_bench(bass, data["bench"]) if "bench" in data else bass

    @staticmethod
    def played(bass: Instrument, values: dict[str, float]) -> Instrument:
        """The bass played with the values of the table [plugin], as precise as a host's."""
        given = {p.symbol: float(np.float32(values[p.symbol])) for p in PARAMETER_ROWS.values() if values.get(p.symbol)}
        knobs: dict[str, Any] = {name: knob_of(name, given.pop(name)) for name in EFFECTS if name in given}
        return replace(bass, played=tuple(given.items()), effects=replace(bass.effects, **knobs))

    def on_bench(self, bass: Instrument, raw: Any) -> Instrument:
        """The bass changed by the sliders of the table [bench]."""
        made = change_bass(bass, self.table("bench", raw, "bench"))
        for string, neck in zip(made.strings, made.necks, strict=True):
            if not self.ships:
                self.check_notes(string, neck, f"string[{string.name}]", "bench")
        return made

    def effects(self, raw: Any) -> Effects:
        """The effects after the DI. The path of a response is relative to the file."""
        values = self.table("effects", raw, "effects")
        normalized = values.pop("response_level") == "normalized"
        if "response" in values:
            try:
                values["response"] = load_response(Path(self.label).parent / values["response"], normalized)
            except PresetError as error:
                raise self.error("effects.response", str(error)) from None
        return Effects(**values)

    def tuned(
        self, made: list[tuple[String, Neck, str, str]], head: dict[str, Any], data: dict[str, Any]
    ) -> list[tuple[String, Neck]]:
        """The strings and necks of `made`, from `string_and_neck`, tuned and checked.

        head: the checked values of the keys above the tables of `data`.
        """
        opens = [string.open_note for string, *_ in made]
        try:
            wanted = open_strings(opens, head["tuning"], head["a4"], head.get("temperament", ()))
        except ValueError as error:
            key, _, why = str(error).partition(": ")
            raise self.error(key, why, data.get(key)) from None
        frets = min(len(neck.fret_positions) for _, neck, *_ in made)
        if not 0 <= head["capo"] < frets:
            raise self.error("capo", f"must be from 0 to {frets - 1}, as the neck has {frets} frets", head["capo"])
        pairs = []
        for (string, neck, where, place), each in zip(made, wanted, strict=True):
            string = tune_string(string, each.note, each.offsets)
            if not MIN_TENSION <= string.tension <= MAX_TENSION:
                why = f"{note_name(each.note)} needs {format_quantity(string.tension, 'force')} on string {string.name}"
                raise self.error("tuning", f"{why}, which must be {keys.limits_of(TENSION)}", data.get("tuning"))
            string, neck = with_capo(string, neck, head["capo"])
            if not self.ships:
                self.check_notes(string, neck, where, place)
            pairs.append((string, neck))
        return pairs

    def for_each_string(self, section: str, raw: Any, count: int) -> list[dict[str, Any]]:
        """The table `raw` for each of `count` strings; a list instead of a number gives each string its item.

        Values are checked, but the dicts keep the form of the file.
        """
        lists = {}
        if isinstance(raw, dict):
            for key in keys.keys_of(section):
                if keys.each_string(key) and (listed := keys.items(raw.get(key.name))) is not None:
                    place = f"{section}.{key.name}"
                    try:
                        keys.check_value(replace(key, kind=f"{key.kind}[]"), listed)
                    except ValueError as error:
                        raise self.error(place, str(error), raw[key.name]) from None
                    if len(listed) != count:
                        why = f"{len(listed)} values for {count} strings; give one for all, or one for each"
                        raise self.error(place, why)
                    lists[key.name] = listed
            raw = {name: value for name, value in raw.items() if name not in lists}
        self.table(section, raw, section, defaults=False)
        return [raw | {name: listed[i] for name, listed in lists.items()} for i in range(count)]

    def output(self, data: dict[str, Any], pairs: list[tuple[String, Neck]]) -> Output:
        """Output with pickups and circuit; all pickups lie between saddle and neck."""
        coil = Coil(**self.table("coil", data.get("coil", {}), "coil"))
        raws = self.tables(data, "pickup")
        names = [string.name for string, _ in pairs]
        pickups = tuple(self.pickup(raw, f"pickup[{i}]", names) for i, raw in enumerate(raws, 1))
        output = Output(**self.table("output", data.get("output", {}), "output"), pickups=pickups, coil=coil)
        if output.kind == "pickups" and not pickups:
            raise self.error("pickup", "missing; at least one [[pickup]] if output.kind is pickups")
        for name in names:
            sensing = sum(not p.strings or name in p.strings for p in pickups)
            if pickups and not 1 <= sensing <= MAX_SENSING:
                raise self.error("pickup", f"{sensing} of them sense string {name}; there must be 1 to {MAX_SENSING}")
        room = min(string.length - neck_end(neck) for string, neck in pairs)
        ends = f"must be between the saddle and the neck, 0 mm to {checks.mm(room)}"
        for i, p in enumerate(pickups, 1):
            if not p.aperture / 2 <= p.position <= room - p.aperture / 2:
                raise self.error(f"pickup[{i}].position", f"{ends}, aperture included", checks.mm(p.position))
        for key in ("sensor", "sensor_v"):
            if not getattr(output, key) < room:
                raise self.error(f"output.{key}", ends, checks.mm(getattr(output, key)))
        return output

    def pickup(self, raw: Any, where: str, names: list[str]) -> Pickup:
        """One pickup. Matches its `strings`, in any case, to this bass's `names`."""
        values = self.table("pickup", raw, where)
        known = {name.casefold(): name for name in names}
        for name in values.get("strings", ()):
            if name.casefold() not in known:
                raise self.error(f"{where}.strings", f"this bass has {', '.join(names)}", name)
        return Pickup(**values | {"strings": tuple(known[n.casefold()] for n in values.get("strings", ()))})

    def string_and_neck(self, raw: Any, number: int, shared: dict[str, Any]) -> tuple[String, Neck, str, str]:
        """The `number`-th [[string]] table and its neck: `shared` keys, its [neck] table, and its own.

        Returns both as in the file, and the places of both tables, for messages.
        """
        where = f"string[{number}]"
        if isinstance(raw, dict) and isinstance(raw.get("name"), str):
            where = f"string[{raw['name'][:20]}]"
        own = raw.get("neck", {}) if isinstance(raw, dict) else {}
        rest = {k: v for k, v in raw.items() if k != "neck"} if isinstance(raw, dict) else raw
        values = self.table("string", rest, where)
        self.table("neck", own, f"{where}.neck", defaults=False)
        length, neck = self.neck(merged_neck(shared, own), f"{where}.neck" if own else "neck")
        return self.string(values, length, where), neck, where, f"{where}.neck" if own else "neck"

    def hand_neck(self, raw: dict[str, Any], shared: dict[str, Any], player: dict[str, Any]) -> Neck | None:
        """The frets or board whose grazing sets the hand's unit of force on a string; None: the string's own.

        `raw` and `shared` as for `string_and_neck`, which has checked them; `player`: the string's values in the file.
        """
        given = {name: value for name, value in player.items() if name.startswith(keys.HAND)}
        if not given:
            return None
        values = {name.removeprefix(keys.HAND): v for name, v in self.table("player", given, "player", False).items()}
        merged = merged_neck(shared, raw.get("neck", {}))
        why = "not allowed together with a measured"
        if "profile_positions" in merged:
            raise self.error(f"player.{next(iter(given))}", f"{why} profile")
        if merged.keys() & MEASURED and (bent := [name for name in given if name != f"{keys.HAND}action"]):
            raise self.error(f"player.{bent[0]}", f"{why} neck", given[bent[0]])
        _, neck = self.neck({k: v for k, v in merged.items() if k != "lift"}, "neck", values)
        if (high := max(neck.fret_heights)) > 0.0:
            obstacle = "the board" if neck.fretless else "a fret"
            why = f"{obstacle} of this neck stands {checks.mm(high)} above the string"
            raise self.error(f"player.{next(iter(given))}", why)
        return Neck(neck.fret_positions, neck.fret_heights, surface=neck.surface)

    def check_notes(self, string: String, neck: Neck, where: str, place: str) -> None:
        """Checks the notes of every fret; `where` is the string's table, `place` its neck's."""
        for fret in range(len(neck.fret_positions) + 1):
            try:
                speaking(string, neck, fret)
            except ValueError as error:
                counted = " (counted from the capo)" if neck.capo else ""
                obstacle = "board" if neck.fretless else "frets"
                why = f"{error}{counted}; lower the {obstacle} or raise the action"
                raise self.error(f"{where}.neck", why) from None
        self.check_grid(string, neck, place)
        self.check_damping(string, neck, where, place)

    def check_grid(self, string: String, neck: Neck, where: str) -> None:
        """Checks that every fret has a grid point of its own, not at an end of the speaking length."""
        for fret in range(len(neck.fret_positions) + 1):
            s = speaking(string, neck, fret)
            step = s.step
            points = [0, *(round(x / step) for x in s.contact_position), s.grid_points]
            if any(b <= a for a, b in pairwise(points)):
                room = min(b - a for a, b in pairwise([0.0, *neck.fret_positions, string.length]))
                why = "two frets, or a fret and an end of the string, share a grid point; allowed up to"
                raise self.error(f"{where}.grid_step", f"{why} {checks.mm(0.9 * room)}", checks.mm(neck.grid_step))

    def check_damping(self, string: String, neck: Neck, where: str, neck_where: str) -> None:
        """Checks that every mode of the string can ring, at every fret."""
        found = checks.overdamped_mode(string, neck)
        if not found:
            return
        key = next(k for k in keys.KEYS if k.name == found.key)
        kind = key.kind.removesuffix("[]")
        shown = format_quantity(found.value, kind) if kind in units.DIMENSIONS else found.value
        place = neck_where if key.section == "neck" else where
        raise self.error(f"{place}.{found.key}", found.why(kind), shown)

    def string(self, values: dict[str, Any], length: float, where: str) -> String:
        """A string of `length` (m) from its checked values; derives tension and inharmonicity if missing."""
        pitch = note_frequency(values["open_note"])  # Hz
        mu = values["linear_density"]
        speed = 2 * length * pitch
        tension = values.setdefault("tension", mu * (speed * speed))
        if not MIN_TENSION <= tension <= MAX_TENSION:
            note = note_name(values["open_note"])
            why = f"left out, and {note} needs {format_quantity(tension, 'force')}"
            must = f"which must be {keys.limits_of(TENSION)}; another linear_density or open_note would do"
            raise self.error(f"{where}.tension", f"{why}, {must}")
        core = values.pop("core_diameter", None)
        modulus, ratio = values.pop("core_modulus"), values.pop("stiffness_ratio")
        if (core is None) == ("inharmonicity" not in values):
            raise self.error(f"{where}.inharmonicity", "give either this or core_diameter")
        if core is not None:
            if core > values["diameter"]:
                why = f"at most the diameter, {checks.mm(values['diameter'])}"
                raise self.error(f"{where}.core_diameter", why, checks.mm(core))
            fourth = float(Fraction(core) ** 4)  # rounded once, on every system
            bending = ratio * modulus * math.pi * fourth / 64  # N m2
            values["inharmonicity"] = math.pi**2 * bending / (tension * (length * length))
            if values["inharmonicity"] > 0.01:
                why = f"gives B = {values['inharmonicity']:.3g}, allowed up to 0.01"
                raise self.error(f"{where}.core_diameter", why, checks.mm(core))
        natural, law = math.sqrt(tension / mu) / (2 * length), values.get("law_fundamental", pitch)  # Hz
        name, hertz = ("law_fundamental", law)
        if abs(units.cents(natural / pitch)) > 100:
            name, hertz = ("tension", natural)
        if abs(units.cents(hertz / pitch)) > 100:
            note = note_name(values["open_note"])
            why = f"sounds {hertz:.2f} Hz, more than a semitone off {note}, {pitch:.2f} Hz"
            would = mu * (speed * speed) if name == "tension" else pitch
            dimension = "force" if name == "tension" else "frequency"
            shown = format_quantity(values[name], dimension)
            raise self.error(f"{where}.{name}", f"{why}; {format_quantity(would, dimension)} would do", shown)
        modes, dampings = (values.get(f"measured_{k}", ()) for k in ("frequencies", "dampings"))
        self.check_ascending(f"{where}.measured_frequencies", modes, "frequency")
        if len(modes) != len(dampings):
            why = f"{len(dampings)} for {len(modes)} measured_frequencies; there must be one for each"
            raise self.error(f"{where}.measured_dampings", why)
        return String(**values, length=length)

    def neck(self, raw: dict[str, Any], where: str, hand: dict[str, float] | None = None) -> tuple[float, Neck]:
        """Scale length (m) and neck of one string, from measured frets or by geometry.

        hand: heights by geometry (m) that replace the string's own, for the neck that sets the hand's unit of force.
        """
        v = self.table("neck", raw, where) | (hand or {})
        length, lift = v["scale_length"], v.get("lift", {})
        if raw.keys() & MEASURED:
            if raw.keys() & GEOMETRY:
                both = sorted(raw.keys() & GEOMETRY)[0]
                raise self.error(f"{where}.{both}", "not allowed together with measured frets", raw[both])
            x, h = (v.get(k, ()) for k in ("fret_positions", "fret_heights"))
            if not x or len(x) != len(h):
                why = f"{len(h)} for {len(x)} fret_positions; there must be one for each, and at least 1"
                raise self.error(f"{where}.fret_heights", why)
            if len(x) > MAX_FRETS:
                raise self.error(f"{where}.fret_positions", f"{len(x)} frets; there must be at most {MAX_FRETS}")
            self.check_ascending(f"{where}.fret_positions", x, "length", v["grid_step"])
            if not 0 < x[0] <= x[-1] < length:
                off = checks.mm(x[0] if x[0] <= 0 else x[-1])
                raise self.error(f"{where}.fret_positions", f"must be between 0 mm and {checks.mm(length)}", off)
            h = tuple(v["height_scale"] * height + v["height_offset"] for height in h)
            h = tuple(height + lift.get(k, 0.0) for k, height in enumerate(h, 1))
            if hand:
                h = tilt(x, h, v["action"])
        else:
            x, h = frets_from_geometry(length, v["frets"], v["action"], v["relief"], v["nut_height"], lift)
        if lift and max(lift) > len(x):
            raise self.error(f"{where}.lift", f"this neck has frets 1 to {len(x)}", raw["lift"])
        for name in ("conductance_frequencies", "resonance_frequencies"):
            self.check_ascending(f"{where}.{name}", v.get(name, ()), "frequency")
        try:
            admittance = checks.neck_admittance(v)
        except checks.Conflict as found:
            raise self.error(f"{where}.{found.key}", found.why) from None
        self.check_ascending(f"{where}.profile_positions", v.get("profile_positions", ()), "length")
        try:
            h, surface = checks.neck_surface(set(raw), v, x, h)
        except checks.Conflict as found:
            raise self.error(f"{where}.{found.key}", found.why, *found.raw) from None
        as_given = {f.name: v[f.name] for f in fields(Neck) if f.name in v and f.name not in _FRETS}
        return length, Neck(x, h, admittance=admittance, surface=surface, fretless=v["obstacle"] == "board", **as_given)

    def check_ascending(self, where: str, values: tuple[float, ...], dimension: str, minimum: float = 0.0) -> None:
        """Checks that each of `values` is above the one before, by at least `minimum` (rounding errors aside)."""
        for number, (a, b) in enumerate(pairwise(values), 2):
            if b <= a or b - a < minimum * (1 - 1e-9):
                why = f"must ascend, by at least {format_quantity(minimum, dimension)}" if minimum else "must ascend"
                raise self.error(where, f"item {number}, {format_quantity(b, dimension)}: {why}")


def merged_neck(shared: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """The keys of a string's neck: those `shared` by all, unless its `own` replace them."""
    drop = GEOMETRY if own.keys() & _FRETS else MEASURED if own.keys() & GEOMETRY else set()
    drop = drop | checks.replaced_keys(set(own))
    return {k: v for k, v in shared.items() if k not in drop} | own


def neck_end(neck: Neck) -> float:
    """End of the board, or last fret, m from the nut: pickups lie beyond."""
    return max([neck.fret_positions[-1], *(x for x, _ in neck.surface[-1:])])
