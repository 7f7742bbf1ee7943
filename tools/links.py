"""Checks the links of a folder of web pages without a network.

python tools/links.py FOLDER     prints dead links and what pages load from other hosts; --external lists other links
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass, field
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADED = {  # what a browser fetches to show a page: (tag, attribute)
    ("audio", "src"), ("embed", "src"), ("iframe", "src"), ("image", "href"), ("img", "src"), ("input", "src"),
    ("link", "href"), ("object", "data"), ("script", "src"), ("source", "src"), ("track", "src"), ("use", "href"),
    ("video", "poster"), ("video", "src"),
}  # fmt: skip
SETS = {("img", "srcset"), ("link", "imagesrcset"), ("source", "srcset")}  # lists of addresses, each with a size
FOLLOWED = {("a", "href"), ("area", "href"), ("form", "action")}
UNFETCHED = {"alternate", "author", "canonical", "help", "license", "next", "prev", "search"}  # rel of <link>
STYLE = re.compile(r"""url\(\s*["']?([^"')]+)["']?\s*\)|@import\s+["']([^"']+)["']""")
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


@dataclass
class Links(HTMLParser):
    """The anchors and addresses of one page."""

    anchors: set[str] = field(default_factory=set)
    loaded: list[str] = field(default_factory=list)
    followed: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()
        self._style = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self._style = tag == "style"
        self.anchors.update(given[name] for name in ("id", "name") if name in given)
        fetched = tag != "link" or not set(given.get("rel", "").split()) <= UNFETCHED
        for name, value in given.items():
            if (tag, name) in FOLLOWED or ((tag, name) in LOADED and not fetched):
                self.followed += [value] if given.get("rel") != "canonical" else []  # the page's own address
            elif (tag, name) in LOADED:
                self.loaded.append(value)
            elif (tag, name) in SETS:
                self.loaded += [part.split()[0] for part in value.split(",") if part.split()]
            elif name == "style":
                self.loaded += styled(value)

    def handle_endtag(self, tag: str) -> None:
        self._style = False

    def handle_data(self, data: str) -> None:
        if self._style:
            self.loaded += styled(data)


def styled(text: str) -> list[str]:
    """Returns the addresses that a style sheet loads."""
    return [first or second for first, second in STYLE.findall(COMMENT.sub("", text))]


def read(file: Path) -> Links:
    """Returns the links of an HTML page or a style sheet."""
    links = Links()
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".css":
        links.loaded += styled(text)
    else:
        links.feed(text)
        links.close()
    return links


def is_elsewhere(address: str) -> bool:
    """True if an address names another host or program (https:, //host, mailto:); data: is part of the page."""
    parts = urlsplit(address)
    return bool(parts.netloc or (parts.scheme and parts.scheme not in ("data", "blob", "javascript")))


def check(folder: Path) -> tuple[list[str], set[str]]:
    """Returns the faults of the pages in `folder`, a line each, and the links that lead elsewhere.

    A fault is a link to a missing file or anchor, a link out of the folder, or a resource from another host.
    """
    folder = folder.resolve()
    faults: list[str] = []
    elsewhere: set[str] = set()
    known = cache(read)
    for file in sorted(path for path in folder.rglob("*") if path.suffix in (".html", ".css")):
        links, name = known(file), file.relative_to(folder).as_posix()
        faults += [f"{name}: loads {address}" for address in links.loaded if is_elsewhere(address)]
        elsewhere.update(address for address in links.followed if is_elsewhere(address))
        for address in dict.fromkeys((*links.loaded, *links.followed)):
            parts = urlsplit(address)
            if is_elsewhere(address) or parts.scheme:
                continue
            path = unquote(parts.path)
            target = (folder / path.lstrip("/") if path.startswith("/") else file.parent / path).resolve()
            target = file if not path else target / "index.html" if target.is_dir() else target
            if not target.is_relative_to(folder) or not target.is_file():
                faults.append(f"{name}: {address}: there is no such file")
            elif parts.fragment and target.suffix == ".html" and unquote(parts.fragment) not in known(target).anchors:
                faults.append(f"{name}: {address}: the page has no such anchor")
    return faults, elsewhere


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", type=Path, help="of HTML pages")
    parser.add_argument("--external", action="store_true", help="list the links that lead elsewhere, too")
    given = parser.parse_args()
    if not given.folder.is_dir():
        parser.error(f"{given.folder}: is not a folder")
    faults, elsewhere = check(given.folder)
    for line in faults:
        print(line, file=sys.stderr)
    for address in sorted(elsewhere) if given.external else ():
        print(address)
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
