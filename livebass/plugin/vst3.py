"""Writes a VST3 bundle, a folder livebass.vst3, with a system's binary, and the instruments in Contents/Resources.

To install it, copy the whole folder: on Linux into ~/.vst3, on macOS into ~/Library/Audio/Plug-Ins/VST3, on Windows
into %LOCALAPPDATA%\\Programs\\Common\\VST3. Instruments in the user's directory come after the bundle's.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from livebass.model.instrument import Instrument
from livebass.plugin.bundle import RESOURCES, are_instruments, is_macos, macos_files, write_bundle_of
from livebass.plugin.systems import System

IDENTIFIER = "org.livebass.vst3"
BINARIES = {  # path within the bundle, by system name; macOS has its own kind of bundle
    "linux-x86_64": "Contents/x86_64-linux/livebass.so",
    "linux-aarch64": "Contents/aarch64-linux/livebass.so",
    "windows-x86_64": "Contents/x86_64-win/livebass.vst3",
}


def bundle_files(
    basses: dict[str, Instrument], instruments: dict[str, bytes], code: bytes, system: System
) -> dict[str, bytes]:
    """Returns the files of a bundle, as `clap.bundle_files` does."""
    if is_macos(system):
        return macos_files(IDENTIFIER, code, instruments) | {"Contents/PkgInfo": b"BNDL????"}
    return {f"{RESOURCES}/{name}": data for name, data in instruments.items()} | {BINARIES[system.name]: code}


def is_bundle(entries: list[Path]) -> bool:
    """True if these are the entries of a bundle that this module wrote: they may be replaced."""
    resources = entries[0].parent / RESOURCES
    if [entry.name for entry in entries] != ["Contents"] or not resources.is_dir():
        return False
    return are_instruments(list(resources.iterdir()))


write_bundle = partial(write_bundle_of, bundle_files, is_bundle)
