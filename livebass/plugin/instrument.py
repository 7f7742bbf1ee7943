"""Instrument files, `.lbass`: a bass in numbers, for any audio rate and in each tier, as the plugins read it.

A file is the image of a bass (engine/image.py); kernels/bass defines the format and has the kernels that read it. It
holds everything that can be computed from a preset without knowing the audio rate.
"""

from __future__ import annotations

import os
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from livebass.engine.image import (
    Image,
    added_bytes,
    all_strokes,
    image_bytes,
    image_of,
    sealed,
)
from livebass.engine.prepare import is_heavy
from livebass.files import Transaction
from livebass.kernels.bass.change import BENCH_FILE, BENCH_MAGIC
from livebass.kernels.bass.check import DAMAGED, FOREIGN, GOOD, OTHER_VERSION, check_file
from livebass.kernels.bass.instrument import COARSE, LIVE, STUDIO, TIERS, WORD
from livebass.live import synth
from livebass.model.bench import bench_of
from livebass.model.instrument import Instrument
from livebass.model.quality import ENDS_SOON, QUALITIES, Quality
from livebass.parts import VERSION, WITH_EFFECTS, WITH_STROKES
from livebass.rows import TINY

ENDING = ".lbass"
BENCH_ENDING = ".bench"
REASONS = {
    FOREIGN: "not an instrument file",
    OTHER_VERSION: f"a file of another version, this one reads {VERSION}, {WITH_STROKES} and {WITH_EFFECTS}: "
    "export it anew",
    DAMAGED: "a damaged instrument file: export it anew",
}


def tiers(instrument: Instrument) -> list[Quality]:
    """Returns the qualities of an instrument file, by tier."""
    of = {LIVE: QUALITIES["live"], STUDIO: QUALITIES["studio"], COARSE: synth.COARSE}
    return [of[k].for_contact(instrument.loss, instrument.over_board) for k in range(TIERS)]


def instrument_file(instrument: Instrument) -> bytes:
    """Returns a bass's instrument file. Raises ValueError for a neck that cannot be played."""
    return image_bytes(instrument, tiers(instrument))


def tiers_by_loss(instrument: Instrument) -> list[tuple[float, list[Quality]]]:
    """Returns a bass's qualities by fret loss: (least loss in s/m, ascending; qualities from there on)."""
    made = []
    for least, loss in ((0.0, 0.0), (TINY, ENDS_SOON / 2), (ENDS_SOON, 2 * ENDS_SOON)):
        necks = tuple(replace(neck, contact_loss=loss * neck.pressing) for neck in instrument.necks)
        made.append((least, tiers(replace(instrument, necks=necks))))
    return made


def all_that_some_have(instrument: Instrument) -> bytes:
    """Returns the strokes and effects of a file whose hand measures its force on another neck."""
    hands = np.zeros(len(instrument.strings), np.int64)
    return all_strokes(instrument.player).tobytes() + added_bytes(instrument.effects, hands)


def bench_file(instrument: Instrument, file: bytes) -> bytes:
    """Returns the bench file of a bass with this instrument `file` (kernels/bass/change.py)."""
    made, rest = bench_of(instrument, tiers(instrument)), all_that_some_have(instrument)
    head = np.zeros(1, BENCH_FILE)
    head["magic"], head["bytes"], head["of"] = BENCH_MAGIC, BENCH_FILE.itemsize, np.frombuffer(file[-WORD:], "<u8")
    head["numbers"], head["rest"] = len(made.numbers), len(rest) // WORD
    for k, (least, qualities) in enumerate(tiers_by_loss(instrument)):
        head["from_loss"][0, k] = least
        for tier, quality in enumerate(qualities):
            head["modes"][0, k, tier], head["heavy"][0, k, tier] = quality.modes or 0, is_heavy(quality)
            head["contact_rate"][0, k, tier] = quality.contact_rate
    head["bench"] = made.record
    head["words"] = (head.nbytes + made.numbers.nbytes + len(rest)) // WORD + 1
    return sealed(head.tobytes() + made.numbers.tobytes() + rest)


def write_instrument(instrument: Instrument, path: Path, files: Transaction | None = None) -> None:
    """Writes a bass's instrument file and bench file, whole or not at all; or as part of the transaction `files`.

    Raises ValueError, OutputError.
    """
    data = instrument_file(instrument)
    with Transaction() if files is None else nullcontext(files) as files:
        files.write(path, data)
        files.write(path.with_suffix(BENCH_ENDING), bench_file(instrument, data))


def read_instrument(path: str | os.PathLike[str]) -> Image:
    """Reads an instrument file. Raises ValueError if it is damaged or of another kind; OSError."""
    data = Path(path).read_bytes()
    found = image_of(data)
    state = int(check_file(found.address, len(data)))
    if state != GOOD:
        raise ValueError(f"{path}: {REASONS[state]}")
    return found
