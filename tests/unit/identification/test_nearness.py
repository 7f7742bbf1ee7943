"""The distance by which `tools/identified.py` judges identified presets."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from support.programs import load

from livebass.lab.comparison.distance import distance, shape

RATE = 44_100


@pytest.fixture
def tool() -> ModuleType:
    return load("identified")


def note(bright: float, damping: float = 1.0) -> np.ndarray:
    t = np.arange(round(1.2 * RATE)) / RATE
    return sum(j**-bright * np.exp(-damping * t) * np.sin(2 * np.pi * 55 * j * t) for j in range(1, 80))


def test_the_best_velocity_counts_and_loudness_does_not(tool: ModuleType) -> None:
    """It is the product's distance, over the span or the length of a shorter recording."""
    near, far = note(1.1), note(1.5)
    recorded = shape(0.1 * note(1.0), RATE, 3.0)
    found = tool.nearness(tool.shapes({30: far, 90: near}), recorded)
    assert found.velocities == (90, 90)
    assert found.distances[0] == pytest.approx(distance(near, note(1.0), RATE), abs=0.01)
    assert 0.1 < found.distances[1] < tool.nearness(tool.shapes({30: far}), recorded).distances[1]


def test_t60_of_both_are_compared(tool: ModuleType) -> None:
    twice = tool.ln_t60(note(1.0, 1.5), (note(1.0, 3.0), RATE), 55.0)
    assert twice == pytest.approx(np.log(2), abs=0.05)
