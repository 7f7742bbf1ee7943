"""The page's bench: the sliders of a bass, and the data with which the page shows and saves them.

The sliders are rows of techniques.py. The kernels build the changed bass (kernels/bass/change.py); the page shows the
resulting values and writes the slider values into links and presets.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from livebass.model.bench import change_bass
from livebass.model.instrument import Instrument, Pickup
from livebass.preset.load import load_preset, preset_tables
from livebass.preset.source import is_path
from livebass.rows.row import rows
from livebass.rows.techniques import OWN_PICKUPS, RENAMED, SLIDER_ROWS
from livebass.rows.units import DIMENSIONS


@dataclass(frozen=True)
class Source:
    """The preset that a page's bass was made from, and the top-level keys given in place of the preset's own."""

    preset: str
    given: Mapping[str, Any] = field(default_factory=dict)


def bench(bass: Instrument, source: Source) -> dict[str, Any] | None:
    """Returns the data the page needs to change a bass; None if no preset like its source can describe the bass."""
    same = load_preset(source.preset, **source.given)
    if replace(same, player=bass.player, effects=bass.effects) != bass:
        return None
    if bass.effects.response != same.effects.response:
        return None
    if bass.grazed or "bench" in preset_tables(source.preset)[1]:
        return None
    return {
        "like": Path(source.preset).name if is_path(source.preset) else source.preset,
        "head": head(bass, same, source),
        "sliders": list(sliders(bass)),
        "renamed": RENAMED,
    }


def head(bass: Instrument, same: Instrument, source: Source) -> dict[str, dict[str, str]]:
    """Returns the keys and values (TOML, by section) that turn a preset like the source into this bass."""
    made = {"": {name: toml(value) for name, value in source.given.items()}}
    for section, own, other in (("player", bass.player, same.player), ("effects", bass.effects, same.effects)):
        kinds = {name: row.kind for name, row in rows(type(own)).items()}
        kinds |= {"velocity_curve": ""} if section == "player" else {}
        values = {name: getattr(own, name) for name in kinds if getattr(own, name) != getattr(other, name)}
        made[section] = {name: toml(value, kinds[name]) for name, value in values.items()}
    return {section: keys for section, keys in made.items() if keys}


def toml(value: Any, kind: str = "") -> str:
    """Formats a value for a preset; a quantity with a dimension is in SI and gets its SI unit."""
    if kind in DIMENSIONS:
        return f'"{value!r} {next(unit for unit, size in DIMENSIONS[kind].units.items() if size == 1.0)}"'
    if isinstance(value, tuple | list):
        return f"[{', '.join(toml(item) for item in value)}]"
    return json.dumps(value, ensure_ascii=False)


def sliders(bass: Instrument) -> Iterator[dict[str, Any]]:
    """Yields the sliders that change this bass, each with its number, its name here and the bass's own value."""
    pickups = () if bass.output.kind == "displacement" else bass.output.pickups
    own = own_values(bass)
    for number, (symbol, row) in enumerate(SLIDER_ROWS.items()):
        p, name, maximum = row.parameter, row.parameter.name, row.parameter.maximum
        of = int(symbol.split("_")[1]) if symbol.startswith("pickup_") and symbol[7].isdigit() else 0
        if of > (len(pickups) if len(pickups) > 1 else 0) or (p.group == "Pickups" and not pickups):
            continue
        if not changes(bass, symbol):
            continue
        if of:
            name = f"{pickup_name(pickups[of - 1], bass)}: {symbol.split('_')[2]}"
        if symbol == "fret":
            maximum = min(maximum, bass.frets)
        value, unit = own.get(symbol, (None, ""))
        yield {
            "number": number, "symbol": symbol, "group": p.group, "name": name, "help": row.help, "unit": p.unit,
            "minimum": p.minimum, "maximum": maximum, "step": row.step, "points": p.points, "own": value,
            "ownUnit": unit,
        }  # fmt: skip


def changes(bass: Instrument, symbol: str) -> bool:
    """True if the slider changes the bass."""
    of_fret, maximum = {"fret": 1.0, "fret_height": 0.1}, SLIDER_ROWS[symbol].parameter.maximum
    return change_bass(bass, of_fret | {symbol: maximum / 2} if symbol in of_fret else {symbol: maximum / 2}) != bass


def own_values(bass: Instrument) -> dict[str, tuple[float, str]]:
    """Returns the bass's own values of the slider quantities, for its lowest string, with units."""
    string, neck, player = bass.strings[0], bass.necks[0], bass.player
    x, gaps = neck.fret_positions, [-1e3 * height for height in neck.fret_heights]
    middle = len(x) // 2
    s = (x[middle] - x[0]) / (x[-1] - x[0]) if middle else 0.0
    hollow = gaps[middle] - gaps[0] - (gaps[-1] - gaps[0]) * s
    made = {
        "concert_pitch": (bass.a4, "Hz"),
        "action": (gaps[min(12, len(gaps)) - 1], "mm"),
        "neck_relief": (hollow / (4 * s * (1 - s)) if 0 < s < 1 else 0.0, "mm"),
        "nut_height": (gaps[0], "mm"),
        "contact_loss": (neck.contact_loss, "N s/m"),
        "gauge": (string.diameter * 1e3, "mm"),
        "tension": (string.tension, "N"),
        "foam": (string.extra_damping, "1/s"),
        "cable": (bass.output.coil.capacitance * 1e12, "pF"),
        "finger_width": (player.rounding * 1e3, "mm"),
        "pluck_angle": (math.degrees(player.pluck_angle), "deg"),
        "hardest": (player.hardest, ""),
    }
    bends = next((r for r in neck.admittance.resonances if r.shape), None)
    if bends:
        made |= {"neck_resonance": (bends.frequency, "Hz"), "neck_mass": (bends.mass, "kg")}
    for k, pickup in enumerate(bass.output.pickups[:OWN_PICKUPS], 1):
        made[f"pickup_{k}_place"] = pickup.position * 1e3, "mm"
    if len(bass.output.pickups) == 1:
        made["pickup_place"] = bass.output.pickups[0].position * 1e3, "mm"
    return {symbol: (float(f"{value:.6g}"), unit) for symbol, (value, unit) in made.items()}


def pickup_name(pickup: Pickup, bass: Instrument) -> str:
    """Names a pickup among its bass's pickups."""
    if pickup.strings:
        return f"Pickup under {' '.join(pickup.strings)}"
    others = [p.position for p in bass.output.pickups if p is not pickup]
    if len(others) != 1:
        return f"Pickup {1 + sum(p > pickup.position for p in others)}"
    return "Neck pickup" if pickup.position > others[0] else "Bridge pickup"
