"""Links one WebAssembly object file into a module, as `wasm-ld` would: the page needs no installed linker.

https://github.com/WebAssembly/tool-conventions/blob/main/Linking.md describes the format. An object file is a module
with numbers in its code and data that the linker sets: its relocations. It imports memory, stack pointer and table; the
linked module has its own. Functions that no export reaches are left out.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from typing import NamedTuple

MAGIC = b"\0asm\x01\0\0\0"
CUSTOM, TYPE, IMPORT, FUNCTION, TABLE, MEMORY, GLOBAL, EXPORT, CODE, DATA = 0, 1, 2, 3, 4, 5, 6, 7, 10, 11  # sections
OF_FUNCTION, OF_DATA, OF_GLOBAL, OF_TABLE = 0, 1, 2, 5  # symbol kinds
SYMBOLS, SEGMENTS = 8, 5  # parts of the section "linking"
UNDEFINED, NAMED = 0x10, 0x40  # symbol flags
FUNCTION_INDEX, ADDRESS, SIGNED_ADDRESS, ADDRESS_32, TYPE_INDEX, GLOBAL_INDEX, TABLE_NUMBER = 0, 3, 4, 5, 6, 7, 20
TO_ADDRESSES = (ADDRESS, SIGNED_ADDRESS, ADDRESS_32)  # relocations that have an addend
FUNCREF, I32, END, CONST_I32 = 0x70, 0x7F, 0x0B, 0x41  # WebAssembly codes
PAGE, PADDED = 65536, 5  # bytes in a memory page; in a number that a linker sets
STACK_POINTER, HEAP_BASE = 0, 1  # the module's globals


class LinkError(ValueError):
    """This linker cannot link an object file; the message is one line."""


class Relocation(NamedTuple):
    kind: int
    at: int  # place in its section
    to: int  # number of a symbol or type
    addend: int


class Symbol(NamedTuple):
    kind: int
    name: str
    where: int  # number of the function or data segment; -1: defined elsewhere
    offset: int  # in the segment


class Reader:
    """Reads numbers and names of a section, from `at` on."""

    def __init__(self, data: bytes, at: int = 0) -> None:
        self.data, self.at = data, at

    def byte(self) -> int:
        self.at += 1
        return self.data[self.at - 1]

    def number(self, signed: bool = False) -> int:
        """Reads a number in LEB128."""
        value = shift = 0
        while True:
            byte = self.byte()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value - (1 << shift) if signed and byte & 0x40 else value

    def bytes(self) -> bytes:
        """Reads a length and that many bytes."""
        size = self.number()
        self.at += size
        return self.data[self.at - size : self.at]

    def name(self) -> str:
        return self.bytes().decode()


class Object(NamedTuple):
    """The parts of an object file that a linker needs."""

    types: bytes
    types_of: list[int]  # by function
    bodies: list[tuple[int, bytes]]  # of functions: place in the code section, and the code
    segments: list[tuple[int, bytes]]  # of data: place in the data section, and the data
    alignments: list[int]  # of segments, bytes
    symbols: list[Symbol]
    of_code: list[Relocation]
    of_data: list[Relocation]


def link(data: bytes, exports: Sequence[str], stack: int) -> bytes:
    """Links the object file `data` into a module with a stack of `stack` bytes at the beginning of its memory.

    It exports the functions `exports`, "memory", "__indirect_function_table" and "__heap_base", where free memory
    begins. Raises LinkError for an object that needs other imports, or lacks one of `exports`.
    """
    found = read_object(data)
    functions = {s.name: s.where for s in found.symbols if s.kind == OF_FUNCTION and s.where >= 0}
    for name in exports:
        if name not in functions:
            raise LinkError(f"there is no function {name}")
    reached = reachable(found, [functions[name] for name in exports])
    number = {old: new for new, old in enumerate(sorted(reached))}
    places, end = [], stack
    for (_, segment), alignment in zip(found.segments, found.alignments, strict=True):
        end = align(end, alignment)
        places.append(end)
        end += len(segment)
    heap = align(end, 16)

    def value(relocation: Relocation) -> int:
        if relocation.kind == TYPE_INDEX:
            return relocation.to
        symbol = found.symbols[relocation.to]
        if relocation.kind == FUNCTION_INDEX:
            return number[symbol.where]
        if relocation.kind in TO_ADDRESSES:
            if symbol.where < 0:
                raise LinkError(f"the data {symbol.name} are not in it")
            return places[symbol.where] + symbol.offset + relocation.addend
        return 0  # the one table, and STACK_POINTER, the one global

    code = [relocate(at, body, found.of_code, value) for at, body in (found.bodies[old] for old in sorted(reached))]
    segments = [relocate(at, segment, found.of_data, value) for at, segment in found.segments]
    sections = {
        TYPE: found.types,
        FUNCTION: vector([leb(found.types_of[old]) for old in sorted(reached)]),
        TABLE: vector([bytes([FUNCREF, 0, 1])]),
        MEMORY: vector([b"\0" + leb(-(-heap // PAGE))]),
        GLOBAL: vector([bytes([I32, 1]) + constant(stack), bytes([I32, 0]) + constant(heap)]),
        EXPORT: vector(
            [
                encode_export("memory", 2, 0),
                encode_export("__indirect_function_table", 1, 0),
                encode_export("__heap_base", 3, HEAP_BASE),
                *(encode_export(name, 0, number[functions[name]]) for name in exports),
            ]
        ),
        CODE: vector([with_size(body) for body in code]),
        DATA: vector(
            [b"\0" + constant(place) + with_size(segment) for place, segment in zip(places, segments, strict=True)]
        ),
    }
    return MAGIC + b"".join(bytes([kind]) + with_size(section) for kind, section in sections.items())


def read_object(data: bytes) -> Object:
    """Reads an object file. Raises LinkError."""
    if not data.startswith(MAGIC):
        raise LinkError("it is no WebAssembly")
    types, types_of, bodies, segments = b"\0", list[int](), list[tuple[int, bytes]](), list[tuple[int, bytes]]()
    alignments, symbols = list[int](), list[Symbol]()
    relocations: dict[int, list[Relocation]] = {CODE: [], DATA: []}
    numbers: dict[int, int] = {}  # kinds of sections, by their number
    file = Reader(data, len(MAGIC))
    while file.at < len(data):
        kind = file.byte()
        section = Reader(file.bytes())
        numbers[len(numbers)] = kind
        if kind == TYPE:
            types = section.data
        elif kind == IMPORT:
            check_imports(section)
        elif kind == FUNCTION:
            types_of = [section.number() for _ in range(section.number())]
        elif kind == CODE:
            bodies = [sized_place(section) for _ in range(section.number())]
        elif kind == DATA:
            for _ in range(section.number()):
                if section.number() != 0 or section.byte() != CONST_I32:
                    raise LinkError("a segment of data is not of the usual kind")
                section.number(signed=True)
                section.byte()
                segments.append(sized_place(section))
        elif kind == CUSTOM:
            name = section.name()
            if name == "linking":
                symbols, alignments = read_linking(section)
            elif name.startswith("reloc."):
                of = numbers.get(section.number(), CUSTOM)
                if of in relocations:
                    relocations[of] = [read_relocation(section) for _ in range(section.number())]
    return Object(types, types_of, bodies, segments, alignments, symbols, relocations[CODE], relocations[DATA])


def check_imports(section: Reader) -> None:
    """Raises LinkError for imports other than the memory, the stack pointer and the table."""
    standard = {"__linear_memory", "__stack_pointer", "__indirect_function_table"}
    for _ in range(section.number()):
        section.name()
        name, kind = section.name(), section.byte()
        if name not in standard:
            raise LinkError(f"it needs {name}")
        if kind == 3:
            section.at += 2
        else:
            section.at += kind == 1
            limited = section.number() & 1
            for _ in range(1 + limited):
                section.number()


def sized_place(section: Reader) -> tuple[int, bytes]:
    """Reads a length and that many bytes; returns their place and the bytes."""
    data = section.bytes()
    return section.at - len(data), data


def read_linking(section: Reader) -> tuple[list[Symbol], list[int]]:
    """Reads the symbols and the segments' alignments (bytes)."""
    symbols, alignments = list[Symbol](), list[int]()
    if section.number() != 2:
        raise LinkError("its format is of another version")
    while section.at < len(section.data):
        kind = section.byte()
        part = Reader(section.bytes())
        if kind == SYMBOLS:
            symbols = [read_symbol(part) for _ in range(part.number())]
        elif kind == SEGMENTS:
            for _ in range(part.number()):
                part.name()
                alignments.append(1 << part.number())
                part.number()
    return symbols, alignments


def read_symbol(part: Reader) -> Symbol:
    kind, flags = part.byte(), part.number()
    there = not flags & UNDEFINED
    if kind == OF_DATA:
        name = part.name()
        index, offset, _ = (part.number(), part.number(), part.number()) if there else (-1, 0, 0)
        return Symbol(kind, name, index, offset)
    if kind not in (OF_FUNCTION, OF_GLOBAL, OF_TABLE):
        raise LinkError(f"it has a symbol of kind {kind}")
    index = part.number()
    name = part.name() if there or flags & NAMED else ""
    return Symbol(kind, name, index if there else -1, 0)


def read_relocation(section: Reader) -> Relocation:
    kind, at, index = section.byte(), section.number(), section.number()
    if kind not in (*TO_ADDRESSES, FUNCTION_INDEX, TYPE_INDEX, GLOBAL_INDEX, TABLE_NUMBER):
        raise LinkError(f"it has a relocation of kind {kind}")
    return Relocation(kind, at, index, section.number(signed=True) if kind in TO_ADDRESSES else 0)


def reachable(found: Object, begin: list[int]) -> set[int]:
    """Returns the functions `begin` and all functions that they call, directly or not."""
    calls: dict[int, list[int]] = {}
    for k, (at, body) in enumerate(found.bodies):
        within = between(found.of_code, at, at + len(body))
        calls[k] = [found.symbols[r.to].where for r in within if r.kind == FUNCTION_INDEX]
    reached, left = set(begin), list(begin)
    while left:
        for k in calls[left.pop()]:
            if k not in reached:
                reached.add(k)
                left.append(k)
    return reached


def between(relocations: list[Relocation], begin: int, end: int) -> list[Relocation]:
    """Returns the relocations from `begin` to below `end`."""
    first = bisect_left(relocations, begin, key=lambda r: r.at)
    return relocations[first : bisect_left(relocations, end, key=lambda r: r.at)]


def relocate(at: int, data: bytes, relocations: list[Relocation], value: Callable[[Relocation], int]) -> bytes:
    """Returns `data`, which begins `at` in its section, with its relocations applied."""
    made = bytearray(data)
    for relocation in between(relocations, at, at + len(data)):
        number, place = value(relocation), relocation.at - at
        if relocation.kind == ADDRESS_32:
            made[place : place + 4] = number.to_bytes(4, "little")
        else:  # below 2^31, PADDED signed bytes are the same
            made[place : place + PADDED] = bytes(
                (number >> 7 * k) & 0x7F | 0x80 * (k < PADDED - 1) for k in range(PADDED)
            )
    return bytes(made)


def align(place: int, alignment: int) -> int:
    """Returns the first multiple of `alignment` from `place` on."""
    return -(-place // alignment) * alignment


def leb(number: int) -> bytes:
    """Encodes a number, 0 or more, in unsigned LEB128."""
    made = bytearray()
    while number > 0x7F:
        made.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*made, number])


def constant(number: int) -> bytes:
    """Returns code for a constant from 0 to below 2^31."""
    signed = leb(number)
    if signed[-1] & 0x40:  # it would be read as the sign
        signed = signed[:-1] + bytes([signed[-1] | 0x80, 0])
    return bytes([CONST_I32]) + signed + bytes([END])


def with_size(data: bytes) -> bytes:
    """Returns `data` after its length."""
    return leb(len(data)) + data


def vector(items: Sequence[bytes]) -> bytes:
    """Returns `items` after their number."""
    return leb(len(items)) + b"".join(items)


def encode_export(name: str, kind: int, index: int) -> bytes:
    """Encodes an export."""
    return with_size(name.encode()) + bytes([kind]) + leb(index)
