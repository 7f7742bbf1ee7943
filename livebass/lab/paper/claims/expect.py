"""A claim of the paper, and the kinds of expectation that a measured value can meet."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

from livebass.lab.paper.claims.runs import BRUTE

Value = float | int | bool | list[float] | list[int]


class Expectation(Protocol):
    """The expected value, its tolerance, and the check."""

    @property
    def expected(self) -> Value | str:
        """The value as the paper states it."""

    @property
    def tolerance(self) -> str:
        """The allowed deviation in words."""

    def holds(self, measured: Value) -> bool:
        """True if `measured` meets the expectation; NaN never does."""


def numbers(value: Value) -> list[float]:
    """`value` as a list of floats."""
    return [float(v) for v in value] if isinstance(value, list) else [float(value)]


@dataclass(frozen=True)
class Near:
    """A number to a relative tolerance: the paper's "about"."""

    expected: float
    within: float  # relative

    @property
    def tolerance(self) -> str:
        return f"± {100 * self.within:.3g} %"

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        return len(found) == 1 and abs(found[0] - self.expected) <= self.within * abs(self.expected)


@dataclass(frozen=True)
class Between:
    """A number, or each of several, from `minimum` to `maximum`."""

    minimum: float
    maximum: float

    tolerance = "none"

    @property
    def expected(self) -> str:
        return f"{self.minimum:g} to {self.maximum:g}"

    def holds(self, measured: Value) -> bool:
        return bool(numbers(measured)) and all(self.minimum <= v <= self.maximum for v in numbers(measured))


class AtLeast(Between):
    """A number, or each of several, of `minimum` or more."""

    def __init__(self, minimum: float) -> None:
        super().__init__(minimum, math.inf)

    @property
    def expected(self) -> str:
        return f"≥ {self.minimum:g}"


class AtMost(Between):
    """A number, or each of several, of `maximum` or less."""

    def __init__(self, maximum: float) -> None:
        super().__init__(-math.inf, maximum)

    @property
    def expected(self) -> str:
        return f"≤ {self.maximum:g}"


@dataclass(frozen=True)
class Exactly:
    """A count, a fret or a list of frets, exactly."""

    value: int | tuple[int, ...]

    @property
    def expected(self) -> Value:
        return self.value if isinstance(self.value, int) else list(self.value)

    tolerance = "exact"

    def holds(self, measured: Value) -> bool:
        return measured == self.expected


@dataclass(frozen=True)
class Nears:
    """Several numbers, each to a relative tolerance as in `Near`."""

    values: tuple[float, ...]
    within: float

    @property
    def expected(self) -> Value:
        return list(self.values)

    @property
    def tolerance(self) -> str:
        return f"± {100 * self.within:.3g} % each"

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        near = (Near(e, self.within).holds(v) for e, v in zip(self.values, found, strict=False))
        return len(found) == len(self.values) and all(near)


@dataclass(frozen=True)
class Rising:
    """Ascending numbers, each above the previous by more than `minimum` times it."""

    minimum: float = 0.0

    expected = "rising"

    @property
    def tolerance(self) -> str:
        return f"each over the one before by more than {100 * self.minimum:g} %"

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        return len(found) > 1 and all(b > a * (1 + self.minimum) for a, b in pairwise(found))


@dataclass(frozen=True)
class Falling:
    """Numbers whose last is below the first, none above the previous by more than `slack` times it."""

    slack: float = 0.0

    expected = "falling"

    @property
    def tolerance(self) -> str:
        return f"the last under the first, none over the one before by more than {100 * self.slack:g} %"

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        steps = all(b <= a * (1 + self.slack) for a, b in pairwise(found))
        return len(found) > 1 and steps and found[-1] < found[0]


@dataclass(frozen=True)
class Covers:
    """A measured interval that contains the interval from `start` to `end`."""

    start: float
    end: float

    @property
    def expected(self) -> Value:
        return [self.start, self.end]

    tolerance = "all of it inside"

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        return len(found) == 2 and found[0] <= self.start and self.end <= found[1]


@dataclass(frozen=True)
class Each:
    """Several numbers, each with its own expectation."""

    parts: tuple[Expectation, ...]

    @property
    def expected(self) -> str:
        return ", ".join(str(part.expected) for part in self.parts)

    @property
    def tolerance(self) -> str:
        said = [part.tolerance for part in self.parts]
        return said[0] if len(set(said)) == 1 else ", ".join(said)

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        return len(found) == len(self.parts) and all(p.holds(v) for p, v in zip(self.parts, found, strict=True))


# The source of a bound.
PAPER = "paper"  # the number is the paper's; a tolerance that it does not state is ours
ONE_PLUCK = "one pluck"  # the number is the paper's, from one chaotic pluck: it is compared with the spread of many
DIRECTION = "direction"  # the paper says which is greater, without a number; a margin is ours
OURS = "ours"  # the paper has a word, such as "negligible"; the number is ours
ROUNDING = "rounding"  # the statement is exact; the bound allows for rounding
AXIS = "axis"  # a tick of an axis in a figure of the paper: not a number that it states, and not counted
SETUP = "set-up"  # an input of the paper, read back: no claim, and not counted


@dataclass(frozen=True)
class Null:
    """A null test: how often random values meet an expectation."""

    drawn: str  # what is random, in words
    rate: Callable[..., float]  # takes the claim, its measured value, and its runs


@dataclass(frozen=True)
class Claim:
    """A statement of the paper that can be checked, or an input that can be read back."""

    id: str
    section: str  # of the paper, with its figure or equation
    statement: str  # of the paper, in our words
    quantity: str  # measured
    unit: str  # SI; "" for counts and ratios
    expects: Expectation
    bound: str  # PAPER, ONE_PLUCK, DIRECTION, OURS, ROUNDING, AXIS or SETUP
    needs: tuple[str, ...]  # names of runs: keys of `runs.ENGINE` and `runs.BRUTE`
    measure: Callable[..., Value]  # takes these runs, each `Solved`, in this order
    null: Null | None = None  # overrides `null.null_of`

    @property
    def plucks(self) -> bool:
        """True if it is judged over many plucks within the uncertainty of the paper's, not by one alone."""
        return bool(self.needs) and self.bound not in (SETUP, ROUNDING) and not BRUTE.keys() & set(self.needs)


def each(measure: Callable[[Any], float]) -> Callable[..., Value]:
    """Measures each run of a claim separately."""
    return lambda *runs: [measure(run) for run in runs]
