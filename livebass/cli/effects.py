"""Options of `play`, `render` and `export` for the effects after the DI: compressor, amp, impulse response."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.messages import say
from livebass.cli.options import file_option, of_option, option, together
from livebass.cli.values import Number, Quantity
from livebass.rows.parts import Knobs
from livebass.rows.row import Row, rows
from livebass.rows.units import DIMENSIONS, quantity

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument

NAMES = (*rows(Knobs), "response", "response_level")
OPTIONS = " ".join(f"--{name.replace('_', '-')}" for name in NAMES)


def _kind(row: Row) -> click.ParamType:
    """Returns the type of this row's option: one of its choices, or a number within a preset's limits."""
    if len(row.choices) > 1:
        return click.Choice(row.choices)
    if row.kind in DIMENSIONS:
        return Quantity(row.kind, quantity(row.minimum, row.kind), quantity(row.maximum, row.kind))
    return Number(row.kind, *row.limits)


# The options that `Behind.from_options` reads.
effects_options = together(
    *(
        option(
            f"--{name.replace('_', '-')}",
            _kind(row),
            f"{row.meaning[0].upper()}{row.meaning[1:]}.  [default: the preset's]",
        )
        for name, row in rows(Knobs).items()
    ),
    file_option(
        "--response", "Impulse response of a cabinet or room, a sound file of up to 1 s.  [default: the preset's]"
    ),
    option(
        "--response-level",
        click.Choice(["normalized", "file"]),
        "normalized: keep the loudness of the bass; file: keep the level of the file.  "
        "[default: normalized with --response, else the preset's]",
    ),
)


@dataclass(frozen=True)
class EffectOptions:
    """The effects that the options put behind a bass; the preset decides the rest."""

    changes: dict[str, Any]
    remarks: set[str] = field(default_factory=set)  # already printed

    @classmethod
    def from_options(cls, options: dict[str, Any]) -> EffectOptions:
        """Takes the options of `effects_options` out of a command's `options`. Raises PresetError for a bad file."""
        given = {name: options.pop(name) for name in NAMES}
        if isinstance(given["response"], Path):
            from livebass.preset.response import load_response

            with of_option("--response"):
                given["response"] = load_response(given["response"])
        return cls({name: value for name, value in given.items() if value is not None})

    def put(self, bass: Instrument) -> Instrument:
        """Returns `bass` with these effects; reports which channel of a response plays."""
        changes = dict(self.changes)
        level = changes.pop("response_level", None)
        response = changes.get("response", bass.effects.response)
        if response and level:
            changes["response"] = response = replace(response, normalized=level == "normalized")
        elif level:
            say(f"{bass.name}: has no response; --response-level changes nothing")
        if response and response.remark and response.remark not in self.remarks:
            say(response.remark)
            self.remarks.add(response.remark)
        return replace(bass, effects=replace(bass.effects, **changes)) if changes else bass
