"""The factory sounds: basses with sliders and the values that play them, each for one style.

One file holds all of them. Here each becomes the text of a preset, for `-p` and for the plugins.
"""

from __future__ import annotations

import json
import tomllib
from functools import cache
from typing import Any

from livebass.preset.source import shipped_folder

FILE = "sounds/factory.toml"  # in the folder of the presets


def sound_names() -> list[str]:
    """Names of the factory sounds, in the order of their file."""
    return list(_sounds())


def sound_title(name: str) -> str:
    """The title of a factory sound, for people."""
    return str(_sounds()[name]["name"])


def sound_description(name: str) -> str:
    """One sentence about a factory sound."""
    return str(_sounds()[name]["description"])


def sound_text(name: str) -> str:
    """A factory sound as the text of a preset."""
    sound = _sounds()[name]
    lines = [f"{key} = {json.dumps(sound[key], ensure_ascii=False)}" for key in ("like", "name", "description")]
    for section in ("bench", "plugin"):
        if values := sound.get(section):
            lines += ["", f"[{section}]", *(f"{symbol} = {value}" for symbol, value in values.items())]
    return "\n".join([*lines, ""])


def sounds_of(bass: str) -> list[str]:
    """Names of the factory sounds that play the preset `bass`."""
    return [name for name, sound in _sounds().items() if sound["like"] == bass]


def sound_values(name: str) -> dict[str, float]:
    """The values of a factory sound's parameters, by symbol."""
    sound = _sounds()[name]
    return {**sound.get("bench", {}), **sound.get("plugin", {})}


@cache
def _sounds() -> dict[str, dict[str, Any]]:
    return tomllib.loads((shipped_folder() / FILE).read_text("utf-8"))
