"""The grid of a sweep: for every point what is to be solved, and a digest of all that its result depends on."""

from __future__ import annotations

import copy
import functools
import hashlib
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from livebass import __version__
from livebass.analysis import PAPER_RATE
from livebass.instrument import Coil, Instrument, Neck, Output
from livebass.motion import Trial
from livebass.operators import pickups_under, whole_contact_rate
from livebass.preset import preset_tables
from livebass.preset_build import Builder
from livebass.quality import Quality, modes_for
from livebass.sweep_grid import MOST, Axis
from livebass.sweep_key import hidden
from livebass.trials import checked_trial, speaking_string

INSTEAD = {"player.pluck_angle": "pluck.angle", "player.pluck_position": "pluck.at"}


@dataclass(frozen=True)
class Settings:
    """What is the same at every point, unless a `pluck.` key is varied."""

    preset: str  # name or file
    string: str
    fret: int
    apex: float  # m
    at: float  # m from the stop
    angle: float  # rad
    duration: float  # s
    quality: Quality
    modes: int | None  # of the string as stopped, instead of the quality's


@dataclass(frozen=True)
class Work:
    """One point: everything its result depends on but the program."""

    trial: Trial
    output: Output


@dataclass(frozen=True)
class Point:
    """One point of the grid."""

    numbers: tuple[float, ...]  # one an axis, in its unit
    name: str  # "neck.action = 1.5 mm, pluck.apex = 3 mm"
    work: Work
    digest: str  # hexadecimal, of `work` and `program()`


@functools.cache
def program() -> str:
    """What computes: livebass with a digest of its sources, and the libraries whose rounding could differ."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:12]
    return f"livebass {__version__} ({digest}), numpy {version('numpy')}, numba {version('numba')}"


def grid(settings: Settings, axes: Sequence[Axis]) -> list[Point]:
    """Every point, the last axis fastest. ValueError, before anything is computed, for one that cannot be.

    Also for an axis that changes nothing anywhere, and one that is given twice.
    """
    names = [axis.at.dotted for axis in axes]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{name}: given twice")
    count = math.prod(len(axis.numbers) for axis in axes)
    if count > MOST:
        raise ValueError(f"{count} points, allowed are at most {MOST}")
    label, data = preset_tables(settings.preset)
    speaking_string(Builder(label).instrument(data), settings.string, 0)
    for axis in axes:
        if axis.at.section != "pluck":
            axis.at.tables(copy.deepcopy(data))
        why = hidden(axis.at, data, settings.string)
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


def _work(bass: Instrument, settings: Settings) -> Work:
    """The trial and output of one point, free of what cannot matter there."""
    s = speaking_string(bass, settings.string, settings.fret)
    modes = settings.modes
    if modes is None:
        modes = modes_for(settings.quality, s.length, s.string.length, s.grid_points)
    contact_rate = whole_contact_rate(settings.quality.contact_rate, PAPER_RATE)
    trial = checked_trial(
        bass, s, settings.apex, settings.at, settings.duration, modes, contact_rate, PAPER_RATE, settings.angle
    )  # fmt: skip
    s = trial.speaking  # of a board, the grid of so many modes
    output = replace(bass.output, sensor=Output.sensor, sensor_v=Output.sensor_v)  # they are in the trial
    if output.kind == "displacement":
        s = replace(s, string=replace(s.string, level=1.0))
        output = replace(output, pickups=(), coil=Coil())
    else:
        output = replace(output, pickups=pickups_under(output, s.string.name), across=0.0)
    if not settings.angle:  # it stays in its plane
        s = replace(s, friction=Neck.friction, friction_speed=Neck.friction_speed)
        trial = replace(trial, sensor_v=None)
        output = replace(output, across=0.0, pickups=tuple(replace(p, across=0.0) for p in output.pickups))
    return Work(replace(trial, speaking=s), output)


def _check_effects(settings: Settings, axes: Sequence[Axis], points: Sequence[Point]) -> None:
    """Refuse an axis along which, wherever the others stand, all points are the same."""
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
