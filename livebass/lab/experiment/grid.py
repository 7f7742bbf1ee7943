"""The grid of a sweep: dotted keys, the values of each, and the trial to solve at every point.

A dotted key such as `neck.lift.6` or `string.G.tension` names a row of the presets' keys and a place in a preset
(`target`). `KEY=FROM:TO:N` gives it values, checked as in a preset file (`axis`). Every combination is a point, with a
digest of everything that its result depends on (`grid`). Here a preset is its parsed TOML, checked as a whole.
"""

from __future__ import annotations

import copy
import functools
import hashlib
import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from livebass import __version__
from livebass.engine.prepare import pickups_under, whole_contact_rate
from livebass.model.instrument import Coil, Instrument, Neck, Output
from livebass.model.quality import ANGLE, APEX, AT, Limits
from livebass.model.trial import PluckRequest, Trial, checked_trial, in_quality, speaking_string
from livebass.preset.build import Builder
from livebass.preset.keys import KEYS, Key, check_value, nearest
from livebass.preset.load import preset_tables
from livebass.rows.bounds import between, complaint, refusal, within
from livebass.rows.units import DIMENSIONS, note_number, split_quantity
from livebass.sound.analysis import PAPER_RATE
from livebass.system.extras import installed_version

SINGLE = ("neck", "output", "coil", "player")  # sections that occur once in a preset
MEASURED, GEOMETRY = ("height_scale", "height_offset"), ("frets", "action", "relief", "nut_height")


def _pluck_key(name: str, limits: Limits, meaning: str) -> Key:
    unit = next(unit for unit, size in DIMENSIONS[limits.dimension].units.items() if size == 1.0)
    minimum, maximum = (f"{end!r} {unit}" for end in (limits.minimum, limits.maximum))
    return Key("pluck", name, limits.dimension, minimum, maximum, None, meaning)


PLUCK = {
    key.name: key
    for key in (
        _pluck_key("apex", APEX, "height of the plucked corner"),
        _pluck_key("at", AT, "where it is, from the stop"),
        _pluck_key("angle", ANGLE, "of the pull, from straight up"),
        Key("pluck", "fret", "integer", "0", "36", None, "where the string is stopped"),
    )
}


@dataclass(frozen=True)
class Target:
    """The place in a preset, or the property of a pluck, that a dotted key names."""

    dotted: str
    key: Key  # of a single number
    section: str  # "pluck", or a section of the file
    which: str = ""  # name of the string, or number of the pickup; "": all
    neck: bool = False  # the string's own neck
    fret: str = ""  # of neck.lift

    def tables(self, data: dict[str, Any]) -> list[dict[str, Any]]:
        """The tables of `data` that hold the key, created if the preset omits them.

        Raises ValueError if the bass has no such string or pickup.
        """
        if self.section in SINGLE:
            found = [data.setdefault(self.section, {})]
        elif self.section == "string":
            strings = data["string"]
            found = [t for t in strings if self.which.casefold() in ("", t["name"].casefold())]
            if not found:
                raise ValueError(f"{self.dotted}: this bass has strings {', '.join(t['name'] for t in strings)}")
        else:
            pickups = data.get("pickup", [])
            found = [t for i, t in enumerate(pickups, 1) if self.which in ("", str(i))]
            if not found:
                raise ValueError(f"{self.dotted}: this bass has {len(pickups)} pickups")
        return [table.setdefault("neck", {}) for table in found] if self.neck else found

    def put(self, data: dict[str, Any], raw: Any) -> None:
        """Set the key in `data`, in place; `raw` is the value as in a file."""
        for table in self.tables(data):
            if self.fret:
                table.setdefault("lift", {})[self.fret] = raw
            else:
                table[self.key.name] = raw


def target(dotted: str) -> Target:
    """Parse a dotted key. Raises ValueError if it is unknown or not a single number."""
    section, *rest = dotted.strip().split(".")
    which, neck, fret = "", False, ""
    if section in ("string", "pickup") and len(rest) > 1 and rest[0] != "neck":
        which, *rest = rest
    home = section
    if section == "string" and rest[:1] == ["neck"]:
        neck, home, rest = True, "neck", rest[1:]
    if home == "neck" and rest[:1] == ["lift"] and len(rest) == 2 and re.fullmatch("[1-9][0-9]?", rest[1]):
        rest, fret = rest[:1], rest[1]
    key = _row(home, rest[0]) if len(rest) == 1 else None
    if key is None:
        raise ValueError(f"{dotted}: unknown key; {nearest(dotted, names())}")
    if key.kind == "lift":
        if not fret:
            raise ValueError(f"{dotted}: needs the number of a fret, such as {dotted}.6")
        key = replace(key, kind="length")
    if not _one_number(key):
        raise ValueError(f"{dotted}: is {_what(key)}; a sweep varies one number")
    return Target(dotted, key, section, which, neck, fret)


def names() -> list[str]:
    """All keys that can be varied; keys of strings and pickups stand for all of them."""
    keys = [f"{key.section}.{key.name}" for key in (*KEYS, *PLUCK.values()) if key.section and _one_number(key)]
    return [*keys, "neck.lift.1"]


def hiding_reason(at: Target, data: dict[str, Any], string: str) -> str:
    """The reason why changing `at` has no effect on `string` of `data`, and the key that has; "" if it has one."""
    if at.section != "neck" and not at.neck:
        return ""
    mine = next((t for t in data["string"] if t["name"].casefold() == string.casefold()), None)
    if mine is None or (at.neck and at.which.casefold() not in ("", string.casefold())):
        return ""
    own, shared = mine.get("neck", {}), data.get("neck", {})
    where = own if own.keys() & {"fret_positions", "fret_heights", *GEOMETRY} else shared
    prefix = f"string.{mine['name']}.neck"
    name = at.key.name
    if not at.neck and name in own:
        return f"string {mine['name']} has {name} of its own; vary {prefix}.{name}"
    if name in GEOMETRY and "fret_heights" in where:
        return "its frets are measured; vary neck.height_scale, neck.height_offset or neck.lift.6"
    if name in MEASURED and "fret_heights" not in where:
        return "its frets are not measured; vary neck.action, neck.relief or neck.nut_height"
    return ""


def _row(section: str, name: str) -> Key | None:
    if section == "pluck":
        return PLUCK.get(name)
    return next((key for key in KEYS if section and (key.section, key.name) == (section, name)), None)


def _one_number(key: Key) -> bool:
    return key.kind in (*DIMENSIONS, "number", "integer", "note")


def _what(key: Key) -> str:
    if key.kind.endswith("[]"):
        return "a list"
    return {
        "text": "a text",
        "controller": "the number of a controller",
        "key map": "a key map",
        "curve": "a curve",
    }.get(key.kind, "a choice")


MAXIMUM = 100_000  # values of a parameter, and points of a grid
USAGE = "needs KEY=FROM:TO:N or KEY=FROM:TO:N:log, such as neck.action=1.5mm:3mm:7"


@dataclass(frozen=True)
class Axis:
    """One parameter and its values, `KEY=FROM:TO:N`."""

    at: Target
    unit: str  # of FROM; "": a plain number
    numbers: tuple[float, ...]  # in `unit`
    log: bool  # a geometric series

    @property
    def title(self) -> str:
        """Key and unit, "neck.action [mm]"."""
        return f"{self.at.dotted} [{self.unit}]" if self.unit else self.at.dotted

    def raw(self, number: float) -> Any:
        """`number` as in a preset file."""
        if self.unit:
            return f"{number!r} {self.unit}"
        return number if self.at.key.kind == "number" else int(number)

    def value(self, number: float) -> Any:
        """`number` in SI. Raises ValueError, with the limits."""
        return check_value(self.at.key, self.raw(number))

    def shown(self, number: float) -> str:
        """Key and value for messages, "neck.action = 1.5 mm"."""
        return f"{self.at.dotted} = {number:.12g}{' ' + self.unit if self.unit else ''}"


def axis(text: str) -> Axis:
    """Parse one `--vary`. Raises ValueError with key, value and limits for any value beyond them."""
    name, equals, rest = text.partition("=")
    parts = rest.split(":")
    if not equals or not name.strip() or len(parts) not in (3, 4):
        raise ValueError(f"{text}: {USAGE}")
    at = target(name)
    (first_text, last_text, count_text), spacing = parts[:3], parts[3:]
    if spacing not in ([], ["log"]):
        raise ValueError(f"{text}: only log may come after N, not {spacing[0]!r}")
    if not re.fullmatch(r"\s*[0-9]{1,9}\s*", count_text) or not 1 <= int(count_text) <= MAXIMUM:
        raise refusal(f"{at.dotted}: N", between(1, MAXIMUM, whole=True), repr(count_text.strip()))
    first, unit = _number(at, first_text)
    last, other = _number(at, last_text)
    if other != unit:
        size = DIMENSIONS[at.key.kind].units
        last = float(f"{last * size[other] / size[unit]:.12g}")
    made = Axis(at, unit, _series(at, first, last, int(count_text), bool(spacing)), bool(spacing))
    for number in made.numbers:
        try:
            made.value(number)
        except ValueError as error:
            shown = made.shown(number)
            raise ValueError(complaint(at.dotted, error, shown.removeprefix(f"{at.dotted} = "))) from None
    return made


def _number(at: Target, text: str) -> tuple[float, str]:
    """Parse FROM or TO into its number and unit."""
    try:
        if at.key.kind in DIMENSIONS:
            return split_quantity(text, at.key.kind)
        return (float(note_number(text)) if at.key.kind == "note" else float(text)), ""
    except ValueError as error:
        why = str(error) if at.key.kind in DIMENSIONS or at.key.kind == "note" else "not a number"
        raise ValueError(f"{at.dotted} = {text.strip()!r}: {why}") from None


def _series(at: Target, first: float, last: float, count: int, log: bool) -> tuple[float, ...]:
    """`count` numbers from first to last, rounded to 12 digits, so steps of 0.1 show no binary rounding."""
    if log and not (first > 0 and last > 0):
        raise ValueError(f"{at.dotted}: log needs FROM and TO above 0")
    if count > 1 and first == last:
        raise ValueError(f"{at.dotted}: FROM and TO are the same, {first:.12g}, for {count} values")
    parts = [i / max(count - 1, 1) for i in range(count)]
    made = [first * (last / first) ** p if log else first + (last - first) * p for p in parts]
    made = [float(f"{x:.12g}") for x in made]
    made[0], made[-1] = first, last if count > 1 else first
    if at.key.kind in ("integer", "note"):
        for x in made:
            if not x.is_integer():
                raise refusal(at.dotted, "a whole number", f"{x:.12g}: take another N")
    return tuple(made)


INSTEAD = {"player.pluck_angle": "pluck.angle", "player.pluck_position": "pluck.at"}


@dataclass(frozen=True)
class Settings(PluckRequest):
    """The pluck and the precision of its solution: the same at every point unless a `pluck.` key is varied."""

    preset: str = "paper-g"  # name or file


@dataclass(frozen=True)
class Work:
    """Everything that the result of one point depends on, except the program."""

    trial: Trial
    output: Output


@dataclass(frozen=True)
class Point:
    """One point of the grid."""

    numbers: tuple[float, ...]  # one per axis, in its unit
    name: str  # "neck.action = 1.5 mm, pluck.apex = 3 mm"
    work: Work
    digest: str  # of `work` and `program()`, hexadecimal


@functools.cache
def program() -> str:
    """Identifies the program: livebass with a digest of its sources, and the libraries that may round differently."""
    sources = sorted(Path(__file__).parents[2].rglob("*.py"))
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:12]
    return f"livebass {__version__} ({digest}), numpy {installed_version('numpy')}, numba {installed_version('numba')}"


def grid(settings: Settings, axes: Sequence[Axis]) -> list[Point]:
    """Every point, the last axis fastest.

    Raises ValueError, before computing anything, for a point that cannot be solved, an axis that changes nothing at any
    point, and one given twice.
    """
    names = [axis.at.dotted for axis in axes]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{name}: given twice")
    count = math.prod(len(axis.numbers) for axis in axes)
    within("number of points", count, 1, MAXIMUM)
    label, data = preset_tables(settings.preset)
    speaking_string(Builder(label).instrument(data), settings.string, 0)
    for axis in axes:
        if axis.at.section != "pluck":
            axis.at.tables(copy.deepcopy(data))
        why = hiding_reason(axis.at, data, settings.string)
        if why:
            raise ValueError(f"{axis.at.dotted} changes nothing in preset {settings.preset}: {why}")
    points = list(_points(settings, axes, Builder(label), data))
    _check_effects(settings, axes, points)
    return points


def _points(settings: Settings, axes: Sequence[Axis], builder: Builder, data: dict[str, Any]) -> Iterator[Point]:
    of_preset = [axis.at.section != "pluck" for axis in axes]

    @functools.lru_cache(maxsize=1024)
    def instrument(numbers: tuple[float | None, ...]) -> Instrument:
        changed = copy.deepcopy(data)
        for axis, number in zip(axes, numbers, strict=True):
            if number is not None:
                axis.at.put(changed, axis.raw(number))
        return builder.instrument(changed)

    for numbers in itertools.product(*(axis.numbers for axis in axes)):
        name = ", ".join(axis.shown(number) for axis, number in zip(axes, numbers, strict=True))
        mine = {
            axis.at.key.name: axis.value(number)
            for axis, number, preset in zip(axes, numbers, of_preset, strict=True)
            if not preset
        }
        try:
            bass = instrument(tuple(n if p else None for n, p in zip(numbers, of_preset, strict=True)))
            work = _work(bass, replace(settings, **mine))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
        yield Point(numbers, name, work, hashlib.sha256(f"{program()}\n{work!r}".encode()).hexdigest()[:32])


def varied(preset: str, axes: Sequence[Axis], maximum: int) -> list[tuple[str, Instrument]]:
    """The bass of a preset for every combination of values, at most `maximum`, each with their names, the last fastest.

    Raises ValueError for a bass that cannot be, an axis of the pluck, one that changes nothing, and one given twice.
    """
    within("number of combinations", math.prod(len(axis.numbers) for axis in axes), 1, maximum)
    label, data = preset_tables(preset)
    for axis in axes:
        dotted = axis.at.dotted
        if axis.at.section == "pluck":
            raise ValueError(f"{dotted}: the bass's player plucks here; vary a key of the preset")
        if [each.at.dotted for each in axes].count(dotted) > 1:
            raise ValueError(f"{dotted}: given twice")
        axis.at.tables(copy.deepcopy(data))
        whys = {hiding_reason(axis.at, data, string["name"]) for string in data["string"]}
        if "" not in whys:
            raise ValueError(f"{dotted} changes nothing in preset {preset}: {min(whys)}")
    made = []
    for numbers in itertools.product(*(axis.numbers for axis in axes)):
        name, changed = ", ".join(axis.shown(n) for axis, n in zip(axes, numbers, strict=True)), copy.deepcopy(data)
        for axis, number in zip(axes, numbers, strict=True):
            axis.at.put(changed, axis.raw(number))
        try:
            made.append((name, Builder(label).instrument(changed)))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
    return made


def _work(bass: Instrument, settings: Settings) -> Work:
    """The trial and output of one point, without values irrelevant there, so digests agree."""
    s = speaking_string(bass, settings.string, settings.fret)
    of_quality, contact_rate = in_quality(s, settings.quality)
    modes = of_quality if settings.modes is None else settings.modes
    trial = checked_trial(bass, s, settings, modes, whole_contact_rate(contact_rate, PAPER_RATE), PAPER_RATE)
    s = trial.speaking  # over a board, with the grid for that many modes
    output = replace(bass.output, sensor=Output.sensor, sensor_v=Output.sensor_v)  # they are already in the trial
    if output.kind == "displacement":
        s = replace(s, string=replace(s.string, level=1.0))
        output = replace(output, pickups=(), coil=Coil())
    else:
        output = replace(output, pickups=pickups_under(output, s.string.name), across=0.0)
    if not settings.angle:  # the motion stays in its plane
        s = replace(s, friction=Neck.friction, friction_speed=Neck.friction_speed)
        trial = replace(trial, sensor_v=None)
        output = replace(output, across=0.0, pickups=tuple(replace(p, across=0.0) for p in output.pickups))
    return Work(replace(trial, speaking=s), output)


def _check_effects(settings: Settings, axes: Sequence[Axis], points: Sequence[Point]) -> None:
    """Raise ValueError for an axis along which all points are the same, for any values of the others."""
    for k, axis in enumerate(axes):
        if len(axis.numbers) == 1:
            continue
        lines: dict[tuple[float, ...], set[str]] = {}
        for point in points:
            lines.setdefault(point.numbers[:k] + point.numbers[k + 1 :], set()).add(point.digest)
        if all(len(digests) == 1 for digests in lines.values()):
            other = INSTEAD.get(axis.at.dotted)
            why = f"vary {other}" if other else f"nothing of this pluck of string {settings.string} depends on it"
            raise ValueError(f"{axis.at.dotted} changes nothing in preset {settings.preset}: {why}")
