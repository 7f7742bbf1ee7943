"""The basses of the tests: shipped presets as they once were.

Tests of the machine play these, so that a preset can be fitted again without a change in any of them. Tests that judge
presets load the shipped ones; so do tests of what every player hears, by names with AS_SHIPPED.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import livebass
from livebass import Instrument

FOLDER = Path(__file__).with_name("basses")
AS_SHIPPED = " as shipped"  # after the name of a preset: not the bass of the tests
# Basses that people play, with turned axes, the hardest first: over a board with sensors, struck by a thumb, picked
FRETTED = tuple(name + AS_SHIPPED for name in ("slap", "precision-pick", "jazz-finger"))
PLAYED = ("upright" + AS_SHIPPED, *FRETTED[:2])


def load_preset(name: str | Path, **tuned: Any) -> Instrument:
    """The bass of the tests with this name, or else the preset; arguments as those of livebass.load_preset."""
    if isinstance(name, str) and name.endswith(AS_SHIPPED):
        return livebass.load_preset(name.removesuffix(AS_SHIPPED), **tuned)
    own = FOLDER / f"{name}.toml"
    if not own.exists():
        return livebass.load_preset(name, **tuned)
    return livebass.load_preset(own, **tuned) if tuned else _made(own)


@cache
def _made(file: Path) -> Instrument:
    """The bass of a file, checked and made once."""
    return livebass.load_preset(file)
