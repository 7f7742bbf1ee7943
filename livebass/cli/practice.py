"""The basses of a page, and the tablature that it practises."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from livebass.cli.hands import Loader
from livebass.cli.messages import say
from livebass.cli.options import PATH, option
from livebass.cli.shelf import basses_of, names_of
from livebass.cli.tabs import TabOptions, tab_options
from livebass.cli.tuning import given_tuning

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument
    from livebass.web.bench import Source


def page_tab_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Adds the options for a tablature on a page."""
    path = option(
        "--tab", PATH, "Practise this tablature on the page. The first -p plays it, else a bass for its track."
    )
    return path(tab_options(command))


def page_basses(
    presets: tuple[str, ...], more: tuple[str, ...], options: dict[str, Any]
) -> tuple[dict[str, Instrument], dict[str, Source], dict[str, Any]]:
    """The basses of a page by name, the preset and tuning of each, and the data of the tablature.

    Takes the tuning and the tablature out of `options`.
    """
    from livebass.web.bench import Source

    path, tab = options.pop("tab"), TabOptions.from_options(options, options)
    given = given_tuning(options)
    load = Loader(options)
    if path is None:
        tab.check_unused(None)
        basses = basses_of(presets, more, load)
        return basses, {name: Source(preset, given) for name, preset in names_of(presets, more).items()}, {}
    from livebass.cli.song import AUTO, Song
    from livebass.web.tab import tab_data

    song = Song(path, AUTO, presets[0] if presets else None, tab, load).arrangement()
    say(f"{path}: {song.remark}")
    named = names_of(presets or (song.preset,), more)
    first = next(iter(named))
    basses = {name: song.bass if name == first else load(preset) for name, preset in named.items()}
    own = {"tuning": song.given["tuning"]} | ({"capo": int(song.given["capo"])} if "capo" in song.given else {}) | given
    sources = {name: Source(preset, own if name == first else given) for name, preset in named.items()}
    return basses, sources, {"tab": tab_data(song, path.name, first)}
