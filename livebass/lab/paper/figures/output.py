"""The files that a study writes into its directory, all or none, and the HTML page over all studies.

The page refers only to the files beside it, so it also opens from a disk.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from livebass import __version__
from livebass.files.whole import Transaction
from livebass.lab.paper.cases import PLAYED
from livebass.lab.paper.figures.study import Findings, Picture, Sound, Study, Table
from livebass.report.page import html_page
from livebass.report.picture import image
from livebass.report.text import csv_text, json_text, plain
from livebass.sound.audiofile import AudioWriter, encoding

SUMMARY, DATA = "summary.json", "result.npz"
FORMAT = 1  # of the summary
PEAK = 10 ** (-1 / 20)  # of a sound, -1 dBFS


def write(directory: Path, study: Study, found: Findings, about: dict[str, Any]) -> dict[str, Any]:
    """Write the files of `study` into `directory`, created if missing; return their summary, which is one of them.

    `about` is added to the summary. Raises OutputError; the directory is then unchanged.
    """
    with Transaction() as files:
        files.directory(directory)
        summary = {
            "format": FORMAT, "version": __version__, "name": study.name, "title": study.title,
            "section": study.section, "gives": study.gives, **about,
            "figures": [_picture(files, directory, picture) for picture in found.pictures],
            "sounds": [_sound(files, directory, sound) for sound in found.sounds],
            "tables": [_table(files, directory, table) for table in found.tables],
            "numbers": plain(found.numbers), "data": DATA if found.arrays else None,
        }  # fmt: skip
        if found.arrays:
            arrays = io.BytesIO()
            np.savez_compressed(arrays, **found.arrays)  # type: ignore[arg-type]
            files.write(directory / DATA, arrays.getvalue())
        files.write_text(directory / SUMMARY, json_text(summary))
    return summary


def read_summary(directory: Path) -> dict[str, Any] | None:
    """The summary that a study wrote into `directory`; None if this version cannot read one."""
    try:
        summary = json.loads((directory / SUMMARY).read_bytes())
    except (OSError, ValueError):
        return None
    return summary if isinstance(summary, dict) and summary.get("format") == FORMAT else None


def _picture(files: Transaction, directory: Path, picture: Picture) -> dict[str, str]:
    names = {}
    for kind in ("png", "svg"):
        names[kind] = f"{picture.name}.{kind}"
        files.write(directory / names[kind], image(picture.figure, kind))
        picture.figure.set_layout_engine("none")  # now laid out, which takes as long as drawing
    return {"name": picture.name, "caption": picture.caption, **names}


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
    files.write_text(directory / f"{table.name}.csv", csv_text(table.columns, table.rows))
    about = {"name": table.name, "caption": table.caption, "csv": f"{table.name}.csv"}
    return about | ({"columns": list(table.columns), "rows": plain(table.rows)} if table.shown else {})


def page(summaries: Iterable[Mapping[str, Any]], version: str, player: str = "") -> str:
    """The HTML page over studies, from their summaries; the files of each are in the directory of its name.

    Studies of one of the PLAYED cases link to it on the page that plays, at the address `player`, if given.
    """
    studies = [
        {**s, "files": [*([s["data"]] if s["data"] else []), *(table["csv"] for table in s["tables"])]}
        for s in summaries
    ]
    verdict = next((s["numbers"]["verdict"] for s in studies if "verdict" in (s["numbers"] or {})), None)
    return html_page(
        "livebass.lab.paper",
        "studies.html",
        version=version,
        studies=studies,
        verdict=verdict,
        player=player,
        played=PLAYED,
    )
