"""Tension that follows the motion, and the motion too small to count."""

from __future__ import annotations

import numpy as np
import pytest
from support.played import RATE, Played, event

from livebass.engine.prepare import modal_row, play_frames
from livebass.kernels.string.records import EVENT, HAND, PLUCK

LOOK = 64  # frames
MINIMUM = 1e-7  # of the tension


def tension_added(string: Played) -> float:
    """The tension added by the motion, relative to the tension."""
    slot = string.voice.slots[int(string.record["slot"])]
    op = string.ops[int(slot["fret"])]
    slope = 0.0
    for name, count in (("u", int(slot["active"])), ("v", int(slot["v_active"]))):
        bent = np.arange(1, count + 1) * np.pi / float(op["length"]) * modal_row(slot[name], "q")[:count]
        slope += float(bent @ bent)
    return float(string.record["stretch"]) * slope * float(op["weight"]) / float((op["fine"] * op["speed"]) ** 2)


def pluck(string: Played, apex: float) -> None:
    place = 0.8 * float(string.ops[0]["length"])
    string.play(event(PLUCK, 0, apex=apex, place=place, width=2e-3, seconds=1e-4, angle=0.5))
    while string.hands()[0]:
        string.play(np.zeros(0, EVENT))


@pytest.mark.parametrize("quality", ["live", "studio", "reference"])
@pytest.mark.parametrize("preset", ["jazz-finger", "slap"])
def test_tension_is_left_out_of_small_motion_alone(preset: str, quality: str) -> None:
    """With float64 modes it never is; a hand ends it."""
    string = Played(preset, 3, quality)
    pluck(string, 1e-3)
    slot = string.voice.slots[int(string.record["slot"])]
    none, out, steady = np.zeros(0, EVENT), np.zeros(LOOK), []
    rings, lasts = round(0.2 * RATE / LOOK), round(0.59 * RATE / LOOK)
    for k in range(lasts):
        now = none
        if k == rings:
            now = event(HAND, value=30.0)  # /s
            now["frame"] = int(string.record["frame"])
        play_frames(string.voice, string.ops, now, out)
        if not slot["on"]:
            break
        steady.append(bool(slot["steady"]))
        if steady[-1]:
            assert tension_added(string) < MINIMUM
    assert len(steady) == lasts and not any(steady[:rings])
    assert steady[-1] == (quality != "reference")
    string.frame = int(string.record["frame"])
    pluck(string, 1e-3)
    assert not slot["steady"]
