"""Values of command-line options: numbers with units and limits, notes, MIDI channels."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import click

from livebass.bounds import between
from livebass.model import quality
from livebass.units import is_number, note_name, note_number, quantity


class Quantity(click.ParamType):
    """A number within limits, with a unit or in SI: "3.6mm", "0.64 m", "0.64", "8MHz"."""

    def __init__(self, dimension: str, least: float, most: float, whole: bool = False) -> None:
        self.name, self.limits = dimension, quality.Limits(dimension, least, most, whole)

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return self.name.upper()

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float | int):
            return float(value)
        try:
            number = float(value)
        except ValueError:
            try:
                number = quantity(value, self.name)
            except ValueError as error:
                self.fail(f"{value!r}: {error}", param, ctx)
        if self.limits.whole and math.isclose(number, _nearest(number), rel_tol=1e-12):
            number = _nearest(number)  # round: 8.1 times 1e6 Hz need not be whole
        try:
            self.limits.check("", number)
        except ValueError:
            self.fail(f"must be {self.limits}, not {value}", param, ctx)
        return number


class WholeQuantity(Quantity):
    """A quantity in whole SI units, given as an integer: "48000", "44.1kHz"."""

    def __init__(self, dimension: str, least: float, most: float, whole: bool = True) -> None:
        super().__init__(dimension, least, most, whole=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        return int(super().convert(value, param, ctx))


def _nearest(number: float) -> float:
    """The nearest integer; NaN and infinities unchanged."""
    return float(round(number)) if math.isfinite(number) else number


class Number(click.ParamType):
    """A number within limits, with or without `unit` after it; `whole` ones are integers, written 1000 or 1e3."""

    def __init__(self, name: str, least: float, most: float, whole: bool = False, unit: str = "") -> None:
        self.name, self.least, self.most, self.whole, self.unit = name, least, most, whole, unit

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return self.name.upper()

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | int:
        try:
            number = float(str(value).removesuffix(self.unit))
        except ValueError:
            number = math.nan
        if not self.least <= number <= self.most or (self.whole and number != int(number)):
            self.fail(f"must be {between(self.least, self.most, whole=self.whole)}, not {value}", param, ctx)
        return int(number) if self.whole else number


class Span(click.ParamType):
    """A section of a piece, from one time to another: "4s:12s", "4:12.5"; "all" is (0, 0)."""

    name = "from:to"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return "[FROM:TO]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:
        if value == "all":
            return 0.0, 0.0
        if isinstance(value, tuple):
            return value
        begin, colon, end = str(value).partition(":")
        time = Quantity("time", 0.0, 86400.0)
        if not colon:
            self.fail(f"must be two times, such as 4s:12s, or nothing for the whole file, not {value}", param, ctx)
        ends = time.convert(begin, param, ctx), time.convert(end, param, ctx)
        if not ends[0] < ends[1]:
            self.fail(f"{value}: the end must come after the beginning", param, ctx)
        return ends


class Learn(click.ParamType):
    """A playing parameter, with or without its MIDI controller: "tone", "tone=74", "tone=off"."""

    name = "parameter[=controller]"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return "PARAMETER[=N]"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, int | str | None]:
        from livebass.live.desk import check_controllers

        if isinstance(value, tuple):
            return value
        symbol, given, controller = str(value).partition("=")
        try:
            if given and controller != "off":
                number = int(controller) if is_number(controller) else controller
                return symbol, check_controllers({symbol: number})[symbol]
            check_controllers({symbol: 0})
        except ValueError as error:
            self.fail(str(error), param, ctx)
        return symbol, "off" if given else None


class Parsed(click.ParamType):
    """Converts a text by `parse`; refuses it if that raises ValueError."""

    def __init__(self, name: str, parse: Callable[[Any], Any], metavar: str | None = None) -> None:
        self.name, self.parse, self.metavar = name, parse, metavar or name.upper()

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return self.metavar

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            return self.parse(value)
        except ValueError as error:
            self.fail(f"{value!r}: {error}", param, ctx)


class Channel(click.ParamType):
    """A MIDI channel, counted from 1, or "auto" or "all"."""

    name = "auto|all|1-16"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return f"[{self.name}]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str | int:
        if value in ("auto", "all"):
            return str(value)
        if not re.fullmatch("[1-9]|1[0-6]", str(value)):
            self.fail(f"must be auto, all or a number from 1 to 16, not {value!r}", param, ctx)
        return int(value)


class Note(int):
    """The MIDI number of a note, and its name as `written`: Bb1 stays Bb1."""

    written: str


def _note(value: Any) -> Note:
    """Reads a note name or a MIDI number. Raises ValueError."""
    note = Note(note_number(value))
    name = re.fullmatch(r"([A-Ga-g])([#b]?)(-?\d+)", str(value).strip())
    note.written = f"{name[1].upper()}{name[2]}{name[3]}" if name else note_name(note)
    return note


NOTE = Parsed("note", _note)
RATE = WholeQuantity(*quality.RATE)
MODES = Number("count", 1, quality.MOST_MODES, whole=True)
CONTACT_RATE = Quantity(*quality.CONTACT_RATE)
