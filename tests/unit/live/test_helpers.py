"""Threads that play strings beside the audio thread: the same bits from any thread; a session starts and ends them."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from support.jack import PATIENCE
from support.live import QUICK, RATE, Session, run_ahead, synth_and_device
from support.quiet import without_noise

from livebass.live.fake import FakeDevice
from livebass.live.settings import Settings
from livebass.live.synth import LiveBass, Synth
from livebass.live.thread.records import MAX_HELPERS
from livebass.rows.arrays import Floats

BLOCKS = (64, 16, 256, 1000, 64, 64)  # frames


def helping() -> int:
    return sum(thread.name == "livebass helper" for thread in threading.enumerate())


def play(preset: str, count: int, how: str, minimum: int) -> Floats:
    """Wild playing on all strings with `count` helpers, which have played at least `minimum` strings."""
    synth, device = synth_and_device(preset, QUICK, adaptive=False)
    run_ahead(synth, how)
    synth.start_helpers(count)
    assert helping() == count
    rng, sounds = np.random.default_rng(11), []
    try:
        for k in range(100):
            for _ in range(int(rng.integers(0, 5))):
                first, second, frame = int(rng.integers(26, 60)), int(rng.integers(1, 128)), int(rng.integers(64))
                kind = int(rng.choice([0x90, 0x90, 0x90, 0x80, 0xE0]))
                synth.send(kind, first if kind != 0xE0 else 0, second, frame=synth.frame + frame)
            if k == 50:
                synth.switch_to(LiveBass(without_noise("five-string"), QUICK, RATE))  # the old bass rings out
            sounds.append(device.block(BLOCKS[k % len(BLOCKS)]))
        end = time.monotonic() + PATIENCE
        while synth.helped < minimum and time.monotonic() < end:
            more(synth, device)
        assert synth.helped >= minimum
        assert synth.meters().faults == 0
    finally:
        synth.stop_helpers()
    assert helping() == 0
    return np.concatenate(sounds)


def more(synth: Synth, device: FakeDevice) -> None:
    for key in (23, 28, 33, 38, 43):
        synth.send(0x90, key, 120)
    device.block(256)


@pytest.mark.parametrize(("preset", "how"), [("slap", "far"), ("slap", "never"), ("fretless", "as time allows")])
def test_strings_sound_the_same_whoever_plays_them(preset: str, how: str) -> None:
    alone = play(preset, 0, how, 0)
    assert np.abs(alone).max() > 0.05
    for count in (1, 3) if how == "never" else (3,):
        assert np.array_equal(play(preset, count, how, 50), alone), count


def test_helpers_come_and_go() -> None:
    synth, device = synth_and_device("slap", QUICK)
    synth.start_helpers(100)
    assert helping() == MAX_HELPERS
    synth.stop_helpers()
    synth.stop_helpers()
    assert helping() == 0
    before = synth.helped
    more(synth, device)
    assert synth.helped == before, "the audio thread plays alone again"
    synth.start_helpers(1)
    assert helping() == 1
    synth.stop_helpers()


def test_on_a_system_that_lacks_a_rest_there_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("livebass.live.synth.c_function", lambda name: 0)
    synth, device = synth_and_device("slap", QUICK)
    assert synth.start_helpers(2) is None and helping() == 0
    more(synth, device)
    assert synth.helped == 0


@pytest.mark.parametrize(
    ("cores", "refused", "wanted"),
    [(1, None, 0), (2, None, 1), (16, None, 3), (None, None, 2), (None, "no rights", 0), (2, "no rights", 1)],
)
def test_a_session_has_one_a_core_that_is_left_and_a_string(
    cores: int | None, refused: str | None, wanted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On three cores; without real-time priority only as asked for."""
    monkeypatch.setattr("livebass.live.rig.core_count", lambda: 3)
    monkeypatch.setattr("livebass.live.synth.make_realtime", lambda thread: refused)
    session = Session(Settings(without_noise("slap"), QUICK, cores=cores))
    synth = Synth(RATE)
    session.start_helpers(synth)
    assert helping() == wanted
    synth.stop_helpers()
