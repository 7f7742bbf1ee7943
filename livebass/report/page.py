"""HTML pages from Jinja templates, files in the directory `templates` of a room."""

from __future__ import annotations

from importlib import resources
from typing import Any


def html_page(room: str, template: str, **values: Any) -> str:
    """Fills the template of that name in the package `room` with escaped `values`. Needs Jinja2.

    `style` is the style sheet of all pages.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(room), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    return environment.get_template(template).render(values, style=style())


def style() -> str:
    """The style sheet of the pages."""
    return (resources.files("livebass.report") / "style.css").read_text(encoding="utf-8")
