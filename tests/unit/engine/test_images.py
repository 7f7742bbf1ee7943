"""What engines of tests share (support/images.py) is what each would make for itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.images import keep
from support.own_basses import load_preset

from livebass import QUALITIES, Instrument
from livebass.engine.image import Image, image
from livebass.model.quality import Quality

BASS = load_preset("slap")
OTHER_PLAYER = replace(BASS, player=replace(BASS.player, thumb_width=3e-3, floor_noise=-40.0, pluck_nearest=0.7))
LIVE, RATE = QUALITIES["live"], 48_000


def are_alike(made: Image, other: Image, rate: int = RATE) -> bool:
    """Whether the pools of two images, of `other` at RATE, are the same but for addresses in themselves."""
    one, two = made.pool(0, rate).memory, other.pool(0, RATE).memory
    if one.size != two.size:
        return False
    apart = one.view(np.int64) - two.view(np.int64)
    return set(apart[apart != 0]) <= {one.ctypes.data - two.ctypes.data}


def test_operators_do_not_depend_on_the_player_of_a_bass() -> None:
    assert are_alike(image(BASS, LIVE), image(OTHER_PLAYER, LIVE))
    assert keep(BASS, LIVE).pool(0, RATE) is keep(OTHER_PLAYER, LIVE).pool(0, RATE)


@pytest.mark.parametrize(
    ("bass", "quality", "rate"),
    [
        (replace(BASS, strings=(replace(BASS.strings[0], level=0.5), *BASS.strings[1:])), LIVE, RATE),
        (replace(BASS, necks=tuple(replace(neck, friction=9.0) for neck in BASS.necks)), LIVE, RATE),
        (replace(BASS, output=replace(BASS.output, pickups=BASS.output.pickups[:1])), LIVE, RATE),
        (BASS, replace(LIVE, modes=50), RATE),
        (BASS, replace(LIVE, contact_rate=96e3), RATE),
        (BASS, replace(LIVE, exact=True), RATE),
        (BASS, LIVE, 44_100),
    ],
)
def test_operators_that_differ_are_not_shared(bass: Instrument, quality: Quality, rate: int) -> None:
    shared = keep(bass, quality).pool(0, rate) is keep(BASS, LIVE).pool(0, RATE)
    assert not shared or are_alike(image(bass, quality), image(BASS, LIVE), rate)
