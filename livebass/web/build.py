"""Provides the kernels as a WebAssembly module: from the wheel, from the user's directory, or compiled once.

The module imports nothing. It exports its memory, its function table, and the entries that the page calls or whose
addresses kernels take.
"""

from __future__ import annotations

from pathlib import Path

from livebass.compiling import store
from livebass.compiling.library import compiled_for
from livebass.compiling.processes import Progress, silent
from livebass.web import linking
from livebass.web.layout import ENTRIES

LEVEL = "wasm32"
BUILD_TIME = 30  # s, about
STACK = 1 << 20  # bytes
BUILT = store.BUILT / f"kernels-{store.digest()}-{LEVEL}.wasm"


def kept_module() -> Path | None:
    """Returns the module's path in the user's directory; None if nothing can be kept there."""
    place = store.directory(f"kernels-{store.digest()}")
    return place / f"{LEVEL}.wasm" if place else None


def is_cached() -> bool:
    """True if the module is already compiled."""
    there = kept_module()
    return store.whole(BUILT) is not None or (there is not None and store.whole(there) is not None)


def module(progress: Progress = silent) -> bytes:
    """Returns the module; compiles it first if necessary. `progress` gets the fraction done. Raises OSError."""
    built = store.whole(BUILT)
    return (
        store.kept_or_made(kept_module(), lambda: link_module(compiled_for(LEVEL, progress)))
        if built is None
        else built
    )


def link_module(kernels: bytes) -> bytes:
    """Links the kernels' object file into the module. Raises OSError."""
    try:
        return linking.link(kernels, [f"lb_{entry.name}" for entry in ENTRIES], STACK)
    except linking.LinkError as error:
        raise OSError(f"the kernels cannot be linked: {error}") from None
