"""Finds the keys of a preset file that change no note, whatever their value, and says why.

A key is idle if changing its value leaves the bass the same, apart from fields that affect no note. RULES lists these
fields and their basses: by the groups in their rows (rows.py), or by name.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from livebass.model.instrument import Instrument, Neck, String
from livebass.model.keymap import CURVES, MAPS
from livebass.preset.build import Builder
from livebass.preset.keys import DATACLASSES, KEYS, Key, items, key_names
from livebass.preset.source import PresetError
from livebass.rows.row import rows
from livebass.rows.units import DIMENSIONS, OFF, quantity, split_quantity

NAMES = {("", "name"), ("", "description"), ("string", "name"), ("string", "open_note"), ("pickup", "strings")}


@dataclass(frozen=True)
class Rule:
    """Fields of a section that change no note of a bass if `holds(bass, part)` is true."""

    section: str
    keys: tuple[str, ...]
    why: str
    holds: Callable[[Instrument, Any], bool]


def _straight(bass: Instrument, part: Any) -> bool:
    player = bass.player
    plucked = player.pluck_angle == 0 and player.angle_when_hard == 0 and player.stroke not in ("pick", "pop")
    return plucked and not _is_turned(bass)


def _is_turned(bass: Instrument) -> bool:
    """True if motion up and down becomes motion across."""
    return any(neck.own_across and neck.axes_turned for neck in bass.necks)


def _displacement(bass: Instrument, part: Any) -> bool:
    return bass.output.kind == "displacement"


def _plucks_only(bass: Instrument, part: Any) -> bool:
    return bass.player.technique == "pluck" or not bass.player.slapped_strings


def _slaps_only(bass: Instrument, part: Any) -> bool:
    return bass.player.technique == "slap" and bass.player.slapped_strings == len(bass.strings)


def _is_unpicked(bass: Instrument, part: Any) -> bool:
    return bass.player.stroke != "pick"


def _alone(bass: Instrument, part: Any) -> bool:
    return len(bass.strings) == 1 or not any(n.admittance.resonances or n.admittance.table for n in bass.necks)


NO_PICKUPS = 'output.kind is "displacement", which takes no pickups'
UP_AND_DOWN = "player.pluck_angle is 0, when hard too: strings move up and down, not across"
NO_PICK = 'player.stroke is not "pick": only keys bring it'
STRUCK = "the thumb strikes every string, and none is plucked"

PICKING = key_names("pick")


def _group(name: str, why: str, holds: Callable[[Instrument, Any], bool]) -> list[Rule]:
    """Rules for the rows of the group `name`, one per section."""
    found = [
        Rule(section, tuple(key for key, row in rows(cls).items() if name in row.of.split()), why, holds)
        for section, cls in DATACLASSES.items()
    ]
    return [rule for rule in found if rule.keys]


def _needs(key: str, knob: str, off: str) -> Rule:
    """The rule for a key of the effects that does nothing while another is 0."""
    return Rule(
        "effects", (key,), f"effects.{knob} is {off}: only a knob turns it up", lambda _, e: not getattr(e, knob)
    )


RULES = (
    Rule("coil", key_names("coil"), NO_PICKUPS, _displacement),
    Rule("pickup", key_names("pickup"), NO_PICKUPS, _displacement),
    Rule("string", ("level",), NO_PICKUPS, _displacement),
    Rule("player", ("squeak",), "all strings are flat", lambda bass, _: not any(s.winding for s in bass.strings)),
    *_group(
        "sensor", 'output.kind is "pickups", which takes no sensor', lambda bass, part: not _displacement(bass, part)
    ),
    *_group("across", UP_AND_DOWN, _straight),
    Rule("output", ("sensor_v",), "output.across is 0", lambda bass, output: output.across == 0),
    Rule(
        "pickup",
        tuple(name for name in key_names("pickup") if name not in ("level", "strings")),
        "this pickup's level is 0",
        lambda bass, pickup: pickup.level == 0,
    ),
    Rule(
        "neck",
        ("axes_turned",),
        "strings move across as they move up: see neck.stiffness_across and neck.longer_across",
        lambda bass, neck: not neck.own_across,
    ),
    Rule("string", ("relaxation_frequency",), "string.relaxation is 0", lambda bass, string: string.relaxation == 0),
    Rule("neck", ("friction_speed",), "neck.friction is 0", lambda bass, neck: neck.friction == 0),
    Rule("neck", ("free_length", "stiffness_across"), "the neck is rigid", lambda bass, neck: not _bends(neck)),
    Rule("neck", ("stop_across",), "neck.stop_conductance is 0", lambda bass, neck: neck.stop_conductance == 0),
    Rule("player", ("answering",), "no string moves another: the neck is rigid, or there is one string", _alone),
    *_group(
        "answers", 'player.answering is "off"', lambda bass, player: player.answering == "off" or _alone(bass, player)
    ),
    *_group("floor", "player.floor_noise is off", lambda bass, player: player.floor_noise <= OFF),
    *_group("release", "player.release_noise is off", lambda bass, player: player.release_noise <= OFF),
    *_group("hum", "player.hum is off", lambda bass, player: player.hum <= OFF),
    Rule("player", ("technique",), "player.slapped_strings is 0", lambda bass, player: player.slapped_strings == 0),
    Rule(
        "player", ("slapped_strings",), 'player.technique is "pluck"', lambda bass, player: player.technique == "pluck"
    ),
    *_group("thumb", "no string is slapped: see player.technique", _plucks_only),
    *_group(
        "bounce",
        "no string is slapped by a thumb with a mass: see player.thumb_mass",
        lambda bass, player: _plucks_only(bass, player) or player.thumb_mass == 0 or bass.over_board,
    ),
    *_group(
        "impulse",
        "player.thumb_mass is given: the thumb is no impulse",
        lambda bass, player: player.thumb_mass > 0 and not bass.over_board,
    ),
    Rule("player", ("thumb_mass",), "over a board the thumb is an impulse", lambda bass, player: bass.over_board),
    *_group(
        "palm",
        "no palm rests on the strings: player.palm_resistance is 0",
        lambda _, player: not player.palm_resistance,
    ),
    *_group("pluck", STRUCK, _slaps_only),
    *_group("across", STRUCK, lambda bass, part: _slaps_only(bass, part) and not _is_turned(bass)),
    Rule("pick", PICKING, STRUCK, _slaps_only),
    Rule("pick", PICKING, NO_PICK, _is_unpicked),
    *_group("pick", NO_PICK, _is_unpicked),
    _needs("eq_low_mid_frequency", "eq_low_mid", "0 dB"),
    _needs("eq_high_mid_frequency", "eq_high_mid", "0 dB"),
    _needs("clean_blend", "drive", "0"),
)
# Keys without a field of their own: why they may be idle.
NO_CORE = "string.inharmonicity is given, not core_diameter"
WITHOUT_FIELD = {
    ("string", "core_modulus"): NO_CORE, ("string", "stiffness_ratio"): NO_CORE,
    ("effects", "response_level"): "effects.response is missing",
}  # fmt: skip


def _bends(neck: Neck) -> bool:
    """True if the neck's effect on a string depends on where the neck ends."""
    return bool(neck.admittance.table) or any(r.shape for r in neck.admittance.resonances)


class _Unchecked(Builder):
    """A Builder that does not check notes, which takes 0.1 s a string."""

    def check_notes(self, string: String, neck: Neck, where: str, place: str) -> None:
        pass


@dataclass(frozen=True)
class Given:
    """A key of a file, and its place."""

    place: str  # for messages, "string[E].neck.action"
    key: Key
    path: tuple[str | int, ...]  # into the file's tables, without the key's name
    raw: Any

    def with_value(self, data: dict[str, Any], raw: Any) -> dict[str, Any]:
        """A copy of `data` in which the key has the value `raw`."""
        changed = copy.deepcopy(data)
        table: Any = changed
        for step in self.path:
            table = table[step]
        table[self.key.name] = raw
        return changed


def idle_keys(data: dict[str, Any], label: str = "") -> list[tuple[str, str]]:
    """Keys in a preset's parsed tables `data` that change no note, as (place, why), in file order.

    `label` is the path of the file. The path of a key map is relative to it.

    Raises PresetError for tables that make no bass.
    """
    builder = _Unchecked(label)
    bass = builder.instrument(data)
    heard = _heard_fields(bass)
    idle = (given for given in given_keys(data) if _is_idle(given, data, heard, builder))
    return [(given.place, _why(given, data, bass)) for given in idle]


def _is_idle(given: Given, data: dict[str, Any], heard: Instrument, builder: Builder) -> bool:
    """True if other values of a key leave `heard` as is; values that make no bass do not count."""
    idle = False
    for raw in other_values(given.key, given.raw):
        try:
            other = _heard_fields(builder.instrument(given.with_value(data, raw)))
        except PresetError:
            continue
        if other != heard:
            return False
        idle = True
    return idle


def given_keys(data: dict[str, Any]) -> Iterator[Given]:
    """Every key in `data` that a note could depend on."""
    for section, table in data.items():
        several = isinstance(table, list)
        for i, one in enumerate(table if several else [table]):
            if not isinstance(one, dict):
                continue
            path: tuple[str | int, ...] = (section, i) if several else (section,)
            label = f"{section}[{one.get('name', i + 1)}]" if several else section
            yield from _keys_of(section, one, label, path)
            if section == "string":
                yield from _keys_of("neck", one.get("neck", {}), f"{label}.neck", (*path, "neck"))


def _keys_of(section: str, table: dict[str, Any], label: str, path: tuple[str | int, ...]) -> Iterator[Given]:
    for key in KEYS:
        if key.section == section and key.name in table and (section, key.name) not in NAMES:
            yield Given(f"{label}.{key.name}", key, path, table[key.name])


def other_values(key: Key, raw: Any) -> Iterator[Any]:
    """Values other than `raw` for a key, in the form of a file."""
    kind = key.kind.removesuffix("[]")
    if "|" in kind:
        yield from (choice for choice in kind.split("|") if choice != raw)
    elif kind in ("curve", "key map"):
        yield from (choice for choice in (CURVES if kind == "curve" else MAPS) if choice != raw)
    elif kind == "lift":
        one = replace(key, kind="length")
        yield {fret: next(iter(other_values(one, height))) for fret, height in raw.items()}
    elif (listed := items(raw)) is not None:
        each = [list(other_values(replace(key, kind=kind), item)) for item in listed]
        yield from (list(row) for row in zip(*each, strict=False))
    elif kind in DIMENSIONS:
        number, unit = split_quantity(raw, kind)
        size = DIMENSIONS[kind].units[unit]
        ends = [quantity(end, kind) / size for end in (key.minimum, key.maximum)]
        yield from (f"{other!r} {unit}" for other in _other_numbers(number, ends))
    elif kind == "number":
        yield from _other_numbers(raw, [float(key.minimum), float(key.maximum)])
    elif kind in ("integer", "controller"):
        yield from (raw + 1, raw - 1)


def _other_numbers(number: float, ends: list[float]) -> tuple[float, ...]:
    """Two numbers near `number`, within the ends or not; near 0, some up to the upper end."""
    return (number * 0.9, number * 1.1) if number else (ends[1] * 1e-3, ends[1] * 1e-2, ends[1])


def _parts(bass: Instrument) -> dict[str, list[Any]]:
    """The parts of `bass` that each section of a file describes, in order."""
    output, player = bass.output, bass.player
    return {
        "string": [*bass.strings], "neck": [*bass.necks], "pickup": [*output.pickups], "coil": [output.coil],
        "output": [output], "player": [player], "pick": [player.pick], "effects": [bass.effects],
    }  # fmt: skip


def _heard_fields(bass: Instrument) -> Instrument:
    """`bass` with defaults for all fields that change none of its notes."""
    parts = _parts(bass)
    for rule in RULES:
        defaults = {name: getattr(DATACLASSES[rule.section], name, None) for name in rule.keys}
        parts[rule.section] = [replace(p, **defaults) if rule.holds(bass, p) else p for p in parts[rule.section]]
    output = replace(parts["output"][0], pickups=tuple(parts["pickup"]), coil=parts["coil"][0])
    player = replace(parts["player"][0], pick=parts["pick"][0])
    strings, necks = tuple(parts["string"]), tuple(parts["neck"])
    return replace(bass, strings=strings, necks=necks, output=output, player=player, effects=parts["effects"][0])


def _why(given: Given, data: dict[str, Any], bass: Instrument) -> str:
    """Says why an idle key is idle."""
    key, own = given.key, [string.get("neck", {}) for string in data["string"]]
    if given.path == ("neck",):
        if all(key.name in neck for neck in own):
            return "every string has its own"
        if all(own):
            return "the neck. keys of every string take its place"
    if (key.section, key.name) in WITHOUT_FIELD:
        return WITHOUT_FIELD[key.section, key.name]
    for rule in RULES:
        if rule.section == key.section and key.name in rule.keys and _holds(rule, given, bass):
            return rule.why
    return "other keys leave it without effect"


def _holds(rule: Rule, given: Given, bass: Instrument) -> bool:
    """True if `rule` holds for the part of the bass that has the key."""
    parts, number = _parts(bass)[rule.section], given.path[1:2]
    return all(rule.holds(bass, part) for part in ([parts[int(number[0])]] if number else parts))
