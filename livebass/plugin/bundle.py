"""Writes the folders that hosts load: each replaces livebass's older one completely, or nothing is written."""

from __future__ import annotations

import plistlib
from collections.abc import Callable, Mapping
from pathlib import Path

import platformdirs

from livebass import __version__
from livebass.files.whole import Transaction, whole_directory
from livebass.model.instrument import Instrument
from livebass.plugin.build import binary
from livebass.plugin.instrument import ENDING, OLD_ENDING, instrument_file
from livebass.plugin.systems import System, this_system
from livebass.preset.sounds import sound_text, sound_title, sounds_of
from livebass.rows.bounds import refusal, within
from livebass.rows.techniques import MAX_BASSES

LONGEST_NAME = 63  # bytes in an instrument's short name, as in c/instance/core.c
LIST = "instruments.txt"
SOUNDS = "sounds"  # folder of the factory sounds, beside the instruments
STUDIO = "studio"  # follows a name in the list
Qualities = Mapping[str, str]  # initial quality in the plugins, by a bass's short name
LIVE: Qualities = {}  # every bass begins in live
RESOURCES = "Contents/Resources"  # instruments in macOS and VST3 bundles


def instrument_files(basses: dict[str, Instrument], qualities: Qualities = LIVE) -> dict[str, bytes]:
    """Returns instrument files and their list, by file name, for `basses`, by short name.

    The factory sounds of these basses are in a folder of their own.

    The list gives a bass's initial quality after its name, unless it is `live`. Raises ValueError for unsuitable names
    or basses.
    """
    within("number of instruments", len(basses), 1, MAX_BASSES)
    for name in basses:
        checked_name(name)
    files = {f"{name}{ENDING}": instrument_file(bass) for name, bass in basses.items()}
    files |= {f"{SOUNDS}/{sound_title(s)}.toml": sound_text(s).encode() for name in basses for s in sounds_of(name)}
    lines = [f"{name} {STUDIO}\n" if qualities.get(name) == STUDIO else f"{name}\n" for name in basses]
    return files | {LIST: "".join(lines).encode()}


def checked_name(name: str) -> str:
    """Returns an instrument's short name. Raises ValueError if it is unsuitable."""
    fits = name.isprintable() and not set(name) & set('/\\"<>{}|^` ') and 1 <= len(name.encode()) <= LONGEST_NAME
    if not fits:
        raise refusal("name of an instrument", f"1 to {LONGEST_NAME} letters, digits, - and _", repr(name))
    return name


def write_files(folder: Path, files: dict[str, bytes], replaceable: Callable[[list[Path]], bool]) -> None:
    """Writes `files`, by their paths in `folder`, all or none. Raises OutputError.

    Anything already in the folder must be `replaceable`: see `checked_directory`.
    """
    with whole_directory(folder, replaceable) as temporary, Transaction() as written:
        for name, data in files.items():
            (temporary / name).parent.mkdir(parents=True, exist_ok=True)
            written.write(temporary / name, data)


def write_bundle_of(
    bundle_files: Callable[[dict[str, Instrument], dict[str, bytes], bytes, System], dict[str, bytes]],
    is_bundle: Callable[[list[Path]], bool],
    basses: dict[str, Instrument],
    folder: Path,
    system: System | None = None,
    qualities: Qualities = LIVE,
) -> None:
    """Writes a bundle of `basses`, by short name; it replaces an older bundle completely, or nothing is written.

    bundle_files, is_bundle: functions of a format that list a bundle's files and recognise an older bundle. `system`:
    the target system, None: this one; `qualities`: the initial qualities. Raises ValueError for unsuitable names or
    basses, OutputError, BuildError.
    """
    system = system or this_system()
    write_files(folder, bundle_files(basses, instrument_files(basses, qualities), binary(system), system), is_bundle)


def own_instruments() -> Path:
    """Returns the directory of the user's own instrument files, which every installed plugin searches."""
    return Path(platformdirs.user_data_path("livebass", appauthor=False, roaming=True))


def distinct_titles(basses: dict[str, Instrument]) -> list[str]:
    """Returns these basses' titles for lists; a repeated title gets the short name in brackets.

    The plugins do the same for every bass they find: `open_shelf` of c/instance/core.c.
    """
    titles = [bass.name for bass in basses.values()]
    return [
        with_name(title, name) if title in titles[:k] else title
        for k, (name, title) in enumerate(zip(basses, titles, strict=True))
    ]


def with_name(title: str, name: str) -> str:
    """Returns a bass's title, which may not be unique, with its short name."""
    return f"{title} ({name})"


def are_instruments(entries: list[Path]) -> bool:
    """True if these are an instrument list and files that belong beside it, and nothing else."""
    names = [entry.name for entry in entries]
    return LIST in names and all(name in (LIST, SOUNDS) or name.endswith((ENDING, OLD_ENDING)) for name in names)


def is_macos(system: System) -> bool:
    return system.name.startswith("macos")


def macos_files(identifier: str, binary: bytes, resources: dict[str, bytes]) -> dict[str, bytes]:
    """Returns the files of a macOS bundle, by their paths in it."""
    info = {
        "CFBundleIdentifier": identifier, "CFBundleName": "livebass", "CFBundleExecutable": "livebass",
        "CFBundlePackageType": "BNDL", "CFBundleVersion": __version__, "CFBundleShortVersionString": __version__,
        "CFBundleInfoDictionaryVersion": "6.0", "LSMinimumSystemVersion": "11.0",
    }  # fmt: skip
    made = {"Contents/MacOS/livebass": binary, "Contents/Info.plist": plistlib.dumps(info)}
    return made | {f"{RESOURCES}/{name}": data for name, data in resources.items()}
