"""How long work reports on itself to its caller."""

from __future__ import annotations

from collections.abc import Callable

Say = Callable[[str], None]  # is given a line for people: what comes next, or what went wrong
Progress = Callable[[float], None]  # is given the fraction done, 0 to 1, ascending


def silent(_: str) -> None:
    """A `Say` that drops every line."""
