"""Standard MIDI File -> channel messages in ticks: the container only, no seconds and no notes.

Read here byte by byte rather than through a library because the reader's promises are its own: any file that
keeps the format is read (unknown chunks, escapes, odd text and key signatures are passed over), and whatever
breaks it is reported with its track and byte.
"""

from __future__ import annotations

from dataclasses import dataclass

DEFAULT_TEMPO = 500_000  # us per quarter note, until the file says otherwise
SMPTE_RATES = {24: (24, 1), 25: (25, 1), 29: (30_000, 1001), 30: (30, 1)}  # frames/s as a fraction
META_END, META_TEMPO = 0x2F, 0x51


class SmfError(ValueError):
    """The bytes are not a Standard MIDI File that can be played; one line with the place."""


@dataclass(frozen=True)
class Smf:
    """A file's content. Ticks count from the start of the file."""

    ticks_per_quarter: int  # 0 where time is in SMPTE frames
    ticks_per_second: tuple[int, int]  # numerator, denominator; (0, 1) where time is in quarter notes
    messages: tuple[tuple[int, bytes], ...]  # (tick, status and data) by tick, then track, then place
    tempos: tuple[tuple[int, int], ...]  # (tick, us per quarter note) by tick
    end_tick: int  # the latest end of a track


class _Bytes:
    """A cursor over `data` up to `end` that names the place when something is missing."""

    def __init__(self, data: bytes, start: int, end: int, place: str) -> None:
        self.data, self.at, self.end, self.place = data, start, end, place

    def fail(self, what: str, at: int | None = None) -> SmfError:
        return SmfError(f"{self.place}, byte {self.at if at is None else at}: {what}")

    def take(self, count: int, what: str) -> bytes:
        if self.at + count > self.end:
            left = self.end - self.at
            raise self.fail(f"{what} of {count} bytes, {left} left: the file is truncated or damaged")
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self, what: str) -> int:
        """A variable-length quantity; the format allows 4 bytes."""
        start, value = self.at, 0
        for _ in range(4):
            byte = self.take(1, what)[0]
            value = value << 7 | byte & 0x7F
            if byte < 0x80:
                return value
        raise self.fail(f"{what} longer than the 4 bytes allowed", start)


def parse_smf(data: bytes) -> Smf:
    """The content of a type 0 or 1 file; SmfError with track and byte for anything else."""
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
    messages: list[tuple[int, bytes]] = []
    tempos: list[tuple[int, int]] = []
    end = 0
    for number in range(1, count + 1):
        track = _next_track(head, number, count)
        end = max(end, _read_track(track, messages, tempos))
    messages.sort(key=lambda m: m[0])
    tempos.sort(key=lambda t: t[0])
    return Smf(per_quarter, per_second, tuple(messages), tuple(tempos), end)


def _division(word: int) -> tuple[int, tuple[int, int]]:
    """Ticks per quarter note and per second; the one not in use is zero."""
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


def _next_track(file: _Bytes, number: int, count: int) -> _Bytes:
    """The bytes of the next MTrk chunk; other kinds of chunk are passed over, as the format asks."""
    file.place = f"track {number} of {count}"
    while True:
        kind = file.take(4, "chunk name")
        size = int.from_bytes(file.take(4, "chunk length"))
        start = file.at
        file.take(size, "chunk")
        if kind == b"MTrk":
            return _Bytes(file.data, start, start + size, file.place)


def _read_track(track: _Bytes, messages: list[tuple[int, bytes]], tempos: list[tuple[int, int]]) -> int:
    """Append a track's channel messages and tempos; its last tick. A missing end mark is forgiven."""
    tick, running = 0, 0
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
                tempos.append((tick, _tempo(track, data, start)))
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
            messages.append((tick, bytes([running]) + data))
    return tick


def _tempo(track: _Bytes, data: bytes, start: int) -> int:
    """Microseconds per quarter note."""
    tempo = int.from_bytes(data)
    if len(data) != 3 or tempo == 0:
        raise track.fail(f"tempo {tempo} in {len(data)} bytes, allowed: 1 to 16777215 us in 3 bytes", start)
    return tempo
