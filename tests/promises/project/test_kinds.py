"""Each test is of one kind, by its folder, and real ones do not disturb each other."""

from __future__ import annotations

import tomllib
from types import SimpleNamespace

import pytest
from support import kinds
from support.places import ROOT, TESTS
from xdist.remote import Producer

FILES = [f"{file.relative_to(ROOT).as_posix()}::test_it" for file in sorted(TESTS.rglob("test_*.py"))]
REALS = {file for file in FILES if file.startswith("tests/real/")}


def test_each_has_a_mark_that_pytest_knows() -> None:
    options = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["pytest"]["ini_options"]
    known = {line.partition(":")[0] for line in options["markers"]}
    found = [kinds.marks(file) for file in FILES]
    assert {mark for marks in found for mark in marks} == known - {"slow"}
    assert {marks[0] for marks in found} == set(kinds.KINDS) and len(found) > 100


@pytest.mark.parametrize("file", ["tests/test_new.py", "tests/new/test_new.py", "tests/real/test_new.py"])
def test_elsewhere_there_are_none(file: str) -> None:
    with pytest.raises(pytest.UsageError, match=rf"^{file}: tests stand in a folder of tests: unit, .*, real/PART$"):
        kinds.marks(f"{file}::test_it")


def test_two_workers_at_most_have_real_tests_and_begin_with_them() -> None:
    order = sorted(FILES, key=kinds.turn)
    groups = list(dict.fromkeys(kinds.group(file) for file in order))
    assert [kinds.marks(file)[0] == "real" for file in order] == sorted((f in REALS for f in order), reverse=True)
    assert sum(group.startswith("tests/real/") for group in groups) == 2
    assert len({kinds.group(file) for file in REALS if "/jack/" in file}) == 1
    assert len(groups) == 2 + len(FILES) - len(REALS)


def test_pytest_xdist_takes_these_groups(request: pytest.FixtureRequest) -> None:
    one_worker = SimpleNamespace(getvalue={"tx": ["popen"], "dist": "load"}.get)
    scheduler = request.config.hook.pytest_xdist_make_scheduler(config=one_worker, log=Producer("test"))
    assert {scheduler._split_scope(f"{file}[a::b@c]") for file in FILES} == {kinds.group(file) for file in FILES}
