"""The workflows of GitHub: they only call the project's commands, with few rights, for the Pythons that it supports."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from support.places import ROOT

FILES = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
CHOSEN = "${{ matrix.packages }}"
COMMAND = re.compile(r"(?:python tools/run\.py (?P<name>\w+)|gh)(?: [^;&|`()<>]+)?")


@pytest.fixture(params=FILES, ids=lambda file: file.stem)
def text(request: pytest.FixtureRequest) -> str:
    file = request.param
    assert isinstance(file, Path)
    return file.read_text()


def classify() -> list[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    return [found[1] for line in project["classifiers"] if (found := re.search(r"Python :: (3\.\d+)$", line))]


def test_there_are_workflows() -> None:
    assert [file.stem for file in FILES] == ["release", "site", "tests", "weekly"]


def test_each_step_is_one_command_of_ours(text: str) -> None:
    known = subprocess.run([sys.executable, ROOT / "tools" / "run.py"], capture_output=True, text=True).stderr
    names = re.findall(r"^ +packages: \[(.+)\]$", text, re.MULTILINE)
    steps = re.findall(r"\brun: *(.*)", text)
    steps += [run.replace(CHOSEN, name) for run in steps if CHOSEN in run for name in names[0].split(", ")]
    for run in (run for run in steps if CHOSEN not in run):
        found = COMMAND.fullmatch(run)
        assert found, run
        assert not found["name"] or re.search(rf"\b{found['name']}\b", known), f"tools/run.py has no {found['name']}"


def test_pythons_are_those_of_pyproject(text: str) -> None:
    for listed in re.findall(r"^ +python: \[(.+)\]$", text, re.MULTILINE):
        assert re.findall(r'"(.+?)"', listed) == classify()
    used = re.findall(r"^ +python-version: (.+)$", text, re.MULTILINE)
    assert len(used) == text.count("setup-python@")
    assert set(used) <= {"${{ matrix.python }}", *(f'"{version}"' for version in classify())}


def test_rights_are_few_and_actions_are_githubs_own_in_one_version(text: str) -> None:
    assert re.search(r"^permissions:\n  contents: read\n$", text, re.MULTILINE)
    assert re.search(r"^concurrency:\n  group: ", text, re.MULTILINE)
    assert "secrets." not in text
    jobs = re.split(r"^  \w+:\n", text.split("\njobs:\n")[1], flags=re.MULTILINE)[1:]
    for job in jobs:
        assert "timeout-minutes: " in job or "uses: ./.github/workflows/" in job
        if "write" in job:
            assert "checkout@" not in job and "run.py" not in job, "a job that may write runs nothing of the tree"
    assert text.count("actions/checkout@") == text.count("persist-credentials: false")


def test_an_action_has_one_version_in_all_workflows() -> None:
    versions: dict[str, set[str]] = {}
    for file in FILES:
        for name, version in re.findall(r"uses: (actions/[\w-]+)@(.+)", file.read_text()):
            versions.setdefault(name, set()).add(version)
        for used in re.findall(r"uses: (.*)", file.read_text()):
            assert re.fullmatch(r"actions/[\w-]+@v\d+|\./\.github/workflows/\w+\.yml", used), used
    assert versions and all(len(found) == 1 for found in versions.values()), versions
