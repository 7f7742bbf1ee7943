"""Ring buffers for MIDI messages and sound, each with one writing and one reading thread. [any thread]

A ring is an int64 array. Words HEAD (entries ever written) and TAIL (entries ever read) only grow and lie on their own
cache lines; the entries start at word DATA. A message is two words: its frame, or NOW, and the event. The event has a
kind in bits 24 to 31. A MIDI message has its three bytes below; any other event has a number in bits 0 to 7 and a
float32 in bits 32 to 63. An event for a channel's last-played key also has the channel plus one in bits 8 to 12; a
parameter moved by a MIDI controller has the controller's value plus one in bits 8 to 15 and its channel in bits 16 to
19. Sound is float32. Functions take a ring's address and its size in entries.
"""

import numpy as np

from livebass.compiling import entry, inlined, jit
from livebass.kernels.machine.native import load_acquire, samples_at, store_release, words_at
from livebass.kernels.player.performer import ANY
from livebass.techniques import PARAMETER

HEAD, TAIL, DATA = 0, 8, 16
WORD = 8  # bytes
ENTRY = 2  # words of a message
NOW = -1  # instead of a frame: as soon as possible
# Kinds of messages: MIDI; a string's bend, semitones; the pluck position of
# a key's next note, as PLUCK_POSITION; the bend of the string that played a key last, semitones; the string of a key's
# next note; the vibrato of the string that played a key last, 0 to 1; the end of a key's sound, whatever the pedal
# does. techniques.py has those that set a parameter: 1, 6, 9 and above.
MIDI, STRING_BEND, NOTE_PLACE, NOTE_BEND, NOTE_STRING, NOTE_VIBRATO, NOTE_CUT = 0, 2, 3, 4, 5, 7, 8
KIND_BIT, VALUE_BIT, CHANNEL_BIT = 24, 8, 16
NUMBER, OF_CHANNEL = 0xFF, 0x1F  # masks: of an event's number, and of the channel above it


@entry("int64(int64)")
def read_word(address):
    """Returns the int64 at `address`; everything written before it was stored is then visible."""
    return load_acquire(address)


@entry("void(int64, int64)")
def write_word(address, value):
    """Stores the int64 `value` at `address`, after everything written before."""
    store_release(address, value)


@jit
def pack(status, first, second):
    """A MIDI message as one word; data bytes have 7 bits, and the kind is MIDI."""
    return np.int64(status) & 0xFF | (np.int64(first) & 0x7F) << 8 | (np.int64(second) & 0x7F) << 16


@jit
def unpack(word):
    """Status, first and second data byte of a packed message."""
    return word & 0xFF, (word >> 8) & 0x7F, (word >> 16) & 0x7F


@inlined
def ring_words(address, size):
    """The array of a ring of `size` messages."""
    return words_at(address, DATA + ENTRY * size)


@jit
def push_word(address, size, frame, word, value):
    """Adds a message for `frame`; returns False if the ring is full. [writing thread]

    `word` is the event, with bits 32 to 63 zero: they become `value`.
    """
    words = ring_words(address, size)
    head = words[HEAD]
    if head - load_acquire(address + WORD * TAIL) >= size:
        return False
    place = DATA + ENTRY * (head % size)
    words[place] = frame
    words[place + 1] = word
    samples_at(address + WORD * (place + 1), 2)[1] = value
    store_release(address + WORD * HEAD, head + 1)
    return True


@jit
def push_midi(address, size, frame, status, first, second):
    """Adds a MIDI message for `frame`; returns False if the ring is full. [writing thread]"""
    return push_word(address, size, frame, pack(status, first, second), np.float32(0.0))


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


@jit
def controller_of(word):
    """Returns the value, 0 to 127, of the controller that moved an event's parameter; -1: no controller."""
    return ((word >> VALUE_BIT) & 0xFF) - 1


@jit
def key_channel_of(word):
    """Returns the channel of an event's key; ANY: any channel."""
    channel = ((word >> VALUE_BIT) & OF_CHANNEL) - 1
    return channel if 0 <= channel < ANY else np.int64(ANY)


@entry("int64(int64, int64, int64, int64, int64, float64)")
def push_event(address, size, frame, kind, number, value):
    """C function: adds an event of a `kind` other than MIDI for `frame`; returns 1, or 0 if the ring is full.

    `number` is the parameter, string or key, 0 to 255. For one channel's key, add the channel plus one from bit
    VALUE_BIT on. [writing thread]
    """
    word = np.int64(number) & (OF_CHANNEL << VALUE_BIT | NUMBER) | (np.int64(kind) & 0xFF) << KIND_BIT
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


def unread(ring: np.ndarray) -> list[tuple[int, int, int, int]]:
    """The MIDI messages waiting in a ring, oldest first: (frame, status, first, second). [reading thread]"""
    entries = ring[DATA:].reshape(-1, ENTRY)
    waiting = entries[np.arange(ring[TAIL], read_word(ring.ctypes.data + WORD * HEAD)) % len(entries)]
    return [(frame, *unpack(word)) for frame, word in waiting.tolist()]


def pop_messages(ring: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Removes the messages waiting in a ring; returns them like `unread`. [reading thread]"""
    messages = unread(ring)
    write_word(ring.ctypes.data + WORD * TAIL, int(ring[TAIL]) + len(messages))
    return messages
