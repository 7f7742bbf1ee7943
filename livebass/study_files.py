"""What came out of a study as files of a directory: all of them or none."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from livebass import __version__
from livebass.atomic import Transaction
from livebass.audiofile import AudioWriter, encoding
from livebass.study_draw import rendered
from livebass.study_parts import Findings, Sound, Study, Table

SUMMARY, DATA = "summary.json", "result.npz"
FORMAT = 1  # of the summary
PEAK = 10 ** (-1 / 20)  # of a sound, -1 dBFS


def write(directory: Path, study: Study, found: Findings, about: dict[str, Any]) -> dict[str, Any]:
    """The files of `study` into `directory`, made if need be; their summary, which is one of them.

    `about` goes into the summary as it is. Raises OutputError; the directory is then as it was.
    """
    with Transaction() as files:
        files.directory(directory)
        summary = {
            "format": FORMAT, "version": __version__, "name": study.name, "title": study.title,
            "section": study.section, "gives": study.gives, **about,
            "figures": [_picture(files, directory, p.name, p.caption, p.figure) for p in found.pictures],
            "sounds": [_sound(files, directory, sound) for sound in found.sounds],
            "tables": [_table(files, directory, table) for table in found.tables],
            "numbers": plain(found.numbers), "data": DATA if found.arrays else None,
        }  # fmt: skip
        if found.arrays:
            arrays = io.BytesIO()
            np.savez_compressed(arrays, **found.arrays)  # type: ignore[arg-type]
            files.write(directory / DATA, arrays.getvalue())
        files.write(directory / SUMMARY, json_bytes(summary))
    return summary


def read_summary(directory: Path) -> dict[str, Any] | None:
    """The summary a study left in `directory`, if it did and this version can read it."""
    try:
        summary = json.loads((directory / SUMMARY).read_bytes())
    except (OSError, ValueError):
        return None
    return summary if isinstance(summary, dict) and summary.get("format") == FORMAT else None


def json_bytes(data: dict[str, Any]) -> bytes:
    """As UTF-8, with a line end."""
    return (json.dumps(data, indent=1, allow_nan=False) + "\n").encode()


def plain(value: Any) -> Any:
    """`value` in what JSON has: no NumPy types; None for a number that is not finite."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _picture(files: Transaction, directory: Path, name: str, caption: str, figure: Any) -> dict[str, str]:
    names = {}
    for kind, data in rendered(figure).items():
        names[kind] = f"{name}.{kind}"
        files.write(directory / names[kind], data)
    return {"name": name, "caption": caption, **names}


def _sound(files: Transaction, directory: Path, sound: Sound) -> dict[str, Any]:
    path = directory / f"{sound.name}.wav"
    metres_per_unit = float(np.max(np.abs(sound.samples))) / PEAK or 1.0
    writer = AudioWriter(files, path, encoding(path, sound.rate, bits="24"))
    writer.write(sound.samples / metres_per_unit)
    writer.close()
    return {
        "name": sound.name, "caption": sound.caption, "wav": path.name, "rate_hz": sound.rate,
        "seconds": sound.samples.size / sound.rate, "metres_per_unit": metres_per_unit,
    }  # fmt: skip


def _table(files: Transaction, directory: Path, table: Table) -> dict[str, Any]:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(("" if value is None else value for value in row) for row in table.rows)
    files.write(directory / f"{table.name}.csv", text.getvalue().encode())
    about = {"name": table.name, "caption": table.caption, "csv": f"{table.name}.csv"}
    return about | ({"columns": list(table.columns), "rows": plain(table.rows)} if table.shown else {})
