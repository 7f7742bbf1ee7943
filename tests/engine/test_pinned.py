"""The sound of the release, pinned: what every preset plays, hard, as one hash for each level of processor.

A change of the physics, of a preset or of the compiler changes them. If the change is meant, listen, and write the new
ones: `python tests/engine/test_pinned.py` prints them for the level in LIVEBASS_LEVEL, or for this processor's.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from livebass import QUALITIES, load_preset, preset_names, render_to_array, score_of
from livebass.compiling import emitter, store

RATE = 48_000
PINNED = json.loads((Path(__file__).parent / "pinned.json").read_text())
# By key switch; the last three stay on: a pick, the thumb with pops, and fingers again
TECHNIQUES = (
    "legato", "slide", "palm_mute", "ghost", "harmonic", "vibrato", "tap", "left_slap", "pick", "slap", "finger",
)  # fmt: skip
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


def hashes() -> dict[str, str]:
    return {preset: phrase_hash(preset) for preset in preset_names()}


@pytest.mark.skipif(store.level() not in PINNED, reason="no sound was pinned for this kind of processor")
@pytest.mark.parametrize("preset", preset_names())
def test_the_sound_is_the_pinned_one(preset: str) -> None:
    assert phrase_hash(preset) == PINNED[store.level()][preset]


@pytest.mark.slow
@pytest.mark.skipif(store.level() not in X86, reason="another kind of processor")
@pytest.mark.parametrize("level", X86[: X86.index(store.level())] if store.level() in X86 else [])
def test_so_is_that_of_lower_levels(level: str) -> None:
    done = subprocess.run(
        [sys.executable, __file__], capture_output=True, text=True, env=os.environ | {"LIVEBASS_LEVEL": level}
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == PINNED[level]


if __name__ == "__main__":
    print(json.dumps(hashes(), indent=2))
