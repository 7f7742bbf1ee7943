"""Writes the page: a folder for a web server, or one HTML file that also plays from a disk.

The page asks no other server for anything, and its content security policy forbids it to.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from pathlib import Path
from typing import Any

from livebass import __version__
from livebass.files import whole_directory
from livebass.kernels.instrument import LIVE, STUDIO
from livebass.model.instrument import Instrument
from livebass.plugin.instrument import ENDING, instrument_file
from livebass.web import build
from livebass.web.layout import layout

STATIC = Path(__file__).parent / "static"
INDEX, SINGLE = "index.html", "livebass.html"
BASSES, MODULE = "basses", "livebass.wasm"
TIERS = {"live": LIVE, "studio": STUDIO}
MOST_BASSES, LONGEST_NAME = 128, 63
# The audio thread of a page from a disk is a data: address, the worker a blob: one
POLICIES = {
    False: "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; worker-src 'self';"
    " connect-src 'self'; img-src data:",
    True: "default-src 'none'; script-src {scripts} data: blob: 'wasm-unsafe-eval'; style-src {styles};"
    " worker-src data: blob:; img-src data:",
}


def export_page(basses: dict[str, Instrument], folder: Path, single: bool = False, quality: str = "live") -> Path:
    """Writes a page that plays `basses`, by short name; returns the HTML file.

    The folder appears complete, over an older page, or not at all. The first bass is the one that the page begins with.
    Raises ValueError for names or basses that do not fit, OutputError, RuntimeError where the module cannot be built.
    """
    if not 1 <= len(basses) <= MOST_BASSES:
        raise ValueError(f"{len(basses)} basses: allowed are 1 to {MOST_BASSES}")
    for name in basses:
        if not 1 <= len(name) <= LONGEST_NAME or not all(c.isascii() and (c.isalnum() or c in "-_.") for c in name):
            raise ValueError(f"bass {name!r}: allowed are 1 to {LONGEST_NAME} letters, digits, - and _")
    files = page_files(basses, quality)
    if single:
        files = {SINGLE: single_page(files)}
    with whole_directory(folder, is_page) as temporary:
        for name, data in files.items():
            place = temporary / name
            place.parent.mkdir(exist_ok=True)
            place.write_bytes(data)
    return folder / (SINGLE if single else INDEX)


def is_page(entries: list[Path]) -> bool:
    """True if these are the entries of a page that this file wrote: they may be replaced."""
    names = {entry.name for entry in entries}
    return names == {SINGLE} or names == {INDEX, BASSES, MODULE, "app.js", "style.css", "worker.js", "worklet.js"}


def page_files(basses: dict[str, Instrument], quality: str) -> dict[str, bytes]:
    """The files of the page in a folder, by their paths."""
    engine = (layout() + text("engine.js")).encode()
    files = {f"{BASSES}/{name}{ENDING}": instrument_file(bass) for name, bass in basses.items()}
    files |= {
        MODULE: build.module(),
        "worker.js": engine + text("worker.js").encode(),
        "worklet.js": engine + text("worklet.js").encode(),
        "app.js": text("app.js").encode(),
        "style.css": text("style.css").encode(),
    }
    page = {
        "version": __version__,
        "tier": TIERS[quality],
        "basses": [shown(name, bass) for name, bass in basses.items()],
    }
    return files | {INDEX: html(page, POLICIES[False]).encode()}


def shown(name: str, bass: Instrument) -> dict[str, Any]:
    """What the page shows of a bass and cannot read from its file."""
    player = bass.player
    place = (player.pluck_position - player.pluck_nearest) / (player.pluck_farthest - player.pluck_nearest)
    return {
        "name": name,
        "title": bass.name,
        "about": bass.description,
        "strings": [
            {"name": s.name, "note": s.open_note, "gauge": round(s.diameter * 1e3, 2)} for s in bass.strings
        ],
        "frets": min(len(neck.fret_positions) for neck in bass.necks),
        "fretless": bass.over_board,
        "position": round(127 * min(max(place, 0.0), 1.0)),
        "controller": player.position_controller,
    }


def single_page(files: dict[str, bytes]) -> bytes:
    """The page in one file: scripts and style in it, everything else packed."""
    style, script = files["style.css"].decode(), files["app.js"].decode()
    packed = {
        name: base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()
        for name, data in files.items()
        if name not in (INDEX, "app.js", "style.css")
    }
    begin, end = '<script type="application/json" id="page">', "</script>"
    index = files[INDEX].decode()
    page = json.loads(index.split(begin)[1].split(end)[0]) | {"files": packed}
    policy = POLICIES[True].format(scripts=digest(script), styles=digest(style))
    made = html(page, policy)
    for found, put in (
        ('<link rel="stylesheet" href="style.css">', f"<style>{style}</style>"),
        ('<script src="app.js"></script>', f"<script>{script}</script>"),
    ):
        assert made.count(found) == 1
        made = made.replace(found, put)
    return made.encode()


def html(page: dict[str, Any], policy: str) -> str:
    """The HTML with what the page knows and its policy."""
    data = json.dumps(page, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")
    return (
        text("index.html")
        .replace("<!-- policy -->", f'<meta http-equiv="Content-Security-Policy" content="{policy}">')
        .replace('id="page"></script>', f'id="page">{data}</script>')
    )


def digest(source: str) -> str:
    """The source expression of a policy that allows this one script or style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()}'"


def text(name: str) -> str:
    """A file of the page."""
    return (STATIC / name).read_text("utf-8")
