"""Compiles the kernels with numba, and keeps them on disk in a cache that depends on all their sources.

Numba keys a compiled function by the file it stands in: a function that calls into another file would stay as it was
when that file changes. Here every state of all kernel sources together has a cache directory of its own.
"""

from __future__ import annotations

import functools
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba as nb
import platformdirs

ROOMS = ("kernels", "live/thread", "reference")  # folders whose functions are compiled
ENTRY, LIVE_ENTRY = "voice.run-*.nbi", "block.process-*.nbi"  # cache files of the functions compiled last


@functools.cache
def sources() -> tuple[Path, ...]:
    """The files that compiled code depends on."""
    here = Path(__file__).parent
    return (Path(__file__), *sorted(file for room in ROOMS for file in (here / room).rglob("*.py")))


@functools.cache
def directory() -> Path:
    """The cache for the sources as they are: in NUMBA_CACHE_DIR, the user's cache or else the temporary directory."""
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources())).hexdigest()[:16]
    given = os.environ.get("NUMBA_CACHE_DIR")
    places = [Path(given) if given else platformdirs.user_cache_path("livebass")]
    places.append(Path(tempfile.gettempdir()) / f"livebass-{getattr(os, 'getuid', int)()}")
    for place in places:
        try:
            (place / f"kernels-{digest}").mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError:
            continue
        if os.access(place / f"kernels-{digest}", os.W_OK):
            break
    return place / f"kernels-{digest}"


@contextmanager
def _cache() -> Iterator[None]:
    """Makes numba keep what it compiles within the block in `directory`."""
    settings: Any = nb.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = str(directory())
    try:
        yield
    finally:
        settings.CACHE_DIR = before


# Division as in C; kept on disk.
USUAL: dict[str, Any] = {"error_model": "numpy", "cache": True}


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: numba's `njit` without the interpreter lock, with `USUAL` and `options`."""

    def decorate(function: Callable[..., Any]) -> Any:
        with _cache():
            return nb.njit(nogil=True, **USUAL, **options)(function)

    return decorate


def callback(signature: str) -> Callable[[Callable[..., Any]], Callable[[], int]]:
    """A decorator: a C function of that signature. Calling the result compiles it and returns its address."""

    def decorate(function: Callable[..., Any]) -> Callable[[], int]:
        @functools.cache  # keeps the compiled function alive
        def made() -> Any:
            with _cache():
                return nb.cfunc(signature, **USUAL)(function)

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
    """Returns whether the kernels up to `entry` are on disk, compiled from the sources as they are."""
    newest = max(source.stat().st_mtime for source in sources())
    return any(index.stat().st_mtime >= newest for index in directory().rglob(entry))
