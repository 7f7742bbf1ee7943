"""What a string tells those who look at it: the contacts that begin, and the events that it was handed.

Both are rings, in memory that the string's VOICE has the addresses of; with room for none they cost nothing. A counter
says how many there have been, the last so many as there is room for can be read. A string that runs ahead of the clock
may go back (live/thread/ahead.py): the counters go back with it, and the entries that it had come to are written anew.
So a reader keeps a count of its own, and takes no contact of a fine step that is not heard yet.

TOLD holds a string's events since it was last still, and its VOICE as it was before the first of them. From there
`begin_again` and the same events, on the same operators, make the same motion, bit for bit; but not if strings changed
to other operators in between, as under overload. [audio thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.machine.native import copy_record, record_at
from livebass.kernels.string.records import EVENT, STRING, VOICE, on_lines

TOLD = on_lines(
    [
        ("voice", VOICE),  # before the first event
        ("from_frame", "i8"),  # of that
    ]
)  # EVENT (told_room,) behind
string_at = record_at(STRING)
event_at = record_at(EVENT)
told_at = record_at(TOLD)
TOLD_BYTES, EVENT_BYTES = TOLD.itemsize, EVENT.itemsize


@jit
def remember(voice, event):
    """Keeps an event that the string is handed now, if its voice has room for any."""
    if voice.told_room == 0:
        return
    if voice.still:
        voice.told_count = 0
    if voice.told_count == 0:
        told = told_at(voice.told)
        copy_record(told.voice, voice)
        told.from_frame = voice.frame
    copy_record(event_at(voice.told + TOLD_BYTES + EVENT_BYTES * (voice.told_count % voice.told_room)), event)
    voice.told_count += 1


@entry("void(int64, int64)")
def begin_again(string, told):
    """Puts the STRING at an address, as new, to where another one was before the events of a TOLD at an address.

    What is in memory of its own stays: the filters of the tone pot, functions, its log and its events.
    """
    voice = string_at(string).voice
    functions = voice.over_frets, voice.over_board
    tones, log, log_room = voice.tones, voice.log, voice.log_room
    place, room = voice.told, voice.told_room
    copy_record(voice, told_at(told).voice)
    voice.over_frets, voice.over_board = functions
    voice.tones = tones
    voice.log, voice.log_room, voice.logged = log, log_room, np.int64(0)
    voice.told, voice.told_room, voice.told_count = place, room, np.int64(0)
