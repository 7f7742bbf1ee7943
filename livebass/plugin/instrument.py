"""Instrument files, `.lbass`: a bass in numbers, for any audio rate and in each tier, as the plugins read it.

The kernels that read them are in kernels/bass/instrument.py, with the format; this file writes them, and reads them for
Python. A file holds what a preset says, worked out as far as it does not depend on the audio rate.
"""

from __future__ import annotations

import os
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebass.arrays import Floats
from livebass.engine.engine import frets_of, notes
from livebass.engine.prepare import Pool, bass_numbers, note_numbers, zeroed_lines
from livebass.files import Transaction
from livebass.kernels.bass.instrument import (
    COARSE,
    DAMAGED,
    FILE,
    FOREIGN,
    GOOD,
    LIVE,
    MAGIC,
    OTHER_VERSION,
    POOL,
    STUDIO,
    TIERS,
    WORD,
    check_file,
    checksum,
    fill_pool,
    measure_pool,
)
from livebass.kernels.string.preparing import DONE
from livebass.kernels.string.records import OPERATOR
from livebass.live import synth
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES, Quality
from livebass.parts import VERSION

ENDING = ".lbass"
REASONS = {
    FOREIGN: "not an instrument file",
    OTHER_VERSION: f"an instrument file of another version, this one reads {VERSION}: export it anew",
    DAMAGED: "a damaged instrument file: export it anew",
}


def tiers(instrument: Instrument) -> list[Quality]:
    """The qualities of an instrument file, by tier."""
    of = {LIVE: QUALITIES["live"], STUDIO: QUALITIES["studio"], COARSE: synth.COARSE}
    return [of[k].over(instrument.over_board) for k in range(TIERS)]


def instrument_file(instrument: Instrument) -> bytes:
    """The instrument file of a bass. Raises ValueError for a neck that cannot be played."""
    frets, qualities = frets_of(instrument), tiers(instrument)
    rows = [notes(instrument, quality, frets) for quality in qualities]
    given, numbers = note_numbers([note for row in rows[LIVE] for note in row], playable=True)
    modes = np.array([[note.modes for row in tier for note in row] for tier in rows], "<i8")
    head = np.zeros(1, FILE)
    head["magic"], head["version"] = MAGIC, VERSION
    head["name"][0] = _text(instrument.name, head["name"].shape[1])
    for i, string in enumerate(instrument.strings):
        head["string_names"][0, i] = _text(string.name, head["string_names"].shape[2])
    head["instrument"] = bass_numbers(instrument, qualities, frets)
    rest = given.tobytes() + modes.tobytes() + numbers.tobytes()
    head["words"] = (head.nbytes + len(rest)) // WORD + 1
    words = np.frombuffer(head.tobytes() + rest, "<i8")
    return words.tobytes() + int(checksum(words.ctypes.data, len(words))).to_bytes(WORD, "little")


def write_instrument(instrument: Instrument, path: Path, files: Transaction | None = None) -> None:
    """Writes the instrument file of a bass, whole or not at all; or as one of `files`.

    Raises ValueError, OutputError.
    """
    data = instrument_file(instrument)
    with Transaction() if files is None else nullcontext(files) as files:
        files.write(path, data)


@dataclass(frozen=True)
class InstrumentFile:
    """An instrument file in memory, accepted by `check_file`."""

    words: Floats  # (n,)

    @property
    def address(self) -> int:
        return int(self.words.ctypes.data)

    @property
    def head(self) -> np.void:
        """Its FILE record."""
        found: np.void = self.words.view(np.uint8)[: FILE.itemsize].view(FILE)[0]
        return found

    @property
    def numbers(self) -> NDArray[np.void]:
        """Its INSTRUMENT, (1,)."""
        return self.words.view(np.uint8)[: FILE.itemsize].view(FILE)["instrument"]

    @property
    def name(self) -> str:
        """The name of the bass."""
        return bytes(self.head["name"]).rstrip(b"\0").decode()

    @property
    def string_names(self) -> list[str]:
        """The names of its strings."""
        names = self.head["string_names"][: int(self.numbers["strings"][0])]
        return [bytes(name).rstrip(b"\0").decode() for name in names]

    def pool(self, tier: int, rate: int) -> Pool:
        """The operators of one tier at an audio rate (Hz). Raises ValueError for a rate that cannot be played."""
        pool = np.zeros(1, POOL)
        pool["file"], pool["tier"], pool["rate"] = self.address, tier, rate
        measure_pool(pool.ctypes.data)
        memory = zeroed_lines(int(pool["bytes"][0]) // WORD)
        pool["memory"] = memory.ctypes.data
        if fill_pool(pool.ctypes.data) != DONE:
            raise ValueError(f"{self.name}: cannot be played at {rate} Hz")
        strings, frets = (int(self.numbers[name][0]) for name in ("strings", "frets"))
        size = strings * (frets + 1) * OPERATOR.itemsize
        return Pool(memory.view(np.uint8)[:size].view(OPERATOR).reshape(strings, frets + 1), memory)


def read_instrument(path: str | os.PathLike[str]) -> InstrumentFile:
    """Reads an instrument file. Raises ValueError for one that is damaged, or none; OSError."""
    data = Path(path).read_bytes()
    words = zeroed_lines(-(-len(data) // WORD) + 1)
    words.view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
    state = int(check_file(words.ctypes.data, len(data)))
    if state != GOOD:
        raise ValueError(f"{path}: {REASONS[state]}")
    return InstrumentFile(words)


def _text(text: str, size: int) -> NDArray[np.uint8]:
    """`text` in UTF-8, cut to `size` - 1 bytes, with zeros behind."""
    data = text.encode()[: size - 1].decode(errors="ignore").encode()
    return np.frombuffer(data.ljust(size, b"\0"), np.uint8)
