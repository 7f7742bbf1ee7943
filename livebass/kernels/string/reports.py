"""A string's reports for displays: new contacts, and the events it received.

Both are rings in memory whose addresses are in the string's VOICE; with a size of 0 they cost nothing. A counter gives
the total; the latest entries that fit can be read. A string that runs ahead of the clock may go back
(live/thread/ahead.py): its counters go back too, and it rewrites the later entries. So readers keep their own count,
and skip contacts of fine steps that are not heard yet.

REPORTS holds a string's events since it was last still, and its VOICE before the first of them. From there
`begin_again` and the same events, on the same operators, make the same motion, bit for bit; but not if strings changed
operators in between, as under overload. [audio thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.machine.native import copy_record, record_at
from livebass.kernels.string.records import EVENT, STRING, VOICE, on_lines

REPORTS = on_lines(
    [
        ("voice", VOICE),  # before the first event
        ("from_frame", "i8"),  # its frame
    ]
)  # EVENT (report_room,) follows
string_at = record_at(STRING)
event_at = record_at(EVENT)
reports_at = record_at(REPORTS)
REPORTS_BYTES, EVENT_BYTES = REPORTS.itemsize, EVENT.itemsize


@jit
def remember(voice, event):
    """Keeps an event that the string receives now, if its voice has room for events."""
    if voice.report_room == 0:
        return
    if voice.still:
        voice.report_count = 0
    if voice.report_count == 0:
        reports = reports_at(voice.reports)
        copy_record(reports.voice, voice)
        reports.from_frame = voice.frame
    copy_record(event_at(voice.reports + REPORTS_BYTES + EVENT_BYTES * (voice.report_count % voice.report_room)), event)
    voice.report_count += 1


@entry("void(int64, int64)")
def begin_again(string, reports):
    """Sets the new STRING at an address to another string's state before the events of the REPORTS at an address.

    It keeps its own memory: the tone pot's filters, functions, log and events.
    """
    voice = string_at(string).voice
    functions = voice.over_frets, voice.over_board
    tones, log, log_room = voice.tones, voice.log, voice.log_room
    place, room = voice.reports, voice.report_room
    copy_record(voice, reports_at(reports).voice)
    voice.over_frets, voice.over_board = functions
    voice.tones = tones
    voice.log, voice.log_room, voice.logged = log, log_room, np.int64(0)
    voice.reports, voice.report_room, voice.report_count = place, room, np.int64(0)
