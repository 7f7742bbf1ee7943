"""Kernels as plain Python, for a debugger: the same contacts and note as compiled, up to rounding."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from support.plain import in_plain_python
from support.quiet import without_noise
from support.strings import case_b, oblique

from livebass.compiling import PLAIN
from livebass.engine.engine import Engine
from livebass.engine.solve import solve_trial
from livebass.kernels.pickup import tone
from livebass.model.quality import Quality

RATE = 24000
FEW = Quality("few", 10, 96e3)
ROUNDING = 1e-9  # relative to the largest: fused multiply-adds, and sums reordered by LLVM


def pluck() -> dict[str, list[float]]:
    """An oblique pluck against the frets, of few modes."""
    trial = dataclasses.replace(
        oblique(case_b(duration=0.0042), 0.6, 4e-3), modes=12, contact_rate=2e5, output_rate=2e4
    )
    motion = solve_trial(trial)
    assert motion.across_m is not None
    return {
        "step": motion.contact_step.tolist(),
        "point": motion.contact_index.tolist(),
        "u": motion.displacement_m.tolist(),
        "v": motion.across_m.tolist(),
    }


def note() -> dict[str, list[float]]:
    """A played note, with its fingers, on a bass of one string and two frets."""
    if PLAIN:
        tone.BELOW, tone.ABOVE, tone.TONES = 1, 1, 3  # filters of the pot: its ends and the bass's own, which plays
    bass = without_noise("jazz-finger")
    neck = bass.necks[-1]
    neck = dataclasses.replace(neck, fret_positions=neck.fret_positions[:2], fret_heights=neck.fret_heights[:2])
    engine = Engine(dataclasses.replace(bass, strings=bass.strings[-1:], necks=(neck,)), FEW, RATE, workers=1)
    key = bass.strings[-1].open_note + 2
    engine.send(np.array([0, 130]), np.array([[0x90, key, 110], [0x80, key, 0]], np.uint8))
    return {"sound": engine.process(140)[0].tolist()}


def test_kernels_run_in_plain_python() -> None:
    """The same in a separate process, without the compiled library."""
    plain = in_plain_python(__file__)
    compiled = pluck() | note()
    assert len(plain["step"]) > 20, "the string hits its frets"
    assert (plain["step"], plain["point"]) == (compiled["step"], compiled["point"])
    for name in ("u", "v", "sound"):
        assert max(map(abs, compiled[name])) > 0
        assert plain[name] == pytest.approx(compiled[name], rel=0, abs=ROUNDING * max(map(abs, compiled[name]))), name


if __name__ == "__main__":
    assert PLAIN
    print(json.dumps(pluck() | note()))
