"""Instrument files, `.lbass`: a bass in named numbers, as plugins and page read it and keep it in their states.

kernels/bass/kept.py defines the format, and kernels/bass/change.py makes the image of a bass from it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from livebass import __version__
from livebass.engine.image import contact_heights, image_bytes, put_head, seal
from livebass.engine.prepare import is_heavy
from livebass.files.whole import Transaction
from livebass.kernels.bass.instrument import COARSE, LIVE, STUDIO, TIERS, WORD
from livebass.kernels.bass.kept import FIELDS, FORMAT, HEAD, KEPT, KEPT_MAGIC, LISTS_KEPT, name_words
from livebass.live import synth
from livebass.model.bench import bench_of
from livebass.model.instrument import Instrument
from livebass.model.quality import ENDS_SOON, QUALITIES, Quality
from livebass.rows.row import TINY

ENDING = ".lbass"
OLD_ENDING = ".bench"  # of files that older versions wrote beside them


def tiers(instrument: Instrument) -> list[Quality]:
    """Returns the qualities of an instrument file, by tier."""
    of = {LIVE: QUALITIES["live"], STUDIO: QUALITIES["studio"], COARSE: synth.COARSE}
    return [of[k].for_contact(instrument.loss, instrument.over_board) for k in range(TIERS)]


def image_file(instrument: Instrument) -> bytes:
    """Returns the image that kernels make of a bass's instrument file. Raises ValueError as `instrument_file`."""
    return image_bytes(instrument, tiers(instrument))


def instrument_file(instrument: Instrument) -> bytes:
    """Returns a bass's instrument file. Raises ValueError for a neck that cannot be played."""
    image_file(instrument)
    heights = contact_heights(instrument, instrument.grazed or instrument.necks)
    made, kept, first = bench_of(instrument, tiers(instrument)), np.zeros(1, KEPT), 1
    put_head(instrument, tiers(instrument), kept)
    for i, of in enumerate(heights):
        kept["instrument"]["hand"][0, i], kept["hand_count"][0, i] = first, len(of)
        first += len(of)
    kept["hand_stays"] = bool(instrument.grazed)
    for k, (minimum, qualities) in enumerate(tiers_by_loss(instrument)):
        kept["from_loss"][0, k] = minimum
        for tier, quality in enumerate(qualities):
            kept["modes"][0, k, tier], kept["heavy"][0, k, tier] = quality.modes or 0, is_heavy(quality)
            kept["contact_rate"][0, k, tier] = quality.contact_rate
    kept["bench"] = made.record
    response = instrument.effects.response
    lists = (made.numbers.tobytes(), np.concatenate(heights).tobytes(), response.played if response else b"")
    words = kept.view(np.int64)
    return file_of(
        {name: words[places].tobytes() for name, places in FIELDS.items()} | dict(zip(LISTS_KEPT, lists, strict=True))
    )


def image_digest(instrument: Instrument) -> str:
    """Returns a digest of a bass: the same in every version that plays the bass alike, unlike that of its file."""
    return hashlib.sha256(image_file(instrument)).hexdigest()[:8]


def file_of(fields: Mapping[str, bytes], version: str = __version__, format: int = FORMAT) -> bytes:
    """Returns the instrument file with these fields, by name. It leaves out the zeros at the end of a value."""
    body = b""
    for name, value in fields.items():
        kept = value.rstrip(b"\0")
        for part in (name_words(name), kept + bytes(-len(kept) % WORD)):
            body += (len(part) // WORD).to_bytes(WORD, "little") + part
    head = np.zeros(1, HEAD)
    head["magic"], head["format"], head["fields"] = KEPT_MAGIC, format, len(fields)
    head["made"].view("S32")[0] = version.encode()
    head["words"] = (head.nbytes + len(body)) // WORD + 1
    return seal(head.tobytes() + body)


def tiers_by_loss(instrument: Instrument) -> list[tuple[float, list[Quality]]]:
    """Returns a bass's qualities by fret loss: (least loss in s/m, ascending; qualities from there on)."""
    made = []
    for minimum, loss in ((0.0, 0.0), (TINY, ENDS_SOON / 2), (ENDS_SOON, 2 * ENDS_SOON)):
        necks = tuple(replace(neck, contact_loss=loss * neck.pressing) for neck in instrument.necks)
        made.append((minimum, tiers(replace(instrument, necks=necks))))
    return made


def write_instrument(instrument: Instrument, path: Path, files: Transaction | None = None) -> None:
    """Writes a bass's instrument file, whole or not at all; or as part of the transaction `files`.

    Raises ValueError, OutputError.
    """
    data = instrument_file(instrument)
    with Transaction() if files is None else nullcontext(files) as files:
        files.write(path, data)
