"""One HTML page over what studies left in a directory: figures, players, numbers, links to the data.

It refers to the files beside it and to nothing else, so that it opens from a disk as well.
"""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping
from string import Template
from typing import Any
from urllib.parse import quote

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
        tables="\n".join(_table(table) for table in summary["tables"] if "rows" in table),
        data=", ".join(f'<a href="{_link(name, file)}">{_text(file)}</a>' for file in files),
    )


def _figure(name: str, figure: Mapping[str, Any]) -> str:
    caption = _text(figure["caption"])
    return (
        f'<figure><a href="{_link(name, figure["svg"])}"><img src="{_link(name, figure["png"])}" alt="{caption}"></a>'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def _table(table: Mapping[str, Any]) -> str:
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
