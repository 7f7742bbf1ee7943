"""Hosts within the process: the plugins of one kind, their thread rules checked, and a test's own BASSES in them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.clap import Plugin
from support.picture import Host, shelf
from support.plugins import checked_binary, no_instruments_of_the_user  # noqa: F401

from livebass import load_preset
from livebass.plugin import bundle, clap, vst3
from livebass.plugin.systems import this_system


@pytest.fixture(scope="module")
def thread_checks() -> Iterator[None]:
    """Plugins written for this system abort where a thread rule is broken."""
    with pytest.MonkeyPatch.context() as patch:
        other, here = bundle.binary, this_system()
        patch.setattr(bundle, "binary", lambda system: checked_binary() if system == here else other(system))
        yield


@pytest.fixture(scope="module")
def folder(request: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plugin of CLAP with the module's BASSES."""
    made = tmp_path_factory.mktemp("clap") / "livebass"
    clap.write_bundle({name: load_preset(name) for name in request.module.BASSES}, made)
    return made


@pytest.fixture(scope="module")
def vst3_bundle(request: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("vst3") / "livebass.vst3"
    vst3.write_bundle({name: load_preset(name) for name in request.module.BASSES}, made)
    return made


@pytest.fixture(scope="module")
def instruments(request: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The module's BASSES as a plugin finds them."""
    return shelf(tmp_path_factory.mktemp("instruments"), request.module.BASSES)


@pytest.fixture
def plugin(folder: Path, lend: Any) -> Plugin:
    return lend(Plugin(folder))  # type: ignore[no-any-return]


@pytest.fixture
def host(instruments: Path, lend: Any) -> Host:
    return lend(Host(instruments))  # type: ignore[no-any-return]


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's folder; it and its parents are created on the first write."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "a" / "b"))
    return tmp_path / "a" / "b" / "livebass"
