"""The release's sound, pinned: every preset, played hard, as one hash per processor level.

A change of the physics, a preset or the compiler changes the hashes. If the change is meant, listen, then write the new
ones: `python tests/unit/engine/test_pinned.py` prints them for the level in LIVEBASS_LEVEL, or for this processor's.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import module_paths, python_output
from support.costs import quick
from support.own_basses import load_preset

from livebass import QUALITIES, preset_names, render_to_array, score_of
from livebass.compiling import emitter, store
from livebass.model.instrument import Instrument
from livebass.model.keymap import MODO_12
from livebass.rows.techniques import LEARNED, PARAMETERS
from livebass.score.score import Score

RATE = 48_000
PINNED = json.loads((Path(__file__).parent / "pinned.json").read_text())
# By key switch; the last three stay on: a pick, the thumb with pops, and fingers again
TECHNIQUES = (
    "legato", "slide", "palm_mute", "ghost", "harmonic", "vibrato", "tap", "left_slap", "pick", "slap", "finger",
)  # fmt: skip
# Fields of the player for a performance of all techniques, by preset: fingers, a nail, a thumb with a mass, and a
# board. Their unevenness stays.
PERFORMERS = {
    "jazz-finger": {"answering": "pedal", "ghost_below": 24},
    "precision-finger": {"stroke": "nail", "wheel": "slide", "velocity_curve": "soft"},
    "slap": {"ghost_below": 24, "answering": "always"},
    "fretless": {"wheel": "slide", "out_of_range": "drop"},
}
BAR = 0.07  # s
BACK = {1: 0, 5: 0, 7: 100, 9: 0, 11: 127, 64: 0, 65: 0, 68: 0, LEARNED: 120}  # values to return to; others: 64
Messages = list[tuple[float, int, int, int]]  # s, status, first, second
X86 = [level for level in emitter.LEVELS if level.startswith("x86")]


def phrase_hash(preset: str) -> str:
    """SHA-256 of three seconds of `preset`: hard notes on all strings, then each technique of TECHNIQUES."""
    bass = load_preset(preset)
    keys = [string.open_note for string in bass.strings]
    notes = [(0.06 * k, 0.25, keys[k % len(keys)] + 5 * (k // len(keys)) % 12, 127 - 5 * k) for k in range(16)]
    switches = {name: key for key, name, value in bass.player.keys.keys if value == 0}
    for k, technique in enumerate(TECHNIQUES):
        start, key = 1.3 + 0.14 * k, keys[k % len(keys)] + 3 + k % 5
        notes += [(start, 0.13, switches[technique], 100)]
        notes += [
            (start + 0.01, 0.11, key, 110),
            (start + 0.04, 0.04, key + 2, 100),
        ]  # on and off while the other is held
    sound = render_to_array(bass, score_of(notes, RATE), QUALITIES["live"], tail=0.3)
    return hashlib.sha256(sound.tobytes()).hexdigest()[:16]


def bar_of(k: int, channels: tuple[int, int] = (0, 0)) -> Messages:
    """Bar `k`: a note, a second a whole tone above while it is held, and back; softer and harder from bar to bar."""
    key, velocity, (one, other) = 34 + 5 * k % 23, 20 + 37 * k % 108, channels
    notes: Messages = [
        (0.1, 0x90 | one, key, velocity), (0.4, 0x90 | other, key + 2, 127 - velocity // 2),
        (0.7, 0x80 | other, key + 2, velocity), (0.9, 0x80 | one, key, 127 - velocity),
    ]  # fmt: skip
    return [(BAR * (k + part), *message) for part, *message in notes]  # type: ignore[misc]


def everything() -> Messages:
    """A performance with each switch, controller, parameter and channel mode in turn, a bar or two each."""
    played: Messages = []
    k = 0

    def bar(*messages: tuple[float, int, int, int], channels: tuple[int, int] = (0, 0)) -> None:
        """Plays the next bar, with messages at fractions of it."""
        nonlocal k
        played.extend(bar_of(k, channels))
        played.extend((BAR * (k + part), *message) for part, *message in messages)  # type: ignore[misc]
        k += 1

    for key, name, fret in MODO_12.keys:
        if name != "hand" or fret % 6 == 1:
            bar((0.0, 0x90, key, 100), (0.98, 0x80, key, 0))
            if name in ("pick", "slap"):
                bar((0.5, 0xD0, 90, 0))
    bar((0.0, 0x90, 19, 100), (0.0, 0x90, 27, 100), (0.5, 0x90, 17, 100), (0.9, 0x80, 17, 0), (0.95, 0x80, 19, 0))
    for stroke in (13, 15):  # pick strokes, down and up; then fingers
        bar((0.0, 0x90, stroke, 1), (0.5, 0x80, stroke, 1))
    bar((0.0, 0x90, 25, 100), (0.0, 0xB0, 126, 1))  # one voice
    bar((0.2, 0xE0, 0, 30), (0.5, 0xE0, 127, 127), (0.95, 0xB0, 127, 0))
    bar((0.0, 0xB0, 101, 0), (0.0, 0xB0, 100, 0), (0.0, 0xB0, 6, 7), (0.05, 0xB0, 38, 50), (0.5, 0xE0, 0, 90))
    controllers = [number for number, _ in MODO_12.controllers] + [LEARNED + n for n in range(PARAMETERS)]
    for number in (*controllers, 16):
        bar((0.0, 0xB0, number, 25), (0.02, 0xB0, number, 0), (0.3, 0xB0, number, 110))
        bar((0.5, 0xB0, number, BACK.get(number, 64)), (0.6, 0x90, 36, 0))
    bar((0.0, 0xE0, 0, 64), (0.3, 0xB0, 126, 4), channels=(0, 1))  # one string per channel
    for one, other in ((1, 1), (3, 2), (0, 5)):
        bend = (0.2, 0xE0 | one, 0, 80), (0.6, 0xE0 | other, 0, 40)
        bar(*bend, (0.3, 0xD0 | one, 80, 0), (0.0, 0xB0 | one, 74, 110), channels=(one, other))
    bar((0.0, 0xB0, 101, 0), (0.0, 0xB0, 100, 6), (0.0, 0xB0, 6, 5), channels=(1, 2))  # MPE
    for one, other in ((1, 1), (3, 2), (4, 1)):
        bend = (0.2, 0xE0 | one, 0, 68), (0.6, 0xE0 | other, 0, 60)
        bar(*bend, (0.3, 0xD0 | one, 80, 0), (0.0, 0xB0 | one, 74, 20), channels=(one, other))
    bar((0.0, 0xB0, 64, 127), (0.0, 0xB0, 9, 70), (0.0, 0x90, 18, 9), (0.5, 0xB0, 121, 0))
    bar((0.0, 0xB0, 9, 40), (0.0, 0xB0, 68, 100), (0.5, 0xB0, 123, 0), (0.99, 0xB0, 64, 127))
    bar((0.1, 0x90, 74, 60), (0.2, 0x90, 103, 100), (0.6, 0x80, 74, 60))
    bar((0.0, 0xB0, 1, 60), (0.0, 0xB0, 104, 90), (0.0, 0xC0, 1, 0))  # another bass, with these controllers
    bar((0.0, 0x90, 19, 100), (0.3, 0xB0, 64, 0), (0.5, 0x80, 19, 100))
    bar((0.3, 0xC0, 0, 0), (0.6, 0xB0, 120, 0))
    bar()
    return played


def performed_hash(preset: str) -> str:
    """SHA-256 of `everything` played on `preset` by PERFORMERS."""
    bass = load_preset(preset)
    bass = replace(bass, player=replace(bass.player, keys=MODO_12, **PERFORMERS[preset]))  # type: ignore[arg-type]
    played = sorted(everything(), key=lambda message: message[0])
    frames = np.array([round(time * RATE) for time, *_ in played])
    messages = np.array([message for _, *message in played], np.uint8)
    score = Score(frames, messages, int(frames[-1]), 0, "everything", RATE)
    basses: dict[int, Instrument] = {0: bass, 1: load_preset("slap-impulse" if preset != "slap-impulse" else "muted")}
    sound = render_to_array(bass, score, QUALITIES["live"], tail=0.1, seed=7, basses=basses)
    assert np.isfinite(sound).all() and np.abs(sound).max() > 0.1
    return hashlib.sha256(sound.tobytes()).hexdigest()[:16]


def hashes() -> dict[str, str]:
    pinned = {preset: phrase_hash(preset) for preset in preset_names()}
    return pinned | {f"everything on {preset}": performed_hash(preset) for preset in PERFORMERS}


@pytest.mark.skipif(store.level() not in PINNED, reason="no sound was pinned for this kind of processor")
@pytest.mark.parametrize("preset", preset_names())
def test_the_sound_is_the_pinned_one(preset: str) -> None:
    assert phrase_hash(preset) == PINNED[store.level()][preset]


@pytest.mark.skipif(store.level() not in PINNED, reason="no sound was pinned for this kind of processor")
@pytest.mark.parametrize("preset", quick(PERFORMERS, ["slap", "fretless"]))
def test_so_is_that_of_all_that_hands_can_do(preset: str) -> None:
    assert performed_hash(preset) == PINNED[store.level()][f"everything on {preset}"]


@pytest.mark.slow
@pytest.mark.skipif(store.level() not in X86, reason="another kind of processor")
@pytest.mark.parametrize("level", X86[: X86.index(store.level())] if store.level() in X86 else [])
def test_so_is_that_of_lower_levels(level: str) -> None:
    printed = python_output(__file__, env={"LIVEBASS_LEVEL": level} | module_paths(), timeout=None)
    assert json.loads(printed) == PINNED[level]


if __name__ == "__main__":
    print(json.dumps(hashes(), indent=2))
