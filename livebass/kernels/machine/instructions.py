"""Instructions that numba lacks: atomic words, raw addresses, bits of floats, calls of C functions, flush bits.

Addresses are int64. Everything here compiles to a few instructions; nothing allocates or locks. Kernels import these
from native.py, which imports numba only to compile them. [any thread]
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numba as nb
import numba.extending
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.np import arrayobj

POSITIONAL = inspect.Parameter.POSITIONAL_OR_KEYWORD
WORD, BYTES, U32 = ir.IntType(64), cgutils.voidptr_t, ir.IntType(32)


def make_intrinsic(count: int, typed: Callable[..., Any]) -> Any:
    """An intrinsic of `count` arguments, whose type and code `typed` returns for their types.

    The code is called as `code(builder, *values)`, or `code(context, builder, *values)`. It returns None for no result.
    """

    def find(_context: Any, *arguments: Any) -> Any:
        signature, code = typed(*arguments)
        with_context = "context" in inspect.signature(code).parameters

        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            result = code(context, builder, *values) if with_context else code(builder, *values)
            return context.get_dummy_value() if result is None else result

        return signature, generate

    names = ["_context", *(f"a{k}" for k in range(count))]
    find.__signature__ = inspect.Signature([inspect.Parameter(name, POSITIONAL) for name in names])  # type: ignore[attr-defined]
    return numba.extending.intrinsic(find)


def instruction(result: Any, *arguments: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator: an intrinsic of these types with the code it decorates."""
    return lambda code: make_intrinsic(len(arguments), lambda *_: (result(*arguments), code))


@instruction(types.int64, types.int64)
def load_acquire(builder: Any, address: Any) -> Any:
    """Loads the int64 at `address`, and sees everything written before it was stored."""
    return builder.load_atomic(builder.inttoptr(address, WORD.as_pointer()), "acquire", 8)


@instruction(types.void, types.int64, types.int64)
def store_release(builder: Any, address: Any, value: Any) -> None:
    """Stores the int64 `value` at `address`, after everything written before."""
    builder.store_atomic(value, builder.inttoptr(address, WORD.as_pointer()), "release", 8)


@instruction(types.int64, types.int64, types.int64, types.int64)
def replace_word(builder: Any, address: Any, old: Any, new: Any) -> Any:
    """Stores the int64 `new` at `address` if `old` is there, in one step; returns 1 if so, else 0.

    The storing thread sees everything written before `store_release` or `replace_word` stored `old`.
    """
    found = builder.cmpxchg(builder.inttoptr(address, WORD.as_pointer()), old, new, "acq_rel", "acquire")
    return builder.zext(builder.extract_value(found, 1), WORD)


def _to_word(builder: Any, pointer: Any) -> Any:
    return builder.ptrtoint(pointer, WORD)


address_of = instruction(types.int64, types.voidptr)(_to_word)  # (C pointer) -> its address
record_address = make_intrinsic(1, lambda record: (types.int64(record), _to_word))  # (record) -> its address


def _copy_record(target: Any, source: Any) -> Any:
    def code(builder: Any, to: Any, given: Any) -> None:
        cgutils.raw_memcpy(builder, to, given, WORD(target.size), 1)

    return types.void(target, source) if target == source else None, code


copy_record = make_intrinsic(2, _copy_record)  # (target, source): copies a record to one of the same type


@instruction(types.int64, types.float64)
def bits(builder: Any, value: Any) -> Any:
    """Returns the 64 bits of the float64 `value` as an int64."""
    return builder.bitcast(value, WORD)


@instruction(types.float64, types.int64)
def from_bits(builder: Any, word: Any) -> Any:
    """Returns the float64 with the 64 bits of the int64 `word`."""
    return builder.bitcast(word, ir.DoubleType())


def _array_at(kind: Any, dimensions: int = 1) -> Any:
    """Makes an intrinsic (address, *shape) -> C array of `kind` without a reference count."""
    array = types.Array(kind, dimensions, "C")

    def code(context: Any, builder: Any, address: Any, *shape: Any) -> Any:
        made = context.make_array(array)(context, builder)
        item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind)))
        strides = [item]
        for size in reversed(shape[1:]):
            strides.insert(0, builder.mul(strides[0], size))
        data = builder.inttoptr(address, made.data.type)
        arrayobj.populate_array(made, data=data, shape=shape, strides=strides, itemsize=item, meminfo=None)
        return made._getvalue()

    return instruction(array, types.int64, *[types.int64] * dimensions)(code)


# (address, count) -> array of `count` float64, float32, int64 or uint8 there
floats_at, samples_at, words_at, bytes_at = map(_array_at, (types.float64, types.float32, types.int64, types.uint8))


def records_at(dtype: np.dtype[Any], dimensions: int = 1) -> Any:
    """Makes an intrinsic (address, *shape) -> array of `dimensions` of records of type `dtype`."""
    return _array_at(nb.from_dtype(dtype), dimensions)


def record_at(dtype: np.dtype[Any]) -> Any:
    """Makes an intrinsic (address) -> record of type `dtype`, without a reference count."""
    record: Any = nb.from_dtype(dtype)

    def code(context: Any, builder: Any, address: Any) -> Any:
        return builder.inttoptr(address, context.get_value_type(record))

    return instruction(record, types.int64)(code)


@instruction(types.int64, types.int64, types.int64)
def nanoseconds(builder: Any, clock_gettime: Any, clock: Any) -> Any:
    """Reads `clock` (ns) with the C function at address `clock_gettime`; 0 if that address is 0."""
    result = cgutils.alloca_once_value(builder, WORD(0))
    spec = cgutils.alloca_once(builder, WORD, size=2)
    with builder.if_then(builder.icmp_signed("!=", clock_gettime, WORD(0))):
        kind = ir.FunctionType(U32, [U32, WORD.as_pointer()])
        builder.call(builder.inttoptr(clock_gettime, kind.as_pointer()), [builder.trunc(clock, U32), spec])
        seconds = builder.load(spec)
        rest = builder.load(builder.gep(spec, [U32(1)]))
        builder.store(builder.add(builder.mul(seconds, WORD(1_000_000_000)), rest), result)
    return builder.load(result)


def _c_function(result: Any, *arguments: Any) -> Any:
    """Makes an intrinsic (address, *arguments) -> result that calls a C function by its address.

    A function called so is not compiled into the caller.
    """

    def code(builder: Any, address: Any, *given: Any) -> Any:
        function = builder.inttoptr(address, ir.FunctionType(result, arguments).as_pointer())
        values = [
            builder.inttoptr(value, kind) if isinstance(kind, ir.PointerType)
            else value if kind == WORD else builder.trunc(value, kind)
            for value, kind in zip(given, arguments, strict=True)
        ]  # fmt: skip
        back = builder.call(function, values)
        if isinstance(result, ir.VoidType):
            return None
        return builder.ptrtoint(back, WORD) if isinstance(result, ir.PointerType) else builder.zext(back, WORD)

    words = [types.int64] * (1 + len(arguments))
    return instruction(types.void if isinstance(result, ir.VoidType) else types.int64, *words)(code)


pointer_from = _c_function(BYTES, BYTES, U32)  # void *function(void *pointer, uint32 count): jack_port_get_buffer
count_from = _c_function(U32, BYTES)  # uint32 function(void *pointer): jack_midi_get_event_count, jack_last_frame_time
wait_by = _c_function(U32, U32)  # int function(uint32 microseconds): usleep
status_from = _c_function(U32, BYTES, BYTES, U32)  # int function(void *, void *, uint32 index): jack_midi_event_get
call_2, call_3, call_4 = (_c_function(ir.VoidType(), *[WORD] * count) for count in (2, 3, 4))  # of int64


def _of_processor(name: str, result: Any, *arguments: Any) -> Any:
    """Makes an intrinsic that calls a machine-dependent function of emitter.PROCESSOR."""

    def code(builder: Any, *given: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType() if result == types.void else WORD, [WORD] * len(given))
        called = builder.call(cgutils.get_or_insert_function(builder.module, kind, name), given)
        return None if result == types.void else called

    return instruction(result, *arguments)(code)


float_control = _of_processor("float_control", types.int64)  # () -> the thread's floating-point control word, or 0
set_float_control = _of_processor("set_float_control", types.void, types.int64)  # sets that word
flush_bits = _of_processor("flush_bits", types.int64)  # () -> its bits that flush denormal numbers to zero
