"""Makes the notes of a bass from its numbers: strings, necks and pickups in, NOTEs (preparing.py) and their lists out.

A BENCH holds what its maker decides, in SI units, with a BENCH_STRING for each string and its neck; lists of any length
lie in one array of numbers, as those of a NOTE do. What takes powers or bending shapes is among them, worked out once:
the frequencies of the notes, and by which part each resonance of the neck is felt at each fret. Everything else is
here, in additions, multiplications, divisions and square roots, which have the same bits everywhere. Python calls some
of these functions as they are, for single notes (model/instrument.py): a preset loads without compiled kernels. The
notes of whole basses are made by the compiled ones. Equation numbers: Issanchou et al. (2018). [any thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import entry, jit, shared
from livebass.kernels.bass.instrument import TIERS
from livebass.kernels.machine.native import floats_at, record_at, words_at
from livebass.kernels.player.performer import MOST_STRINGS
from livebass.kernels.string.law import (
    admittance,
    bending_stiffness,
    clamped_mode,
    detuning,
    frequency,
    held_part,
    neck_damping,
    resonance,
    stretched,
    tabled,
)
from livebass.kernels.string.preparing import ALL, NOTE, NOTE_BYTES, listed, note_at

ROUNDING = 1e-9  # m, by which a crown may stand above the string at rest and still count as level with it
BOARD_ROUGH = 20e-6  # m, by which a board may stand above the string at rest; it is pressed flat
MOST_DETUNING = 0.05  # relative shift of a mode by the neck: beyond, eq. 8 fails, as it is of first order
LEAST_GRID = 8  # steps
SPLIT = 134217729.0  # 2^27 + 1: takes a float64 apart into two halves (Veltkamp)
LANES = 8  # partial sums of a long sum: of every eighth number

BENCH_STRING = np.dtype(
    [
        ("paper_law", "i8"),  # 1: String.stiffness_law is "paper", 0: "hinged"
        ("answering_modes", "i8"),  # of the open string, that may answer others
        ("tap_width", "i8"),  # numbers of a tap
        ("capo", "i8"),  # 1: the neck has one, and even the open string a stop
        ("length", "f8"),  # m, nut to saddle
        ("linear_density", "f8"),  # kg/m
        ("tension", "f8"),  # N
        ("diameter", "f8"),  # m
        ("inharmonicity", "f8"),  # B of the open string
        ("viscoelastic_angle", "f8"),
        ("thermoelastic", "f8"),
        ("extra_damping", "f8"),  # 1/s
        ("extra_damping_slope", "f8"),
        ("law_fundamental", "f8"),  # Hz, f0 of the open string if measured; 0: from its pitch
        ("contact_stiffness", "f8"),  # K of eq. 6
        ("contact_exponent", "f8"),  # alpha of eq. 6
        ("friction", "f8"),  # N/m, A of eq. 7
        ("friction_speed", "f8"),  # m/s, s of eq. 7
        ("grid_step", "f8"),  # m, dx
        ("nut_conductance", "f8"),  # m/s/N, Re Y at every frequency, of the nut ...
        ("stop_conductance", "f8"),  # ... and of a fret and the finger behind it
        *listed("pitches"),  # (Hz, and how many times as high the string is tuned for it) of the notes, the open first
        *listed("frets"),  # (m from the nut, height of the crown in m) each
        *listed("resonances"),  # (Hz, Q, kg) each
        # For the nut and each fret, one after the other, the part of each resonance, and then that of the table, that
        # is felt there; and the part by which a force there moves the nut, where strings answer
        *listed("parts"),
        *listed("nut_parts"),
        *listed("table"),  # (Hz, Re Y, Im Y) each, ascending
        *listed("frequencies"),  # (Hz,) each, measured
        *listed("dampings"),  # (1/s,) each, measured
        *listed("surface"),  # (m from the nut, height in m) each, ascending; or none
        *listed("taps"),  # (m from the saddle,) each of a sensor, or with the aperture (m) of a pickup
    ],
    align=True,
)

BENCH = np.dtype(
    [
        ("strings", "i8"),
        ("frets", "i8"),  # that every string is played at
        ("sensed", "i8"),  # as INSTRUMENT
        ("tiers", "i8", (TIERS,)),  # modes of the open strings; 0: all that the grid carries
        ("most_modes", "i8"),
        ("string", BENCH_STRING, (MOST_STRINGS,)),
        ("numbers", "i8"),  # address: float64, the lists of the strings
        ("notes", "i8"),  # address: NOTE (strings, frets + 1)
        ("modes", "i8"),  # address: int64 (TIERS, strings, frets + 1)
        ("lists", "i8"),  # address: float64 (room,) for the lists of the notes
        ("room", "i8"),  # `measure_bench` sets it
        ("used", "i8"),  # of that; `fill_bench` sets it, or where it failed:
        ("fault_string", "i8"),
        ("fault_fret", "i8"),
        ("fault_height", "f8"),  # m above the string at rest
        ("fault_place", "f8"),  # number of the crown, or m from the stop
        ("note", NOTE),  # workspace
    ],
    align=True,
)
bench_at = record_at(BENCH)

# What `make_note` and `fill_bench` return
MADE, CROWN_ABOVE, BOARD_ABOVE = 0, 1, 2


# One note. `string` is a BENCH_STRING, `note` a NOTE, or objects with their fields; `numbers` the lists of the string,
# `lists` those of the note.


@shared
def crown(string, numbers, k):
    """Place (m from the nut) and height (m) of fret `k`; 0 is the nut."""
    if k == 0:
        return 0.0, 0.0
    row = string.frets + 2 * (k - 1)
    return numbers[row], numbers[row + 1]


@shared
def resting_on(string, numbers, fret):
    """The fret that the string rests on when stopped at `fret`: one beyond, if it stands so high that it chokes it."""
    stop = fret
    if fret == 0:
        return stop
    x, h = crown(string, numbers, fret)
    steepest = h / (string.length - x)
    for k in range(fret + 1, string.frets_count + 1):
        x, h = crown(string, numbers, k)
        steep = h / (string.length - x)
        if steep > steepest:
            stop, steepest = k, steep
    return stop


@shared
def under_tension(tension, inharmonicity, ratio):
    """T and B of a string that sounds `ratio` times as high: T r^2 and B / r^2, as E I stays."""
    square = ratio * ratio
    return tension * square, inharmonicity / square


@shared
def make_note(string, numbers, fret, note, lists, end):
    """Makes the note of `string` at `fret`, but for its modes and answers, with its lists from `end` on.

    A note is in tune wherever its fret is exactly, as a compensated saddle would do; one with an offset of its own has
    another tension. The neck shifts each mode by a different part (eq. 8): the first one is in tune.

    Returns the fret it rests on, MADE or CROWN_ABOVE, the crown and its height (m) if it is above the string at rest,
    and the place behind the lists.
    """
    stop = resting_on(string, numbers, fret)
    note.length = string.length - crown(string, numbers, stop)[0]
    note.grid_points = max(LEAST_GRID, int(np.rint(note.length / string.grid_step)))
    take_numbers(string, numbers, stop, note)
    end = set_admittance(string, numbers, stop, note, lists, end)
    end = set_measured(string, numbers, stop, note, lists, end)
    tune(string, numbers, stop, note, lists)
    note.damped_fundamental = note.fundamental
    if stop == 0 and string.law_fundamental != 0.0:  # measured: the published dampings still follow c / 2L
        note.damped_fundamental = np.sqrt(string.tension / string.linear_density) / (2 * string.length)
    note.obstacles = end
    state, which, height, behind = set_obstacles(string, numbers, stop, note, lists, end)
    if state != MADE:
        return stop, state, which, height, end
    if string.surface_count > 0:  # in place of the crowns
        x, h = crown(string, numbers, stop)
        note.obstacles_count, note.surface = 0, end
        end = surface_beyond(numbers, string.surface, string.surface_count, x, h, string.length, lists, end)
        note.surface_count = (end - note.surface) // 2
    else:
        note.surface, note.surface_count = behind, 0
        end = behind
    note.taps, note.taps_count = end, string.taps_count
    wide = string.tap_width
    for k in range(string.taps_count):
        lists[end] = note.length - numbers[string.taps + wide * k]
        if wide == 2:
            lists[end + 1] = numbers[string.taps + wide * k + 1]
        end += wide
    return stop, MADE, 0, 0.0, end


@shared
def take_numbers(string, numbers, stop, note):
    """Sets what the note has of its string and neck."""
    ratio = numbers[string.pitches + 2 * stop + 1]
    tension, inharmonicity = under_tension(string.tension, string.inharmonicity, ratio)
    part = string.length / note.length
    note.paper_law = string.paper_law
    note.tension = tension
    note.inharmonicity = inharmonicity * (part * part)
    note.bending = bending_stiffness(inharmonicity, tension, string.length)
    note.held_stiffness = held_part(string.paper_law, note.inharmonicity, note.length)
    note.clamp = clamped_mode(note.length)
    note.linear_density = string.linear_density
    note.diameter = string.diameter
    note.viscoelastic_angle = string.viscoelastic_angle
    note.thermoelastic = string.thermoelastic
    note.extra_damping = string.extra_damping
    note.extra_damping_slope = string.extra_damping_slope
    note.contact_stiffness = string.contact_stiffness
    note.contact_exponent = string.contact_exponent
    note.friction = string.friction
    note.friction_speed = string.friction_speed


@shared
def set_admittance(string, numbers, stop, note, lists, end):
    """Sets the admittance of the neck at a stop: each resonance counts by its part there, as if its mass were greater.

    Returns the place behind its lists.
    """
    note.stop = string.stop_conductance if stop > 0 or string.capo else string.nut_conductance
    count = string.resonances_count
    parts = string.parts + stop * (count + 1)
    note.resonances, note.resonances_count = end, 0
    for k in range(count):
        part, row = numbers[parts + k], string.resonances + 3 * k
        if part != 0.0:
            lists[end] = numbers[row]
            lists[end + 1] = numbers[row + 1]
            lists[end + 2] = numbers[row + 2] / part
            note.resonances_count += 1
            end += 3
    part = numbers[parts + count]
    note.table, note.table_count = end, string.table_count if part != 0.0 else 0
    for k in range(note.table_count):
        row = string.table + 3 * k
        lists[end] = numbers[row]
        lists[end + 1] = part * numbers[row + 1]
        lists[end + 2] = part * numbers[row + 2]
        end += 3
    return end


@shared
def set_measured(string, numbers, stop, note, lists, end):
    """Copies the measured modes, which are those of the open string. Returns the place behind them."""
    note.frequencies, note.frequencies_count = end, string.frequencies_count if stop == 0 else 0
    for k in range(note.frequencies_count):
        lists[end + k] = numbers[string.frequencies + k]
    end += note.frequencies_count
    note.dampings, note.dampings_count = end, string.dampings_count if stop == 0 else 0
    for k in range(note.dampings_count):
        lists[end + k] = numbers[string.dampings + k]
    return end + note.dampings_count


@shared
def tune(string, numbers, stop, note, lists):
    """Sets f0 so that the first mode sounds at the pitch of the note."""
    if stop == 0 and string.law_fundamental != 0.0:
        note.fundamental = string.law_fundamental
        return
    pitch = numbers[string.pitches + 2 * stop]
    mass = 2 * string.linear_density * note.length  # kg, so that mu c is mass times f0
    mute = string.extra_damping / (2 * np.pi) + string.extra_damping_slope * pitch  # Hz
    if note.stop != 0.0:
        mute += neck_damping(admittance(note, lists, pitch)[0], mass * pitch, pitch) / (2 * np.pi)
    sounds = hypotenuse(pitch, mute)  # tuned higher, as a damped mode rings lower than its eigenfrequency
    stretch = stretched(note.paper_law, note.inharmonicity, 1.0)
    fundamental = sounds / stretch
    if note.resonances_count + note.table_count > 0 or note.stop != 0.0:
        for _ in range(8):  # fixed-point iteration; each pass gains digits, as the neck's part is small
            aside = detuning(admittance(note, lists, fundamental)[1], mass * fundamental, 1)
            aside = min(max(aside, -MOST_DETUNING), MOST_DETUNING)
            before = fundamental
            fundamental = sounds / (stretch + aside)
            if abs(fundamental / before - 1) < 1e-12:
                break
    note.fundamental = fundamental


@shared
def square(x):
    """x^2 rounded, and what rounding took away (Dekker 1971)."""
    high = SPLIT * x - (SPLIT * x - x)
    low = x - high
    p = x * x
    return p, ((high * high - p) + 2 * high * low) + low * low


@shared
def hypotenuse(a, b):
    """The square root of a^2 + b^2 for a >= b >= 0, a > 0, rounded once."""
    p, p_low = square(a)
    q, q_low = square(b)
    s = p + q
    low = (q - (s - p)) + (p_low + q_low)
    root = np.sqrt(s)
    r, r_low = square(root)
    return root + (((s - r) - r_low) + low) / (2 * root)


@shared
def set_obstacles(string, numbers, stop, note, lists, end):
    """Lists the crowns beyond a stop, on the grid, as the string at rest sees them.

    Returns MADE or CROWN_ABOVE, which crown is above the string at rest, its height (m), and the place behind.
    """
    x_stop, h_stop = crown(string, numbers, stop)
    step = note.length / note.grid_points
    note.obstacles_count = string.frets_count - stop
    for k in range(stop + 1, string.frets_count + 1):
        x, h = crown(string, numbers, k)
        height = h - h_stop * (string.length - x) / note.length
        if height > ROUNDING:
            return CROWN_ABOVE, k, height, end
        lists[end] = np.rint((x - x_stop) / step) * step
        lists[end + 1] = height if height < 0.0 else 0.0
        end += 2
    return MADE, 0, 0.0, end


@shared
def surface_beyond(numbers, first, rows, stop, height, total, lists, end):
    """Lists the part of a board beyond a stop, seen from the string that is stopped there.

    The board is `rows` of (m from the nut, height in m) from `first` on, ascending, with straight lines between; the
    stop is `stop` (m) from the nut, at `height` (m), the saddle `total` (m). Places count from the stop, heights from
    the line between stop and saddle. Returns the place behind the list.
    """
    begun = False
    for k in range(rows):
        row = first + 2 * k
        x, h = numbers[row], numbers[row + 1]
        if stop < x < total:
            if not begun and k > 0:
                before, under = numbers[row - 2], numbers[row - 1]
                at_stop = under if before == stop else (h - under) / (x - before) * (stop - before) + under
                lists[end] = 0.0
                lists[end + 1] = at_stop - height
                end += 2
            begun = True
            lists[end] = x - stop
            lists[end + 1] = h - height * (total - x) / (total - stop)
            end += 2
    return end


# A whole bass


@entry("void(int64)")
def measure_bench(address):
    """Sets the `room` for lists that the BENCH at an address needs, at most."""
    bench = bench_at(address)
    bench.room = 0
    answering = 0
    for i in range(bench.strings):
        answering += bench.string[i].answering_modes
    for i in range(bench.strings):
        string = bench.string[i]
        rows = 3 * (string.resonances_count + string.table_count) + string.frequencies_count + string.dampings_count
        rows += 2 * (string.frets_count + string.surface_count + 1 + string.taps_count + answering)
        bench.room += rows * (bench.frets + 1)
    bench.room += answering


@entry("int64(int64)")
def fill_bench(address):
    """Makes the notes of the BENCH at an address that `measure_bench` has seen; returns MADE or what stands above."""
    bench = bench_at(address)
    numbers, lists = floats_at(bench.numbers, ALL), floats_at(bench.lists, bench.room)
    modes = words_at(bench.modes, TIERS * bench.strings * (bench.frets + 1))
    answering = list_answering(bench, numbers, lists)
    end = 0
    for i in range(bench.strings):
        string = bench.string[i]
        for fret in range(bench.frets + 1):
            k = i * (bench.frets + 1) + fret
            note = note_at(bench.notes + NOTE_BYTES * k)
            stop, state, which, height, end = make_note(string, numbers, fret, note, lists, end)
            bench.fault_string, bench.fault_fret, bench.fault_height, bench.fault_place = i, stop, height, which
            if state != MADE:
                return np.int64(state)
            if not clear_of_board(bench, note, lists):
                return np.int64(BOARD_ABOVE)
            for tier in range(TIERS):
                count = modes_of(bench.tiers[tier], bench.most_modes, note, string.length)
                modes[tier * bench.strings * (bench.frets + 1) + k] = count
            note.modes = modes[k]
            end = set_answers(bench, i, stop, note, numbers, lists, answering, end)
    bench.used = end
    return np.int64(MADE)


@jit
def modes_of(wanted, most, note, open_length):
    """Modes of a note, of `wanted` on the open string (m), 0: all; at most what the grid carries, and `most`."""
    full = min(note.grid_points - 1, most)
    if wanted == 0:
        return full
    return max(1, min(full, np.int64(np.rint(wanted * note.length / open_length))))


@jit
def clear_of_board(bench, note, lists):
    """True unless the board, on the note's grid, stands above the string at rest; `bench` is told where."""
    rows, step = note.surface_count, note.length / note.grid_points
    if rows == 0:
        return True
    k: Any = max(1, np.int64(np.ceil(lists[note.surface] / step - 1e-9)))
    last = min(note.grid_points - 1, np.int64(np.floor(lists[note.surface + 2 * (rows - 1)] / step + 1e-9)))
    i, peak = 0, 0
    while k <= last:
        x = k * step
        while i < rows - 1 and lists[note.surface + 2 * (i + 1)] <= x:
            i += 1
        row = note.surface + 2 * i
        h = lists[row + 1]
        if i < rows - 1 and x > lists[row]:
            h += (lists[row + 3] - h) / (lists[row + 2] - lists[row]) * (x - lists[row])
        while peak < rows and np.rint(lists[note.surface + 2 * peak] / step) <= k:
            row = note.surface + 2 * peak
            beyond = peak + 1 < rows and lists[row + 3] > lists[row + 1]
            if np.rint(lists[row] / step) == k and peak > 0 and lists[row - 1] <= lists[row + 1] and not beyond:
                h = max(h, lists[row + 1])  # a crown within a grid step counts there
            peak += 1
        if h > BOARD_ROUGH:
            bench.fault_height, bench.fault_place = h, x
            return False
        k += 1
    return True


@jit
def list_answering(bench, numbers, lists):
    """Puts the frequencies (Hz) of all modes that may answer to the end of the lists; returns where they begin."""
    count = 0
    for t in range(bench.strings):
        count += bench.string[t].answering_modes
    first = bench.room - count
    place = first
    for t in range(bench.strings):
        if bench.string[t].answering_modes > 0:
            make_note(bench.string[t], numbers, 0, bench.note, lists, 0)
            for j in range(1, bench.string[t].answering_modes + 1):
                lists[place] = frequency(bench.note, lists, j)
                place += 1
    return first


@jit
def set_answers(bench, i, stop, note, numbers, lists, answering, end):
    """Lists how a force at a stop of string `i` moves the nut, at each mode of other strings that may answer."""
    string = bench.string[i]
    note.answers, note.answers_count = end, 0
    for t in range(bench.strings):
        for _ in range(bench.string[t].answering_modes):
            if t != i:
                lists[end], lists[end + 1] = toward_nut(string, numbers, stop, lists[answering])
                note.answers_count += 1
                end += 2
            answering += 1
    return end


@jit
def toward_nut(string, numbers, stop, nu):
    """Re and Im (m/s/N) of the velocity of the nut over a force at a stop, at `nu` (Hz).

    Eight partial sums, added in pairs, and what is left over one by one: so does numpy, which once made these numbers.
    """
    parts, felt = string.nut_parts + stop * (string.resonances_count + 1), 0
    for k in range(string.resonances_count):
        if numbers[parts + k] != 0.0:
            felt += 1
    whole = felt - felt % LANES
    real, imaginary = 0.0, 0.0
    if whole > 0:
        for lane in range(0, LANES, 4):
            a, a_imaginary = part_sum(string, numbers, parts, nu, lane, LANES, whole)
            b, b_imaginary = part_sum(string, numbers, parts, nu, lane + 1, LANES, whole)
            c, c_imaginary = part_sum(string, numbers, parts, nu, lane + 2, LANES, whole)
            d, d_imaginary = part_sum(string, numbers, parts, nu, lane + 3, LANES, whole)
            real += (a + b) + (c + d)
            imaginary += (a_imaginary + b_imaginary) + (c_imaginary + d_imaginary)
    for k in range(whole, felt):
        a, a_imaginary = part_sum(string, numbers, parts, nu, k, felt, felt)
        real += a
        imaginary += a_imaginary
    part = numbers[parts + string.resonances_count]
    a, b = tabled(numbers, string.table, string.table_count, part, nu)
    return nu * real + a, nu * imaginary + b


@jit
def part_sum(string, numbers, parts, nu, first, step, end):
    """Adds up every `step`-th resonance that is felt, from the `first` on and before `end`, over nu: Re and Im, m/N."""
    real, imaginary, place = 0.0, 0.0, 0
    for k in range(string.resonances_count):
        part, row = numbers[parts + k], string.resonances + 3 * k
        if part != 0.0:
            if place >= first and place < end and (place - first) % step == 0:
                a, b = resonance(numbers[row], numbers[row + 1], numbers[row + 2] / part, nu)
                real += a
                imaginary += b
            place += 1
    return real, imaginary
