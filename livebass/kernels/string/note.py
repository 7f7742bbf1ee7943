"""Makes one note: a string with its neck, stopped at a fret, becomes a NOTE (preparing.py) and its lists.

A `string` is a BENCH_STRING (kernels/bass/bench.py), a `note` a NOTE, or objects with their fields; `numbers` are the
string's lists, `lists` the note's. The numbers contain everything that needs powers or bending shapes. This file only
adds, multiplies, divides and takes square roots, which gives the same bits everywhere. Python calls these functions
uncompiled (model/instrument.py), so a preset loads without compiled kernels. Equation numbers: Issanchou et al. (2018).
[any thread]
"""

import numpy as np

from livebass.compiling import shared
from livebass.kernels.string import law
from livebass.rows.parts import NeckLaw, StringLaw
from livebass.rows.row import copier, rows

take_law = shared(copier([*rows(StringLaw), *rows(NeckLaw)]))

BOARD_ROUGH = 20e-6  # m that a board may stand above the string at rest; it is pressed flat
ROUNDING = 1e-9  # m that a crown may stand above the string at rest and still count as level with it
MAX_DETUNING = 0.05  # relative shift of a mode by the neck, by eq. 8: beyond this its first order fails
TUNINGS = 16  # of a string by `tune_line`; most notes need 2 to 4
IN_TUNE = 1e-12  # of the pitch
FLATTEST, STEEPEST = 0.5, 2.0  # slope of a line's frequency over f0 that `tune_line` trusts
MIN_GRID = 8  # steps
SPLIT = 134217729.0  # 2^27 + 1: splits a float64 into two halves (Veltkamp)

# Return values of `make_note`
MADE, CROWN_ABOVE = 0, 1


@shared
def crown(string, numbers, k):
    """Place (m from the nut) and height (m) of fret `k`; 0 is the nut."""
    if k == 0:
        return 0.0, 0.0
    row = string.frets + 2 * (k - 1)
    return numbers[row], numbers[row + 1]


@shared
def gap_under(numbers, frets, count, k, action, relief, nut_height):
    """Gap (m) under the open string at fret `k`, from 0, of `count` frets; rows (place, height) begin at `frets`.

    Geometry, all in m: `action` is the gap at fret 12, `nut_height` the gap at fret 1, `relief` the depth of the hollow
    between the first and the last fret, at its middle.
    """
    s = along(numbers, frets, count, k)
    pivot = along(numbers, frets, count, min(12, count) - 1)
    hollow = 4 * relief * pivot * (1 - pivot)
    last = nut_height + (action - hollow - nut_height) / (pivot if pivot != 0.0 else 1.0)
    return nut_height + (last - nut_height) * s + 4 * relief * s * (1 - s)


@shared
def along(numbers, frets, count, k):
    """Place of fret `k`, from 0: 0 at the first fret, 1 at the last."""
    if count == 1:
        return 0.0
    first = numbers[frets]
    return (numbers[frets + 2 * k] - first) / (numbers[frets + 2 * (count - 1)] - first)


@shared
def bow_through(numbers, frets, count, x):
    """Height (m) at `x` (m from the nut) of the parabola through the first, middle and last fret, by Newton."""
    low, middle, high = frets, frets + 2 * (count // 2), frets + 2 * (count - 1)
    x_0, x_1, x_2 = numbers[low], numbers[middle], numbers[high]
    h_0, h_1, h_2 = numbers[low + 1], numbers[middle + 1], numbers[high + 1]
    slope, next_slope = (h_1 - h_0) / (x_1 - x_0), (h_2 - h_1) / (x_2 - x_1)
    bow = (next_slope - slope) / (x_2 - x_0)
    return h_0 + (x - x_0) * (slope + (x - x_1) * bow)


@shared
def resting_on(string, numbers, fret):
    """The last fret that the string rests on when stopped at `fret`: a later one if that is high enough to choke it."""
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
    """T and B of a string tuned `ratio` times as high: T r^2 and B / r^2, as E I stays."""
    square = ratio * ratio
    return tension * square, inharmonicity / square


@shared
def make_note(string, numbers, fret, note, lists, end):
    """Makes the note of `string` at `fret`, except for its modes and answers, with its lists from `end` on.

    A note is in tune wherever its fret is, as with a compensated saddle; a note with its own offset has another
    tension. The neck shifts each mode by a different part (law.py): the first mode is in tune.

    Over frets the string may lie on higher crowns (draped.py); over a board it ends at the last of them. Returns the
    fret it ends at, MADE or CROWN_ABOVE, the crown and its height (m) if it is above the open string at rest, and the
    end of the lists.
    """
    stop = resting_on(string, numbers, fret) if string.surface_count > 0 else fret
    note.length = string.length - crown(string, numbers, stop)[0]
    note.grid_points = max(MIN_GRID, int(np.rint(note.length / string.grid_step)))
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
    if string.surface_count > 0:  # replaces the crowns
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
    """Sets the numbers that follow from string, neck and fret."""
    ratio = numbers[string.pitches + 2 * stop + 1]
    tension, inharmonicity = under_tension(string.tension, string.inharmonicity, ratio)
    part = string.length / note.length
    note.paper_law = string.paper_law
    note.tension = tension
    note.inharmonicity = inharmonicity * (part * part)
    note.bending = law.bending_stiffness(inharmonicity, tension, string.length)
    note.held_stiffness = law.held_part(string.paper_law, note.inharmonicity, note.length)
    note.clamp = law.clamped_mode(note.length)
    note.contact_loss = string.contact_loss
    take_law(string, note)


@shared
def set_admittance(string, numbers, stop, note, lists, end):
    """Sets the neck's admittance at a stop: each resonance counts by its part there, as if its mass were greater.

    Returns the end of its lists.
    """
    stopped = stop > 0 or string.capo
    note.stop = string.stop_conductance if stopped else string.nut_conductance
    note.resonances = end
    end = felt_resonances(string, numbers, stop, 1.0, lists, end)
    note.resonances_count = (end - note.resonances) // 3
    note.table = end
    end = felt_table(string, numbers, stop, 1.0, lists, end)
    note.table_count = (end - note.table) // 3
    note.own_across = string.own_across
    note.stop_across = string.stop_conductance_across if stopped else string.nut_conductance
    note.longer_across = string.longer_across / note.length
    note.resonances_across = end
    if string.own_across:
        end = felt_resonances(string, numbers, stop, string.higher_across, lists, end)
    note.resonances_across_count = (end - note.resonances_across) // 3
    note.table_across = end
    if string.own_across:
        end = felt_table(string, numbers, stop, string.higher_across, lists, end)
    note.table_across_count = (end - note.table_across) // 3
    return end


@shared
def felt_resonances(string, numbers, stop, higher, lists, end):
    """Lists the resonances felt at a stop, those that bend the neck `higher` times as high.

    Returns the end of the list.
    """
    parts = string.parts + stop * (string.resonances_count + 1)
    for k in range(string.resonances_count):
        part, row = numbers[parts + k], string.resonances + 3 * k
        if part != 0.0:
            lists[end] = numbers[row] * higher if numbers[string.bending + k] else numbers[row]
            lists[end + 1] = numbers[row + 1]
            lists[end + 2] = numbers[row + 2] / part
            end += 3
    return end


@shared
def felt_table(string, numbers, stop, higher, lists, end):
    """Lists the measured admittance felt at a stop, for a neck that vibrates `higher` times as high.

    Returns the end of the list.
    """
    part = numbers[string.parts + stop * (string.resonances_count + 1) + string.resonances_count]
    if part != 0.0:
        for k in range(string.table_count):
            row = string.table + 3 * k
            lists[end] = numbers[row] * higher
            lists[end + 1] = part * numbers[row + 1] / higher
            lists[end + 2] = part * numbers[row + 2] / higher
            end += 3
    return end


@shared
def set_measured(string, numbers, stop, note, lists, end):
    """Copies the measured modes of the open string. Returns the end of the lists."""
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
    """Sets f0 so that the first mode sounds at the note's pitch."""
    if stop == 0 and string.law_fundamental != 0.0:
        note.fundamental = string.law_fundamental
        return
    pitch = numbers[string.pitches + 2 * stop]
    mass = 2 * string.linear_density * note.length  # kg: mu c is mass times f0
    mute = string.extra_damping / (2 * np.pi) + string.extra_damping_slope * pitch  # Hz
    if note.stop != 0.0:
        mute += law.neck_damping(law.admittance(note, lists, pitch, False)[0], mass * pitch, pitch) / (2 * np.pi)
    sounds = hypotenuse(pitch, mute)  # tuned higher, as a damped mode rings lower than its eigenfrequency
    stretch = law.stretch_ratio(note.paper_law, note.inharmonicity, 1.0)
    fundamental = sounds / stretch
    if not law.is_printed(note, 1):
        fundamental = tune_line(note, lists, pitch, fundamental)
    elif note.resonances_count + note.table_count > 0 or note.stop != 0.0:
        for _ in range(8):  # fixed-point iteration; each pass gains digits, as the neck's part is small
            aside = law.detuning(law.admittance(note, lists, fundamental, False)[1], mass * fundamental, 1)
            aside = min(max(aside, -MAX_DETUNING), MAX_DETUNING)
            before = fundamental
            fundamental = sounds / (stretch + aside)
            if abs(fundamental / before - 1) < 1e-12:
                break
    note.fundamental = fundamental


@shared
def tune_line(note, lists, pitch, first):
    """The f0 (Hz) near `first` with which the line of the first mode (`law.ringing`) lies at `pitch` (Hz): by secants.

    Where string and neck move alike, perhaps none brings the line there: then the best that was found.
    """
    lowest, highest = (1 - MAX_DETUNING) * first, (1 + MAX_DETUNING) * first
    fundamental, best, least = first, first, np.inf
    before, off_before, slope = first, 0.0, 1.0
    for k in range(TUNINGS):
        note.fundamental = note.damped_fundamental = fundamental
        off = law.ringing(note, lists, 1, False)[0] - pitch
        if abs(off) < least:
            best, least = fundamental, abs(off)
        if least < IN_TUNE * pitch:
            break
        if k > 0 and fundamental != before:
            slope = min(max((off - off_before) / (fundamental - before), FLATTEST), STEEPEST)
        before, off_before = fundamental, off
        fundamental = min(max(fundamental - off / slope, lowest), highest)
    return best


@shared
def square(x):
    """x^2 rounded, and the rounding error (Dekker 1971)."""
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
    """Lists the crowns beyond a stop, on the grid; heights count from the line from the stop to the saddle.

    Returns MADE, or CROWN_ABOVE if a crown stands above that line of an open string, the crown, its height (m), and the
    end of the list.
    """
    x_stop, h_stop = crown(string, numbers, stop)
    step = note.length / note.grid_points
    note.obstacles_count = string.frets_count - stop
    for k in range(stop + 1, string.frets_count + 1):
        x, h = crown(string, numbers, k)
        height = h - h_stop * (string.length - x) / note.length
        if height > ROUNDING and stop == 0:
            return CROWN_ABOVE, k, height, end
        lists[end] = np.rint((x - x_stop) / step) * step
        lists[end + 1] = height if height < 0.0 or height > ROUNDING else 0.0
        end += 2
    return MADE, 0, 0.0, end


@shared
def surface_beyond(numbers, first, rows, stop, height, total, lists, end):
    """Lists the part of a board beyond a stop, relative to the string stopped there.

    The board is `rows` of (m from the nut, height in m) from `first` on, ascending, with straight lines between; the
    stop is `stop` (m) from the nut, at `height` (m), the saddle `total` (m). Places count from the stop, heights from
    the line between stop and saddle. Returns the end of the list.
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
