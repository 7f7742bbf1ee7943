"""Instructions that numba lacks: atomic words, raw addresses, bits of floats, calls of C functions, flush bits.

Addresses are int64. Everything here compiles to a few instructions; nothing allocates or locks. Kernels import these
from native.py, which imports numba only to compile them. [any thread]
"""

from __future__ import annotations

from typing import Any

import numba as nb
import numba.extending
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.np import arrayobj

# Typed as Any: numba itself passes the context to an intrinsic, and mypy cannot know that.
intrinsic: Any = numba.extending.intrinsic

WORD = ir.IntType(64)


@intrinsic
def load_acquire(_context: Any, address: Any) -> Any:
    """Loads the int64 at `address`, and sees everything written before it was stored."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = builder.inttoptr(args[0], WORD.as_pointer())
        return builder.load_atomic(pointer, "acquire", 8)

    return types.int64(types.int64), generate


@intrinsic
def store_release(_context: Any, address: Any, value: Any) -> Any:
    """Stores the int64 `value` at `address`, after everything written before."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = builder.inttoptr(args[0], WORD.as_pointer())
        builder.store_atomic(args[1], pointer, "release", 8)
        return context.get_dummy_value()

    return types.void(types.int64, types.int64), generate


@intrinsic
def replace_word(_context: Any, address: Any, old: Any, new: Any) -> Any:
    """Stores the int64 `new` at `address` if `old` is there, in one step; returns 1 if so, else 0.

    The storing thread sees everything written before `store_release` or `replace_word` stored `old`.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = builder.inttoptr(args[0], WORD.as_pointer())
        found = builder.cmpxchg(pointer, args[1], args[2], "acq_rel", "acquire")
        return builder.zext(builder.extract_value(found, 1), WORD)

    return types.int64(types.int64, types.int64, types.int64), generate


@intrinsic
def address_of(_context: Any, value: Any) -> Any:
    """Converts a C pointer to an address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.ptrtoint(args[0], WORD)

    return types.int64(types.voidptr), generate


@intrinsic
def record_address(_context: Any, record: Any) -> Any:
    """Returns the address of a record."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.ptrtoint(args[0], WORD)

    return types.int64(record), generate


@intrinsic
def copy_record(_context: Any, target: Any, source: Any) -> Any:
    """Copies the record `source` to `target`, a record of the same type."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        cgutils.raw_memcpy(builder, args[0], args[1], WORD(signature.args[0].size), 1)
        return context.get_dummy_value()

    return types.void(target, source) if target == source else None, generate


@intrinsic
def bits(_context: Any, value: Any) -> Any:
    """Returns the 64 bits of the float64 `value` as an int64."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], WORD)

    return types.int64(types.float64), generate


@intrinsic
def from_bits(_context: Any, word: Any) -> Any:
    """Returns the float64 with the 64 bits of the int64 `word`."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), generate


def _array_at(kind: Any, dimensions: int = 1) -> Any:
    """Makes the type and the code of an intrinsic (address, *shape) -> C array of `kind` without a reference count."""
    array = types.Array(kind, dimensions, "C")
    sizes = [types.int64] * dimensions

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        made = context.make_array(array)(context, builder)
        item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind)))
        strides = [item]
        for size in reversed(args[2:]):
            strides.insert(0, builder.mul(strides[0], size))
        data = builder.inttoptr(args[0], made.data.type)
        arrayobj.populate_array(made, data=data, shape=args[1:], strides=strides, itemsize=item, meminfo=None)
        return made._getvalue()

    return array(types.int64, *sizes), generate


@intrinsic
def floats_at(_context: Any, address: Any, count: Any) -> Any:
    """Returns `count` float64 at `address` as an array."""
    return _array_at(types.float64)


@intrinsic
def samples_at(_context: Any, address: Any, count: Any) -> Any:
    """Returns `count` float32 at `address` as an array."""
    return _array_at(types.float32)


@intrinsic
def words_at(_context: Any, address: Any, count: Any) -> Any:
    """Returns `count` int64 at `address` as an array."""
    return _array_at(types.int64)


@intrinsic
def bytes_at(_context: Any, address: Any, count: Any) -> Any:
    """Returns `count` uint8 at `address` as an array."""
    return _array_at(types.uint8)


def records_at(dtype: np.dtype[Any], dimensions: int = 1) -> Any:
    """Makes an intrinsic (address, *shape) -> array of `dimensions` of records of type `dtype`."""
    record: Any = nb.from_dtype(dtype)
    if dimensions == 2:

        @intrinsic
        def table_at(_context: Any, address: Any, rows: Any, columns: Any) -> Any:
            return _array_at(record, 2)

        return table_at

    @intrinsic
    def row_at(_context: Any, address: Any, count: Any) -> Any:
        return _array_at(record)

    return row_at


def record_at(dtype: np.dtype[Any]) -> Any:
    """Makes an intrinsic (address) -> record of type `dtype`, without a reference count."""
    record: Any = nb.from_dtype(dtype)

    @intrinsic
    def at(_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(record))

        return record(types.int64), generate

    return at


@intrinsic
def nanoseconds(_context: Any, clock_gettime: Any, clock: Any) -> Any:
    """Reads `clock` (ns) with the C function at address `clock_gettime`; 0 if that address is 0."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        function, number = args
        result = cgutils.alloca_once_value(builder, WORD(0))
        spec = cgutils.alloca_once(builder, WORD, size=2)
        with builder.if_then(builder.icmp_signed("!=", function, WORD(0))):
            kind = ir.FunctionType(ir.IntType(32), [ir.IntType(32), WORD.as_pointer()])
            call = builder.inttoptr(function, kind.as_pointer())
            builder.call(call, [builder.trunc(number, ir.IntType(32)), spec])
            seconds = builder.load(spec)
            rest = builder.load(builder.gep(spec, [ir.IntType(32)(1)]))
            builder.store(builder.add(builder.mul(seconds, WORD(1_000_000_000)), rest), result)
        return builder.load(result)

    return types.int64(types.int64, types.int64), generate


def _c_function(result: Any, arguments: list[Any], numba_arguments: list[Any]) -> Any:
    """Makes an intrinsic (address, *arguments) -> result that calls a C function by its address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        function = builder.inttoptr(args[0], ir.FunctionType(result, arguments).as_pointer())
        values = [
            builder.inttoptr(value, kind) if isinstance(kind, ir.PointerType) else builder.trunc(value, kind)
            for value, kind in zip(args[1:], arguments, strict=True)
        ]
        back = builder.call(function, values)
        if isinstance(result, ir.PointerType):
            return builder.ptrtoint(back, WORD)
        return builder.zext(back, WORD)

    return types.int64(types.int64, *numba_arguments), generate


BYTES, U32 = cgutils.voidptr_t, ir.IntType(32)


@intrinsic
def pointer_from(_context: Any, function: Any, pointer: Any, count: Any) -> Any:
    """Calls void *function(void *pointer, uint32 count): jack_port_get_buffer."""
    return _c_function(BYTES, [BYTES, U32], [types.int64, types.int64])


@intrinsic
def count_from(_context: Any, function: Any, pointer: Any) -> Any:
    """Calls uint32 function(void *pointer): jack_midi_get_event_count, jack_last_frame_time."""
    return _c_function(U32, [BYTES], [types.int64])


@intrinsic
def wait_by(_context: Any, function: Any, microseconds: Any) -> Any:
    """Calls int function(uint32 microseconds): usleep."""
    return _c_function(U32, [U32], [types.int64])


@intrinsic
def status_from(_context: Any, function: Any, target: Any, pointer: Any, index: Any) -> Any:
    """Calls int function(void *target, void *pointer, uint32 index): jack_midi_event_get."""
    return _c_function(U32, [BYTES, BYTES, U32], [types.int64] * 3)


def _call(arguments: int) -> Any:
    """Makes an intrinsic (address, *arguments) that calls a C function of int64 arguments by its address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType(), [WORD] * arguments)
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), list(args[1:]))
        return context.get_dummy_value()

    return types.void(*[types.int64] * (1 + arguments)), generate


# A function called by its address is not compiled into the caller.
@intrinsic
def call_2(_context: Any, function: Any, a: Any, b: Any) -> Any:
    """Calls void function(int64, int64)."""
    return _call(2)


@intrinsic
def call_3(_context: Any, function: Any, a: Any, b: Any, c: Any) -> Any:
    """Calls void function(int64, int64, int64)."""
    return _call(3)


@intrinsic
def call_4(_context: Any, function: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Calls void function(int64, int64, int64, int64)."""
    return _call(4)


def _of_processor(name: str, result: Any, *arguments: Any) -> Any:
    """Makes the type and the code of an intrinsic that calls a machine-dependent function of emitter.PROCESSOR."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType() if result == types.void else WORD, [WORD] * len(args))
        made = builder.call(cgutils.get_or_insert_function(builder.module, kind, name), args)
        return context.get_dummy_value() if result == types.void else made

    return result(*arguments), generate


@intrinsic
def float_control(_context: Any) -> Any:
    """Returns the floating-point control word of this thread's processor; 0 if there is none."""
    return _of_processor("float_control", types.int64)


@intrinsic
def set_float_control(_context: Any, word: Any) -> Any:
    """Sets the floating-point control word that `float_control` returns."""
    return _of_processor("set_float_control", types.void, types.int64)


@intrinsic
def flush_bits(_context: Any) -> Any:
    """Returns the bits of `float_control` that flush denormal numbers to zero."""
    return _of_processor("flush_bits", types.int64)
