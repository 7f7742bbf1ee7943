"""Every statement of Issanchou et al. (2018) that can be checked, checked: what `livebass study claims` does."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from livebass import (
    claims_contact,
    claims_linear,
    claims_neck,
    claims_player,
    claims_runs,
    claims_scheme,
    claims_spectrum,
)
from livebass.claims_expect import Claim, Value, finite
from livebass.preset_build import nearest

TABLES = (claims_linear, claims_scheme, claims_contact, claims_spectrum, claims_player, claims_neck)
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
            "measured": finite(self.measured),
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


def check(
    claims: Iterable[Claim], workers: int | None = None, progress: Callable[[float], None] | None = None
) -> list[Result]:
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
