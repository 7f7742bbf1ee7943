"""`tools/contact_order.py`: its steps follow the brute-force solver, keep the energy, and have the order they claim."""

from __future__ import annotations

import dataclasses
import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import strings

TOOLS = Path(__file__).parents[2] / "tools"
UNSOLVED = "a contact was not solved"


@pytest.fixture(scope="module")
def tool() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TOOLS))
        return importlib.import_module("contact_order")


@pytest.mark.slow
def test_steps_come_near_the_scheme_with_their_order(tool: Any) -> None:
    trial = strings.tiny(contact_rate=8e6, output_rate=tool.OUTPUT, duration=0.004)
    best = tool.moved(trial, 4e6, tool.PARTS["fivefold "])
    assert best is not None and best.time.size > 5, UNSOLVED
    scheme = tool.of_scheme(trial, 16e6)
    largest = np.abs(best.displacement).max()
    assert np.abs(scheme.displacement - best.displacement).max() < 2e-5 * largest
    for parts, kicks, least, most in (("", False, 3.3, 4.5), ("", True, 2, 8), ("fivefold ", False, 7, 20)):
        errors = []
        for rate in (2e6, 1e6):
            found = tool.moved(trial, rate, tool.PARTS[parts], kicks)
            assert found is not None, UNSOLVED
            errors.append(np.abs(found.displacement - best.displacement).max())
        assert least < errors[1] / errors[0] < most, f"{parts or 'plain'}: {errors}"


@pytest.mark.parametrize("parts", ["", "fivefold "])
def test_hold_keeps_the_energy(tool: Any, parts: str) -> None:
    trial = strings.tiny(contact_rate=8e6, output_rate=tool.OUTPUT, lossless=True)
    found = tool.moved(trial, 5e5, tool.PARTS[parts])
    assert found is not None and found.time.size > 5, UNSOLVED
    assert np.abs(found.energy / found.energy[0] - 1).max() < 1e-10
    losing = dataclasses.replace(strings.losing(trial, 3e8, 50.0), lossless=False)
    lost = tool.moved(losing, 5e5, tool.PARTS[parts])
    assert lost is not None, UNSOLVED
    assert np.diff(lost.energy).max() <= 0.0 and lost.energy[-1] < 0.999 * found.energy[-1]


def test_passes_needed_lie_between_two_rows(tool: Any) -> None:
    rows = [tool.Row("", "", passes, (error,) * 3, "", "", 0.0) for passes, error in ((400, 1e-3), (100, 1e-1))]
    assert tool.needed(rows, 1e-2, 0) == pytest.approx(200)
    assert np.isnan(tool.needed(rows, 1e-4, 0))
    assert tool.needed(rows, 1.0, 0) == 100
