"""The options that tune a bass, for `play`, `render` and `export`."""

from __future__ import annotations

import re
from collections.abc import Container
from typing import TYPE_CHECKING, Any

from livebass.cli.options import option, together
from livebass.cli.values import Number, Parsed, of_value

if TYPE_CHECKING:
    from livebass.model.instrument import Instrument

TUNING_KEYS = ("tuning", "capo", "a4", "temperament")  # the keys of a preset, too
FILE = re.compile(r"[/\\]|\.(scl|kbm|txt)$", re.IGNORECASE)  # names a temperament file


def _tuning(text: str) -> str:
    """A tuning, as given, checked: by name or by the notes of the open strings."""
    from livebass.preset.tuning import tuning_of

    of_value(tuning_of, text)
    return text


def _reference(text: str) -> float:
    """The pitch of the A above middle C, Hz, from "432" or "432Hz"."""
    from livebass.preset.tuning import reference_of

    return float(of_value(reference_of, text))


def _temperament(text: str) -> str:
    """A temperament: a name, comma-separated cents, or a file, which is converted to cents."""
    from livebass.preset.tuning import temperament_of, temperament_of_file

    if FILE.search(text):
        return ",".join(f"{each:.10g}" for each in temperament_of_file(text))
    of_value(temperament_of, text)
    return text


tuning_type = Parsed("name|notes", _tuning)
tuning_options = together(
    option(
        "--tuning",
        tuning_type,
        "Tuning: drop-d, eb, half-step-down ..., or the notes, lowest first: DADG, 'D1 A1 D2 G2'.",
    ),
    option("--capo", Number("fret", 0, 31, whole=True), "Fret of a capo, 0 to 31."),
    option("--a4", Parsed("hz", _reference), "Pitch of the A above middle C.  [default: 440, or the preset's]"),
    option(
        "--temperament",
        Parsed("name|cents|file", _temperament),
        "equal, just, pythagorean, meantone, werckmeister, kirnberger or vallotti; or 12 numbers with commas, the "
        "cents off equal from C on; or a file: these numbers, a scale (.scl), or scale.scl,mapping.kbm.",
    ),
)


GIVEN = re.compile(rf"(?P<file>.+?): (?P<key>{'|'.join(TUNING_KEYS)})(?: =)?(?P<why> .*)")  # parts of an error


def load_tuned(preset: str, tuning: dict[str, Any], given: Container[str] = TUNING_KEYS, text: str = "") -> Instrument:
    """Loads a preset with a tuning; `text`: what its file held. Raises PresetError.

    The error names the option if a `given` one is at fault.
    """
    from livebass.preset.load import load_kept, load_preset
    from livebass.preset.source import PresetError

    try:
        return load_kept(preset, text, **tuning) if text else load_preset(preset, **tuning)
    except PresetError as error:
        found = GIVEN.fullmatch(str(error))
        if found is None or tuning.get(found["key"]) is None or found["key"] not in given:
            raise
        raise PresetError(f"--{found['key']}{found['why']}, in {found['file']}") from None


def tuning_of_options(options: dict[str, Any]) -> dict[str, Any]:
    """Takes the tuning out of a command's options; returns the given values, as `load_preset` takes them."""
    given = given_tuning(options)
    for name in TUNING_KEYS:
        del options[name]
    return given


def given_tuning(options: dict[str, Any]) -> dict[str, Any]:
    """The tuning given among a command's options, which keep it."""
    return {name: options[name] for name in TUNING_KEYS if options[name] is not None}
