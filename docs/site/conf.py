"""Configuration of Sphinx. tools/site.py puts this folder and the repository's pages together, and builds the site."""

from __future__ import annotations

import ast
import dataclasses
import tomllib
from pathlib import Path
from typing import Any

import numpy.typing
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.pycode import ModuleAnalyzer

import livebass


class NDArray:
    """Stands for numpy's, whose types would appear as ndarray[tuple[Any, ...], dtype[float64]]."""

    def __class_getitem__(cls, kind: type) -> type:
        return type(f"NDArray[{getattr(kind, '__name__', kind)}]", (), {"__module__": "builtins"})


numpy.typing.NDArray = NDArray  # before the first module of livebass that names it
numpy.typing.ArrayLike = type("ArrayLike", (), {"__module__": "builtins"})

# This file is a copy in a scratch folder during a build: the package says where the project is.
PROJECT = tomllib.loads((Path(livebass.__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
URLS = PROJECT.get("urls", {})

project = PROJECT["name"]
version = release = livebass.__version__
author = PROJECT["authors"][0]["name"]
project_copyright = author  # without a year: the same sources give the same pages
language = "en"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.githubpages",
]
myst_heading_anchors = 4
smartquotes = False  # would turn --option into a dash
highlight_language = "none"  # indented code of the handbook is commands, TOML and text
suppress_warnings = ["myst.header"]  # README's sections have levels of their own

default_role = "py:obj"  # `name` in a docstring leads to that name if the site has it, and is code in any case
autosummary_generate = False
autodoc_typehints = "description"
autodoc_member_order = "bysource"
autodoc_typehints_description_target = "documented_params"
autoclass_content = "both"  # the class and its __init__
python_display_short_literal_types = True
python_use_unqualified_type_names = True
add_module_names = False
napoleon_numpy_docstring = False
napoleon_use_rtype = False
toc_object_entries_show_parents = "hide"

html_theme = "pydata_sphinx_theme"
html_title = "livebass"
html_favicon = "icon.svg"
html_baseurl = URLS.get("Site", "")
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_context = {"default_mode": "auto"}  # dark or light as the reader's system
html_theme_options = {
    "logo": {"text": "livebass", "image_light": "icon.svg", "image_dark": "icon.svg", "alt_text": ""},
    "navbar_align": "left",
    "navbar_end": ["theme-switcher", "navbar-icon-links"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
    "icon_links": [{"name": "Source", "url": URLS["Source"], "icon": "fa-solid fa-code"}] if "Source" in URLS else [],
}
html_sidebars = {"index": [], "page": [], "start": []}


def describe(app: Sphinx, what: str, name: str, obj: object, options: Any, lines: list[str]) -> None:
    """Gives a public value, such as QUALITIES, the comment of its definition, and keeps colons in texts of fields."""
    if what == "data":
        stub = ast.parse(Path(livebass.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
        own = name.removeprefix("livebass.")
        modules = [n.module for n in stub.body if isinstance(n, ast.ImportFrom) and own in {a.name for a in n.names}]
        lines[:] = ModuleAnalyzer.for_module(f"livebass.{modules[0]}").find_attr_docs()["", own]
    if what in ("attribute", "property") and ":" in "".join(lines[:1]):
        lines[:0] = ["..", ""]  # an empty comment: napoleon takes what stands before a colon in line 1 for a type


def shorten(app: Sphinx, what: str, name: str, obj: Any, *rest: object) -> tuple[str, str] | None:
    """Hides the fields in the head of a class that holds results or settings: they stand below it."""
    return ("", "") if dataclasses.is_dataclass(obj) else None


def set_dashes(app: Sphinx, doctree: nodes.document) -> None:
    """Sets dashes between arguments and their descriptions; anywhere else -- belongs to an option."""
    for text in list(doctree.findall(lambda node: isinstance(node, nodes.Text) and node == " -- ")):
        text.parent.replace(text, nodes.Text(" \N{EN DASH} "))


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-docstring", describe, priority=400)  # before napoleon
    app.connect("autodoc-process-signature", shorten)
    app.connect("doctree-read", set_dashes)
