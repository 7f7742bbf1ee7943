"""Functions that numba compiles: the reference solver, single kernels for tests, and lowering.py's.

The cache key includes all sources, Python, numba and the kind of processor: numba alone keys a function by its own file
only, and would not recompile it when it calls into another file that changes. Every file ends with a checksum: numba
trusts what it finds. A damaged directory is emptied; an unwritable one is not used.
"""

from __future__ import annotations

import functools
import hashlib
import io
import logging
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from livebass.compiling import FROM_SOURCE, Entry, store
from livebass.system.extras import REFERENCE, install
from livebass.system.interrupts import aside

try:
    import numba as nb
    from llvmlite import binding
    from numba.core import caching, event
except ModuleNotFoundError as error:
    if error.name not in ("numba", "llvmlite"):
        raise
    raise LookupError(f"the reference solver needs numba: {install(REFERENCE)}") from None

LOG = logging.getLogger("livebass")


@functools.cache
def directory() -> Path | None:
    """The cache directory of compiled functions, by sources, Python, numba and processor; None: there is none."""
    config: Any = nb.config
    processor = config.CPU_NAME or binding.get_host_cpu_name()
    features = config.CPU_FEATURES
    if features is None:
        features = binding.get_host_cpu_features().flatten()
    versions = (sys.implementation.cache_tag, nb.__version__, binding.llvm_version_info, processor, features)
    digest = hashlib.sha256(repr(versions).encode())
    for source in (Path(__file__), *sorted((store.PACKAGE / "lab/reference").rglob("*.py"))):
        digest.update(source.read_bytes())
    return store.directory(f"reference-{digest.hexdigest()[:16]}")


def _empty() -> None:
    """Empties the directory as far as the system allows."""
    place = directory()
    with suppress(OSError):
        for entry in place.iterdir() if place else ():
            shutil.rmtree(entry, ignore_errors=True)


@functools.cache  # once is enough
def _start_again() -> None:
    """Empties a damaged cache, and says so."""
    _empty()
    LOG.warning("the compiled code in %s is damaged: compiling it again", directory())


class _Files(caching.IndexDataCacheFile):
    """The index and the data of one function, in numba's formats, each with its checksum at the end."""

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        data = io.BytesIO()
        yield data
        with super()._open_for_write(filepath) as file:
            file.write(store.seal(data.getvalue()))

    def _load_index(self) -> Any:
        if os.path.exists(self._index_path) and store.whole(Path(self._index_path)) is None:
            _start_again()
            return {}
        return super()._load_index()

    def _load_data(self, name: str) -> Any:
        if store.whole(Path(self._data_path(name))) is None:
            _start_again()
            raise FileNotFoundError  # numba compiles
        return super()._load_data(name)


class _Locator(caching.UserProvidedCacheLocator):
    """Places a function's cache files by its module, not by where livebass is installed."""

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
    """numba's cache of one function. It recompiles unreadable entries and does not keep unwritable ones."""

    _impl_class = _Results

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, self._impl.locator.get_source_stamp())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # from a file, a pickle, or LLVM
            _start_again()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):
            super().save_overload(sig, data)


COMMON: dict[str, Any] = {"nogil": True, "error_model": "numpy"}  # division as in C
# No references to Python's objects, which cost a quarter of the time; allocating code does not compile.
LEAN: dict[str, Any] = {"_nrt": False}
# Set for every function: otherwise it inherits the setting of whichever caller makes numba compile it first.
STRICT: dict[str, Any] = {"fastmath": False, "forceinline": False}


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: numba's `njit` with `COMMON`, `STRICT` and `options`; kept on disk."""

    def decorate(function: Callable[..., Any]) -> Any:
        made = nb.njit(**COMMON, **{**STRICT, **options})(function)
        if directory():
            made._cache = _Cache(function)
        made.compile = functools.partial(aside, made.compile)
        return made

    return decorate


counted = compiled()  # counts references: for functions that allocate


_inlined: set[str] = set()  # names of functions merged into their callers
_attributes: dict[str, str] = {}  # of functions, by name, if any


def kernel(attributes: str = "", **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: a kernel, with `options` of numba's `njit` besides `COMMON`, `LEAN` and `STRICT`.

    Space-separated `attributes` are for LLVM (`attributes_of`).
    """
    make = nb.njit(**COMMON, **LEAN, **{**STRICT, **options})

    def decorate(function: Callable[..., Any]) -> Any:
        if "inline" in options:
            _inlined.add(_name(function))
        if attributes:
            _attributes[_name(function)] = attributes
        return make(function)

    return decorate


def share(function: Callable[..., Any]) -> None:
    """Makes a Python function known to the kernels that call it."""
    nb.extending.register_jitable(**COMMON, **LEAN, **STRICT)(function)


def _name(function: Callable[..., Any]) -> str:
    return f"{function.__module__}.{function.__qualname__}"


def attributes_of(llvm_name: str) -> list[str]:
    """The attributes of a function by its `llvm_name`, as numba and lowering.py form it."""
    return _attributes.get(llvm_name.removeprefix("_ZN").rpartition(".")[0], "").split()


class _Compiled(event.Listener):
    """Reports how much of the functions in `missing` numba has compiled, after each."""

    def __init__(self, tell: Callable[[float], None], missing: set[str]) -> None:
        self._tell, self._missing, self._count = tell, missing, len(missing)

    def on_start(self, event: Any) -> None:
        pass

    def on_end(self, event: Any) -> None:
        name = _name(event.data["dispatcher"].py_func)
        if name in self._missing:
            self._missing.remove(name)
            self._tell(1 - len(self._missing) / self._count)


def tell_progress(tell: Callable[[float], None], names: Iterable[str]) -> None:
    """Calls `tell` with the compiled fraction of the functions `names`, after each, from now on.

    Functions merged into their callers do not count.
    """
    event.register("numba:compile", _Compiled(tell, set(names) - _inlined))


def lower(entry: Entry) -> str:
    """Compiles an entry; returns the name of numba's function for it."""
    assert FROM_SOURCE
    made = kernel(entry.attributes)(entry.function)
    made.compile(entry.signature)
    (found,) = made.overloads.values()
    return str(found.fndesc.llvm_func_name)
