"""Joins the page's JavaScript modules into one script that leaves no name in the global scope.

Each module becomes a function that returns its exports; it runs after the modules that it imports. Modules import with
lines such as `import {name, ...} from "./file.js";`, `import * as name from "../folder/file.js";` or
`import "./file.js";`; a file's name is unique among all folders. They export functions, classes and constants at their
declarations, and must not import one another in a circle.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from pathlib import Path

from livebass.web.layout import layout
from livebass.web.words import words

STATIC = Path(__file__).parent / "static"
IMPORT = re.compile(
    r'^import (?:(?:\* as (?P<all>\w+)|\{(?P<names>[\w$, ]+)\}) from )?"\.{1,2}/(?:\w+/)?(?P<file>[\w.]+)";\n',
    re.MULTILINE,
)
EXPORT = re.compile(r"^export (?=(?:const|class|(?:async )?function\*?) (?P<name>[\w$]+))", re.M)
UNJOINED = re.compile(r"^(?:import|export)\b.*", re.M)
MADE = {"layout.js": layout, "words.js": words}  # modules made by Python: the kernels' layout, words about MIDI files
NONE: Mapping[str, str] = {}


def join_modules(entry: str, more: Mapping[str, str] = NONE) -> str:
    """Returns a classic script: an expression whose value is the exports of the module `entry`.

    `more` holds modules besides the page's own, by file name. Raises ValueError for modules that cannot be joined.
    """
    parts: dict[str, str] = {}
    exports: dict[str, list[str]] = {}

    def add(file: str, importers: tuple[str, ...]) -> None:
        if file in importers:
            raise ValueError(f"modules import one another in a circle: {' -> '.join((*importers, file))}")
        if file in parts:
            return
        source = more[file] if file in more else f"export {MADE[file]()}" if file in MADE else text(file)
        for found in IMPORT.finditer(source):
            add(found["file"], (*importers, file))
            for name in _names(found):
                if name not in exports[found["file"]]:
                    raise ValueError(f"{file}: {found['file']} exports no {name}")
        exports[file] = [found["name"] for found in EXPORT.finditer(source)]
        body = EXPORT.sub("", IMPORT.sub(_import_line, source))
        if odd := UNJOINED.search(body):
            raise ValueError(f"{file}: cannot be joined: {odd[0]}")
        parts[file] = f"const {_variable(file)} = (() => {{\n{body}return {{{', '.join(exports[file])}}};\n}})();\n"

    add(entry, ())
    return f'(() => {{\n"use strict";\n{"".join(parts.values())}return {_variable(entry)};\n}})();\n'


def text(name: str) -> str:
    """Reads a file of the page."""
    return _places()[name].read_text("utf-8")


@functools.cache
def _places() -> dict[str, Path]:
    """Finds the page's files by name, in all folders."""
    return {place.name: place for place in STATIC.rglob("*.*")}


def _names(found: re.Match[str]) -> list[str]:
    return [name.strip() for name in (found["names"] or "").split(",") if name.strip()]


def _import_line(found: re.Match[str]) -> str:
    """Returns the script line that replaces an import."""
    names = found["all"] or (f"{{{found['names']}}}" if found["names"] else "")
    return f"const {names} = {_variable(found['file'])};\n" if names else ""


def _variable(file: str) -> str:
    """Names the variable for a module's exports."""
    return "$" + file.removesuffix(".js").replace(".", "_")
