"""The distance by which `tools/identified.py` judges identified presets."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

TOOLS = Path(__file__).parents[2] / "tools"
RATE = 44_100


@pytest.fixture
def tool(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(TOOLS)
    spec = importlib.util.spec_from_file_location("identified", TOOLS / "identified.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(__import__("sys").modules, "identified", module)
    spec.loader.exec_module(module)
    return module


def note(bright: float, damping: float = 1.0) -> np.ndarray:
    t = np.arange(round(1.2 * RATE)) / RATE
    return sum(j**-bright * np.exp(-damping * t) * np.sin(2 * np.pi * 55 * j * t) for j in range(1, 80))


def test_loudness_does_not_count(tool: ModuleType) -> None:
    one = tool.third_octaves(note(1.0), RATE, 1.0)
    assert one.shape == (36, tool.BANDS)
    assert tool.distance(one, tool.third_octaves(0.1 * note(1.0), RATE, 1.0)) < 0.1


def test_what_decays_or_shines_otherwise_is_farther(tool: ModuleType) -> None:
    one = tool.third_octaves(note(1.0), RATE, 1.0)
    near, far = (tool.distance(one, tool.third_octaves(note(b), RATE, 1.0)) for b in (1.1, 1.5))
    assert 0.1 < near < far
    assert tool.distance(one, tool.third_octaves(note(1.0, 4.0), RATE, 1.0)) > 3


def test_t60_of_both_are_compared(tool: ModuleType) -> None:
    twice = tool.ln_t60(note(1.0, 1.5), (note(1.0, 3.0), RATE), 55.0)
    assert twice == pytest.approx(np.log(2), abs=0.05)
