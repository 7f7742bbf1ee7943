"""Every statement of Issanchou et al. (2018) that can be checked, checked: what `livebass study claims` does.

Checked claims for people and programs: a table as text, as part of a page, as CSV and as JSON.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from livebass.paper.claims import runs as claims_runs
from livebass.paper.claims import section_4_1, section_4_2, sections_2_3
from livebass.paper.claims.expect import Claim, Value
from livebass.preset.build import nearest
from livebass.report.page import page as filled
from livebass.report.progress import Progress
from livebass.report.text import columns, csv_text, json_text, plain

TABLES = (sections_2_3, section_4_1, section_4_2)
CLAIMS = {claim.id: claim for table in TABLES for claim in table.CLAIMS}


@dataclass(frozen=True)
class Result:
    """A claim and what came out."""

    claim: Claim
    measured: Value
    passed: bool

    def as_json(self) -> dict[str, Any]:
        """Numbers and text only; in `measured` null is what was not there to be measured."""
        c = self.claim
        return {
            "id": c.id,
            "section": c.section,
            "statement": c.statement,
            "quantity": c.quantity,
            "expected": c.expects.expected,
            "measured": plain(self.measured),
            "unit": c.unit,
            "tolerance": c.expects.tolerance,
            "passed": self.passed,
        }


def chosen(ids: Iterable[str] = ()) -> list[Claim]:
    """The claims of these ids, each once, or all. Raises ValueError for one there is not."""
    wanted = list(dict.fromkeys(ids)) or list(CLAIMS)
    for name in wanted:
        if name not in CLAIMS:
            raise ValueError(f"claim {name[:40]!r}: unknown; {nearest(name, list(CLAIMS))}")
    return [CLAIMS[name] for name in wanted]


def check(claims: Iterable[Claim], workers: int | None = None, progress: Progress | None = None) -> list[Result]:
    """Solve what these claims need, each run once, on `workers` threads (default: as many as cores), and measure.

    `progress` is called with the fraction done. Needs SciPy. [main thread]
    """
    claims = list(claims)
    needs = {name for claim in claims for name in claim.needs}
    ready = 0

    def done() -> None:
        nonlocal ready
        ready += 1
        if progress:
            progress(ready / len(needs))

    runs = claims_runs.solve(needs, workers or os.cpu_count() or 1, done)
    return [result(claim, runs) for claim in claims]


def result(claim: Claim, runs: dict[str, claims_runs.Run]) -> Result:
    """One claim, measured in the runs it needs."""
    measured = claim.measure(*(runs[name] for name in claim.needs))
    return Result(claim, measured, bool(claim.expects.holds(measured)))


HEAD = ("id", "section", "statement", "expected", "measured", "holds")
WIDTHS = {"statement": 48, "expected": 26, "measured": 28}  # characters a line of text has for them


def value_text(value: Any, unit: str = "") -> str:
    """A value of a claim in four digits; whole numbers in a row as "1 to 12"."""
    if isinstance(value, str):
        shown = value
    elif isinstance(value, list):
        row = len(value) > 3 and value == list(range(int(value[0]), int(value[0]) + len(value)))
        shown = f"{value[0]} to {value[-1]}" if row else ", ".join(value_text(v) for v in value) or "none"
    else:
        shown = f"{value:.4g}"
    return f"{shown} {unit}" if unit and value != [] else shown


def count_line(results: Sequence[Result]) -> str:
    """How many hold."""
    return f"{sum(r.passed for r in results)} of {len(results)} hold"


def cells(result: Result) -> tuple[str, ...]:
    """What `HEAD` names, unshortened."""
    c = result.claim
    wanted = c.expects.expected
    expected = value_text(wanted, "" if str(wanted).isalpha() else c.unit)  # "rising" has no unit
    if c.expects.tolerance.startswith("±"):
        expected += f" {c.expects.tolerance}"
    measured = value_text(result.measured, c.unit)
    return c.id, c.section, c.statement, expected, measured, "yes" if result.passed else "NO"


def table(results: Sequence[Result]) -> str:
    """A line a claim, long cells shortened, and how many hold."""
    rows = [HEAD, *(cells(r) for r in results)]
    wide = [WIDTHS.get(name, 40) for name in HEAD]
    rows = [tuple(textwrap.shorten(c, w, placeholder=" …") for c, w in zip(row, wide, strict=True)) for row in rows]
    lines = [line.rstrip() for line in columns(rows, left=len(HEAD))]
    return "\n".join([*lines, count_line(results)])


def page(results: Sequence[Result]) -> str:
    """The table as an HTML page, with the measured quantity of each claim. Needs Jinja2."""
    rows = []
    for r in results:
        name, section, statement, *rest = cells(r)
        rows.append((name, section, statement, r.claim.quantity, *rest))
    return filled("livebass.paper", "claims.html", rows=rows, count=count_line(results))


def claims_json(results: Sequence[Result]) -> str:
    """`{"claims": [{id, section, statement, quantity, expected, measured, unit, tolerance, passed}]}`."""
    return json_text({"claims": [r.as_json() for r in results]}, indent=2, ascii_only=False)


def claims_csv(results: Sequence[Result]) -> str:
    """The keys of the JSON as columns; lists with spaces between."""
    rows = [r.as_json() for r in results]
    return csv_text(
        rows[0], ([" ".join(map(repr, v)) if isinstance(v, list) else v for v in row.values()] for row in rows)
    )


WRITERS = {"json": claims_json, "csv": claims_csv, "html": page}
