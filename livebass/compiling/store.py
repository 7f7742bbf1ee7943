"""Keeps compiled kernels: in the package where it was built with them, or in a directory of the user's.

A file of kernels is called after a digest of all their sources and after the level of processor it is for, and ends
with a checksum: a file that a power cut or a full disk damaged would crash.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import logging
import os
import platform
import re
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import platformdirs

from livebass.compiling import ARM, X86

LOG = logging.getLogger("livebass")
PACKAGE = Path(__file__).parents[1]
ROOMS = ("kernels", "live/thread", "compiling")  # folders whose functions are compiled, or compile them
BUILT = PACKAGE / "built"  # libraries that came with the package
CHECKSUM = hashlib.sha256().digest_size  # bytes at the end of a file
KEPT = re.compile(r"(kernels|objects|plugin|reference)-[0-9a-f]{16}")  # directories of compiled code, by version
UNUSED = 90 * 24 * 3600  # s after which one that nothing has used is deleted


@functools.cache
def sources() -> tuple[Path, ...]:
    """The files that compiled kernels depend on."""
    return tuple(sorted(file for room in ROOMS for file in (PACKAGE / room).rglob("*.py")))


@functools.cache
def digest() -> str:
    """A name for the kernels' sources as they are."""
    found = hashlib.sha256()
    for source in sources():
        found.update(source.relative_to(PACKAGE).as_posix().encode() + b"\0" + source.read_bytes())
    return found.hexdigest()[:16]


@functools.cache
def level() -> str:
    """The level of this processor, a key of `emitter.LEVELS`: kernels of one level give the same sound, bit for bit.

    LIVEBASS_LEVEL names a lower one. Raises ValueError for a processor without kernels, and a level that it has not.
    """
    machine = platform.machine().lower()
    if machine in X86:
        core = "numpy._core" if importlib.util.find_spec("numpy._core") else "numpy.core"  # before numpy 2
        has = importlib.import_module(f"{core}._multiarray_umath").__cpu_features__
        levels = ["x86-64-v2", "x86-64-v3"] if has.get("AVX2") and has.get("FMA3") else ["x86-64-v2"]
    elif machine in ARM:
        levels = ["arm64"]
    else:
        raise ValueError(f"processor {machine}: livebass plays on {', '.join(X86 + ARM)} only")
    given = os.environ.get("LIVEBASS_LEVEL") or levels[-1]
    if given not in levels:
        raise ValueError(f"LIVEBASS_LEVEL={given}: allowed on this processor: {', '.join(levels)}")
    return given


@functools.cache
def directory(name: str) -> Path | None:
    """The directory `name` of the user, for compiled code: in NUMBA_CACHE_DIR, the user's cache or the temporary one.

    None if none of them can be written to. Everybody may write to the temporary directory, and who can write there
    can run code here: there, the directory must be the user's, and closed to all others.

    Its time of change becomes that of its last use. The first use of a new version deletes those long out of use.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    usual = Path(given) if given else platformdirs.user_cache_path("livebass")
    with suppress(OSError):
        new = not (usual / name).exists()
        (usual / name).mkdir(parents=True, exist_ok=True, mode=0o700)
        if os.access(usual / name, os.W_OK):
            os.utime(usual / name)
            if new:
                delete_unused(usual)
            return usual / name
    shared = Path(tempfile.gettempdir()) / f"livebass-{_user()}"
    with suppress(OSError):
        for place in (shared, shared / name):
            place.mkdir(exist_ok=True, mode=0o700)
            if not _private(place):
                return None
        return shared / name
    return None


def delete_unused(place: Path) -> None:
    """Deletes what versions of livebass keep in `place` that nothing has used for `UNUSED` seconds."""
    with suppress(OSError):
        for kept in place.iterdir():
            with suppress(OSError):
                if KEPT.fullmatch(kept.name) and time.time() - kept.lstat().st_mtime > UNUSED:
                    shutil.rmtree(kept, ignore_errors=True)  # which leaves a symbolic link, and what is in use, alone


def _user() -> int:
    """The number of the user; 0 on systems without."""
    return os.getuid() if hasattr(os, "getuid") else 0


def _private(place: Path) -> bool:
    """True if `place` is a directory of the user to which nobody else can write."""
    status = place.lstat()
    return stat.S_ISDIR(status.st_mode) and status.st_uid == _user() and not status.st_mode & 0o022


def built() -> Path:
    """The library that may have come with the package."""
    ending = {"darwin": "dylib", "win32": "dll"}.get(sys.platform, "so")
    return BUILT / f"kernels-{digest()}-{level()}.{ending}"


def kept() -> Path | None:
    """The object file that may be in the user's directory; None if there can be none."""
    place = directory(f"kernels-{digest()}")
    return place / f"{level()}.o" if place else None


def sealed(data: bytes) -> bytes:
    """Returns `data` with its checksum at the end."""
    return data + hashlib.sha256(data).digest()


def whole(path: Path) -> bytes | None:
    """The content of a file without its checksum; None if there is no file, or it is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    return data[:-CHECKSUM] if sealed(data[:-CHECKSUM]) == data else None


def kept_or_made(path: Path | None, make: Callable[[], bytes], damaged: str = "") -> bytes:
    """Returns the content of the file at `path` if it is whole, else what `make` returns, and keeps it there.

    What cannot be kept is made for this process alone. `damaged`: a warning if there is a file that is not whole; with
    `path` None there can be none.
    """
    data = whole(path) if path else None
    if data is None:
        if damaged and path and path.exists():
            LOG.warning("%s", damaged)
        data = make()
        if path:
            with suppress(OSError):
                write(path, data)
    return data


def write(path: Path, data: bytes) -> None:
    """Writes a file whole, or not at all. Raises OSError."""
    handle, name = tempfile.mkstemp(dir=path.parent)
    try:
        with open(handle, "wb") as file:
            file.write(sealed(data))
        os.replace(name, path)
    except BaseException:
        with suppress(OSError):
            os.unlink(name)
        raise
