"""Links the object file of the kernels into an image, so that a process that only loads them needs no LLVM.

For ELF files of x86-64. The kernels refer to themselves, by distances and a few addresses, and to MEMORY functions of
the C library, through a jump. An image is a line of JSON (symbols, places of addresses) and the bytes at any address.
System V ABI, AMD64 supplement, 4.4: relocations.
"""

from __future__ import annotations

import ctypes
import json
import mmap
import sys
from collections.abc import Callable
from ctypes import c_int, c_int64, c_size_t, c_void_p
from struct import calcsize, iter_unpack, pack, pack_into, unpack_from

MAGIC = b"livebass image "
HEADER, SECTION, SYMBOL, RELOCATION = "<16x2H20xQ10x3H", "<2I4Q2I2Q", "<I2BH2Q", "<QQq"
ELF, OBJECT, X86_64 = b"\x7fELF\x02\x01", 1, 62
SYMBOLS, RELOCATIONS, NO_BITS = 2, 4, 8  # types of sections
ALLOCATED, UNWINDING = 2, ".eh_frame"  # a flag of sections; one that only debuggers read
ADDRESS, DISTANCE, CALL = 1, 2, 4  # types of relocations
MEMORY = ("memcpy", "memmove", "memset")
JUMP, SLOT = b"\xff\x25\2\0\0\0\x90\x90", 8  # jmp to the address in the SLOT behind it


def link(data: bytes) -> bytes:
    """Returns the image of an object file; on other systems, and of what this linker does not know, the file itself."""
    if sys.platform != "linux" or not data.startswith(ELF):
        return data
    try:
        return _link_elf(data)
    except KeyError:
        return data


def is_image(data: bytes) -> bool:
    return data.startswith(MAGIC)


def _link_elf(data: bytes) -> bytes:
    """The same for an ELF file; raises KeyError for unknown relocations and functions."""
    kind, machine, at, size, count, names_in = unpack_from(HEADER, data)
    if (kind, machine) != (OBJECT, X86_64):
        raise KeyError(machine)
    sections = [unpack_from(SECTION, data, at + size * k) for k in range(count)]
    titles = sections[names_in][4]
    places: dict[int, int] = {}  # of the sections that are loaded, in the image
    image = bytearray()
    for k, (name, kind, flags, _, begin, length, _, _, align, _) in enumerate(sections):
        if flags & ALLOCATED and _text(data, titles + name) != UNWINDING:
            image += bytes(-len(image) % align)
            places[k] = len(image)
            image += bytes(length) if kind == NO_BITS else data[begin : begin + length]
    (table,) = (section for section in sections if section[1] == SYMBOLS)
    texts = sections[table[6]][4]
    symbols = [
        (_text(data, texts + name), places[where] + value if where in places else None)
        for name, _, _, where, value, _ in iter_unpack(SYMBOL, data[table[4] : table[4] + table[5]])
    ]
    image += bytes(-len(image) % SLOT)
    outside = {}
    for name in MEMORY:
        outside[name] = len(image) + len(JUMP)
        image += JUMP + bytes(SLOT)
    addresses = []
    for section in sections:
        if section[1] != RELOCATIONS or section[7] not in places:
            continue
        for place, info, addend in iter_unpack(RELOCATION, data[section[4] : section[4] + section[5]]):
            name, to = symbols[info >> 32]
            if to is None:
                to = outside[name] - len(JUMP)
            place += places[section[7]]
            if info & 0xFFFFFFFF == ADDRESS:
                pack_into("<q", image, place, to + addend)
                addresses.append(place)
            elif info & 0xFFFFFFFF in (DISTANCE, CALL):
                pack_into("<i", image, place, to + addend - place)
            else:
                raise KeyError(info & 0xFFFFFFFF)
    entries = {name: to for name, to in symbols if name.startswith("lb_") and to is not None}
    head = json.dumps({"entries": entries, "outside": outside, "addresses": addresses}).encode()
    return MAGIC + pack("<Q", len(head)) + head + image


def _text(data: bytes, at: int) -> str:
    return data[at : data.index(0, at)].decode()


def load_image(data: bytes) -> Callable[[str], int]:
    """Loads an image, for good: threads may run it while Python ends.

    Returns the addresses of its entries by name. Raises OSError if the system refuses.
    """
    begin = len(MAGIC) + calcsize("<Q")
    end = begin + unpack_from("<Q", data, len(MAGIC))[0]
    head, image = json.loads(data[begin:end]), bytearray(data[end:])
    system = ctypes.CDLL(None, use_errno=True)
    system.mmap.restype, system.mmap.argtypes = c_void_p, (c_void_p, c_size_t, c_int, c_int, c_int, c_int64)
    base = system.mmap(None, len(image), mmap.PROT_READ | mmap.PROT_WRITE, mmap.MAP_PRIVATE | mmap.MAP_ANON, -1, 0)
    if base == c_void_p(-1).value:
        raise OSError(ctypes.get_errno(), "no memory for the compiled kernels")
    for name, slot in head["outside"].items():
        pack_into("<Q", image, slot, ctypes.cast(getattr(system, name), c_void_p).value or 0)
    for place in head["addresses"]:
        pack_into("<Q", image, place, base + unpack_from("<q", image, place)[0])
    ctypes.memmove(base, bytes(image), len(image))
    if system.mprotect(c_void_p(base), c_size_t(len(image)), mmap.PROT_READ | mmap.PROT_EXEC):
        raise OSError(ctypes.get_errno(), "the system does not let compiled kernels run")
    return lambda name: base + int(head["entries"][f"lb_{name}"])
