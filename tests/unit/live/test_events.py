"""Random events in every quality, with helper threads.

All presets together get LIVEBASS_EVENTS events in each quality; 100 000 before a release.
"""

from __future__ import annotations

import os

import pytest
from support.events import bear

from livebass import QUALITIES, preset_names

EVENTS = int(os.environ.get("LIVEBASS_EVENTS", "2000"))


@pytest.mark.parametrize("preset", ["slap", "fretless"])
def test_random_events(preset: str) -> None:
    bear(preset, "live", 200, 1)


@pytest.mark.slow
@pytest.mark.parametrize("tier", QUALITIES)
@pytest.mark.parametrize("preset", preset_names())
def test_random_events_in_all_presets(preset: str, tier: str) -> None:
    print(bear(preset, tier, -(-EVENTS // len(preset_names())), 2).text(), flush=True)
