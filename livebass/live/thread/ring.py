"""Ring buffers for messages and sound, each with one writing and one reading thread. [any thread]

A ring is an int64 array. Words HEAD (entries ever written) and TAIL (entries ever read) only grow and lie on their own
cache lines; the entries start at word DATA. A message is two words: its frame, or NOW, and a word as kernels/player
reads it (words.py there). Sound is float32. Functions take a ring's address and its size in entries.
"""

import numpy as np

from livebass.compiling import entry, inlined, jit
from livebass.kernels.machine.native import load_acquire, samples_at, store_release, words_at
from livebass.kernels.player.words import CHANNEL_BIT, KIND_BIT, VALUE_BIT, Row, pack, row_of
from livebass.rows.techniques import PARAMETER

HEAD, TAIL, DATA = 0, 8, 16
WORD = 8  # bytes
ENTRY = 2  # words of a message
NOW = -1  # instead of a frame: as soon as possible


@entry("int64(int64)")
def read_word(address):
    """Returns the int64 at `address`; everything written before it was stored is then visible."""
    return load_acquire(address)


@entry("void(int64, int64)")
def write_word(address, value):
    """Stores the int64 `value` at `address`, after everything written before."""
    store_release(address, value)


@inlined
def ring_words(address, size):
    """The array of a ring of `size` messages."""
    return words_at(address, DATA + ENTRY * size)


@jit
def free_place(address, size):
    """Returns the place of the next message among the words of a ring; -1 if the ring is full. [writing thread]"""
    head = ring_words(address, size)[HEAD]
    full = head - load_acquire(address + WORD * TAIL) >= size
    return np.int64(-1) if full else DATA + ENTRY * (head % size)


@jit
def push_whole(address, size, frame, word):
    """Adds a message for `frame`; returns False if the ring is full. [writing thread]"""
    words, place = ring_words(address, size), free_place(address, size)
    if place < 0:
        return False
    words[place] = frame
    words[place + 1] = word
    store_release(address + WORD * HEAD, words[HEAD] + 1)
    return True


@jit
def push_word(address, size, frame, word, value):
    """`push_whole` of a `word` with bits 32 to 63 zero: they become `value`."""
    words, place = ring_words(address, size), free_place(address, size)
    if place < 0:
        return False
    words[place] = frame
    words[place + 1] = word
    samples_at(address + WORD * (place + 1), 2)[1] = value
    store_release(address + WORD * HEAD, words[HEAD] + 1)
    return True


@jit
def push_midi(address, size, frame, status, first, second):
    """Adds a MIDI message for `frame`; returns False if the ring is full. [writing thread]"""
    return push_whole(address, size, frame, pack(status, first, second))


@entry("int64(int64, int64, int64, int64, int64, int64)")
def push_message(address, size, frame, status, first, second):
    """C function: `push_midi`; returns 1 or 0."""
    return np.int64(push_midi(address, size, frame, status, first, second))


@jit
def push_learned(address, size, frame, number, value, channel, controlled):
    """Adds parameter `number` at `value`, moved by a controller on `channel` that went to `controlled`.

    Returns False if the ring is full. [writing thread]
    """
    word = number | (controlled + 1) << VALUE_BIT | channel << CHANNEL_BIT | np.int64(PARAMETER) << KIND_BIT
    return push_word(address, size, frame, word, np.float32(value))


@entry("int64(int64, int64, int64, int64, int64, float64)")
def push_event(address, size, frame, kind, number, value):
    """C function: adds an event of a `kind` other than MIDI for `frame`; returns 1, or 0 if the ring is full.

    `number` is the parameter, string or key, 0 to 255, or a stroke's. For one channel's key, add the channel plus one
    from bit VALUE_BIT on. [writing thread]
    """
    word = np.int64(number) & ((1 << KIND_BIT) - 1) | (np.int64(kind) & 0xFF) << KIND_BIT
    return np.int64(push_word(address, size, frame, word, np.float32(value)))


@jit
def next_frame(address, size, empty):
    """Returns the frame of the next message, or NOW, or `empty` if there is no message. [reading thread]"""
    words = ring_words(address, size)
    tail = words[TAIL]
    if load_acquire(address + WORD * HEAD) == tail:
        return empty
    return words[DATA + ENTRY * (tail % size)]


@jit
def pop(address, size):
    """Removes the next message, which must exist; returns its word and the value in it. [reading thread]"""
    words = ring_words(address, size)
    tail = words[TAIL]
    place = DATA + ENTRY * (tail % size) + 1
    word, value = words[place], np.float64(samples_at(address + WORD * place, 2)[1])
    store_release(address + WORD * TAIL, tail + 1)
    return word, value


@jit
def push_sound(address, size, sound, n):
    """Adds n samples as far as there is room; returns the number lost. [writing thread]"""
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


def unread(ring: np.ndarray) -> list[Row]:
    """The messages waiting in a ring, oldest first: (frame, *`row_of` its word). [reading thread]"""
    entries = ring[DATA:].reshape(-1, ENTRY)
    waiting = entries[np.arange(ring[TAIL], read_word(ring.ctypes.data + WORD * HEAD)) % len(entries)]
    return [(frame, *row_of(word)) for frame, word in waiting.tolist()]


def pop_messages(ring: np.ndarray) -> list[Row]:
    """Removes the messages waiting in a ring; returns them like `unread`. [reading thread]"""
    messages = unread(ring)
    write_word(ring.ctypes.data + WORD * TAIL, int(ring[TAIL]) + len(messages))
    return messages
