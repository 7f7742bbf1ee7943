"""Keeps compiled kernels: in the package where it was built with them, or in a directory of the user's.

A file of kernels is called after a digest of all their sources and after the level of processor it is for, and ends
with a checksum: a file that a power cut or a full disk damaged would crash. Of several processes that need the same
one, one makes it, and the others wait for it.
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
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import platformdirs

from livebass.bounds import either
from livebass.compiling import ARM, X86

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LOG = logging.getLogger("livebass")
PACKAGE = Path(__file__).parents[1]
ROOMS = ("kernels", "live/thread", "compiling")  # folders whose functions are compiled, or compile them ...
FILES = ("techniques.py", "parts.py", "rows.py", "units.py", "kits.py")  # ... and what they take their numbers from
BUILT = PACKAGE / "built"  # libraries that came with the package
CHECKSUM = hashlib.sha256().digest_size  # bytes at the end of a file
KEPT = re.compile(r"(kernels|objects|plugin|reference|loads)-[0-9a-f]{16}")  # directories of compiled code, by version
UNUSED = 90 * 24 * 3600  # s after which one that nothing has used is deleted
WAITING = "compiling the kernels: another process does so already, waiting for it"


@functools.cache
def sources() -> tuple[Path, ...]:
    """The files that compiled kernels depend on."""
    rooms = [file for room in ROOMS for file in (PACKAGE / room).rglob("*.py")]
    return tuple(sorted([*rooms, *(PACKAGE / file for file in FILES)]))


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
        raise ValueError(f"LIVEBASS_LEVEL must be {either(levels)} on this processor, not {given}")
    return given


@functools.cache
def directory(name: str) -> Path | None:
    """The directory `name` of the user, for compiled code: in NUMBA_CACHE_DIR, the user's cache or the temporary one.

    Who can write there can run code here: wherever it is, the directory must be the user's, and closed to all others.
    One that is not is passed over, and a line says so. None if there is no other, or none can be written to.

    Its time of change becomes that of its last use. The first use of a new version deletes those long out of use.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    usual = Path(os.path.realpath(given or platformdirs.user_cache_path("livebass")))
    for place in (usual, Path(tempfile.gettempdir()) / f"livebass-{_user()}"):
        with suppress(OSError):
            new = not (place / name).exists()
            if all(_private(folder) for folder in (place, place / name)) and os.access(place / name, os.W_OK):
                os.utime(place / name)
                if new:
                    delete_unused(place)
                return place / name
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
    """True if `place`, made if need be, is a directory of the user to which nobody else can write; else says why not.

    Raises OSError.
    """
    place.mkdir(mode=0o700, parents=True, exist_ok=True)
    status, why = place.lstat(), ""
    if not stat.S_ISDIR(status.st_mode):
        why = "is a link"
    elif hasattr(os, "getuid") and status.st_uid != _user():
        why = "belongs to another user"
    elif hasattr(os, "getuid") and status.st_mode & 0o022:
        why = "can be written to by others"
    if why:
        LOG.warning("%s: %s; compiled code is neither kept there nor taken from it", place, why)
    return not why


def built() -> Path:
    """The library that may have come with the package."""
    ending = {"darwin": "dylib", "win32": "dll"}.get(sys.platform, "so")
    return BUILT / f"kernels-{digest()}-{level()}.{ending}"


def kept() -> Path | None:
    """The object file that may be in the user's directory; None if there can be none."""
    place = directory(f"kernels-{digest()}")
    return place / f"{level()}.o" if place else None


def program_built() -> Path:
    """The program that LLVM compiles (lowering.py), as it may have come with the sources."""
    return BUILT / f"program-{digest()}.ll.gz"


def program_kept() -> Path | None:
    """The program as it may be in the user's directory; None if there can be none."""
    place = directory(f"kernels-{digest()}")
    return place / "program.ll.gz" if place else None


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

    What cannot be kept is made for this process alone. If another process makes it, waits for that. `damaged`: a
    warning if there is a file that is not whole; with `path` None there can be none.
    """
    if path is None:
        return make()
    data = whole(path)
    if data is None:
        with _locked(path):
            data = whole(path)  # by the process that was waited for
            if data is None:
                if damaged and path.exists():
                    LOG.warning("%s", damaged)
                data = make()
                with suppress(OSError):
                    write(path, data)
    return data


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Locks what is to become the file at `path`; says so if another process has. One that has ended has no lock.

    Where there are no locks, or no room for a file, the block runs without.
    """
    place = path.with_name(f"{path.name}.lock")
    fd = _lock_of(place) if fcntl else None
    try:
        yield
    finally:
        if fd is not None:
            with suppress(OSError):
                place.unlink()  # those who wait see that it is gone
            os.close(fd)


def _lock_of(place: Path) -> int | None:
    """Makes the file at `place` if need be and locks it; returns its descriptor, or None."""
    said = False
    while True:
        try:
            fd = os.open(place, os.O_RDWR | os.O_CREAT, 0o600)
        except OSError:
            return None
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if not said:
                LOG.warning(WAITING)
            said = True
            fcntl.flock(fd, fcntl.LOCK_EX)
        except OSError:  # a file system without locks
            pass
        if os.fstat(fd).st_nlink:
            return fd
        os.close(fd)  # who had it has removed it, and another may have made a new one


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
