"""Records of a bass in memory: BASS, a prepared instrument, and AHEAD, what a string keeps to run ahead of the clock.

setup.py makes them; live/thread plays them.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.native import record_at
from livebass.kernels.machine.noise import BAND
from livebass.kernels.player.performer import MOST_EVENTS, MOST_STRINGS
from livebass.kernels.string.records import GROUP_ROOM, MOST_NEAR, VOICE

EVENT_ROOM = 129 * MOST_EVENTS
SAVES = 64  # saved states that a string keeps
SOUND_RING = 4096  # frames of a string's sound that it keeps
WORD = 8  # bytes
VOICE_WORDS = VOICE.itemsize // WORD
POLARISATIONS = 2  # u and v
POINT_ROWS, GROUP_ROWS = 7, 4  # saved of each contact point, and of each group of them (live/thread/ahead.py)


@jit
def kept(modes, points):
    """Returns the float64 that save the motion of one polarisation: `modes`, padded, over `points` contact points."""
    return 2 * modes + POINT_ROWS * points + (GROUP_ROWS * GROUP_ROOM if points > MOST_NEAR else 0)


AHEAD = np.dtype(
    [
        ("first", "i8"),  # number of the oldest valid saved state ...
        ("saved", "i8"),  # ... and of the next one; state k lies in place k % SAVES
        ("frame", "i8", (SAVES,)),  # of each saved state
        ("voice", "i8"),  # address: int64 (SAVES, VOICE_WORDS), each a VOICE
        ("slots", "i8"),  # address: int64 (SAVES, VOICE_SLOTS, SLOT_STATE), each the state at the head of a SLOT
        ("memory", "i8"),  # address: float64 (SAVES, VOICE_SLOTS, POLARISATIONS, kept): motion, contact points, groups
        ("kept", "i8"),
        ("answers", "i8"),  # address: float64 (SAVES, 2, MOST_ANSWERS), where strings may answer
        ("sound", "i8"),  # float64 (SOUND_RING,): frame n is at n % SOUND_RING
        ("events", "i8"),  # place of its first event among the string_events of the bass ...
        ("count", "i8"),  # ... and how many there are, in this chunk
    ],
    align=True,
)

# The noise of the electronics (floor.py)
FLOOR = np.dtype(
    [
        ("level", "f8"),  # rms at full volume; 0: there is none
        ("seed", "i8"),
        ("frame", "i8"),  # of the bass
        ("left", "i8"),  # frames until it is silent, if no string sounds ...
        ("hold", "i8"),  # ... which are so many and ...
        ("fade", "i8"),  # ... so many that it fades in, after one has sounded
        ("cut", "i8"),  # frame until which rests fade, as a string was cut
        ("closes", "i8"),  # frame from which it fades, and opens no more
        ("heard", "i8"),  # samples of it since it opened
        ("gain", "f8"),  # volume, now ...
        ("gain_wanted", "f8"),  # ... where it goes ...
        ("gain_pole", "f8"),  # ... and part of the way there each frame
        ("band", BAND),
    ],
    align=True,
)

BASS = np.dtype(
    [
        ("play_string", "i8"),  # address of the C function ahead.play_string
        ("strings", "i8"),
        ("frets", "i8"),
        ("coarse", "i8"),  # strings that play with the coarse operators, a bit each
        ("operators", "i8", (2,)),  # addresses: OPERATOR (strings, frets + 1), fine and coarse
        ("string", "i8", (MOST_STRINGS,)),  # address: STRING
        ("performer", "i8"),
        ("events", "i8"),  # EVENT (EVENT_ROOM,), of all strings
        ("string_events", "i8"),  # EVENT (EVENT_ROOM,), by string
        ("ahead", "i8", (MOST_STRINGS,)),  # AHEAD of each string
        ("frame", "i8"),  # of the synth, when this bass began
        ("tones", "i8"),  # the strings' filters (tone.py)
        ("floor", FLOOR),
        ("share", "f8"),  # of a block's time that strings may take at least to run ahead; 0: they do not
        ("share_now", "f8"),  # as much as two blocks lately took ...
        ("share_once", "f8"),  # ... and the costliest one
        ("stride", "i8"),  # frames between looks at the clock while they do
        ("effects", "i8"),  # EFFECTS of the mix of its strings
    ],
    align=True,
)

bass_at = record_at(BASS)
ahead_at = record_at(AHEAD)
