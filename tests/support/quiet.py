"""Basses without the noise of fingers, hands and electronics, for tests of the strings alone."""

from __future__ import annotations

from dataclasses import replace

from livebass import QUALITIES, Instrument
from livebass.engine.engine import Engine
from livebass.rows.parts import SILENT
from support.own_basses import load_preset

QUIET = {name: value for name, value in SILENT.items() if name != "squeak"}  # no other test hears a slide squeak
ALONE = " without answers"  # after the name of a preset: its idle strings do not ring along
ENGINES: dict[str, Engine] = {}  # of basses without noise, by name


def engine(preset: str = "jazz-finger") -> Engine:
    """A new player of the preset without noise, at `live` and 48 kHz; operators are shared."""
    if preset not in ENGINES:
        ENGINES[preset] = Engine(without_noise(preset), QUALITIES["live"], 48000)
    return ENGINES[preset].another()


def without_noise(bass: str | Instrument, **player: float) -> Instrument:
    """A preset, or a bass, whose player makes no noise; `player` sets further numbers."""
    made = load_preset(bass.removesuffix(ALONE)) if isinstance(bass, str) else bass
    if isinstance(bass, str) and bass.endswith(ALONE):
        made = replace(made, player=replace(made.player, answering="off"))
    return replace(made, player=replace(made.player, **{**QUIET, **player}))  # type: ignore[arg-type]
