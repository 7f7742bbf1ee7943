"""Instrument files, `.lbass`: a bass in numbers, for any audio rate and in each tier, as the plugins read it.

A file is the image of a bass (engine/image.py); kernels/bass defines the format and has the kernels that read it. It
holds everything that can be computed from a preset without knowing the audio rate.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from livebass.engine.image import image_bytes, sealed
from livebass.engine.prepare import is_heavy
from livebass.files import Transaction
from livebass.kernels.bass.change import BENCH_FILE, BENCH_MAGIC
from livebass.kernels.bass.instrument import COARSE, LIVE, STUDIO, TIERS, WORD
from livebass.live import synth
from livebass.model.bench import bench_of
from livebass.model.instrument import Instrument
from livebass.model.quality import ENDS_SOON, QUALITIES, Quality
from livebass.rows import TINY

ENDING = ".lbass"
BENCH_ENDING = ".bench"


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


def bench_file(instrument: Instrument, file: bytes) -> bytes:
    """Returns the bench file of a bass with this instrument `file` (kernels/bass/change.py)."""
    made = bench_of(instrument, tiers(instrument))
    head = np.zeros(1, BENCH_FILE)
    head["magic"], head["bytes"], head["of"] = BENCH_MAGIC, BENCH_FILE.itemsize, np.frombuffer(file[-WORD:], "<u8")
    head["numbers"] = len(made.numbers)
    for k, (least, qualities) in enumerate(tiers_by_loss(instrument)):
        head["from_loss"][0, k] = least
        for tier, quality in enumerate(qualities):
            head["modes"][0, k, tier], head["heavy"][0, k, tier] = quality.modes or 0, is_heavy(quality)
            head["contact_rate"][0, k, tier] = quality.contact_rate
    head["bench"] = made.record
    head["words"] = (head.nbytes + made.numbers.nbytes) // WORD + 1
    return sealed(head.tobytes() + made.numbers.tobytes())


def write_instrument(instrument: Instrument, path: Path, files: Transaction | None = None) -> None:
    """Writes a bass's instrument file and bench file, whole or not at all; or as part of the transaction `files`.

    Raises ValueError, OutputError.
    """
    data = instrument_file(instrument)
    with Transaction() if files is None else nullcontext(files) as files:
        files.write(path, data)
        files.write(path.with_suffix(BENCH_ENDING), bench_file(instrument, data))
