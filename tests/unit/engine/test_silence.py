"""Modes that nobody hears are no longer computed: what each leaves out is far below a loud note."""

from __future__ import annotations

import numpy as np
import pytest
from support.own_basses import load_preset
from support.scores import RATE

from livebass import QUALITIES
from livebass.engine.engine import Engine
from livebass.engine.prepare import Voice, modal_row
from livebass.kernels.string.slot import REST_EVERY
from livebass.rows.arrays import Floats

ON, OFF = 0x90, 0x80
LOUD, BELOW = 110, -105.0  # velocity; dB


def speeds(voice: Voice) -> Floats:
    """Speed amplitudes (m^1.5/s) of the modes of u, then of v, that pickups sense, in the slot that plays."""
    found = []
    slot = voice.slots[voice.record["slot"][0]]
    for w, n in ((slot["u"], slot["active"]), (slot["v"], slot["v_active"])):
        q, p, kappa = (modal_row(w, name) for name in ("q", "p", "kappa"))
        with np.errstate(divide="ignore", invalid="ignore"):
            speed = np.hypot(p / kappa, w["omega"] * q)
        found.append(np.where(np.arange(len(q)) < min(n, slot["heard"]), speed, 0.0))
    return np.concatenate(found)


def play(engine: Engine, frames: int, *message: int) -> None:
    if message:
        engine.send(np.array([engine.frame]), np.array([message], np.uint8))
    engine.process(frames)


@pytest.mark.parametrize("quality", ["live", "studio"])
@pytest.mark.parametrize(("key", "velocity"), [(28, 30), (28, 100), (40, 60), (55, 100)])
def test_dropped_modes_are_far_below_a_loud_note(quality: str, key: int, velocity: int) -> None:
    """As the note rings, and as hands end it: the modes dropped in one check, together."""
    engine = Engine(load_preset("jazz-finger"), QUALITIES[quality], RATE)
    play(engine, RATE // 10, ON, key, LOUD)
    (i,) = (i for i, voice in enumerate(engine.voices) if voice.slots["on"].any())
    loud = np.linalg.norm(speeds(engine.voices[i]))
    engine = engine.another()
    voice, dropped, maximum = engine.voices[i], 0, 0.0
    play(engine, 1, ON, key, velocity)
    for message in ((), (OFF, key, 64)):
        play(engine, 1, *message)
        play(engine, -(engine.frame - int(voice.record["woken"][0])) % REST_EVERY)
        for _ in range(RATE // 2 // REST_EVERY):
            play(engine, REST_EVERY - 1)
            before = speeds(voice)
            play(engine, 1)
            gone = before[(before > 0) & (speeds(voice) == 0)]
            dropped, maximum = dropped + len(gone), max(maximum, float(np.linalg.norm(gone)))
    assert dropped > 100
    assert 20 * np.log10(maximum / loud) < BELOW
