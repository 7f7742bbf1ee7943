"""The memory of a score that is read: SCORE says where everything is; the shell provides the memory.

A line is a channel of a port. If tracks share a channel and each sets a program of its own, as some software writes
files, each of these tracks is a line. A part is what one track plays on one line. Numbers count from 0.
"""

import numpy as np

from livebass.compiling import SMALL, compiled, inlined
from livebass.kernels.machine.native import bytes_at, record_at, records_at, words_at
from livebass.kernels.player.messages import CONTROL, NOTE_OFF, NOTE_ON
from livebass.kernels.player.performer import CHANNELS
from livebass.kernels.score.records import EXCLUSIVE, FILE, MESSAGE, REMARK, TEMPO, TEXT

jit = compiled(attributes=SMALL)

PROGRAM = 0xC0  # a kind of message
KEYS = 128
PORTS = 256
NONE = -1  # instead of a program, a bank, a part, a track or a place
WORD = 8  # bytes
MAX_BASSES = 16  # parts that are compared
SET = 4  # words of a set of numbers from 0 to 127, 32 in each
# What names say, in a table of bytes: one row a track; a column for each channel's name, and the last for the track's
IS_BASS, IS_OTHER, IS_DRUMS, BASS_INSTRUMENT, NAMED = 1, 2, 4, 8, 16
TRACK_NAME = CHANNELS
NAMES = CHANNELS + 1
# Errors
TOO_LONG, TOO_MUCH = 1, 2

# A message with its frame
TIMED = np.dtype(
    [
        ("frame", "i8"),
        ("line", "i4"),
        ("track", "i4"),
        ("part", "i4"),  # of this track on this line; NONE: it has no notes there
        ("status", "u1"),
        ("first", "u1"),
        ("second", "u1"),
        ("mark", "u1"),  # 1: chosen for the step in hand
    ],
    align=True,
)

# A message to play
PLAYED = np.dtype([("frame", "i8"), ("status", "u1"), ("first", "u1"), ("second", "u1")], align=True)

NOTE = np.dtype(
    [
        ("place", "i8"),  # among the messages
        ("part", "i4"),
        ("program", "i2"),  # of its line or zone at its beginning; NONE: not yet set
        ("bank", "i2"),  # the most significant byte
        ("key", "u1"),
        ("drums", "u1"),
        ("chosen", "u1"),
    ],
    align=True,
)

LINE = np.dtype(
    [
        ("port", "i4"),
        ("channel", "i4"),
        ("root", "i4"),  # the line of its channel, its own number unless it is one track's
        ("home", "i4"),  # first line of its port
        ("first_part", "i4"),  # its parts have consecutive numbers
        ("parts", "i4"),
        ("moved", "i4"),  # messages that bend or colour its notes
        ("waiting", "i8"),  # place of a program change before the next note
        ("program", "i2"),
        ("bank", "i2"),
        ("to", "i2"),  # channel that it is sent on
        ("high", "u1"),  # of the selected parameter; kept by the first line of a port ...
        ("low", "u1"),
        ("system", "u1"),  # ... as is the standard that names its drums (kits.py)
        ("kit", "i1"),  # 1: drums, 0: no drums by system exclusive messages; NONE: neither
        ("zone", "u1"),  # 1: one of the lines of one instrument
        ("split", "u1"),  # 1: its tracks have lines of their own
        ("programmed", "u1"),  # 1: it sets a program
        ("chosen", "u1"),  # 1: it has chosen notes
        ("heard", "u1"),  # 1: its controllers and programs are for chosen notes
        ("played", "u1"),  # 1: it has had a note
        ("changed", "u1"),  # 1: its program has changed after a note
        ("ready", "u1"),  # 1: a bend may begin
        ("sent", "u1"),  # 1: it has messages to play
    ],
    align=True,
)

PART = np.dtype(
    [
        ("line", "i4"),
        ("track", "i4"),
        ("next", "i4"),  # part of the same track; NONE: the last
        ("notes", "i8"),
        ("start", "i8"),  # of its notes in `of_part`
        ("filled", "i8"),
        ("first", "i8"),  # its first note
        ("keys", "i8", (SET,)),
        ("programs", "i8", (SET,)),
        ("chosen", "i8"),  # notes
        ("double", "i4"),  # part that has its notes, too; NONE
        ("wanted", "u1"),  # 1: a line of an instrument that may spread over several
        ("drums", "u1"),  # 1: all notes are drums
        ("unlike", "u1"),  # 1: it is called bass, but its programs are others
    ],
    align=True,
)

TRACK = np.dtype(
    [
        ("seen", "i8"),  # line of its last note
        ("first_part", "i4"),
        ("last_part", "i4"),
        ("lines", "i4"),
        ("bass", "u1"),  # 1: it is called bass and is no drums, even on channel 10
    ],
    align=True,
)

SEGMENT = np.dtype([("tick", "i8"), ("seconds", "i8"), ("rest", "i8"), ("us", "i8")])  # of one tempo: times.py
SENT = np.dtype([("frame", "i8"), ("home", "i8"), ("at", "i8"), ("size", "i8")])  # a system exclusive message

# What cleaning.py needs
CLEANING = np.dtype(
    [
        ("rate", "i8"),
        ("rows", "i8"),  # address of TIMED, by frame
        ("count", "i8"),
        ("marked", "i8"),  # 1: only marked ones
        ("lines", "i8"),  # number
        ("end", "i8"),  # frame at which notes end that nothing ends
        ("out", "i8"),  # address of TIMED
        ("made", "i8"),  # number of these
        ("ended", "i8"),  # notes
        # workspace, addresses of words: two tables by line and key, ...
        ("table", "i8"),
        ("found", "i8"),
        ("strokes", "i8"),  # ... one for each note-on and note-off, ...
        ("frames", "i8"),  # ... and four for each note
        ("ends", "i8"),
        ("order", "i8"),
        ("spare", "i8"),
    ]
)

SCORE = np.dtype(
    [
        # Given: addresses of FILE, its MESSAGE, TEMPO and EXCLUSIVE rows, its bytes, and the table of names
        ("file", "i8"),
        ("messages", "i8"),
        ("tempos", "i8"),
        ("exclusives", "i8"),
        ("data", "i8"),
        ("names", "i8"),
        ("rate", "i8"),  # Hz
        ("take", "i8"),  # 1: a take of livebass: every message stays
        ("memory", "i8"),  # address of memory for the lines ...
        ("bytes", "i8"),  # ... and the size it needs
        ("more", "i8"),  # address of memory for the notes ...
        ("more_bytes", "i8"),
        ("free", "i8"),
        # Found
        ("error", "i8"),  # 0, TOO_LONG or TOO_MUCH
        ("last", "i8"),  # frame of the last note-on or note-off
        ("end", "i8"),  # frame of the end of the file
        ("has_zone", "i8"),
        ("lines_count", "i8"),
        ("max_lines", "i8"),
        ("parts_count", "i8"),
        ("max_parts", "i8"),
        ("events_count", "i8"),
        ("exclusives_count", "i8"),
        ("clean_count", "i8"),
        ("sent_count", "i8"),
        ("played_count", "i8"),
        ("remarks_count", "i8"),
        ("line_remarks", "i8"),  # those that do not depend on the choice
        ("note_ons", "i8"),
        ("note_offs", "i8"),
        ("copies", "i8"),  # events, once tracks are apart
        ("splits", "i8"),  # lines that are split
        # The choice
        ("chosen", "i8"),  # notes
        ("alone", "i8"),  # 1: whole parts; other parts on their lines do not matter
        ("why", "i8"),  # reason of the chosen parts ...
        ("else_why", "i8"),  # ... and of the others
        ("program", "i8"),  # of the first notes; NONE
        ("notes", "i8"),  # note-ons to play
        # State of a pass
        ("segment", "i8"),
        ("zone_program", "i8"),
        ("exclusive", "i8"),
        # Addresses
        ("segments", "i8"),
        ("events", "i8"),
        ("copied", "i8"),
        ("sent_exclusives", "i8"),
        ("lines", "i8"),
        ("parts", "i8"),
        ("tracks", "i8"),
        ("remarks", "i8"),
        ("clean", "i8"),
        ("all_notes", "i8"),
        ("of_part", "i8"),
        ("sent", "i8"),
        ("sent_notes", "i8"),
        ("played", "i8"),
        ("words", "i8", (5,)),  # a number for each note; used by one step after the other
        ("tables", "i8", (3,)),  # the same for each line and key
        ("cleaning", CLEANING),
        ("ranks", "i8", (PORTS,)),  # of the ports with messages; NONE: it has none
        ("heads", "i8", (KEYS + 1,)),
        ("counts", "i8", (KEYS + 1,)),
        ("ranked", "i8", (MAX_BASSES,)),  # parts
    ],
    align=True,
)

# A part as a list shows it
LISTED = np.dtype(
    [
        ("port", "i8"),
        ("channel", "i8"),
        ("track", "i8"),
        ("notes", "i8"),
        ("switches", "i8"),  # note-ons of key switches, not counted as notes
        ("lowest", "i8"),  # 0 without notes
        ("highest", "i8"),
        ("chosen", "i8"),  # notes
        ("drums", "i8"),
        ("why", "i8"),
        ("programs", "i8"),  # number of these ...
        ("banks", "i8"),
        ("program", "u1", (KEYS,)),  # ... by their first note
        ("bank", "u1", (KEYS,)),
    ],
    align=True,
)

file_at, score_at, listed_at, cleaning_at = map(record_at, (FILE, SCORE, LISTED, CLEANING))
messages_at, tempos_at, exclusives_at, remarks_at, texts_at = map(records_at, (MESSAGE, TEMPO, EXCLUSIVE, REMARK, TEXT))
timed_at, played_at, notes_at, lines_at, parts_at = map(records_at, (TIMED, PLAYED, NOTE, LINE, PART))
tracks_at, segments_at, sent_at = map(records_at, (TRACK, SEGMENT, SENT))


@jit
def take_memory(score, size):
    """Takes `size` bytes of the free memory; returns their address."""
    address = score.free
    score.free += (size + WORD - 1) // WORD * WORD
    return address


@jit
def kind_of(row):
    """The kind of a message."""
    return np.int64(row.status) & 0xF0


@jit
def is_note(row):
    """True for a note-on or a note-off."""
    return kind_of(row) in (NOTE_ON, NOTE_OFF)


@jit
def is_control(row, number):
    """True for a message of controller `number`."""
    return kind_of(row) == CONTROL and row.first == number


@jit
def place_of(row):
    """A number for the line and the key of a note."""
    return np.int64(row.line) * KEYS + np.int64(row.first)


@inlined
def lines_of(score):
    """The lines, and one for all of the zone."""
    return lines_at(score.lines, score.max_lines + 1)


@inlined
def parts_of(score):
    """The parts by port, channel and track."""
    return parts_at(score.parts, score.parts_count)


@inlined
def tracks_of(score):
    """The tracks."""
    return tracks_at(score.tracks, file_at(score.file).tracks)


@inlined
def events_of(score):
    """The messages by frame, as the file has them."""
    return timed_at(score.events, score.events_count)


@jit
def name_of(score, track, channel):
    """Returns the bits of the name of a track's channel; `channel` TRACK_NAME: of the track's own."""
    return np.int64(bytes_at(score.names + NAMES * np.int64(track) + channel, 1)[0])


@jit
def add_to(numbers, number):
    """Adds 0 to 127 to a set."""
    numbers[number >> 5] |= np.int64(1) << (number & 31)


@jit
def has(numbers, number):
    """True if a set has 0 to 127."""
    return (numbers[number >> 5] >> (number & 31)) & 1 == 1


@jit
def size_of(numbers):
    """How many numbers a set has."""
    count = 0
    for number in range(KEYS):
        if has(numbers, number):
            count += 1
    return count


@jit
def clear_words(address, count):
    """Sets words to NONE."""
    words_at(address, count)[:] = NONE
