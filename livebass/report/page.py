"""HTML pages from Jinja templates, which are files in the directory `templates` of a room."""

from __future__ import annotations

from typing import Any


def html_page(room: str, template: str, **values: Any) -> str:
    """Fill the template of that name in the package `room` with `values`, which are escaped. Needs Jinja2."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(room), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    return environment.get_template(template).render(values)
