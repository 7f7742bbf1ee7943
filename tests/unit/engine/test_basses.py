"""Several basses in one score: one rings out while the next plays, and a further change fades it out."""

from __future__ import annotations

import numpy as np
import pytest
from support.messages import Timed, send
from support.quiet import without_noise
from support.scores import play_in_blocks

from livebass import Quality
from livebass.engine.basses import Basses
from livebass.engine.engine import Engine
from livebass.kernels.player.performer import FADE
from livebass.rows.arrays import Floats

RATE = 48000
LIGHT = Quality("light", 60, 192e3)
JAZZ, SLAP, FRETLESS = (without_noise(name) for name in ("jazz-finger", "slap", "fretless"))
LOW: list[Timed] = [(0, 0xB0, 64, 127), (10, 0x90, 28, 100)]  # the E string rings on


def play(messages: list[Timed], frames: int, size: int) -> tuple[Floats, Basses]:
    """(strings, frames), in blocks of `size`."""
    basses = Basses(Engine(JAZZ, LIGHT, RATE), {33: JAZZ, 36: SLAP, 35: FRETLESS})
    return play_in_blocks(basses, messages, frames, [size]), basses


def test_the_bass_before_rings_out_and_the_one_before_that_is_faded_out() -> None:
    once = [*LOW, (8000, 0xC0, 36, 0), (9000, 0x90, 45, 90)]
    kept, basses = play(once, 24_000, 24_000)
    alone, _ = play(LOW, 24_000, 24_000)
    assert np.array_equal(kept[0], alone[0]) and np.abs(kept[3, 9000:]).max() > 0.01, "E rings on, G is the new one's"
    assert basses.report().notes == 2
    twice, basses = play([*once, (16_000, 0xC0, 35, 0)], 24_000, 24_000)
    whole = round(FADE * RATE)
    ramp = (whole - np.arange(whole)) / whole
    assert np.array_equal(twice[:, :16_000], kept[:, :16_000])
    assert np.array_equal(twice[0, 16_000 : 16_000 + whole], alone[0, 16_000 : 16_000 + whole] * ramp)
    assert not twice[0, 16_000 + whole :].any() and np.array_equal(twice[3], kept[3])
    assert basses.report().notes == 2


@pytest.mark.parametrize("size", [64, 777])
def test_blocks_of_any_size_sound_the_same(size: int) -> None:
    """Up to rounding in the basses that ring out: their filters' last remains are 180 dB down."""
    messages = [*LOW, (5000, 0xC0, 36, 0), (6000, 0xB0, 64, 0), (9000, 0x90, 28, 90), (20_000, 0xC0, 33, 0)]
    messages += [(21_000, 0xB0, 120, 0), (22_000, 0x90, 40, 90), (23_000, 0xC0, 1, 0), (24_000, 0xC0, 33, 0)]
    whole, _ = play(messages, 60_000, 60_000)
    assert np.allclose(play(messages, 60_000, size)[0], whole, rtol=0, atol=2e-9)


def test_a_bass_with_more_strings_comes_after_one_with_fewer() -> None:
    """Its B string is the first of five; the old E string rings on until the new bass plays an E."""
    five = without_noise("five-string")
    basses = Basses(Engine(JAZZ, LIGHT, RATE), {36: five})
    send(basses, [*LOW, (8000, 0xC0, 36, 0), (9000, 0x90, 23, 100)])
    sound = basses.process(24_000)
    alone, _ = play(LOW, 24_000, 24_000)
    new = Engine(five, LIGHT, RATE)
    send(new, [(0, 0xB0, 64, 127), (1000, 0x90, 23, 100)])
    assert sound.shape == (5, 24_000) and np.abs(alone[0, 9000:]).max() > 0.01
    assert np.array_equal(sound[1:4, :8000], alone[1:, :8000])
    assert np.allclose(sound[0, 8000:], alone[0, 8000:] + new.process(16_000)[0], rtol=0, atol=1e-12)
