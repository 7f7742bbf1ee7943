"""A claim of the paper, and the kinds of expectation that a measured value can meet."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

from livebass.lab.paper.claims.runs import BRUTE

Value = float | int | bool | list[float] | list[int]


def numbers(value: Value) -> list[float]:
    """`value` as a list of floats."""
    return [float(v) for v in value] if isinstance(value, list) else [float(value)]


@dataclass(frozen=True)
class Expectation:
    """The expected value, its tolerance, and the check."""

    expected: Value | str  # as the paper states it
    tolerance: str  # the allowed deviation in words
    check: Callable[[list[float]], bool]  # takes the measured numbers
    centres: tuple[float, ...] = ()  # the numbers that random ones may replace; for a range, the upper end

    def holds(self, measured: Value) -> bool:
        """True if `measured` meets the expectation; NaN never does."""
        return self.check(numbers(measured))


class Nears(Expectation):
    """Several numbers, each to a relative tolerance as in `Near`."""

    def __init__(self, values: tuple[float, ...], within: float) -> None:
        super().__init__(list(values), f"± {100 * within:.3g} % each", partial(_are_near, values, within), values)


class Near(Expectation):
    """A number to a relative tolerance: the paper's "about"."""

    def __init__(self, value: float, within: float) -> None:
        super().__init__(value, f"± {100 * within:.3g} %", partial(_are_near, (value,), within), (value,))


def _are_near(values: Sequence[float], within: float, found: Sequence[float]) -> bool:
    near = (abs(v - e) <= within * abs(e) for e, v in zip(values, found, strict=False))
    return len(found) == len(values) and all(near)


class Between(Expectation):
    """A number, or each of several, from `minimum` to `maximum`."""

    def __init__(self, minimum: float, maximum: float) -> None:
        super().__init__(f"{minimum:g} to {maximum:g}", "none", partial(_are_inside, minimum, maximum), (maximum,))


class AtLeast(Expectation):
    """A number, or each of several, of `minimum` or more."""

    def __init__(self, minimum: float) -> None:
        super().__init__(f"≥ {minimum:g}", "none", partial(_are_inside, minimum, math.inf), (minimum,))


class AtMost(Expectation):
    """A number, or each of several, of `maximum` or less."""

    def __init__(self, maximum: float) -> None:
        super().__init__(f"≤ {maximum:g}", "none", partial(_are_inside, -math.inf, maximum), (maximum,))


def _are_inside(minimum: float, maximum: float, found: Sequence[float]) -> bool:
    return bool(found) and all(minimum <= v <= maximum for v in found)


class Exactly(Expectation):
    """A count, a fret or a list of frets, exactly."""

    def __init__(self, value: int | tuple[int, ...]) -> None:
        frets = value if isinstance(value, int) else list(value)
        super().__init__(frets, "exact", lambda found: found == frets)

    def holds(self, measured: Value) -> bool:
        return measured == self.expected


class Rising(Expectation):
    """Ascending numbers, each above the previous by more than `minimum` times it."""

    def __init__(self, minimum: float = 0.0) -> None:
        def rise(found: list[float]) -> bool:
            return len(found) > 1 and all(b > a * (1 + minimum) for a, b in pairwise(found))

        super().__init__("rising", f"each over the one before by more than {100 * minimum:g} %", rise)


class Falling(Expectation):
    """Numbers whose last is below the first, none above the previous by more than `slack` times it."""

    def __init__(self, slack: float = 0.0) -> None:
        def fall(found: list[float]) -> bool:
            return len(found) > 1 and all(b <= a * (1 + slack) for a, b in pairwise(found)) and found[-1] < found[0]

        said = f"the last under the first, none over the one before by more than {100 * slack:g} %"
        super().__init__("falling", said, fall)


class Covers(Expectation):
    """A measured interval that contains the interval from `start` to `end`."""

    def __init__(self, start: float, end: float) -> None:
        def cover(found: list[float]) -> bool:
            return len(found) == 2 and found[0] <= start and end <= found[1]

        super().__init__([start, end], "all of it inside", cover, (start, end))


class Each(Expectation):
    """Several numbers, each with its own expectation."""

    def __init__(self, parts: tuple[Expectation, ...]) -> None:
        def hold(found: list[float]) -> bool:
            return len(found) == len(parts) and all(p.holds(v) for p, v in zip(parts, found, strict=True))

        said = dict.fromkeys(part.tolerance for part in parts)
        super().__init__(", ".join(str(part.expected) for part in parts), ", ".join(said), hold)


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
