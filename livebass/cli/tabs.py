"""Options of `play`, `render` and `export midi` for tablature."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.options import option, together
from livebass.cli.tuning import TUNING_KEYS
from livebass.cli.values import Number, Parsed
from livebass.rows.techniques import PARAMETER_ROWS

if TYPE_CHECKING:
    from livebass.tab.reading import TabRequest


def _bars(text: str) -> range:
    """Bars, counted from 1, such as 9-16 or 12, as a range from 0. Raises ValueError."""
    found = re.fullmatch(r"(\d{1,5})(?:-(\d{1,5}))?", text)
    first, last = (int(found[1]), int(found[2] or found[1])) if found else (0, 0)
    if not 1 <= first <= last:
        raise ValueError(f"must be numbers of bars such as 9-16, not {text}")
    return range(first - 1, last)


_ROW = PARAMETER_ROWS["dynamics"]
# The options that `TabOptions.from_options` reads.
tab_options = together(
    option("--track", str, "Track of a tablature to play.  [default: the bass]", metavar="NAME|NUMBER"),
    option("--bars", Parsed("[from-to]", _bars), "Bars of a tablature to play, such as 9-16, without repeats."),
    option(
        "--dynamics",
        Number("dB", _ROW.minimum, _ROW.maximum, unit="dB"),
        "Play a tablature softer or harder, -12 to 12 dB.",
    ),
)


@dataclass(frozen=True)
class TabOptions:
    """The choices that a command's options make in a tablature."""

    track: str | None
    bars: range | None  # from 0
    dynamics: float | None  # dB
    tuning: dict[str, Any]

    @classmethod
    def from_options(cls, options: dict[str, Any], sound: Mapping[str, Any]) -> TabOptions:
        """Takes its options out of a command's `options`; the tuning is that of its `sound` options."""
        given = {f.name: options.pop(f.name) for f in fields(cls) if f.name != "tuning"}
        return cls(**given, tuning={name: sound[name] for name in TUNING_KEYS})

    def request(self, preset: str | None) -> TabRequest:
        """The same for the reader, to play on `preset`, if given."""
        from livebass.tab.reading import TabRequest

        return TabRequest(self.track or "", self.bars, self.dynamics or 0.0, preset, self.tuning)

    def check_unused(self, path: Path | None) -> None:
        """Raises UsageError if any is given for another file, or without one."""
        problem = f"tablature, and {path} is not one that livebass reads" if path else "a --tab"
        for name in ("track", "bars", "dynamics"):
            if getattr(self, name) is not None:
                raise click.UsageError(f"--{name} is for {problem}")
