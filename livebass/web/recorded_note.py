"""A recorded note of a real bass, which the page plays beside the same note of a preset."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

FOLDER = "recorded"
RECORDED = ("LICENSE.txt", "note.flac")  # in the folder, of the package and of a page
PRESET = "jazz-finger"  # pages with this bass have the recording
NOTE: dict[str, Any] = {
    "bass": PRESET,
    "string": 1,
    "note": 36,
    "velocity": 110,
    "says": "C2, hard. Recorded: a Squier Jazz Bass, by Karoryfer Lecolds, public domain (CC0). "
    f"Computed: the preset {PRESET}, a bass of the same kind; it is not fitted to this one. Both are equally loud.",
}


def recorded_files() -> dict[str, bytes]:
    """Returns the recording and its licence, by path in a page's folder."""
    own = files("livebass.web").joinpath(FOLDER)
    return {f"{FOLDER}/{name}": own.joinpath(name).read_bytes() for name in RECORDED}


def is_recorded(folder: Path) -> bool:
    """True if this is a page's folder with the recording and nothing else."""
    return folder.is_dir() and {entry.name for entry in folder.iterdir()} == set(RECORDED)
