"""Compiles the kernels with numba, and keeps them on disk in a cache that depends on all their sources.

Numba keys a compiled function by the file it stands in: a function that calls into another file would stay as it was
when that file changes. Here every state of all kernel sources together has a cache directory of its own, for each
Python, numba and kind of processor. Every file in it ends with a checksum: numba trusts what it finds, and a file
that a power cut or a full disk damaged would raise any error, or crash. A damaged cache is emptied; one that cannot be
written to is done without.
"""

from __future__ import annotations

import functools
import hashlib
import io
import logging
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numba as nb
import platformdirs
from llvmlite import binding
from numba.core import caching, sigutils
from numba.core.ccallback import CFunc

from livebass.interrupts import aside

ROOMS = ("kernels", "live/thread", "reference")  # folders whose functions are compiled
# The functions compiled last: of all, for playing live, and for fretless boards.
ENTRY, LIVE_ENTRY, BOARD_ENTRY = "voice.run", "block.process", "board.over_board"
LOG = logging.getLogger("livebass")


@functools.cache
def sources() -> tuple[Path, ...]:
    """The files that compiled code depends on."""
    here = Path(__file__).parent
    return (Path(__file__), *sorted(file for room in ROOMS for file in (here / room).rglob("*.py")))


@functools.cache
def directory() -> Path | None:
    """The cache for the sources as they are: in NUMBA_CACHE_DIR, the user's cache or else the temporary directory.

    None if none of them can be written to. Everybody may write to the temporary directory, and who can write to the
    cache can run code here: there, the cache must be the user's, and closed to all others.
    """
    name = f"kernels-{_digest()}"
    given = os.environ.get("NUMBA_CACHE_DIR")
    usual = Path(given) if given else platformdirs.user_cache_path("livebass")
    with suppress(OSError):
        (usual / name).mkdir(parents=True, exist_ok=True, mode=0o700)
        if os.access(usual / name, os.W_OK):
            return usual / name
    shared = Path(tempfile.gettempdir()) / f"livebass-{_user()}"
    with suppress(OSError):
        for place in (shared, shared / name):
            place.mkdir(exist_ok=True, mode=0o700)
            if not _private(place):
                return None
        return shared / name
    return None


def _digest() -> str:
    """A name for the kernels' sources as they are, this Python, numba and processor."""
    config: Any = nb.config
    processor = config.CPU_NAME or binding.get_host_cpu_name()
    features = config.CPU_FEATURES
    if features is None:
        features = binding.get_host_cpu_features().flatten()
    versions = (sys.implementation.cache_tag, nb.__version__, binding.llvm_version_info, processor, features)
    digest = hashlib.sha256(repr(versions).encode())
    for source in sources():
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _user() -> int:
    """The number of the user; 0 on systems without."""
    return os.getuid() if hasattr(os, "getuid") else 0


def _private(place: Path) -> bool:
    """True if `place` is a directory of the user to which nobody else can write."""
    status = place.lstat()
    return stat.S_ISDIR(status.st_mode) and status.st_uid == _user() and not status.st_mode & 0o022


def _whole(path: str | Path) -> bool:
    """True if the file ends with the checksum of the rest. Raises OSError if it cannot be read."""
    data = Path(path).read_bytes()
    return hashlib.sha256(data[:-32]).digest() == data[-32:]


def _empty() -> None:
    """Empties the cache, as far as the system lets us."""
    place = directory()
    with suppress(OSError):
        for entry in place.iterdir() if place else ():
            shutil.rmtree(entry, ignore_errors=True)


@functools.cache  # once is enough
def _start_anew() -> None:
    """Empties a cache that turned out to be damaged, and says so."""
    _empty()
    LOG.warning("the compiled kernels in %s are damaged: compiling them anew (about 25 s)", directory())


class _Files(caching.IndexDataCacheFile):
    """The index and the data of one function, in numba's formats, each with its checksum at the end."""

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        data = io.BytesIO()
        yield data
        with super()._open_for_write(filepath) as file:
            file.write(data.getvalue() + hashlib.sha256(data.getvalue()).digest())

    def _load_index(self) -> Any:
        if os.path.exists(self._index_path) and not _whole(self._index_path):
            _start_anew()
            return {}
        return super()._load_index()

    def _load_data(self, name: str) -> Any:
        if not _whole(self._data_path(name)):
            _start_anew()
            raise FileNotFoundError  # numba compiles
        return super()._load_data(name)


class _Locator(caching.UserProvidedCacheLocator):
    """Names the place of a function's cache files: by its module, not by where livebass is installed."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno
        self._cache_path = os.path.join(directory() or "", function.__module__)

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> _Locator:
        return cls(function, file)

    def get_source_stamp(self) -> str:
        return ""  # the name of the directory says all


class _Results(caching.CompileResultCacheImpl):
    _locator_classes: Any = (_Locator,)


class _Cache(caching.FunctionCache):
    """numba's cache of one function. What cannot be read is compiled anew, what cannot be written is not kept."""

    _impl_class = _Results

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, self._impl.locator.get_source_stamp())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # of a file, a pickle, or LLVM
            _start_anew()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):
            super().save_overload(sig, data)


# Division as in C.
USUAL: dict[str, Any] = {"error_model": "numpy"}


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: numba's `njit` without the interpreter lock, with `USUAL` and `options`; kept on disk."""

    def decorate(function: Callable[..., Any]) -> Any:
        made = nb.njit(nogil=True, **USUAL, **options)(function)
        if directory():
            made._cache = _Cache(function)
        made.compile = functools.partial(aside, made.compile)
        return made

    return decorate


def callback(signature: str) -> Callable[[Callable[..., Any]], Callable[[], int]]:
    """A decorator: a C function of that signature. Calling the result compiles it and returns its address."""

    def decorate(function: Callable[..., Any]) -> Callable[[], int]:
        @functools.cache  # keeps the compiled function alive
        def made() -> Any:
            native: Any = CFunc(function, sigutils.normalize_signature(signature), locals={}, options=USUAL)
            if directory():
                native._cache = _Cache(function)
            aside(native.compile)
            return native

        @functools.wraps(function)
        def address() -> int:
            return int(made().address or 0)

        return address

    return decorate


# Counts references: for the reference solver, which allocates, and for files that make arrays of addresses.
counted = compiled()
# All others: no references, which cost a quarter of the time; what would allocate does not compile.
LEAN: dict[str, Any] = {"_nrt": False}
jit = compiled(**LEAN)
# Becomes part of its callers before they are compiled: for functions that take functions, or that return arrays they
# made, which numba does not do without references.
inlined = compiled(inline="always", **LEAN)


def cached(entry: str = ENTRY) -> bool:
    """Returns whether the kernels up to `entry` are on disk, whole. Empties a damaged cache."""
    place = directory()
    try:
        files = [file for ending in ("nbi", "nbc") for file in place.glob(f"*/{entry}-*.{ending}")] if place else []
        if all(map(_whole, files)):
            return {file.suffix for file in files} == {".nbi", ".nbc"}
    except OSError:
        pass
    _empty()
    return False
