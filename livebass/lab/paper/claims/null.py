"""Null tests: how often a random value would meet the expectation of a claim.

A bound that random values often meet says little, however well the computed value meets it. Rates come from `DRAWS`
random values with a fixed seed, or from all orders of a few numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations

import numpy as np

from livebass.lab.analysis.motion import Solved
from livebass.lab.paper.claims import expect
from livebass.lab.paper.claims.expect import Claim, Value, numbers
from livebass.lab.paper.claims.runs import fundamental_at, set_sizes, set_times

DRAWS, SEED = 2000, 1
ALL_ORDERS = 5  # up to so many numbers, every order is tried
DECADE = 10.0  # random sizes are from a tenth to ten times the bound


def null_of(claim: Claim) -> expect.Null | None:
    """The null test of a claim.

    None for set-up, for bounds that allow for rounding, and for exact values and limits that the paper gives.
    """
    if claim.null:
        return claim.null
    if claim.bound in (expect.SETUP, expect.ROUNDING) or isinstance(claim.expects, expect.Exactly):
        return None
    if claim.bound in (expect.PAPER, expect.AXIS) and isinstance(claim.expects, expect.AtLeast | expect.AtMost):
        return None
    return SIZES if claim.expects.centres else SHUFFLED


def null_rate(
    claim: Claim,
    measured: Value,
    runs: Sequence[Solved],
    between: tuple[Value, Value] | None = None,
) -> float | None:
    """Share of random values that meet the expectation of `claim`, 0 to 1; None without a null test.

    `between`: the limits that the paper's number must lie between, for a claim judged in this way.
    """
    null = null_of(claim)
    if null is None:
        return None
    if between is not None:
        return float(np.mean([lies_between(row, *between) for row in _random_sizes(claim.expects.centres)]))
    return null.rate(claim, measured, *runs)


def lies_between(values: Sequence[float], low: Value, high: Value) -> bool:
    """True if each of `values` is from `low` to `high`; a limit of NaN means never and counts as above all."""
    ends = ([math.inf if math.isnan(end) else end for end in numbers(side)] for side in (low, high))
    return all(minimum <= value <= maximum for value, minimum, maximum in zip(values, *ends, strict=True))


def _shuffle(claim: Claim, measured: Value, *_: Solved) -> float:
    values = numbers(measured)
    if len(values) <= ALL_ORDERS:
        orders = [list(order) for order in permutations(values)]
    else:
        rng = np.random.default_rng(SEED)
        orders = [rng.permutation(values).tolist() for _ in range(DRAWS)]
    return float(np.mean([claim.expects.holds(order) for order in orders]))


def _sizes(claim: Claim, measured: Value, *_: Solved) -> float:
    middle = claim.expects.centres
    if len(middle) == 1:  # one bound for all numbers
        middle *= len(numbers(measured))
    return float(np.mean([claim.expects.holds(row if len(row) > 1 else row[0]) for row in _random_sizes(middle)]))


def _random_sizes(middle: Sequence[float]) -> list[list[float]]:
    """`DRAWS` rows of numbers from a tenth to ten times `middle`, uniform in the logarithm."""
    rng = np.random.default_rng(SEED)
    found: list[list[float]] = (np.array(middle) * DECADE ** rng.uniform(-1, 1, size=(DRAWS, len(middle)))).tolist()
    return found


SHUFFLED = expect.Null("the numbers in random order", _shuffle)
SIZES = expect.Null("numbers from a tenth to ten times the bound", _sizes)


def _sets_shuffled(claim: Claim, measured: Value, run: Solved) -> float:
    """For the correlation `runs.frets_and_pitch`."""
    rng, sizes, nu = np.random.default_rng(SEED), set_sizes(run)[1:], fundamental_at(run, set_times(run)[1:])
    if len(nu) < 3:
        return math.nan
    found = (float(np.corrcoef(sizes, rng.permutation(nu))[0, 1]) for _ in range(DRAWS))
    return float(np.mean([claim.expects.holds(value) for value in found]))


SETS_SHUFFLED = expect.Null("the sets in random order", _sets_shuffled)
