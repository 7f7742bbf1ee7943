"""Standard MIDI Files: from bytes to rows (records.py).

Real files have harmless damage, which only causes a remark: a header with the wrong number of tracks, wrong track
lengths, stray bytes before the header or between chunks, data bytes above 0x7F, real-time messages within a track,
impossible tempos. From a RIFF file (.rmi) it reads the file inside. Other damage is an error.

`measure_smf` reads a file and counts its rows, at most MAX_EVENTS; `fill_smf` reads it again and writes them. Errors
and remarks are codes with numbers; where a place is named, these begin with the track, from 1, the number of tracks,
and the byte, from the header's first. [any thread but audio]
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.machine.native import bytes_at, record_at
from livebass.kernels.score.merging import sort_rows
from livebass.kernels.score.records import (
    EXCLUSIVE,
    EXCLUSIVES,
    MARKED,
    MESSAGE,
    MESSAGES,
    METER,
    METERS,
    NO_CHANNEL,
    ODDITIES,
    REMARK,
    REMARKS,
    ROW_BYTES,
    SMF,
    TEMPO,
    TEMPOS,
    TEXT,
    TEXTS,
)

jit = compiled(attributes=SMALL)
smf_at, message_at, exclusive_at, remark_at = map(record_at, (SMF, MESSAGE, EXCLUSIVE, REMARK))
tempo_at, meter_at, text_at = map(record_at, (TEMPO, METER, TEXT))

MARK = "livebass plays "  # begins the text in a take that names its bass
MARK_BYTES = np.frombuffer(MARK.encode(), np.uint8)
MAX_BEFORE = 4096  # bytes before the header: a MacBinary file has 128
CHUNK_HEAD = 8  # bytes: name and length
MAX_CHUNKS = 256  # of other kinds in a row; more are stray bytes, or a damaged file could take minutes
WORD = 8  # bytes
MTHD, MTRK, RIFF, RMID, DATA, CASM = (
    int.from_bytes(name) for name in (b"MThd", b"MTrk", b"RIFF", b"RMID", b"data", b"CASM")
)
MAX_EVENTS = 1_000_000  # that are kept: a score takes up to 400 bytes for each
META_TEXT, META_TRACK_NAME, META_INSTRUMENT, META_MARKER, META_CHANNEL, META_PORT = 0x01, 0x03, 0x04, 0x06, 0x20, 0x21
META_END, META_TEMPO, META_METER = 0x2F, 0x51, 0x58
MAX_UNDER = 7  # of a meter: the power of two of a bar's unit
NONE, SEVERAL = -1, -2  # ports that a track sets
# Data bytes of the system messages from 0xF0 on; exclusive ones and meta events have a length instead
SYSTEM_BYTES = np.array([0, 1, 2, 1, *[0] * 12])
# Rates of SMPTE, frames/s as a fraction, by the number in the header
SMPTE_RATES = np.array([(24, 24, 1), (25, 25, 1), (29, 30_000, 1001), (30, 30, 1)])

GOOD = 0
# Errors without a place, or in the header
EMPTY, NO_MIDI, FOREIGN, SHORT_HEADER, BAD_KIND, NO_TICKS, BAD_TIME_CODE = range(1, 8)
# Errors with a place: no track; a data byte, the fourth number, without a status
NO_TRACK, NO_STATUS = 8, 9
TOO_MANY = 10  # events, the fourth number
# With the part: CUT, bytes that it has and that are left; LONG, a number longer than 4 bytes
CUT, LONG = 16, 32
(
    HEADER_LENGTH, HEADER, CHUNK_NAME, CHUNK, DELTA_TIME, EVENT, META_EVENT, META_LENGTH, EXCLUSIVE_LENGTH,
    EXCLUSIVE_DATA, SYSTEM_MESSAGE, MESSAGE_DATA,
) = range(12)  # fmt: skip
# Remarks. The first ODDITIES are counted: the number, and the place of the first. Then: bytes before the header; track,
# tracks and bytes by which a chunk's length is wrong; tracks read and promised; patterns, and the one that plays
STRAYS, BAD_TEMPOS, SYSTEMS, HIGH_BYTES, BEFORE, SHORTER, LONGER, FEWER, MORE, PATTERNS = range(10)


@jit
def fail(smf, code, at, first, second):
    """Sets an error with its place and two numbers; returns False."""
    track = smf.file.tracks + 1
    smf.file.error = code
    smf.file.numbers[0], smf.file.numbers[1], smf.file.numbers[2] = track, max(track, smf.file.promised), at
    smf.file.numbers[3], smf.file.numbers[4] = first, second
    return False


@jit
def new_row(smf, kind):
    """Counts a further row of a kind; returns its address, or 0 if it is not kept.

    A track that is read twice may have more rows the first time than memory.
    """
    if kind != REMARKS and smf.file.played >= 0 and smf.file.played != smf.file.tracks:
        return np.int64(0)
    k = smf.count[kind]
    smf.count[kind] = k + 1
    return smf.rows[kind] + ROW_BYTES[kind] * k if smf.memory and k < smf.counted[kind] else np.int64(0)


@jit
def remark(smf, code, first, second, third, fourth):
    """Adds a remark with up to four numbers."""
    address = new_row(smf, REMARKS)
    if address:
        row = remark_at(address)
        row.code = code
        row.numbers[0], row.numbers[1], row.numbers[2], row.numbers[3] = first, second, third, fourth
        row.numbers[4], row.numbers[5] = 0, 0


@jit
def remark_odd(smf, code, count, at):
    """Counts damage, which begins at byte `at`, in the one remark about its kind."""
    k = smf.odd_row[code]
    if k < 0:
        smf.odd_row[code] = smf.count[REMARKS]
        track = smf.file.tracks + 1
        remark(smf, code, count, track, max(track, smf.file.promised), at)
    elif smf.memory:
        remark_at(smf.rows[REMARKS] + ROW_BYTES[REMARKS] * k).numbers[0] += count


@jit
def odd(smf, code, at):
    """Counts damage within a track."""
    if smf.odd[code] == 0:
        smf.odd_at[code] = at
    smf.odd[code] += 1


@jit
def number_at(data, at, count):
    """The number in `count` bytes, the highest first."""
    value = np.int64(0)
    for k in range(count):
        value = value << 8 | np.int64(data[at + k])
    return value


@jit
def stands(smf, data, at, name):
    """True if a name of four letters stands at `at`."""
    return at + 4 <= smf.length and number_at(data, at, 4) == name


@jit
def find(data, at, end, name):
    """The first place of a name of four letters that lies entirely from `at` to `end`; -1: nowhere."""
    for place in range(at, end - 3):
        if np.int64(data[place]) == name >> 24 and number_at(data, place, 4) == name:
            return np.int64(place)
    return np.int64(-1)


@jit
def is_chunk(smf, data, at):
    """True if a chunk may begin here: a track, or four printable characters and a length within the smf."""
    if stands(smf, data, at, MTRK):
        return True
    if at + CHUNK_HEAD > smf.length or at + CHUNK_HEAD + number_at(data, at + 4, 4) > smf.length:
        return False
    printable = True
    for k in range(4):
        printable = printable and 0x20 <= data[at + k] < 0x7F
    return printable


@jit
def skip(smf, count, part):
    """Moves past the `count` bytes of a part; returns their beginning, or -1 if they are not there."""
    if smf.at + count > smf.limit:
        fail(smf, CUT + part, smf.at, count, smf.limit - smf.at)
        return np.int64(-1)
    smf.at += count
    return smf.at - count


@jit
def read_quantity(smf, data, part):
    """Reads a variable-length quantity of at most 4 bytes; -1: an error."""
    start, value = smf.at, np.int64(0)
    for _ in range(4):
        at = skip(smf, 1, part)
        if at < 0:
            return np.int64(-1)
        value = value << 7 | np.int64(data[at]) & 0x7F
        if data[at] < 0x80:
            return value
    fail(smf, LONG + part, start, 0, 0)
    return np.int64(-1)


@jit
def read_message(smf, data, start):
    """Reads the data of a channel message with the running status; False: an error."""
    status = smf.running
    size = 1 if status >> 4 == 0xC or status >> 4 == 0xD else 2
    at = skip(smf, size, MESSAGE_DATA)
    if at < 0:
        return False
    first, second = np.int64(data[at]), np.int64(data[at + size - 1]) if size > 1 else np.int64(0)
    if first > 0x7F or second > 0x7F:
        odd(smf, HIGH_BYTES, start)
    address = new_row(smf, MESSAGES)
    if address:
        row = message_at(address)
        row.tick, row.track, row.port, row.status = smf.tick, smf.file.tracks, smf.port, status
        row.first, row.second = min(first, 0x7F), min(second, 0x7F)
    return True


@jit
def read_exclusive(smf, data, status):
    """Reads a system exclusive message, or the rest of one; False: an error."""
    size = read_quantity(smf, data, EXCLUSIVE_LENGTH)
    at = skip(smf, size, EXCLUSIVE_DATA) if size >= 0 else np.int64(-1)
    if at < 0:
        return False
    address = new_row(smf, EXCLUSIVES) if status == 0xF0 else np.int64(0)
    if address:
        row = exclusive_at(address)
        row.tick, row.port, row.at = smf.tick, smf.port, smf.header + at
        row.size = size - 1 if size > 0 and data[at + size - 1] == 0xF7 else size
    return True


@jit
def add_text(smf, kind, at, size):
    """Adds a text or a name."""
    address = new_row(smf, TEXTS)
    if address:
        row = text_at(address)
        row.tick, row.track, row.channel = smf.tick, smf.file.tracks, smf.prefix
        row.kind, row.at, row.size = kind, smf.header + at, size


@jit
def is_mark(data, at, size):
    """True if a text begins with MARK."""
    same = 0
    while same < min(size, len(MARK_BYTES)) and data[at + same] == MARK_BYTES[same]:
        same += 1
    return same == len(MARK_BYTES)


@jit
def take_text(smf, data, kind, at, size):
    """Keeps a mark, a marker, a text at the beginning, and the first name of each kind of a track or a channel."""
    if kind == META_MARKER:
        add_text(smf, kind, at, size)
        return
    if kind == META_TEXT:
        if is_mark(data, at, size):
            add_text(smf, MARKED, at, size)
        elif smf.tick == 0:
            add_text(smf, META_TEXT, at, size)
        return
    bit = np.int64(1) << 2 * (smf.prefix - NO_CHANNEL) + (kind == META_INSTRUMENT)
    if smf.named & bit == 0:
        smf.named |= bit
        add_text(smf, kind, at, size)


@jit
def take_time(smf, data, kind, at, size, start):
    """Keeps a tempo or a meter."""
    if kind == META_TEMPO:
        if size != 3 or number_at(data, at, 3) == 0:
            odd(smf, BAD_TEMPOS, start)
            return
        address = new_row(smf, TEMPOS)
        if address:
            row = tempo_at(address)
            row.tick, row.us = smf.tick, number_at(data, at, 3)
    elif size > 1 and data[at] > 0 and data[at + 1] <= MAX_UNDER:
        address = new_row(smf, METERS)
        if address:
            row = meter_at(address)
            row.tick, row.over, row.under = smf.tick, np.int64(data[at]), np.int64(1) << np.int64(data[at + 1])


@jit
def read_meta(smf, data, start):
    """Reads a meta event; False: an error."""
    kind_at = skip(smf, 1, META_EVENT)
    size = read_quantity(smf, data, META_LENGTH) if kind_at >= 0 else np.int64(-1)
    at = skip(smf, size, META_EVENT) if size >= 0 else np.int64(-1)
    if at < 0:
        return False
    kind = np.int64(data[kind_at])
    if kind == META_END:
        smf.ended = 1
    elif kind in (META_TEMPO, META_METER):
        take_time(smf, data, kind, at, size, start)
    elif kind in (META_TEXT, META_TRACK_NAME, META_INSTRUMENT, META_MARKER):
        take_text(smf, data, kind, at, size)
    elif kind == META_CHANNEL and size > 0 and data[at] < 16:
        smf.prefix = np.int64(data[at])
    elif kind == META_PORT and size > 0:
        smf.port = np.int64(data[at])
        smf.ports = smf.port if smf.ports == NONE or smf.ports == smf.port else np.int64(SEVERAL)
    return True


@jit
def read_event(smf, data):
    """Reads a delta time and an event; False: an error."""
    delta = read_quantity(smf, data, DELTA_TIME)
    start = skip(smf, 1, EVENT) if delta >= 0 else np.int64(-1)
    if start < 0:
        return False
    smf.tick += delta
    status = np.int64(data[start])
    if status == 0xFF:
        return read_meta(smf, data, start)
    if status == 0xF0 or status == 0xF7:
        return read_exclusive(smf, data, status)
    if status > 0xEF:
        odd(smf, SYSTEMS, start)
        return skip(smf, SYSTEM_BYTES[status & 0x0F], SYSTEM_MESSAGE) >= 0
    if status < 0x80:
        if smf.running == 0:
            return fail(smf, NO_STATUS, start, status, 0)
        smf.at = start
    else:
        smf.running, smf.prefix = status, NO_CHANNEL
    return read_message(smf, data, start)


@jit
def read_track(smf, data, start, end):
    """Reads a track from `start` to its End of Track or `end`, and forgets an earlier try; False: an error."""
    for kind in range(REMARKS):
        smf.count[kind] = smf.before[kind]
    smf.odd[:] = 0
    smf.file.error, smf.at, smf.limit = GOOD, start, end
    smf.tick, smf.ended, smf.running, smf.port, smf.named = 0, 0, 0, 0, 0
    smf.ports, smf.prefix = NONE, NO_CHANNEL
    while smf.at < end and smf.ended == 0:
        if not read_event(smf, data):
            return False
    if smf.ports >= 0 and smf.memory:
        set_port(smf)
    return True


@jit
def set_port(smf):
    """Gives the track's messages its only port, which holds for the whole track, wherever it appears."""
    for k in range(smf.before[MESSAGES], min(smf.count[MESSAGES], smf.counted[MESSAGES])):
        message_at(smf.rows[MESSAGES] + ROW_BYTES[MESSAGES] * k).port = smf.ports
    for k in range(smf.before[EXCLUSIVES], min(smf.count[EXCLUSIVES], smf.counted[EXCLUSIVES])):
        exclusive_at(smf.rows[EXCLUSIVES] + ROW_BYTES[EXCLUSIVES] * k).port = smf.ports


@jit
def read_to_its_mark(smf, data, start, end):
    """Reads a track from `start` whose chunk claims a wrong `end`; False: an error."""
    following = find(data, start, smf.length, MTRK)
    good = read_track(smf, data, start, following if following >= 0 else smf.length)
    if good and (smf.ended != 0 or following >= 0 or end > smf.length):
        return True
    if end > smf.length:
        smf.at, smf.limit = start, smf.length
        return skip(smf, end - start, CHUNK) >= 0  # cut off within an event
    return read_track(smf, data, start, end)


@jit
def remark_track(smf):
    """Adds the damage within a track to the remarks, in its order."""
    for _ in range(ODDITIES):
        first = -1
        for code in range(ODDITIES):
            if smf.odd[code] > 0 and (first < 0 or smf.odd_at[code] < smf.odd_at[first]):
                first = code
        if first >= 0:
            remark_odd(smf, first, smf.odd[first], smf.odd_at[first])
            smf.odd[first] = 0


@jit
def read_next_track(smf, data):
    """Reads the track chunk at which the file is, and moves behind it; False: an error.

    A track ends with its chunk. If the chunk's length is wrong, as neither a chunk nor the end of the file follows it,
    the track ends at its End of Track, or where the next track begins.
    """
    start = smf.at + CHUNK_HEAD
    end = start + number_at(data, start - 4, 4)
    for kind in range(REMARKS):
        smf.before[kind] = smf.count[kind]
    if end == smf.length or is_chunk(smf, data, end):
        if not read_track(smf, data, start, end):
            return False
        if smf.ended == 0 or not stands(smf, data, smf.at, MTRK):
            smf.at = end
    elif not read_to_its_mark(smf, data, start, end):
        return False
    remark_track(smf)
    track = smf.file.tracks + 1
    if smf.at != end:
        code = SHORTER if smf.at < end else LONGER
        remark(smf, code, track, max(track, smf.file.promised), abs(end - smf.at), 0)
    if smf.sounding < 0 and smf.count[MESSAGES] > smf.before[MESSAGES]:
        smf.sounding = smf.file.tracks
    if smf.file.played < 0 or smf.file.played == smf.file.tracks:
        smf.file.end = max(smf.file.end, smf.tick)
    smf.file.tracks += 1
    return True


@jit
def is_foreign(smf, data, at):
    """True if a chunk that is no header and no track may begin here."""
    return is_chunk(smf, data, at) and not stands(smf, data, at, MTHD) and not stands(smf, data, at, MTRK)


@jit
def seek_track(smf, data):
    """Moves to the next track chunk, past other chunks and stray bytes.

    False if there is none, or another file begins first. A style's track ends with a chunk CASM; tracks within the
    chunks behind it set up the panel of a keyboard.
    """
    at, passed = smf.at, 0
    while passed < MAX_CHUNKS and is_foreign(smf, data, at):
        if stands(smf, data, at, CASM) and smf.file.tracks >= max(smf.file.promised, 1):
            smf.file.casm, smf.file.casm_size = smf.header + at + CHUNK_HEAD, number_at(data, at + 4, 4)
            return False
        at += CHUNK_HEAD + number_at(data, at + 4, 4)
        passed += 1
    if not stands(smf, data, at, MTRK):
        if smf.another < smf.at:
            found = find(data, smf.at, smf.length, MTHD)
            smf.another = found if found >= 0 else smf.length
        at = find(data, smf.at, smf.another, MTRK)
        if at >= 0:
            remark_odd(smf, STRAYS, 1, smf.at)
    if at < 0 or at + CHUNK_HEAD > smf.length:
        return False
    smf.at = at
    return True


@jit
def seek_header(smf):
    """Finds the header, in a RIFF file or behind stray bytes; False: an error."""
    data = bytes_at(smf.data, smf.size)
    smf.header, smf.length = 0, smf.size
    if smf.size == 0:
        return fail(smf, EMPTY, 0, 0, 0)
    if stands(smf, data, 0, RIFF) and stands(smf, data, 8, RMID):
        at = np.int64(12)
        while not stands(smf, data, at, DATA) or at + CHUNK_HEAD > smf.size:
            if at + CHUNK_HEAD > smf.size:
                return fail(smf, NO_MIDI, 0, 0, 0)
            size = little_at(data, at + 4)
            at += CHUNK_HEAD + size + size % 2
        smf.header = at + CHUNK_HEAD
        smf.length = min(little_at(data, at + 4), smf.size - smf.header)
    start = find(data, smf.header, smf.header + min(smf.length, MAX_BEFORE), MTHD)
    if start < 0:
        return fail(smf, FOREIGN, 0, 0, 0)
    if start > smf.header:
        remark(smf, BEFORE, start - smf.header, 0, 0, 0)
    smf.length -= start - smf.header
    smf.header = start
    return True


@jit
def little_at(data, at):
    """The number in four bytes, the lowest first."""
    value = np.int64(0)
    for k in range(4):
        value |= np.int64(data[at + k]) << 8 * k
    return value


@jit
def read_header(smf, data):
    """Reads the header; False: an error."""
    smf.at, smf.limit = 4, smf.length
    at = skip(smf, 4, HEADER_LENGTH)
    if at < 0:
        return False
    size = number_at(data, at, 4)
    if size < 6:
        return fail(smf, SHORT_HEADER, 0, size, 0)
    at = skip(smf, size, HEADER)
    if at < 0:
        return False
    smf.file.kind, smf.file.promised = number_at(data, at, 2), number_at(data, at + 2, 2)
    if smf.file.kind > 2:
        return fail(smf, BAD_KIND, 0, smf.file.kind, 0)
    return take_division(smf, number_at(data, at + 4, 2))


@jit
def take_division(smf, word):
    """Sets the ticks per quarter note or per second; False: an error."""
    smf.file.per_quarter, smf.file.per_second[0], smf.file.per_second[1] = 0, 0, 1
    if word & 0x8000 == 0:
        smf.file.per_quarter = word
        return word > 0 or fail(smf, NO_TICKS, 0, 0, 0)
    frames, ticks = 256 - (word >> 8), word & 0xFF
    for k in range(len(SMPTE_RATES)):
        if SMPTE_RATES[k, 0] == frames and ticks > 0:
            smf.file.per_second[0], smf.file.per_second[1] = SMPTE_RATES[k, 1] * ticks, SMPTE_RATES[k, 2]
            return True
    return fail(smf, BAD_TIME_CODE, 0, frames, ticks)


@jit
def read_tracks(smf, data):
    """Reads all tracks; False: an error."""
    behind = smf.at
    while seek_track(smf, data):
        if not read_next_track(smf, data):
            return False
    if smf.file.tracks == 0:
        smf.at, smf.limit = behind, smf.length
        return skip(smf, 4, CHUNK_NAME) >= 0 and fail(smf, NO_TRACK, smf.at, 0, 0)
    if smf.file.tracks < smf.file.promised:
        remark(smf, FEWER, smf.file.tracks, smf.file.promised, 0, 0)
    elif smf.file.tracks > smf.file.promised:
        remark(smf, MORE, smf.file.tracks, smf.file.promised, 0, 0)
    if smf.file.played >= 0:
        remark(smf, PATTERNS, smf.file.tracks, smf.file.played + 1, 0, 0)
    return True


@jit
def read_file(smf):
    """Reads a file from its beginning; False: an error."""
    smf.count[:] = 0
    smf.odd_row[:] = -1
    smf.file.error, smf.file.promised, smf.file.tracks, smf.file.end = GOOD, 0, 0, 0
    smf.file.casm, smf.file.casm_size = 0, 0
    smf.another, smf.sounding = -1, -1
    if not seek_header(smf):
        return False
    data = bytes_at(smf.data + smf.header, smf.length)
    return read_header(smf, data) and read_tracks(smf, data)


@entry("int64(int64)", SMALL)
def measure_smf(address):
    """C function: reads the SMF at `address`, counts its rows and sets its `room`; returns its error."""
    smf = smf_at(address)
    smf.memory, smf.file.played, smf.room = 0, -1, 0
    if read_file(smf) and smf.file.kind == 2 and smf.file.tracks > 1:
        smf.file.played = max(smf.sounding, 0)
        read_file(smf)
    largest, events = np.int64(0), np.int64(0)
    for kind in range(REMARKS):
        events += smf.count[kind]
    if smf.file.error == GOOD and events > MAX_EVENTS:
        fail(smf, TOO_MANY, 0, events, 0)
    for kind in range(len(ROW_BYTES)):
        smf.counted[kind] = smf.count[kind]
        smf.room += ROW_BYTES[kind] * smf.count[kind]
        if kind < TEXTS:
            largest = max(largest, ROW_BYTES[kind] * smf.count[kind])
    if smf.file.tracks > 1:
        smf.room += largest  # for sorting
    smf.file.messages, smf.file.tempos, smf.file.meters = smf.count[MESSAGES], smf.count[TEMPOS], smf.count[METERS]
    smf.file.exclusives, smf.file.texts, smf.file.remarks = smf.count[EXCLUSIVES], smf.count[TEXTS], smf.count[REMARKS]
    return smf.file.error


@entry("void(int64)", SMALL)
def fill_smf(address):
    """C function: writes the rows of a measured SMF into its `memory`."""
    smf = smf_at(address)
    place = smf.memory
    for kind in range(len(ROW_BYTES)):
        smf.rows[kind] = place
        place += ROW_BYTES[kind] * smf.counted[kind]
    smf.file.text_rows = smf.rows[TEXTS]
    read_file(smf)
    for kind in range(TEXTS):
        sort_rows(smf.rows[kind], smf.count[kind], ROW_BYTES[kind] // WORD, place)
