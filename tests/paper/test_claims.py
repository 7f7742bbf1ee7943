"""The claims of the paper: they are checked, they can fail, and the results are written as they are."""

from __future__ import annotations

import csv
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from support.command import Run as Command
from support.command import assert_one_clear_line

from livebass.analysis.motion import Solved
from livebass.model.trial import Motion
from livebass.paper.claims import runs
from livebass.paper.claims.check import (
    CLAIMS,
    TABLES,
    Result,
    check,
    chosen,
    claims_html,
    claims_json,
    needed,
    result,
    table,
    value_text,
)
from livebass.paper.claims.expect import (
    AtLeast,
    AtMost,
    Between,
    Covers,
    Each,
    Exactly,
    Expectation,
    Falling,
    Near,
    Nears,
    Rising,
    Value,
)
from livebass.paper.solving import Job

KEYS = ["id", "section", "statement", "quantity", "expected", "measured", "unit", "tolerance", "passed"]
CASE_B = [claim for claim in CLAIMS.values() if claim.needs == ("b",)]
BEYOND = {"fretless", "one-contact"}  # cases of the same group, not of the paper
CHEAP = ("a-no-contact", "g-fundamental", "a-centroid")


@pytest.fixture(scope="module")
def solved() -> dict[str, Solved]:
    """Cases A and B at the paper's rates."""
    return runs.solve(["b", "a"], workers=2)


def test_the_tables() -> None:
    assert len(CLAIMS) == sum(len(section.CLAIMS) for section in TABLES) >= 25
    assert set(needed(CLAIMS.values())) == {*runs.ENGINE, *runs.BRUTE} - BEYOND
    for claim in CLAIMS.values():
        assert re.fullmatch(r"[24](\.\d){0,2}|3(\.2)?", claim.section), claim.id
        assert claim.statement and claim.quantity and claim.expects.tolerance, claim.id


@pytest.mark.parametrize("name", CLAIMS)
def test_nothing_measured_is_no_pass(name: str) -> None:
    expects = CLAIMS[name].expects
    for nothing in (math.nan, [math.nan], [math.nan] * 2, [math.nan] * 3, []):
        assert not expects.holds(nothing)


@pytest.mark.parametrize(
    "expects, good, bad",
    [
        (Near(4e-3, 0.1), [3.61e-3, 4.39e-3], [3.5e-3, 4.5e-3, -4e-3]),
        (Nears((1.0, 2.0), 0.1), [[1.09, 1.81]], [[1.0], [1.0, 2.3], [1.0, 2.0, 3.0]]),
        (AtLeast(2), [2, [2, 5]], [1.9, [5, 1]]),
        (AtMost(2), [2, [1, 2]], [2.1, [1, 3]]),
        (Between(1, 2), [1, 2, [1.5]], [0.9, 2.1, [1.5, 3]]),
        (Exactly(12), [12], [11, [12]]),
        (Exactly((1, 2)), [[1, 2]], [[2, 1], [1], 1]),
        (Rising(0.1), [[1, 1.2, 2]], [[1, 1.05], [2, 1], [1, 2, 2], [1]]),
        (Falling(), [[3, 2, 2, 1]], [[3, 4, 1], [1, 1], [3]]),
        (Falling(0.1), [[3, 3.2, 1]], [[3, 3.4, 1], [3, 2.9, 3.1]]),
        (Covers(0.25, 0.35), [[0.2, 0.4]], [[0.26, 0.4], [0.2, 0.34], [0.2]]),
        (Each((AtLeast(2), AtMost(1))), [[2, 1]], [[1, 1], [2, 2], [2]]),
    ],
)
def test_expectations(expects: Expectation, good: list[Value], bad: list[Value]) -> None:
    for value in good:
        assert expects.holds(value), value
    for value in bad:
        assert not expects.holds(value), value


@pytest.mark.parametrize("name", [claim.id for claim in CASE_B])
def test_case_b_as_the_paper_has_it(name: str, solved: dict[str, Solved]) -> None:
    """At 8 MHz with all modes; and a string that touches nothing passes for none of it."""
    case_b = result(CLAIMS[name], solved)
    assert case_b.passed, f"{case_b.measured}, expected {CLAIMS[name].expects.expected}"
    other = result(CLAIMS[name], {"b": solved["a"]})
    assert not other.passed, f"case A passes with {other.measured}"


@pytest.mark.parametrize("name, wrong", [
    ("b-first-contact", Near(5e-3, 0.1)), ("b-first-set", Exactly(tuple(range(1, 14)))), ("b-phase", Near(0.15, 0.1)),
    ("b-fewer", Rising()), ("b-energy", AtMost(5)),
])  # fmt: skip
def test_another_expectation_fails(name: str, wrong: Expectation, solved: dict[str, Solved]) -> None:
    assert not result(replace(CLAIMS[name], expects=wrong), solved).passed


@pytest.mark.slow
def test_all_claims_but_two_hold() -> None:
    """The two that do not are told in `livebass help studies`."""
    assert {r.claim.id for r in check(CLAIMS.values()) if not r.passed} == {"soft-longer", "soft-decrease"}


def test_each_run_is_solved_once_and_heard_of(monkeypatch: pytest.MonkeyPatch) -> None:
    began: list[str] = []
    real = Job.solve

    def solve(job: Job) -> Motion:
        began.append(next(name for name in ("a", "b", "neck") if runs.job(name) == job))
        return real(job)

    monkeypatch.setattr(Job, "solve", solve)
    heard: list[float] = []
    results = check(chosen(["a-no-contact", "a-centroid", "neck-no-contact", "g-mode-34"]), 1, heard.append)
    assert began == ["neck", "a"] and heard == [0.5, 1.0]
    assert [r.claim.id for r in results] == ["a-no-contact", "a-centroid", "neck-no-contact", "g-mode-34"]
    assert all(r.passed for r in results)


def test_the_command(run: Command, tmp_path: Path) -> None:
    file, out = tmp_path / "claims.json", tmp_path / "new" / "out"
    status, text, err = run("study", "claims", *CHEAP, "--json", file, "-o", out, "--workers", 1)
    assert status == 0, err
    lines = text.splitlines()
    assert lines[-1] == "3 of 3 hold" and len(lines) == 5
    assert [line.split()[0] for line in lines[1:-1]] == list(CHEAP)
    found = json.loads(file.read_text())["claims"]
    assert [list(claim) for claim in found] == [KEYS] * 3
    assert [claim["id"] for claim in found] == list(CHEAP)
    assert found[0]["measured"] == 0 and found[1]["measured"] == pytest.approx(97.97319798)
    assert found[0]["passed"] is True and found[1]["unit"] == "Hz" and found[1]["tolerance"] == "± 0.5 %"
    assert json.loads((out / "claims.json").read_text())["claims"] == found
    with open(out / "claims.csv", newline="") as lines:
        assert [row["id"] for row in csv.DictReader(lines)] == list(CHEAP)
    assert "3 of 3 hold" in (out / "claims.html").read_text()
    assert sorted(p.name for p in out.iterdir()) == ["claims.csv", "claims.html", "claims.json"]


def test_a_claim_that_fails(run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CLAIMS, "g-fundamental", replace(CLAIMS["g-fundamental"], expects=Near(110, 0.005)))
    file = tmp_path / "claims.json"
    status, text, _ = run("study", "claims", "g-mode-34", "g-fundamental", "--json", file)
    assert status == 1 and text.splitlines()[-1] == "1 of 2 hold"
    assert text.splitlines()[2].endswith("NO")
    assert [claim["passed"] for claim in json.loads(file.read_text())["claims"]] == [True, False]


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("b-first-contakt",), "claim 'b-first-contakt': unknown; nearest: b-first-contact"),
        (("xyz",), "allowed: g-fundamental, g-tension"),
        (("a-no-contact", "--json", "no/claims.json"), "there is no directory"),
        (("a-no-contact", "-o", "file"), "is not a directory"),
        (("a-no-contact", "-o", "new", "--json", "new/claims.csv"), "-o writes a file of that name"),
        (("a-no-contact", "--workers", "0"), "1 to 64"),
    ],
)
def test_bad_input_is_one_line(
    run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("mine")
    status, out, err = run("study", "claims", *arguments)
    assert_one_clear_line(status, err)
    assert words in err and not out
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_texts_of_odd_values() -> None:
    claim = replace(CLAIMS["b-phase"], statement='5 < 6 & "so"')
    results = [Result(claim, math.nan, False), Result(claim, [1.5, math.inf], True)]
    found = json.loads(claims_json(results))["claims"]
    assert found[0]["measured"] is None and found[1]["measured"] == [1.5, None]
    text = claims_html(results)
    assert "5 &lt; 6 &amp; &#34;so&#34;" in text and text.count("<html") == 1 and text.count("<tr") == 3
    assert value_text(list(range(1, 13))) == "1 to 12"
    assert value_text([], "s") == "none"
    assert table(results).splitlines()[-1] == "1 of 2 hold"
