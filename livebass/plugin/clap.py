"""Writes a folder with the CLAP plugin and its instruments; hosts search the folders in their plugin directory.

To install it, copy the whole folder: on Linux into ~/.clap, on macOS into ~/Library/Audio/Plug-Ins/CLAP, on Windows
into %LOCALAPPDATA%\\Programs\\Common\\CLAP. The instruments lie beside the file livebass.clap; on macOS livebass.clap
is itself a bundle and holds them in Contents/Resources. Instruments in the user's directory come after them.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from livebass.model.instrument import Instrument
from livebass.plugin.bundle import RESOURCES, are_instruments, is_macos, macos_files, write_bundle_of
from livebass.plugin.systems import System

BINARY = "livebass.clap"
IDENTIFIER = "org.livebass.clap"


def bundle_files(
    basses: dict[str, Instrument], instruments: dict[str, bytes], code: bytes, system: System
) -> dict[str, bytes]:
    """Returns the folder's files, by path: `instruments` (from `instrument_files`) and the binary `code`."""
    if is_macos(system):
        return {f"{BINARY}/{name}": data for name, data in macos_files(IDENTIFIER, code, instruments).items()}
    return instruments | {BINARY: code}


def is_bundle(entries: list[Path]) -> bool:
    """True if these are the entries of a folder that this module wrote: they may be replaced."""
    if [entry.name for entry in entries] == [BINARY] and (resources := entries[0] / RESOURCES).is_dir():
        return are_instruments(list(resources.iterdir()))
    return BINARY in [entry.name for entry in entries] and are_instruments([e for e in entries if e.name != BINARY])


write_bundle = partial(write_bundle_of, bundle_files, is_bundle)
