"""Messages to a performer as words of 64 bits: MIDI messages, and events that MIDI lacks. [any thread]

A word has a kind in bits 24 to 31. A MIDI message has its three bytes below; any other event has a number in bits 0 to
23 and a float32, its value, in bits 32 to 63. Most numbers have 8 bits: a parameter, string or key. An event for a
channel's last-played key also has the channel plus one in bits 8 to 12; a parameter moved by a MIDI controller has the
controller's value plus one in bits 8 to 15 and its channel in bits 16 to 19. A STROKE has fields in number and value.
"""

import struct

import numpy as np

from livebass.compiling import jit
from livebass.kernels.player.performer import ANY

KIND_BIT, VALUE_BIT, CHANNEL_BIT = 24, 8, 16
NUMBER, OF_CHANNEL = 0xFF, 0x1F  # masks: of a number with 8 bits, and of the channel above it
STATUS = 0x80  # of MIDI, and above
# Kinds: MIDI; a string's bend, semitones; the pluck position of a key's next note, as PLUCK_POSITION; the bend of the
# string that played a key last, semitones; the string of a key's next note; the vibrato of the string that played a key
# last, 0 to 1; the end of a key's sound, whatever the pedal does. techniques.py has those that set a parameter: 1, 6,
# and 9 to 11.
MIDI, STRING_BEND, NOTE_PLACE, NOTE_BEND, NOTE_STRING, NOTE_VIBRATO, NOTE_CUT = 0, 2, 3, 4, 5, 7, 8
# Kinds for playing by strings, as a tablature does, without keys (tablature.py): a stroke, and its end; a string's own
# wheel, -8192 to 8191, vibrato and expression, 0 to 127 each; and a string at rest, without all these
STROKE, STROKE_END, STRING_WHEEL, STRING_VIBRATO, STRING_EXPRESSION, STRING_REST = range(12, 18)
# Fields of a STROKE: (first bit, bits). In its number: the string; the fret; the velocity; 1: palm-muted; the pick's
# DOWN or UP; a technique held meanwhile (NO_SWITCH: none). A STROKE_END has string and technique, too.
STRING, FRET, VELOCITY, PALMED, DIRECTION, WITH = (0, 3), (3, 6), (9, 7), (16, 1), (17, 2), (19, 5)
# In its value, a whole number: what strikes, as TECHNIQUE; the partial of a harmonic (0: none); the time of a slide, in
# steps of SLIDE_STEP (0: the usual speed); dynamics, in steps of DYNAMICS_STEP above NO_DYNAMICS
STRIKES, PARTIAL, SLOW, LOUDER = (0, 3), (3, 4), (7, 7), (14, 10)
DOWN, UP = 1, 2
DYNAMICS_STEP, NO_DYNAMICS = 0.025, 512  # dB


@jit
def pack(status, first, second):
    """A MIDI message as one word; data bytes have 7 bits, and the kind is MIDI."""
    return np.int64(status) & 0xFF | (np.int64(first) & 0x7F) << 8 | (np.int64(second) & 0x7F) << 16


@jit
def kind_of(word):
    """The kind of a word."""
    return (word >> KIND_BIT) & 0xFF


@jit
def unpack(word):
    """Status, first and second data byte of a packed message; the status of another event is 0."""
    status = word & 0xFF if kind_of(word) == MIDI else np.int64(0)
    return status, (word >> 8) & 0x7F, (word >> 16) & 0x7F


@jit
def plays_strings(kind):
    """True for the kinds of a tablature."""
    return STROKE <= kind <= STRING_REST


@jit
def controller_of(word):
    """Returns the value, 0 to 127, of the controller that moved an event's parameter; -1: no controller."""
    return ((word >> VALUE_BIT) & 0xFF) - 1


@jit
def key_channel_of(word):
    """Returns the channel of an event's key; ANY: any channel."""
    channel = ((word >> VALUE_BIT) & OF_CHANNEL) - 1
    return channel if 0 <= channel < ANY else np.int64(ANY)


@jit
def field(bits, place):
    """The field of a STROKE at a `place` in the `bits` of its number or value."""
    return (bits >> place[0]) & ((1 << place[1]) - 1)


# A message as a row: its frame, and either a MIDI message's three bytes, or an event's kind, which is below 0x80, its
# number and its value
Row = tuple[int, int, int, float]


def word_of(first: int, second: int, third: float) -> int:
    """The word of a row without its frame."""
    if first >= STATUS:
        return first | second << 8 | int(third) << 16
    (bits,) = struct.unpack("<i", struct.pack("<f", third))
    return bits << 32 | first << KIND_BIT | second


def row_of(word: int) -> tuple[int, int, float]:
    """The row, without its frame, of a word."""
    kind = word >> KIND_BIT & 0xFF
    if kind == MIDI:
        return word & 0xFF, word >> 8 & 0x7F, word >> 16 & 0x7F
    (value,) = struct.unpack("<f", struct.pack("<i", word >> 32))
    return kind, word & (1 << KIND_BIT) - 1, value


def joined(fields: dict[tuple[int, int], int]) -> int:
    """A STROKE's number or value of `fields` by their places. Raises ValueError for one that is too large."""
    for (_, bits), value in fields.items():
        if not 0 <= value < 1 << bits:
            raise ValueError(f"{value} has more than {bits} bits")
    return sum(value << first for (first, _), value in fields.items())
