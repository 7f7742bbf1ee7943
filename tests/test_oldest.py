"""The oldest packages that pyproject.toml allows: tools/oldest.py installs the lower bounds that it states."""

from __future__ import annotations

import runpy
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
OLDEST = runpy.run_path(str(ROOT / "tools" / "oldest.py"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_every_requirement_has_a_lower_bound() -> None:
    found = OLDEST["requirements"](PROJECT, PROJECT["optional-dependencies"])
    assert {"numpy", "click", "matplotlib", "pytest"} <= {OLDEST["name_of"](one) for one in found}
    assert not [one for one in found if ">=" not in one or one.startswith("livebass")]


def test_extras_bring_those_they_name_and_packages_can_be_left_out() -> None:
    project = {
        "dependencies": ["numpy>=1"],
        "optional-dependencies": {"a": ["x>=2"], "b": ["livebass[a,c]", "y-z>=3"], "c": ["Q>=1"], "d": ["no>=1"]},
    }
    assert OLDEST["requirements"](project, ["b"]) == ["Q>=1", "numpy>=1", "x>=2", "y-z>=3"]
    assert OLDEST["requirements"](project, ["b"], ["q", "Y-Z"]) == ["numpy>=1", "x>=2"]
