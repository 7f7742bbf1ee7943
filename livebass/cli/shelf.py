"""The basses in a plugin or on a page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from livebass.cli.messages import say
from livebass.cli.options import DEFAULT_PRESET
from livebass.cli.progress import have_kernels, shown_progress

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument


def basses_of(
    presets: tuple[str, ...], more: tuple[str, ...], load: Callable[[str], Instrument]
) -> dict[str, Instrument]:
    """The basses of `presets` and `more`, loaded by `load`, by name; without any, all of them, the default first.

    `more` are names after the last -p, which is required.
    """
    return {name: load(preset) for name, preset in names_of(presets, more).items()}


def names_of(presets: tuple[str, ...], more: tuple[str, ...]) -> dict[str, str]:
    """The presets that `basses_of` loads, by the names of their basses."""
    if more and not presets:
        raise click.UsageError(f"{more[0]}: name presets with -p")
    from livebass.plugin.bundle import checked_name
    from livebass.preset.load import preset_names

    found: dict[str, str] = {}
    for preset in [*presets, *more] or sorted(preset_names(), key=lambda name: name != DEFAULT_PRESET):
        name = checked_name(Path(preset).stem)
        if name in found:
            raise click.UsageError(f"-p {preset}: there are two basses called {name}")
        found[name] = preset
    return found


def page_ready(report: Callable[[float], None] = lambda done: None) -> None:
    """Compiles what a page needs, if missing, with messages; `report` gets the fraction done, from another thread."""
    from livebass.web import build

    have_kernels(lambda done: report(done / 2))
    if not build.is_cached():
        say(f"compiling the kernels for browsers, once (about {build.BUILD_TIME} s) ...")
        with shown_progress("compiling for browsers") as show:

            def progress(done: float) -> None:
                report((1 + done) / 2)
                if show:
                    show(done)

            build.module(progress)
