"""The kernels, from Python functions to machine code: one emitter, one list of entries, one library.

`jit` or `inlined` marks a function as source of a kernel, in the subset of Python that numba compiles. `entry` makes it
a C function exported by the kernel library: Python, audio thread, plugin and page call no others. The emitter
(emitter.py) compiles all of them in one pass, in a process of its own; the library (library.py) loads the result. numba
is only imported by the emitter, or if FROM_SOURCE is set, as in tests of single kernels; otherwise these decorators
leave the functions as they are. Kernels call `shared` functions compiled; Python calls them uncompiled, on numbers or,
if the arithmetic allows, arrays.
"""

from __future__ import annotations

import ctypes
import functools
import os
from collections.abc import Callable
from typing import Any

X86, ARM = ("x86_64", "amd64"), ("aarch64", "arm64")  # names from platform.machine()
FROM_SOURCE = bool(os.environ.get("LIVEBASS_FROM_SOURCE"))
PLAIN = bool(os.environ.get("LIVEBASS_PLAIN")) and not FROM_SOURCE  # kernels run as plain Python, for pdb
C_TYPES: dict[str, Any] = {
    "void": None,
    "voidptr": ctypes.c_void_p,
    "int32": ctypes.c_int32,
    "uint32": ctypes.c_uint32,
    "int64": ctypes.c_int64,
    "uint64": ctypes.c_uint64,
    "float64": ctypes.c_double,
}
ENTRIES: dict[str, Entry] = {}  # by name: all C functions of the library


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: the source of a kernel, compiled with `options` of numba's njit.

    An extra option, `attributes`, lists LLVM function attributes, such as "noinline".
    """

    def decorate(function: Callable[..., Any]) -> Any:
        if not FROM_SOURCE:
            return function
        from livebass.compiling import by_numba

        return by_numba.kernel(**options)(function)

    return decorate


jit = compiled()
# Merged into its callers before compiling: for functions that take functions, or that return arrays they made, which
# numba cannot do without references.
inlined = compiled(inline="always")
# Stays one function that its callers call: for long loops used in many places.
apart = compiled(attributes="noinline")
SMALL = "optsize"  # an attribute: short code instead of fast code, for functions that run once per bass or message


def shared(function: Callable[..., Any]) -> Any:
    """A decorator: the source of a kernel that Python also calls: it stays a Python function everywhere."""
    if FROM_SOURCE:
        from livebass.compiling import by_numba

        by_numba.share(function)
    return function


class Entry:
    """A C function of the library: call it, or take its `address`. Integers may be addresses."""

    def __init__(self, function: Callable[..., Any], signature: str, attributes: str = "") -> None:
        self.function, self.signature, self.name = function, signature, function.__name__
        self.attributes = attributes
        self.result, arguments = signature.rstrip(")").split("(")
        self.arguments = [name.strip() for name in arguments.split(",") if name.strip()]
        functools.update_wrapper(self, function)

    @functools.cached_property
    def address(self) -> int:
        """Finds the function's address. Loads the library, and compiles it if needed."""
        if PLAIN:
            return int(ctypes.cast(self._plain, ctypes.c_void_p).value or 0)
        from livebass.compiling.library import library

        return library()(self.name)

    @functools.cached_property
    def call(self) -> Callable[..., Any]:
        """The function, for Python; other threads run meanwhile."""
        return self._uncompiled if PLAIN else self._kind(self.address)

    @property
    def _kind(self) -> Any:
        """The type of the C function."""
        return ctypes.CFUNCTYPE(C_TYPES[self.result], *(C_TYPES[name] for name in self.arguments))

    def _uncompiled(self, *arguments: Any) -> Any:
        """Calls the Python function; integers wrap around and division by zero gives infinity, as in compiled code."""
        import numpy as np

        with np.errstate(all="ignore"):
            return self.function(*arguments)

    @functools.cached_property
    def _plain(self) -> Any:
        """The Python function as a C function; it lives as long as this entry."""
        return self._kind(self._uncompiled)

    def __call__(self, *arguments: Any) -> Any:
        return self.call(*arguments)


def entry(signature: str, attributes: str = "") -> Callable[[Callable[..., Any]], Entry]:
    """A decorator: makes a C function of the library, with a `signature` such as "int64(int64, float64)".

    `attributes`: as for `compiled`. Raises ValueError if the name is taken.
    """

    def decorate(function: Callable[..., Any]) -> Entry:
        made = Entry(function, signature, attributes)
        if made.name in ENTRIES:
            raise ValueError(f"two entries called {made.name}")
        ENTRIES[made.name] = made
        return made

    return decorate
