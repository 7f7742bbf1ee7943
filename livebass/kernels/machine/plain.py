"""The functions of instructions.py in plain Python, for a debugger: LIVEBASS_PLAIN=1 runs the kernels uncompiled.

They do the same to the same memory, but thousands of times slower and in one thread: nothing here is atomic. A record
at an address is a numpy record that writes through. Kernels import these from native.py. [one thread]
"""

from __future__ import annotations

import ctypes
import struct
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

WORD = (1 << 64) - 1
U32 = (1 << 32) - 1


def load_acquire(address: int) -> int:
    """Returns the int64 at `address`."""
    return ctypes.c_int64.from_address(int(address)).value


def store_release(address: int, value: int) -> None:
    """Stores the int64 `value` at `address`."""
    ctypes.c_int64.from_address(int(address)).value = int(value)


def replace_word(address: int, old: int, new: int) -> int:
    """Stores the int64 `new` at `address` if `old` is there; returns 1 if so, else 0."""
    if load_acquire(address) != old:
        return 0
    store_release(address, new)
    return 1


def address_of(value: int | None) -> int:
    """Returns the address in a C pointer."""
    return value or 0


def record_address(record: Any) -> int:
    """Returns the address of a record."""
    return int(record.__array_interface__["data"][0])


def copy_record(target: Any, source: Any) -> None:
    """Copies the record `source` to `target`, a record of the same type."""
    ctypes.memmove(record_address(target), record_address(source), target.dtype.itemsize)


def bits(value: float) -> int:
    """Returns the 64 bits of the float64 `value` as an int64."""
    return int(struct.unpack("<q", struct.pack("<d", value))[0])


def from_bits(word: int) -> np.float64:
    """Returns the float64 with the lower 64 bits of `word`; compiled kernels wrap integers in the same way."""
    return np.float64(struct.unpack("<d", struct.pack("<Q", int(word) & WORD))[0])


def _array_at(kind: Any, address: int, shape: tuple[int, ...]) -> NDArray[Any]:
    """Returns the memory at `address` as a C array of `kind`; an empty one needs no memory."""
    kind = np.dtype(kind)
    count = int(np.prod(shape))
    if count <= 0 or not address:
        return np.zeros(shape if count >= 0 else 0, kind)
    memory = (ctypes.c_uint8 * (count * kind.itemsize)).from_address(int(address))
    return np.frombuffer(memory, kind).reshape(shape)


def _row_at(kind: Any) -> Callable[[int, int], NDArray[Any]]:
    """Makes a function (address, count) -> array of `count` items of `kind`."""
    return lambda address, count: _array_at(kind, address, (count,))


floats_at, samples_at, words_at, bytes_at = map(_row_at, (np.float64, np.float32, np.int64, np.uint8))


class Record(np.void):  # type: ignore[misc]  # numpy allows it
    """A record whose fields are attributes; np.record hides fields named like a method, such as `diagonal`."""

    def __getattribute__(self, name: str) -> Any:
        if name in np.void.__getattribute__(self, "dtype").names:
            return self[name]
        return np.void.__getattribute__(self, name)

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


def _with_attributes(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Returns a type like `dtype` whose fields, also in nested records, are attributes, as in compiled kernels."""
    if dtype.subdtype:
        item, shape = dtype.subdtype
        return np.dtype((_with_attributes(item), shape))
    if dtype.fields is None or dtype.names is None:
        return dtype
    fields = [dtype.fields[name] for name in dtype.names]
    spec: Any = {
        "names": list(dtype.names),
        "formats": [_with_attributes(field[0]) for field in fields],
        "offsets": [field[1] for field in fields],
        "itemsize": dtype.itemsize,
    }
    return np.dtype((Record, np.dtype(spec)))


def records_at(dtype: np.dtype[Any], dimensions: int = 1) -> Callable[..., Any]:
    """Makes a function (address, *shape) -> array of `dimensions` of records of type `dtype`."""
    kind = _with_attributes(dtype)
    assert dimensions in (1, 2)
    return lambda address, *shape: _array_at(kind, address, shape)


def record_at(dtype: np.dtype[Any]) -> Callable[[int], Any]:
    """Makes a function (address) -> record of type `dtype`."""
    kind = _with_attributes(dtype)
    return lambda address: _array_at(kind, address, (1,))[0]


def nanoseconds(clock_gettime: int, clock: int) -> int:
    """Reads `clock` (ns); 0 if the address `clock_gettime` is 0."""
    return time.clock_gettime_ns(clock) if clock_gettime else 0


def _c_function(result: Any, *arguments: Any) -> Callable[..., int]:
    """Makes a function (address, *arguments) -> result that calls a C function by its address."""

    def call(address: int, *given: int) -> int:
        masked = [int(x) & U32 if kind == ctypes.c_uint32 else int(x) for x, kind in zip(given, arguments, strict=True)]
        return ctypes.CFUNCTYPE(result, *arguments)(int(address))(*masked) or 0

    return call


pointer_from = _c_function(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32)
count_from = _c_function(ctypes.c_uint32, ctypes.c_void_p)
wait_by = _c_function(ctypes.c_uint32, ctypes.c_uint32)
status_from = _c_function(ctypes.c_uint32, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32)
call_2, call_3, call_4 = (_c_function(None, *[ctypes.c_int64] * count) for count in (2, 3, 4))


def float_control() -> int:
    """Returns 0: Python cannot read the floating-point control word, and keeps denormal numbers."""
    return 0


def set_float_control(word: int) -> None:
    """Does nothing: see `float_control`."""


def flush_bits() -> int:
    """Returns 0: see `float_control`."""
    return 0
