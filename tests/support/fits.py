"""A fit to notes of a known bass."""

from __future__ import annotations

import pytest

pytest.importorskip("cmaes")
pytest.importorskip("scipy")
from livebass.lab.comparison.notes import Note
from livebass.lab.fitting.bounds import FREE
from livebass.lab.fitting.notes import Place
from livebass.lab.fitting.problem import Problem
from livebass.lab.fitting.target import measure_note, searched_figures
from livebass.preset.load import preset_tables

NAME = "jazz-finger"
BASE = preset_tables(NAME)[1]
TONE = next(f for f in FREE if f.key == "tone")
LOSS = next(f for f in FREE if f.key == "thermoelastic")
TRUTH = (1.2e-3, 0.4)  # loss, tone
PLACES = (Place(33, "E", 0), Place(45, "", 1))
KNOWN = Problem(NAME, BASE, "fingers", 2, dict.fromkeys(PLACES, ()), (LOSS, TONE))


def real_notes() -> dict[Place, Note]:
    """Notes of the base preset with other numbers, by another player."""
    return KNOWN.play(TRUTH, PLACES, seed=5)


def problem_of(real: dict[Place, Note]) -> Problem:
    """The search for these notes among the losses and tones."""
    theirs = {p: (measure_note(n.sound, n.rate, n.pitch, searched_figures("fingers")),) for p, n in real.items()}
    return Problem(NAME, BASE, "fingers", 2, theirs, (LOSS, TONE))
