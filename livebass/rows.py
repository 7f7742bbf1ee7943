"""Rows: a number of the bass stands once, with its unit, limits, default and meaning, and the rest follows.

A field that `number` or `choice` makes is a row of its dataclass. From it follow the key of preset files with its
checks, messages and help (preset/keys.py), and for fields with a `word` the record of the kernels, its struct in C, and
the limits within which instrument files may have it. A record of the kernels alone is a list of Words.

To add a number of a string, a neck or the player: its row in parts.py, with the next word and another VERSION; the
kernel that uses it; a sentence in the handbook.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, dataclass, field, fields
from math import prod
from sys import float_info
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from livebass.units import DIMENSIONS, quantity

TINY = float_info.min  # the least that is more than 0
LARGEST = 1e15  # of any number in a file, unless its row says otherwise
BYTES = 8  # of a word
REQUIRED: Any = MISSING  # in place of a default: a preset must say


@dataclass(frozen=True)
class Row:
    """What is said of a field; limits as a preset writes them."""

    kind: str  # a dimension of `units`, choices "a|b", number, integer or controller
    least: str
    most: str
    meaning: str
    of: tuple[str, ...] = ()  # groups of numbers that are without effect together: preset/idle.py
    optional: bool = False  # no default in a preset: `meaning` says what holds if it is left out
    word: int | None = None  # place in the record of the kernels
    file: tuple[float, float] | None = None  # SI, limits in an instrument file if they are others than in a preset
    record: str = ""  # of a choice: the number of INSTRUMENT that has its place among the choices

    @property
    def choices(self) -> list[str]:
        """What there is to choose from."""
        return self.kind.split("|")

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the most, SI, that an instrument file may have."""
        if self.file:
            return self.file
        least, most = (quantity(x, self.kind) if self.kind in DIMENSIONS else float(x) for x in (self.least, self.most))
        return least, most


def number(
    default: float, kind: str, least: str, most: str, meaning: str, *, of: str = "", optional: bool = False,
    word: int | None = None, file: tuple[float, float] | None = None,
) -> Any:  # fmt: skip
    """Makes a field of a dataclass that has a Row; `of`: groups, with spaces between."""
    row = Row(kind, least, most, meaning, tuple(of.split()), optional, word, file)
    return field(default=default, metadata={"row": row})


def result(word: int, least: float = -LARGEST, most: float = LARGEST, kind: str = "number") -> Any:
    """Makes a field of a dataclass that no preset has, as it follows from others; limits in SI."""
    return field(metadata={"row": Row(kind, "", "", "", word=word, file=(least, most))})


def choice(default: str, choices: Sequence[str], meaning: str, *, of: str = "", record: str = "") -> Any:
    """Makes a field of a dataclass that is one of `choices`."""
    return field(
        default=default, metadata={"row": Row("|".join(choices), "", "", meaning, tuple(of.split()), record=record)}
    )


def rows(cls: type) -> dict[str, Row]:
    """The rows of a dataclass by the names of their fields, in their order."""
    return {f.name: f.metadata["row"] for f in fields(cls) if "row" in f.metadata}


def copier(names: Iterable[str]) -> Callable[[Any, Any], None]:
    """Makes a function of Python, for kernels too, that copies fields from one record or object to another."""
    scope: dict[str, Any] = {"__name__": __name__}
    exec("\n    ".join(["def copy(given, to):", *(f"to.{name} = given.{name}" for name in names)]), scope)
    made: Callable[[Any, Any], None] = scope["copy"]
    return made


class Word(NamedTuple):
    """A number of a record of the kernels, or many of a kind: its type, limits in an instrument file, and shape."""

    name: str
    type: str | Sequence[Word]  # "f8", "i8", or the words of a record
    least: float = -LARGEST
    most: float = LARGEST
    shape: tuple[int, ...] = ()


def words(cls: type) -> list[Word]:
    """The words of the rows of a dataclass that have one, in their order. Raises ValueError if they do not count on."""
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
    """The limits of words one after the other in a record."""

    name: str  # with those of the records it is in: "player.thumb_mass"
    first: int  # word
    size: int  # words
    each: int  # of them for each string; 0: there are always `size`
    whole: bool  # int64, not float64
    least: float
    most: float


def limits(given: Sequence[Word], strings: int = 0, first: int = 0, inside: str = "") -> list[Limit]:
    """The limits of a record whose first word is `first`, and of the records in it, that of `inside` among them.

    strings: so many a record has room for. What has this size, has an item for each; not all need be there.
    """
    made = []
    for w in given:
        count, name = prod(w.shape), f"{inside}{w.name}"
        if isinstance(w.type, str):
            each = count // strings if w.shape and w.shape[0] == strings else 0
            made.append(Limit(name, first, count, each, w.type == "i8", w.least, w.most))
            first += count
        else:
            for _ in range(count):
                made += limits(w.type, 0, first, f"{name}.")
                first += record(w.type).itemsize // BYTES
    return made


def table(given: Sequence[Limit]) -> NDArray[np.float64]:
    """The limits as kernels walk them, (n, 6), without names."""
    return np.array([limit[1:] for limit in given], float)
