"""Records of a bass in memory: BASS, a prepared instrument, and AHEAD, a string's state for running ahead of the clock.

setup.py makes them; live/thread plays them.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.native import record_at
from livebass.kernels.machine.noise import BAND
from livebass.kernels.player.performer import MAX_EVENTS, MAX_STRINGS
from livebass.kernels.string.records import DOUBLE, GROUP_ROOM, MAX_NEAR, SINGLE, VOICE

EVENT_ROOM = 65 * MAX_EVENTS
SAVES = 64  # saved states that a string keeps
SOUND_RING = 4096  # frames of sound that a string keeps
WORD = 8  # bytes
VOICE_WORDS = VOICE.itemsize // WORD
# Rows saved per mode, per contact point, for u and for v, and per group of points (live/thread/ahead.py)
MODE_ROWS, POINT_ROWS, ACROSS_ROWS, GROUP_ROWS = 2, 7, 3, 4
ANSWER_ROWS = 3  # saved per answer


@jit
def saved_bytes(op):
    """Returns the bytes that save u and v on an operator."""
    modes = MODE_ROWS * (DOUBLE * op.split + SINGLE * (op.padded - op.split))
    groups = GROUP_ROWS * GROUP_ROOM if op.points > MAX_NEAR else 0
    return modes + DOUBLE * (POINT_ROWS * op.points + groups), modes + DOUBLE * ACROSS_ROWS * op.points


AHEAD = np.dtype(
    [
        ("first", "i8"),  # number of the oldest valid saved state ...
        ("saved", "i8"),  # ... and of the next one; state k lies in place k % SAVES
        ("frame", "i8", (SAVES,)),  # of each saved state
        ("voice", "i8"),  # address: int64 (SAVES, VOICE_WORDS), each a VOICE
        ("slots", "i8"),  # address: int64 (SAVES, VOICE_SLOTS, SLOT_STATE), each the state at the head of a SLOT
        ("memory", "i8"),  # address: motion, contact points and groups, of each slot of each saved state: first ...
        ("kept_u", "i8"),  # ... so many bytes of u ...
        ("kept_v", "i8"),  # ... then so many of v
        ("answers", "i8"),  # address: float64 (SAVES, ANSWER_ROWS, MAX_ANSWERS), if strings may answer
        ("sound", "i8"),  # float64 (SOUND_RING,): frame n is at n % SOUND_RING
        ("events", "i8"),  # index of its first event in the bass's string_events ...
        ("count", "i8"),  # ... and number of events, in this chunk
    ],
    align=True,
)

SHELVES = 3  # of the floor's flicker
SHELF = np.dtype([("pole", "f8"), ("low_pass", "f8")])  # part of the way per frame; memory

# The noise of the electronics (floor.py)
FLOOR = np.dtype(
    [
        ("level", "f8"),  # rms at full volume; 0: none
        ("hum", "f8"),  # the same of the hum ...
        ("mains", "f8"),  # ... and its turns per frame
        ("seed", "i8"),
        ("frame", "i8"),  # of the bass
        ("left", "i8"),  # frames until it is silent, if no string sounds:
        ("hold", "i8"),  # after a string has sounded, this many frames ...
        ("fade", "i8"),  # ... and this many for the fade
        ("cut", "i8"),  # frame until which rests fade, because a string was cut
        ("closes", "i8"),  # frame from which it fades and stays closed
        ("heard", "i8"),  # samples since it opened
        ("gain", "f8"),  # volume now ...
        ("gain_wanted", "f8"),  # ... its target ...
        ("gain_pole", "f8"),  # ... and part of the way to it per frame
        ("band", BAND),
        ("flicker", SHELF, (SHELVES,)),
    ],
    align=True,
)

BASS = np.dtype(
    [
        ("play_string", "i8"),  # address of the C function ahead.play_string
        ("strings", "i8"),
        ("frets", "i8"),
        ("coarse", "i8"),  # strings on the coarse operators, a bit each
        ("operators", "i8", (2,)),  # addresses: OPERATOR (strings, frets + 1), fine and coarse
        ("string", "i8", (MAX_STRINGS,)),  # address: STRING
        ("performer", "i8"),
        ("events", "i8"),  # EVENT (EVENT_ROOM,), of all strings
        ("string_events", "i8"),  # EVENT (EVENT_ROOM,), by string
        ("ahead", "i8", (MAX_STRINGS,)),  # AHEAD of each string
        ("frame", "i8"),  # the synth's frame when this bass began
        ("of", "i8"),  # as BUILDING
        ("tones", "i8"),  # the strings' filters (tone.py)
        ("floor", FLOOR),
        ("share", "f8"),  # minimum share of a block's time that strings may take to run ahead; 0: they do not
        ("share_now", "f8"),  # share that two recent blocks took ...
        ("share_once", "f8"),  # ... and the costliest one
        ("stride", "i8"),  # frames between looks at the clock while running ahead
        ("effects", "i8"),  # EFFECTS for the mix of its strings
    ],
    align=True,
)

bass_at = record_at(BASS)
ahead_at = record_at(AHEAD)
