"""The luthier's bench of a page: what can be changed of a bass there, and the numbers that the page needs for it.

A row of CONTROLS is a slider. It stands for a key of preset files, whose unit and limits are in preset/keys.py; the
page (static/bench.js) writes the keys that differ into a preset that is like the bass, and makes the notes anew by the
kernels (static/maker.js), as `livebass render` of that preset does.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from livebass.engine.image import bench_of, frets_of
from livebass.engine.prepare import BEYOND, is_heavy
from livebass.kernels.bass.instrument import WORD
from livebass.model.instrument import Instrument, Pickup, String
from livebass.plugin.instrument import all_that_some_have, tiers, tiers_by_loss
from livebass.preset.build import MEASURED, Builder, merged_neck, neck_end
from livebass.preset.load import load_preset, preset_tables
from livebass.preset.source import is_path
from livebass.rows import rows
from livebass.units import DIMENSIONS

BENCH_ENDING = ".bench"


class Control(NamedTuple):
    """A slider of the bench. Its limits are within those of its key."""

    symbol: str  # in links; of pickups with their number behind, of a fret's lift with that of the fret
    group: str  # neck, strings, pickups, hand
    name: str
    key: str  # section.name of preset/keys.py
    unit: str  # of its values, and of the preset that is written; of a factor "x"; "" for plain numbers
    least: float
    most: float
    step: float
    help: str


CONTROLS = (
    Control(
        "action", "neck", "Action", "neck.action", "mm", 0.5, 6, 0.05,
        "gap under the lowest string at fret 12; the others go with it",
    ),
    Control(
        "relief", "neck", "Relief", "neck.relief", "mm", 0, 2, 0.02,
        "hollow of the neck at its middle",
    ),
    Control(
        "nut_height", "neck", "Nut", "neck.nut_height", "mm", 0.1, 2, 0.02,
        "gap under the open strings at fret 1",
    ),
    Control(
        "lift", "neck", "Fret up or down", "neck.lift", "mm", -0.5, 1.5, 0.02,
        "one fret stands proud, or is worn",
    ),
    Control(
        "contact_loss", "neck", "Loss at the frets", "neck.contact_loss", "N s/m", 0, 800, 5,
        "what a fret takes from a string that hits it",
    ),
    Control(
        "resonance", "neck", "Neck resonance", "neck.resonance_frequencies", "Hz", 80, 250, 0.5,
        "the lowest at which the neck bends; notes near it die early",
    ),
    Control(
        "resonance_mass", "neck", "Neck mass there", "neck.resonance_masses", "kg", 0.2, 3, 0.01,
        "lighter: the dead spot is deeper",
    ),
    Control(
        "gauge", "strings", "Gauge", "string.diameter", "x", 0.7, 1.4, 0.01,
        "thickness of all strings, at the same pitch",
    ),
    Control(
        "tension", "strings", "Tension", "string.tension", "x", 0.75, 1.3, 0.01,
        "of all strings, heavier for their thickness",
    ),
    Control(
        "damping", "strings", "Wear", "string.thermoelastic", "x", 0.5, 12, 0.1,
        "losses inside the strings: new ones have little, old ones much",
    ),
    Control(
        "mute", "strings", "Foam", "string.extra_damping", "/s", 0, 60, 0.5,
        "damping that a mute adds to all strings",
    ),
    Control(
        "pickup", "pickups", "Place", "pickup.position", "mm", 10, 400, 0.5,
        "centre, from the saddle",
    ),
    Control(
        "height", "pickups", "Height", "pickup.level", "mm", -3, 3, 0.05,
        "nearer to the strings, or farther away",
    ),
    Control(
        "tone", "pickups", "Tone pot", "coil.tone", "", 0, 1, 0.01,
        "0 closed, 1 open",
    ),
    Control(
        "cable", "pickups", "Cable", "coil.capacitance", "pF", 200, 5000, 10,
        "capacitance of windings and cable",
    ),
    Control(
        "pluck_position", "hand", "Plucks at", "player.pluck_position", "", 0.5, 0.98, 0.005,
        "part of the open string, from the nut",
    ),
    Control(
        "rounding", "hand", "Finger", "player.rounding", "mm", 0.5, 20, 0.1,
        "half of what touches the string: narrow is bright",
    ),
    Control(
        "hardest", "hand", "Hardest pluck", "player.hardest", "", 1, 12, 0.05,
        "at velocity 127; at 1 the open string grazes a fret",
    ),
)  # fmt: skip
MM = 1e-3
LEAST_FRETS = 3  # of a neck whose heights follow from action, relief and nut
NECK = ("action", "relief", "nut_height")
STRING = ("diameter", "linear_density", "tension", "inharmonicity", "axial_stiffness")  # by gauge and tension
LOSSES = ("viscoelastic_angle", "thermoelastic", "extra_damping")
UNITS = {  # of the keys that the page writes, and their dimensions
    "mm": "length", "N s/m": "mechanical resistance", "Hz": "frequency", "kg": "mass", "g/m": "linear density",
    "N": "force", "/s": "decay rate", "pF": "capacitance",
}  # fmt: skip


@dataclass(frozen=True)
class Source:
    """The preset that a bass of a page was made of, and keys at the top that were given in place of its own."""

    preset: str
    given: Mapping[str, Any] = field(default_factory=dict)


def bench(bass: Instrument, source: Source) -> dict[str, Any] | None:
    """Returns what the page must know to change a bass; None for one that no preset like its source can be."""
    same = load_preset(source.preset, **source.given)
    if replace(same, player=bass.player, effects=bass.effects) != bass:
        return None
    if bass.effects.response != same.effects.response or bass.player.answering != "off" or bass.grazed:
        return None
    label, data = preset_tables(source.preset)
    known: dict[str, Any] = {
        "like": Path(source.preset).name if is_path(source.preset) else source.preset,
        "head": head(bass, same, source),
        "neck": neck_numbers(bass, label, data),
        "contact": contact_numbers(bass),
        "resonance": resonance_numbers(bass),
        "strings": string_numbers(bass),
        "pickups": pickup_numbers(bass),
        "coil": {name: getattr(bass.output.coil, name) for name in ("tone", "capacitance")},
        "player": {name: getattr(bass.player, name) for name in ("pluck_position", "rounding", "hardest")},
    }
    return known | {"controls": [c._asdict() for c in controls(bass, known)]}


def head(bass: Instrument, same: Instrument, source: Source) -> dict[str, dict[str, str]]:
    """What a preset like the source says to be the bass as it is here: keys and values as TOML, by section."""
    made = {"": {name: toml(value) for name, value in source.given.items()}}
    for section, own, other in (("player", bass.player, same.player), ("effects", bass.effects, same.effects)):
        kinds = {name: row.kind for name, row in rows(type(own)).items()}
        kinds |= {"velocity_curve": ""} if section == "player" else {}
        values = {name: getattr(own, name) for name in kinds if getattr(own, name) != getattr(other, name)}
        made[section] = {name: toml(value, kinds[name]) for name, value in values.items()}
    return {section: keys for section, keys in made.items() if keys}


def toml(value: Any, kind: str = "") -> str:
    """A value as a preset has it; of a dimension, in SI, with the unit that is 1 there."""
    if kind in DIMENSIONS:
        return f'"{value!r} {next(unit for unit, size in DIMENSIONS[kind].units.items() if size == 1.0)}"'
    if isinstance(value, tuple | list):
        return f"[{', '.join(toml(item) for item in value)}]"
    return json.dumps(value, ensure_ascii=False)


def neck_numbers(bass: Instrument, label: str, data: dict[str, Any]) -> dict[str, Any] | None:
    """The heights by geometry (m) of each string, and its frets that stand proud; None for a neck with others."""
    builder, raws = Builder(label), data["string"]
    shared = builder.for_each_string("neck", data.get("neck", {}), len(raws))
    given = [merged_neck(neck, raw.get("neck", {})) for neck, raw in zip(shared, raws, strict=True)]
    values = [builder.table("neck", each, "neck") for each in given]
    if any(each.keys() & MEASURED for each in given) or any(v["obstacle"] == "profile" for v in values):
        return None
    if any(neck.capo or len(neck.fret_positions) < LEAST_FRETS for neck in bass.necks):
        return None
    lifts = [{k: height for k, height in v.get("lift", {}).items() if height} for v in values]
    if any(each != lifts[0] for each in lifts):
        return None
    made: dict[str, Any] = {name: [v[name] for v in values] for name in NECK}
    return made | {"lift": lifts[0], "fretted": not bass.over_board}


def contact_numbers(bass: Instrument) -> dict[str, Any] | None:
    """The loss at the frets (N s/m), the force that presses each string in (N), and the tiers by loss (s/m)."""
    if len({bool(neck.surface) for neck in bass.necks}) > 1:
        return None
    ranges = [
        {"from": least, "tiers": [[q.modes or 0, q.contact_rate, int(is_heavy(q))] for q in found]}
        for least, found in tiers_by_loss(bass)
    ]
    loss_of = [neck.contact_loss for neck in bass.necks]
    return {"loss": loss_of, "pressing": [neck.pressing for neck in bass.necks], "tiers": ranges}


def resonance_numbers(bass: Instrument) -> dict[str, Any] | None:
    """The resonances of the neck, and which is the lowest that bends it; None for a neck that has none such."""
    found = bass.necks[0].admittance.resonances
    lowest = next((k for k, r in enumerate(found) if r.shape == 1), None)
    if lowest is None or any(neck.admittance.resonances != found for neck in bass.necks):
        return None
    return {
        "lowest": lowest,
        "frequencies": [r.frequency for r in found],
        "qualities": [r.quality for r in found],
        "masses": [r.mass for r in found],
        "shapes": [r.shape for r in found],
    }


def string_numbers(bass: Instrument) -> list[dict[str, Any]] | None:
    """The numbers of the strings, in SI; None for those that are tuned otherwise, or under a capo, or measured."""
    if any(s.own_note is not None or s.measured_frequencies for s in bass.strings):
        return None
    made = []
    for string in bass.strings:
        numbers = {name: getattr(string, name) for name in (*STRING, *LOSSES)}
        made.append(numbers | {"name": string.name, "stretches": 2 * (string.length + BEYOND)})
    return made


def pickup_numbers(bass: Instrument) -> list[dict[str, Any]]:
    """The pickups: names, numbers in SI, and for each string that they sense its number, level, and which tap it is."""
    if bass.output.kind == "displacement":
        return []
    room = min(s.length - neck_end(neck) for s, neck in zip(bass.strings, bass.necks, strict=True))
    taps, made = [0] * len(bass.strings), []
    for pickup in bass.output.pickups:
        senses = []
        for i, string in enumerate(bass.strings):
            if not pickup.strings or string.name in pickup.strings:
                senses.append([i, taps[i], string.level])
                taps[i] += 1
        numbers = {name: getattr(pickup, name) for name in ("position", "level", "decay_length")}
        ends = [pickup.aperture / 2, room - pickup.aperture / 2]
        made.append(numbers | {"name": called(pickup, bass), "senses": senses, "ends": ends})
    return made


def called(pickup: Pickup, bass: Instrument) -> str:
    """What a pickup is called among those of its bass."""
    if pickup.strings:
        return f"Pickup under {' '.join(pickup.strings)}"
    others = [p.position for p in bass.output.pickups if p is not pickup]
    if len(others) != 1:
        return "Pickup" if not others else f"Pickup {1 + sum(p > pickup.position for p in others)}"
    return "Neck pickup" if pickup.position > others[0] else "Bridge pickup"


def controls(bass: Instrument, known: dict[str, Any]) -> Iterator[Control]:
    """The sliders that this bass has, one for each pickup, with its own limits."""
    neck, resonance = known["neck"], known["resonance"]
    there = {
        "action": neck, "relief": neck, "nut_height": neck, "lift": neck and neck["fretted"],
        "contact_loss": known["contact"], "resonance": resonance, "resonance_mass": resonance,
        "gauge": known["strings"], "tension": known["strings"], "damping": known["strings"], "mute": known["strings"],
        "tone": known["pickups"], "cable": known["pickups"], "pluck_position": not bass.necks[0].capo,
        "rounding": True, "hardest": True,
    }  # fmt: skip
    for control in CONTROLS:
        if control.symbol == "pickup":  # and its height
            height = CONTROLS[CONTROLS.index(control) + 1]
            for k, pickup in enumerate(known["pickups"], 1):
                yield within(numbered(control, k, pickup), *(end / MM for end in pickup["ends"]))
                yield numbered(height, k, pickup)
        elif control.symbol == "height":
            continue
        elif control.symbol == "hardest":
            yield within(control, bass.player.softest, control.most)
        elif control.symbol == "damping" and known["strings"]:
            losses = [
                (rows(String)[name].limits[1], string[name]) for string in known["strings"] for name in LOSSES[:2]
            ]
            yield within(control, control.least, min(most / loss for most, loss in losses if loss))
        elif control.symbol == "resonance" and resonance:
            yield within(control, *between(resonance["frequencies"], resonance["lowest"]))
        elif there[control.symbol]:
            yield control


def numbered(control: Control, k: int, pickup: dict[str, Any]) -> Control:
    """The slider of the `k`-th pickup, from 1."""
    return control._replace(symbol=f"{control.symbol}{k}", name=f"{pickup['name']}: {control.name.lower()}")


def within(control: Control, least: float, most: float) -> Control:
    """`control` with limits that are not beyond these."""
    steps = math.ceil((max(control.least, least) - control.least) / control.step - 1e-9)
    return control._replace(least=control.least + steps * control.step, most=min(control.most, most))


def between(ascending: Sequence[float], k: int) -> tuple[float, float]:
    """Between what item `k` of an ascending list may be, without those beside it."""
    below = ascending[k - 1] + 1 if k else 0.0
    return below, ascending[k + 1] - 1 if k + 1 < len(ascending) else math.inf


def bench_file(bass: Instrument) -> bytes:
    """The BENCH of a bass, for the kernels: how many numbers it has, the record, the numbers; and the strokes and
    effects of a file whose hand measures its force by another neck (kernels/bass/instrument.py).
    """
    made = bench_of(bass, tiers(bass), frets_of(bass))
    return len(made.numbers).to_bytes(WORD, "little") + made.data() + all_that_some_have(bass)
