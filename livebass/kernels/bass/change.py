"""Makes the file of a bass whose neck, strings, pickups or hand are changed, from its own and its sliders' file.

A sliders' file lies beside an instrument file: SLIDERS with the BENCH of the bass, the numbers of its lists, all
strokes and effects as an instrument file may have them, and a checksum. A slider moves what the bass has, by a
difference or in proportion; 0 leaves it. The hand stays while the neck changes: it goes on measuring its force by the
heights of the bass's own file. [any thread]
"""

import math

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.bass.bench import BENCH, bench_at, bow_surface, make_notes, measure_lists
from livebass.kernels.bass.check import checksum_of
from livebass.kernels.bass.instrument import (
    ADDED_BYTES,
    FILE_BYTES,
    MOST_PICKUPS,
    ROOM_OF_STROKES,
    TIERS,
    WORD,
    added_at,
    added_of,
    copy_words,
    file_at,
    lines,
    notes_of,
    words_before_numbers,
)
from livebass.kernels.machine.elementary import exp
from livebass.kernels.machine.native import floats_at, record_at, words_at
from livebass.kernels.string.note import MADE, gap_under
from livebass.kernels.string.preparing import ALL, MOST_WORDS, NOTE_BYTES, note_at
from livebass.parts import VERSION, WITH_EFFECTS
from livebass.techniques import (
    ACTION,
    BUILT,
    CABLE,
    CONTACT_LOSS,
    FINGER_WIDTH,
    FOAM,
    GAUGE,
    HARDEST,
    NECK_RELIEF,
    NUT_HEIGHT,
    PICKUP_HEIGHT,
    PICKUP_PLACE,
    PLUCK_ANGLE,
    TENSION,
    WEAR,
)

jit = compiled(attributes=SMALL)

SLIDERS_MAGIC = 0x5345_4449_4C53_424C  # "LBSLIDES"
LOSSES = 3  # ranges of the loss at the frets, each with tiers of its own
SLIDERS = np.dtype(
    [
        ("magic", "i8"),
        ("words", "i8"),  # of the whole file
        ("of", "u8"),  # checksum of the instrument file that it is beside
        ("bytes", "i8"),  # of this record
        ("numbers", "i8"),  # words of the lists, behind this
        ("rest", "i8"),  # words of strokes and effects, behind these
        ("from_loss", "f8", (LOSSES,)),  # s/m, ascending, where each range begins
        ("modes", "i8", (LOSSES, TIERS)),  # as BENCH.tiers
        ("contact_rate", "f8", (LOSSES, TIERS)),  # Hz
        ("heavy", "i8", (LOSSES, TIERS)),
        ("bench", BENCH),
    ],
    align=True,
)
sliders_at = record_at(SLIDERS)
SLIDERS_BYTES = SLIDERS.itemsize
BENCH_PLACE = SLIDERS.fields["bench"][1]  # type: ignore[index]

CHANGE = np.dtype(
    [
        ("file", "i8"),  # address of the instrument file, which `check_file` accepts
        ("sliders", "i8"),  # address of the sliders' file; it is changed
        ("size", "i8"),  # of that, bytes
        ("value", "f8", (BUILT,)),  # of the parameters, in their units
        ("memory", "i8"),  # address of the workspace, and of the file that is made ...
        ("bytes", "i8"),  # ... and how many it has: `measure_change` sets them
        ("made", "i8"),  # address of the file that `make_change` made
        ("words", "i8"),  # of that
    ],
    align=True,
)
change_at = record_at(CHANGE)

MM, PERCENT, PICO = 1e-3, 1e-2, 1e-12
LEAST_CAPACITANCE = 50e-12  # F
STEEPEST = 1.55  # rad from straight up
LEAST_FRETS = 3  # of a neck whose heights follow from action, relief and nut


@entry("int64(int64)", SMALL)
def measure_change(address):
    """Sets the `bytes` that the CHANGE at an address needs; returns 0 for sliders that are not its file's."""
    change = change_at(address)
    if change.size < SLIDERS_BYTES + WORD or change.size % WORD != 0 or change.size > WORD * MOST_WORDS:
        return np.int64(0)
    s, file, last = sliders_at(change.sliders), file_at(change.file), change.size // WORD - 1
    if s.magic != SLIDERS_MAGIC or s.bytes != SLIDERS_BYTES or s.words != last + 1:
        return np.int64(0)
    own = np.uint64(words_at(change.file + WORD * (file.words - 1), 1)[0])
    if s.of != own or checksum_of(change.sliders, last) != np.uint64(words_at(change.sliders + WORD * last, 1)[0]):
        return np.int64(0)
    if s.numbers < 0 or s.rest < ROOM_OF_STROKES or SLIDERS_BYTES // WORD + s.numbers + s.rest != last:
        return np.int64(0)
    bench = bench_at(change.sliders + BENCH_PLACE)
    if bench.strings != file.instrument.strings or bench.frets != file.instrument.frets:
        return np.int64(0)
    measure_lists(bench)
    notes = notes_of(file)
    change.bytes = lines(NOTE_BYTES * notes) + lines(WORD * TIERS * notes) + lines(WORD * bench.room)
    contacts = 0
    for i in range(bench.strings):
        contacts += contacts_of(change.file, i)
    change.bytes += lines(WORD * (words_before_numbers(file) + bench.room + contacts + s.rest + 1))
    return np.int64(1)


@entry("int64(int64)", SMALL)
def make_change(address):
    """Makes the file of the CHANGE at an address that `measure_change` has seen; returns as `fill_bench`.

    `check_file` must accept it before it is played.
    """
    change = change_at(address)
    s, file, bench = sliders_at(change.sliders), file_at(change.file), bench_at(change.sliders + BENCH_PLACE)
    notes = notes_of(file)
    bench.numbers = change.sliders + SLIDERS_BYTES
    bench.notes = change.memory
    bench.modes = bench.notes + lines(NOTE_BYTES * notes)
    bench.lists = bench.modes + lines(WORD * TIERS * notes)
    change.made = bench.lists + lines(WORD * bench.room)
    copy_words(change.file, change.made, FILE_BYTES // WORD)
    made = file_at(change.made)
    numbers, value = floats_at(bench.numbers, ALL), change.value
    move_strings(bench, made.instrument, value)
    move_pickups(bench, numbers, made.instrument, value)
    move_hand(made.instrument, value)
    lose(s, bench, made.instrument, value)
    other_neck = move_neck(bench, numbers, value)
    state = make_notes(bench)
    if state == MADE:
        put_together(change, s, bench, other_neck)
    return np.int64(state)


@jit
def move_strings(bench, instrument, value):
    """Makes the strings thicker at their pitch, heavier for their thickness, older, and damped by foam.

    The tension goes with the mass; the bending stiffness E I with the fourth power of the thickness, and B with E I
    over the tension.
    """
    g, t, older = 1.0 + PERCENT * value[GAUGE], 1.0 + PERCENT * value[TENSION], 1.0 + PERCENT * value[WEAR]
    for i in range(bench.strings):
        string = bench.string[i]
        string.diameter *= g
        string.linear_density = string.linear_density * g * g * t
        string.tension = string.tension * g * g * t
        string.inharmonicity = string.inharmonicity * g * g / t
        string.viscoelastic_angle *= older
        string.thermoelastic *= older
        string.extra_damping += value[FOAM]
        instrument.stretch[i] = instrument.stretch[i] * g * g


@jit
def move_pickups(bench, numbers, instrument, value):
    """Moves the pickups along the strings, as far as there is room, and nearer to them; changes their cable.

    Nearer to the strings is louder: the flux falls e times with each decay length.
    """
    cable = instrument.circuit.capacitance + PICO * value[CABLE]
    if value[CABLE] != 0.0:
        instrument.circuit.capacitance = max(cable, LEAST_CAPACITANCE)
    for i in range(bench.strings):
        string = bench.string[i]
        room = string.length
        if string.frets_count > 0:
            room -= numbers[string.frets + 2 * (string.frets_count - 1)]
        for k in range(min(instrument.pickups[i], MOST_PICKUPS)):
            half = 0.5 * instrument.aperture[i, k]
            if value[PICKUP_PLACE] != 0.0:
                place = instrument.saddle[i, k] + MM * value[PICKUP_PLACE]
                instrument.saddle[i, k] = max(min(place, room - half), half)
                numbers[string.taps + string.tap_width * k] = instrument.saddle[i, k]
            if value[PICKUP_HEIGHT] != 0.0:
                instrument.mix[i, k] *= exp(MM * value[PICKUP_HEIGHT] * instrument.decay[i, k])


@jit
def move_hand(instrument, value):
    """Makes the finger wider, turns the pull more across, and the hardest pluck harder."""
    player, wider = instrument.player, 1.0 + PERCENT * value[FINGER_WIDTH]
    player.rounding *= wider
    player.rounding_soft *= wider
    if value[PLUCK_ANGLE] != 0.0:
        angle = player.pluck_angle + value[PLUCK_ANGLE] * math.pi / 180.0
        player.pluck_angle = max(min(angle, STEEPEST), -STEEPEST)
    if value[HARDEST] != 0.0:
        player.hardest = max(player.hardest * (1.0 + PERCENT * value[HARDEST]), player.softest)


@jit
def lose(s, bench, instrument, value):
    """Has the frets take more from the strings that hit them, in the tiers that this calls for."""
    if value[CONTACT_LOSS] == 0.0:
        return
    least = np.inf
    for i in range(bench.strings):
        bench.string[i].contact_loss *= 1.0 + PERCENT * value[CONTACT_LOSS]
        least = min(least, bench.string[i].contact_loss)
    found = 0
    for k in range(LOSSES):
        if least >= s.from_loss[k]:
            found = k
    for tier in range(TIERS):
        bench.tiers[tier] = s.modes[found, tier]
        instrument.tiers[tier].contact_rate = s.contact_rate[found, tier]
        instrument.tiers[tier].heavy = s.heavy[found, tier]


@jit
def move_neck(bench, numbers, value):
    """Raises the strings over the frets by what the differences come to there; returns True if it did.

    It leaves a neck whose frets count from a capo, or with too few of them, or a board that no bow fits.
    """
    action, relief, nut_height = MM * value[ACTION], MM * value[NECK_RELIEF], MM * value[NUT_HEIGHT]
    if action == 0.0 and relief == 0.0 and nut_height == 0.0:
        return False
    moved = False
    for i in range(bench.strings):
        string = bench.string[i]
        frets, count = string.frets, string.frets_count
        if string.capo or count < LEAST_FRETS or (string.surface_count > 0 and not string.bowed):
            continue
        moved = True
        for k in range(count):
            numbers[frets + 2 * k + 1] -= gap_under(numbers, frets, count, k, action, relief, nut_height)
        if string.surface_count > 0:
            bow_surface(numbers, frets, count, string.surface, string.surface_count)
    return moved


@jit
def contacts_of(file, i):
    """How many contacts are under the open string `i` of the file at an address."""
    note = note_at(file + FILE_BYTES + NOTE_BYTES * i * (file_at(file).instrument.frets + 1))
    return note.obstacles_count + note.surface_count


@jit
def put_together(change, s, bench, other_neck):
    """Writes the file: the notes of the BENCH, their lists, heights for the hand, strokes and effects, checksum."""
    own, file = file_at(change.file), file_at(change.made)
    notes, before = notes_of(file), words_before_numbers(file)
    copy_words(bench.notes, change.made + FILE_BYTES, NOTE_BYTES // WORD * notes)
    copy_words(bench.modes, change.made + FILE_BYTES + NOTE_BYTES * notes, TIERS * notes)
    copy_words(bench.lists, change.made + WORD * before, bench.used)
    end, added = before + bench.used, added_of(change.file)
    rest = change.sliders + SLIDERS_BYTES + WORD * s.numbers
    theirs = rest + WORD * s.rest - ADDED_BYTES
    for i in range(bench.strings):
        first = np.int64(0)
        if added != 0:
            first = added_at(added).hand[i]
        if other_neck or first > 0:
            added_at(theirs).hand[i] = end - before + 1
            end = copy_heights(change, i, first, end)
            file.version = WITH_EFFECTS
    count = np.int64(0)
    if file.version == WITH_EFFECTS:
        count = s.rest
    elif own.version != VERSION:
        count = np.int64(ROOM_OF_STROKES)
    copy_words(rest, change.made + WORD * end, count)
    end += count
    file.words = end + 1
    words_at(change.made + WORD * end, 1)[0] = np.int64(checksum_of(change.made, end))
    change.words = end + 1


@jit
def copy_heights(change, i, first, end):
    """Puts the heights by which the hand measures its force on string `i` of its own file at word `end` of the new one.

    first: where they begin among the numbers there, and 1; 0: they are those of the open note. Returns the word behind.
    """
    own = file_at(change.file)
    numbers = floats_at(change.file + WORD * words_before_numbers(own), ALL)
    made, note = (
        floats_at(change.made, ALL),
        note_at(change.file + FILE_BYTES + NOTE_BYTES * i * (own.instrument.frets + 1)),
    )
    rows = note.obstacles if note.surface_count == 0 else note.surface
    for k in range(contacts_of(change.file, i)):
        made[end + k] = numbers[first - 1 + k] if first > 0 else numbers[rows + 2 * k + 1]
    return end + contacts_of(change.file, i)
