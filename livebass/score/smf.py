"""Standard MIDI Files, as the kernels read them: messages with ticks, names and remarks.

An error names the track and the byte. Kernels find the rows (kernels/score/smf.py); here they get their words and the
texts their letters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.files.kinds import HEAD, SCORES, TEXT_TAB, kind_of, kind_of_name
from livebass.kernels.score import records
from livebass.kernels.score.records import MARKED, NO_CHANNEL, SMF
from livebass.kernels.score.smf import FOREIGN, MARK, META_INSTRUMENT, META_TEXT, META_TRACK_NAME, fill_smf, measure_smf
from livebass.score.sentences import ERRORS, REMARKS, sentence
from livebass.score.tracknames import decode

__all__ = ["MARK", "Smf", "SmfError", "parse_smf"]
LONGEST_NAME = 40  # characters of a track's name that are kept
MAX_MARKS = 500_000  # texts of livebass, for the basses and strokes of a take
WORD = 8  # bytes


class SmfError(ValueError):
    """Bytes are not a Standard MIDI File, or not a playable one. The message names the place."""


@dataclass(frozen=True, eq=False)
class Smf:
    """The content of a Standard MIDI File. Ticks count from the start of the file."""

    data: bytes  # of the whole file; EXCLUSIVE rows tell places in it
    file: NDArray[np.void]  # (1,) FILE
    rows: NDArray[np.void]  # (n,) MESSAGE, by tick, track and place in the track
    tempo_rows: NDArray[np.void]  # (n,) TEMPO by tick
    meter_rows: NDArray[np.void]  # (n,) METER by tick
    exclusive_rows: NDArray[np.void]  # (n,) EXCLUSIVE by tick
    names: tuple[str, ...]  # of the tracks; "": it has none
    instruments: tuple[str, ...]  # the tracks' instruments by name; "": it has none
    channel_names: Mapping[tuple[int, int], str]  # by (track, channel), both from 0, after a channel prefix
    warnings: tuple[str, ...]  # a line each, about harmless damage
    texts: frozenset[str]  # at tick 0, beside the names
    marks: tuple[tuple[int, str], ...]  # (tick, text) of texts that begin with MARK, by tick


def parse_smf(data: bytes, name: str = "") -> Smf:
    """Parses a Standard MIDI File. Raises SmfError, with track and byte, for any other or too damaged bytes.

    name: of the file, for an error about other bytes.
    """
    file, rows = _read(data, name)
    texts = rows[records.TEXTS]
    named = texts[np.isin(texts["kind"], (META_TRACK_NAME, META_INSTRUMENT))]
    at_begin = texts[texts["kind"] == META_TEXT]
    marks = texts[texts["kind"] == MARKED]
    if len(marks) > MAX_MARKS:
        raise SmfError(f"has {len(marks)} texts of livebass, more than {MAX_MARKS}")
    shown = [_printable(text) for text in decode([_bytes(data, row) for row in (*named, *at_begin)])]
    called = {
        (int(row["track"]), int(row["channel"]), int(row["kind"])): text
        for row, text in zip(named, shown, strict=False)  # the other texts follow
    }
    titles, instruments = (
        tuple(called.get((track, NO_CHANNEL, kind), "") for track in range(int(file["tracks"][0])))
        for kind in (META_TRACK_NAME, META_INSTRUMENT)
    )
    return Smf(
        data=data,
        file=file,
        rows=rows[records.MESSAGES],
        tempo_rows=rows[records.TEMPOS],
        meter_rows=rows[records.METERS],
        exclusive_rows=rows[records.EXCLUSIVES],
        names=tuple(title or instrument for title, instrument in zip(titles, instruments, strict=True)),
        instruments=instruments,
        channel_names={(track, channel): text for (track, channel, _), text in called.items() if channel != NO_CHANNEL},
        warnings=tuple(sentence(REMARKS[code], numbers) for code, numbers in rows[records.REMARKS].tolist()),
        texts=frozenset(shown[len(named) :]),
        marks=tuple(
            (int(row["tick"]), _bytes(data, row).decode(errors="replace"))
            for row in marks[np.argsort(marks["tick"], kind="stable")]
        ),
    )


def _read(data: bytes, name: str) -> tuple[NDArray[np.void], list[NDArray[np.void]]]:
    """(1,) FILE of a file, and its rows of each kind. Raises SmfError."""
    given = np.frombuffer(data, np.uint8)
    made: NDArray[np.void] = np.zeros(1, SMF)
    smf, address = made[0], made.ctypes.data
    smf["data"], smf["size"] = given.ctypes.data, len(given)
    error = measure_smf(address)
    if error == FOREIGN:
        raise SmfError(_other_kind(data[smf["header"] : smf["header"] + smf["length"]], name))
    if error:
        raise SmfError(sentence(ERRORS[error], smf["file"]["numbers"].tolist()))
    memory = np.empty(int(smf["room"]) // WORD, np.int64)
    smf["memory"] = memory.ctypes.data
    fill_smf(address)
    begins = smf["rows"] - memory.ctypes.data
    return made["file"], [
        memory.view(np.uint8)[at : at + count * row.itemsize].view(row)
        for at, count, row in zip(begins.tolist(), smf["count"].tolist(), records.ROWS.values(), strict=True)
    ]


def _bytes(data: bytes, row: Any) -> bytes:
    """The bytes of a text."""
    return data[row["at"] : row["at"] + row["size"]]


def _other_kind(data: bytes, name: str) -> str:
    """Names a file that is not MIDI, and says what to do."""
    kind = kind_of(data[:HEAD]) or kind_of_name(name)
    if kind is None:
        return ERRORS[FOREIGN]
    if kind == TEXT_TAB:
        return f"is {kind}, which does not tell the lengths of its notes: livebass reads Guitar Pro and MusicXML files"
    if kind in SCORES:
        return f"is {kind}, not a MIDI file: export MIDI or MusicXML from the program that wrote it"
    return f"is {kind}, not a MIDI file"


def _printable(text: str) -> str:
    """The printable text of a meta event, cut to LONGEST_NAME."""
    text = "".join(c if c.isprintable() else " " for c in text).strip()
    return text if len(text) <= LONGEST_NAME else f"{text[: LONGEST_NAME - 3]}..."
