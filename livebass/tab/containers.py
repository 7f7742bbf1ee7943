"""Finds the score inside the archives of Guitar Pro 6 (.gpx), Guitar Pro 7 and 8 (.gp) and MusicXML (.mxl).

A .gpx file is BCFS, sectors of 4096 bytes with a directory, or BCFZ, the same packed: bits that repeat earlier bytes.
"""

from __future__ import annotations

import io
import re
import zipfile
import zlib
from collections.abc import Callable
from html import unescape
from itertools import takewhile

from livebass.tab.model import UnreadableTab

LARGEST = 24 << 20  # bytes of a score, unpacked
LARGEST_PACKED = 1 << 20
SECTOR = 4096
FILE_ENTRY = 2  # kind of a directory entry
NAME, SIZE, SECTORS = slice(4, 131), 0x8C, 0x94  # places in an entry
CONTAINER = "META-INF/container.xml"
ROOT_FILE = re.compile(rb"""<(?:\w+:)?rootfile\s[^<>]*?full-path=["']([^"'<>]+)""")
TOO_LARGE = f"its score has more than {LARGEST >> 20} MB, which is the most"


def score_in_zip(data: bytes, is_score: Callable[[str], bool]) -> bytes:
    """The first file in a zip archive whose name `is_score` accepts. Raises UnreadableTab."""
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
        name = next((name for name in archive.namelist() if is_score(name)), None)
        if name is None:
            raise UnreadableTab("is a zip archive without a score")
        with archive.open(name) as file:
            found = file.read(LARGEST + 1)
    except UnreadableTab:
        raise
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, NotImplementedError):
        raise UnreadableTab("is damaged: its archive cannot be read") from None
    except RuntimeError:  # a password
        raise UnreadableTab("is locked with a password") from None
    if len(found) > LARGEST:
        raise UnreadableTab(TOO_LARGE)
    return found


def score_in_mxl(data: bytes) -> bytes:
    """The score in a .mxl file: the one that its container names, else the first one. Raises UnreadableTab."""
    try:
        named = ROOT_FILE.findall(score_in_zip(data, CONTAINER.__eq__))
        names = [unescape(name.decode()) for name in named]
        return score_in_zip(data, next(filter(_is_musicxml, names), "".join(names[:1])).__eq__)
    except (UnreadableTab, UnicodeDecodeError):
        return score_in_zip(data, _is_musicxml)


def _is_musicxml(name: str) -> bool:
    return name.lower().endswith((".xml", ".musicxml")) and not name.startswith("META-INF")


def score_in_gpx(data: bytes) -> bytes:
    """The file score.gpif in a .gpx file. Raises UnreadableTab."""
    if data.startswith(b"BCFZ"):
        data = _unpack(data)
    if not data.startswith(b"BCFS"):
        raise UnreadableTab("is damaged: its content is not BCFS")
    data = data[4:]
    for at in range(SECTOR, len(data), SECTOR):
        entry = data[at : at + SECTOR]
        if _number(entry, 0) == FILE_ENTRY and entry[NAME].split(b"\0")[0] == b"score.gpif":
            sectors = takewhile(bool, (_number(entry, place) for place in range(SECTORS, SECTOR, 4)))
            content = b"".join(data[sector * SECTOR : (sector + 1) * SECTOR] for sector in sectors)
            return content[: _number(entry, SIZE)]
    raise UnreadableTab("is damaged: it has no score.gpif")


def _number(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 4], "little")


def _unpack(data: bytes) -> bytes:
    """The content of a BCFZ file: as many bytes as its bits give, at most those that it promises."""
    wanted = _number(data, 4)
    if wanted > LARGEST:
        raise UnreadableTab(TOO_LARGE)
    if len(data) > LARGEST_PACKED:
        raise UnreadableTab(f"has more than {LARGEST_PACKED >> 20} MB, which is the most for Guitar Pro 6")
    out, bit, end = bytearray(), 64, 8 * len(data)
    data += bytes(8)
    while len(out) < wanted and bit < end:
        ahead = int.from_bytes(data[bit >> 3 : (bit >> 3) + 8]) << (bit & 7)
        if ahead >> 63 & 1:
            width = ahead >> 59 & 15
            back, size = (_reverse_bits(ahead >> 59 - k * width & (1 << width) - 1, width) for k in (1, 2))
            if back > len(out):
                raise UnreadableTab("is damaged: it repeats bytes that it does not have")
            out += out[len(out) - back : len(out) - back + min(back, size)]
            bit += 5 + 2 * width
        else:
            count = (0, 2, 1, 3)[ahead >> 61 & 3]  # two bits in reverse order
            out += (ahead >> 37 & 0xFFFFFF).to_bytes(3)[:count]
            bit += 3 + 8 * count
    return bytes(out)


def _reverse_bits(bits: int, width: int) -> int:
    """The number of `width` bits that stand in reverse order."""
    return int(f"{bits:0{width}b}"[::-1], 2) if width else 0
