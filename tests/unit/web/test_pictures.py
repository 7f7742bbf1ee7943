"""The page's pictures, in node: what a spectrum's line shows."""

from __future__ import annotations

import pytest
from support.node import node

TESTED = 'import {levelIn} from "./pictures.js";\nexport const tested = {levelIn};\n'
FLOOR = -110.0  # dB
LEVELS = [-60.0, -20.0, -40.0, -30.0, -90.0, -70.0]


def test_a_spectrums_line_joins_levels_that_are_far_apart_and_keeps_peaks() -> None:
    """At low frequencies a level is many px wide: the line has no steps; at high ones a peak is not lost."""
    ask = "return arguments[0].map(([from, to]) => tested.levelIn(arguments[1] || [null], from, to))"
    with node("tested.js", {"tested.js": TESTED}) as found:
        fine = found.run(ask, [[k / 4, (k + 1) / 4] for k in range(9)], LEVELS)
        assert fine == pytest.approx([-60, -50, -40, -20, -20, -25, -30, -35, -40])
        assert found.run(ask, [[0.5, 3.5], [3.5, 5], [2, 4]], LEVELS) == [-20, -70, -30]
        assert found.run("return tested.levelIn([-Infinity, -Infinity], 0.2, 0.4)") == FLOOR
