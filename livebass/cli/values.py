"""Values of command-line options: numbers with units and limits, notes, MIDI channels."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import click

from livebass.model import quality
from livebass.rows.bounds import between, complaint
from livebass.rows.units import is_number, note_name, note_number, quantity


class Parsed(click.ParamType):
    """Converts a text by `parse`, whose ValueError says why it refuses one; `name` in capitals is the metavar."""

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        self.name, self.parse = name, parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        try:
            return self.parse(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class Quantity(Parsed):
    """A number within limits, with a unit or in SI: "3.6mm", "0.64 m", "0.64", "8MHz"."""

    def __init__(self, dimension: str, minimum: float, maximum: float, whole: bool = False) -> None:
        super().__init__(dimension, self.read)
        self.limits = quality.Limits(dimension, minimum, maximum, whole)

    def read(self, text: str) -> float:
        """The number in SI."""
        try:
            number = float(text)
        except ValueError:
            number = of_value(quantity, text, self.name)
        if self.limits.whole and math.isfinite(number) and math.isclose(number, round(number), rel_tol=1e-12):
            number = float(round(number))  # 8.1 times 1e6 Hz need not be whole
        try:
            self.limits.check("", number)
        except ValueError:
            raise ValueError(f"must be {self.limits}, not {text}") from None
        return number


class Number(Parsed):
    """A number within limits, with or without `unit` after it; `whole` ones are integers, written 1000 or 1e3."""

    def __init__(self, name: str, minimum: float, maximum: float, whole: bool = False, unit: str = "") -> None:
        super().__init__(name, self.read)
        self.minimum, self.maximum, self.whole, self.unit = minimum, maximum, whole, unit

    def read(self, text: str) -> float | int:
        """The number."""
        try:
            number = float(text.removesuffix(self.unit))
        except ValueError:
            number = math.nan
        if not self.minimum <= number <= self.maximum or (self.whole and number != int(number)):
            raise ValueError(f"must be {between(self.minimum, self.maximum, whole=self.whole)}, not {text}")
        return int(number) if self.whole else number


def of_value(parse: Callable[..., Any], text: str, *more: Any) -> Any:
    """`parse(text, *more)`; puts the text before the message of a ValueError."""
    try:
        return parse(text, *more)
    except ValueError as error:
        raise ValueError(complaint("", error, repr(text)).removeprefix(" = ").strip()) from None


def span(text: str) -> tuple[float, float]:
    """A section of a piece, from one time to another: "4s:12s", "4:12.5"; "all" is (0, 0). Raises ValueError."""
    if text == "all":
        return 0.0, 0.0
    begin, colon, end = text.partition(":")
    if not colon:
        raise ValueError(f"must be two times, such as 4s:12s, or nothing for the whole file, not {text}")
    time = Quantity("time", 0.0, 86400.0)
    ends = time.read(begin), time.read(end)
    if not ends[0] < ends[1]:
        raise ValueError(f"{text}: the end must come after the beginning")
    return ends


def learn(text: str) -> tuple[str, int | str | None]:
    """A playing parameter and its MIDI controller: "tone=74", "tone=off", or None from "tone". Raises ValueError."""
    from livebass.live.desk import check_controllers

    symbol, given, controller = text.partition("=")
    number = int(controller) if is_number(controller) else controller
    if not given or number == "off":
        check_controllers({symbol: 0})
        return symbol, "off" if given else None
    return symbol, check_controllers({symbol: number})[symbol]


def beats(text: str) -> float | str:
    """Beats per minute, 20 to 400, or "file". Raises ValueError."""
    try:
        return text if text == "file" else Number("BPM", 20, 400).read(text)
    except ValueError:
        raise ValueError(f"must be from 20 to 400, or file, not {text}") from None


def channel(text: str) -> str | int:
    """A MIDI channel, counted from 1, or "auto" or "all". Raises ValueError."""
    if not re.fullmatch("auto|all|[1-9]|1[0-6]", text):
        raise ValueError(f"must be auto, all or a number from 1 to 16, not {text!r}")
    return int(text) if text.isdigit() else text


class Note(int):
    """The MIDI number of a note, and its name as `written`: Bb1 stays Bb1."""

    written: str


def _note(text: str) -> Note:
    """Reads a note name or a MIDI number. Raises ValueError."""
    note = Note(of_value(note_number, text))
    name = re.fullmatch(r"([A-Ga-g])([#b]?)(-?\d+)", text.strip())
    note.written = f"{name[1].upper()}{name[2]}{name[3]}" if name else note_name(note)
    return note


NOTE = Parsed("note", _note)
RATE = Parsed("frequency", lambda text: int(Quantity(*quality.RATE).read(text)))
MODES = Number("count", 1, quality.MAX_MODES, whole=True)
CONTACT_RATE = Quantity(*quality.CONTACT_RATE)
