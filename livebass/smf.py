"""Standard MIDI Files: from bytes to mido's messages with ticks.

mido knows messages; chunks, lengths and running status are read here, as its own reader stops at what the format allows
(time in SMPTE frames, unknown chunks, escapes, odd texts and key signatures), and does not say at which byte of which
track a file is damaged. Errors here do. A header that promises more tracks than there are, and a last track that claims
to go on beyond the file, are read as far as they go, with a warning.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from mido import Message

SMPTE_RATES = {24: (24, 1), 25: (25, 1), 29: (30_000, 1001), 30: (30, 1)}  # frames/s as a fraction
META_TEXT, META_TRACK_NAME, META_INSTRUMENT, META_END, META_TEMPO = 0x01, 0x03, 0x04, 0x2F, 0x51
MARK = "livebass plays "  # begins a text of a take that names its bass
LONGEST_NAME = 40  # characters of a track's name that are kept
CHUNK_HEAD = 8  # bytes: name and length


class SmfError(ValueError):
    """Bytes that are not a Standard MIDI File, or not one that can be played. The message names the place."""


@dataclass(frozen=True)
class Smf:
    """The content of a Standard MIDI File. Ticks count from the start of the file."""

    ticks_per_quarter: int  # 0 if time is in SMPTE frames
    ticks_per_second: tuple[int, int]  # numerator, denominator; (0, 1) if time is in quarter notes
    messages: tuple[
        tuple[int, Message, int], ...
    ]  # (tick, message, track from 0) by tick, track and place in the track
    tempos: tuple[tuple[int, int], ...]  # (tick, us per quarter note) by tick
    names: tuple[str, ...]  # of the tracks; "": it has none
    end_tick: int  # of the track that ends last
    warnings: tuple[str, ...]  # each a line about damage that did not matter
    texts: frozenset[str] = frozenset()  # at tick 0, beside the names
    marks: tuple[tuple[int, str], ...] = ()  # (tick, text) of those that begin with MARK, by tick


@lru_cache(maxsize=1 << 16)
def message(data: bytes) -> Message:
    """The channel message of these bytes. One object stands for all that are equal: leave it as it is."""
    return Message.from_bytes(data)


class _Bytes:
    """A cursor over `data` up to `end`. Its errors name `place` and the byte."""

    def __init__(self, data: bytes, start: int, end: int, place: str) -> None:
        self.data, self.at, self.end, self.place = data, start, end, place

    def fail(self, what: str, at: int | None = None) -> SmfError:
        return SmfError(f"{self.place}, byte {self.at if at is None else at}: {what}")

    def take(self, count: int, what: str) -> bytes:
        """Reads `count` bytes; `what` they are is for the error."""
        if self.at + count > self.end:
            left = self.end - self.at
            raise self.fail(f"{what} of {count} bytes, {left} left: the file is truncated or damaged")
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self, what: str) -> int:
        """Reads a variable-length quantity, of at most 4 bytes."""
        start, value = self.at, 0
        for _ in range(4):
            byte = self.take(1, what)[0]
            value = value << 7 | byte & 0x7F
            if byte < 0x80:
                return value
        raise self.fail(f"{what} longer than the 4 bytes allowed", start)


class _Tracks:
    """The tracks as far as they have been read."""

    def __init__(self) -> None:
        self.messages: list[tuple[int, Message, int]] = []
        self.tempos: list[tuple[int, int]] = []
        self.names: list[str] = []
        self.texts: set[str] = set()
        self.marks: list[tuple[int, str]] = []
        self.end = 0  # tick


def parse_smf(data: bytes) -> Smf:
    """Parses a Standard MIDI File of type 0 or 1. Raises SmfError, with track and byte, for anything else."""
    if not data:
        raise SmfError("the file is empty (0 bytes)")
    if data[:4] != b"MThd":
        raise SmfError("not a Standard MIDI File (it does not begin with MThd)")
    head = _Bytes(data, 4, len(data), "header")
    size = int.from_bytes(head.take(4, "header length"))
    if size < 6:
        raise SmfError(f"header, byte 4: header length {size}, allowed: 6 or more")
    body = head.take(size, "header")
    kind, count, division = (int.from_bytes(body[i : i + 2]) for i in (0, 2, 4))
    if kind not in (0, 1):
        raise SmfError(f"type {kind} MIDI file, allowed: type 0 (one track) or 1 (tracks together)")
    per_quarter, per_second = _division(division)
    tracks, warnings = _Tracks(), []
    for number in range(1, count + 1):
        if number > 1 and _no_more_chunks(head):
            warnings.append(f"has {number - 1} of the {count} tracks that its header promises")
            break
        short = _read_next_track(head, number, count, tracks)
        if short:
            warnings.append(short)
            break
    tracks.messages.sort(key=lambda m: m[0])
    tracks.tempos.sort(key=lambda t: t[0])
    return Smf(
        per_quarter, per_second, tuple(tracks.messages), tuple(tracks.tempos), tuple(tracks.names), tracks.end,
        tuple(warnings), frozenset(tracks.texts), tuple(sorted(tracks.marks, key=lambda m: m[0])),
    )  # fmt: skip


def _division(word: int) -> tuple[int, tuple[int, int]]:
    """Ticks per quarter note and per second (numerator, denominator); the one not in use is zero."""
    if word & 0x8000 == 0:
        if word == 0:
            raise SmfError("header, byte 12: 0 ticks per quarter note, allowed: 1 to 32767")
        return word, (0, 1)
    frames, ticks = 256 - (word >> 8), word & 0xFF
    if frames not in SMPTE_RATES or ticks == 0:
        what = f"{frames} SMPTE frames of {ticks} ticks"
        raise SmfError(f"header, byte 12: {what}, allowed: 24, 25, 29 or 30 frames of 1 to 255 ticks")
    over, under = SMPTE_RATES[frames]
    return 0, (over * ticks, under)


def _no_more_chunks(file: _Bytes) -> bool:
    """True if no MTrk chunk begins in the rest of the file."""
    at = file.at
    while at + CHUNK_HEAD <= file.end:
        if file.data[at : at + 4] == b"MTrk":
            return False
        at += CHUNK_HEAD + int.from_bytes(file.data[at + 4 : at + CHUNK_HEAD])
    return True


def _read_next_track(file: _Bytes, number: int, count: int, tracks: _Tracks) -> str:
    """Reads the next MTrk chunk into `tracks`, passing over other chunks, as the format asks.

    Returns a warning if the chunk claims to go on beyond the file although its events end within it; or "".
    """
    file.place = f"track {number} of {count}"
    while True:
        kind = file.take(4, "chunk name")
        size = int.from_bytes(file.take(4, "chunk length"))
        start = file.at
        missing = start + size - file.end
        if kind == b"MTrk":
            break
        file.take(size, "chunk")
    track = _Bytes(file.data, start, min(start + size, file.end), file.place)
    if missing <= 0:
        file.at = start + size
        _read_track(track, number - 1, tracks)
        return ""
    try:
        _read_track(track, number - 1, tracks)
    except SmfError:
        file.take(size, "chunk")  # raises: cut off within an event
    return f"track {number} of {count} is {missing} bytes shorter than it says"


def _read_track(track: _Bytes, number: int, tracks: _Tracks) -> None:
    """Reads the channel messages, tempos and the name of a track. Its end mark may be missing."""
    tick, running = 0, 0
    names: dict[int, str] = {}
    while track.at < track.end:
        tick += track.number("delta time")
        start = track.at
        status = track.take(1, "event")[0]
        if status == 0xFF:
            kind = track.take(1, "meta event")[0]
            data = track.take(track.number("meta event length"), "meta event")
            if kind == META_END:
                break
            if kind == META_TEMPO:
                tracks.tempos.append((tick, _tempo(track, data, start)))
            if kind == META_TEXT and tick == 0:
                tracks.texts.add(_text(data))
            if kind == META_TEXT and data.startswith(MARK.encode()):
                tracks.marks.append((tick, data.decode(errors="replace")))
            if kind in (META_TRACK_NAME, META_INSTRUMENT):
                names.setdefault(kind, _text(data))
        elif status in (0xF0, 0xF7):
            track.take(track.number("system exclusive length"), "system exclusive")
        elif status > 0xEF:
            raise track.fail(f"status byte 0x{status:02X} is not allowed in a file", start)
        else:
            if status < 0x80:
                if running == 0:
                    raise track.fail(f"data byte 0x{status:02X} without a status byte before it", start)
                track.at = start
            else:
                running = status
            data = track.take(1 if running >> 4 in (0xC, 0xD) else 2, "message")
            if max(data) > 0x7F:
                raise track.fail(f"data byte 0x{max(data):02X} in a message, allowed: 0 to 0x7F", start)
            tracks.messages.append((tick, message(bytes([running]) + data), number))
    tracks.names.append(names.get(META_TRACK_NAME) or names.get(META_INSTRUMENT) or "")
    tracks.end = max(tracks.end, tick)


def _tempo(track: _Bytes, data: bytes, start: int) -> int:
    """Reads a tempo, us per quarter note."""
    tempo = int.from_bytes(data)
    if len(data) != 3 or tempo == 0:
        raise track.fail(f"tempo {tempo} in {len(data)} bytes, allowed: 1 to 16777215 us in 3 bytes", start)
    return tempo


def _text(data: bytes) -> str:
    """The printable text of a meta event, in UTF-8 or else Latin-1, cut to LONGEST_NAME."""
    try:
        text = data.decode()
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    text = "".join(c if c.isprintable() else " " for c in text).strip()
    return text if len(text) <= LONGEST_NAME else f"{text[: LONGEST_NAME - 3]}..."
