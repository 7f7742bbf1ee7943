"""Ring buffers of MIDI messages and of sound, each with one writing and one reading thread. [any thread]

A ring is an int64 array. Words HEAD (entries ever written) and TAIL (entries ever read) only grow and lie on cache
lines of their own; the entries follow from word DATA. A message is two words: its frame, or NOW, and its three bytes
in one word. Sound is float32. Functions take a ring's address and its size in entries.
"""

import numpy as np

from livebass.compiling import entry, inlined, jit
from livebass.kernels.native import load_acquire, samples_at, store_release, words_at

HEAD, TAIL, DATA = 0, 8, 16
WORD = 8  # bytes
ENTRY = 2  # words of a message
NOW = -1  # in place of a frame: as soon as possible


@entry("int64(int64)")
def read_word(address):
    """Returns the int64 at `address`; what was written before it was stored is visible afterwards."""
    return load_acquire(address)


@entry("void(int64, int64)")
def write_word(address, value):
    """Stores the int64 `value` at `address`, after everything written before."""
    store_release(address, value)


@jit
def pack(status, first, second):
    """A MIDI message as one word; data bytes have 7 bits."""
    return np.int64(status) & 0xFF | (np.int64(first) & 0x7F) << 8 | (np.int64(second) & 0x7F) << 16


@jit
def unpack(word):
    """Status, first and second data byte of a packed message."""
    return word & 0xFF, (word >> 8) & 0x7F, (word >> 16) & 0x7F


@inlined
def words_of(address, size):
    """The array of a ring of `size` messages."""
    return words_at(address, DATA + ENTRY * size)


@jit
def push(address, size, frame, status, first, second):
    """Adds a message for `frame`; returns False if the ring is full. [writing thread]"""
    words = words_of(address, size)
    head = words[HEAD]
    if head - load_acquire(address + WORD * TAIL) >= size:
        return False
    words[DATA + ENTRY * (head % size)] = frame
    words[DATA + ENTRY * (head % size) + 1] = pack(status, first, second)
    store_release(address + WORD * HEAD, head + 1)
    return True


@entry("int64(int64, int64, int64, int64, int64, int64)")
def push_message(address, size, frame, status, first, second):
    """C function: `push`; returns 1 or 0."""
    return np.int64(push(address, size, frame, status, first, second))


@jit
def next_frame(address, size, empty):
    """Returns the frame of the next message, or NOW, or `empty` if there is no message. [reading thread]"""
    words = words_of(address, size)
    tail = words[TAIL]
    if load_acquire(address + WORD * HEAD) == tail:
        return empty
    return words[DATA + ENTRY * (tail % size)]


@jit
def pop(address, size):
    """Removes the next message, which must be there; returns status, first, second. [reading thread]"""
    words = words_of(address, size)
    tail = words[TAIL]
    word = words[DATA + ENTRY * (tail % size) + 1]
    store_release(address + WORD * TAIL, tail + 1)
    return unpack(word)


@jit
def push_sound(address, size, sound, n):
    """Adds n samples as far as there is room; returns how many were lost. [writing thread]"""
    words = words_at(address, DATA)
    data = samples_at(address + WORD * DATA, size)
    head = words[HEAD]
    fits = min(n, size - (head - load_acquire(address + WORD * TAIL)))
    for j in range(fits):
        data[(head + j) % size] = sound[j]
    store_release(address + WORD * HEAD, head + fits)
    return n - fits


def new_message_ring(size: int) -> np.ndarray:
    """An empty ring of `size` messages."""
    return np.zeros(DATA + ENTRY * size, np.int64)


def new_sound_ring(size: int) -> np.ndarray:
    """An empty ring of `size` samples."""
    return np.zeros(DATA + (size + 1) // 2, np.int64)


def pop_sound(ring: np.ndarray, size: int) -> np.ndarray:
    """Removes all samples of a ring of `size`, (n,) float32. [reading thread]"""
    address = ring.ctypes.data
    tail, head = int(ring[TAIL]), read_word(address + WORD * HEAD)
    sound = ring[DATA:].view(np.float32)[np.arange(tail, head) % size]
    write_word(address + WORD * TAIL, head)
    return sound


def unread(ring: np.ndarray) -> list[tuple[int, int, int, int]]:
    """The messages that wait in a ring, oldest first: (frame, status, first, second). [reading thread]"""
    entries = ring[DATA:].reshape(-1, ENTRY)
    waiting = entries[np.arange(ring[TAIL], read_word(ring.ctypes.data + WORD * HEAD)) % len(entries)]
    return [(frame, *unpack(word)) for frame, word in waiting.tolist()]


def pop_messages(ring: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Removes and returns the messages that wait in a ring, as `unread` does. [reading thread]"""
    messages = unread(ring)
    write_word(ring.ctypes.data + WORD * TAIL, int(ring[TAIL]) + len(messages))
    return messages
