"""Rows: define each number of the bass once, with its unit, limits, default and meaning.

A field made by `number` or `choice` is a row of its dataclass. It defines the preset key with its checks, messages and
help (preset/keys.py). If it has a `word`, it also defines its place in a kernel record, the struct in C, and its limits
in instrument files. A record that only kernels know is a list of Words.

To add a number of a string, a neck or the player, write its row in parts.py with the next word, the kernel that
uses it, and a sentence in the handbook.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, dataclass, field, fields
from math import prod
from sys import float_info
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebass.rows.units import DIMENSIONS, quantity

TINY = float_info.min  # the least above 0
LARGEST = 1e15  # of any number in a file, unless its row says otherwise
BYTES = 8  # of a word
REQUIRED: Any = MISSING  # in place of a default: a preset must say


@dataclass(frozen=True)
class Row:
    """Describes a field. Limits read as in a preset."""

    kind: str  # a dimension of `units`, choices "a|b", number, integer or controller
    minimum: str
    maximum: str
    meaning: str
    of: str = ""  # space-separated groups of numbers that lose their effect together: preset/idle.py
    optional: bool = False  # no default in a preset: `meaning` says what a missing key means
    word: int | None = None  # place in the kernel record
    file: tuple[float, float] | None = None  # SI, limits in an instrument file where they differ from a preset's
    record: str = ""  # of a choice: the number of INSTRUMENT that holds its index

    @property
    def choices(self) -> list[str]:
        """The choices of a `choice`."""
        return self.kind.split("|")

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest value, SI, in an instrument file."""
        if self.file:
            return self.file
        minimum, maximum = (
            quantity(x, self.kind) if self.kind in DIMENSIONS else float(x) for x in (self.minimum, self.maximum)
        )
        return minimum, maximum


def number(default: float, kind: str, minimum: str, maximum: str, meaning: str, **more: Any) -> Any:
    """Makes a dataclass field with a Row; `more`: other fields of the Row."""
    return field(default=default, metadata={"row": Row(kind, minimum, maximum, meaning, **more)})


def result(word: int, minimum: float = -LARGEST, maximum: float = LARGEST, kind: str = "number") -> Any:
    """Makes a dataclass field that follows from others and is not in presets; limits in SI."""
    return field(metadata={"row": Row(kind, "", "", "", word=word, file=(minimum, maximum))})


def choice(default: str, choices: Sequence[str], meaning: str, **more: Any) -> Any:
    """Makes a dataclass field that is one of `choices`; `more`: other fields of its Row."""
    return field(default=default, metadata={"row": Row("|".join(choices), "", "", meaning, **more)})


def rows(cls: type) -> dict[str, Row]:
    """The rows of a dataclass by field name, in order."""
    return {f.name: f.metadata["row"] for f in fields(cls) if "row" in f.metadata}


def copier(names: Iterable[str]) -> Callable[[Any, Any], None]:
    """Makes a function, for Python and kernels, that copies these fields from one record or object to another."""
    scope: dict[str, Any] = {"__name__": __name__}
    exec("\n    ".join(["def copy(given, to):", *(f"to.{name} = given.{name}" for name in names)]), scope)
    made: Callable[[Any, Any], None] = scope["copy"]
    return made


class Word(NamedTuple):
    """A number or an array in a kernel record: its type, limits in an instrument file, and shape."""

    name: str
    type: str | Sequence[Word]  # "f8", "i8", or the words of a record
    minimum: float = -LARGEST
    maximum: float = LARGEST
    shape: tuple[int, ...] = ()


def words(cls: type) -> list[Word]:
    """The words of a dataclass, by number. Raises ValueError unless they count from 0 without a gap."""
    placed = sorted((row.word, name) for name, row in rows(cls).items() if row.word is not None)
    if [word for word, _ in placed] != list(range(len(placed))):
        raise ValueError(f"{cls.__name__}: words must count from 0, each of one row: {placed}")
    of = rows(cls)
    return [Word(name, "i8" if of[name].kind == "integer" else "f8", *of[name].limits) for _, name in placed]


def record(given: Sequence[Word]) -> np.dtype[np.void]:
    """The type of a record of these words."""
    types = [(w.name, w.type if isinstance(w.type, str) else record(w.type), w.shape) for w in given]
    return np.dtype(types, align=True)


class Limit(NamedTuple):
    """The limits of neighbouring words in a record."""

    name: str  # with the names of the records around it: "player.thumb_mass"
    first: int  # word
    size: int  # words
    each: int  # words for each string; 0: there are always `size`
    whole: bool  # int64, not float64
    minimum: float
    maximum: float


def limits(given: Sequence[Word], strings: int = 0, first: int = 0, inside: str = "") -> list[Limit]:
    """The limits of a record that starts at word `first`, and of the records inside it; `inside` begins their names.

    strings: the record's room for strings. An array of this size has an item for each, used or not.
    """
    made = []
    for w in given:
        count, name = prod(w.shape), f"{inside}{w.name}"
        if isinstance(w.type, str):
            each = count // strings if w.shape and w.shape[0] == strings else 0
            made.append(Limit(name, first, count, each, w.type == "i8", w.minimum, w.maximum))
            first += count
        else:
            for _ in range(count):
                made += limits(w.type, 0, first, f"{name}.")
                first += record(w.type).itemsize // BYTES
    return made


def table(given: Sequence[Limit]) -> NDArray[np.float64]:
    """The limits without their names, (n, 6), as kernels read them."""
    return np.array([limit[1:] for limit in given], float)
