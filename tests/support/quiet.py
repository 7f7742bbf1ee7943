"""Basses without the noise of fingers, hands and electronics, for tests of the strings alone."""

from __future__ import annotations

from dataclasses import replace

from livebass import Instrument, load_preset
from livebass.units import OFF

NOISES = ("skin_noise", "release_noise", "floor_noise")  # a slide may squeak: no other test hears it


def without_noise(bass: str | Instrument, **player: float) -> Instrument:
    """A preset, or a bass, whose player makes no noise; `player` sets further numbers."""
    made = load_preset(bass) if isinstance(bass, str) else bass
    return replace(made, player=replace(made.player, **{**dict.fromkeys(NOISES, OFF), **player}))  # type: ignore[arg-type]
