"""A claim of the paper, and what it expects of the numbers measured for it: what, how closely, and whether."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

Value = float | int | bool | list[float] | list[int]


class Expectation(Protocol):
    """What is expected and how closely."""

    @property
    def expected(self) -> Value | str:
        """As the paper has it."""

    @property
    def tolerance(self) -> str:
        """What is allowed, in words."""

    def holds(self, measured: Value) -> bool:
        """Whether `measured` is that; a NaN never is."""


def numbers(value: Value) -> list[float]:
    """A value as a list."""
    return [float(v) for v in value] if isinstance(value, list) else [float(value)]


@dataclass(frozen=True)
class Near:
    """A number, the paper's "about"."""

    expected: float
    within: float  # part of it

    @property
    def tolerance(self) -> str:
        return f"± {100 * self.within:g} %"

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        return len(found) == 1 and abs(found[0] - self.expected) <= self.within * abs(self.expected)


@dataclass(frozen=True)
class AtLeast:
    """A number, or each of some, not under `least`."""

    least: float

    @property
    def expected(self) -> str:
        return f"≥ {self.least:g}"

    tolerance = "none"

    def holds(self, measured: Value) -> bool:
        return bool(numbers(measured)) and all(v >= self.least for v in numbers(measured))


@dataclass(frozen=True)
class AtMost:
    """A number, or each of some, not over `most`."""

    most: float

    @property
    def expected(self) -> str:
        return f"≤ {self.most:g}"

    tolerance = "none"

    def holds(self, measured: Value) -> bool:
        return bool(numbers(measured)) and all(v <= self.most for v in numbers(measured))


@dataclass(frozen=True)
class Between:
    """A number, or each of some, from `least` to `most`."""

    least: float
    most: float

    @property
    def expected(self) -> str:
        return f"{self.least:g} to {self.most:g}"

    tolerance = "none"

    def holds(self, measured: Value) -> bool:
        return bool(numbers(measured)) and all(self.least <= v <= self.most for v in numbers(measured))


@dataclass(frozen=True)
class Exactly:
    """A count, a fret, a list of frets."""

    value: int | tuple[int, ...]

    @property
    def expected(self) -> Value:
        return self.value if isinstance(self.value, int) else list(self.value)

    tolerance = "exact"

    def holds(self, measured: Value) -> bool:
        return measured == self.expected


@dataclass(frozen=True)
class Nears:
    """Several numbers, each as in `Near`."""

    values: tuple[float, ...]
    within: float

    @property
    def expected(self) -> Value:
        return list(self.values)

    @property
    def tolerance(self) -> str:
        return f"± {100 * self.within:g} % each"

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        near = (Near(e, self.within).holds(v) for e, v in zip(self.values, found, strict=False))
        return len(found) == len(self.values) and all(near)


@dataclass(frozen=True)
class Rising:
    """Numbers in ascending order, each over the one before by more than `least`, a part of that."""

    least: float = 0.0

    expected = "rising"

    @property
    def tolerance(self) -> str:
        return f"each over the one before by more than {100 * self.least:g} %"

    def holds(self, measured: Value) -> bool:
        found = numbers(measured)
        return len(found) > 1 and all(b > a * (1 + self.least) for a, b in pairwise(found))


@dataclass(frozen=True)
class Falling:
    """Numbers that go down from the first to the last, none over the one before by more than `slack`."""

    slack: float = 0.0  # part of it

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
    """An interval [start, end] that holds another one."""

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
    """Several numbers, each with an expectation of its own."""

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


@dataclass(frozen=True)
class Claim:
    """A statement that can be checked."""

    id: str
    section: str  # of the paper
    statement: str  # as the paper has it
    quantity: str  # what is measured
    unit: str  # SI; "" for counts and ratios
    expects: Expectation
    needs: tuple[str, ...]  # runs: keys of claims_runs.JOBS
    measure: Callable[..., Value]  # of these runs, in that order
