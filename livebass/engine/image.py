"""A bass as bytes: its numbers and notes, computed as far as they do not depend on the audio rate.

Everything that plays is made from an image, by the same kernels (kernels/bass). Python computes that of engine and
synth; kernels make that of plugins and page, from an instrument file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass.engine.prepare import SEEDS, Pool, Voice, bass_numbers, zeroed_lines
from livebass.kernels.bass.check import checksum
from livebass.kernels.bass.instrument import COARSE, FILE, MAGIC, TIERS, WORD
from livebass.kernels.bass.pool import POOL, fill_pool, measure_pool
from livebass.kernels.bass.records import BASS
from livebass.kernels.bass.setup import BUILDING, fill_bass, measure_bass
from livebass.kernels.player.performer import PERFORMER
from livebass.kernels.string.board import over_board
from livebass.kernels.string.frets import over_frets
from livebass.kernels.string.preparing import DONE, FROZEN, OVERDAMPED
from livebass.kernels.string.records import CONTACT, EVENT, OPERATOR, STRING
from livebass.kernels.string.reports import REPORTS
from livebass.model.bench import bench_of
from livebass.model.instrument import Instrument, Neck, speaking
from livebass.model.quality import Quality
from livebass.rows.arrays import Floats

WHY = {
    OVERDAMPED: "damping is above critical for a mode: lower the extra damping",
    FROZEN: "a mode stands still at this contact rate: take another one",
}


@dataclass(frozen=True)
class Image:
    """A bass as bytes, in the layout of kernels/bass/instrument.py."""

    words: Floats  # (n,)
    exact: bool = False  # all modes are float64, except in the last tier

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
        """The operators of one tier at an audio rate (Hz). Raises ValueError for an unplayable rate."""
        pool = np.zeros(1, POOL)
        pool["file"], pool["tier"], pool["rate"] = self.address, tier, rate
        pool["exact"] = self.exact and tier != COARSE
        measure_pool(pool.ctypes.data)
        memory = zeroed_lines(int(pool["bytes"][0]) // WORD)
        pool["memory"] = memory.ctypes.data
        state = int(fill_pool(pool.ctypes.data))
        if state != DONE:
            raise ValueError(f"{self.name}: cannot be played at {rate} Hz: {WHY[state]}")
        strings, frets = (int(self.numbers[name][0]) for name in ("strings", "frets"))
        size = strings * (frets + 1) * OPERATOR.itemsize
        return Pool(memory.view(np.uint8)[:size].view(OPERATOR).reshape(strings, frets + 1), memory)

    def bass(
        self, tier: int, rate: int, seed: int, pools: Sequence[Pool], play_string: int = 0, contacts: int = 0,
        events: int = 0,
    ) -> Bass:  # fmt: skip
        """Makes the bass, new and silent; `seed` is for the player's unevenness.

        pools: its operators at this `rate` (Hz), fine and, for strings under overload, coarse. play_string: address of
        the C function that runs strings ahead of the clock; 0: none. contacts, events: how many of the last ones each
        string keeps for inspection.
        """
        building = np.zeros(1, BUILDING)
        building["file"], building["tier"], building["rate"] = self.address, tier, rate
        building["seed"], building["ahead"], building["play_string"] = seed & SEEDS, play_string != 0, play_string
        building["operators"] = [[pools[k].records.ctypes.data for k in (0, -1)]]
        building["log_room"], building["report_room"] = contacts, events
        building["over_frets"], building["over_board"] = over_frets.address, over_board.address
        measure_bass(building.ctypes.data)
        memory = zeroed_lines(int(building["bytes"][0]) // WORD)
        building["memory"] = memory.ctypes.data
        fill_bass(building.ctypes.data)
        return Bass(memory)


@dataclass(frozen=True)
class Bass:
    """A playing bass, in the memory of its BASS."""

    memory: Floats

    @property
    def address(self) -> int:
        return int(self.memory.ctypes.data)

    @property
    def record(self) -> NDArray[np.void]:
        """Its BASS, (1,)."""
        return self._view(self.address, BASS)

    @property
    def effects(self) -> int:
        """The address of its EFFECTS."""
        return int(self.record["effects"][0])

    @property
    def performer(self) -> NDArray[np.void]:
        """Its PERFORMER, (1,)."""
        return self._view(self.record["performer"][0], PERFORMER)

    @property
    def voices(self) -> list[Voice]:
        """Its strings."""
        b, made = self.record[0], []
        for place in b["string"][: b["strings"]]:
            string = self._view(place, STRING)
            v = string["voice"][0]
            made.append(Voice(string, self._view(v["log"], CONTACT, int(v["log_room"]))))
        return made

    def _view(self, address: int, kind: np.dtype[Any], count: int = 1) -> NDArray[np.void]:
        """The records, (count,), at an address in this memory."""
        first = int(address) - self.address
        return self.memory.view(np.uint8)[first : first + count * kind.itemsize].view(kind)

    def reports(self, i: int) -> tuple[NDArray[np.void], NDArray[np.void]]:
        """The REPORTS of string `i`, (1,), and the events it received since it was still, (n,) EVENT, in order.

        Raises LookupError if it does not keep that many.
        """
        reports, events = self.ring_of_events(i)
        count = int(self.voices[i].record[0]["report_count"])
        if count > len(events):
            raise LookupError(f"string {i}: {count} events since it was still, {len(events)} of them kept")
        return reports, events[:count]

    def ring_of_events(self, i: int) -> tuple[NDArray[np.void], NDArray[np.void]]:
        """The REPORTS of string `i`, (1,), and the ring of events it received, (room,) EVENT."""
        v = self.voices[i].record[0]
        place, room = int(v["reports"]), int(v["report_room"])
        return self._view(place, REPORTS), self._view(place + REPORTS.itemsize, EVENT, room)


def image_bytes(instrument: Instrument, qualities: Sequence[Quality]) -> bytes:
    """The image of a bass, one tier per quality. Raises ValueError for an unplayable neck."""
    given, modes, numbers = bench_of(instrument, qualities).notes()
    hands, heights = hand_heights(instrument, given, len(numbers))
    response = instrument.effects.response
    head = np.zeros(1, FILE)
    head["magic"] = MAGIC
    put_head(instrument, qualities, head)
    head["instrument"]["hand"][0, : len(hands)] = hands
    lists = (given, modes, numbers, heights)
    rest = b"".join(each.tobytes() for each in lists) + (response.played if response else b"")
    head["words"] = (head.nbytes + len(rest)) // WORD + 1
    return seal(head.tobytes() + rest)


def put_head(instrument: Instrument, qualities: Sequence[Quality], to: NDArray[np.void]) -> None:
    """Puts the names of a bass and its strings, and its numbers, into a FILE or KEPT, (1,)."""
    to["name"][0] = _text(instrument.name, to["name"].shape[1])
    for i, string in enumerate(instrument.strings):
        to["string_names"][0, i] = _text(string.name, to["string_names"].shape[2])
    to["instrument"] = bass_numbers(instrument, qualities, instrument.frets)


def seal(data: bytes) -> bytes:
    """These bytes, whole words, followed by their checksum."""
    words = np.frombuffer(data, "<i8")
    return data + int(checksum(words.ctypes.data, len(words))).to_bytes(WORD, "little")


def hand_heights(instrument: Instrument, notes: NDArray[np.void], behind: int) -> tuple[NDArray[np.int64], Floats]:
    """Returns INSTRUMENT.hand, (strings,), of the heights that set the hand's unit of force, and all heights.

    notes: NOTE (strings, frets + 1); behind: the place after the existing numbers.
    """
    places, heights = np.zeros(len(instrument.strings), np.int64), list[float]()
    for i, found in enumerate(contact_heights(instrument, instrument.grazed)):
        if len(found) != notes[i, 0]["surface_count"] + notes[i, 0]["obstacles_count"]:
            raise ValueError(f"string {instrument.strings[i].name}: the neck that force 1 grazes has other contacts")
        places[i] = behind + len(heights) + 1
        heights.extend(found)
    return places, np.array(heights)


def contact_heights(instrument: Instrument, necks: Sequence[Neck]) -> list[list[float]]:
    """The heights (m) of the contacts under each open string, on these necks."""
    made = []
    for string, neck in zip(instrument.strings, necks, strict=False):
        s = speaking(string, neck, 0)
        made.append([h for _, h in s.surface] if neck.surface else list(s.contact_height))
    return made


def image_of(data: bytes) -> Image:
    """The image with these bytes, in memory aligned to a cache line."""
    words = zeroed_lines(-(-len(data) // WORD) + 1)
    words.view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
    return Image(words)


def image(instrument: Instrument, fine: Quality, coarse: Quality | None = None) -> Image:
    """The image of a bass in a `fine` quality, with a `coarse` one as last tier; None: the last tier is `fine`.

    Raises ValueError for an unplayable neck.
    """
    made = image_of(image_bytes(instrument, [fine] * (TIERS - 1) + [coarse or fine]))
    return replace(made, exact=fine.exact)


def _text(text: str, size: int) -> NDArray[np.uint8]:
    """`text` in UTF-8, cut to `size` - 1 bytes, padded with zeros."""
    data = text.encode()[: size - 1].decode(errors="ignore").encode()
    return np.frombuffer(data.ljust(size, b"\0"), np.uint8)
