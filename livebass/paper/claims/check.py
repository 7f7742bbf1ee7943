"""Checks the claims of Issanchou et al. (2018) for `livebass study claims`, and writes the results.

The results are written as a text table, CSV, JSON and an HTML page.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from livebass.analysis.motion import Solved
from livebass.paper.claims import runs, section_4_1, section_4_2, sections_2_3
from livebass.paper.claims.expect import Claim, Value
from livebass.preset.build import nearest
from livebass.report.page import html_page
from livebass.report.progress import Progress, steps
from livebass.report.text import columns, csv_text, json_text, plain

TABLES = (sections_2_3, section_4_1, section_4_2)
CLAIMS = {claim.id: claim for table in TABLES for claim in table.CLAIMS}


@dataclass(frozen=True)
class Result:
    """A claim and the value measured for it."""

    claim: Claim
    measured: Value
    passed: bool

    def as_json(self) -> dict[str, Any]:
        """The result as JSON has it; None in `measured` for NaN, which is what could not be measured."""
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
    """The claims called `ids`, each once, or all of them. Raises ValueError for an unknown one."""
    wanted = list(dict.fromkeys(ids)) or list(CLAIMS)
    for name in wanted:
        if name not in CLAIMS:
            raise ValueError(f"claim {name[:40]!r}: unknown; {nearest(name, list(CLAIMS))}")
    return [CLAIMS[name] for name in wanted]


def check(claims: Iterable[Claim], workers: int | None = None, progress: Progress | None = None) -> list[Result]:
    """Solve the runs that these claims need, each once, on `workers` threads (default: as many as cores), and measure.

    `progress` is called with the fraction done. Needs SciPy. [main thread]
    """
    claims = list(claims)
    names = needed(claims)
    solved = runs.solve(names, workers, steps(progress, len(names)))
    return [result(claim, solved) for claim in claims]


def needed(claims: Iterable[Claim]) -> list[str]:
    """Names of the runs that these claims need, each once."""
    return list(dict.fromkeys(name for claim in claims for name in claim.needs))


def result(claim: Claim, solved: Mapping[str, Solved]) -> Result:
    """Check one claim in the solved runs, by name."""
    measured = claim.measure(*(solved[name] for name in claim.needs))
    return Result(claim, measured, bool(claim.expects.holds(measured)))


HEAD = ("id", "section", "statement", "expected", "measured", "holds")
WIDTHS = {"statement": 48, "expected": 26, "measured": 28}  # characters of a column in the text table, at most


def value_text(value: Any, unit: str = "") -> str:
    """A value of a claim in four digits; consecutive whole numbers as "1 to 12"."""
    if isinstance(value, str):
        shown = value
    elif isinstance(value, list):
        row = len(value) > 3 and value == list(range(int(value[0]), int(value[0]) + len(value)))
        shown = f"{value[0]} to {value[-1]}" if row else ", ".join(value_text(v) for v in value) or "none"
    else:
        shown = f"{value:.4g}"
    return f"{shown} {unit}" if unit and value != [] else shown


def count_line(results: Sequence[Result]) -> str:
    """The number of claims that hold, as "80 of 82 hold"."""
    return f"{sum(r.passed for r in results)} of {len(results)} hold"


def cells(result: Result) -> tuple[str, ...]:
    """The columns of `HEAD` for one result, unshortened."""
    c = result.claim
    wanted = c.expects.expected
    expected = value_text(wanted, "" if str(wanted).isalpha() else c.unit)  # "rising" has no unit
    if c.expects.tolerance.startswith("±"):
        expected += f" {c.expects.tolerance}"
    measured = value_text(result.measured, c.unit)
    return c.id, c.section, c.statement, expected, measured, "yes" if result.passed else "NO"


def table(results: Sequence[Result]) -> str:
    """The results as a text table, a line for each claim, long cells shortened, and the number that hold."""
    rows = [HEAD, *(cells(r) for r in results)]
    wide = [WIDTHS.get(name, 40) for name in HEAD]
    rows = [tuple(textwrap.shorten(c, w, placeholder=" …") for c, w in zip(row, wide, strict=True)) for row in rows]
    lines = [line.rstrip() for line in columns(rows, left=len(HEAD))]
    return "\n".join([*lines, count_line(results)])


def claims_html(results: Sequence[Result]) -> str:
    """The results as an HTML page, with the measured quantity of each claim. Needs Jinja2."""
    rows = []
    for r in results:
        name, section, statement, *rest = cells(r)
        rows.append((name, section, statement, r.claim.quantity, *rest))
    return html_page("livebass.paper", "claims.html", rows=rows, count=count_line(results))


def claims_json(results: Sequence[Result]) -> str:
    """The results as JSON, `{"claims": [...]}`, each as `Result.as_json` has it."""
    return json_text({"claims": [r.as_json() for r in results]}, indent=2, ascii_only=False)


def claims_csv(results: Sequence[Result]) -> str:
    """The results with the keys of the JSON as columns; the items of a list are separated by spaces."""
    rows = [r.as_json() for r in results]
    return csv_text(
        rows[0], ([" ".join(map(repr, v)) if isinstance(v, list) else v for v in row.values()] for row in rows)
    )


WRITERS = {"json": claims_json, "csv": claims_csv, "html": claims_html}
