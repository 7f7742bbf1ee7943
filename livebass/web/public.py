"""A page on a public server: tags for previews of its links, and files that keep it for use offline."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit

from livebass.web.modules import text

MANIFEST, WORKER, ELEMENT, CARD = "manifest.webmanifest", "offline.js", "embed.js", "card.png"
PUBLIC = (MANIFEST, WORKER, ELEMENT, CARD)
PICTURE, CARD_SIZE = Path(__file__).with_name(CARD), (1200, 630)  # beside links; px: tools/card.py draws it
GROUND = "#15110e"  # as in style.css
ABOUT = "An electric bass, computed from physics as you play: see and hear its strings hit the frets."
ICON = re.compile(r'<link rel="icon" href="([^"]*)">')


def checked_address(address: str) -> str:
    """Returns a page's public address without the part after its #. Raises ValueError for any other text."""
    page = address.split("#")[0]
    parts = urlsplit(page)
    if parts.scheme not in ("http", "https") or not parts.hostname or re.search(r"[\s\"'<>]", page):
        raise ValueError(f"an address must be such as https://example.org/bass/, not {address[:60]}")
    return page


def head(page: dict[str, Any]) -> str:
    """Returns the lines that a page with this data has in its head."""
    lines = [f'<meta name="description" content="{ABOUT}">']
    if address := page.get("address"):
        tags = {"type": "website", "title": f"livebass: {page['basses'][0]['title']}", "description": ABOUT,
                "url": address}  # fmt: skip
        if not page.get("packed"):  # a single file has no picture beside it
            tags |= {"image": urljoin(address, CARD), "image:width": str(CARD_SIZE[0]),
                     "image:height": str(CARD_SIZE[1]), "image:alt": "A bass string that hits the frets"}  # fmt: skip
            lines.append('<meta name="twitter:card" content="summary_large_image">')
        lines += [f'<meta property="og:{name}" content="{escape(words)}">' for name, words in tags.items()]
        lines.append(f'<link rel="canonical" href="{escape(address)}">')
    if page.get("offline"):
        lines.append(f'<link rel="manifest" href="{MANIFEST}">')
    return "\n".join(lines)


def public_files(names: Iterable[str], needed: int, digest: str) -> dict[str, bytes]:
    """Returns the files of PUBLIC for a page with the files `names`, the first `needed` at once, and their digest."""
    icon = {"src": ICON.findall(text("index.html"))[0], "sizes": "any", "type": "image/svg+xml"}
    manifest = {
        "name": "livebass", "short_name": "livebass", "description": ABOUT, "start_url": "./", "display": "standalone",
        "background_color": GROUND, "theme_color": GROUND, "icons": [icon],
    }  # fmt: skip
    versions = [f"{name}?v={digest}" for name in names]
    worker = text(WORKER).replace("DIGEST", digest).replace('["FILES"]', json.dumps(["./", *versions[:needed]]))
    worker = worker.replace('["LATER"]', json.dumps(versions[needed:]))
    made = {MANIFEST: json.dumps(manifest), WORKER: worker, ELEMENT: text(ELEMENT)}
    return {name: words.encode() for name, words in made.items()} | {CARD: PICTURE.read_bytes()}
