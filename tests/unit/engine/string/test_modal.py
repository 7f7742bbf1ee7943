"""Tuned modes: the effect of a bend on their frequencies and on their motion."""

from __future__ import annotations

import numpy as np
from support.played import Played, event

from livebass.kernels.string.records import BEND, EVENT, PLUCK
from livebass.rows.arrays import Floats

HIGHEST = 0.45  # of the contact rate, which carries no mode much faster


def tune(string: Played) -> tuple[Floats, Floats]:
    """Turns per fine step of the modes of u, (modes,): before and after a bend of an octave upwards."""
    op = string.ops[0]
    string.play(event(PLUCK, apex=2e-3, place=0.7 * float(op["length"]), width=5e-3, seconds=1e-4))
    turns = [string.voice.slots[int(string.record["slot"])]["u"]["omega"].copy()]
    string.play(event(BEND, value=2.0))
    while string.record["tuned"] != string.record["bend"]:
        string.play(np.zeros(0, EVENT))
    turns.append(string.voice.slots[int(string.record["slot"])]["u"]["omega"].copy())
    before, after = (x[: int(op["modes"])] * float(op["fine"]) / (2 * np.pi) for x in turns)
    return before, after


def test_a_bend_tunes_all_modes_but_those_that_the_contact_rate_does_not_carry() -> None:
    before, after = tune(Played("paper-bass", 0))
    assert before.max() < HIGHEST < 0.5 < 2 * before.max(), "the highest modes have no room for an octave"
    assert 0.3 < np.mean(2 * before < HIGHEST) < 0.95
    np.testing.assert_allclose(after, np.minimum(2 * before, HIGHEST), rtol=1e-12)
