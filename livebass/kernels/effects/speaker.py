"""Cabinets: the drivers before the microphone as taps, box and cone as filters of second order. [audio thread]

`boxes.py` has the numbers. The paths from all drivers add up: each weighs as 1 / distance, comes as late as it is
farther, and is heard through the directivity of a piston, 2 J1(x) / x with x = k a sin(angle). That is the transform of
a semicircle: a sum over NODES of equal angles, by Gauss and Chebyshev's quadrature. High passes follow by the bilinear
transform at their own frequency; the rest by matched poles and magnitudes (Vicanek 2016, "Matched second order digital
filters"), which keep the response up to half the audio rate. With no cabinet the sound is unchanged, bit for bit.
"""

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.effects.boxes import BOXES, BREAK_UP, ROLL_OFF, SOUND, high_passes, sources
from livebass.kernels.effects.compressor import FOLLOWS, follow_knob
from livebass.kernels.effects.records import CABINET, CABINETS, PART, PATHS
from livebass.kernels.machine.elementary import cos, exp, power, sin, sin_cos

NODES = 9  # of a driver's directivity
HIGHEST = 0.45  # of the audio rate: sections above it are left out
COEFFICIENTS = 5  # of a section: b0, b1, b2, a1, a2
MAX_SOURCES = max(len(sources(cabinet)) for cabinet in BOXES.values())
# Of each cabinet: sources (distance, m, and sine of the angle), high passes (Hz and Q; 0: no more), and of its driver
# the cone's radius (m), its ring's and its last frequency (Hz)
SOURCES = np.zeros((CABINETS, MAX_SOURCES, 2))
HIGH_PASSES = np.zeros((CABINETS, 2, 2))
DRIVERS = np.zeros((CABINETS, 3))
for number, cabinet in enumerate(BOXES.values()):
    SOURCES[number, : len(sources(cabinet))] = sources(cabinet)
    HIGH_PASSES[number, : len(high_passes(cabinet))] = high_passes(cabinet)
    DRIVERS[number] = cabinet.driver.radius, cabinet.driver.ring, cabinet.driver.end


@jit
def fill_speakers(e):
    """Computes the taps and sections of all cabinets at the rate of an EFFECTS. [not the playing thread]"""
    for number in range(CABINETS):
        fill_paths(e, number)
        e.sections[number] = 0
        for k in range(2):
            if HIGH_PASSES[number, k, 0] > 0.0:
                add_high_pass(e, number, HIGH_PASSES[number, k, 0], HIGH_PASSES[number, k, 1])
        for ratio, decibel, q in BREAK_UP:
            add_peak(e, number, ratio * DRIVERS[number, 1], power(10.0, decibel / 20.0), q)
        for q in ROLL_OFF:
            add_low_pass(e, number, DRIVERS[number, 2], q)


@jit
def fill_paths(e, number):
    """Computes the taps of a cabinet's paths through the air; their sum is 1."""
    radius, taps = DRIVERS[number, 0], e.paths[number]
    taps[:] = 0.0
    first, total = 1e9, 0.0
    for i in range(MAX_SOURCES):
        if SOURCES[number, i, 0] > 0.0:
            first = min(first, SOURCES[number, i, 0] - radius * SOURCES[number, i, 1] * cos(np.pi / (NODES + 1)))
            total += 1.0 / SOURCES[number, i, 0]
    e.reach[number] = 1
    for i in range(MAX_SOURCES):
        if SOURCES[number, i, 0] == 0.0:
            continue
        for k in range(1, NODES + 1):
            turn = np.pi * k / (NODES + 1)
            weight = 2.0 * sin(turn) * sin(turn) / (NODES + 1) / (SOURCES[number, i, 0] * total)
            far = SOURCES[number, i, 0] - radius * SOURCES[number, i, 1] * cos(turn) - first
            add_path(e, number, far / SOUND * e.rate, weight)


@jit
def add_path(e, number, late, weight):
    """Adds a path that is `late` samples, by Lagrange's cubic between taps; at the beginning by a line."""
    k = np.int64(late)
    t = late - k
    taps = e.paths[number]
    if k + 2 >= PATHS:
        return
    if k == 0:
        taps[0] += weight * (1.0 - t)
        taps[1] += weight * t
    else:
        taps[k - 1] -= weight * t * (t - 1.0) * (t - 2.0) / 6.0
        taps[k] += weight * (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0
        taps[k + 1] -= weight * (t + 1.0) * t * (t - 2.0) / 2.0
        taps[k + 2] += weight * (t + 1.0) * t * (t - 1.0) / 6.0
    e.reach[number] = max(e.reach[number], k + 3)


@inlined
def next_section(e, number):
    """The coefficients of a cabinet's next section."""
    m = e.section[number, e.sections[number]]
    e.sections[number] += 1
    return m


@jit
def add_high_pass(e, number, hertz, q):
    """Adds a high pass of second order."""
    sine, cosine = sin_cos(np.pi * hertz / e.rate)
    k = sine / cosine
    under = 1.0 + k / q + k * k
    m = next_section(e, number)
    m[0] = 1.0 / under
    m[1] = -2.0 / under
    m[2] = 1.0 / under
    m[3] = 2.0 * (k * k - 1.0) / under
    m[4] = (1.0 - k / q + k * k) / under


@jit
def place_poles(m, turn, q):
    """Gives a section the poles of a resonance at `turn` rad a sample, by impulse invariance."""
    damping = 0.5 / q
    fades = exp(-damping * turn)
    m[3] = -2.0 * fades * cos(np.sqrt(1.0 - damping * damping) * turn)  # q is above 0.5
    m[4] = fades * fades


@jit
def add_low_pass(e, number, hertz, q):
    """Adds a low pass of second order: Vicanek's equations 27 to 30."""
    if hertz > HIGHEST * e.rate:
        return
    m, p0, p1, a0, _, at_poles = next_poles(e, number, hertz, q)
    b1 = max(at_poles * q * q / p1 - a0 * p0 / p1, 0.0)
    m[0] = 0.5 * (np.sqrt(a0) + np.sqrt(b1))
    m[1] = np.sqrt(a0) - m[0]
    m[2] = 0.0


@jit
def add_peak(e, number, hertz, gain, q):
    """Adds a peak of `gain` on poles of this q: Vicanek's equations 37 to 42."""
    if hertz > HIGHEST * e.rate:
        return
    m, p0, p1, a0, slope, at_poles = next_poles(e, number, hertz, q)
    r1 = at_poles * gain * gain
    r2 = slope * gain * gain
    b2 = (r1 - r2 * p1 - a0) / (4.0 * p1 * p1)
    b1 = r2 + a0 + 4.0 * (p1 - p0) * b2
    w = 0.5 * (np.sqrt(a0) + np.sqrt(max(b1, 0.0)))
    m[0] = 0.5 * (w + np.sqrt(max(w * w + b2, 0.0)))
    m[1] = 0.5 * (np.sqrt(a0) - np.sqrt(max(b1, 0.0)))
    m[2] = -b2 / (4.0 * m[0])


@jit
def next_poles(e, number, hertz, q):
    """Returns the next section with its poles placed, and at `hertz` phi_0 and phi_1 as Vicanek names them.

    Then A_0, the slope of the denominator's square over phi_1 there, and that square itself.
    """
    turn = 2.0 * np.pi * hertz / e.rate
    m = next_section(e, number)
    place_poles(m, turn, q)
    half = sin(0.5 * turn)
    p1 = half * half
    p0 = 1.0 - p1
    a0 = (1.0 + m[3] + m[4]) * (1.0 + m[3] + m[4])
    a1 = (1.0 - m[3] + m[4]) * (1.0 - m[3] + m[4])
    a2 = -4.0 * m[4]
    return m, p0, p1, a0, -a0 + a1 + 4.0 * (p0 - p1) * a2, a0 * p0 + a1 * p1 + a2 * (4.0 * p0 * p1)


@jit
def wanted_cabinet(e, j):
    """The cabinet that plays in frame j: 0 none, else 1 + its number."""
    choice = np.int64(e.requested[CABINET, j]) - 1
    return choice if choice >= 0 else e.own_cabinet


@jit
def begin_speaker(e):
    """Sets the cabinet to the first frame's immediately."""
    for number in range(CABINETS):
        e.share[number] = 1.0 if wanted_cabinet(e, 0) == number + 1 else 0.0


@jit
def speaks(e):
    """True if a cabinet is on, or goes on."""
    return e.own_cabinet > 0 or e.share[0] > 0.0 or e.share[1] > 0.0 or e.share[2] > 0.0


@jit
def speak(e, place, n):
    """Sends n frames of an EFFECTS' sound through its cabinet, from frame `place` of this partition on.

    Cabinets fade into each other, and into the sound without. They know nothing of the time when none was on.
    """
    if not speaks(e) and not is_asked(e, n):
        return
    fill_shares(e, n)
    j = 0
    while j < n:
        end = j
        while end < n and e.dry[end] != 1.0:
            end += 1
        if end > j:
            speak_on(e, place, j, end)
        j = end
        while j < n and e.dry[j] == 1.0:
            j += 1
        if j > end:
            silence_speaker(e)
    if place + n == PART and e.spoke:
        for k in range(PATHS):
            e.line_of_paths[k] = e.line_of_paths[PART + k]


@jit
def is_asked(e, n):
    """True if a cabinet is asked for in these n frames."""
    asked = False
    for j in range(n):
        asked = asked or e.requested[CABINET, j] > 1.0
    return asked


@jit
def fill_shares(e, n):
    """Computes each cabinet's part of the sound in n frames, and the part without a cabinet."""
    step = 1.0 - exp(-1.0 / (FOLLOWS * e.rate))
    for j in range(n):
        chosen = wanted_cabinet(e, j) - 1
        e.dry[j] = 1.0
        for number in range(CABINETS):
            wanted = 1.0 if number == chosen else 0.0
            if e.share[number] != wanted:
                e.share[number] = follow_knob(e.share[number], wanted, step)
            e.shares[number, j] = e.share[number]
            e.dry[j] -= e.share[number]


@jit
def speak_on(e, place, begin, end):
    """Plays frames `begin` to `end`, in each of which a cabinet is on."""
    e.spoke = 1
    for j in range(begin, end):
        e.line_of_paths[PATHS + place + j] = e.sound[j]
        e.sound[j] = e.dry[j] * e.sound[j]
        e.heard[j] = 1.0
        e.amp[j] = 1.0
    for number in range(CABINETS):
        j = begin
        while j < end:
            stop = j
            while stop < end and e.shares[number, stop] > 0.0:
                stop += 1
            if stop > j:
                play_cabinet(e, number, place, j, stop)
            while stop < end and e.shares[number, stop] == 0.0:
                stop += 1
                e.section_state[number] = 0.0
            j = stop


@jit
def play_cabinet(e, number, place, begin, end):
    """Adds a cabinet's part to frames `begin` to `end`."""
    taps, spoken = e.paths[number], e.spoken
    spoken[begin:end] = 0.0
    for i in range(e.reach[number]):
        tap, first = taps[i], PATHS + place - i
        for j in range(begin, end):
            spoken[j] += tap * e.line_of_paths[first + j]
    for k in range(e.sections[number]):
        filter_section(spoken, e.section[number, k], e.section_state[number, k], begin, end)
    for j in range(begin, end):
        e.sound[j] += e.shares[number, j] * spoken[j]


@jit
def filter_section(sound, m, state, begin, end):
    """Filters frames `begin` to `end` by a section, in its transposed form."""
    b0, b1, b2, a1, a2 = m[0], m[1], m[2], m[3], m[4]
    s, t = state[0], state[1]
    for j in range(begin, end):
        x = sound[j]
        y = b0 * x + s
        s = b1 * x - a1 * y + t
        t = b2 * x - a2 * y
        sound[j] = y
    state[0] = s
    state[1] = t


@jit
def silence_speaker(e):
    """Resets the cabinets' filters."""
    if e.spoke:
        e.line_of_paths[:] = 0.0
        e.section_state[:] = 0.0
    e.spoke = 0
