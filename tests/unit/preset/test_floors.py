"""The noise floors of shipped presets, as those of recorded basses: level, and as far under a soft note."""

from __future__ import annotations

import numpy as np
import pytest

from livebass import QUALITIES, load_preset, preset_names, score_of
from livebass.engine.engine import Engine
from livebass.lab.comparison import measure
from livebass.lab.comparison.measures import FLOOR_KEYS
from livebass.lab.comparison.notes import RATE, VELOCITIES
from livebass.model.instrument import note_frequency
from livebass.rows.units import OFF

# The hardest first: strings that buzz, that ring longest in the treble, and a board with sensors
HARDEST = ("slap", "jazz-bright", "upright")
NAMES = sorted((n for n in preset_names() if not n.startswith("paper")), key=lambda n: (n not in HARDEST, n))
KEYS = (30, 36, 45)
SECONDS = 1.6


@pytest.mark.parametrize("name", NAMES)
def test_the_floor_is_level_and_as_far_under_a_soft_note_as_of_real_basses(name: str) -> None:
    """From 0.5 to 16 kHz, between partials, median over a few notes; below 0.5 kHz pickups' preamplifiers flicker."""
    bass = load_preset(name)
    engine = Engine(bass, QUALITIES["live"], RATE)
    found = []
    for key in KEYS:
        score = score_of([(0.0, SECONDS + 0.1, key, VELOCITIES[0])], RATE)
        sound = np.concatenate(list(engine.another(1).play(score, 0.0)), axis=1).sum(axis=0)
        figures = measure(sound, RATE, note_frequency(key), only=FLOOR_KEYS)
        found.append([figures[band] for band in FLOOR_KEYS])
    low, *level = np.median(found, axis=0)
    assert max(level) - min(level) < 6.0 and min(level) >= -82.0 and max(level) <= -70.0, level
    if bass.output.kind == "pickups":
        assert 4.0 < low - level[-1] < 11.0, (low, level)


def test_the_papers_basses_have_no_floor() -> None:
    for name in set(preset_names()) - set(NAMES):
        assert load_preset(name).player.floor_noise == OFF
