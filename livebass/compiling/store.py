"""Keeps compiled kernels: in a package that was built with them, or in a user directory.

The name of a kernel file holds a digest of all sources and the level of processor. It ends with a checksum: a file
damaged by a power cut or a full disk would crash. If several processes need the same file, one makes it and the others
wait.
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

from livebass.compiling import ARM, X86
from livebass.rows.bounds import either

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

LOG = logging.getLogger("livebass")
PACKAGE = Path(__file__).parents[1]
ROOMS = ("kernels", "live/thread", "compiling")  # folders of compiled functions, and of their compiler ...
FILES = (
    "rows/__init__.py",
    "rows/techniques.py",
    "rows/parts.py",
    "rows/row.py",
    "rows/units.py",
)  # ... and the sources of their numbers
BUILT = PACKAGE / "built"  # libraries that came with the package
CHECKSUM = hashlib.sha256().digest_size  # bytes at the end of a file
KEPT = re.compile(r"(kernels|objects|plugin|reference|loads)-[0-9a-f]{16}")  # directories of compiled code, by version
UNUSED = 90 * 24 * 3600  # s after which an unused one is deleted
WAITING = "compiling the kernels: another process does so already, waiting for it"


@functools.cache
def sources() -> tuple[Path, ...]:
    """The files that compiled kernels depend on."""
    rooms = [file for room in ROOMS for file in (PACKAGE / room).rglob("*.py")]
    return tuple(sorted([*rooms, *(PACKAGE / file for file in FILES)]))


@functools.cache
def digest() -> str:
    """A name for the current sources of the kernels."""
    found = hashlib.sha256()
    for source in sources():
        found.update(source.relative_to(PACKAGE).as_posix().encode() + b"\0" + source.read_bytes())
    return found.hexdigest()[:16]


@functools.cache
def level() -> str:
    """The level of this processor, a key of `emitter.LEVELS`: kernels of one level give the same sound, bit for bit.

    LIVEBASS_LEVEL names a lower one. Raises ValueError for a processor without kernels, and for a level it lacks.
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
    """The user's directory `name` for compiled code: in NUMBA_CACHE_DIR, the user's cache or the temporary directory.

    Anyone who can write there can run code here: the directory must belong to the user, and be closed to all others.
    Otherwise it is skipped with a one-line warning. None if there is no other, or none is writable.

    Its time of change becomes the time of last use. The first use of a new version deletes those long out of use.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    default = Path(os.path.realpath(given or platformdirs.user_cache_path("livebass")))
    for place in (default, Path(tempfile.gettempdir()) / f"livebass-{_user()}"):
        with suppress(OSError):
            new = not (place / name).exists()
            if all(_private(folder) for folder in (place, place / name)) and os.access(place / name, os.W_OK):
                os.utime(place / name)
                if new:
                    delete_unused(place)
                return place / name
    return None


def delete_unused(place: Path) -> None:
    """Deletes directories of livebass versions in `place` that nothing has used for `UNUSED` seconds."""
    with suppress(OSError):
        for kept in place.iterdir():
            with suppress(OSError):
                if KEPT.fullmatch(kept.name) and time.time() - kept.lstat().st_mtime > UNUSED:
                    shutil.rmtree(kept, ignore_errors=True)  # leaves symbolic links and files in use alone


def _user() -> int:
    """The number of the user; 0 on systems without."""
    return os.getuid() if hasattr(os, "getuid") else 0


def _private(place: Path) -> bool:
    """True if `place`, made if needed, is a directory of the user that nobody else can write to; else says why not.

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


def built_library() -> Path:
    """The library that may have come with the package."""
    ending = {"darwin": "dylib", "win32": "dll"}.get(sys.platform, "so")
    return BUILT / f"kernels-{digest()}-{level()}.{ending}"


def kept_library() -> Path | None:
    """The compiled kernels that may be in the user's directory; None without a directory."""
    place = directory(f"kernels-{digest()}")
    return place / f"{level()}.code" if place else None


def program_built() -> Path:
    """The program that LLVM compiles (lowering.py), possibly shipped with the sources."""
    return BUILT / f"program-{digest()}.ll.gz"


def program_kept() -> Path | None:
    """The program that may be in the user's directory; None without a directory."""
    place = directory(f"kernels-{digest()}")
    return place / "program.ll.gz" if place else None


def seal(data: bytes) -> bytes:
    """Returns `data` with its checksum at the end."""
    return data + hashlib.sha256(data).digest()


def whole(path: Path) -> bytes | None:
    """The content of a file without its checksum; None if there is no file, or it is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    return data[:-CHECKSUM] if seal(data[:-CHECKSUM]) == data else None


def kept_or_made(path: Path | None, make: Callable[[], bytes], damaged: str = "") -> bytes:
    """Returns the content of the file at `path` if undamaged, else the result of `make`, and keeps it there.

    If it cannot be kept, it serves this process alone. If another process is making it, waits for that. `damaged`: a
    warning about a damaged file. `path` None: keeps nothing.
    """
    if path is None:
        return make()
    data = whole(path)
    if data is None:
        with _lock(path):
            data = whole(path)  # from the other process
            if data is None:
                if damaged and path.exists():
                    LOG.warning("%s", damaged)
                data = make()
                with suppress(OSError):
                    write(path, data)
    return data


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Locks the future file at `path`; says so if another process has. A process that ended holds no lock.

    Without locks, or room for a file, the block runs unlocked.
    """
    place = path.with_name(f"{path.name}.lock")
    fd = _lock_of(place) if fcntl else None
    try:
        yield
    finally:
        if fd is not None:
            with suppress(OSError):
                place.unlink()  # waiting processes see that it is gone
            os.close(fd)


def _lock_of(place: Path) -> int | None:
    """Makes the file at `place` if needed and locks it; returns its descriptor, or None."""
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
        os.close(fd)  # its owner removed it, and another process may have made a new one


def write(path: Path, data: bytes) -> None:
    """Writes a file whole or not at all. Raises OSError."""
    handle, name = tempfile.mkstemp(dir=path.parent)
    try:
        with open(handle, "wb") as file:
            file.write(seal(data))
        os.replace(name, path)
    except BaseException:
        with suppress(OSError):
            os.unlink(name)
        raise
