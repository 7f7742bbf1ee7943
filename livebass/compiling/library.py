"""The kernel library in this process: from the package, or compiled on this machine.

The system loads the first, without numba or LLVM. emitter.py makes the second, an object file, in a process of its own,
at its first use. Linked where linking.py can, which also loads without LLVM, it is kept in the user's directory. If
damaged, it is made again; if it cannot be kept, it serves this process alone.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from livebass.compiling import linking, processes, store
from livebass.system.interrupts import aside

Library = Callable[[str], int]  # gives the address of an entry by its name; raises KeyError for an unknown name
_lock = threading.Lock()
_loaded: list[Library] = []


def shared_library(path: Path) -> Library:
    """Loads a shared library. Raises OSError if the system cannot."""
    loaded = ctypes.CDLL(str(path))

    def address(name: str) -> int:
        try:
            return int(ctypes.cast(getattr(loaded, f"lb_{name}"), ctypes.c_void_p).value or 0)
        except AttributeError:
            raise KeyError(name) from None

    return address


def object_file(data: bytes) -> Library:
    """Links an object file in memory, by LLVM. Raises RuntimeError if that cannot load it."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    machine = binding.Target.from_default_triple().create_target_machine(opt=0, jit=True)
    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), machine)
    engine.add_object_file(binding.ObjectFileRef.from_data(data))
    engine.finalize_object()

    def address(name: str) -> int:
        found = int(engine.get_function_address(f"lb_{name}"))
        if not found:
            raise KeyError(name)
        return found

    return address


def is_cached() -> bool:
    """True if the kernels are already compiled."""
    if _loaded or store.whole(store.built_library()) is not None:
        return True
    kept = store.kept_library()
    return kept is not None and store.whole(kept) is not None


def library(progress: processes.Progress = processes.silent) -> Library:
    """The library; the first call loads it, and compiles it if needed. [any thread]

    `progress` gets the compiled fraction, from a thread of its own.
    """
    if not _loaded:
        aside(_load_once, progress)
    return _loaded[0]


def _load_once(progress: processes.Progress) -> None:
    with _lock:
        if not _loaded:
            _loaded.append(_load(progress))


def _load(progress: processes.Progress) -> Library:
    if store.whole(store.built_library()) is not None:
        with suppress(OSError):
            return shared_library(store.built_library())
    kept = store.kept_library()
    damaged = f"the compiled kernels in {kept and kept.parent} are damaged: compiling them again"
    data = store.kept_or_made(kept, lambda: linking.link(compiled_here(progress)), damaged)
    return linking.load_image(data) if linking.is_image(data) else object_file(data)


def compiled_here(progress: processes.Progress = processes.silent) -> bytes:
    """Compiles the kernels for this processor: `compiled_for`."""
    return compiled_for(store.level(), progress)


def compiled_for(level: str, progress: processes.Progress = processes.silent) -> bytes:
    """Compiles the kernels for a level of processor, in separate processes that end with this one.

    `progress` gets the fraction done. Returns the object file. Raises OSError with a failed process's last message.
    """
    if not os.path.isfile(sys.executable or ""):
        raise OSError(
            f"the kernels must be compiled first, by the Python in sys.executable, which is {sys.executable!r}"
        )
    try:
        return processes.result_of("livebass.compiling.emitter", level, progress=progress)
    except processes.Failed as error:
        raise OSError(f"the kernels do not compile: {error}") from None


def duration() -> str:
    """Says how long compiling takes on two idle cores, for "in about ..."."""
    kept = store.program_kept()
    lowered = store.program_built().exists() or (kept is not None and kept.exists())
    return "a quarter of a minute" if lowered else "half a minute"
