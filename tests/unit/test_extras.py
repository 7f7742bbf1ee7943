"""The command that installs missing parts, for each way of installing livebass."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import shlex
import sys
import tomllib

import pytest
from support.places import ROOT
from support.programs import load

from livebass.system.extras import REFERENCE, install

STATED = ["numpy>=1.26", "sounddevice>=0.5; extra == 'live'", 'JACK-Client ; extra == "live"', "scipy; extra == 'x'"]


@pytest.fixture(autouse=True)
def _stated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda _: STATED)


def test_it_names_the_packages_and_the_running_python() -> None:
    python = shlex.quote(sys.executable)
    assert install("live") == f"{python} -m pip install 'sounddevice>=0.5' JACK-Client"
    assert install("x,live") == f"{python} -m pip install 'sounddevice>=0.5' JACK-Client scipy"


def test_without_metadata_it_names_livebass(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(_: str) -> None:
        raise importlib.metadata.PackageNotFoundError

    monkeypatch.setattr(importlib.metadata, "requires", none)
    assert install("live,x").endswith(" -m pip install 'livebass[live,x]'")


@pytest.mark.parametrize(
    "prefix, pip, begins",
    [
        ("/home/me/.local/share/pipx/venvs/livebass", True, "pipx inject livebass 'sounddevice"),
        ("/home/me/.local/share/uv/tools/livebass", True, "uv pip install --python "),
        ("/home/me/project/.venv", False, "uv pip install --python "),
    ],
)
def test_it_is_that_of_the_program_that_installed_livebass(
    monkeypatch: pytest.MonkeyPatch, prefix: str, pip: bool, begins: str
) -> None:
    monkeypatch.setattr(sys, "prefix", prefix)
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: object() if pip else None)
    assert install("live").startswith(begins)


def test_a_wheel_has_numba_in_an_extra_and_a_checkout_needs_it() -> None:
    wheels, text = load("wheels"), (ROOT / "pyproject.toml").read_text("utf-8")
    before, after = (tomllib.loads(one)["project"] for one in (text, wheels.without_compiler(text)))
    (numba,) = (one for one in before["dependencies"] if one.startswith("numba"))
    assert "<" in numba, "bounded above: lowering.py replaces parts of numba"
    assert after["dependencies"] == [one for one in before["dependencies"] if one != numba]
    assert after["optional-dependencies"] == {REFERENCE: [numba]} | before["optional-dependencies"]
    with pytest.raises(ValueError, match="numba must be in one line, not in 2"):
        wheels.without_compiler(text.replace('    "numpy', f'    "{numba}",\n    "numpy'))
