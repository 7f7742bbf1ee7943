"""The compiler of the kernels, and a cache on disk that knows all their sources.

Numba keys a compiled function by the file it stands in, so one that calls into another file would stay as it was
when that file changes. Here a directory of its own belongs to each state of all the kernel sources together.
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

HERE = Path(__file__).parent
ROOMS = ("kernels", "live/thread", "reference")
SOURCES = (Path(__file__), *sorted(f for room in ROOMS for f in (HERE / room).glob("*.py")))
ENTRY, LIVE_ENTRY = "voice.run-*.nbi", "block.process-*.nbi"  # what is compiled last


def _directory() -> Path:
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in SOURCES)).hexdigest()[:16]
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


DIRECTORY = _directory()


@contextmanager
def _cache() -> Iterator[None]:
    """What numba compiles in here is kept in `DIRECTORY`."""
    settings: Any = nb.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = str(DIRECTORY)
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
    """A decorator: a C function of that signature. What it gives is called for its address, and compiles it then."""

    def decorate(function: Callable[..., Any]) -> Callable[[], int]:
        @functools.cache
        def address() -> int:
            with _cache():
                made = nb.cfunc(signature, **USUAL)(function)
            _KEPT.append(made)
            return int(made.address or 0)

        return address

    return decorate


_KEPT: list[Any] = []  # compiled callbacks live as long as the process
# Counts references: for the reference solver, which allocates, and for files that make arrays of addresses.
counted = compiled()
# All others: no references, which cost a quarter of the time; what would allocate does not compile.
LEAN: dict[str, Any] = {"_nrt": False}
jit = compiled(**LEAN)


def cached(entry: str = ENTRY) -> bool:
    """Whether the kernels up to `entry` are on disk, compiled from the sources as they are."""
    newest = max(source.stat().st_mtime for source in SOURCES)
    return any(index.stat().st_mtime >= newest for index in DIRECTORY.rglob(entry))
