"""A plugin of another version: one parameter more in the middle, and one by another name."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from livebass.live.parameters import PARAMETERS
from livebass.plugin import header
from livebass.rows.techniques import PARAMETER_ROWS, SLIDER_ROWS, event
from support import picture

EXTRA = "growl"  # before the parameter that here is called ...
HERE, THERE = "wear", "string_age"  # ... and there
AT = PARAMETER_ROWS[HERE].number
MORE = replace(PARAMETER_ROWS["vibrato"], number=AT, symbol=EXTRA, name="Growl")


def number(symbol: str) -> int:
    """The number of a parameter there."""
    here = {EXTRA: AT, THERE: AT + 1}
    return here[symbol] if symbol in here else moved_parameter(PARAMETER_ROWS[symbol]).number


def moved_parameter(row: Any) -> Any:
    """A parameter as it is there."""
    symbol = THERE if row.symbol == HERE else row.symbol
    return replace(row, number=row.number + (row.number >= AT), symbol=symbol)


@contextmanager
def there() -> Iterator[None]:
    """The header of that version, while the block lasts."""
    rows = {row.symbol: row for row in map(moved_parameter, PARAMETERS)}
    events = {moved_parameter(row).symbol: event(row) for row in PARAMETERS}
    sliders = [replace(row, parameter=moved_parameter(row.parameter)) for row in SLIDER_ROWS.values()]
    with pytest.MonkeyPatch.context() as patch:
        before, after = [rows[moved_parameter(row).symbol] for row in PARAMETERS[:AT]], list(rows.values())[AT:]
        patch.setattr(header, "PARAMETERS", (*before, MORE, *after))
        patch.setattr(header, "PARAMETER_ROWS", rows)
        patch.setattr(header, "SLIDER_ROWS", {row.parameter.symbol: row for row in sliders})
        patch.setattr(header, "RENAMED", {HERE: THERE})
        patch.setattr(header, "event", lambda row: events.get(row.symbol))
        yield


@cache
def library() -> Any:
    """The C of its instance. Nothing else in it depends on the name."""
    with there():
        return picture.load_product("another-version", "-O1", "-w", f"-DLB_{HERE.upper()}=LB_{THERE.upper()}")


class Host(picture.Host):
    """An instance of that version."""

    def number(self, symbol: str) -> int:
        return number(symbol)
