"""Writes what hosts load, a folder: it appears whole, over an older one of livebass, or not at all."""

from __future__ import annotations

import plistlib
from collections.abc import Callable, Mapping
from pathlib import Path

import platformdirs

from livebass import __version__
from livebass.bounds import refusal, within
from livebass.files import Transaction, whole_directory
from livebass.model.instrument import Instrument
from livebass.plugin.build import binary
from livebass.plugin.instrument import BENCH_ENDING, ENDING, bench_file, instrument_file
from livebass.plugin.systems import System, this_system
from livebass.techniques import MOST_BASSES

LONGEST_NAME = 63  # bytes of an instrument's short name, of c/core.c
LIST = "instruments.txt"
STUDIO = "studio"  # in the list, behind a name
Qualities = Mapping[str, str]  # in which the plugins begin, by short name of a bass
LIVE: Qualities = {}  # all in that
RESOURCES = "Contents/Resources"  # of bundles of macOS and of VST3: the instruments


def instrument_files(basses: dict[str, Instrument], qualities: Qualities = LIVE) -> dict[str, bytes]:
    """The instrument files of `basses`, by short name, their bench files and the list of them, by the files' names.

    The list says behind a name in which quality the plugins begin with that bass, if that is not `live`. Raises
    ValueError for names or basses that do not fit.
    """
    within("number of instruments", len(basses), 1, MOST_BASSES)
    for name in basses:
        checked_name(name)
    files = {f"{name}{ENDING}": instrument_file(bass) for name, bass in basses.items()}
    files |= {f"{name}{BENCH_ENDING}": bench_file(bass, files[f"{name}{ENDING}"]) for name, bass in basses.items()}
    lines = [f"{name} {STUDIO}\n" if qualities.get(name) == STUDIO else f"{name}\n" for name in basses]
    return files | {LIST: "".join(lines).encode()}


def checked_name(name: str) -> str:
    """Returns the short name of an instrument. Raises ValueError for one that does not fit."""
    fits = name.isprintable() and not set(name) & set('/\\"<>{}|^` ') and 1 <= len(name.encode()) <= LONGEST_NAME
    if not fits:
        raise refusal("name of an instrument", f"1 to {LONGEST_NAME} letters, digits, - and _", repr(name))
    return name


def write_files(folder: Path, files: dict[str, bytes], replaceable: Callable[[list[Path]], bool]) -> None:
    """Writes `files`, by their places in `folder`, all or none. Raises OutputError.

    What is in the folder must be `replaceable`: see `checked_directory`.
    """
    with whole_directory(folder, replaceable) as temporary, Transaction() as written:
        for name, data in files.items():
            (temporary / name).parent.mkdir(parents=True, exist_ok=True)
            written.write(temporary / name, data)


class BundleWriter:
    """Writes the bundles of a format, by what files are in one, and by which entries of a folder are one."""

    def __init__(
        self,
        bundle_files: Callable[[dict[str, Instrument], dict[str, bytes], bytes, System], dict[str, bytes]],
        is_bundle: Callable[[list[Path]], bool],
    ) -> None:
        self._files, self._replaceable = bundle_files, is_bundle

    def __call__(
        self, basses: dict[str, Instrument], folder: Path, system: System | None = None, qualities: Qualities = LIVE
    ) -> None:
        """Writes a bundle of `basses`, by short name; the folder appears complete, over an older bundle, or not at all.

        `system`: the one that it is for, None: this one; `qualities`: those to begin in. Raises ValueError for names or
        basses that do not fit, OutputError, BuildError.
        """
        system = system or this_system()
        files = self._files(basses, instrument_files(basses, qualities), binary(system), system)
        write_files(folder, files, self._replaceable)


def own_instruments() -> Path:
    """The directory of the user's own instrument files, in which every installed plugin looks."""
    return Path(platformdirs.user_data_path("livebass", appauthor=False, roaming=True))


def distinct_titles(basses: dict[str, Instrument]) -> list[str]:
    """Returns what lists call these basses: a title that an earlier one has, with the short name in brackets behind.

    The plugins do the same with all that they find: `open_shelf` of c/core.c.
    """
    titles = [bass.name for bass in basses.values()]
    return [
        with_name(title, name) if title in titles[:k] else title
        for k, (name, title) in enumerate(zip(basses, titles, strict=True))
    ]


def with_name(title: str, name: str) -> str:
    """The title of a bass, which others may have too, with its short name."""
    return f"{title} ({name})"


def are_instruments(entries: list[Path]) -> bool:
    """True if these are a list of instruments and what may lie beside it, and nothing else."""
    names = [entry.name for entry in entries]
    return LIST in names and all(name == LIST or name.endswith((ENDING, BENCH_ENDING)) for name in names)


def is_macos(system: System) -> bool:
    return system.name.startswith("macos")


def macos_files(identifier: str, binary: bytes, resources: dict[str, bytes]) -> dict[str, bytes]:
    """The files of a bundle of macOS, by their places in it."""
    info = {
        "CFBundleIdentifier": identifier, "CFBundleName": "livebass", "CFBundleExecutable": "livebass",
        "CFBundlePackageType": "BNDL", "CFBundleVersion": __version__, "CFBundleShortVersionString": __version__,
        "CFBundleInfoDictionaryVersion": "6.0", "LSMinimumSystemVersion": "11.0",
    }  # fmt: skip
    made = {"Contents/MacOS/livebass": binary, "Contents/Info.plist": plistlib.dumps(info)}
    return made | {f"{RESOURCES}/{name}": data for name, data in resources.items()}
