"""Keys of a file beyond a bass's range: notes of a low tuning, or key switches.

A livebass reads keys below its lowest note as key switches if its key map has them. In a foreign file they are notes if
they look like notes: each sounds alone, as long as the others. A key switch is brief, or held while notes begin. Notes
move up by octaves. Other keys beyond the range that look like switches are those of another instrument: they are left
out. So is one that is sent again before the note.
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry, inlined
from livebass.kernels.machine.native import bytes_at, copy_record, record_at, words_at
from livebass.kernels.player.messages import NOTE_OFF, NOTE_ON
from livebass.kernels.player.performer import CHANNELS
from livebass.kernels.score.memory import KEYS, NONE, WORD, is_note, kind_of, played_at
from livebass.kernels.score.sorting import count_below, fill_order, sort_by
from livebass.kernels.score.spread import OVERLAP

jit = compiled(attributes=SMALL)

DEEPEST = 16  # E0: no bass is tuned lower
SHORT = 0.5  # of the median length of a note: key switches are shorter
MAXIMUM = 0.6  # of the low keys must look like notes, or of the others beyond the range like switches
FAR = 12  # semitones from all notes to a key that is held as a switch
FITTING_WORDS = 8  # of workspace, for each note-on

FITTING = np.dtype(
    [
        ("rows", "i8"),  # address of PLAYED, by frame
        ("count", "i8"),
        ("end", "i8"),  # frame at which notes end that nothing ends
        ("rate", "i8"),
        ("lowest", "i8"),  # key of the bass
        ("highest", "i8"),
        ("switches", "i8"),  # address of 128 bytes, 1 for keys that switch
        ("memory", "i8"),  # address of FITTING_WORDS for each note-on
        ("notes", "i8"),  # note-ons
        ("left_out", "i8"),  # key switches of another instrument
        ("raised", "i8"),  # notes that moved up
        ("down", "i8", (CHANNELS, KEYS)),
    ],
    align=True,
)
fitting_at = record_at(FITTING)


@entry("int64(int64)", SMALL)
def leave_switches(address):
    """Takes another instrument's key switches from the rows of a FITTING; returns how many rows are left.

    These are keys beyond the range of the bass that do not switch it: brief ones just before a longer note, or, far
    from all notes, keys that are held while notes begin.
    """
    f = fitting_at(address)
    f.left_out = 0
    find_strokes(f)
    if find_switches(f):
        take_switches(f)
    return f.count


@entry("int64(int64)", SMALL)
def raise_notes(address):
    """Moves low keys that would switch, in the rows of a FITTING, up by octaves if they are notes; returns how many."""
    f = fitting_at(address)
    f.raised = 0
    find_strokes(f)
    if are_notes(f):
        rows = played_at(f.rows, f.count)
        for k in range(f.count):
            key = np.int64(rows[k].first)
            raised = key - 12 * ((key - f.lowest) // 12)
            if is_note(rows[k]) and is_low(f, key) and not switches_bass(f, raised):
                rows[k].first = raised
                f.raised += 1 if kind_of(rows[k]) == NOTE_ON else 0
    return f.raised


@inlined
def words_of(f, k):
    """Part `k` of the workspace."""
    return words_at(f.memory + WORD * f.notes * k, f.notes)


@inlined
def strokes_of(f):
    """Begin, end and key of each note, sorted by these."""
    return words_of(f, 5), words_of(f, 6), words_of(f, 7)


@jit
def find_strokes(f):
    """Finds the notes; sets `notes`."""
    rows, f.notes = played_at(f.rows, f.count), 0
    for k in range(f.count):
        f.notes += 1 if kind_of(rows[k]) == NOTE_ON else 0
    begins, ends, keys, order, spare = words_of(f, 0), words_of(f, 1), words_of(f, 2), words_of(f, 3), words_of(f, 4)
    fill_strokes(f, rows, begins, ends, keys, spare)
    fill_order(order, f.notes)
    sort_by(order, spare, keys, f.notes)
    sort_by(order, spare, ends, f.notes)
    sort_by(order, spare, begins, f.notes)
    sorted_begins, sorted_ends, sorted_keys = strokes_of(f)
    for n in range(f.notes):
        sorted_begins[n], sorted_ends[n], sorted_keys[n] = begins[order[n]], ends[order[n]], keys[order[n]]


@jit
def fill_strokes(f, rows, begins, ends, keys, following):
    """Fills begin, end and key of the notes; one that nothing ends sounds to the end."""
    f.down[:, :] = NONE
    n = 0
    for k in range(f.count):
        row = rows[k]
        channel, key = np.int64(row.status) & 0x0F, np.int64(row.first)
        if kind_of(row) == NOTE_ON:
            begins[n], ends[n], keys[n] = row.frame, f.end, key
            following[n] = f.down[channel, key]
            f.down[channel, key] = n
            n += 1
        elif kind_of(row) == NOTE_OFF:
            note = f.down[channel, key]
            f.down[channel, key] = NONE
            while note != NONE:
                ends[note] = row.frame
                note = following[note]


@jit
def switches_bass(f, key):
    """True if a key switches the bass."""
    return bytes_at(f.switches, KEYS)[key] == 1


@jit
def is_low(f, key):
    """True if a key would switch, but a bass may be tuned so low."""
    return DEEPEST <= key < f.lowest and switches_bass(f, key)


@jit
def is_other(f, key):
    """True for a key that does not switch, or is in the range."""
    return key >= f.lowest or not switches_bass(f, key)


@jit
def median_of(lengths, order, spare, count):
    """The median of `count` lengths."""
    fill_order(order, count)
    sort_by(order, spare, lengths, count)
    return (lengths[order[(count - 1) // 2]] + lengths[order[count // 2]]) / 2.0


@jit
def find_switches(f):
    """Marks the notes, in workspace 2, that look like another instrument's key switches.

    Returns False if there are too few to be switches.
    """
    begins, ends, keys = strokes_of(f)
    note_begins, note_ends, marks = words_of(f, 0), words_of(f, 1), words_of(f, 2)
    notes, beyond, found, near, far = 0, 0, 0, np.int64(KEYS), np.int64(NONE)
    for n in range(f.notes):
        if f.lowest <= keys[n] <= f.highest:
            note_begins[notes], note_ends[notes], marks[notes] = begins[n], ends[n], ends[n] - begins[n]
            near, far = min(near, keys[n]), max(far, keys[n])
            notes += 1
    if notes == 0:
        return False
    short = SHORT * median_of(marks, words_of(f, 3), words_of(f, 4), notes)
    again = f.down[0]  # by key: the next stroke, if it is a switch before whose note no other begins
    again[:] = NONE
    for n in range(f.notes - 1, -1, -1):
        marks[n] = 0
        if f.lowest <= keys[n] <= f.highest:
            again[:] = NONE
        elif is_other(f, keys[n]):
            beyond += 1
            is_far, brief = keys[n] < near - FAR or keys[n] > far + FAR, ends[n] - begins[n] < short
            twice = brief and again[keys[n]] != NONE
            again[keys[n]] = NONE
            if twice or looks_like_switch(f, begins[n], ends[n], brief, is_far, notes):
                marks[n], again[keys[n]] = 1, n
                found += 1
    return found > 0 and found >= MAXIMUM * beyond


@jit
def looks_like_switch(f, begin, end, brief, is_far, notes):
    """True for a brief key just before a longer note, or, far from all `notes`, one held while notes begin."""
    if not (brief or is_far):
        return False
    begins, ends, overlap = words_of(f, 0), words_of(f, 1), OVERLAP * f.rate
    until = begin + overlap
    if is_far:
        until = max(end - overlap, until)
    for n in range(count_below(begins, notes, begin), count_below(begins, notes, until)):
        if ends[n] > end + overlap or not brief:
            return True
    return False


@jit
def take_switches(f):
    """Takes the marked notes from the rows; sets `left_out`."""
    begins, ends, keys = strokes_of(f)
    marks, order, rows = words_of(f, 2), words_of(f, 3), played_at(f.rows, f.count)
    fill_order(order, f.notes)
    sort_by(order, words_of(f, 4), ends, f.notes)
    f.down[:, :] = NONE
    pressed, released = f.down[0], f.down[1]  # last frame of each key
    kept, a, b = 0, 0, 0
    for k in range(f.count):
        row = rows[k]
        while a < f.notes and begins[a] <= row.frame:
            if marks[a] == 1:
                pressed[keys[a]] = begins[a]
            a += 1
        while b < f.notes and ends[order[b]] <= row.frame:
            if marks[order[b]] == 1:
                released[keys[order[b]]] = ends[order[b]]
            b += 1
        if kind_of(row) == NOTE_ON and pressed[row.first] == row.frame:
            f.left_out += 1
        elif not (kind_of(row) == NOTE_OFF and released[row.first] == row.frame):
            copy_record(rows[kept], row)
            kept += 1
    f.count = kept


@jit
def are_notes(f):
    """True if most low keys that would switch look like notes."""
    begins, ends, keys = strokes_of(f)
    low, others, alike, last_low, first_other, key = 0, 0, 0, np.int64(0), np.int64(0), np.int64(NONE)
    lengths = words_of(f, 2)
    for n in range(f.notes):
        if is_other(f, keys[n]):
            first_other = begins[n] if others == 0 else first_other
            lengths[others] = ends[n] - begins[n]
            others += 1
        elif is_low(f, keys[n]):
            key = keys[n] if low == 0 or keys[n] == key else np.int64(NONE)
            last_low = begins[n]
            low += 1
    if low == 0 or others == 0:
        return low > 0
    if low <= 2 and key != NONE and last_low < first_other:  # a switch before the first note, perhaps sent again
        return False
    short = SHORT * median_of(lengths, words_of(f, 3), words_of(f, 4), others)
    long = find_long(f)
    for n in range(f.notes):
        if is_low(f, keys[n]) and ends[n] - begins[n] >= short and is_alone(f, begins[n], ends[n], long):
            alike += 1
    return alike >= MAXIMUM * low


@jit
def find_long(f):
    """Begins and ends of the notes that are long enough to overlap, each sorted, in workspaces 0 and 1."""
    begins, ends, _ = strokes_of(f)
    long_begins, long_ends, order, lengths = words_of(f, 0), words_of(f, 1), words_of(f, 3), words_of(f, 2)
    count = 0
    for n in range(f.notes):
        if ends[n] - begins[n] > OVERLAP * f.rate:
            long_begins[count], lengths[count] = begins[n], ends[n]
            count += 1
    fill_order(order, count)
    sort_by(order, words_of(f, 4), lengths, count)
    for n in range(count):
        long_ends[n] = lengths[order[n]]
    return count


@jit
def is_alone(f, begin, end, long):
    """True if a note sounds alone, or is too short to overlap."""
    overlap = OVERLAP * f.rate
    if end - begin <= overlap:
        return True
    begun = count_below(words_of(f, 0), long, end - overlap)
    ended = count_below(words_of(f, 1), long, np.floor(begin + overlap) + 1.0)  # frames up to there are whole
    return begun - ended <= 1
