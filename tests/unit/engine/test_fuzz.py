"""Random MIDI with all techniques at random frames: the sound is finite and bounded, and all sound off ends it.

It is the same bit for bit however the time is cut into blocks.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from support.costs import quick
from support.events import CHANNELS, LOUDEST, TOGETHER, random_events
from support.quiet import without_noise

from livebass import QUALITIES, preset_names
from livebass.engine.engine import Engine
from livebass.score.score import score_of

RATE = 48000
EVENTS = 100_000  # over all presets
LONGEST = 8192  # frames of a block


def loudest_note(bass: Engine) -> float:
    """The peak of the strings' open notes and a high one, played as hard as possible."""
    keys = [string.open_note for string in bass.instrument.strings]
    notes = [(0.3 * k, 0.2, key, 127) for k, key in enumerate([*keys, keys[-1] + bass.frets - 1])]
    return max(float(np.abs(block).max()) for block in bass.another().play(score_of(notes, RATE), 0.0))


def assert_it_bears(preset: str, events: int, seed: int) -> None:
    """Plays `events` random messages, and checks every frame.

    Boards run at the contact rate of frets, five times as fast.
    """
    bass = Engine(without_noise(preset), replace(QUALITIES["live"], modes=120, on_board=None), RATE)
    maximum, rng, sent = LOUDEST * loudest_note(bass), np.random.default_rng([*map(ord, preset), seed]), 0
    while sent < events:
        frames, messages = random_events(rng)
        frames += bass.frame
        bass.send(frames, messages)
        sound = bass.process(int(frames[-1]) + 1 - bass.frame)
        sent += TOGETHER
        assert np.isfinite(sound).all() and np.abs(sound).max() < maximum, (sent, np.abs(sound).max(), maximum)
    off = [(0xB0 | channel, 120, 0) for channel in CHANNELS]
    bass.send(np.full(len(off), bass.frame), np.array(off, np.uint8))
    bass.process(RATE)
    assert not bass.sounding() and not bass.process(RATE // 10).any()
    assert bass.report().weakened == 0


@pytest.mark.parametrize("preset", ["jazz-finger", "slap", "fretless"])
def test_a_thousand_messages(preset: str) -> None:
    assert_it_bears(preset, 1000, 1)


@pytest.mark.slow
@pytest.mark.parametrize("preset", preset_names())
def test_a_hundred_thousand_messages_in_all_presets(preset: str) -> None:
    assert_it_bears(preset, -(-EVENTS // len(preset_names())), 2)


TIERS = ("live", "studio", "reference")


def assert_blocks_change_nothing(preset: str, tier: str, events: int) -> None:
    """Plays `events` random messages in blocks of 1 to LONGEST frames, and in as few as they need."""
    whole = Engine(without_noise(preset), QUALITIES[tier], RATE)
    cut, rng, sent = whole.another(), np.random.default_rng([*map(ord, preset + tier)]), 0
    while sent < events:
        frames, messages = random_events(rng)
        frames += whole.frame
        sent += TOGETHER
        for bass in (whole, cut):
            bass.send(frames, messages)
        sound = whole.process(int(frames[-1]) + 1 - whole.frame)
        parts, left = [], sound.shape[-1]
        while left:
            parts.append(cut.process(min(left, int(LONGEST ** rng.random()))))
            left -= parts[-1].shape[-1]
        assert np.array_equal(np.concatenate(parts, axis=-1), sound), (sent, whole.frame)


QUICK = [("slap", "live"), ("jazz-finger", "studio"), ("fretless", "live")]


@pytest.mark.parametrize(("preset", "tier"), quick(itertools.product(preset_names(), TIERS), QUICK))
def test_blocks_of_any_length_change_nothing(preset: str, tier: str) -> None:
    assert_blocks_change_nothing(preset, tier, 300)


@pytest.mark.slow
@pytest.mark.parametrize(("preset", "tier"), list(itertools.product(preset_names(), TIERS)))
def test_a_hundred_thousand_messages_a_tier_in_any_blocks(preset: str, tier: str) -> None:
    assert_blocks_change_nothing(preset, tier, -(-EVENTS // len(preset_names())))
