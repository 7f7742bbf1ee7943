"""Makes the operators of a bass: numbers in, rows of the pool out, without allocation.

`measure_operators` finds each note's number of modes and the memory for all of them; `fill_operators` writes operators
and rows. Both take the address of one record, PREPARING, which holds the addresses of the notes, their numbers, and the
memory to fill. A NOTE is one string at one fret. Lists of any length (resonances, a table of admittance, measured
modes, obstacles, taps) lie in one float64 array; a note holds each list's offset and its length in rows.

law.py has the law of the modes. Mode shapes at the obstacles, which lie on a grid of N steps, come from a table of
sin(pi k / N), as sin(pi j k / N) has a period of 2 N in j k: exact to rounding for any mode, without a sine per number.
Nothing in here is reassociated: every processor makes the same rows from the same sines. Equation numbers: Issanchou et
al. (2018). [any thread]
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry, inlined
from livebass.kernels.machine.elementary import cos, exp, sin
from livebass.kernels.machine.native import floats_at, record_at, words_at
from livebass.kernels.string.law import are_turned, both_axes, exchange, turned_damping, turned_frequency
from livebass.kernels.string.operators import (
    EXCHANGE_ROWS,
    KAPPA,
    KEPT,
    LEAPS,
    MAX_LEFT,
    OMEGA,
    PACE,
    SIGMA,
    SPRING,
    coefficient,
    coefficient_at,
    coefficient_bytes,
    coupling,
    exchange_row,
    fine_coefficients,
    hand_heights,
    heights,
    leap_steps,
    left_out,
    mixed_bytes,
    mixed_coefficient,
    number_at,
    positions,
    put_number,
    shape_row,
    tap_row,
    yields,
)
from livebass.kernels.string.records import BLOCK, DOUBLE, LONGER, LOW, MAX_NEAR, OPERATOR, PART, WHOLE
from livebass.rows.parts import MAX_GRID, TURNED_MODES, NoteNumbers
from livebass.rows.row import Word, record, words

jit = compiled(attributes=SMALL)

PART_TIME = 5.2e-6  # s, length of the parts that divide a contact frame ...
MIN_PART = 16  # ... but at least this many fine steps: a check costs as much as a few steps
FADE_FROM, FADE_TO = 0.40, 0.46  # of the audio rate: modes fade from the output between these
FREE_APEX = 2e-3  # of the length: the pluck that counts as grazing if there is no obstacle
MIN_SINE = 1e-9  # of a fine step; below it a mode's motion between two fine steps is unknown
ON_GRID = 1e-9  # of a grid step: how far an obstacle may be off the grid
ALL = 1 << 40  # longer than any list of numbers

# Taps: PICKUPS, rows (m from the stop, aperture in m); or the displacement at two sensors, for u and for v, a row of
# (m from the stop,) each: SENSORS with the modes that the audio rate carries, SAMPLED with all, at each frame phase
PICKUPS, SENSORS, SAMPLED = 0, 1, 2
# Return values of `fill_operators`
DONE, OVERDAMPED, FROZEN = 0, 1, 2


def list_rows(name: str) -> list[tuple[str, str]]:
    """A list among the numbers: the index of its first row, and its number of rows."""
    return [(name, "i8"), (f"{name}_count", "i8")]


# Lists among the numbers, and the numbers per row
LISTS = {
    "resonances": 3,  # (Hz, Q, kg)
    "resonances_across": 3,  # the same for v, if `own_across`
    "table": 3,  # (Hz, Re Y, Im Y), ascending
    "table_across": 3,  # the same for v
    "frequencies": 1,  # (Hz,), measured, of the first modes
    "dampings": 1,  # (1/s,), measured
    "obstacles": 2,  # (m from the stop, height in m)
    "surface": 2,  # (m from the stop, height in m), ascending: replaces obstacles
    "taps": 2,  # or 1: see PICKUPS
    "answers": 2,  # (Re Y, Im Y), m/s/N: the nut's, from this stop, for each line that may answer
}
MAX_WORDS = 1 << 23  # of an instrument file
NOTE_WORDS = [
    Word("modes", "i8", 1, MAX_GRID),  # wanted; `measure_operators` removes those that the contact rate cannot carry
    *words(NoteNumbers),  # `measure_operators` sets the grid over a surface
    Word("stop", "f8", 0.0),  # m/s/N, Re Y at every frequency ...
    Word("stop_across", "f8", 0.0),  # ... the same for v, if `own_across`
    # of each list: the index of its first row, and its number of rows
    *(Word(f"{name}{end}", "i8", 0, MAX_WORDS) for name in LISTS for end in ("", "_count")),
]
NOTE = record(NOTE_WORDS)

PREPARING = np.dtype(
    [
        ("notes", "i8"),  # address: NOTE (count,)
        ("operators", "i8"),  # address: OPERATOR (count,)
        ("count", "i8"),
        ("numbers", "i8"),  # address: float64
        ("memory", "i8"),  # address: float64 (words,) zeros, for the rows
        ("words", "i8"),  # `measure_operators` sets them
        ("table", "i8"),  # address: float64 (table_words,), workspace
        ("table_words", "i8"),  # `measure_operators` sets them
        ("taps", "i8"),  # PICKUPS, SENSORS or SAMPLED
        ("lossless", "i8"),  # 1: all sigma_j zero
        ("exact", "i8"),  # 1: all modes are float64, 0: the first LOW
        ("rate", "f8"),  # audio, Hz
        ("contact_rate", "f8"),  # Hz
        ("apart", "i8"),  # notes of each string: one may share shapes with the string before
        ("numerator", "i8"),  # fine steps ...
        ("denominator", "i8"),  # ... in this many frames
        ("carried", "f8"),  # of the contact rate: the highest possible mode
    ],
    align=True,
)

preparing_at = record_at(PREPARING)
note_at = record_at(NOTE)
operator_at = record_at(OPERATOR)
NOTE_BYTES, OPERATOR_BYTES = NOTE.itemsize, OPERATOR.itemsize


@entry("void(int64)", SMALL)
def measure_operators(address):
    """Sets modes, grids, `words` and `table_words` of the PREPARING at an address."""
    work = preparing_at(address)
    work.words = 0
    work.table_words = 0
    for k in range(work.count):
        fit_modes(work, note_at(work.notes + NOTE_BYTES * k))
    measure_all(work)


@jit
def measure_all(work):
    """Adds the needs of all operators, whose notes have their modes, to `words` and `table_words`."""
    for k in range(work.count):
        note = note_at(work.notes + NOTE_BYTES * k)
        before = note_at(work.notes + NOTE_BYTES * (k - work.apart))
        shared = k >= work.apart and have_same_shapes(work, note, before)
        measure(work, note, operator_at(work.operators + OPERATOR_BYTES * k), shared)


@jit
def fit_modes(work, note):
    """Finds a note's modes and grid."""
    note.modes = carried_modes(work, note)
    if note.surface_count > 0:
        note.grid_points = note.modes + 1


@jit
def have_same_shapes(work, note, other):
    """True if the modes of two notes have the same shapes at the same contact points."""
    if note.modes != other.modes or note.grid_points != other.grid_points or note.length != other.length:
        return False
    if note.surface_count > 0 or other.surface_count > 0:
        return min(note.surface_count, other.surface_count) > 0 and grid_over(work, note) == grid_over(work, other)
    equal = note.obstacles_count == other.obstacles_count
    for m in range(min(note.obstacles_count, other.obstacles_count)):
        x = list_value(work, note.obstacles, 2 * m)
        equal = equal and x == list_value(work, other.obstacles, 2 * m)
    return equal


@jit
def carrying(work, note):
    """1 + the last contact point that carries the string at rest; 0: no crown is above the line from stop to saddle.

    From there to the saddle is steepest.
    """
    last, steepest = np.int64(0), 0.0
    if note.surface_count > 0:
        return last
    for m in range(note.obstacles_count):
        x, h = list_value(work, note.obstacles, 2 * m), list_value(work, note.obstacles, 2 * m + 1)
        if h > steepest * (note.length - x):
            last, steepest = np.int64(m + 1), h / (note.length - x)
    return last


@jit
def measure(work, note, op, shared):
    """Adds a note's operator's needs to `words` and `table_words`; `shared`: it shares its shapes."""
    op.modes = note.modes
    op.padded = blocks(note.modes)
    op.split = op.padded if work.exact else min(op.padded, LOW)
    op.points = points_of(work, note)
    op.turned = min(op.padded, TURNED_MODES) if are_turned(note) else 0
    op.shared = np.int64(1 if shared else 0)
    op.draped = carrying(work, note)
    set_parts(work, op)
    work.words += lay_out(work, note, op, np.int64(0)) // DOUBLE
    work.table_words = max(work.table_words, behind_table(note) + op.points)


@entry("int64(int64)", SMALL)
def fill_operators(address):
    """Writes operators and rows of the PREPARING at an address, after `measure_operators`.

    Returns DONE, OVERDAMPED or FROZEN.
    """
    return fill(preparing_at(address))


@jit
def fill(work):
    """`fill_operators` for a record."""
    place = work.memory
    for k in range(work.count):
        note = note_at(work.notes + NOTE_BYTES * k)
        op = operator_at(work.operators + OPERATOR_BYTES * k)
        place = lay_out(work, note, op, place)
        if op.shared:
            op.shapes = operator_at(work.operators + OPERATOR_BYTES * (k - work.apart)).shapes
        state = fill_operator(work, note, op)
        if state != DONE:
            return state
        measure_by_own(op)
    return np.int64(DONE)


@jit
def fill_operator(work, note, op):
    """Fills an operator and its zeroed rows, except the hand's heights; returns as `fill`."""
    set_numbers(work, note, op)
    state = set_coefficients(work, note, op)
    if state != DONE:
        return state
    set_points(work, note, op)
    set_table(work, note)
    if not op.shared:
        set_shapes(work, note, op)
    set_taps(work, note, op)
    if op.points <= MAX_NEAR:
        set_coupling(work, note, op)
        set_yields(op)
    set_answers(work, note, op)
    return np.int64(DONE)


@jit
def blocks(n):
    """`n`, rounded up to a whole BLOCK."""
    return (n + BLOCK - 1) // BLOCK * BLOCK


@jit
def list_value(work, first, k):
    """Number `k` of the list that begins at `first`."""
    return floats_at(work.numbers + DOUBLE * (first + k), 1)[0]


@jit
def tap_rows(work, note):
    """Rows of taps: one per pickup; for sensors one for q and one for P, for u and for v, at each phase."""
    if work.taps == PICKUPS:
        return note.taps_count
    return 4 if work.taps == SENSORS else 4 * work.denominator


@jit
def lay_out(work, note, op, place):
    """Sets the operator's row addresses from `place` on; returns the address after the rows."""
    square = op.points * op.points if op.points <= MAX_NEAR else 0
    op.coefficients = place
    op.coefficients_v = op.coefficients + coefficient_bytes(op) * note.own_across
    op.taps = op.coefficients_v + coefficient_bytes(op)
    op.shapes = op.taps + mixed_bytes(op) * tap_rows(work, note)
    op.heights = op.shapes + (0 if op.shared else mixed_bytes(op) * op.points)
    op.hand_heights = op.heights + DOUBLE * op.points
    op.positions = op.hand_heights + DOUBLE * op.points
    op.coupling = op.positions + DOUBLE * op.points
    op.left_out = op.coupling + DOUBLE * square
    op.answers = op.left_out + DOUBLE * square
    op.answering = note.answers_count
    op.turning = op.answers + DOUBLE * 2 * op.answering
    op.yields = op.turning + DOUBLE * EXCHANGE_ROWS * op.turned
    more = (2 + op.draped) * square + 2 * op.answering + EXCHANGE_ROWS * op.turned
    return op.heights + DOUBLE * blocks(3 * op.points + more)


@inlined
def numbers_of(work):
    """All the numbers that the notes point into."""
    return floats_at(work.numbers, ALL)


@jit
def carried_modes(work, note):
    """Number of wanted modes below `work.carried` of the contact rate, at least 1: from the highest, few are solved."""
    count = note.modes
    limit = work.carried * work.contact_rate
    while count > 1 and turned_frequency(note, both_axes(note, numbers_of(work), count), False) >= limit:
        count -= 1
    return max(count, 1)


@jit
def set_numbers(work, note, op):
    """Sets the operator's single numbers."""
    dt = 1.0 / work.contact_rate
    dx = note.length / note.grid_points
    op.diagonal = note.modes == note.grid_points - 1
    op.weight = dt * dt / note.linear_density
    op.axes[0], op.axes[1] = 1.0, 0.0
    if op.turned > 0:
        op.axes[0], op.axes[1] = cos(note.axes_turned), sin(note.axes_turned)
    op.fine = dt
    op.push = dt * dt * (dx / note.linear_density)
    op.friction = note.friction
    op.slip = 2 * dt * note.friction_speed
    op.stiffness = note.contact_stiffness
    op.exponent = note.contact_exponent
    op.loss = note.contact_loss / (2.0 * dt)
    op.length = note.length
    op.speed = 2 * note.length * note.fundamental
    op.graze = FREE_APEX * note.length
    op.held_stiffness = note.held_stiffness


@jit
def set_parts(work, op):
    """Sets the fine steps of frames and of their parts, and the number of leaps over them."""
    op.steps = work.numerator // work.denominator
    op.parts = min(np.int64(np.rint(op.steps * (1.0 / work.contact_rate) / PART_TIME)), op.steps // MIN_PART)
    if op.parts < 2:
        op.parts = 0
    op.part_steps = op.steps // max(op.parts, 1)
    op.leaps = (LONGER if work.denominator > 1 else PART if op.parts > 0 else WHOLE) + 1


@jit
def set_coefficients(work, note, op):
    """Fills the coefficients of u's modes, of v's, if `own_across`, and their exchange; returns as `fill`."""
    begin_rows(op, op.coefficients)
    if note.own_across:
        begin_rows(op, op.coefficients_v)
    for k in range(op.modes):
        axes = both_axes(note, numbers_of(work), k + 1)
        if k < op.turned:
            set_exchange(work, note, op, k, axes)
        for direction in range(1 + note.own_across):
            across = direction > 0
            nu = turned_frequency(note, axes, across)
            s = 0.0 if work.lossless else damping_of(note, op, k, axes, across)
            state = set_mode(work, op, op.coefficients_v if across else op.coefficients, k, (nu, s))
            if state != DONE:
                return state
    return np.int64(DONE)


@jit
def begin_rows(op, rows):
    """Fills coefficients at `rows` of the modes that fill up the last block: at rest, they must not divide by zero."""
    kappa, omega = coefficient_at(rows, op, KAPPA), coefficient_at(rows, op, OMEGA)
    for k in range(op.modes, op.padded):
        kappa[k] = 1.0
        omega[k] = 1.0
        put_number(mixed_coefficient(rows, op, KEPT), op, k, 1.0)


@jit
def set_mode(work, op, rows, k, of):
    """Fills the coefficients at `rows` of mode `k`, of frequency (Hz) and damping (1/s) `of`; returns as `fill`."""
    dt, s = 1.0 / work.contact_rate, of[1]
    w = 2 * np.pi * of[0]
    if s >= w:
        return np.int64(OVERDAMPED)
    w = np.sqrt(w * w - s * s)
    sine = sin(w * dt)
    if abs(sine) < MIN_SINE:
        return np.int64(FROZEN)
    kept, spring, damp = fine_coefficients(s * dt, sin(0.5 * w * dt))
    es = damp * sine
    put_number(mixed_coefficient(rows, op, KEPT), op, k, kept)
    put_number(mixed_coefficient(rows, op, SPRING), op, k, spring)
    put_number(mixed_coefficient(rows, op, PACE), op, k, w / es)
    coefficient_at(rows, op, KAPPA)[k] = es / w
    coefficient_at(rows, op, OMEGA)[k] = w
    coefficient_at(rows, op, SIGMA)[k] = s
    for which in range(op.leaps):
        steps, row = leap_steps(op, which), LEAPS + 3 * which
        damp = exp(-s * steps * dt)
        if k >= op.split:
            damp = min(damp, MAX_LEFT)
        turned = damp * sin(w * steps * dt)
        put_number(mixed_coefficient(rows, op, row), op, k, damp * cos(w * steps * dt))
        put_number(mixed_coefficient(rows, op, row + 1), op, k, turned / es)
        put_number(mixed_coefficient(rows, op, row + 2), op, k, turned * es)
    return np.int64(DONE)


@jit
def damping_of(note, op, k, axes, across):
    """sigma (1/s) of u's mode `k`, or of v's if `across`, from `both_axes`; the exchange has the rest (turning.py)."""
    if k < op.turned:
        return min(axes[2], axes[3])
    return turned_damping(note, axes, across)


# Contact points


@jit
def points_of(work, note):
    """Number of contact points: obstacles, or grid points over the surface."""
    if note.surface_count == 0:
        return note.obstacles_count
    first, last = grid_over(work, note)
    return max(last - first + 1, 0)


@jit
def grid_over(work, note):
    """The first and the last grid point over the surface."""
    step = note.length / note.grid_points
    first = np.int64(np.ceil(list_value(work, note.surface, 0) / step - 1e-9))
    last = np.int64(np.floor(list_value(work, note.surface, 2 * (note.surface_count - 1)) / step + 1e-9))
    return max(first, 1), min(last, note.grid_points - 1)


@jit
def set_points(work, note, op):
    """Fills positions and heights of the contact points; presses flat any that stand above the string at rest."""
    x = positions(op)
    if note.surface_count == 0:
        for m in range(op.points):
            x[m] = list_value(work, note.obstacles, 2 * m)
        set_heights(work, note, op, heights(op), note.obstacles + 1, 2)
        return
    step = note.length / note.grid_points
    first, _ = grid_over(work, note)
    for m in range(op.points):
        x[m] = (first + m) * step
    set_heights(work, note, op, heights(op), note.surface + 1, 2)


@jit
def set_heights(work, note, op, h, given, stride):
    """Fills the contact heights `h` from the note's list that begins at `given`, in steps of `stride`."""
    if note.surface_count == 0:
        for m in range(op.points):
            h[m] = list_value(work, given, stride * m)
        return
    x, step = positions(op), note.length / note.grid_points
    first, _ = grid_over(work, note)
    rows, table = note.surface_count, note.surface
    i = 0
    for m in range(op.points):
        while i < rows - 1 and list_value(work, table, 2 * (i + 1)) <= x[m]:
            i += 1
        h[m] = list_value(work, given, stride * i)
        if i < rows - 1 and x[m] > list_value(work, table, 2 * i):
            slope = list_value(work, given, stride * (i + 1)) - h[m]
            slope /= list_value(work, table, 2 * i + 2) - list_value(work, table, 2 * i)
            h[m] += slope * (x[m] - list_value(work, table, 2 * i))
    for i in range(1, rows):  # a crown within a grid step counts there; the first place never is a crown
        height = list_value(work, given, stride * i)
        m = np.int64(np.rint(list_value(work, table, 2 * i) / step)) - first
        beyond = i + 1 < rows and list_value(work, given, stride * (i + 1)) > height
        if 0 <= m < op.points and list_value(work, given, stride * (i - 1)) <= height and not beyond:
            h[m] = max(h[m], height)
    for m in range(op.points):
        h[m] = min(h[m], 0.0)


@jit
def measure_by_own(op):
    """Makes the present contact heights those that the hand measures its force by."""
    kept, h = hand_heights(op), heights(op)
    for m in range(op.points):
        kept[m] = h[m]


@jit
def behind_table(note):
    """Float64 count of a note's workspace, before room for one number per contact point."""
    return note.grid_points + 1 + 2 * MAX_NEAR


@jit
def set_table(work, note):
    """Fills the workspace with sin(pi k / N) for k = 0 to N; room for two rows of MAX_NEAR follows."""
    n = note.grid_points
    table = floats_at(work.table, work.table_words)
    for k in range(n // 2 + 1):
        table[k] = sin(np.pi * k / n)
        table[n - k] = table[k]


@jit
def sine(table, turn, n):
    """sin(pi turn / n) for 0 <= turn < 2 n."""
    return table[turn] if turn <= n else -table[turn - n]


@jit
def grid_point(note, x):
    """The grid point at `x` (m); -1: none."""
    step = note.length / note.grid_points
    k = np.int64(np.rint(x / step))
    return k if abs(x / step - k) <= ON_GRID else -1


@jit
def shape_at(note, x, j):
    """phi_j(x), m^-0.5: eq. 3."""
    return np.sqrt(2 / note.length) * sin(x * j * (np.pi / note.length))


@jit
def set_shapes(work, note, op):
    """Fills the mode shapes at the contact points."""
    table, n = floats_at(work.table, work.table_words), note.grid_points
    scale = np.sqrt(2 / note.length)
    for m in range(op.points):
        row, x = shape_row(op, m), positions(op)[m]
        k = grid_point(note, x)
        if k < 0:
            for j in range(op.modes):
                put_number(row, op, j, shape_at(note, x, j + 1))
            continue
        turn = 0
        for j in range(op.modes):
            turn += k
            if turn >= 2 * n:
                turn -= 2 * n
            put_number(row, op, j, scale * sine(table, turn, n))


@jit
def set_coupling(work, note, op):
    """Fills W from the present modes, and the static R from the omitted modes up to the grid's limit."""
    n, points, x = note.grid_points, op.points, positions(op)
    table = floats_at(work.table, work.table_words)
    behind = work.table + DOUBLE * (n + 1)
    phi, turn = floats_at(behind, points), words_at(behind + DOUBLE * points, points)
    for j in range(op.modes):
        for m in range(points):
            phi[m] = number_at(shape_row(op, m), op, j)
        for m in range(points):
            add_products(coupling(op, m), phi, phi[m], m + 1)
    for m in range(points):
        turn[m] = grid_point(note, x[m]) * op.modes % (2 * n)
    scale = np.sqrt(2 / note.length)
    for j in range(op.modes + 1, n):
        w = 2 * np.pi * turned_frequency(note, both_axes(note, numbers_of(work), j), False)
        part = 1 / (w * w)
        for m in range(points):
            k = grid_point(note, x[m])
            turn[m] += k
            if turn[m] >= 2 * n:
                turn[m] -= 2 * n
            phi[m] = shape_at(note, x[m], j) if k < 0 else scale * sine(table, turn[m], n)
        for m in range(points):
            add_products(left_out(op, m), phi, part * phi[m], m + 1)
    compliance = note.length / n / note.linear_density
    for m in range(points):
        for k in range(m + 1):
            coupling(op, m)[k] *= op.fine * op.fine * compliance
            coupling(op, k)[m] = coupling(op, m)[k]
            left_out(op, m)[k] *= compliance
            left_out(op, k)[m] = left_out(op, m)[k]


@jit
def set_yields(op):
    """Fills the static compliance of a draped string: a constant f adds push f phi / spring to a mode (draped.py)."""
    if not op.draped:
        return
    spring = mixed_coefficient(op.coefficients, op, SPRING)
    for m in range(op.points):
        for k in range(m + 1):
            x, one, other = 0.0, shape_row(op, m), shape_row(op, k)
            for j in range(op.modes):
                x += number_at(one, op, j) * number_at(other, op, j) / number_at(spring, op, j)
            yields(op, m)[k] = op.push * x + left_out(op, m)[k]
            yields(op, k)[m] = yields(op, m)[k]


@jit
def add_products(row, phi, f, count):
    """Adds `f` times the first `count` of `phi` to `row`."""
    for k in range(count):
        row[k] += f * phi[k]


@jit
def set_answers(work, note, op):
    """Copies the nut's motion per force at this stop."""
    row = floats_at(op.answers, 2 * op.answering)
    for k in range(2 * op.answering):
        row[k] = list_value(work, note.answers, k)


@jit
def set_exchange(work, note, op, k, axes):
    """Fills the rates at which u and v exchange the amplitudes of mode `k`, from `both_axes`."""
    found = exchange(note, axes)
    exchange_row(op, 0)[k] = found[0]
    for row in range(1, EXCHANGE_ROWS):
        exchange_row(op, row)[k] = 0.0 if work.lossless else found[row]


# Taps


@jit
def set_taps(work, note, op):
    """Fills the modes' weights in the output, and the number of modes with any weight."""
    rows = tap_rows(work, note)
    for k in range(op.modes):
        if work.taps == PICKUPS:
            set_pickups(work, note, op, k, rows)
        elif work.taps == SENSORS:
            fade = audible_weight(work.rate, coefficient(op, OMEGA)[k], coefficient(op, SIGMA)[k])
            for i in range(2):
                weight = shape_at(note, list_value(work, note.taps, i), k + 1) * fade
                put_number(tap_row(op, 2 * i), op, k, weight)
        else:
            set_sampled(work, note, op, k)
    op.tap_modes = 0
    for row in range(rows):
        weights = tap_row(op, row)
        for k in range(op.tap_modes, op.modes):
            if number_at(weights, op, k) != 0.0:
                op.tap_modes = k + 1
    op.tap_modes = blocks(op.tap_modes)


@jit
def audible_weight(rate, omega, sigma):
    """Weight of a mode in the output at `rate` (Hz): 1 well within the audio band, 0 above it."""
    nu = np.sqrt(omega * omega + sigma * sigma) / (2 * np.pi)
    low, high = FADE_FROM * rate, FADE_TO * rate
    if nu >= high:
        return 0.0
    return 0.5 + 0.5 * cos(np.pi * max((nu - low) / (high - low), 0.0))


@jit
def set_pickups(work, note, op, k, rows):
    """Fills mode `k`'s weights at each pickup: a Gaussian window as wide as a rectangle of the aperture."""
    fade = audible_weight(work.rate, coefficient(op, OMEGA)[k], coefficient(op, SIGMA)[k])
    if fade == 0.0:
        return
    for i in range(rows):
        x, aperture = list_value(work, note.taps, 2 * i), list_value(work, note.taps, 2 * i + 1)
        wide = (k + 1) * (np.pi / note.length) * aperture
        put_number(tap_row(op, i), op, k, shape_at(note, x, k + 1) * exp(-(wide * wide) / 24) * fade)


@jit
def set_sampled(work, note, op, k):
    """Fills mode `k`'s weights of q and P, for u, then v, at each phase that a frame can have between fine steps."""
    for i in range(2):
        rows = op.coefficients if i == 0 else op.coefficients_v
        w, s = coefficient_at(rows, op, OMEGA)[k], coefficient_at(rows, op, SIGMA)[k]
        es = coefficient_at(rows, op, KAPPA)[k] * w
        weight = shape_at(note, list_value(work, note.taps, i), k + 1)
        for phase in range(work.denominator):
            ahead = (-phase * work.numerator) % work.denominator / work.denominator / work.contact_rate  # s
            grown = exp(s * ahead) * weight
            row = 2 * (i * work.denominator + phase)
            put_number(tap_row(op, row), op, k, grown * cos(w * ahead))
            put_number(tap_row(op, row + 1), op, k, -grown * sin(w * ahead) / es)
