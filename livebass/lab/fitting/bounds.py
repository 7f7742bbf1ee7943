"""The free numbers of a fit: where each stands in a preset, its bounds, scale and prior.

A search moves them on a scale from 0, the lower bound, to 1, the upper one. The prior holds each near the base preset:
its standard deviation on that scale. Numbers that trade places with others, or that notes do not tell, are not free:
positions of pickups, their sense of the motion across, and stiffness_across.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from livebass.model.instrument import Coil, Instrument, Neck, Pick, Player, String
from livebass.rows.row import rows
from livebass.rows.units import DIMENSIONS

Tables = dict[str, Any]
CLASSES: dict[str, type] = {"string": String, "neck": Neck, "player": Player, "pick": Pick, "coil": Coil}
PRIOR = 0.25  # of the scale
MAX_ANGLE = 84.0  # deg, of the hardest pull
WIDEST = 0.97  # of the open string, the farthest place of a pluck
FINGERED, PICKED_AT = 0.93, 0.96  # of it, the nearest to the bridge that a finger usually plucks, and a pick strikes
ROOM = 0.02  # of it, from the usual place to the ends of the controller
# Sections of numbers that are no keys of their own: factors of strings, of masses and of pickups, and two more
FACTOR, MASSES, PICKUPS, STEP, MIX = "factor", "masses", "pickups", "step", "mix"
FACTORS = (FACTOR, MASSES, PICKUPS)


@dataclass(frozen=True)
class Free:
    """One free number. `low` and `high` are in `unit`, as in a preset."""

    section: str  # of a preset, or one of FACTORS, STEP or MIX
    key: str
    title: str  # in words
    low: float
    high: float
    unit: str = ""
    log: bool = False
    prior: float = PRIOR

    @property
    def name(self) -> str:
        """Its dotted key in a preset; "" for the force of a layer, which is in none."""
        return "" if self.section == STEP else f"{self.home}.{self.key}"

    @property
    def home(self) -> str:
        """The section of the preset that it is written to."""
        return {FACTOR: "string", MASSES: "neck", PICKUPS: "pickup", MIX: "pickup"}.get(self.section, self.section)

    def value(self, u: float) -> float:
        """The number at `u` on the scale from 0 to 1."""
        u = min(max(u, 0.0), 1.0)
        return self.low * (self.high / self.low) ** u if self.log else self.low + (self.high - self.low) * u

    def on_scale(self, value: float) -> float:
        """The place of a number on the scale, from 0 to 1."""
        value = min(max(value, self.low), self.high)
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def read(self, bass: Instrument) -> float:
        """The number of a bass, in `unit`."""
        if self.section in FACTORS:
            return 1.0
        if self.section == MIX:
            first, last = bass.output.pickups[0].level, bass.output.pickups[-1].level
            return 20 * math.log10(max(last, 1e-3) / max(first, 1e-3))
        if self.section == "string":
            each = [getattr(s, self.key) for s in bass.strings]
            return float(np.exp(np.mean(np.log(each)))) if min(each) > 0 else 0.0
        of = {"neck": bass.necks[0], "player": bass.player, "pick": bass.player.pick, "coil": bass.output.coil}
        return float(getattr(of[self.section], self.key)) / self.size

    @property
    def size(self) -> float:
        """Its unit in SI."""
        kind = rows(CLASSES[self.section])[self.key].kind
        return DIMENSIONS[kind].units[self.unit] if kind in DIMENSIONS else 1.0

    def put(self, own: Tables, bass: Instrument, value: float) -> None:
        """Writes the number into the tables of a preset that is like `bass`."""
        if self.section == STEP:
            return
        if self.section == MIX:
            levels = [p.level for p in bass.output.pickups]
            middle = math.sqrt(max(levels[0], 1e-3) * max(levels[-1], 1e-3))
            tables = own.setdefault("pickup", [{} for _ in levels])
            tables[0]["level"], tables[-1]["level"] = (round_digits(middle * 10 ** (x / 40)) for x in (-value, value))
        elif self.section == PICKUPS:
            pickups = bass.output.pickups
            for table, p in zip(own.setdefault("pickup", [{} for _ in pickups]), pickups, strict=True):
                table[self.key] = f"{1000 * value * getattr(p, self.key):.4g} mm"
        elif self.section == MASSES:
            masses = [round_digits(value * r.mass) for r in bass.necks[0].admittance.resonances]
            own.setdefault("neck", {})[self.key] = {"unit": "kg", "values": masses}
        elif self.section in (FACTOR, "string"):
            for s in bass.strings:
                each = value * getattr(s, self.key) if self.section == FACTOR else value
                maximum = float(rows(String)[self.key].maximum)
                string_table(own, bass, s.name)[self.key] = round_digits(min(each, maximum))
        else:
            own.setdefault(self.section, {})[self.key] = (
                f"{value:.4g} {self.unit}" if self.unit else round_digits(value)
            )


def round_digits(value: float) -> float:
    """The number with four digits, as presets show it."""
    return float(f"{value:.4g}")


def string_table(own: Tables, bass: Instrument, name: str) -> Tables:
    """The [[string]] table of a string in `own`; all strings get one, so that none is out of order."""
    tables = own.setdefault("string", [{"name": s.name} for s in bass.strings])
    return next(t for t in tables if t["name"] == name)


HARDEST = Free("player", "hardest", "force at velocity 127", 1.5, 12.0, log=True)
FREE = (
    Free("string", "thermoelastic", "loss in the windings", 5e-5, 4e-3, log=True),
    Free("string", "relaxation", "loss that grows up to some kHz", 1e-4, 1e-2, log=True),
    Free(FACTOR, "viscoelastic_angle", "loss in the cores, over the base preset's", 0.2, 10.0, log=True),
    Free("neck", "stop_conductance", "loss at a stop", 0.1, 4.0, "mm/s/N", log=True),
    Free("neck", "contact_loss", "loss at the frets", 10.0, 1500.0, "N s/m", log=True),
    HARDEST,
    Free("player", "greatest_apex", "greatest height of a pluck", 2.0, 14.0, "mm", log=True),
    Free("player", "pluck_angle", "angle of a soft pull", 0.0, 60.0, "deg"),
    Free("player", "angle_when_hard", "by which hard pulls go more across", 0.0, 60.0, "deg"),
    Free("player", "pluck_position", "place of the pluck", 0.62, FINGERED),
    Free("player", "rounding", "width of the finger, hard", 0.8, 14.0, "mm", log=True),
    Free("player", "rounding_soft", "width of the finger, soft", 2.0, 45.0, "mm", log=True),
    Free("player", "nearer_when_hard", "by which hard plucks are nearer the bridge", 0.0, 90.0, "mm"),
    Free(MIX, "level", "bridge pickup over neck pickup", -20.0, 20.0, "dB"),
    Free(PICKUPS, "aperture", "width of the pickups, over the base preset's", 0.3, 1.4, log=True),
    Free("coil", "capacitance", "capacitance of windings and cable", 150.0, 6000.0, "pF", log=True),
    Free("coil", "tone", "tone control", 0.0, 1.0),
    Free("player", "palm_resistance", "resistance of the resting palm", 0.02, 8.0, "N s/m", log=True),
    Free("player", "palm_place", "distance of the palm from the saddle", 5.0, 45.0, "mm", log=True),
    Free("player", "palm_width", "width of the palm", 2.0, 15.0, "mm", log=True),
    Free("neck", "axes_turned", "turn of the neck's axes", 0.0, 60.0, "deg"),
    Free("neck", "longer_across", "length across over that upwards", 0.2, 4.0, "mm", log=True, prior=0.15),
    Free(MASSES, "resonance_masses", "masses of the neck, over the base preset's", 0.3, 3.0, log=True, prior=0.15),
)
PICKED = {  # a pick has its own numbers
    "pluck_angle": "angle", "pluck_position": "place", "rounding": "hard_width", "rounding_soft": "soft_width",
    "nearer_when_hard": "nearer",
}  # fmt: skip
SLAPPED = (
    Free("player", "strike_softest", "speed of the thumb, soft", 0.05, 4.0, "m/s", log=True),
    Free("player", "strike_hardest", "speed of the thumb, hard", 0.5, 8.0, "m/s", log=True),
    Free("player", "strike_position", "place of the thumb", 0.5, 0.9),
)
PALM = ("palm_place", "palm_width")
UNSTRUCK = (
    "pluck_angle", "angle_when_hard", "pluck_position", "rounding", "rounding_soft", "nearer_when_hard",
)  # fmt: skip


def step(low: str, high: str) -> Free:
    """The force of one layer over that of a softer one."""
    return Free(STEP, f"{low}-{high}", f"force of {high} over {low}", 0.5, 12.0, "dB")


def number_of_pick(free: Free, pick: Pick) -> Free:
    """The number of a pick that a finger's number is about, if `pick` has one."""
    if free.section != "player" or free.key not in PICKED or not getattr(pick, PICKED[free.key]):
        return free
    high = PICKED_AT if free.key == "pluck_position" else free.high
    return replace(free, section="pick", key=PICKED[free.key], title=free.title.replace("finger", "pick"), high=high)


def free_numbers(bass: Instrument) -> list[Free]:
    """The free numbers that a bass has, with bounds that hold its own values; without the forces of layers.

    On a scale of ratios, a number that is 0 stays 0.
    """
    found, player = list(FREE), bass.player
    if not bass.necks[0].own_across:
        found = [f for f in found if f.key != "axes_turned"]
    if not player.palm_resistance:
        found = [f for f in found if f.key not in PALM]
    if not bass.necks[0].admittance.resonances:
        found = [f for f in found if f.section != MASSES]
    if player.stroke == "pick":
        found = [number_of_pick(f, player.pick) for f in found]
    if player.technique == "slap":
        found = [f for f in found if f.key not in UNSTRUCK] + (list(SLAPPED) if player.thumb_mass > 0 else [])
    pickups = bass.output.pickups
    if len(pickups) < 2 or any(p.strings for p in pickups):
        found = [f for f in found if f.section != MIX]
    if bass.output.kind != "pickups":
        found = [f for f in found if f.section not in (MIX, PICKUPS, "coil")]
    values = [f.read(bass) for f in found]
    return [
        replace(f, low=min(f.low, value), high=max(f.high, value))
        for f, value in zip(found, values, strict=True)
        if value > 0 or not f.log
    ]


def own_tables(bass: Instrument, free: Sequence[Free], values: Sequence[float], fixed: Tables) -> Tables:
    """The tables of a preset like `bass` with the numbers `values`; `fixed`: more of them."""
    own: Tables = {
        section: [dict(each) for each in table] if isinstance(table, list) else dict(table)
        for section, table in fixed.items()
    }
    given = {f.key: value for f, value in zip(free, values, strict=True)}
    for f, value in zip(free, values, strict=True):
        if f.key == "angle_when_hard":
            minimum = given.get("pluck_angle", given.get("angle", 0.0))
            value = min(value, max(0.0, MAX_ANGLE - minimum))
        f.put(own, bass, value)
    if "pluck_position" in given:
        place, player = round_digits(given["pluck_position"]), own["player"]
        if place > bass.player.pluck_farthest - ROOM:
            player["pluck_farthest"] = round_digits(min(WIDEST, place + ROOM))
        if place < bass.player.pluck_nearest + ROOM:
            player["pluck_nearest"] = round_digits(place - ROOM)
    return own
