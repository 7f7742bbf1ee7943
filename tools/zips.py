"""Makes the zip archives for users without Python; tools/wheels.py calls it.

An archive holds the plugins in all formats with every preset and sound, the page, the licences and INSTALL.txt.
The same sources and tools give the same bytes: files are sorted and have one date.
"""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

from livebass import __version__
from livebass.model.instrument import Instrument
from livebass.model.keymap import COUNTING, named_keys
from livebass.plugin import clap, lv2, vst3
from livebass.plugin.bundle import is_macos
from livebass.plugin.export import BUNDLES
from livebass.plugin.systems import SYSTEMS, VST3_PRESETS, System, folder_of_plugins
from livebass.web.export import SINGLE

LICENSE = Path(__file__).parents[1] / "LICENSE"
FONT = LICENSE.parent / "livebass/plugin/c/picture/DEJAVU.txt"  # licence of the window's font
FORMATS: dict[str, ModuleType] = {"lv2": lv2, "clap": clap, "vst3": vst3}
PRESETS = "VST3 Presets"  # folder of the factory sounds for VST3 hosts
UNIVERSAL = "macos"  # one archive for both kinds of processor
UNTRIED = {  # what a user must know about a system on which nobody has tried the plugins
    "macos": "Then run, in Terminal: xattr -dr com.apple.quarantine ~/Library/Audio/Plug-Ins. "
    "These builds are not signed, and nobody has run them on a Mac yet.",
    "windows": "These builds have run under Wine only.",
}
LOWEST = 28  # key of the lowest note of most basses
DATE = (1980, 1, 1, 0, 0, 0)  # the earliest that an archive can have
FILE, PROGRAM, UNIX = 0o100644, 0o100755, 3
FAT, ALIGNMENT = 0xCAFEBABE, 14  # of a universal binary: its first word; 2^14 bytes, a page on arm64


def archives(requested: Mapping[str, bytes]) -> dict[str, dict[str, bytes]]:
    """Returns the archives that the binaries `requested` allow, by name, each with its binaries by system name.

    The macOS archive needs the binaries of all macOS systems.
    """
    macos = [name for name, system in SYSTEMS.items() if is_macos(system)]
    found = {name: {name: code} for name, code in requested.items() if name not in macos}
    if set(macos) <= set(requested):
        found[UNIVERSAL] = {name: requested[name] for name in macos}
    return found


def universal(slices: list[bytes]) -> bytes:
    """Joins Mach-O binaries for several kinds of processor into one file."""
    table, body = struct.pack(">II", FAT, len(slices)), b""
    start = 1 << ALIGNMENT
    for code in slices:
        kind, subtype = struct.unpack_from("<II", code, 4)
        body += b"\0" * (-len(body) % (1 << ALIGNMENT))
        table += struct.pack(">IIIII", kind, subtype, start + len(body), len(code), ALIGNMENT)
        body += code
    return table.ljust(start, b"\0") + body


def archive(
    name: str, binaries: Mapping[str, bytes], basses: dict[str, Instrument], instruments: dict[str, bytes], page: bytes
) -> bytes:
    """Returns the archive `name` of `basses`, with its binaries from `archives`.

    instruments: the basses' files, from `instrument_files`; page: the page with them, in one file.
    """
    system = SYSTEMS[next(iter(binaries))]
    code = universal(list(binaries.values())) if name == UNIVERSAL else binaries[name]
    files = {"INSTALL.txt": install_text(system).encode(), "LICENSE.txt": LICENSE.read_bytes(), SINGLE: page}
    files["LICENSE-DejaVu.txt"] = FONT.read_bytes()
    for kind, module in FORMATS.items():
        made = module.bundle_files(basses, instruments, code, system)
        files |= {f"{kind.upper()}/{BUNDLES[kind]}/{place}": data for place, data in made.items()}
    files |= {f"{PRESETS}/{place}": data for place, data in vst3.preset_files(basses).items()}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as to:
        for place, data in sorted(files.items()):
            entry = zipfile.ZipInfo(f"{title(name)}/{place}", DATE)
            entry.create_system, entry.compress_type = UNIX, zipfile.ZIP_DEFLATED
            entry.external_attr = (PROGRAM if data == code else FILE) << 16
            to.writestr(entry, data, compresslevel=9)
    return packed.getvalue()


def title(name: str) -> str:
    """Names an archive's file, without .zip, and the folder in it."""
    return f"livebass-{__version__}-{name}"


def install_text(system: System) -> str:
    """Returns three lines: where to copy the plugins, how to load them, how to play."""
    places = ", ".join(
        f"{kind.upper()}/{BUNDLES[kind]} into {folder_of_plugins(system, kind)}" for kind in ("vst3", "clap", "lv2")
    )
    untried = UNTRIED.get(system.name.partition("-")[0], "")
    return (
        f"Copy what your host plays, one or all: {places}.{f' {untried}' if untried else ''}"
        f" So that VST3 hosts list the sounds, copy the folders in {PRESETS} into "
        f"{folder_of_plugins(system, VST3_PRESETS)}.\n"
        "Load: let your host look for new plugins, and put livebass on an instrument track.\n"
        f"Play MIDI notes from {named_keys((LOWEST,))} up ({COUNTING}), or open {SINGLE} in a browser. "
        "To uninstall, delete the copies.\n"
    )
