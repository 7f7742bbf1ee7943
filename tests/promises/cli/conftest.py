"""Commands run in an empty folder; sound without physics for them."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.engine import FakeEngine

from livebass.engine import render


@pytest.fixture(autouse=True)
def in_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> type[FakeEngine]:
    monkeypatch.setattr(render, "Engine", FakeEngine)
    monkeypatch.setattr("livebass.compiling.library.is_cached", lambda: True)
    monkeypatch.setattr(FakeEngine, "peak", 0.1)
    monkeypatch.setattr(FakeEngine, "weakened", 0)
    return FakeEngine
