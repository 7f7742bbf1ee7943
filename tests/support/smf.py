"""Standard MIDI Files byte by byte, for tests of their readers."""

from __future__ import annotations

from pathlib import Path

from livebass.score.reading import read_score
from livebass.score.score import Score

BASS = b"\x00\xc0\x21"  # at 0: channel 1 plays program 33, finger bass
END = b"\x00\xff\x2f\x00"


def read(folder: Path, data: bytes, channel: str | int = "auto", rate: int = 48000) -> Score:
    """The score of a MIDI file with these bytes, written into `folder`."""
    path = folder / "song.mid"
    path.write_bytes(data)
    return read_score(path, rate, channel)


def chunk(name: bytes, data: bytes) -> bytes:
    return name + len(data).to_bytes(4) + data


def smf(*tracks: bytes, kind: int = 1, division: int = 480) -> bytes:
    head = kind.to_bytes(2) + len(tracks).to_bytes(2) + division.to_bytes(2)
    return chunk(b"MThd", head) + b"".join(chunk(b"MTrk", t) for t in tracks)


def named(name: bytes, channel: int, *notes: int, program: bytes = b"") -> bytes:
    """A track with its name and consecutive notes on a channel, counted from 0."""
    setting = b"\x00" + bytes([0xC0 | channel]) + program if program else b""
    played = b"".join(
        b"\x00" + bytes([0x90 | channel, note, 100]) + b"\x60" + bytes([0x80 | channel, note, 0]) for note in notes
    )
    return b"\x00\xff\x03" + bytes([len(name)]) + name + setting + played + END


def variable(number: int) -> bytes:
    """A variable-length quantity."""
    assert number >= 0, "events must be in order"
    data = [number & 0x7F]
    while number := number >> 7:
        data.append(number & 0x7F | 0x80)
    return bytes(reversed(data))


def events(*rows: tuple[int, tuple[int, ...]]) -> bytes:
    """A track of (tick, message)."""
    data, last = b"", 0
    for tick, message in rows:
        data += variable(tick - last) + bytes(message)
        last = tick
    return data + END


def note_of(channel: int, key: int, begin: int, end: int) -> list[tuple[int, tuple[int, ...]]]:
    return [(begin, (0x90 | channel, key, 90)), (end, (0x80 | channel, key, 50))]


def struck(score: Score) -> list[int]:
    """The keys of a score's note-ons."""
    return [int(m[1]) for m in score.messages if m[0] & 0xF0 == 0x90]
