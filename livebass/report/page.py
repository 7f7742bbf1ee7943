"""HTML pages from templates of Jinja: the files in the directory `templates` of a room."""

from __future__ import annotations

from typing import Any


def page(room: str, template: str, **values: Any) -> str:
    """The text of `template` of the package `room`, filled with `values`, which are escaped. Needs Jinja2."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(room), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    return environment.get_template(template).render(values)
