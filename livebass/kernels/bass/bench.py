"""Makes a bass's notes from its numbers: strings, necks and pickups in, NOTEs (preparing.py) and their lists out.

A BENCH holds the maker's decisions, in SI units, with a BENCH_STRING for each string and its neck. Lists of any length
lie in one array of numbers, like a NOTE's lists. Python computes everything that needs powers or bending shapes once:
the notes' frequencies, and how much of each neck resonance is felt at each fret. kernels/string/note.py makes each
note. [any thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.bass.instrument import TIERS
from livebass.kernels.machine.native import floats_at, record_at, words_at
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.kernels.string.law import along, interpolate_rows, lines_of, resonating, stretch_ratio
from livebass.kernels.string.note import BOARD_ROUGH, MADE, bow_through, make_note
from livebass.kernels.string.preparing import ALL, NOTE, NOTE_BYTES, list_rows, note_at
from livebass.rows.parts import NeckNumbers, StringNumbers
from livebass.rows.row import rows

jit = compiled(attributes=SMALL)

PICKUPS = 8  # of a bass
MEET = 25.0  # Hz between two lines, without what the neck shifts, that may exchange energy: above NEAR of answers.py

# Lists among the numbers of a string, and the numbers per row
LISTS = {
    "pitches": 2,  # (Hz, tuning factor of the string for it) of the notes, the open first
    "frets": 2,  # (m from the nut, height of the crown in m)
    "resonances": 3,  # (Hz, Q, kg)
    "bending": 1,  # (1 if it bends the neck, 0 if the whole bass moves,) of each resonance
    # For the nut and each fret in turn: how much of each resonance, then of the table, is felt there; and, if strings
    # answer, the part by which a force there moves the nut
    "parts": 1,
    "nut_parts": 1,
    "table": 3,  # (Hz, Re Y, Im Y), ascending
    "frequencies": 1,  # (Hz,), measured
    "dampings": 1,  # (1/s,), measured
    "surface": 2,  # (m from the nut, height in m), ascending; or none
    "taps": 0,  # (m from the saddle,) of a sensor, or with the aperture (m) of a pickup: `tap_width` numbers
}

BENCH_STRING = np.dtype(
    [
        ("paper_law", "i8"),  # 1: String.stiffness_law is "paper", 0: "hinged"
        ("answering_modes", "i8"),  # of the open string: modes that may answer other strings
        ("tap_width", "i8"),  # numbers of a tap
        ("capo", "i8"),  # 1: the neck has a capo, so even the open string has a stop
        ("bowed", "i8"),  # 1: the surface is a bare board through the frets, see `bow_through`
        ("open_note", "i8"),  # MIDI
        ("shifted", "i8"),  # semitones by which the sliders have tuned it ...
        ("retuned", "f8"),  # ... and the factor of its pitch, with the A
        ("length", "f8"),  # m, nut to saddle
        # The rows of string and neck, in SI; but `contact_loss` is c of contact.py, s/m
        *((name, "f8") for part in (StringNumbers, NeckNumbers) for name in rows(part)),
        ("nut_conductance", "f8"),  # m/s/N, of the nut, as `stop_conductance`
        ("own_across", "i8"),  # 1: v has its own neck: the next two and `longer_across`; 0: u's neck
        ("stop_conductance_across", "f8"),  # m/s/N
        ("higher_across", "f8"),  # factor by which the neck's bending is higher, Hz
        *(word for name in LISTS for word in list_rows(name)),
    ],
    align=True,
)

BENCH = np.dtype(
    [
        ("strings", "i8"),
        ("frets", "i8"),  # played on every string
        ("tiers", "i8", (TIERS,)),  # modes of the open strings; 0: all the grid carries
        ("most_modes", "i8"),
        ("string", BENCH_STRING, (MAX_STRINGS,)),
        # Other values that the sliders move (change.py), as the bass has them:
        ("contact_loss", "f8", (MAX_STRINGS,)),  # N s/m, and the force ...
        ("pressing", "f8", (MAX_STRINGS,)),  # ... in N that divides it to give BENCH_STRING's contact_loss
        ("pickups", "i8"),  # of the bass, and of each:
        ("position", "f8", (PICKUPS,)),  # m from the saddle
        ("aperture", "f8", (PICKUPS,)),  # m
        ("decay_length", "f8", (PICKUPS,)),  # m
        ("pickup_level", "f8", (PICKUPS,)),
        ("tap", "i8", (PICKUPS, MAX_STRINGS)),  # the pickup's tap on a string; -1: it does not sense the string
        ("a4", "f8"),  # Hz
        ("capacitance", "f8"),  # F
        ("rounding", "f8"),  # of the player, as the next four
        ("rounding_soft", "f8"),
        ("pluck_angle", "f8"),
        ("softest", "f8"),
        ("hardest", "f8"),
        ("numbers", "i8"),  # address: float64, the lists of the strings
        ("notes", "i8"),  # address: NOTE (strings, frets + 1)
        ("modes", "i8"),  # address: int64 (TIERS, strings, frets + 1)
        ("lists", "i8"),  # address: float64 (room,) for the lists of the notes
        ("room", "i8"),  # `measure_bench` sets it
        ("used", "i8"),  # of `room`; `fill_bench` sets it, or the place of its failure:
        ("fault_string", "i8"),
        ("fault_fret", "i8"),
        ("fault_height", "f8"),  # m above the string at rest
        ("fault_place", "f8"),  # number of the crown, or m from the stop
        ("note", NOTE),  # workspace
    ],
    align=True,
)
bench_at = record_at(BENCH)

BOARD_ABOVE = 2  # `fill_bench` returns this, MADE or CROWN_ABOVE


@entry("void(int64)", SMALL)
def measure_bench(address):
    """Sets the most `room` that the BENCH at an address needs for lists."""
    measure_lists(bench_at(address))


@jit
def measure_lists(bench):
    """Sets the most `room` that a BENCH needs for lists."""
    bench.room = 0
    answering = 0
    for i in range(bench.strings):
        answering += answering_lines(bench.string[i])
    for i in range(bench.strings):
        string = bench.string[i]
        rows = 3 * (1 + string.own_across) * (string.resonances_count + string.table_count)
        rows += string.frequencies_count + string.dampings_count
        rows += 2 * (string.frets_count + string.surface_count + 1 + string.taps_count + answering)
        bench.room += rows * (bench.frets + 1)
    bench.room += 2 * answering


@entry("int64(int64)", SMALL)
def fill_bench(address):
    """Makes the notes of the BENCH at an address, after `measure_bench`; returns MADE, CROWN_ABOVE or BOARD_ABOVE."""
    return make_notes(bench_at(address))


@jit
def make_notes(bench):
    """Makes a BENCH's notes; returns as `fill_bench`."""
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
def bow_surface(numbers, frets, count, first, rows):
    """Gives a board of `rows` (place, height) from `first` on the frets' bow, straight beyond them."""
    for k in range(1, rows - 1):
        numbers[first + 2 * k + 1] = bow_through(numbers, frets, count, numbers[first + 2 * k])
    near, next_near = first + 2, first + 4
    slope = (numbers[next_near + 1] - numbers[near + 1]) / (numbers[next_near] - numbers[near])
    numbers[first + 1] = numbers[near + 1] - slope * numbers[near]
    last, before, end = first + 2 * (rows - 2), first + 2 * (rows - 3), first + 2 * (rows - 1)
    slope = (numbers[last + 1] - numbers[before + 1]) / (numbers[last] - numbers[before])
    numbers[end + 1] = numbers[last + 1] + slope * (numbers[end] - numbers[last])


@jit
def modes_of(wanted, maximum, note, open_length):
    """Modes of a note if the open string (m) has `wanted` (0: all); at most what the grid carries, and `maximum`."""
    full = min(note.grid_points - 1, maximum)
    if wanted == 0:
        return full
    return max(1, min(full, np.int64(np.rint(wanted * note.length / open_length))))


@jit
def clear_of_board(bench, note, lists):
    """True unless the board, on the note's grid, stands above the string at rest; sets the place in `bench`."""
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
def answering_lines(string):
    """Number of lines of a string that may answer others."""
    return lines_of(string, string.answering_modes)


@jit
def list_answering(bench, numbers, lists):
    """Puts all lines that may answer at the end of the lists, frequency and decay (Hz) of each; returns their start.

    Of each string those along axis a, then those along b.
    """
    count = 0
    for t in range(bench.strings):
        count += answering_lines(bench.string[t])
    first = bench.room - 2 * count
    place = first
    for t in range(bench.strings):
        modes = bench.string[t].answering_modes
        if modes > 0:
            make_note(bench.string[t], numbers, 0, bench.note, lists, 0)
        for k in range(answering_lines(bench.string[t])):
            nu, sigma = along(bench.note, lists, 1 + k % modes, k >= modes)
            lists[place], lists[place + 1] = nu, sigma / (2.0 * np.pi)
            place += 2
    return first


@jit
def set_answers(bench, i, stop, note, numbers, lists, answering, end):
    """Lists how a force at a stop of string `i` moves the nut along each line of other strings that may answer."""
    string = bench.string[i]
    note.answers, note.answers_count = end, 0
    for t in range(bench.strings):
        for k in range(answering_lines(bench.string[t])):
            if t != i:
                across = k >= bench.string[t].answering_modes
                at = between(note, lists, (lists[answering], lists[answering + 1]), across)
                higher = string.higher_across if across else 1.0
                lists[end], lists[end + 1] = toward_nut(string, numbers, stop, at, higher)
                note.answers_count += 1
                end += 2
            answering += 2
    return end


@jit
def between(note, lists, line, across):
    """Frequency and decay (Hz) midway between another string's `line` and the line of `note` that may excite it.

    Two lines that exchange energy ring at frequencies and decays about their mean: there the neck's admittance says
    what they exchange. A line that no line of the note is near enough to excite stays as it is.
    """
    j = max(1.0, np.rint(line[0] / note.fundamental))
    for _ in range(2):  # stiffness stretches the partials
        j = max(1.0, np.rint(line[0] / (note.fundamental * stretch_ratio(note.paper_law, note.inharmonicity, j))))
    if abs(j * note.fundamental * stretch_ratio(note.paper_law, note.inharmonicity, j) - line[0]) > MEET:
        return line
    nu, sigma = along(note, lists, np.int64(j), across)
    return 0.5 * (line[0] + nu), 0.5 * (line[1] + sigma / (2.0 * np.pi))


@jit
def toward_nut(string, numbers, stop, at, higher):
    """Re and Im (m/s/N) of the nut's velocity over a force at a stop along one axis, for a motion `at` (Hz, Hz).

    `at`: how it rings and decays. The neck bends `higher` times as high along this axis as along a, as in note.py's
    `felt_resonances`.
    """
    parts = string.nut_parts + stop * (string.resonances_count + 1)
    real, imaginary = 0.0, 0.0
    for k in range(string.resonances_count):
        part, row = numbers[parts + k], string.resonances + 3 * k
        if part != 0.0:
            f = numbers[row] * higher if numbers[string.bending + k] else numbers[row]
            a, b, _ = resonating(f, numbers[row + 1], numbers[row + 2] / part, at)
            real += a
            imaginary += b
    part = numbers[parts + string.resonances_count]
    a, b = interpolate_rows(numbers, string.table, string.table_count, part / higher, at[0] / higher)
    return real + a, imaginary + b
