"""The options that tune a bass, for `play`, `render` and `export`."""

from __future__ import annotations

import re
from collections.abc import Container
from typing import TYPE_CHECKING, Any

import click

from livebass.cli.options import together
from livebass.cli.values import Number, Parsed

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument

TUNING_KEYS = ("tuning", "capo", "a4", "temperament")  # the keys of a preset, too
FILE = re.compile(r"[/\\]|\.(scl|txt)$", re.IGNORECASE)  # names a temperament file


def _tuning(value: Any) -> Any:
    """A tuning, as given, checked: by name or by the notes of the open strings."""
    from livebass.preset.tuning import tuning_of

    tuning_of(value)
    return value


def _reference(value: Any) -> float:
    """The pitch of the A above middle C, Hz, from "432" or "432Hz"."""
    from livebass.preset.tuning import reference_of

    return reference_of(value)


class Temperament(click.ParamType):
    """A temperament: a name, comma-separated cents, or a file, which is converted to cents."""

    name = "temperament"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return "NAME|CENTS|FILE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        from livebass.preset.tuning import temperament_of, temperament_of_file

        try:
            if FILE.search(value):
                return ",".join(f"{each:.10g}" for each in temperament_of_file(value))
            temperament_of(value)
        except ValueError as error:
            self.fail(str(error) if FILE.search(value) else f"{value!r}: {error}", param, ctx)
        return str(value)


tuning_type = Parsed("tuning", _tuning, "NAME|NOTES")
tuning_options = together(
    click.option(
        "--tuning",
        type=tuning_type,
        help="Tuning: drop-d, eb, half-step-down ..., or the notes, lowest first: DADG, 'D1 A1 D2 G2'.",
    ),
    click.option("--capo", type=Number("fret", 0, 31, whole=True), help="Fret of a capo, 0 to 31."),
    click.option(
        "--a4", type=Parsed("hz", _reference), help="Pitch of the A above middle C.  [default: 440, or the preset's]"
    ),
    click.option(
        "--temperament",
        type=Temperament(),
        help="just, pythagorean, meantone, werckmeister, kirnberger, vallotti, equal; cents off equal for the 12 "
        "notes from C on, with commas; or a file with these or with a scale (.scl).",
    ),
)


GIVEN = re.compile(rf"(?P<file>.+?): (?P<key>{'|'.join(TUNING_KEYS)}) = (?P<value>.+?): (?P<why>.*)")  # of an error


def load_tuned(preset: str, tuning: dict[str, Any], given: Container[str] = TUNING_KEYS) -> Instrument:
    """Loads a preset with a tuning. Raises PresetError, which names the option if a `given` one is at fault."""
    from livebass.preset.load import load_preset
    from livebass.preset.source import PresetError

    try:
        return load_preset(preset, **tuning)
    except PresetError as error:
        found = GIVEN.fullmatch(str(error))
        if found is None or tuning.get(found["key"]) is None or found["key"] not in given:
            raise
        said = f"--{found['key']} {found['value']}: {found['why']}, in {found['file']}"
        raise PresetError(said) from None


def tuning_of_options(options: dict[str, Any]) -> dict[str, Any]:
    """Takes the tuning out of a command's options; returns the given values, as `load_preset` takes them."""
    given = given_tuning(options)
    for name in TUNING_KEYS:
        del options[name]
    return given


def given_tuning(options: dict[str, Any]) -> dict[str, Any]:
    """The tuning given among a command's options, which keep it."""
    return {name: options[name] for name in TUNING_KEYS if options[name] is not None}
