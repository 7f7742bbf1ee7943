"""The oldest packages that pyproject.toml allows: tools/oldest.py installs the lower bounds that it states."""

from __future__ import annotations

from support.programs import load

OLDEST = load("oldest")
PROJECT = OLDEST.project()


def test_every_requirement_has_a_lower_bound() -> None:
    found = OLDEST.wanted(PROJECT, PROJECT["optional-dependencies"])
    assert {"numpy", "click", "matplotlib", "pytest"} <= {OLDEST.name_of(one) for one in found}
    assert not [one for one in found if ">=" not in one or one.startswith("livebass")]


def test_extras_bring_those_they_name_and_packages_can_be_left_out() -> None:
    project = {
        "dependencies": ["numpy>=1"],
        "optional-dependencies": {"a": ["x>=2"], "b": ["livebass[a,c]", "y-z>=3"], "c": ["Q>=1"], "d": ["no>=1"]},
    }
    assert OLDEST.wanted(project, ["b"]) == ["Q>=1", "numpy>=1", "x>=2", "y-z>=3"]
    assert OLDEST.wanted(project, ["b"], ["q", "Y-Z"]) == ["numpy>=1", "x>=2"]
