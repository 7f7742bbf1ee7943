"""What came out of a study as files of a directory: all of them or none.

One HTML page over what studies left in a directory: figures, players, numbers, links to the data.

It refers to the files beside it and to nothing else, so that it opens from a disk as well.
"""

from __future__ import annotations

import csv
import html
import io
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

import numpy as np

from livebass import __version__
from livebass.audiofile import AudioWriter, encoding
from livebass.files import Transaction
from livebass.paper.figures.draw import rendered
from livebass.paper.figures.measure import Findings, Sound, Study, Table

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


PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>livebass: studies</title>
<style>
body { font: 16px/1.5 sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
nav li { display: inline-block; margin-right: 1.2rem; }
nav ul { padding: 0; }
section { border-top: 1px solid #ccc; margin-top: 2.5rem; }
figure { margin: 1.5rem 0; }
img { max-width: 100%; height: auto; }
figcaption, caption, .small { color: #555; font-size: 0.9rem; text-align: left; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.85rem; margin: 1rem 0; }
th, td { border-bottom: 1px solid #ddd; padding: 0.2rem 0.7rem; text-align: right; vertical-align: top; }
th:first-child, td:first-child { text-align: left; white-space: nowrap; }
th.text, td.text { text-align: left; max-width: 28rem; }
.sounds div { margin: 0.6rem 0; }
audio { display: block; width: 24rem; max-width: 100%; }
</style>
</head>
<body>
<h1>An electric bass computed</h1>
<p>The simulations of C. Issanchou, J.-L. Le Carrou, C. Touz&eacute;, B. Fabre and O. Doar&eacute;, <em>String/frets
contacts in the electric bass sound: Simulations and experiments</em>, Applied Acoustics 129 (2018), computed anew by
livebass $version. Sections and figures are those of that paper.</p>
<nav><ul>
$index
</ul></nav>
$studies
</body>
</html>
""")

TEXT = ' class="text"'
STUDY = Template("""<section id="$name">
<h2>$title</h2>
<p class="small">$section. $about</p>
$sounds
$figures
$tables
<p class="small">Data: $data</p>
</section>
""")


def page(summaries: Iterable[Mapping[str, Any]], version: str) -> str:
    """The text of the page; `summaries` as `study_files.write` gives them, each of the directory of its name."""
    told = list(summaries)
    index = "\n".join(f'<li><a href="#{_text(s["name"])}">{_text(s["title"])}</a></li>' for s in told)
    return PAGE.substitute(version=_text(version), index=index, studies="\n".join(map(_study, told)))


def _study(summary: Mapping[str, Any]) -> str:
    name = summary["name"]
    files = [*([summary["data"]] if summary["data"] else []), *(t["csv"] for t in summary["tables"])]
    seconds = summary.get("solved_in_s")
    about = f"{summary['gives'][0].upper()}{summary['gives'][1:]}."
    if seconds:
        about += f" Computed in {seconds:.2g} s of one core's time, by version {summary['version']}."
    sounds = "\n".join(
        f'<div><span class="small">{_text(sound["caption"])}</span>'
        f'<audio controls preload="metadata" src="{_link(name, sound["wav"])}"></audio></div>'
        for sound in summary["sounds"]
    )
    return STUDY.substitute(
        name=_text(name),
        title=_text(summary["title"]),
        section=_text(f"Section{'s' * (not summary['section'].replace('.', '').isdigit())} {summary['section']}"),
        about=_text(about),
        sounds=f'<div class="sounds">{sounds}</div>' if sounds else "",
        figures="\n".join(_figure(name, figure) for figure in summary["figures"]),
        tables="\n".join(_table_html(table) for table in summary["tables"] if "rows" in table),
        data=", ".join(f'<a href="{_link(name, file)}">{_text(file)}</a>' for file in files),
    )


def _figure(name: str, figure: Mapping[str, Any]) -> str:
    caption = _text(figure["caption"])
    return (
        f'<figure><a href="{_link(name, figure["svg"])}"><img src="{_link(name, figure["png"])}" alt="{caption}"></a>'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def _table_html(table: Mapping[str, Any]) -> str:
    first = table["rows"][0] if table["rows"] else [None] * len(table["columns"])
    head = "".join(
        f"<th{TEXT * isinstance(value, str)}>{_text(column)}</th>"
        for column, value in zip(table["columns"], first, strict=True)
    )
    rows = "\n".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table["rows"])
    caption = f"<caption>{_text(table['caption'])}</caption>"
    return f'<div class="wide"><table>{caption}<thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table></div>'


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return f"<td{TEXT}>{_text(value)}</td>"
    shown = "&ndash;" if value is None else f"{value:.5g}" if isinstance(value, float) else _text(value)
    return f"<td>{shown}</td>"


def _link(name: str, file: str) -> str:
    return _text(quote(f"{name}/{file}"))


def _text(value: Any) -> str:
    return html.escape(str(value))
