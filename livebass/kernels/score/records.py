"""Records of a score in memory: what a Standard MIDI File holds, row by row, and what is odd about it."""

import numpy as np

NO_CHANNEL = -1
MARKED = 0x101  # a kind of text, beside the numbers of meta events

# The header of a file, and the number of its rows
FILE = np.dtype(
    [
        ("kind", "i8"),  # 0, 1 or 2
        ("promised", "i8"),  # tracks, by the header
        ("tracks", "i8"),  # that were read
        ("played", "i8"),  # the track that plays of a file of patterns; -1: all
        ("per_quarter", "i8"),  # ticks; 0 if time is in SMPTE frames
        ("per_second", "i8", (2,)),  # ticks: numerator, denominator; (0, 1) if time is in quarter notes
        ("end", "i8"),  # tick of the last track to end
        ("messages", "i8"),  # number of rows of each kind
        ("tempos", "i8"),
        ("meters", "i8"),
        ("exclusives", "i8"),
        ("texts", "i8"),
        ("remarks", "i8"),
        ("text_rows", "i8"),  # address of the TEXT rows
        ("casm", "i8"),  # first byte in the chunk of a style (styles.py) ...
        ("casm_size", "i8"),  # ... and how many it has; 0: the file is no style
        ("error", "i8"),  # code; 0: none
        ("numbers", "i8", (6,)),  # of the error
    ],
    align=True,
)

# A channel message; rows are sorted by tick, track and place in the track
MESSAGE = np.dtype(
    [
        ("tick", "i8"),
        ("track", "i4"),  # from 0
        ("port", "i2"),  # from 0
        ("status", "u1"),
        ("first", "u1"),  # data byte: a note, a controller or a program ...
        ("second", "u1"),  # ... a velocity or a value; 0 if the message has none
    ],
    align=True,
)

TEMPO = np.dtype([("tick", "i8"), ("us", "i8")])  # us per quarter note; rows by tick
METER = np.dtype([("tick", "i8"), ("over", "i8"), ("under", "i8")])  # a bar has 4 * over / under quarter notes; by tick
EXCLUSIVE = np.dtype([("tick", "i8"), ("port", "i8"), ("at", "i8"), ("size", "i8")])  # bytes without F0 and F7; by tick

# A text, a marker, or a name of a track, its instrument or one of its channels
TEXT = np.dtype(
    [
        ("tick", "i8"),
        ("track", "i8"),
        ("channel", "i8"),  # of a channel's name; NO_CHANNEL: of the track
        ("kind", "i8"),  # number of the meta event; MARKED: a text that begins with MARK (smf.py)
        ("at", "i8"),  # its bytes
        ("size", "i8"),
    ]
)

REMARK = np.dtype([("code", "i8"), ("numbers", "i8", (6,))])  # what is odd, and its numbers: the shells have the words

# Kinds of rows
MESSAGES, TEMPOS, METERS, EXCLUSIVES, TEXTS, REMARKS = range(6)
ROWS = {
    "MESSAGE": MESSAGE, "TEMPO": TEMPO, "METER": METER, "EXCLUSIVE": EXCLUSIVE, "TEXT": TEXT, "REMARK": REMARK,
}  # fmt: skip
ROW_BYTES = np.array([row.itemsize for row in ROWS.values()])
ODDITIES = 4  # kinds of damage that are counted over the whole file

# A file that is read
SMF = np.dtype(
    [
        ("file", FILE),  # what is found
        ("data", "i8"),  # address of the file's bytes
        ("size", "i8"),
        ("memory", "i8"),  # address of `room` bytes for rows, a multiple of 8
        ("room", "i8"),  # `measure_smf` sets it
        ("rows", "i8", (len(ROWS),)),  # address of the rows of each kind
        # Workspace
        ("count", "i8", (len(ROWS),)),  # rows of each kind so far ...
        ("counted", "i8", (len(ROWS),)),  # ... and those for which there is memory
        ("header", "i8"),  # the byte at which the header begins; places count from there
        ("length", "i8"),  # bytes from there on
        ("at", "i8"),  # the next byte to read ...
        ("limit", "i8"),  # ... and the end of what may be read
        ("another", "i8"),  # the next header behind `at`; `length`: none; -1: not looked for
        ("sounding", "i8"),  # the first track with messages; -1: none
        ("odd_row", "i8", (ODDITIES,)),  # the remark about each kind of damage; -1: none
        # Of the track that is being read
        ("before", "i8", (len(ROWS),)),  # `count` at its beginning
        ("tick", "i8"),
        ("ended", "i8"),  # 1: by its End of Track
        ("running", "i8"),  # status; 0: none yet
        ("port", "i8"),
        ("ports", "i8"),  # the only port that it sets; NONE or SEVERAL
        ("prefix", "i8"),  # the channel of the names that follow, or NO_CHANNEL
        ("named", "i8"),  # a bit for each channel and kind of name that it has
        ("odd", "i8", (ODDITIES,)),  # number of each kind of damage
        ("odd_at", "i8", (ODDITIES,)),  # byte of the first
    ],
    align=True,
)
