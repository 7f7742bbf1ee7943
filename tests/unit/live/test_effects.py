"""Effects on the audio thread equal a render's bit for bit and frame for frame in any blocks; off they do nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.live import RATE, run_ahead
from support.strings import behind

from livebass import Quality, load_preset, score_of
from livebass.engine.engine import Engine
from livebass.kernels.effects.records import PART
from livebass.live.fake import FakeDevice
from livebass.live.synth import RING, LiveBass, Synth
from livebass.live.thread.ring import push_event, push_message
from livebass.model.instrument import Instrument, Response
from livebass.rows.arrays import Floats
from livebass.rows.techniques import EFFECT, EFFECTS, GAIN_DB, PARAMETER

LIGHT = Quality("light", 60, 192e3)
FRAMES = 40_000
SLAP, JAZZ = load_preset("slap"), load_preset("jazz-finger")
HALL = Response(44_100, (np.exp(-np.arange(9000) / 2000) * np.cos(np.arange(9000.0)) / 20).tobytes())
NOTES = [(0.1 * k, 0.15, 33 + 5 * (k % 4), 120 - 9 * k) for k in range(5)]
SCORE = score_of(NOTES, RATE)
COMPRESSION, DRIVE = map(EFFECTS.index, ("compression", "drive"))
Event = tuple[int, int, int, float]  # frame, kind, number, value


def synth_of(bass: Instrument) -> tuple[Synth, FakeDevice]:
    synth = Synth(RATE)
    synth.record["ceiling"] = np.inf
    synth.switch_to(LiveBass(bass, LIGHT, RATE))
    run_ahead(synth, "never")
    return synth, FakeDevice(synth)


def play(bass: Instrument, events: list[Event] = [], sizes: tuple[int, ...] = (512,), frames: int = FRAMES) -> Floats:  # noqa: B006
    """The synth's sound of SCORE and of events, in blocks of `sizes` in turn."""
    synth, device = synth_of(bass)
    for frame, message in zip(SCORE.frames.tolist(), SCORE.messages.tolist(), strict=True):
        push_message(synth.rings[1].ctypes.data, RING, frame, *message)
    for event in events:
        push_event(synth.rings[2].ctypes.data, RING, *event)
    out, k = [], 0
    while sum(map(len, out)) < frames:
        out.append(device.block(sizes[k % len(sizes)]))
        k += 1
    return np.concatenate(out)[:frames]


def render(bass: Instrument) -> Floats:
    """The mix of a render."""
    engine = Engine(bass, LIGHT, RATE)
    engine.send(SCORE.frames, SCORE.messages)
    mix = engine.process_with_mix(FRAMES)[1]
    assert mix is not None
    return mix


ON: dict[str, dict[str, Any]] = {
    "compression": {"compression": 0.5},
    "drive": {"drive": 0.6},
    "amp": {"drive": 0.4, "clean_blend": 0.5, "eq_bass": 6.0, "eq_high_mid": -3.0, "cabinet": "closed-4x10"},
    "all": {"compression": 0.3, "drive": 0.2, "response": HALL, "eq_treble": 3.0, "cabinet": "vented-1x15"},
}


@pytest.mark.parametrize("kind", ON)
def test_a_synth_plays_what_a_render_has(kind: str) -> None:
    bass = behind(SLAP, **ON[kind])
    wanted = render(bass)
    assert np.abs(wanted).max() > 0.01
    for sizes in ((512,), (64,), (37, 700, 1, 2000)):
        assert np.array_equal(play(bass, sizes=sizes), wanted), sizes


@pytest.mark.parametrize("kind", ON)
def test_the_floor_goes_through_the_effects_as_in_a_render(kind: str) -> None:
    """The bits are the same in any blocks, and through a rest."""
    bass = behind(replace(SLAP, player=replace(SLAP.player, floor_noise=-30.0)), **ON[kind])
    wanted = render(bass)
    floor = wanted - render(behind(SLAP, **ON[kind]))
    assert np.abs(floor[-1000:]).max() > 1e-4
    for sizes in ((512,), (37, 700, 1, 2000)):
        assert np.array_equal(play(bass, sizes=sizes), wanted), sizes


def test_knobs_of_a_host_take_the_place_of_the_bass() -> None:
    requested = [(0, EFFECT, COMPRESSION, 0.5), (0, EFFECT, DRIVE, 0.25)]
    wanted = render(behind(SLAP, compression=0.5, drive=0.25))
    assert np.array_equal(play(SLAP, requested), wanted)
    assert np.array_equal(play(behind(SLAP, compression=0.9, drive=1.0), requested), wanted)
    again = [*requested, (0, EFFECT, COMPRESSION, float("nan")), (0, EFFECT, DRIVE, -3.0)]
    assert np.array_equal(play(behind(SLAP, drive=0.5), again), render(behind(SLAP, drive=0.5)))


def test_knobs_and_gain_move_at_their_frames_in_any_blocks() -> None:
    events = [
        (3001, EFFECT, DRIVE, 0.5), (7007, PARAMETER, GAIN_DB, -7.0), (9000, EFFECT, COMPRESSION, 0.8),
        (15_000, EFFECT, DRIVE, 0.0), (20_000, EFFECT, COMPRESSION, 0.0), (33_333, EFFECT, COMPRESSION, 0.1),
    ]  # fmt: skip
    wanted, plain = play(SLAP, events), play(SLAP, [(7007, PARAMETER, GAIN_DB, -7.0)])
    assert np.array_equal(wanted[:3001], plain[:3001]) and not np.array_equal(wanted[3001:3100], plain[3001:3100])
    assert np.array_equal(wanted[29_000:33_333], plain[29_000:33_333]), "off again, in all bits"
    assert np.abs(plain[29_000:33_333]).max() > 1e-5
    for sizes in ((64,), (37, 700, 1, 2000)):
        assert np.array_equal(play(SLAP, events, sizes), wanted), sizes


def test_the_gain_comes_behind_the_effects() -> None:
    quiet = play(behind(SLAP, drive=0.9), [(0, PARAMETER, GAIN_DB, -20.0)])
    assert np.allclose(quiet, 0.1 * render(behind(SLAP, drive=0.9)), rtol=1e-5, atol=1e-9)


def test_a_bass_that_rings_out_keeps_its_effects_until_they_are_still() -> None:
    synth, device = synth_of(behind(JAZZ, response=HALL))
    for key in (33, 38):
        synth.send(0x90, key, 120)
    one = [device.block(500) for _ in range(10)]
    synth.send(0xB0, 120)
    synth.switch_to(LiveBass(SLAP, LIGHT, RATE))
    rest = [device.block(500) for _ in range(10)]
    assert synth.ringing and np.abs(np.concatenate(rest[-3:])).max() > 1e-4, "of the response"
    assert np.abs(np.concatenate(one)).max() > 0.01
    for _ in range(200):
        last = device.block(500)
    assert not last.any()
    synth.release_faded()
    assert not synth.ringing


def test_a_synth_is_still_once_its_effects_are() -> None:
    from livebass.live.thread.block import is_still

    synth, device = synth_of(behind(JAZZ, response=HALL, compression=0.2))
    device.block(64)
    assert is_still(synth.address) == 1
    synth.send(0x90, 33, 120)
    device.block(2000)
    synth.send(0xB0, 120)
    silent = 0
    while not is_still(synth.address):
        silent = silent + 500 if not device.block(500).any() else 0
        assert synth.frame < 20 * RATE
    assert not device.block(2000).any()
    assert silent < 2 * RATE + PART


def test_another_synth_goes_on_with_the_knobs() -> None:
    synth, device = synth_of(SLAP)
    assert synth.set_value(EFFECT, DRIVE, 0.5)
    device.block(64)
    other = Synth(RATE)
    other.take_over(synth)
    assert other.value(EFFECT, DRIVE) == synth.value(EFFECT, DRIVE) == 0.5
