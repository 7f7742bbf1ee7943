"""The plugin's C finds in thousands of MIDI files, whole or damaged, what Python finds: notes, parts, choice, words.

Names that are not UTF-8 are Latin-1 in the plugin, so Python reads them in the same way here.
"""

from __future__ import annotations

import ctypes as c
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.choices import BASSES, RATES, Bass
from support.picture import library
from support.songs import damaged, make
from support.structures import struct

from livebass.kernels.score.memory import PLAYED, PROGRAM
from livebass.plugin.systems import this_system
from livebass.score import smf
from livebass.score.low_keys import with_low_notes
from livebass.score.reading import ScoreError, parts_in, score_in
from livebass.score.sentences import NO_BASS

pytestmark = pytest.mark.skipif(this_system().ending != "so", reason="C by ctypes")
FILES = 1250  # of each kind
MAX_PARTS = 64
PLACE = Path("song.mid")


# What the C finds
Reading = struct(
    **dict.fromkeys(("count", "end", "left_out", "raised", "parts"), c.c_int64), line=c.c_char * 4096,
    text=(c.c_char * 400) * MAX_PARTS,
)  # fmt: skip
Keys = struct(lowest=c.c_int, highest=c.c_int, switches=c.c_uint8 * 128)  # lb_keys


def in_c(data: bytes, rate: int, bass: Bass) -> tuple[str, list[Any]]:
    """The line about a file, and what of it plays; nothing if it cannot."""
    found, rows = Reading(), np.zeros(1 << 16, PLAYED)
    keys = Keys(*bass.note_range, (c.c_uint8 * 128)(*(key in bass.switches for key in range(128))))
    good = library().read_song(
        data, len(data), rate, c.addressof(keys), rows.ctypes.data, len(rows), c.addressof(found)
    )  # fmt: skip
    line = found.line.decode()
    if not good:
        return line, []
    played = [row for row in rows[: found.count].tolist() if row[1] & 0xF0 != PROGRAM]
    parts = [found.text[k].value.decode() for k in range(min(found.parts, MAX_PARTS))]
    return line, [played, found.end, found.left_out, found.raised, parts]


def in_python(data: bytes, rate: int, bass: Bass) -> tuple[str | Sequence[str], list[Any]]:
    """The fault or the remarks, and what of the file plays."""
    try:
        score = score_in(data, PLACE, rate)
    except ScoreError as error:
        return str(error).removeprefix(f"{PLACE}: "), []
    played = with_low_notes(score.on_one_bass(), bass)
    rows = [(frame, *message) for frame, message in zip(played.frames.tolist(), played.messages.tolist(), strict=True)]
    remarks = [remark for remark in score.remarks if not remark.startswith("a text at ")]  # of a take's basses
    parts = [str(part) for part in parts_in(data, PLACE)]
    end = max(score.end_frame, score.file_end)
    return remarks, [rows, end, played.left_out, played.raised, parts[:MAX_PARTS]]


def decode(texts: Sequence[bytes]) -> list[str]:
    """The texts in UTF-8 or Latin-1."""

    def read(text: bytes) -> str:
        try:
            return text.decode()
        except UnicodeError:
            return text.decode("latin-1")

    return list(map(read, texts))


def test_thousands_of_files_give_what_they_give_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(smf, "decode", decode)
    faults, plays, shifted = 0, 0, 0
    for k, data in enumerate(file for seed in range(FILES) for file in (make(seed).data, damaged(seed))):
        rate, bass = RATES[k % len(RATES)], BASSES[k % len(BASSES)]
        line, found = in_c(data, rate, bass)
        said, wanted = in_python(data, rate, bass)
        assert found == wanted, k
        if isinstance(said, str):
            faults += 1
            foreign = line.startswith("not a Standard MIDI File") and "MIDI" in said
            short = line in (f"no bass notes: {NO_BASS}", "has no notes") and said.startswith(line)
            assert foreign or short or line == said, (k, line, said)
        else:
            plays += 1
            shifted += found[2] + found[3] > 0
            assert line.startswith("plays ") and line.endswith("; ".join(said)), (k, line, said)
    assert faults > 200 and plays > 500 and shifted > 20
