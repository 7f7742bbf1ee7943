"""A bass as numbers for any audio rate, INSTRUMENT, and the records of strings and player that are made of it.

An instrument file is a FILE record, which holds an INSTRUMENT; then a NOTE (preparing.py) for each string and fret;
their modes in each tier, int64 (TIERS, notes); the numbers that the notes point into, float64; where a bass has strokes
of its own, STROKES rows of STROKE; and a checksum. All of it is words of 8 bytes, little-endian. `check_file` refuses
what is damaged, and whatever would make other kernels read or write outside their memory: what it accepts may be
played. [any thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.hands.techniques import BEND_FRAMES, set_vibrato
from livebass.kernels.machine.elementary import exp
from livebass.kernels.machine.native import (
    copy_record,
    float_control,
    floats_at,
    flush_bits,
    record_at,
    records_at,
    set_float_control,
    words_at,
)
from livebass.kernels.pickup import tone
from livebass.kernels.pickup.coil import CIRCUIT, COIL
from livebass.kernels.player.constants import CONTROLLERS, KEY_MAP, KEYS, PLAYER, STROKE, STROKES
from livebass.kernels.player.controls import reset_controllers
from livebass.kernels.player.expression import VIBRATO_RATE, bend_ratio, loudness, vibrato_depth
from livebass.kernels.player.performer import ANSWERS_WHEN, MOST_RANGE, MOST_STRINGS, performer_at
from livebass.kernels.player.strokes import fill_strokes, strokes_at
from livebass.kernels.string import answers
from livebass.kernels.string.operators import DOUBLE
from livebass.kernels.string.preparing import (
    NOTE,
    NOTE_BYTES,
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
from livebass.techniques import ACTIONS, FUNCTIONS

BLOCKER_HZ = 6.0  # DC blocker's corner
GAIN_TIME = 6e-3  # s, how fast volume follows its controller
MOST_PICKUPS = 4

# How finely it is computed: two qualities, and what overload falls back to
LIVE, STUDIO, COARSE, TIERS = 0, 1, 2, 3
TIER = np.dtype(
    [
        ("contact_rate", "f8"),  # Hz, at least
        ("heavy", "i8"),  # 1: it needs most of a processor's time
    ],
    align=True,
)

INSTRUMENT = np.dtype(
    [
        ("strings", "i8"),
        ("frets", "i8"),
        ("sensed", "i8"),  # 1: the output is the displacement at sensors, 0: through pickups
        ("slap", "i8"),  # 1: the thumb strikes the lower strings
        ("drop", "i8"),  # 1: notes out of range are left out
        ("stroke", "i8"),  # a row of player.constants.STROKE: FINGER, PICK, NAIL or POP
        ("answering", "i8"),  # performer.NEVER, PEDAL or ALWAYS: when idle strings may answer those that sound
        ("gain", "f8"),
        ("carried", "f8"),  # of the contact rate: the highest mode that is played
        ("tiers", TIER, (TIERS,)),
        ("circuit", CIRCUIT),
        ("player", PLAYER),
        ("key_map", KEY_MAP),
        ("part", "f8", (KEYS,)),  # by velocity: part of the way from the softest to the hardest note
        ("wheel_slides", "i8"),  # 1: the pitch wheel slides along the frets
        ("open_note", "i8", (MOST_STRINGS,)),
        ("answering_modes", "i8", (MOST_STRINGS,)),  # of each string, from the lowest, that may answer others
        ("pickups", "i8", (MOST_STRINGS,)),  # of each string, and of each of them:
        ("decay", "f8", (MOST_STRINGS, MOST_PICKUPS)),  # 1/m
        ("mix", "f8", (MOST_STRINGS, MOST_PICKUPS)),
        ("across", "f8", (MOST_STRINGS, MOST_PICKUPS)),
        ("stretch", "f8", (MOST_STRINGS,)),  # N/m, E A over twice the length that stretches
        ("slack", "f8", (MOST_STRINGS,)),  # how far a force pulls it, over how far before it was tuned
        ("called", "i8", (MOST_STRINGS,)),  # pitch class by which key switches call it
        ("saddle", "f8", (MOST_STRINGS, MOST_PICKUPS)),  # m, distance from the saddle; of sensors, for u and v, too
        ("aperture", "f8", (MOST_STRINGS, MOST_PICKUPS)),  # m
        ("winding", "f8", (MOST_STRINGS,)),  # m, pitch of the winding; 0: it is flat
        ("fretless", "i8", (MOST_STRINGS,)),  # 1: a finger slides along it without steps
    ],
    align=True,
)

MAGIC = 0x5353_4142_4556_494C  # "LIVEBASS"
VERSION = 5  # of the file: another one for any change of FILE, NOTE, STROKE, or of what they mean
WITH_STROKES = 6  # the version of a file that has them, and is one of VERSION else
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

MOST_WORDS = 1 << 23  # of a file
MOST_FRETS = 127
MOST_GRID = 20_000  # steps
LARGEST = 1e15  # of any number in a file

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
FILE_BYTES = FILE.itemsize
WORD = 8  # bytes
STROKE_WORDS = STROKES * STROKE.itemsize // WORD


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
    rest(string_at(string), rate, numerator, denominator, over_frets, over_board)


@jit
def rest(string, rate, numerator, denominator, over_frets, over_board):
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
    connect(string_at(string), instrument_at(instrument), i, coil_at(coil))


@jit
def connect(string, instrument, i, coil):
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
    answers.connect(string_at(string), i, bass, operators_at(ops, bass.strings, bass.frets + 1))


@entry("void(int64, int64, int64)")
def settle_string(string, performer, i):
    """C function: `settle` for the address of a STRING, string `i` of the PERFORMER at an address."""
    settle(string_at(string).voice, performer_at(performer), i)


@jit
def settle(voice, p, i):
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
def take_circuit(coil, instrument, rate):
    """Gives a COIL the parts of the instrument's circuit, and the rate (Hz)."""
    circuit = instrument.circuit
    coil.inductance = circuit.inductance
    coil.resistance = circuit.resistance
    coil.capacitance = circuit.capacitance
    coil.volume_pot = circuit.volume_pot
    coil.tone_pot = circuit.tone_pot
    coil.tone_capacitor = circuit.tone_capacitor
    coil.tone = circuit.tone
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
    return address + WORD * (file.words - 1 - STROKE_WORDS) if file.version == WITH_STROKES else np.int64(0)


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
        numbers -= STROKE_WORDS
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
        note = note_at(address + FILE_BYTES + NOTE_BYTES * k)
        taps = 2 if file.instrument.sensed else file.instrument.pickups[k // (file.instrument.frets + 1)]
        others = answers_of(file.instrument, k // (file.instrument.frets + 1))
        if note.answers_count != others:
            return np.int64(DAMAGED)
        if note.taps_count != taps or not is_note(note, file.instrument.sensed, where, numbers):
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
def is_instrument(instrument):
    """True if the numbers of an INSTRUMENT are such as kernels take."""
    if not 1 <= instrument.strings <= MOST_STRINGS or not 0 <= instrument.frets <= MOST_FRETS:
        return False
    if not 0 <= instrument.sensed <= 1 or not abs(instrument.gain) <= LARGEST:
        return False
    if not 0 <= instrument.slap <= 1 or not 0 <= instrument.drop <= 1 or not 0 <= instrument.stroke < STROKES:
        return False
    if not 0.0 < instrument.carried <= 0.5:
        return False
    if not 0 <= instrument.answering < ANSWERS_WHEN:
        return False
    for i in range(instrument.strings):
        if not 0 <= instrument.answering_modes[i] <= MOST_ANSWERS:
            return False
    for i in range(instrument.strings):
        if answers_of(instrument, i) > MOST_ANSWERS:
            return False
    for tier in range(TIERS):
        if not 8000.0 <= instrument.tiers[tier].contact_rate <= 64e6 or not 0 <= instrument.tiers[tier].heavy <= 1:
            return False
    for i in range(instrument.strings):
        if not 0 <= instrument.pickups[i] <= (0 if instrument.sensed else MOST_PICKUPS):
            return False
        if not 0 <= instrument.open_note[i] <= 127 or not 0 <= instrument.called[i] < 12:
            return False
        if not 1e-3 <= instrument.slack[i] <= 1e3:
            return False
        if not 0.0 <= instrument.winding[i] <= 1.0 or not 0 <= instrument.fretless[i] <= 1:
            return False
        for k in range(MOST_PICKUPS):
            if not 0.0 <= instrument.decay[i, k] <= LARGEST or not abs(instrument.mix[i, k]) <= LARGEST:
                return False
            if not abs(instrument.across[i, k]) <= LARGEST or not 0.0 <= instrument.aperture[i, k] <= 1.0:
                return False
    circuit, player = instrument.circuit, instrument.player
    parts = min(circuit.inductance, circuit.resistance, circuit.capacitance, circuit.volume_pot, circuit.tone_pot)
    if not min(parts, circuit.tone_capacitor) > 0.0 or not 0.0 <= circuit.tone <= 1.0:
        return False
    largest = max(circuit.inductance, circuit.resistance, circuit.capacitance, circuit.volume_pot, circuit.tone_pot)
    if not max(largest, circuit.tone_capacitor) <= LARGEST:
        return False
    if not 0 <= instrument.wheel_slides <= 1:
        return False
    for velocity in range(KEYS):
        if not 0.0 <= instrument.part[velocity] <= 1.0:
            return False
    return is_key_map(instrument.key_map) and is_player(player)


@jit
def are_strokes(address):
    """True if the numbers of STROKES rows of STROKE at an address are such as kernels take."""
    for row in strokes_at(address, STROKES):
        if not 0.0 <= row.soft_width <= 1.0 or not 0.0 <= row.hard_width <= 1.0:
            return False
        if not 0.0 <= row.soft_release <= 1.0 or not 0.0 <= row.hard_release <= 1.0:
            return False
        if not 0.0 <= row.place <= 1.0 or not abs(row.angle) <= 1.6 or not abs(row.other_angle) <= 1.6:
            return False
        if not abs(row.nearer) <= 1.0 or not abs(row.other_nearer) <= 1.0:
            return False
        if not 0.0 < row.lift <= 10.0 or not 0.0 <= row.gentler <= 10.0:
            return False
        if not 0.0 < row.other_level <= 10.0 or not 0.0 <= row.other_release <= 10.0:
            return False
        if not 0 <= row.two_ways <= 1:
            return False
    return True


@jit
def is_key_map(key_map):
    """True if the numbers of a KEY_MAP are such as kernels take."""
    for key in range(KEYS):
        if not 0 <= key_map.action[key] < ACTIONS or not 0 <= key_map.value[key] < KEYS:
            return False
    for number in range(CONTROLLERS):
        if not 0 <= key_map.function[number] < FUNCTIONS:
            return False
    return 0 <= key_map.over_notes <= 1


@jit
def is_player(player):
    """True if the numbers of a PLAYER are such as kernels take."""
    if not 0.0 <= player.pull_time <= 10.0 or not 0.0 <= player.strike_time <= 10.0:
        return False
    if not 0.0 <= player.rounding <= 1.0 or not 0.0 <= player.strike_width <= 1.0:
        return False
    if not 0.0 <= player.rounding_soft <= 1.0 or not abs(player.nearer_when_hard) <= 1.0:
        return False
    if not 0.0 <= player.release_time <= 1.0 or not 0.0 <= player.release_time_soft <= 1.0:
        return False
    if not 0.0 <= player.release_speed <= 100.0:
        return False
    if not 0.0 <= player.thumb_mass <= 10.0 or not 0.0 <= player.thumb_width <= 1.0:
        return False
    if not 0.0 <= player.thumb_stiffness <= 1e8 or not 0.0 <= player.thumb_loss <= 1e3:
        return False
    if not 1e-3 <= player.strike_softest <= 1e2 or not 1e-3 <= player.strike_hardest <= 1e2:
        return False
    if not abs(player.pluck_angle) <= 1.6 or not 0.0 <= player.bend_range <= MOST_RANGE:
        return False
    for place in (player.pluck_position, player.pluck_nearest, player.pluck_farthest, player.strike_position):
        if not 0.0 <= place <= 1.0:
            return False
    if not 0.0 <= player.softest <= 1e3 or not 0.0 <= player.hardest <= 1e3:
        return False
    if not 1e-6 <= player.greatest_apex <= 1.0 or not 0.0 <= player.strike_force <= 1e3:
        return False
    if not 0.0 <= player.hand_damping <= 1e6 or not 0.0 <= player.unevenness <= 1.0:
        return False
    return 0 <= player.slapped_strings <= MOST_STRINGS and 0 <= player.ghost_below <= 128


@jit
def is_list(first, count, width, numbers):
    """True if `count` rows of `width` numbers from `first` on are within the file's."""
    return 0 <= count <= numbers and 0 <= first <= numbers - width * count


@jit
def is_note(note, sensed, where, numbers):
    """True if a NOTE of a file is such as kernels take, with its lists among the `numbers` at an address."""
    if not 2 <= note.grid_points <= MOST_GRID or not 0.05 <= note.length <= 5.0:
        return False
    if not 1.0 <= note.fundamental <= 20e3 or not 0.0 <= note.damped_fundamental <= 20e3:
        return False
    if not 1e-6 <= note.linear_density <= 1.0 or not 1e-3 <= note.tension <= 1e5 or not 0.0 <= note.clamp <= LARGEST:
        return False
    if not 1e-6 <= note.diameter <= 0.1 or not 0.0 <= note.bending <= 1e3 or not 0.0 <= note.inharmonicity <= 1.0:
        return False
    if not 0.0 < note.friction_speed <= LARGEST or not 0.0 <= note.friction <= LARGEST:
        return False
    if not 0.0 < note.contact_stiffness <= 1e30 or not 1.0 <= note.contact_exponent <= 5.0:
        return False
    for x in (
        note.viscoelastic_angle, note.thermoelastic, note.extra_damping, note.extra_damping_slope, note.held_stiffness,
        note.stop,
    ):  # fmt: skip
        if not 0.0 <= x <= LARGEST:
            return False
    lists = is_list(note.resonances, note.resonances_count, 3, numbers)
    lists &= is_list(note.table, note.table_count, 3, numbers)
    lists &= is_list(note.frequencies, note.frequencies_count, 1, numbers)
    lists &= is_list(note.dampings, note.dampings_count, 1, numbers)
    lists &= is_list(note.obstacles, note.obstacles_count, 2, numbers)
    lists &= is_list(note.surface, note.surface_count, 2, numbers)
    lists &= is_list(note.answers, note.answers_count, 2, numbers)
    lists &= is_list(note.taps, note.taps_count, 1 if sensed else 2, numbers)
    if not lists or note.obstacles_count > MOST_NEAR or note.surface_count == 1:
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
    source = words_at(pool.file + FILE_BYTES + NOTE_BYTES * k, NOTE_BYTES // WORD)
    target = words_at(note, NOTE_BYTES // WORD)
    for word in range(NOTE_BYTES // WORD):
        target[word] = source[word]
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
    clear(pool.memory, pool.bytes)
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
def clear(address, size):
    """Sets `size` bytes to zero, a whole number of words."""
    words = words_at(address, size // WORD)
    for k in range(size // WORD):
        words[k] = 0


NOTE_PLACE = POOL.fields["note"][1]  # type: ignore[index]
