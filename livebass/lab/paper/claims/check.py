"""Checks the claims of Issanchou et al. (2018) for `livebass study claims`, and writes the results.

The results are written as a text table, CSV, JSON and an HTML page.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from livebass.lab.analysis.motion import Solved
from livebass.lab.paper.claims import runs, section_4_1, section_4_2, sections_2_3
from livebass.lab.paper.claims.expect import AXIS, ONE_PLUCK, SETUP, Claim, Exactly, Value, numbers
from livebass.lab.paper.claims.null import lies_between, null_of, null_rate
from livebass.preset.keys import nearest
from livebass.report.page import html_page
from livebass.report.progress import Progress, steps
from livebass.report.text import csv_text, json_text, plain, wrapped_columns
from livebass.system.cores import core_count

TABLES = (sections_2_3, section_4_1, section_4_2)
CLAIMS = {claim.id: claim for table in TABLES for claim in table.CLAIMS}
PLUCKS = 40  # used to judge a claim about contacts
LOW, HIGH = 0.05, 0.95  # quantiles of the spread
WITHIN = f"between the values that {100 * LOW:g} and {100 * HIGH:g} % of the plucks stay below"
SHARP = 0.1  # the most random values that pass a sharp claim


@dataclass(frozen=True)
class Spread:
    """The values of a claim over plucks within the uncertainty of the paper's."""

    plucks: int
    held: int  # plucks in which the claim holds
    low: Value | None  # a twentieth of the plucks lie below; None if the values are lists of different lengths
    high: Value | None  # a twentieth lie above


@dataclass(frozen=True)
class ClaimResult:
    """A claim and its measured value: the median over its plucks, or the value of the paper's pluck."""

    claim: Claim
    measured: Value
    passed: bool
    spread: Spread | None = None
    null: float | None = None  # share of random values that pass, 0 to 1

    @property
    def sharp(self) -> bool:
        """True if a value must be right to pass: few random ones would."""
        return self.null is not None and self.null <= SHARP

    @property
    def tolerance(self) -> str:
        """The allowed deviation of the value, in words."""
        drawn = self.claim.bound == ONE_PLUCK and self.spread is not None
        return WITHIN if drawn else self.claim.expects.tolerance

    def as_json(self) -> dict[str, Any]:
        """The result for JSON; None in `measured` for NaN, a value that could not be measured."""
        c, spread, null = self.claim, self.spread, null_of(self.claim)
        return {
            "id": c.id,
            "section": c.section.partition(", ")[0],
            "figure": c.section.partition(", ")[2],
            "statement": c.statement,
            "quantity": c.quantity,
            "expected": c.expects.expected,
            "measured": plain(self.measured),
            "unit": c.unit,
            "tolerance": self.tolerance,
            "passed": self.passed,
            "counted": c.bound not in NOT_COUNTED,
            "bound": c.bound,
            "plucks": spread and spread.plucks,
            "plucks_passed": spread and spread.held,
            "low": spread and plain(spread.low),
            "high": spread and plain(spread.high),
            "null": null and null.drawn,
            "null_passed": plain(self.null),
            "sharp": self.sharp,
        }


def choose_claims(ids: Iterable[str] = ()) -> list[Claim]:
    """The claims called `ids`, each once, or all of them. Raises ValueError for an unknown one."""
    wanted = list(dict.fromkeys(ids)) or list(CLAIMS)
    for name in wanted:
        if name not in CLAIMS:
            raise ValueError(f"claim {name[:40]!r}: unknown; {nearest(name, list(CLAIMS))}")
    return [CLAIMS[name] for name in wanted]


def check_claims(
    ids: Iterable[str] = (), plucks: int = PLUCKS, workers: int | None = None, progress: Progress | None = None
) -> list[ClaimResult]:
    """Checks the statements of Issanchou et al. (2018), as `livebass study claims` does. Needs SciPy.

    Args:
        ids: Of the statements; all by default.
        plucks: That judge statements about contacts; 0: the paper's own pluck alone.
        workers: Threads that solve the runs they need, each once; None: one per core.
        progress: Gets the fraction done, 0 to 1.

    Raises:
        ValueError: An unknown statement.
    """
    claims = choose_claims(ids)
    names = needed_runs(claims)
    step = steps(progress, len(names) + (plucks if any(claim.plucks for claim in claims) else 0))
    solved = runs.solve(names, workers, step)
    values = over_plucks(claims, plucks, workers, step)
    return [result(claim, solved, values.get(claim.id, ())) for claim in claims]


def needed_runs(claims: Iterable[Claim]) -> list[str]:
    """Names of the runs that these claims need, each once."""
    return list(dict.fromkeys(name for claim in claims for name in claim.needs))


def over_plucks(
    claims: Iterable[Claim], plucks: int, workers: int | None = None, step: Callable[[], None] = lambda: None
) -> dict[str, list[Value]]:
    """The values of the `claims` that are judged over plucks, by id: one for each of `plucks` plucks.

    A pluck is the same in all runs that a claim compares. `step` is called after each. The kernels must be compiled.
    """
    varied = [claim for claim in claims if claim.plucks]
    pulls = runs.pulls(plucks if varied else 0)

    def measure(pull: runs.Pull) -> dict[str, Value]:
        jobs = {name: runs.job(name, pull) for name in needed_runs(varied)}
        solved = {name: Solved(job.trial, job.solve()) for name, job in jobs.items()}
        return {claim.id: _measure(claim, solved) for claim in varied}

    with ThreadPoolExecutor(workers or core_count()) as pool:
        futures = [pool.submit(measure, pull) for pull in pulls]
        try:
            for future in as_completed(futures):
                future.result()
                step()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return {claim.id: [future.result()[claim.id] for future in futures] for claim in varied}


def result(claim: Claim, solved: Mapping[str, Solved], values: Sequence[Value] = ()) -> ClaimResult:
    """Check one claim in the solved runs, by name, or over the `values` of several plucks, if given.

    Over plucks the median of the values decides. Lists of frets or of sets have none: they hold if they hold in more
    than half of the plucks, and are represented by the list of the paper's own pluck. A number that the paper has from
    one chaotic pluck is one random draw: it holds if it lies between the quantiles LOW and HIGH of the plucks.
    """
    measured = _measure(claim, solved)
    held = sum(map(claim.expects.holds, values))
    spread, between, passed = None, None, bool(claim.expects.holds(measured))
    if values:
        is_list = isinstance(claim.expects, Exactly) and isinstance(claim.expects.expected, list)  # of frets
        middle = None if is_list else _quantile(values, 0.5)
        low, high = (None, None) if middle is None else (_quantile(values, LOW), _quantile(values, HIGH))
        spread = Spread(len(values), held, low, high)
        passed = 2 * held > len(values) if middle is None else bool(claim.expects.holds(middle))
        measured = measured if middle is None else middle
        if claim.bound == ONE_PLUCK:
            assert low is not None and high is not None, f"{claim.id}: numbers, as many in each pluck"
            between = low, high
            passed = lies_between(claim.expects.centres, *between)
    null = null_rate(claim, measured, [solved[name] for name in claim.needs], between)
    return ClaimResult(claim, measured, passed, spread, null)


def _measure(claim: Claim, solved: Mapping[str, Solved]) -> Value:
    return claim.measure(*(solved[name] for name in claim.needs))


def _quantile(values: Sequence[Value], part: float) -> Value | None:
    """The quantile of values, or of each of several numbers; None for lists of different lengths.

    NaN counts as above all: the event did not occur within the run.
    """
    shapes = {np.shape(value) for value in values}
    if len(shapes) > 1:
        return None
    each = np.array(values, np.float64)
    each[np.isnan(each)] = np.inf
    # The median may lie between two values; other quantiles are actual values.
    found = np.median(each, axis=0) if part == 0.5 else np.quantile(each, part, axis=0, method="nearest")
    found = np.where(np.isinf(found), math.nan, found)
    whole = np.asarray(values).dtype.kind in "iu" and bool((found == found.round()).all())
    out: Value = (found.astype(int) if whole else found).tolist()
    return out


BOUND, MEASURED, IN_PLUCKS, RANDOM = "bound", "measured", "plucks", "random"
HEAD = ("id", "section", "statement", "expected", BOUND, MEASURED, IN_PLUCKS, RANDOM, "holds")
AXES_TITLE = "Axes: ticks of the paper's figures, which it does not state, not counted"
INPUTS_TITLE = "Set-up: the paper's inputs, read back and not counted"
NOT_COUNTED = {AXIS: AXES_TITLE, SETUP: INPUTS_TITLE}  # by bound: the title of their part of the table
NOT_MET = "never"  # a time at which nothing happened
WIDTHS = (18, 9, 38, 18, 9, 20, 20, 6, 5)  # maximum characters of a column in the text table
LEGEND_WIDTHS = (8, 110)


def value_text(value: Any, unit: str = "") -> str:
    """A value of a claim in four digits; consecutive integers as "1 to 12"."""
    if isinstance(value, str):
        shown = value
    elif isinstance(value, list):
        row = len(value) > 3 and float(value[0]).is_integer() and all(b - a == 1 for a, b in pairwise(value))
        shown = f"{value[0]} to {value[-1]}" if row else ", ".join(value_text(v) for v in value) or "none"
    else:
        shown = NOT_MET if math.isnan(value) else f"{value:.4g}"
    return f"{shown} {unit}" if unit and value != [] and shown != NOT_MET else shown


def parts(results: Iterable[ClaimResult]) -> list[list[ClaimResult]]:
    """The results that count, and the results of each kind in NOT_COUNTED."""
    results = list(results)
    rest = [[r for r in results if r.claim.bound == bound] for bound in NOT_COUNTED]
    return [[r for r in results if r.claim.bound not in NOT_COUNTED], *rest]


def all_hold(results: Iterable[ClaimResult]) -> bool:
    """True if all claims hold, and all inputs are as in the paper; axis ticks may be missed."""
    return all(r.passed for r in results if r.claim.bound != AXIS)


def count_line(results: Sequence[ClaimResult]) -> str:
    """The number of claims that hold, the names of the others, and the number of sharp ones.

    Such as "82 of 83 hold, not b-phase; 20 are sharp ...".
    """
    claims, axes, inputs = parts(results)
    failed = [r.claim.id for r in (*claims, *inputs) if not r.passed]
    line = f"{sum(r.passed for r in claims)} of {len(claims)} hold"
    line += f", not {', '.join(failed)}" if failed else ""
    line += f"; {sum(r.sharp for r in claims)} are sharp: {100 * SHARP:g} % of random values or fewer pass"
    line += f"; {sum(r.passed for r in axes)} of {len(axes)} ticks of axes are met" if axes else ""
    return line + (f"; {sum(r.passed for r in inputs)} of {len(inputs)} inputs are as in the paper" if inputs else "")


def cells(result: ClaimResult) -> tuple[str, ...]:
    """The columns of `HEAD` for one result."""
    c, spread = result.claim, result.spread
    wanted = c.expects.expected
    expected = value_text(wanted, "" if str(wanted).isalpha() else c.unit)  # "rising" has no unit
    if result.tolerance.startswith("±"):
        expected += f" {result.tolerance}"
    plucks = ""
    if spread:
        plucks = f"{spread.held} of {spread.plucks}"
        if spread.low is not None and spread.high is not None:
            ends = zip(numbers(spread.low), numbers(spread.high), strict=True)
            plucks += ": " + ", ".join(f"{_short(low)} to {_short(high)}" for low, high in ends)
    random = "" if result.null is None else f"{100 * result.null:{'.0f' if result.null > 0.01 else '.1g'}} %"
    verdict = "yes" if result.passed else "NO"
    return c.id, c.section, c.statement, expected, c.bound, value_text(result.measured, c.unit), plucks, random, verdict


def _short(number: float) -> str:
    """A number in three digits, or all its digits before the point."""
    return NOT_MET if math.isnan(number) else f"{number:.0f}" if abs(number) >= 1000 else f"{number:.3g}"


LEGEND = {  # for columns that need one
    BOUND: "paper: the number is the paper's; one pluck: it is the paper's, of one chaotic pluck, and holds if it lies "
    f"{WITHIN}; direction: the paper says which is greater, no number; ours: the paper has a word, and the number is "
    "ours; rounding: it is exact; axis: a tick of an axis in a figure, not stated and not counted. "
    "Tolerances and margins that the paper lacks are ours",
    MEASURED: "the median over the plucks, if there are any",
    IN_PLUCKS: "how many the claim holds in, of plucks within what the paper leaves open (apex 0.05 mm to either side, "
    "place 8 mm less to 4 mm more, rounding 2 to 6 mm), and the values between which nine tenths of them lie",
    RANDOM: "how many random values would pass; the JSON has what is random",
}


def legend_line() -> str:
    """The `LEGEND` as one line."""
    return ". ".join(f"{name[0].upper()}{name[1:]}: {meaning}" for name, meaning in LEGEND.items())


def table(results: Sequence[ClaimResult]) -> str:
    """The results as a text table, with wrapped cells, a legend of the columns, and the number that hold."""
    claims, *others = parts(results)
    lines = wrapped_columns([HEAD, *(cells(r) for r in claims)], WIDTHS)
    for title, rows in zip(NOT_COUNTED.values(), others, strict=True):
        lines += ["", title, *wrapped_columns(map(cells, rows), WIDTHS)] if rows else []
    lines += ["", *wrapped_columns(LEGEND.items(), LEGEND_WIDTHS)]
    return "\n".join([*lines, "", count_line(results)])


def claims_html(results: Sequence[ClaimResult]) -> str:
    """The results as an HTML page, with the measured quantity of each claim. Needs Jinja2."""
    rows = [[(*cells(r)[:3], r.claim.quantity, *cells(r)[3:]) for r in part] for part in parts(results)]
    others = zip(NOT_COUNTED, NOT_COUNTED.values(), rows[1:], strict=True)
    head = (*HEAD[:3], "measured quantity", *HEAD[3:])
    return html_page(
        "livebass.lab.paper", "claims.html", head=head, claims=rows[0], others=[part for part in others if part[2]],
        verdict=count_line(results), legend=LEGEND,
    )  # fmt: skip


def claims_json(results: Sequence[ClaimResult]) -> str:
    """The results as JSON, `{"claims": [...]}`, each from `ClaimResult.as_json`."""
    return json_text({"claims": [r.as_json() for r in results]}, indent=2, ascii_only=False)


def claims_csv(results: Sequence[ClaimResult]) -> str:
    """The results with the JSON keys as columns; spaces separate the items of a list."""
    rows = [r.as_json() for r in results]
    return csv_text(
        rows[0], ([" ".join(map(repr, v)) if isinstance(v, list) else v for v in row.values()] for row in rows)
    )


WRITERS = {"json": claims_json, "csv": claims_csv, "html": claims_html}
