"""The page as the editor of a plugin, one HTML file beside its instruments, for the web views of hosts.

The plugin and the page say to each other what livebass/plugin/c/page.h lists; static/edit.js is the page's side.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from livebass.kernels.player.constants import FINGER, PICK
from livebass.live.parameters import PARAMETERS
from livebass.live.thread.look import LOOK, STRING_LOOK
from livebass.live.thread.sight import SIGHT
from livebass.model.instrument import Instrument
from livebass.techniques import BUTTONS, TECHNIQUE_ROWS
from livebass.web.export import SCRIPTS, page_data, script_of, shown, single_page, text, with_html
from livebass.web.layout import record

SYMBOLS = [p.symbol for p in PARAMETERS]
STROKES = {FINGER: "finger", PICK: "pick"}


def editor_page(basses: dict[str, Instrument]) -> bytes:
    """The page that edits a plugin with `basses`, by short name; of others it shows what the plugin tells of them."""
    known = {name: _shown(name, bass) for name, bass in basses.items()}
    page = page_data(list(known.values())[:1])
    page["buttons"] = [b._replace(value=0)._asdict() for b in BUTTONS]  # by keys alone, as the window's lamps
    page["editing"] = {
        "basses": known,
        "bass": SYMBOLS.index("bass"),
        "symbols": SYMBOLS,
        "parameters": [asdict(p) for p in PARAMETERS],
        "look": record(LOOK),
        "lane": record(STRING_LOOK),
        "sight": SIGHT.itemsize,
        "switches": {row.symbol: row.number for row in TECHNIQUE_ROWS.values()},
        "strokes": STROKES,
    }
    *most, last = SCRIPTS
    scripts = script_of((*most, "edit.js", last))
    return single_page(with_html({"app.js": scripts.encode(), "style.css": text("style.css").encode()}, page))


def _shown(name: str, bass: Instrument) -> dict[str, Any]:
    keys = {technique: key for key, technique, _ in bass.player.keys.keys}
    return shown(name, bass) | {"bench": None, "cases": [], "keys": keys}
