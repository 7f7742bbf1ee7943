"""The basses of the tests: shipped presets as they once were.

Tests of the machine play these, so that a preset can be fitted again without a change in any of them. Tests that judge
presets load the shipped ones.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import livebass
from livebass import Instrument

FOLDER = Path(__file__).with_name("basses")


def load_preset(name: str | Path, **tuned: Any) -> Instrument:
    """The bass of the tests with this name, or else the preset; arguments as those of livebass.load_preset."""
    own = FOLDER / f"{name}.toml"
    return livebass.load_preset(own if own.exists() else name, **tuned)
