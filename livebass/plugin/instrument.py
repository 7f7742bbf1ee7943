"""Instrument files, `.lbass`: a bass in numbers, for any audio rate and in each tier, as the plugins read it.

A file is the image of a bass (engine/image.py); the kernels that read it are in kernels/bass, with the
format. It holds what a preset says, worked out as far as it does not depend on the audio rate.
"""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path

from livebass.engine.image import Image, image_bytes, image_of
from livebass.files import Transaction
from livebass.kernels.bass.check import DAMAGED, FOREIGN, GOOD, OTHER_VERSION, check_file
from livebass.kernels.bass.instrument import COARSE, LIVE, STUDIO, TIERS
from livebass.live import synth
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES, Quality
from livebass.parts import VERSION, WITH_EFFECTS, WITH_STROKES

ENDING = ".lbass"
REASONS = {
    FOREIGN: "not an instrument file",
    OTHER_VERSION: f"a file of another version, this one reads {VERSION}, {WITH_STROKES} and {WITH_EFFECTS}: "
    "export it anew",
    DAMAGED: "a damaged instrument file: export it anew",
}


def tiers(instrument: Instrument) -> list[Quality]:
    """The qualities of an instrument file, by tier."""
    of = {LIVE: QUALITIES["live"], STUDIO: QUALITIES["studio"], COARSE: synth.COARSE}
    return [of[k].for_contact(instrument.loss, instrument.over_board) for k in range(TIERS)]


def instrument_file(instrument: Instrument) -> bytes:
    """The instrument file of a bass. Raises ValueError for a neck that cannot be played."""
    return image_bytes(instrument, tiers(instrument))


def write_instrument(instrument: Instrument, path: Path, files: Transaction | None = None) -> None:
    """Writes the instrument file of a bass, whole or not at all; or as one of `files`.

    Raises ValueError, OutputError.
    """
    data = instrument_file(instrument)
    with Transaction() if files is None else nullcontext(files) as files:
        files.write(path, data)


def read_instrument(path: str | os.PathLike[str]) -> Image:
    """Reads an instrument file. Raises ValueError for one that is damaged, or none; OSError."""
    data = Path(path).read_bytes()
    found = image_of(data)
    state = int(check_file(found.address, len(data)))
    if state != GOOD:
        raise ValueError(f"{path}: {REASONS[state]}")
    return found
