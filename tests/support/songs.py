"""Made-up MIDI files from a seed: whole, odd and damaged ones, for every reader."""

from __future__ import annotations

import hashlib
import json
import random
import struct
from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple

from livebass.score.smf import SmfError, parse_smf
from support.smf import chunk, variable

NAMES = [
    b"Bass", b"", b"Piano", b"E-Bass", b"Drums", b"Voice", b"FINGERED BS", b"PART BASS", "ベース".encode(),
    "ベース".encode("cp932"), "Бас".encode("cp1251"), ("é" * 50).encode(), b"as played by livebass",
    b'livebass plays {"preset": "jazz-finger"}', b"livebass plays ",
]  # fmt: skip
DIVISIONS = [24, 96, 480, 960, 1, 32767, 0xE728, 0xE850, 0xE364, 0xE202]
KEYS = [19, 24, 28, 33, 36, 38, 40, 43, 45, 52, 60, 72]
CONTROLLERS = [0, 1, 5, 6, 7, 64, 74, 98, 100, 101, 121, 126]
EXCLUSIVES = [
    (0x41, 0x10, 0x42, 0x12, 0x40, 0x00, 0x7F, 0, 0x41), (0x41, 0x10, 0x42, 0x12, 0x40, 0x12, 0x15, 2, 0x17),
    (0x43, 0x10, 0x4C, 0, 0, 0x7E, 0), (0x43, 0x10, 0x4C, 8, 1, 7, 1), (0x7E, 0x7F, 9, 1), (0x7F, 0x7F, 4, 4, 0, 62),
    (),
]  # fmt: skip


Row = tuple[int, int, int, int]  # tick, status, data; 0 instead of a second data byte


def meta(kind: int, data: bytes) -> bytes:
    return bytes([0xFF, kind]) + variable(len(data)) + data


def a_meta(rng: random.Random) -> bytes:
    """A meta event that readers know, sometimes of a wrong size."""
    return rng.choice([
        lambda: meta(0x51, rng.randbytes(rng.choice([3, 3, 3, 3, 2, 4, 0]))),
        lambda: meta(0x51, bytes(3)),
        lambda: meta(0x58, bytes([rng.choice([0, 3, 4, 7, 255]), rng.choice([0, 2, 7, 8])])[: rng.choice([2, 2, 1])]),
        lambda: meta(rng.choice([1, 3, 4]), rng.choice(NAMES)),
        lambda: meta(0x20, bytes([rng.choice([0, 2, 9, 15, 16])])[: rng.choice([1, 1, 1, 0])])
        + b"\0" + meta(rng.choice([3, 4]), rng.choice(NAMES)),
        lambda: meta(0x21, bytes([rng.choice([0, 0, 1, 2, 255])])[: rng.choice([1, 1, 1, 0])]),
        lambda: meta(rng.choice([2, 5, 6, 0x54, 0x59, 0x7F]), rng.randbytes(rng.randint(0, 9))),
    ])()  # fmt: skip


def a_message(rng: random.Random, channels: list[int]) -> list[int]:
    """The bytes of a channel message."""
    key = rng.choice(KEYS)
    status, *data = rng.choice([
        (0x90, key, rng.randint(0, 127)), (0x90, key, 80), (0x90, key, 0), (0x80, key, 50), (0x80, key, 0), (0xD0, 40),
        (0xE0, 0, 70), (0xB0, rng.choice(CONTROLLERS), rng.choice([0, 3, 6, 64, 127])),
        (0xA0, key, 9), (0xC0, rng.choice([0, 25, 33, 34, 36])), (0x90, key | 0x80 * (rng.random() < 0.02), 99),
    ])  # fmt: skip
    return [status | rng.choice(channels), *data]


def another_event(rng: random.Random) -> bytes:
    """The bytes of a meta event, a system exclusive message or a system message, which files cannot have."""
    kind = rng.random()
    if kind < 0.65:
        return a_meta(rng)
    if kind < 0.95:
        data = bytes(rng.choice(EXCLUSIVES)) + b"\xf7" * (rng.random() < 0.8)
        return bytes([rng.choice([0xF0, 0xF0, 0xF7])]) + variable(len(data)) + data
    return rng.choice([b"\xf1\x00", b"\xf2\x01\x02", b"\xf3\x05", b"\xf6", b"\xf8", b"\xfe"])


def a_track(rng: random.Random) -> tuple[bytes, list[Row]]:
    """The body of a track, with running status, and its messages."""
    channels = rng.choices([0, 1, 2, 9, 15], k=rng.choice([1, 1, 2, 3]))
    body, running, tick, rows = b"", 0, 0, []
    if rng.random() < 0.7:
        body += b"\0" + meta(rng.choice([3, 3, 4]), rng.choice(NAMES))
    if rng.random() < 0.3:
        body += b"\0" + meta(0x21, bytes([rng.randint(0, 2)]))
    for _ in range(rng.choice([0, 1, 5, 20, 60])):
        delta = rng.choice([0, 0, 0, 10, 40, 120, 5000])
        tick += delta
        body += variable(delta)
        if rng.random() < 0.15:
            body += another_event(rng)
            continue
        status, *data = a_message(rng, channels)
        short = status == running and data[0] < 0x80 and rng.random() < 0.7
        body += bytes(data if short else [status, *data])
        first, second = [min(byte, 0x7F) for byte in (*data, 0)][:2]
        rows.append((tick, status, first, second))
        running = status
    return body + b"\x10\xff\x2f\x00" * (rng.random() < 0.9), rows


class Made(NamedTuple):
    """A made-up file."""

    data: bytes
    kind: int  # 0 to 3
    tracks: list[list[Row]]  # their messages


@cache  # several tests read the same files
def make(seed: int) -> Made:
    """A file whose chunks are right, with what real files have."""
    rng = random.Random(f"made {seed}")
    tracks = [a_track(rng) for _ in range(rng.choice([1, 1, 2, 2, 3, 5]) if seed % 30 else 0)]
    kind = rng.choice([0, 1, 1, 1, 2]) if seed % 50 else 3
    promised = len(tracks) if rng.random() < 0.8 else rng.choice([0, 1, 4, 65535])
    division = rng.choice(DIVISIONS) if seed % 40 else rng.choice([0, 0xEC28, 0xE800])
    head = struct.pack(">HHH", kind, promised, division) + bytes(rng.choice([0, 0, 0, 0, 2]))
    chunks = [chunk(b"MThd", head)]
    for body, _ in tracks:
        if rng.random() < 0.1:
            chunks.append(chunk(rng.choice([b"XFIH", b"abcd"]), rng.randbytes(rng.randint(0, 20))))
        chunks.append(chunk(b"MTrk", body))
    return Made(surrounded(b"".join(chunks), rng), kind, [rows for _, rows in tracks])


def surrounded(data: bytes, rng: random.Random) -> bytes:
    """A file as it is, or in a RIFF file, or behind other bytes."""
    if rng.random() < 0.08:
        inner = b"DISP" + struct.pack("<I", 3) + b"abc\0" if rng.random() < 0.5 else b""
        size = len(data) + rng.choice([0, 0, 0, -20, 99])
        data = b"RIFF" + struct.pack("<I", 999) + b"RMID" + inner + b"data" + struct.pack("<I", max(0, size)) + data
    return rng.choice([b"", b"MacBinary".ljust(128, b"\0"), bytes(5000)]) + data if rng.random() < 0.06 else data


def damage(data: bytearray, rng: random.Random) -> None:
    """Overwrites, removes, doubles or inserts bytes, cuts the file, adds to it, or changes the length of a chunk."""
    at = rng.randrange(len(data) + 1)
    tracks = [k for k in range(len(data)) if data[k : k + 4] == b"MTrk"]
    length = (rng.choice(tracks) if tracks and rng.random() < 0.9 else 0) + 4
    one, none = slice(at, at + 1), slice(at, at)
    new = (b"MTrk", b"MThd", b"MTrk\0\0\0\4\0\xff\x2f\0", b"abcd\0\0\0\0")
    ways: list[tuple[slice, bytes]] = [
        (one, rng.randbytes(1)),
        (one, rng.choice([b"\xff", b"\xf0", b"\x80", b"\x7f", b"\0"])),
        (slice(at, at + rng.randint(1, 9)), b""),
        (none, bytes(data[at : at + rng.randint(1, 40)])),
        (none, rng.choice(new)),
        (slice(at, None), b""),
        (slice(length, length + 4), rng.choice([0, 3, 4, 99, 10_000, 1 << 31]).to_bytes(4)),
        (slice(length + 3, length + 4), rng.randbytes(1)),
        (slice(len(data), None), rng.choice([b"\0\1\2", bytes(data), b"MTrk\0\0\0\0", b"MTrk"])),
    ]
    where, what = rng.choices(ways, [3, 3, 3, 3, 2, 1, 3, 3, 1])[0]
    data[where] = what


@cache
def damaged(seed: int) -> bytes:
    """A made-up file with one to four faults."""
    rng = random.Random(f"damaged {seed}")
    data = bytearray(make(seed).data)
    for _ in range(rng.randint(1, 4)):
        damage(data, rng)
    return bytes(data)


def content(data: bytes) -> list[Any]:
    """All that Python's reader finds in a file, or its error, as plain values."""
    try:
        smf = parse_smf(data)
    except SmfError as error:
        return [str(error)]
    tables = (smf.rows, smf.tempo_rows, smf.meter_rows, smf.exclusive_rows)
    names = [*smf.channel_names.items()]
    exclusive = [data[at : at + size].hex() for _, _, at, size in smf.exclusive_rows.tolist()]
    file = smf.file[0]
    return [
        int(file["per_quarter"]), file["per_second"].tolist(), int(file["end"]),
        *(rows.tolist() for rows in tables), smf.names, smf.instruments, names,
        smf.warnings, sorted(smf.texts), smf.marks, exclusive,
    ]  # fmt: skip


def digests(files: Iterable[bytes], size: int) -> list[str]:
    """A digest of the contents of each `size` files."""
    return digests_of([json.dumps(content(data)) for data in files], size)


def digests_of(found: list[str], size: int) -> list[str]:
    """A digest of each `size` texts."""
    return [hashlib.sha256("\n".join(found[k : k + size]).encode()).hexdigest()[:8] for k in range(0, len(found), size)]
