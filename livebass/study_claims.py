"""What the paper says, statement by statement, beside what comes out: what `study claims` checks, for the page."""

from __future__ import annotations

from collections.abc import Mapping

from livebass import claims
from livebass.claims_text import HEAD, cells, count_line
from livebass.motion import Trial
from livebass.study_parts import Findings, Solved, Table


def trials(duration: float | None) -> dict[str, Trial]:
    """None: the claims solve what they look at, for as long as the paper speaks of, whatever the duration."""
    return {}


def report(motions: Mapping[str, Solved]) -> Findings:
    """All of them checked."""
    results = claims.check(claims.chosen())
    table = Table("statements", f"{count_line(results)} within the tolerance", HEAD, [cells(r) for r in results])
    return Findings(tables=[table], numbers={"claims": [r.as_json() for r in results]})
