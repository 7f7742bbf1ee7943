"""Exports plugins of every format. The command line reads the names here, and loads the rest when it exports."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebass.rows.bounds import one_of

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument
    from livebass.plugin.bundle import Qualities

BUNDLES = {"lv2": "livebass.lv2", "clap": "livebass-clap", "vst3": "livebass.vst3"}  # folders, by format


def export_plugin(
    kind: str,
    basses: Mapping[str, Instrument],
    folder: str | os.PathLike[str],
    system: str | None = None,
    qualities: Qualities | None = None,
) -> Path:
    """Writes a plugin that plays `basses` without Python.

    Args:
        kind: Its format: "lv2", "clap" or "vst3".
        basses: By short name; the first one is chosen in a new instance.
        folder: Where to write the plugin's own folder; an older one is replaced, or nothing is written.
        system: Such as "windows-x86_64"; None: this one.
        qualities: The quality in which a bass begins, "live" or "studio", by short name; None: live.

    Returns:
        The plugin's folder.

    Raises:
        ValueError: An unknown format or system, or unsuitable names or basses.
        OutputError: The folder cannot be written, or holds something else.
        BuildError: The plugin is not built yet, and there is no compiler.
    """
    from livebass.plugin.bundle import LIVE
    from livebass.plugin.systems import SYSTEMS, this_system

    one_of("format of a plugin", kind, tuple(BUNDLES))
    if system is not None:
        one_of("system", system, tuple(SYSTEMS))
    module: Any = import_module(f"livebass.plugin.{kind}")
    place = Path(folder) / BUNDLES[kind]
    module.write_bundle(dict(basses), place, SYSTEMS[system] if system else this_system(), qualities or LIVE)
    return place
