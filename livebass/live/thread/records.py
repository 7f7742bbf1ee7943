"""Records that the audio thread and Python share: one prepared bass, the synth it plays on, rings of words.

A ring is an int64 array: words 0 and 8 are its head (next to write) and tail (next to read), each on a cache line
of its own, the entries follow from word 16. One thread writes, one reads; heads and tails only ever grow.
"""

import numpy as np

from livebass.kernels.performer import MOST_EVENTS, MOST_STRINGS
from livebass.kernels.records import GROUP_ROOM, ROW

HEAD, TAIL, ENTRIES = 0, 8, 16
EVENT_WORDS = 2  # frame, or NOW; status | first << 8 | second << 16
NOW = -1
LEAST_MESSAGES, MOST_MESSAGES = 32, 128  # taken into one stretch, by its length; the others wait for the next
EVENT_ROOM = (MOST_MESSAGES + 1) * MOST_EVENTS
CHUNK = 1024  # frames computed at once, at most
HISTOGRAM = 64

# Running ahead of the clock
HORIZON = 768  # frames
SAVE_EVERY, SAVES = 16, 64  # frames between kept states, whole strides; and how many are kept
SOUND_RING = 4096  # frames, more than CHUNK + HORIZON
POINT_ROWS = 6  # kept of each contact point


def kept(points: int) -> int:
    """float64 a slot to keep the state of a string over so many contact points."""
    return 2 * ROW + POINT_ROWS * points + 4 * GROUP_ROOM


AHEAD = np.dtype(
    [
        ("first", "i8"),  # kept states from here ...
        ("saved", "i8"),  # ... up to here are good
        ("frame", "i8", (SAVES,)),  # of each kept state
        ("voice", "i8"),  # addresses: layout.VOICE (SAVES,)
        ("slots", "i8"),  # layout.SLOT (SAVES, VOICE_SLOTS)
        ("memory", "i8"),  # float64 (SAVES, 2 VOICE_SLOTS, kept): q, P, six numbers a contact point, groups of points
        ("kept", "i8"),
        ("sound", "i8"),  # float64 (SOUND_RING,): frame n is at n % SOUND_RING
    ],
    align=True,
)

BASS = np.dtype(
    [
        ("address", "i8"),  # of this record
        ("play_string", "i8"),  # address of the C function ahead.play_string
        ("strings", "i8"),
        ("frets", "i8"),
        ("coarse", "i8"),  # strings that play with the coarse operators, a bit each
        ("operators", "i8", (2,)),  # addresses: layout.OPERATOR (strings, frets + 1), fine and coarse
        ("pool", "i8", (2,)),
        ("pool_size", "i8", (2,)),
        ("string", "i8", (MOST_STRINGS,)),  # layout.STRING
        ("performer", "i8"),
        ("settings", "i8"),
        ("events", "i8"),  # layout.EVENT (EVENT_ROOM,), of all strings
        ("mine", "i8"),  # the same, of one
        ("ahead", "i8", (MOST_STRINGS,)),  # AHEAD of each string
        ("frame", "i8"),  # of the synth, when this bass began
        ("share", "f8"),  # of the time a block lasts: so long strings may run ahead ...
        ("stride", "i8"),  # ... looking at the clock after so many frames
    ],
    align=True,
)

SYNTH = np.dtype(
    [
        ("process", "i8"),  # address of the C function block.process
        ("rate", "f8"),
        ("frame", "i8"),  # next to be computed
        ("clock", "i8"),  # address of clock_gettime, 0: none
        ("clock_kind", "i8"),
        ("time", "i8"),  # ns, at the start of the last block ...
        ("time_frame", "i8"),  # ... whose first frame this was ...
        ("time_frames", "i8"),  # ... and that had so many
        ("adaptive", "i8"),  # overload may coarsen strings
        # basses, as addresses of BASS
        ("bass", "i8"),  # plays, 0: none
        ("next_bass", "i8"),  # put there by Python; taken at a block's start
        ("old_bass", "i8"),  # fades out
        ("free_bass", "i8"),  # has faded out: Python may let it go and writes 0
        ("fade", "i8"),  # frames left of the fade
        # event rings: live, score, the audio thread's own port; and sound for the recorder
        ("ring", "i8", (3,)),
        ("ring_size", "i8", (3,)),
        ("record", "i8"),  # header of a ring and float32 behind it, 0: not recording
        ("record_size", "i8"),
        ("record_lost", "i8"),  # frames
        # where some fields are, for atomic access
        ("time_address", "i8"),
        ("next_address", "i8"),
        ("free_address", "i8"),
        ("record_address", "i8"),
        ("panic_address", "i8"),
        # what was played
        ("channel", "i8"),  # that MIDI ports are heard on, 0-15; -1: all
        ("program", "i8"),  # of the last program change, bank << 8 | program
        ("program_count", "i8"),
        ("bank", "i8"),
        ("panic", "i8"),  # raised by Python, lowered by the audio thread
        ("gain", "f8"),
        ("gain_wanted", "f8"),
        # meters
        ("blocks", "i8"),
        ("messages", "i8"),
        ("busy", "i8"),  # ns of the last block, all of it
        ("load", "f8"),  # of the last block: what it needed, in parts of its time, without running ahead
        ("load_worst", "f8"),  # since Python lowered it
        ("late", "i8"),  # blocks that took longer than they last
        ("underruns", "i8"),  # told by the driver
        ("peak", "f8"),  # since Python lowered it
        ("faults", "i8"),  # frames of a string that were no number
        ("overload", "i8"),  # strings on coarse operators
        ("calm", "i8"),  # frames since the load was last high
        ("histogram", "i8", (HISTOGRAM,)),  # blocks by load: bin 32 + 4 log2(load)
    ],
    align=True,
)


def new_ring(entries: int, words: int) -> np.ndarray:
    """An empty ring of `entries` entries of `words` words."""
    return np.zeros(ENTRIES + entries * words, np.int64)
