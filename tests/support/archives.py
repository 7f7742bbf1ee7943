"""An archive of tools/zips.py, of one bass."""

from __future__ import annotations

from livebass import load_preset
from livebass.plugin.bundle import instrument_files
from support.programs import load

PAGE = b"<!DOCTYPE html>"
zips = load("zips")


def archive(name: str, binaries: dict[str, bytes]) -> bytes:
    """The archive `name`; its plugins are `binaries`, by system."""
    basses = {"slap": load_preset("slap")}
    made = zips.archive(name, binaries, basses, instrument_files(basses), PAGE)
    assert isinstance(made, bytes)
    return made
