"""The demo phrases of `render` and `play`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from livebass.cli.hands import Hands
from livebass.cli.options import Decorator, option
from livebass.cli.progress import have_kernels

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument
    from livebass.score.score import Score


def demo_option(begin: str) -> Decorator:
    """The option --demo; `begin`: the beginning of its help."""
    text = f"{begin} a nine-second demo phrase of the preset, or with `techniques` a phrase for each technique."
    return option("--demo", click.Choice(["preset", "techniques"]), text, is_flag=False, flag_value="preset")


def ready_for(demo: str | None, bass: Instrument) -> Instrument:
    """The bass; for "techniques", with the key switches that those phrases press."""
    if demo != "techniques":
        return bass
    from livebass.model.keymap import MODO

    return Hands({"keys": MODO}).play(bass)


def demo_for(bass: Instrument, rate: int, demo: str | None = None) -> Score:
    """The demo phrase in the style of the bass's player, or of all "techniques"."""
    from livebass.score.phrases import demo_score

    have_kernels()
    if demo == "techniques":
        return demo_score(rate, demo)
    return demo_score(rate, "slap" if bass.player.technique == "slap" else "finger")
