"""`KEY=FROM:TO:N` of a sweep: the values of one parameter, checked as a preset file's are."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from livebass.preset_keys import checked
from livebass.sweep_key import Target, target
from livebass.units import DIMENSIONS, note_number, split_quantity

MOST = 100_000  # values of a parameter, and points of a grid
USAGE = "needs KEY=FROM:TO:N or KEY=FROM:TO:N:log, such as neck.action=1.5mm:3mm:7"


@dataclass(frozen=True)
class Axis:
    """One parameter and its values."""

    at: Target
    unit: str  # that FROM is written in; "": a plain number
    numbers: tuple[float, ...]  # in `unit`
    log: bool  # they are a geometric series

    @property
    def title(self) -> str:
        """Key and unit, "neck.action [mm]"."""
        return f"{self.at.dotted} [{self.unit}]" if self.unit else self.at.dotted

    def raw(self, number: float) -> Any:
        """`number` as a preset file would hold it."""
        if self.unit:
            return f"{number!r} {self.unit}"
        return number if self.at.key.kind == "number" else int(number)

    def value(self, number: float) -> Any:
        """`number` in SI. Raises ValueError that says what is allowed."""
        return checked(self.at.key, self.raw(number))

    def shown(self, number: float) -> str:
        """For messages: "neck.action = 1.5 mm"."""
        return f"{self.at.dotted} = {number:.12g}{' ' + self.unit if self.unit else ''}"


def axis(text: str) -> Axis:
    """One `--vary`, every value within the limits of its key. ValueError names key, value and what is allowed."""
    name, equals, rest = text.partition("=")
    parts = rest.split(":")
    if not equals or not name.strip() or len(parts) not in (3, 4):
        raise ValueError(f"{text}: {USAGE}")
    at = target(name)
    (first_text, last_text, count_text), spacing = parts[:3], parts[3:]
    if spacing not in ([], ["log"]):
        raise ValueError(f"{text}: {spacing[0]!r} after N; allowed is log")
    if not re.fullmatch(r"\s*[0-9]{1,9}\s*", count_text) or not 1 <= int(count_text) <= MOST:
        raise ValueError(f"{at.dotted}: N = {count_text.strip()!r}, allowed: a whole number from 1 to {MOST}")
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
            raise ValueError(f"{made.shown(number)}: {error}") from None
    return made


def _number(at: Target, text: str) -> tuple[float, str]:
    """FROM or TO: its number and unit."""
    try:
        if at.key.kind in DIMENSIONS:
            return split_quantity(text, at.key.kind)
        return (float(note_number(text)) if at.key.kind == "note" else float(text)), ""
    except ValueError as error:
        why = str(error) if at.key.kind in DIMENSIONS or at.key.kind == "note" else "not a number"
        raise ValueError(f"{at.dotted} = {text.strip()!r}: {why}") from None


def _series(at: Target, first: float, last: float, count: int, log: bool) -> tuple[float, ...]:
    """`count` numbers from first to last, of 12 digits, so that 0.1 steps do not show binary rounding."""
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
                raise ValueError(f"{at.dotted} = {x:.12g}: allowed are whole numbers, take another N")
    return tuple(made)
