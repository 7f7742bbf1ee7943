"""Ring buffers of MIDI messages and of sound, each with one writing and one reading thread. [any thread]

A ring is an int64 array. Words HEAD (entries ever written) and TAIL (entries ever read) only grow and lie on cache
lines of their own; the entries follow from word DATA. A message is two words: its frame, or NOW, and what happens.
The latter has a kind in bits 24 to 31: a MIDI message has its three bytes below, any other event a number in bits 0 to
7 and a float32 in bits 32 to 63; one of a key that a channel has played last, also that channel plus one in bits 8 to
12; a parameter that a MIDI controller has moved, also the controller's value plus one in bits 8 to 15 and its channel
in bits 16 to 19. Sound is float32. Functions take a ring's address and its size in
entries.
"""

import numpy as np

from livebass.compiling import entry, inlined, jit
from livebass.kernels.machine.native import load_acquire, samples_at, store_release, words_at
from livebass.kernels.player.performer import ANY

HEAD, TAIL, DATA = 0, 8, 16
WORD = 8  # bytes
ENTRY = 2  # words of a message
NOW = -1  # in place of a frame: as soon as possible
# Kinds of messages: of MIDI; a parameter (techniques.py) and its value; the bend of a string, semitones; the place
# where the next note of a key is plucked, as PLUCK_POSITION; the bend of the string that played a key last, semitones;
# the string of the next note of a key; the amount of what a function of controllers does, 0 to 1
# (`parameters.set_amount`); the vibrato of the string that played a key last, 0 to 1; the end of a key's sound,
# whatever the pedal does; a knob of the effects, 0 to 1
MIDI, PARAMETER, STRING_BEND, NOTE_PLACE, NOTE_BEND, NOTE_STRING, AMOUNT = 0, 1, 2, 3, 4, 5, 6
NOTE_VIBRATO, NOTE_CUT, EFFECT = 7, 8, 9
KIND_BIT, VALUE_BIT, CHANNEL_BIT = 24, 8, 16
NUMBER, OF_CHANNEL = 0xFF, 0x1F  # masks: of an event's number, and behind it of its channel


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

    `word` is what happens, with bits 32 to 63 of zero: they become `value`.
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
    """Adds parameter `number` at `value`, where a controller on `channel` has moved it by going to `controlled`.

    Returns False if the ring is full. [writing thread]
    """
    word = number | (controlled + 1) << VALUE_BIT | channel << CHANNEL_BIT | np.int64(PARAMETER) << KIND_BIT
    return push_word(address, size, frame, word, np.float32(value))


@jit
def controller_of(word):
    """Returns the value, 0 to 127, of the controller that moved the parameter of an event; -1: none did."""
    return ((word >> VALUE_BIT) & 0xFF) - 1


@jit
def key_channel_of(word):
    """Returns the channel of the key of an event, ANY if it is for those of any channel."""
    channel = ((word >> VALUE_BIT) & OF_CHANNEL) - 1
    return channel if 0 <= channel < ANY else np.int64(ANY)


@entry("int64(int64, int64, int64, int64, int64, float64)")
def push_event(address, size, frame, kind, number, value):
    """C function: adds an event of a `kind` other than MIDI for `frame`; returns 1, or 0 if the ring is full.

    `number` is of the parameter, string or key, 0 to 255. That of a key of one channel alone has this plus one from bit
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
    """Removes the next message, which must be there; returns its word and the value in it. [reading thread]"""
    words = ring_words(address, size)
    tail = words[TAIL]
    place = DATA + ENTRY * (tail % size) + 1
    word, value = words[place], np.float64(samples_at(address + WORD * place, 2)[1])
    store_release(address + WORD * TAIL, tail + 1)
    return word, value


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
    """The MIDI messages that wait in a ring, oldest first: (frame, status, first, second). [reading thread]"""
    entries = ring[DATA:].reshape(-1, ENTRY)
    waiting = entries[np.arange(ring[TAIL], read_word(ring.ctypes.data + WORD * HEAD)) % len(entries)]
    return [(frame, *unpack(word)) for frame, word in waiting.tolist()]


def pop_messages(ring: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Removes and returns the messages that wait in a ring, as `unread` does. [reading thread]"""
    messages = unread(ring)
    write_word(ring.ctypes.data + WORD * TAIL, int(ring[TAIL]) + len(messages))
    return messages
