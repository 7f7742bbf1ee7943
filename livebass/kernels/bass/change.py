"""Changes a bass by the bench sliders (techniques.py): the same for Python, plugins and page.

`move_bench` changes a BENCH: Python calls it for a preset's section [bench]. `make_change` makes the image of a bass,
changed or not, from its instrument file (kept.py): plugins and page call it.

Sliders are relative to the bass as it is; 0 leaves it unchanged. A slider in % multiplies each string's value and keeps
the differences between strings. So does Action: it multiplies the action of all strings by the ratio that the lowest
string gets. A luthier lowers a bass like this, string by string: the same millimetres on every string would bring the
thin strings, which sit lower, to the frets first. The hand stays the same while the neck changes: it still measures its
force by the original heights. [any thread]
"""

import math

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.bass.bench import bench_at, bow_surface, make_notes, measure_lists
from livebass.kernels.bass.check import DAMAGED, GOOD, checksum_of
from livebass.kernels.bass.instrument import (
    BEYOND,
    FILE,
    FILE_BYTES,
    MAGIC,
    TIERS,
    WORD,
    copy_words,
    file_at,
    lines,
    notes_of,
    words_before_numbers,
)
from livebass.kernels.bass.kept import KEPT, LISTS_COUNT, LOSSES, take_file
from livebass.kernels.machine.elementary import exp, exp2
from livebass.kernels.machine.native import floats_at, record_address, record_at, words_at
from livebass.kernels.string.note import MADE, gap_under, under_tension
from livebass.kernels.string.preparing import ALL, MAX_WORDS, NOTE_BYTES
from livebass.rows import techniques

jit = compiled(attributes=SMALL)

CHANGE = np.dtype(
    [
        ("file", "i8"),  # address of the instrument file ...
        ("size", "i8"),  # ... and its bytes
        ("value", "f8", (techniques.SLIDERS,)),  # of the sliders, in their units
        ("memory", "i8"),  # address of the workspace, including the image ...
        ("bytes", "i8"),  # ... and its size: `measure_change` sets it
        ("made", "i8"),  # address of the image that `make_change` made
        ("words", "i8"),  # of the image
        ("unknown", "i8"),  # fields of the file that this version does not know
        ("first", "i8", (LISTS_COUNT,)),  # address of each of LISTS_KEPT in the file ...
        ("count", "i8", (LISTS_COUNT,)),  # ... and its numbers
        ("kept", KEPT),  # the file's fields; `make_change` modifies them
    ],
    align=True,
)
change_at = record_at(CHANGE)
NUMBERS, HAND_HEIGHTS, RESPONSE = range(LISTS_COUNT)
NAME_PLACE = FILE.fields["name"][1]  # type: ignore[index]  # from there on FILE and KEPT are alike
BENCH_PLACE = CHANGE.fields["kept"][1] + KEPT.fields["bench"][1]  # type: ignore[index]

MM, PERCENT, PICO, DEGREE = 1e-3, 1e-2, 1e-12, math.pi / 180.0
MIN_CAPACITANCE = 50e-12  # F
STEEPEST = 1.55  # rad from straight up
MAX_SLACK = 2.0  # times the pull: nobody pulls a slack string farther
MIN_FRETS = 3  # that a neck needs for action, relief and nut to set its heights
APART = 1.0  # Hz between resonances of the neck, at least


@entry("int64(int64)", SMALL)
def measure_change(address):
    """Reads the file of the CHANGE at an address, and sets the `bytes` needed; returns GOOD, or as `take_file`."""
    change = change_at(address)
    state = take_file(change)
    if state != GOOD:
        return np.int64(state)
    bench, count = change.kept.bench, change.count
    measure_lists(bench)
    if bench.room > MAX_WORDS:
        return np.int64(DAMAGED)
    notes, strings = bench.strings * (bench.frets + 1), 0
    for i in range(bench.strings):
        strings += change.kept.hand_count[i]
    change.bytes = lines(WORD * count[NUMBERS]) + lines(NOTE_BYTES * notes)
    change.bytes += lines(WORD * TIERS * notes) + lines(WORD * bench.room)
    before = FILE_BYTES // WORD + notes * (NOTE_BYTES // WORD + TIERS)
    change.bytes += lines(WORD * (before + bench.room + strings + count[RESPONSE] + 1))
    return np.int64(GOOD)


@entry("int64(int64)", SMALL)
def make_change(address):
    """Makes the image of the CHANGE at an address, after `measure_change`; returns as `fill_bench`.

    `check_file` must accept the image before it is played.
    """
    change = change_at(address)
    kept, bench = change.kept, change.kept.bench
    notes = bench.strings * (bench.frets + 1)
    bench.numbers = change.memory
    copy_words(change.first[NUMBERS], bench.numbers, change.count[NUMBERS])
    bench.notes = bench.numbers + lines(WORD * change.count[NUMBERS])
    bench.modes = bench.notes + lines(NOTE_BYTES * notes)
    bench.lists = bench.modes + lines(WORD * TIERS * notes)
    change.made = bench.lists + lines(WORD * bench.room)
    image = file_at(change.made)
    image.magic = MAGIC
    copy_words(record_address(kept), change.made + NAME_PLACE, (FILE_BYTES - NAME_PLACE) // WORD)
    image.instrument.hand[:] = 0
    other_neck = move(bench, change.value)
    take_bench(bench, image.instrument)
    if change.value[techniques.CONTACT_LOSS] != 0.0:
        choose_tiers(kept, bench, image.instrument)
    state = make_notes(bench)
    if state == MADE:
        put_together(change, other_neck or kept.hand_stays == 1)
    return np.int64(state)


@entry("int64(int64, int64)", SMALL)
def move_bench(bench, values):
    """Moves the BENCH at an address by SLIDERS float64 at another; returns 1 if frets or board have moved."""
    return np.int64(move(bench_at(bench), floats_at(values, techniques.SLIDERS)))


@jit
def move(bench, value):
    """Moves a BENCH by the slider values; returns True if frets or board have moved."""
    numbers = floats_at(bench.numbers, ALL)
    move_strings(bench, value)
    tune_strings(bench, numbers, value)
    move_pickups(bench, numbers, value)
    move_hand(bench, value)
    move_resonance(bench, numbers, value)
    moved = move_neck(bench, numbers, value)
    return lift_fret(bench, numbers, value) or moved


@jit
def move_strings(bench, value):
    """Makes the strings thicker at their pitch, heavier for their thickness, older, damped by foam and frets.

    The tension scales with the mass, the bending stiffness E I with the fourth power of the thickness, and B with E I
    over the tension.
    """
    g, t, older = (
        1.0 + PERCENT * value[techniques.GAUGE],
        1.0 + PERCENT * value[techniques.TENSION],
        1.0 + PERCENT * value[techniques.WEAR],
    )
    for i in range(bench.strings):
        string = bench.string[i]
        string.diameter *= g
        string.linear_density = string.linear_density * g * g * t
        string.tension = string.tension * g * g * t
        string.inharmonicity = string.inharmonicity * g * g / t
        string.viscoelastic_angle *= older
        string.thermoelastic *= older
        string.relaxation *= older
        string.extra_damping += value[techniques.FOAM]
        string.axial_stiffness = string.axial_stiffness * g * g
        bench.contact_loss[i] *= 1.0 + PERCENT * value[techniques.CONTACT_LOSS]
        string.contact_loss = bench.contact_loss[i] / bench.pressing[i]


@jit
def tune_strings(bench, numbers, value):
    """Tunes the strings by their tension: model.instrument.tensioned for each, with its measured modes.

    A string pulled tighter gives way less: see `take_bench`. Notes keep their offsets from the frets' own pitches.
    """
    named, higher = np.int64(value[techniques.NAMED_TUNING]), (bench.a4 + value[techniques.CONCERT_PITCH]) / bench.a4
    if named == 0 and value[techniques.CONCERT_PITCH] == 0.0:
        return
    bench.a4 += value[techniques.CONCERT_PITCH]
    for i in range(bench.strings):
        string = bench.string[i]
        string.shifted = techniques.TUNED_BY[named]
        if string.open_note == techniques.TUNED_DROPPED[named]:
            string.shifted -= techniques.TUNED_FURTHER[named]
        string.retuned = exp2(string.shifted / 12.0) * higher
        square, f0 = string.retuned * string.retuned, string.law_fundamental
        if f0 == 0.0:
            f0 = np.sqrt(string.tension / string.linear_density) / (2 * string.length)
        for j in range(string.frequencies_count):
            nu = numbers[string.frequencies + j]
            numbers[string.frequencies + j] = np.sqrt(nu * nu + (square - 1.0) * (((j + 1) * f0) * ((j + 1) * f0)))
        string.tension, string.inharmonicity = under_tension(string.tension, string.inharmonicity, string.retuned)
        string.law_fundamental *= string.retuned
        for k in range(string.pitches_count):
            numbers[string.pitches + 2 * k] *= string.retuned


@jit
def move_pickups(bench, numbers, value):
    """Moves the pickups along the strings, as far as there is room, and towards them; changes their cable.

    Nearer to the strings is louder: the flux falls by a factor of e per decay length.
    """
    if value[techniques.CABLE] != 0.0:
        bench.capacitance = max(bench.capacitance + PICO * value[techniques.CABLE], MIN_CAPACITANCE)
    room = np.inf
    for i in range(bench.strings):
        room = min(room, bench.string[i].length - end_of_neck(bench.string[i], numbers))
    for p in range(bench.pickups):
        place, height = value[techniques.PICKUP_PLACE], value[techniques.PICKUP_HEIGHT]
        if p < techniques.OWN_PICKUPS:
            place += value[techniques.PICKUP_1_PLACE + 2 * p]
            height += value[techniques.PICKUP_1_HEIGHT + 2 * p]
        if place != 0.0:
            half = 0.5 * bench.aperture[p]
            bench.position[p] = max(min(bench.position[p] + MM * place, room - half), half)
        if height != 0.0:
            bench.pickup_level[p] *= exp(MM * height / bench.decay_length[p])
        for i in range(bench.strings):
            if bench.tap[p, i] >= 0:
                numbers[bench.string[i].taps + bench.string[i].tap_width * bench.tap[p, i]] = bench.position[p]


@jit
def end_of_neck(string, numbers):
    """Returns the place of the last fret, or the end of a board beyond it, m from the nut."""
    end = 0.0
    if string.frets_count > 0:
        end = numbers[string.frets + 2 * (string.frets_count - 1)]
    if string.surface_count > 0:
        end = max(end, numbers[string.surface + 2 * (string.surface_count - 1)])
    return end


@jit
def move_hand(bench, value):
    """Makes the finger wider at every velocity, turns the pull more across, and the hardest pluck harder."""
    wider = 1.0 + PERCENT * value[techniques.FINGER_WIDTH]
    bench.rounding *= wider
    bench.rounding_soft *= wider
    if value[techniques.PLUCK_ANGLE] != 0.0:
        bench.pluck_angle = max(min(bench.pluck_angle + DEGREE * value[techniques.PLUCK_ANGLE], STEEPEST), -STEEPEST)
    if value[techniques.HARDEST] != 0.0:
        bench.hardest = max(bench.hardest * (1.0 + PERCENT * value[techniques.HARDEST]), bench.softest)


@jit
def move_resonance(bench, numbers, value):
    """Moves the lowest resonance that bends the neck, kept between its neighbours, and its moving mass."""
    for i in range(bench.strings):
        string, k = bench.string[i], 0
        while k < string.bending_count and numbers[string.bending + k] == 0.0:
            k += 1
        if k == string.bending_count:
            continue
        row = string.resonances + 3 * k
        if value[techniques.NECK_RESONANCE] != 0.0:
            nu = numbers[row] * (1.0 + PERCENT * value[techniques.NECK_RESONANCE])
            if k + 1 < string.resonances_count:
                nu = min(nu, numbers[row + 3] - APART)
            if k > 0:
                nu = max(nu, numbers[row - 3] + APART)
            numbers[row] = nu
        numbers[row + 2] *= 1.0 + PERCENT * value[techniques.NECK_MASS]


@jit
def move_neck(bench, numbers, value):
    """Raises the strings over the frets by the changes in action, relief and nut; returns True if it did.

    Skips necks whose frets count from a capo or are too few, and boards that no bow fits.
    """
    action, relief, nut_height = (
        MM * value[techniques.ACTION],
        MM * value[techniques.NECK_RELIEF],
        MM * value[techniques.NUT_HEIGHT],
    )
    if action == 0.0 and relief == 0.0 and nut_height == 0.0:
        return False
    moved, lowest = False, action_of(bench.string[0], numbers)
    for i in range(bench.strings):
        string = bench.string[i]
        frets, count = string.frets, string.frets_count
        if string.capo or count < MIN_FRETS or (string.surface_count > 0 and not string.bowed):
            continue
        moved, part = True, 1.0
        if lowest > 0.0:
            part = action_of(string, numbers) / lowest
        for k in range(count):
            numbers[frets + 2 * k + 1] -= gap_under(numbers, frets, count, k, action * part, relief, nut_height)
        if string.surface_count > 0:
            bow_surface(numbers, frets, count, string.surface, string.surface_count)
    return moved


@jit
def action_of(string, numbers):
    """Gap (m) under an open string at fret 12, or at the last fret."""
    count = min(12, string.frets_count)
    return -numbers[string.frets + 2 * count - 1] if count > 0 else 0.0


@jit
def lift_fret(bench, numbers, value):
    """Raises one fret of a fretted neck without a capo; returns True if it did."""
    fret, moved = np.int64(value[techniques.FRET]), False
    if fret > 0 and value[techniques.FRET_HEIGHT] != 0.0:
        for i in range(bench.strings):
            string = bench.string[i]
            if not string.capo and string.surface_count == 0 and fret <= string.frets_count:
                numbers[string.frets + 2 * fret - 1] += MM * value[techniques.FRET_HEIGHT]
                moved = True
    return moved


@jit
def take_bench(bench, instrument):
    """Copies the numbers that sliders move from a BENCH to an INSTRUMENT, as Python's `instrument_numbers` does."""
    instrument.circuit.capacitance = bench.capacitance
    player = instrument.player
    player.rounding = bench.rounding
    player.rounding_soft = bench.rounding_soft
    player.pluck_angle = bench.pluck_angle
    player.hardest = bench.hardest
    for i in range(bench.strings):
        instrument.open_note[i] += bench.string[i].shifted
        if bench.string[i].retuned != 1.0:
            square = bench.string[i].retuned * bench.string[i].retuned
            instrument.slack[i] = min(instrument.slack[i] / square, MAX_SLACK)
        instrument.stretch[i] = bench.string[i].axial_stiffness / (2 * (bench.string[i].length + BEYOND))
        for p in range(bench.pickups):
            k = bench.tap[p, i]
            if k >= 0:
                instrument.saddle[i, k] = bench.position[p]
                instrument.mix[i, k] = bench.pickup_level[p] * bench.string[i].level


@jit
def choose_tiers(kept, bench, instrument):
    """Picks the tiers that the lowest fret loss calls for, or the lowest board loss if there is a board."""
    board, minimum = False, np.inf
    for i in range(bench.strings):
        board |= bench.string[i].surface_count > 0
    for i in range(bench.strings):
        if (bench.string[i].surface_count > 0) == board:
            minimum = min(minimum, bench.string[i].contact_loss)
    found = 0
    for k in range(LOSSES):
        if minimum >= kept.from_loss[k]:
            found = k
    for tier in range(TIERS):
        bench.tiers[tier] = kept.modes[found, tier]
        instrument.tiers[tier].contact_rate = kept.contact_rate[found, tier]
        instrument.tiers[tier].heavy = kept.heavy[found, tier]


@jit
def put_together(change, hand):
    """Writes the image: the BENCH's notes, their lists, heights for the hand if it has any, response, and checksum."""
    kept, bench, image = change.kept, change.kept.bench, file_at(change.made)
    notes, before = notes_of(image), words_before_numbers(image)
    copy_words(bench.notes, change.made + FILE_BYTES, NOTE_BYTES // WORD * notes)
    copy_words(bench.modes, change.made + FILE_BYTES + NOTE_BYTES * notes, TIERS * notes)
    copy_words(bench.lists, change.made + WORD * before, bench.used)
    end = before + bench.used
    for i in range(bench.strings):
        if hand:
            image.instrument.hand[i] = end - before + 1
            first = change.first[HAND_HEIGHTS] + WORD * (kept.instrument.hand[i] - 1)
            copy_words(first, change.made + WORD * end, kept.hand_count[i])
            end += kept.hand_count[i]
    copy_words(change.first[RESPONSE], change.made + WORD * end, change.count[RESPONSE])
    end += change.count[RESPONSE]
    image.words = end + 1
    words_at(change.made + WORD * end, 1)[0] = np.int64(checksum_of(change.made, end))
    change.words = end + 1
