"""Options of `play`, `render` and `export` for a preset's player: keys, velocity curve, pitch wheel, noise."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.effects import NAMES as EFFECTS
from livebass.cli.effects import EffectOptions
from livebass.cli.options import flag, of_option, option, together
from livebass.cli.tuning import TUNING_KEYS, load_tuned, tuning_of_options
from livebass.cli.values import Parsed

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument

NAMES = ("keys", "velocity_curve", "wheel")


def _curve(text: str) -> Any:
    """A velocity curve: a name, an exponent, or points such as 1:1,64:90,127:127. Raises ValueError."""
    from livebass.preset.keys import KEYS, check_value, limits_of

    key = next(key for key in KEYS if (key.section, key.name) == ("player", "velocity_curve"))
    raw: Any = text
    if ":" in text:
        raw = [[_number(part) for part in point.split(":")] for point in text.split(",")]
    elif re.match(r"[\d.]", text):
        raw = _number(text)
    try:
        return check_value(key, raw)
    except ValueError:
        rule = limits_of(key).replace("[[1, 1], [64, 90], [127, 127]]", "1:1,64:90,127:127")
        raise ValueError(f"must be {rule}, not {text!r}") from None


def _number(text: str) -> float | str:
    """`text` as a number if it is one, else the text."""
    try:
        return float(text)
    except ValueError:
        return text


velocity_curve_option = option(
    "--velocity-curve",
    Parsed("curve", _curve),
    "Velocity curve: soft, linear, hard, an exponent, or points such as 1:1,64:90,127:127.  [default: linear]",
)


# The options that `Hands.from_options` reads.
hands_options = together(
    option(
        "--keys",
        str,
        "Key map for techniques: modo, modo-12, or your own file; see `livebass presets keymap`.  [default: modo]",
        metavar="NAME|FILE",
    ),
    velocity_curve_option,
    option("--wheel", click.Choice(["bend", "slide"]), "What the pitch wheel does.  [default: bend]"),
    flag("--no-noise", "Turn off the noise of hands and electronics: skin, pick, knock, floor, hum and squeak."),
)


@dataclass(frozen=True)
class Hands:
    """The changes that the options make to a bass's player; the preset decides the rest."""

    changes: dict[str, Any]

    @classmethod
    def from_options(cls, options: dict[str, Any]) -> Hands:
        """Takes the options of `hands_options` out of a command's `options`. Raises PresetError for a bad key map."""
        given = {name: options.pop(name) for name in NAMES}
        if given["keys"] is not None:
            from livebass.preset.keymap import load_key_map

            with of_option("--keys"):
                given["keys"] = load_key_map(given["keys"])
        changes = {name: value for name, value in given.items() if value is not None}
        if options.pop("no_noise"):
            from livebass.rows.parts import SILENT

            changes |= SILENT
        return cls(changes)

    def play(self, bass: Instrument) -> Instrument:
        """Returns `bass` in these hands."""
        return replace(bass, player=replace(bass.player, **self.changes)) if self.changes else bass


SOUND = (*TUNING_KEYS, *NAMES, "no_noise", *EFFECTS)  # options that change a bass, by Python name


class Loader:
    """Loads presets with the hands, tuning and effects of a command's options."""

    def __init__(self, options: dict[str, Any]) -> None:
        """Takes these options out of `options`. Raises PresetError for a bad file."""
        self._requested = {name: options.pop(name) for name in SOUND}
        self._default = self._with({})

    def __call__(self, preset: str, given: Mapping[str, Any] | None = None, text: str = "") -> Instrument:
        """Loads a preset; `given` options apply where the command has none. Raises PresetError.

        `text`: what the preset's file held, in place of what it holds.
        """
        return (self._with(given) if given else self._default)(preset, text)

    def _with(self, given: Mapping[str, Any]) -> Callable[[str, str], Instrument]:
        """Return a function that loads presets with these options added."""
        options = {name: given.get(name, v) if v is None or v is False else v for name, v in self._requested.items()}
        hands, tuning, behind = (
            Hands.from_options(options),
            tuning_of_options(options),
            EffectOptions.from_options(options),
        )
        return lambda preset, text: behind.put(hands.play(load_tuned(preset, tuning, text=text)))
