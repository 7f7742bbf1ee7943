"""A bass as numbers for any audio rate, INSTRUMENT, and the layout of the image that holds them.

An image is a FILE record, which holds an INSTRUMENT; then a NOTE (preparing.py) for each string and fret;
their modes in each tier, int64 (TIERS, notes); the numbers that the notes point into, float64; the samples of the
effects' impulse response, float64; and a checksum. All words have 8 bytes, little-endian. [any thread]
"""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.effects.records import LONGEST, MAX_RATE, MIN_RATE
from livebass.kernels.machine.native import record_at, words_at
from livebass.kernels.pickup.coil import CIRCUIT_WORDS
from livebass.kernels.player.constants import KEY_MAP_WORDS, KEYS, PLAYER_WORDS, STROKE_WORDS, STROKES
from livebass.kernels.player.performer import ANSWERS_WHEN, MAX_STRINGS
from livebass.kernels.string.preparing import MAX_WORDS, NOTE_BYTES
from livebass.kernels.string.records import LINE, MAX_ANSWERING, MAX_PICKUPS
from livebass.rows.parts import Knobs
from livebass.rows.row import TINY, Word, record, words
from livebass.rows.techniques import CABINETS, LIMITING

jit = compiled(attributes=SMALL)

MAX_FRETS = 127
BEYOND = 0.12  # m of string behind nut and saddle, which stretches too
# Tiers of precision: two qualities, and the fallback for overload
LIVE, STUDIO, COARSE, TIERS = 0, 1, 2, 3
TIER_WORDS = [
    Word("contact_rate", "f8", 8000.0, 64e6),  # Hz, at least
    Word("heavy", "i8", 0, 1),  # 1: it needs most of a processor's time
]
TIER = record(TIER_WORDS)
INSTRUMENT_WORDS = [
    Word("strings", "i8", 1, MAX_STRINGS),
    Word("frets", "i8", 0, MAX_FRETS),
    Word("sensed", "i8", 0, 1),  # 1: the output is the displacement at sensors, 0: through pickups
    Word("slap", "i8", 0, 1),  # 1: the thumb strikes the lower strings
    Word("drop", "i8", 0, 1),  # 1: notes out of range are dropped
    Word("stroke", "i8", 0, STROKES - 1),  # performer.FINGER, PICK, NAIL or POP
    Word("answering", "i8", 0, ANSWERS_WHEN - 1),  # when idle strings may answer, performer.NEVER to WHILE_HELD
    Word("gain", "f8"),
    Word("carried", "f8", TINY, 0.5),  # of the contact rate: the highest mode played
    Word("tiers", TIER_WORDS, shape=(TIERS,)),
    Word("circuit", CIRCUIT_WORDS),
    Word("player", PLAYER_WORDS),
    Word("key_map", KEY_MAP_WORDS),
    Word("part", "f8", 0.0, 1.0, (KEYS,)),  # by velocity: 0 the softest note, 1 the hardest
    Word("wheel_slides", "i8", 0, 1),  # 1: the pitch wheel slides along the frets
    Word("open_note", "i8", 0, 127, (MAX_STRINGS,)),
    Word("answering_modes", "i8", 0, MAX_ANSWERING, (MAX_STRINGS,)),  # of each string: modes that may answer others
    Word("pickups", "i8", 0, MAX_PICKUPS, (MAX_STRINGS,)),  # of each string, and of each pickup:
    Word("decay", "f8", 0.0, shape=(MAX_STRINGS, MAX_PICKUPS)),  # 1/m
    Word("mix", "f8", shape=(MAX_STRINGS, MAX_PICKUPS)),
    Word("across", "f8", shape=(MAX_STRINGS, MAX_PICKUPS)),
    Word("stretch", "f8", shape=(MAX_STRINGS,)),  # N/m, E A over twice the stretching length
    Word("slack", "f8", 1e-3, 1e3, (MAX_STRINGS,)),  # how far a force pulls it, relative to before it was tuned
    Word("called", "i8", 0, 11, (MAX_STRINGS,)),  # pitch class that calls it from key switches
    Word("saddle", "f8", shape=(MAX_STRINGS, MAX_PICKUPS)),  # m, from the saddle; also of sensors, for u and v
    Word("aperture", "f8", 0.0, 1.0, (MAX_STRINGS, MAX_PICKUPS)),  # m
    Word("winding", "f8", 0.0, 1.0, (MAX_STRINGS,)),  # m, pitch of the winding; 0: flatwound
    Word("fretless", "i8", 0, 1, (MAX_STRINGS,)),  # 1: a finger slides along it without steps
    # Of each string: 1 + the index, among the numbers, of the contact heights (m) of its open note by which the hand
    # measures its force, in a row; 0: the note's own heights
    Word("hand", "i8", 0, MAX_WORDS, (MAX_STRINGS,)),
    Word("strokes", STROKE_WORDS, shape=(STROKES,)),
    *words(Knobs),
    Word("cabinet", "i8", 0, len(CABINETS) - 1),  # index in CABINETS
    Word("limiter", "i8", 0, len(LIMITING) - 1),  # and in LIMITING
    Word("response_rate", "f8", MIN_RATE, MAX_RATE),  # Hz
    Word("response_count", "i8", 0, int(LONGEST * MAX_RATE)),  # samples; 0: the effects have no response
]
INSTRUMENT = record(INSTRUMENT_WORDS)
MAGIC = 0x5353_4142_4556_494C  # "LIVEBASS"
FILE = np.dtype(
    [
        ("magic", "i8"),
        ("words", "i8"),  # of the whole image
        ("name", "u1", (64,)),  # UTF-8, padded with zeros
        ("string_names", "u1", (MAX_STRINGS, 16)),
        ("instrument", INSTRUMENT),
    ],
    align=True,
)
file_at = record_at(FILE)
instrument_at = record_at(INSTRUMENT)
FILE_BYTES = FILE.itemsize
WORD = 8  # bytes


@jit
def whole_steps(contact_rate, rate):
    """Fine steps per frame: the smallest whole number that gives `contact_rate` (Hz) or more."""
    return max(1.0, np.ceil(contact_rate / rate - 1e-9))


@jit
def copy_words(source, target, count):
    """Copies `count` words from one address to another."""
    taken, to = words_at(source, count), words_at(target, count)
    for k in range(count):
        to[k] = taken[k]


@jit
def notes_of(file):
    """Number of notes in a file."""
    return file.instrument.strings * (file.instrument.frets + 1)


@jit
def words_before_numbers(file):
    """Words of a file before its numbers."""
    return FILE_BYTES // WORD + notes_of(file) * (NOTE_BYTES // WORD + TIERS)


@jit
def response_of(address):
    """Address of the impulse response in the file at an address."""
    file = file_at(address)
    return address + WORD * (file.words - 1 - file.instrument.response_count)


@jit
def answers_of(instrument, i):
    """Number of modes of the other strings that may answer string `i`."""
    count = 0
    for t in range(instrument.strings):
        if t != i:
            count += instrument.answering_modes[t]
    return count


@jit
def lines(size):
    """`size` bytes, rounded up to whole cache lines."""
    return (size + LINE - 1) // LINE * LINE


@jit
def clear_memory(address, size):
    """Sets `size` bytes to zero, a whole number of words."""
    words_at(address, size // WORD)[:] = 0
