"""A bass as numbers for any audio rate, INSTRUMENT, and the records of strings and player that are made of it.

An instrument file is a FILE record, which holds an INSTRUMENT; then a NOTE (preparing.py) for each string and fret;
their modes in each tier, int64 (TIERS, notes); the numbers that the notes point into, float64; where a bass has strokes
of its own, STROKES rows of STROKE; and a checksum. All of it is words of 8 bytes, little-endian. `check_file` refuses
what is damaged, and whatever would make other kernels read or write outside their memory: what it accepts may be
played. [any thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.hands.sliding import BEND_FRAMES, set_vibrato
from livebass.kernels.machine.elementary import exp
from livebass.kernels.machine.native import (
    copy_record,
    float_control,
    floats_at,
    flush_bits,
    record_address,
    record_at,
    records_at,
    set_float_control,
    words_at,
)
from livebass.kernels.pickup import tone
from livebass.kernels.pickup.coil import CIRCUIT, CIRCUIT_WORDS, COIL
from livebass.kernels.player.constants import KEY_MAP_WORDS, KEYS, PLAYER_WORDS, STROKE, STROKE_WORDS, STROKES
from livebass.kernels.player.controls import reset_controllers
from livebass.kernels.player.expression import VIBRATO_RATE, bend_ratio, loudness, vibrato_depth
from livebass.kernels.player.performer import ANSWERS_WHEN, MOST_STRINGS, performer_at
from livebass.kernels.player.strokes import fill_strokes
from livebass.kernels.string import answers
from livebass.kernels.string.operators import DOUBLE
from livebass.kernels.string.preparing import (
    LISTS,
    MOST_WORDS,
    NOTE,
    NOTE_BYTES,
    NOTE_WORDS,
    OPERATOR_BYTES,
    PICKUPS,
    PREPARING,
    SENSORS,
    fill,
    measure,
    note_at,
    operator_at,
)
from livebass.kernels.string.records import BLOCK, LINE, MOST_ANSWERS, MOST_NEAR, OPERATOR, ROW, STRING, VOICE_SLOTS
from livebass.parts import VERSION, WITH_STROKES
from livebass.rows import LARGEST, TINY, Word, limits, record, table

BLOCKER_HZ = 6.0  # DC blocker's corner
GAIN_TIME = 6e-3  # s, how fast volume follows its controller
MOST_PICKUPS = 4
MOST_FRETS = 127

# How finely it is computed: two qualities, and what overload falls back to
LIVE, STUDIO, COARSE, TIERS = 0, 1, 2, 3
TIER_WORDS = [
    Word("contact_rate", "f8", 8000.0, 64e6),  # Hz, at least
    Word("heavy", "i8", 0, 1),  # 1: it needs most of a processor's time
]
TIER = record(TIER_WORDS)

INSTRUMENT_WORDS = [
    Word("strings", "i8", 1, MOST_STRINGS),
    Word("frets", "i8", 0, MOST_FRETS),
    Word("sensed", "i8", 0, 1),  # 1: the output is the displacement at sensors, 0: through pickups
    Word("slap", "i8", 0, 1),  # 1: the thumb strikes the lower strings
    Word("drop", "i8", 0, 1),  # 1: notes out of range are left out
    Word("stroke", "i8", 0, STROKES - 1),  # performer.FINGER, PICK, NAIL or POP
    Word("answering", "i8", 0, ANSWERS_WHEN - 1),  # performer.NEVER, PEDAL or ALWAYS: when idle strings may answer
    Word("gain", "f8"),
    Word("carried", "f8", TINY, 0.5),  # of the contact rate: the highest mode that is played
    Word("tiers", TIER_WORDS, shape=(TIERS,)),
    Word("circuit", CIRCUIT_WORDS),
    Word("player", PLAYER_WORDS),
    Word("key_map", KEY_MAP_WORDS),
    Word("part", "f8", 0.0, 1.0, (KEYS,)),  # by velocity: part of the way from the softest to the hardest note
    Word("wheel_slides", "i8", 0, 1),  # 1: the pitch wheel slides along the frets
    Word("open_note", "i8", 0, 127, (MOST_STRINGS,)),
    Word("answering_modes", "i8", 0, MOST_ANSWERS, (MOST_STRINGS,)),  # of each string, that may answer others
    Word("pickups", "i8", 0, MOST_PICKUPS, (MOST_STRINGS,)),  # of each string, and of each of them:
    Word("decay", "f8", 0.0, shape=(MOST_STRINGS, MOST_PICKUPS)),  # 1/m
    Word("mix", "f8", shape=(MOST_STRINGS, MOST_PICKUPS)),
    Word("across", "f8", shape=(MOST_STRINGS, MOST_PICKUPS)),
    Word("stretch", "f8", shape=(MOST_STRINGS,)),  # N/m, E A over twice the length that stretches
    Word("slack", "f8", 1e-3, 1e3, (MOST_STRINGS,)),  # how far a force pulls it, over how far before it was tuned
    Word("called", "i8", 0, 11, (MOST_STRINGS,)),  # pitch class by which key switches call it
    Word("saddle", "f8", shape=(MOST_STRINGS, MOST_PICKUPS)),  # m, from the saddle; of sensors, for u and v, too
    Word("aperture", "f8", 0.0, 1.0, (MOST_STRINGS, MOST_PICKUPS)),  # m
    Word("winding", "f8", 0.0, 1.0, (MOST_STRINGS,)),  # m, pitch of the winding; 0: it is flat
    Word("fretless", "i8", 0, 1, (MOST_STRINGS,)),  # 1: a finger slides along it without steps
]
INSTRUMENT = record(INSTRUMENT_WORDS)

MAGIC = 0x5353_4142_4556_494C  # "LIVEBASS"
FILE = np.dtype(
    [
        ("magic", "i8"),
        ("version", "i8"),
        ("words", "i8"),  # of the whole file
        ("name", "u1", (64,)),  # UTF-8, zeros behind
        ("string_names", "u1", (MOST_STRINGS, 16)),
        ("instrument", INSTRUMENT),
    ],
    align=True,
)
# What `check_file` returns
GOOD, FOREIGN, OTHER_VERSION, DAMAGED = 0, 1, 2, 3


# The operators of one tier of a file at one rate
POOL = np.dtype(
    [
        ("file", "i8"),  # address of a file that `check_file` accepts
        ("tier", "i8"),
        ("rate", "f8"),  # audio, Hz
        ("memory", "i8"),  # address, on a cache line; OPERATOR (strings, frets + 1) come first
        ("bytes", "i8"),  # of memory: `measure_pool` sets them
        ("preparing", PREPARING),
        ("note", NOTE),  # workspace
        ("operator", OPERATOR),  # workspace
    ],
    align=True,
)

file_at = record_at(FILE)
instrument_at = record_at(INSTRUMENT)
pool_at = record_at(POOL)
string_at = record_at(STRING)
operators_at = records_at(OPERATOR, 2)
coil_at = record_at(COIL)
FILE_BYTES, CIRCUIT_BYTES = FILE.itemsize, CIRCUIT.itemsize
WORD = 8  # bytes
STROKE_BYTES = STROKE.itemsize
ROOM_OF_STROKES = STROKES * STROKE_BYTES // WORD

# Limits of the words of an INSTRUMENT, and behind them of a NOTE and of a STROKE: columns as rows.Limit
LIMITS = table([*limits(INSTRUMENT_WORDS, MOST_STRINGS), *limits(NOTE_WORDS), *limits(STROKE_WORDS)])
NOTE_LIMITS = len(limits(INSTRUMENT_WORDS, MOST_STRINGS))  # the first of a NOTE ...
STROKE_LIMITS = NOTE_LIMITS + len(limits(NOTE_WORDS))  # ... and of a STROKE
PLACE, COUNT, PER_STRING, WHOLE, LEAST, MOST = range(6)
NOTE_LISTS = tuple((NOTE.fields[name][1] // WORD, width) for name, width in LISTS.items())  # type: ignore[index]
TAPS = NOTE.fields["taps"][1] // WORD  # type: ignore[index]


@jit
def whole_steps(contact_rate, rate):
    """Fine steps a frame: the least whole number that makes `contact_rate` (Hz) or more."""
    return max(1.0, np.ceil(contact_rate / rate - 1e-9))


# Strings and player


@entry("void(int64, float64, int64, int64, int64, int64)")
def rest_string(string, rate, numerator, denominator, over_frets, over_board):
    """Makes a silent string of the STRING of zeros at an address; its output is its displacement.

    `numerator` fine steps make `denominator` frames; over_frets and over_board are addresses of these C functions.
    """
    reset_string(string_at(string), rate, numerator, denominator, over_frets, over_board)


@jit
def reset_string(string, rate, numerator, denominator, over_frets, over_board):
    """`rest_string` for a record."""
    voice = string.voice
    voice.over_frets = over_frets
    voice.over_board = over_board
    voice.numerator = numerator
    voice.denominator = denominator
    voice.rate = rate
    voice.bend = 1.0
    voice.slide_to = -1
    voice.tuned = 1.0
    voice.gain = 1.0
    voice.gain_wanted = 1.0
    voice.b[0] = 1.0
    voice.a[0] = 1.0
    voice.block = exp(-2 * np.pi * BLOCKER_HZ / rate)
    voice.gain_pole = 1.0 - exp(-1.0 / (GAIN_TIME * rate))
    for k in range(VOICE_SLOTS):
        string.slots[k].hand = 1.0
        string.slots[k].ratio = 1.0


@entry("void(int64, int64, int64, int64)")
def connect_string(string, instrument, i, coil):
    """Gives a string at rest the pickups and the hand of string `i` of an INSTRUMENT, and the filter of a COIL."""
    connect_pickups(string_at(string), instrument_at(instrument), i, coil_at(coil))


@jit
def connect_pickups(string, instrument, i, coil):
    """`connect_string` for records."""
    voice, player = string.voice, instrument.player
    voice.pickups = instrument.pickups[i]
    voice.stretch = instrument.stretch[i]
    voice.winding = instrument.winding[i]
    voice.fretless = instrument.fretless[i]
    for k in range(MOST_PICKUPS):
        voice.decay[k] = instrument.decay[i, k]
        voice.mix[k] = instrument.mix[i, k]
        voice.level[k] = voice.mix[k]
        voice.across[k] = instrument.across[i, k]
        voice.saddle[k] = instrument.saddle[i, k]
        voice.aperture[k] = instrument.aperture[i, k]
    if voice.pickups > 0:
        for k in range(4):
            voice.b[k] = coil.b[k]
            voice.a[k] = coil.a[k]
    for k in range(4):
        voice.b[k] *= instrument.gain
    voice.pull = np.int64(np.rint(player.pull_time * voice.rate))
    voice.strike = max(1, np.int64(np.rint(player.strike_time * voice.rate)))
    voice.rounding = player.rounding
    voice.strike_width = player.strike_width
    voice.release = player.release_time
    voice.thumb_mass = player.thumb_mass
    voice.thumb_width = player.thumb_width
    voice.thumb_stiffness = player.thumb_stiffness
    voice.thumb_loss = player.thumb_loss
    voice.angle = player.pluck_angle
    voice.follow = player.release_speed / player.greatest_apex
    voice.turn = i * BEND_FRAMES // instrument.strings


@entry("void(int64, int64, int64, int64)")
def connect_answers(string, i, instrument, ops):
    """Gives string `i` of an INSTRUMENT, connected, the answers of the others; ops: address of all operators."""
    bass = instrument_at(instrument)
    answers.fill_answers(string_at(string), i, bass, operators_at(ops, bass.strings, bass.frets + 1))


@entry("void(int64, int64, int64)")
def settle_string(string, performer, i):
    """C function: `set_controls` for the address of a STRING, string `i` of the PERFORMER at an address."""
    set_controls(string_at(string).voice, performer_at(performer), i)


@jit
def set_controls(voice, p, i):
    """Sets the voice of string `i`, at rest, as the controllers of its performer stand, without a ramp."""
    voice.gain_wanted = loudness(p)
    voice.gain = voice.gain_wanted
    voice.bend = bend_ratio(p, i)
    voice.tuned = voice.bend
    voice.tone_wanted = p.tone
    if voice.tone != voice.tone_wanted:
        tone.set_tone(voice, voice.tone_wanted)
    voice.blend_wanted = p.controls.blend
    tone.set_blend(voice, voice.blend_wanted)
    set_vibrato(voice, vibrato_depth(p), VIBRATO_RATE)


@jit
def copy_words(source, target, count):
    """Copies `count` words from one address to another."""
    taken, to = words_at(source, count), words_at(target, count)
    for k in range(count):
        to[k] = taken[k]


@jit
def take_circuit(coil, instrument, rate):
    """Gives a COIL the parts of the instrument's circuit, and the rate (Hz)."""
    copy_words(record_address(instrument.circuit), record_address(coil), CIRCUIT_BYTES // WORD)
    coil.rate = rate


@entry("void(int64, int64, int64)")
def new_performer(performer, instrument, seed):
    """Makes the player of an INSTRUMENT of the PERFORMER of zeros at an address; `seed` of its unevenness.

    It has the standard strokes.
    """
    make_performer(performer_at(performer), instrument_at(instrument), seed, 0)


@jit
def make_performer(p, instrument, seed, strokes):
    """`new_performer` for records; strokes: address of the bass's own, 0: it has none."""
    p.strings = instrument.strings
    p.frets = instrument.frets
    for i in range(instrument.strings):
        p.open[i] = instrument.open_note[i]
        p.slack[i] = instrument.slack[i]
        p.called[i] = instrument.called[i]
    copy_record(p.player, instrument.player)
    copy_record(p.key_map, instrument.key_map)
    fill_strokes(p, strokes)
    for i in range(MOST_STRINGS):
        p.hands.key[i] = -1
    for velocity in range(KEYS):
        p.part[velocity] = instrument.part[velocity]
    p.usual_slapped = p.player.slapped_strings if instrument.slap else 0
    p.wheel_slides = instrument.wheel_slides
    p.answering = instrument.answering
    p.drop = instrument.drop
    p.seed = seed & np.int64(0x7FFF_FFFF_FFFF_FFFF)
    p.placed = p.player.pluck_position
    p.range = p.player.bend_range
    p.ranged = p.range
    p.dynamics = 1.0
    p.hand_damping = p.player.hand_damping
    p.unevenness = p.player.unevenness
    p.slapped = p.usual_slapped
    p.stroke = instrument.stroke
    p.forced = -1
    p.hands.place = 1
    p.controls.volume = 1.0
    p.controls.level = 1.0
    for key in range(KEYS):
        p.controls.place_of[key] = np.nan
        p.controls.string_of[key] = -1
    reset_controllers(p)


# Instrument files


@entry("uint64(int64, int64)")
def checksum(address, count):
    """FNV-1a of `count` words at an address (Fowler, Noll, Vo), a word at a time."""
    return checksum_of(address, count)


@jit
def notes_of(file):
    """How many notes a file has."""
    return file.instrument.strings * (file.instrument.frets + 1)


@jit
def words_before_numbers(file):
    """Words of a file before its numbers."""
    return FILE_BYTES // WORD + notes_of(file) * (NOTE_BYTES // WORD + TIERS)


@jit
def strokes_of(address):
    """Address of the own strokes of the file at an address; 0: it has none."""
    file = file_at(address)
    return address + WORD * (file.words - 1 - ROOM_OF_STROKES) if file.version == WITH_STROKES else np.int64(0)


@entry("int64(int64, int64)")
def check_file(address, size):
    """Returns GOOD for the file of `size` bytes at an address, or why it cannot be played."""
    if size < FILE_BYTES + WORD or size % WORD != 0 or size > WORD * MOST_WORDS:
        return np.int64(FOREIGN)
    file, last = file_at(address), size // WORD - 1
    if file.magic != MAGIC:
        return np.int64(FOREIGN)
    if file.version != VERSION and file.version != WITH_STROKES:
        return np.int64(OTHER_VERSION)
    if file.words != last + 1 or checksum_of(address, last) != np.uint64(words_at(address + WORD * last, 1)[0]):
        return np.int64(DAMAGED)
    if not is_instrument(file.instrument):
        return np.int64(DAMAGED)
    numbers = last - words_before_numbers(file)
    if file.version == WITH_STROKES:
        numbers -= ROOM_OF_STROKES
    if numbers < 0:
        return np.int64(DAMAGED)
    if file.version == WITH_STROKES and not are_strokes(strokes_of(address)):
        return np.int64(DAMAGED)
    where = address + WORD * words_before_numbers(file)
    if not all_within(where, numbers, -LARGEST, LARGEST):
        return np.int64(DAMAGED)
    notes = notes_of(file)
    modes = words_at(address + FILE_BYTES + NOTE_BYTES * notes, TIERS * notes)
    for k in range(notes):
        place = address + FILE_BYTES + NOTE_BYTES * k
        note = note_at(place)
        taps = 2 if file.instrument.sensed else file.instrument.pickups[k // (file.instrument.frets + 1)]
        others = answers_of(file.instrument, k // (file.instrument.frets + 1))
        if note.answers_count != others:
            return np.int64(DAMAGED)
        if note.taps_count != taps or not is_note(place, file.instrument.sensed, where, numbers):
            return np.int64(DAMAGED)
        for tier in range(TIERS):
            count = modes[tier * notes + k]
            if count < 1 or count > min(note.grid_points - 1, ROW - BLOCK):
                return np.int64(DAMAGED)
    return np.int64(GOOD)


@jit
def answers_of(instrument, i):
    """How many modes of the other strings may answer string `i`."""
    count = 0
    for t in range(instrument.strings):
        if t != i:
            count += instrument.answering_modes[t]
    return count


@jit
def checksum_of(address, count):
    """`checksum`, for kernels."""
    words, total = words_at(address, count), np.uint64(0xCBF29CE484222325)
    for k in range(count):
        total = (total ^ np.uint64(words[k])) * np.uint64(0x100000001B3)
    return total


@jit
def all_within(address, count, least, most):
    """True if `count` float64 at an address are numbers from `least` to `most`."""
    numbers, good = floats_at(address, count), True
    for k in range(count):
        if not least <= numbers[k] <= most:
            good = False
    return good


@jit
def are_within(address, first, last, strings):
    """True if the words of a record at an address are within LIMITS, rows `first` to `last`, of so many `strings`."""
    for row in range(first, last):
        place, count = address + WORD * np.int64(LIMITS[row, PLACE]), np.int64(LIMITS[row, COUNT])
        if LIMITS[row, PER_STRING] > 0.0:
            count = strings * np.int64(LIMITS[row, PER_STRING])
        whole, numbers = words_at(place, count), floats_at(place, count)
        for k in range(count):
            x = np.float64(whole[k]) if LIMITS[row, WHOLE] > 0.0 else numbers[k]
            if not LIMITS[row, LEAST] <= x <= LIMITS[row, MOST]:
                return False
    return True


@jit
def is_instrument(instrument):
    """True if the numbers of an INSTRUMENT are such as kernels take."""
    strings = min(max(instrument.strings, 0), MOST_STRINGS)
    if not are_within(record_address(instrument), 0, NOTE_LIMITS, strings):
        return False
    for i in range(strings):
        if answers_of(instrument, i) > MOST_ANSWERS or (instrument.sensed and instrument.pickups[i] > 0):
            return False
    return True


@jit
def are_strokes(address):
    """True if the numbers of STROKES rows of STROKE at an address are such as kernels take."""
    good = True
    for k in range(STROKES):
        good &= are_within(address + STROKE_BYTES * k, STROKE_LIMITS, len(LIMITS), 0)
    return good


@jit
def is_note(address, sensed, where, numbers):
    """True if the NOTE at an address is such as kernels take, with its lists among the `numbers` at `where`."""
    if not are_within(address, NOTE_LIMITS, STROKE_LIMITS, 0):
        return False
    words = words_at(address, NOTE_BYTES // WORD)
    for place, width in NOTE_LISTS:
        first, count = words[place], words[place + 1]
        if count > numbers or first > numbers - (1 if sensed and place == TAPS else width) * count:
            return False
    note = note_at(address)
    if note.obstacles_count > MOST_NEAR or note.surface_count == 1:
        return False
    for k in range(note.obstacles_count):
        x = floats_at(where + DOUBLE * (note.obstacles + 2 * k), 1)[0]
        if not 0.0 <= x <= note.length:
            return False
    for k in range(note.surface_count):
        x = floats_at(where + DOUBLE * (note.surface + 2 * k), 1)[0]
        if not -note.length <= x <= 2.0 * note.length:
            return False
    return True


# The operators of an instrument file


@jit
def begin_pool(pool):
    """Sets what the operators of all notes share, and forgets what was measured."""
    file, work = file_at(pool.file), pool.preparing
    notes, tier = notes_of(file), file.instrument.tiers[pool.tier]
    work.count = notes
    work.numbers = pool.file + WORD * words_before_numbers(file)
    work.taps = SENSORS if file.instrument.sensed else PICKUPS
    work.lossless = 0
    work.rate = pool.rate
    work.numerator = np.int64(whole_steps(tier.contact_rate, pool.rate))
    work.denominator = 1
    work.contact_rate = work.numerator * pool.rate
    work.carried = file.instrument.carried
    work.words = 0
    work.table_words = 0


@jit
def take_note(pool, k, note):
    """Copies note `k` of the file, with its modes in the pool's tier, to the NOTE at an address."""
    notes = notes_of(file_at(pool.file))
    copy_words(pool.file + FILE_BYTES + NOTE_BYTES * k, note, NOTE_BYTES // WORD)
    modes = words_at(pool.file + FILE_BYTES + NOTE_BYTES * notes, TIERS * notes)
    note_at(note).modes = modes[pool.tier * notes + k]


@jit
def lines(size):
    """`size` bytes, up to whole cache lines."""
    return (size + LINE - 1) // LINE * LINE


@entry("void(int64)")
def measure_pool(address):
    """Sets the `bytes` that the POOL at an address needs."""
    pool = pool_at(address)
    begin_pool(pool)
    work = pool.preparing
    for k in range(work.count):
        take_note(pool, k, address + NOTE_PLACE)
        measure(work, pool.note, pool.operator)
    records = lines(OPERATOR_BYTES * work.count) + lines(NOTE_BYTES * work.count)
    pool.bytes = records + lines(DOUBLE * work.words) + lines(DOUBLE * work.table_words)


@entry("int64(int64)")
def fill_pool(address):
    """Fills the memory of the POOL at an address that `measure_pool` has seen.

    Returns DONE, or why the file's modes cannot be played at this rate: OVERDAMPED or FROZEN (preparing.py). The memory
    needs no care before; afterwards it only is read, and any number of basses may share it.
    """
    pool = pool_at(address)
    before = float_control()
    set_float_control(before & ~flush_bits())  # the same rows whatever a host has set
    clear_memory(pool.memory, pool.bytes)
    work, words = pool.preparing, pool.preparing.words
    begin_pool(pool)
    work.operators = pool.memory
    work.notes = work.operators + lines(OPERATOR_BYTES * work.count)
    work.memory = work.notes + lines(NOTE_BYTES * work.count)
    work.table = work.memory + lines(DOUBLE * words)
    for k in range(work.count):
        take_note(pool, k, work.notes + NOTE_BYTES * k)
        measure(work, note_at(work.notes + NOTE_BYTES * k), operator_at(work.operators + OPERATOR_BYTES * k))
    state = fill(work)
    set_float_control(before)
    return state


@jit
def clear_memory(address, size):
    """Sets `size` bytes to zero, a whole number of words."""
    words = words_at(address, size // WORD)
    for k in range(size // WORD):
        words[k] = 0


NOTE_PLACE = POOL.fields["note"][1]  # type: ignore[index]
