"""A MIDI file's lines, parts and notes as the kernels find them (kernels/score/reading.py)."""

from __future__ import annotations

import functools
from collections.abc import Container
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.score import memory, reading
from livebass.kernels.score.choosing import ALL, AUTO, OF_CHANNEL
from livebass.kernels.score.records import REMARK
from livebass.score import tracknames
from livebass.score.sentences import TOO_LONG, TOO_MUCH
from livebass.score.smf import Smf, SmfError

Rows = NDArray[Any]  # of records


class Found:
    """The notes of a file at a rate (Hz), and those that are chosen. Raises SmfError if it is too long."""

    def __init__(self, smf: Smf, rate: int, take: bool) -> None:
        self._score = np.zeros(1, memory.SCORE)
        data = np.frombuffer(smf.data, np.uint8)
        self._kept = [smf.file, smf.rows, smf.tempo_rows, smf.exclusive_rows, data, _names(smf)]
        for name, rows in zip(("file", "messages", "tempos", "exclusives", "data", "names"), self._kept, strict=True):
            self._score[name] = rows.ctypes.data
        self._score["rate"], self._score["take"] = rate, take
        reading.measure_lines(self._address)
        self._give("memory", "bytes")
        error = reading.read_lines(self._address)
        if error == memory.TOO_LONG:
            raise SmfError(TOO_LONG.format(f"{int(self.row['last']) / rate / 3600:.1f}"))
        if error:
            raise SmfError(TOO_MUCH)
        self._give("more", "more_bytes")
        self.parts = int(reading.read_parts_of(self._address))

    @property
    def row(self) -> Any:
        """The SCORE."""
        return self._score[0]

    @property
    def _address(self) -> int:
        return int(self._score.ctypes.data)

    def _give(self, name: str, size: str) -> None:
        """Gives the score memory of the size that it needs."""
        room = np.empty(int(self.row[size]) // memory.WORD, np.int64)
        self._kept.append(room)
        self._score[name] = room.ctypes.data

    def choose(self, channel: str | int) -> None:
        """Chooses the notes to play: "auto", "all" but drums, or a channel's, from 1."""
        how = {"auto": AUTO, "all": ALL}.get(str(channel), OF_CHANNEL)
        reading.choose_notes(self._address, how, channel - 1 if isinstance(channel, int) else 0)

    @property
    def played(self) -> Rows:
        """The PLAYED messages of the chosen notes."""
        return self._rows("played", memory.PLAYED, "played_count").copy()

    @property
    def remarks(self) -> list[tuple[int, list[int]]]:
        """(code, numbers) of each remark about the file and the choice."""
        rows: list[tuple[int, list[int]]] = self._rows("remarks", REMARK, "remarks_count").tolist()
        return rows

    def _rows(self, name: str, kind: np.dtype[Any], count: str) -> Rows:
        """The rows of a kind at the address `name`."""
        size = int(self.row[count]) * kind.itemsize
        room = next(
            (m for m in self._kept if 0 <= int(self.row[name]) - m.ctypes.data <= m.nbytes - size),
            np.zeros(0, np.int64),
        )
        start = int(self.row[name]) - room.ctypes.data
        return room.view(np.uint8)[start : start + size].view(kind)

    def part(self, number: int, switches: Container[int] = ()) -> Any:
        """Part `number` of the last choice, LISTED. Keys in `switches` are not notes."""
        listed, table = np.zeros(1, memory.LISTED), switch_table(switches)
        reading.describe_part(self._address, number, table.ctypes.data, listed.ctypes.data)
        return listed[0]

    def frame(self, tick: int) -> int:
        """The frame of a tick."""
        return int(reading.frame_at_tick(self._address, tick))


def switch_table(switches: Container[int]) -> NDArray[np.uint8]:
    """(128,) 1 for each key in `switches`."""
    return np.array([key in switches for key in range(memory.KEYS)], np.uint8)


def _names(smf: Smf) -> NDArray[np.uint8]:
    """Tells what kinds the names of tracks and their channels name, (tracks, NAMES)."""
    table = np.zeros((len(smf.names), memory.NAMES), np.uint8)
    for track, (name, instrument) in enumerate(zip(smf.names, smf.instruments, strict=True)):
        table[track, memory.TRACK_NAME] = _says(name) | memory.BASS_INSTRUMENT * tracknames.is_bass(instrument)
    for (track, channel), name in smf.channel_names.items():
        if name:
            table[track, channel] = _says(name) | memory.NAMED
    return table


@functools.lru_cache(4096)
def _says(name: str) -> int:
    """Finds the kinds that a name names, as bits."""
    return (
        memory.IS_BASS * tracknames.is_bass(name)
        | memory.IS_OTHER * tracknames.is_other(name)
        | memory.IS_DRUMS * tracknames.is_drums(name)
    )  # fmt: skip
