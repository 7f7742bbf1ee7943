"""Looks into the files of a release and all that is packed in them: for differences, and for words of a machine."""

from __future__ import annotations

import base64
import binascii
import getpass
import hashlib
import io
import os
import re
import socket
import sys
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

ZIP, GZIP = b"PK\3\4", b"\x1f\x8b"  # how these files begin
ROOTS_HOME = "/root"
HEAD = "head of"  # an entry's name, date, rights in an archive
BASE64 = re.compile(rb"[A-Za-z0-9+/]{400,}={0,2}")  # the page holds its module and its basses in it


@dataclass(frozen=True)
class Machine:
    """Words that tell of a machine."""

    paths: frozenset[str]  # of the checkout, of the build, of homes; nothing may have them
    common: frozenset[str]  # paths that many machines have, so that a source may mention them
    names: frozenset[str]  # of user and host

    @classmethod
    def this(cls, *more: str) -> Machine:
        """Returns the words of this machine; `more` paths."""
        user, host = getpass.getuser(), socket.gethostname()
        homes = {str(Path.home()), os.path.expanduser(f"~{user}")}
        paths = {sys.prefix, *homes, *more, *(os.path.realpath(path) for path in more)} - {ROOTS_HOME}
        known = {path for path in paths if os.path.isabs(path) and path != os.path.dirname(path)}
        names = {user, host, host.partition(".")[0]} - {""}
        return cls(frozenset(known), frozenset({tempfile.gettempdir(), ROOTS_HOME}), frozenset(names))


def contents(place: str, data: bytes) -> Iterator[tuple[str, bytes]]:
    """Yields a file and all that is packed in it, each with its place: zip, tar.gz, gzip, base64."""
    yield place, data
    if data.startswith(ZIP):
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            for entry in packed.infolist():
                yield f"{place}: {HEAD} {entry.filename}", repr([entry, entry.date_time, entry.extra]).encode()
                yield from contents(f"{place}: {entry.filename}", packed.read(entry))
    elif data.startswith(GZIP):
        inside = zlib.decompressobj(wbits=31).decompress(data)  # without what follows, such as a checksum
        if not place.endswith(".tar.gz"):
            yield from contents(f"{place}: unpacked", inside)
            return
        with tarfile.open(fileobj=io.BytesIO(inside)) as archive:
            for member in archive:
                yield f"{place}: {HEAD} {member.name}", repr(sorted(member.get_info().items())).encode()
                if file := archive.extractfile(member):
                    yield from contents(f"{place}: {member.name}", file.read())
    else:
        for text in BASE64.findall(data):
            with suppress(binascii.Error):
                yield from contents(f"{place}: base64", base64.b64decode(text, validate=True))


def differences(first: Path, second: Path) -> list[str]:
    """Returns a line for each file that differs in two folders, with the innermost place that does."""
    found = []
    for name in sorted({file.name for folder in (first, second) for file in folder.iterdir()}):
        one, two = first / name, second / name
        if not (one.exists() and two.exists()):
            found.append(f"{name}: only one of two builds has it")
        elif one.read_bytes() != two.read_bytes():
            both = zip_longest(*(contents(name, file.read_bytes()) for file in (one, two)))
            places = [(a or b)[0] for a, b in both if a != b]
            inner = [place for place in places[1:] if not any(other.startswith(f"{place}:") for other in places)]
            found.append(f"{name}: two builds differ, first in {min(inner or places, key=lambda place: HEAD in place)}")
    return found


def leaks(folder: Path, machine: Machine, sources: Collection[bytes]) -> list[str]:
    """Returns a line for each word of `machine` in a folder's files, and in what is packed in them.

    Copies of `sources` may have common paths and names: a user may be called root, or bass. A name that is a word of
    the sources is not searched for in generated files either, which is said.
    """
    common = {name for name in machine.names if any(_has(text, name) for text in sources)}
    for name in sorted(common):
        print(f"Not searched for, as it is a word of the sources: {name}", file=sys.stderr)
    generated = sorted(machine.paths | machine.common | machine.names - common)
    copies = {hashlib.sha256(text).digest() for text in sources}
    found, seen = [], set[bytes]()
    for file in sorted(folder.iterdir()):
        for place, data in contents(file.name, file.read_bytes()):
            digest = hashlib.sha256(data).digest()
            if digest not in seen:
                seen.add(digest)
                searched = sorted(machine.paths) if digest in copies else generated
                found += [f"{place}: has {word}, a word of this machine" for word in searched if _has(data, word)]
    return found


def _has(data: bytes, word: str) -> bool:
    """Returns whether `data` has `word`, in 8 or 16 bits, not as a part of a longer word."""
    narrow, wide = word.encode(), word.encode("utf-16-le")
    if wide in data:
        return True
    return narrow in data and bool(re.search(rb"(?<![\w.-])" + re.escape(narrow) + rb"(?![\w-])", data))
