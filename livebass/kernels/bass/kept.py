"""Instrument files: a bass as it is kept, as named numbers from which kernels compute its notes.

A file outlives versions: a field is found by its name, so a later version may add, move or rename fields. A file begins
with a HEAD. Each of its `fields` follows: the words of its name, the name (ASCII, padded with zeros), the words of its
value, the value; zeros at the end of an array are left out. The last word is a checksum of all words before. All words
have 8 bytes, little-endian.

The fields are those of the record KEPT, inner ones with the names of the records around them ("bench.string.length").
An array is one field, and so is a field of an array of records: it holds the values of all records in turn. LISTS are
fields of any length. `take_file` reads a file that anybody may have made: what it accepts is safe for `make_notes`.
[any thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.bass.bench import BENCH, LISTS, PICKUPS
from livebass.kernels.bass.check import DAMAGED, FOREIGN, GOOD, LATER, all_within, checksum_of
from livebass.kernels.bass.instrument import INSTRUMENT, MAX_FRETS, TIERS, WORD
from livebass.kernels.machine.native import record_address, record_at, words_at
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.kernels.string.preparing import MAX_WORDS
from livebass.kernels.string.records import MAX_ANSWERING, MAX_NEAR
from livebass.rows.row import LARGEST

jit = compiled(attributes=SMALL)

KEPT_MAGIC = 0x7373_6162_6576_696C  # "livebass"
FORMAT = 1  # of instrument files: a new number is for what older versions must not read
LOSSES = 3  # ranges of the fret loss, each with its own tiers
LISTS_KEPT = ("numbers", "hand_heights", "response")  # float64: of the strings; of all strings' contacts, m; samples

KEPT = np.dtype(
    [
        ("name", "u1", (64,)),  # UTF-8, padded with zeros
        ("string_names", "u1", (MAX_STRINGS, 16)),
        ("instrument", INSTRUMENT),  # `hand`: 1 + the first of a string's `hand_heights`
        ("hand_count", "i8", (MAX_STRINGS,)),  # heights from there on: the contacts of its open note
        ("hand_stays", "i8"),  # 1: the hand measures its force by them, even if no slider moves the neck
        ("from_loss", "f8", (LOSSES,)),  # s/m, ascending, the start of each range
        ("modes", "i8", (LOSSES, TIERS)),  # as BENCH.tiers
        ("contact_rate", "f8", (LOSSES, TIERS)),  # Hz
        ("heavy", "i8", (LOSSES, TIERS)),
        ("bench", BENCH),
    ],
    align=True,
)
HEAD = np.dtype(
    [
        ("magic", "i8"),
        ("format", "i8"),
        ("words", "i8"),  # of the whole file
        ("fields", "i8"),
        ("made", "u1", (32,)),  # the version that made it: "1.2.3", padded with zeros
    ],
    align=True,
)
head_at = record_at(HEAD)
HEAD_BYTES = HEAD.itemsize
HEAD_WORDS = HEAD_BYTES // WORD
LONGEST_NAME = 8  # words

# Fields with another name in older versions: {old: new}
RENAMED: dict[str, str] = {}
# Of BENCH: what a computation sets
WORKSPACE = (
    "numbers", "notes", "modes", "lists", "room", "used", "fault_string", "fault_fret", "fault_height", "fault_place",
    "note",
)  # fmt: skip


def leaves(kind: np.dtype[Any], inside: str = "", first: int = 0) -> dict[str, list[int]]:
    """The fields of a record that starts at word `first`: the places of their words, by name.

    inside: begins the names. A field inside an array of records has the words of all of them.
    """
    made: dict[str, list[int]] = {}
    assert kind.fields
    for name, (of, offset, *_) in kind.fields.items():
        if inside == "bench." and name in WORKSPACE:
            continue
        base, shape = of.subdtype or (of, ())
        count, at = int(np.prod(shape, dtype=int)), first + offset // WORD
        if not base.fields:
            made[inside + name] = list(range(at, at + count * base.itemsize // WORD or at + 1))
            continue
        for k in range(count):
            for inner, places in leaves(base, f"{inside}{name}.", at + k * base.itemsize // WORD).items():
                made.setdefault(inner, []).extend(places)
    return made


def name_words(name: str) -> bytes:
    """A name as whole words."""
    data = name.encode("ascii")
    return data + bytes(-len(data) % WORD)


def name_digest(name: str) -> int:
    """The digest by which kernels know a name: `checksum_of` its words."""
    total = 0xCBF29CE484222325
    for word in np.frombuffer(name_words(name), "<u8").tolist():
        total = ((total ^ word) * 0x100000001B3) % (1 << 64)
    return total


KEPT_WORDS = KEPT.itemsize // WORD
FIELDS = leaves(KEPT)
NAMES = [*FIELDS, *LISTS_KEPT]
KNOWN = [(name_digest(name), k) for k, name in enumerate(NAMES)]
KNOWN += [(name_digest(old), NAMES.index(new)) for old, new in RENAMED.items()]
DIGESTS = np.array([digest for digest, _ in KNOWN], np.uint64)
NUMBER = np.array([k for _, k in KNOWN], np.int64)  # of the field with this digest
FIRST = np.array([0, *np.cumsum([len(places) for places in FIELDS.values()])], np.int64)
PLACES = np.array([place for places in FIELDS.values() for place in places], np.uint16)
LISTS_COUNT = len(LISTS_KEPT)
COUNT = len(FIELDS)  # fields of KEPT; LISTS_KEPT have the numbers from here on
ABSENT = COUNT + LISTS_COUNT

STRING_AT = BENCH.fields["string"][1]  # type: ignore[index]
STRING_KIND: np.dtype[Any] = BENCH.fields["string"][0].subdtype[0]  # type: ignore[index]
STRING_BYTES = STRING_KIND.itemsize
FLAGS = ("paper_law", "capo", "bowed", "own_across")
WHOLE_LIMITS = {
    "answering_modes": (0, MAX_ANSWERING), "tap_width": (1, 2), "open_note": (0, 127), "shifted": (-127, 127),
    **dict.fromkeys(FLAGS, (0, 1)),
}  # fmt: skip


def string_limits() -> np.ndarray[Any, np.dtype[np.float64]]:
    """Of each word of a BENCH_STRING: 1 for a whole number, and its limits."""
    made = []
    assert STRING_KIND.fields
    for name, (kind, *_) in STRING_KIND.fields.items():
        whole = kind.kind == "i"
        minimum, maximum = WHOLE_LIMITS.get(name, (0, MAX_WORDS) if whole else (-LARGEST, LARGEST))
        made.append((float(whole), float(minimum), float(maximum)))
    return np.array(made)


STRING_LIMITS = string_limits()
# Of each list of a string: the word of its first number, and the numbers per row; 0: as `tap_width` says
LIST_ROWS = np.array([(STRING_KIND.fields[name][1] // WORD, width) for name, width in LISTS.items()], np.int64)  # type: ignore[index]
# The other float64 of a BENCH: where they begin, and how many
OTHERS = np.array(
    [
        (offset, np.prod(of.shape, dtype=int))
        for name, (of, offset, *_) in BENCH.fields.items()  # type: ignore[union-attr]
        if of.base == np.float64 and name not in WORKSPACE
    ],
    np.int64,
)
MIN_LENGTH, MAX_LENGTH, MIN_STEP, MAX_STEP = 0.05, 5.0, 1e-4, 0.1  # m, of a string; of its grid
MIN_BOARD = 4  # rows of a bowed board


@jit
def take_file(change):
    """Reads the file of a CHANGE: its fields, the places of its lists, how many are unknown.

    A field that the file lacks is zero. Returns as `check_file`.
    """
    size = change.size
    if size < HEAD_BYTES + WORD or size % WORD != 0 or size > WORD * MAX_WORDS:
        return np.int64(FOREIGN)
    head, last = head_at(change.file), size // WORD - 1
    if head.magic != KEPT_MAGIC:
        return np.int64(FOREIGN)
    if head.format > FORMAT:
        return np.int64(LATER)
    words = words_at(change.file, last + 1)
    if head.format < 1 or head.words != last + 1 or checksum_of(change.file, last) != np.uint64(words[last]):
        return np.int64(DAMAGED)
    to, expected, at = words_at(record_address(change.kept), KEPT_WORDS), np.int64(0), np.int64(HEAD_WORDS)
    to[:] = 0
    change.unknown = 0
    for k in range(LISTS_COUNT):
        change.first[k], change.count[k] = change.file, 0
    for _ in range(head.fields):
        if at + 2 > last or not 1 <= words[at] <= LONGEST_NAME or words[at] > last - at - 2:
            return np.int64(DAMAGED)
        digest = checksum_of(change.file + WORD * (at + 1), words[at])
        at += 1 + words[at]
        count = words[at]
        at += 1
        if not 0 <= count <= last - at:
            return np.int64(DAMAGED)
        k = field_with(digest, expected)
        expected = k + 1
        if k < COUNT:
            first = FIRST[k]
            for j in range(min(count, FIRST[k + 1] - first)):
                to[PLACES[first + j]] = words[at + j]
        elif k < ABSENT:
            change.first[k - COUNT], change.count[k - COUNT] = change.file + WORD * at, count
        else:
            change.unknown += 1
        at += count
    if at != last or not is_kept(change):
        return np.int64(DAMAGED)
    return np.int64(GOOD)


@jit
def field_with(digest, expected):
    """The number of the field whose name has a `digest`, `expected` first; ABSENT: it is unknown."""
    if expected < ABSENT and DIGESTS[expected] == digest:
        return expected
    for k in range(len(DIGESTS)):
        if DIGESTS[k] == digest:
            return NUMBER[k]
    return np.int64(ABSENT)


@jit
def is_kept(change):
    """True if the BENCH of a CHANGE that was just read is safe for the kernels, with its lists."""
    kept = change.kept
    bench, instrument, numbers = kept.bench, kept.instrument, change.count[0]
    if not 1 <= bench.strings <= MAX_STRINGS or not 0 <= bench.frets <= MAX_FRETS:
        return False
    if bench.strings != instrument.strings or bench.frets != instrument.frets:
        return False
    for k in range(LISTS_COUNT):
        if not all_within(change.first[k], change.count[k], -LARGEST, LARGEST):
            return False
    if instrument.response_count != change.count[2] or not 0 <= bench.pickups <= PICKUPS:
        return False
    for k in range(len(OTHERS)):
        if not all_within(record_address(bench) + OTHERS[k, 0], OTHERS[k, 1], -LARGEST, LARGEST):
            return False
    answering = 0
    for i in range(bench.strings):
        answering += bench.string[i].answering_modes
    for i in range(bench.strings):
        if not is_string(bench, i, numbers, answering):
            return False
        first, count = kept.instrument.hand[i] - 1, kept.hand_count[i]
        if not 0 <= first <= change.count[1] or not 0 <= count <= change.count[1] - first:
            return False
    return True


@jit
def is_string(bench, i, numbers, answering):
    """True if string `i` of a BENCH is safe for the kernels, with its lists among so many numbers."""
    string, frets = bench.string[i], bench.frets
    place = record_address(bench) + STRING_AT + STRING_BYTES * i
    words = words_at(place, STRING_BYTES // WORD)
    for k in range(STRING_BYTES // WORD):
        if STRING_LIMITS[k, 0] > 0.0:
            if not STRING_LIMITS[k, 1] <= np.float64(words[k]) <= STRING_LIMITS[k, 2]:
                return False
        elif not all_within(place + WORD * k, 1, STRING_LIMITS[k, 1], STRING_LIMITS[k, 2]):
            return False
    for k in range(len(LIST_ROWS)):
        first, count = words[LIST_ROWS[k, 0]], words[LIST_ROWS[k, 0] + 1]
        wide = LIST_ROWS[k, 1] if LIST_ROWS[k, 1] > 0 else string.tap_width
        if first + wide * count > numbers:
            return False
    if not MIN_LENGTH <= string.length <= MAX_LENGTH or not MIN_STEP <= string.grid_step <= MAX_STEP:
        return False
    places, resonances = string.frets_count + 1, string.resonances_count
    if not frets < places <= MAX_NEAR + 1 or string.pitches_count < places or string.surface_count == 1:
        return False
    if string.bending_count < resonances or string.parts_count < places * (resonances + 1):
        return False
    if answering > 0 and string.nut_parts_count < places * (resonances + 1):
        return False
    for p in range(bench.pickups):
        if not -1 <= bench.tap[p, i] < string.taps_count:
            return False
    return string.bowed == 0 or string.surface_count >= MIN_BOARD
