"""Writes the page: a folder for a web server, or one HTML file that also plays from a disk.

The page loads nothing from other servers; its content security policy forbids it. It requests a folder's files with
their digest, which keeps a browser's cache from mixing two exports.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import math
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from livebass import __version__
from livebass.kernels.bass.instrument import LIVE, STUDIO
from livebass.lab.experiment import fretmap
from livebass.lab.paper.cases import CASES, PLAYED, PRESET
from livebass.live.parameters import PARAMETERS
from livebass.live.thread.sight import SEEN, SIGHT, SLOT_SIGHT
from livebass.model.instrument import Instrument, Neck, Pickup, String
from livebass.model.rest import rests
from livebass.plugin.bundle import instrument_files, write_files
from livebass.plugin.instrument import ENDING, OLD_ENDING, image_digest, instrument_file
from livebass.preset.load import load_preset, preset_names
from livebass.preset.revisions import MARK, present, revisions
from livebass.rows.techniques import BUTTONS, EFFECTS, OF_CHANNEL, STROKE_OF, TECHNIQUE_ROWS, event
from livebass.web import build
from livebass.web.bench import Source, bench
from livebass.web.layout import record
from livebass.web.modules import join_modules, text
from livebass.web.public import ELEMENT, GROUND, PUBLIC, head, public_files
from livebass.web.recorded_note import FOLDER, NOTE, is_recorded, recorded_files
from livebass.web.stories import shown_stories

INDEX, SINGLE = "index.html", "livebass.html"
BASS = '<select id="bass" autocomplete="off"></select>'
STORIES = '<div id="stories" role="group" aria-label="Stories"></div>'
REAL = ("real", "Real bass")  # the button of the recorded note
BASSES, MODULE = "basses", "livebass.wasm"
SOURCES = ("app.js", "style.css", "worker.js", "worklet.js")
FIRST = "<script>first.js</script>"
NEEDED = 6  # files to begin with: scripts, style, kernels and a bass
TITLE, DATA = "<title>livebass</title>", '<script type="application/json" id="page">'
HEAD = 1 << 16  # bytes at a page's start; they hold both
BODY = 0.3  # m from the saddle, shown beside some frets: pickups and the right hand
TIERS = {"live": LIVE, "studio": STUDIO}
SWITCHED = {b.symbol for b in BUTTONS if not b.value}  # techniques that the page calls with keys ...
CONTROLLED = {b.symbol for b in BUTTONS if b.value}  # ... and by controllers
Sources = Mapping[str, Source]  # by short name of a bass
NONE: Sources = {}
NOTHING: Mapping[str, Any] = {}
# A page on a disk loads its audio thread from a data: address and its worker from a blob: address
POLICIES = {
    False: "default-src 'none'; script-src 'self' {first} 'wasm-unsafe-eval'; style-src 'self'; worker-src 'self';"
    " connect-src 'self'; img-src data:; manifest-src 'self'",
    True: "default-src 'none'; script-src {first} {scripts} data: blob: 'wasm-unsafe-eval'; style-src {styles};"
    " worker-src data: blob:; img-src data:",
}


def export_page(
    basses: dict[str, Instrument], folder: str | os.PathLike[str], single: bool = False, quality: str = "live",
    sources: Sources = NONE, more: Mapping[str, Any] = NOTHING, element: bool = False,
) -> Path:  # fmt: skip
    """Writes a page that plays basses in a browser.

    Args:
        basses: By short name; the page begins with the first.
        folder: To write; it replaces an older page completely, or nothing is written.
        single: Writes all of it into one HTML file.
        quality: Of the strings, "live" or "studio".
        sources: The presets that the basses were made from, for the bench; by default, each bass's is the preset of
            its short name.
        more: Data that the page has besides.
        element: Puts the script with which articles show the page beside a single one, too.

    Returns:
        The HTML file.

    Raises:
        ValueError: Unsuitable names or basses.
        OutputError: The folder cannot be written, or holds something else.
        OSError: There can be no module.
    """
    if single:
        files = {SINGLE: single_page(page_files(basses, quality, sources, more))}
        files |= {ELEMENT: text(ELEMENT).encode()} if element else {}
    else:
        files = page_files(basses, quality, sources, {**more, "offline": True})
        names = ["app.js", "style.css", *map(quote, by_need(files, next(iter(basses))))]
        files |= public_files(names, NEEDED, digest_of({name: data for name, data in files.items() if name != INDEX}))
    write_files(Path(folder), files, is_page)
    return Path(folder) / (SINGLE if single else INDEX)


def revisions_of(source: Source | None, name: str) -> dict[str, Any]:
    """The revision of a bass that is a shipped preset as it is, and the earlier ones, which links may name."""
    if source != Source(name) or name not in revisions():
        return {}
    last = present(name)
    return {"revision": last, "earlier": list(range(1, last))}


def is_page(entries: list[Path]) -> bool:
    """True if these are the entries of a page that livebass wrote: they may be replaced."""
    found = {entry.name: entry for entry in entries}
    if set(found) - {ELEMENT} == {SINGLE}:
        return is_single_page(found[SINGLE])
    if set(found) - {FOLDER, *PUBLIC} != {INDEX, BASSES, MODULE, *SOURCES} or not found[BASSES].is_dir():
        return False
    if FOLDER in found and not is_recorded(found[FOLDER]):
        return False
    return all(entry.suffix in (ENDING, OLD_ENDING) for entry in found[BASSES].iterdir())


def is_single_page(file: Path) -> bool:
    """True if this is a page in one file, written by any version of livebass."""
    with suppress(OSError):
        if file.is_file():
            with file.open("rb") as opened:
                head = opened.read(HEAD)
            return TITLE.encode() in head and DATA.encode() in head
    return False


def page_files(
    basses: dict[str, Instrument], quality: str, sources: Sources = NONE, more: Mapping[str, Any] = NOTHING
) -> dict[str, bytes]:
    """Returns the files of a page in a folder, by path; `sources` and `more` as for `export_page`."""
    made = instrument_files(basses)
    known = {name: Source(name) for name in preset_names()} | dict(sources)
    benches = {name: bench(bass, known[name]) for name, bass in basses.items() if name in known}
    files = {f"{BASSES}/{name}{ENDING}": made[f"{name}{ENDING}"] for name in basses}
    for name in basses:
        for number in revisions_of(known.get(name), name).get("earlier", ()):
            files[f"{BASSES}/{name}{MARK}{number}{ENDING}"] = instrument_file(load_preset(f"{name}{MARK}{number}"))
    files |= {
        MODULE: build.module(),
        "worker.js": join_modules("worker.js").encode(),
        "worklet.js": join_modules("worklet.js").encode(),
        **shell(),
    }
    shown_basses = [
        bass_data(name, bass)
        | {
            "bench": benches.get(name),
            "cases": shown_cases(bass, known.get(name)),
            "made": image_digest(bass),
            **revisions_of(known.get(name), name),
        }
        for name, bass in basses.items()
    ]
    stories = shown_stories([name for name, has in benches.items() if has])
    data = page_data(shown_basses) | {"tier": TIERS[quality], "stories": stories}
    data["sliders"] = take_out_shared([has["sliders"] for has in benches.values() if has])
    if NOTE["bass"] in basses and known[NOTE["bass"]] == Source(NOTE["bass"]):
        files |= recorded_files()
        data["recorded"] = NOTE
    return with_html(files, data | dict(more))


def waiting_page(done: float) -> dict[str, bytes]:
    """Returns a page to show while the real one is made; `done` is the fraction made."""
    style = f"background: {GROUND}; color: #f1e8db; font: 1.25rem/1.5 system-ui, sans-serif; padding: 2rem"
    words = f"<h1>livebass</h1><p>Compiling the strings, once: {100 * done:.0f} %. The page opens by itself.</p>"
    bar = f'<progress value="{done:.2f}" aria-label="Compiling"></progress>'
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><meta http-equiv="refresh" content="1">{TITLE}'
    return {INDEX: f'{head}<body style="{style}">{words}{bar}</body></html>'.encode()}


def shell() -> dict[str, bytes]:
    """Returns the script and the style that every page has."""
    return {"app.js": join_modules("main.js").encode(), "style.css": text("style.css").encode()}


def with_html(files: dict[str, bytes], page: dict[str, Any]) -> dict[str, bytes]:
    """Adds the HTML with the data `page` to a page's files."""
    known = {"version": __version__, "digest": digest_of(files)} | page
    return files | {INDEX: html(known, POLICIES[False]).encode()}


def page_data(basses: list[dict[str, Any]]) -> dict[str, Any]:
    """Returns the data that every page has; `basses` are as `bass_data` returns them."""
    return {
        "parameters": {
            p.symbol: {
                "minimum": p.minimum,
                "maximum": p.maximum,
                "defaultValue": p.default,
                "unit": p.unit,
                "whole": p.whole,
                "points": p.points,
                "event": event(p),
            }
            for p in PARAMETERS
            if event(p)
        },
        "sight": {"SIGHT": record(SIGHT), "SLOT_SIGHT": record(SLOT_SIGHT) | {"seen": SEEN}},
        "buttons": [
            b._asdict() | {"everywhere": b.symbol in OF_CHANNEL, "stroke": STROKE_OF[TECHNIQUE_ROWS[b.symbol].number]}
            for b in BUTTONS
        ],
        "sliders": {},
        "map": {"velocity": fretmap.VELOCITY, "seconds": fretmap.DURATION, "rate": fretmap.RATE},
        "basses": basses,
    }


def take_out_shared(benches: list[list[dict[str, Any]]]) -> dict[str, dict[str, Any]]:
    """Takes what a slider has on all basses, such as its limits, out of their benches; returns it, by symbol."""
    shared: dict[str, dict[str, Any]] = {}
    for slider in (slider for sliders in benches for slider in sliders):
        known = shared.setdefault(slider["symbol"], dict(slider))
        shared[slider["symbol"]] = {key: value for key, value in known.items() if slider.get(key) == value}
    for slider in (slider for sliders in benches for slider in sliders):
        for key in shared[slider["symbol"]]:
            if key != "symbol":
                del slider[key]
    return shared


def bass_data(name: str, bass: Instrument) -> dict[str, Any]:
    """Returns the data of a bass, such as strings and frets, that the page cannot read from the instrument file."""
    return {
        "name": name,
        "title": bass.name,
        "about": bass.description,
        "strings": [shown_string(s, neck, bass.frets) for s, neck in zip(bass.strings, bass.necks, strict=True)],
        "pickups": [shown_pickup(pickup, bass) for pickup in bass.output.pickups],
        "body": bass.strings[0].length - BODY,
        "pluck": [bass.player.pluck_nearest, bass.player.pluck_position, bass.player.pluck_farthest],
        "capo": round(12 * math.log2(1 + bass.necks[0].capo / bass.strings[0].length)),  # its fret, from the nut
        "frets": bass.frets,
        "fretless": bass.over_board,
        "stroke": "slap" if bass.player.technique == "slap" else bass.player.stroke,
        "range": bass.note_range,
        "switches": sorted(bass.switches),
        "keys": {name: key for key, name, _ in bass.player.keys.keys if name in SWITCHED},
        "effects": {knob: getattr(bass.effects, knob) for knob in EFFECTS},
        "controllers": {name: number for number, name in bass.player.keys.controllers if name in CONTROLLED},
    }


def shown_cases(bass: Instrument, source: Source | None) -> list[dict[str, Any]]:
    """Returns the paper's plucks for the page (lengths in m) if the bass is the paper's unchanged preset."""
    if source != Source(PRESET):
        return []
    return [
        {
            "symbol": name,
            "title": CASES[name].title.removeprefix("Case "),
            "apex": CASES[name].apex,
            "place": CASES[name].position,
            "width": bass.player.rounding,
            "tier": TIERS["studio"],
            "says": f"{CASES[name].title}, {CASES[name].position:g} m from the nut (section {CASES[name].section}).",
        }
        for name in PLAYED
    ]


def shown_string(string: String, neck: Neck, frets: int) -> dict[str, Any]:
    """Returns a string's data for the page: lengths in m, its gauge in mm; it may be pressed at so many `frets`.

    Its `rests` are the frets at which it frets out, each with the fret that it lies on.
    """
    return {
        "name": string.name,
        "note": string.open_note,
        "gauge": round(string.diameter * 1e3, 2),
        "length": string.length,
        "frets": [round(x, 6) for x in neck.fret_positions],
        "heights": [round(h, 7) for h in neck.fret_heights],
        "rests": rests(string, neck, frets),
    }


def shown_pickup(pickup: Pickup, bass: Instrument) -> dict[str, Any]:
    """Returns a pickup's place, m from the saddle, its aperture, and the numbers of the strings it senses."""
    names = [s.name for s in bass.strings]
    strings = [names.index(name) for name in pickup.strings] or list(range(len(names)))
    return {"position": pickup.position, "aperture": pickup.aperture, "strings": strings}


def single_page(files: dict[str, bytes]) -> bytes:
    """Returns the page in one file: script and style inline, everything else packed behind them.

    So a browser shows the neck while the rest is on its way; what is needed first comes first.
    """
    style, script = files["style.css"].decode(), files["app.js"].decode()
    index = files[INDEX].decode()
    page = json.loads(index.split(DATA)[1].split("</script>")[0]) | {"packed": True}
    packed = [
        f'<script type="text/plain" data-file="{escape(name)}">'
        f"{base64.b64encode(gzip.compress(files[name], 9, mtime=0)).decode()}</script>\n"
        for name in by_need(files, page["basses"][0]["name"])
    ]
    policy = POLICIES[True].replace("{scripts}", policy_source(script)).replace("{styles}", policy_source(style))
    made = html(page, policy)
    for found, put in (
        (f'<link rel="stylesheet" href="style.css?v={page["digest"]}">', f"<style>{style}</style>"),
        (f'<script src="app.js?v={page["digest"]}"></script>', f"<script>{script}</script>"),
    ):
        assert made.count(found) == 1
        made = made.replace(found, put)
    return made.replace("</body>", f"{''.join(packed)}</body>").encode()


def by_need(files: Iterable[str], first: str) -> list[str]:
    """Returns the names of a page's packed or kept files in the order in which it needs them.

    First are kernels and scripts, then the bass called `first`, other basses, their earlier revisions, and the rest.
    """
    begins = (MODULE, "worker.js", "worklet.js", f"{BASSES}/{first}{ENDING}", f"{BASSES}/")

    def turn(name: str) -> tuple[int, bool]:
        return next((k for k, begin in enumerate(begins) if name.startswith(begin)), len(begins)), "@" in name

    return sorted((name for name in files if name not in (INDEX, "app.js", "style.css")), key=turn)


def html(page: dict[str, Any], policy: str) -> str:
    """Returns the HTML with the page's data and its policy.

    The header's names are in it, so that nothing moves when the script comes.
    """
    options = "".join(f'<option value="{escape(b["name"])}">{escape(b["title"])}</option>' for b in page["basses"])
    shown = [(f"story-{story['name']}", story["title"]) for story in page.get("stories", ())]
    shown += [REAL] if "recorded" in page else []
    buttons = "".join(f'<button id="{escape(name)}" type="button">{escape(title)}</button>' for name, title in shown)
    data = in_script(page)
    first = text("first.js").replace('"BASSES"', in_script([room(bass) for bass in page["basses"]]))
    policy = policy.replace("{first}", policy_source(first))
    return (
        text("index.html")
        .replace(BASS, BASS.replace("><", f">{options}<"))
        .replace(STORIES, STORIES.replace("><", f">{buttons}<"))
        .replace(FIRST, f"<script>{first}</script>")
        .replace('href="style.css"', f'href="style.css?v={page["digest"]}"')
        .replace('src="app.js"', f'src="app.js?v={page["digest"]}"')
        .replace("<!-- policy -->", f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n{head(page)}')
        .replace(f"{DATA}</script>", f"{DATA}{data}</script>")
    )


def in_script(data: Any) -> str:
    """Returns data as JSON that may stand in a script of a page."""
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")


def room(bass: dict[str, Any]) -> tuple[str, int, bool]:
    """Returns what the room for a bass on the page depends on: its name, its strings, whether it has cases."""
    return bass["name"], len(bass["strings"]), bool(bass.get("cases"))


def digest_of(files: dict[str, bytes]) -> str:
    """Returns a digest of files and their names."""
    whole = hashlib.sha256()
    for name, data in sorted(files.items()):
        whole.update(f"{name}\n{len(data)}\n".encode() + data)
    return whole.hexdigest()[:16]


def policy_source(source: str) -> str:
    """Returns the policy's source expression that allows this script or style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()}'"
