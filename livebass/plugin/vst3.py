"""Writes a VST3 bundle, a folder livebass.vst3, with a system's binary, and the instruments in Contents/Resources.

To install it, copy the whole folder: on Linux into ~/.vst3, on macOS into ~/Library/Audio/Plug-Ins/VST3, on Windows
into %LOCALAPPDATA%\\Programs\\Common\\VST3. Instruments in the user's directory come after the bundle's.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from livebass.model.instrument import Instrument
from livebass.plugin.bundle import RESOURCES, are_instruments, is_macos, macos_files, write_bundle_of, write_files
from livebass.plugin.state import state_of
from livebass.plugin.systems import System
from livebass.preset.sounds import sound_title, sound_values, sounds_of

IDENTIFIER = "org.livebass.vst3"
# Ids of the plugins, by name, as in c/shells/vst3.c: hosts look for a plugin's presets in a folder of that name
CLASSES = {
    "livebass": "6C697665626173739D3F0C5100000001",
    "livebass strings": "6C697665626173739D3F0C5100000002",
}
PRESET = ".vstpreset"
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


def preset_files(basses: Iterable[str]) -> dict[str, bytes]:
    """Returns the factory sounds of `basses`, by short name, as VST3 presets: files by path."""
    sounds = {sound_title(name): state_of(bass, sound_values(name)) for bass in basses for name in sounds_of(bass)}
    return {
        f"{plugin}/{title}{PRESET}": preset_file(plugin, state) for plugin in CLASSES for title, state in sounds.items()
    }


def preset_file(plugin: str, state: bytes) -> bytes:
    """Returns a preset of a plugin of CLASSES: its id, its state, and a list that says where the state is."""
    head = struct.Struct("<4si32sq")
    before = head.pack(b"VST3", 1, CLASSES[plugin].encode(), head.size + len(state))
    return before + state + struct.pack("<4si4sqq", b"List", 1, b"Comp", head.size, len(state))


def write_presets(basses: Iterable[str], folder: Path) -> None:
    """Writes the factory sounds of `basses` into `folder`, a folder for each plugin. Raises OutputError.

    They replace livebass's older presets, and nothing else.
    """
    made = preset_files(basses)
    for plugin in CLASSES:
        files = {name.partition("/")[2]: data for name, data in made.items() if name.startswith(f"{plugin}/")}
        write_files(folder / plugin, files, lambda entries: all(entry.suffix == PRESET for entry in entries))
