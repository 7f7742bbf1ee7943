"""An equaliser as amps have it: two shelves, and two middle bands with a centre frequency each. [audio thread]

Each band is a state-variable filter, integrated by the trapezoidal rule (Zavalishin 2018, "The art of VA filter
design", chapter 4), whose states stay valid while its knobs move. With A = 10^(dB / 40), its outputs v1 (band) and v2
(low) add up to

    bell (s^2 + A/Q s + 1) / (s^2 + s/(A Q) + 1), low shelf A (s^2 + sqrt(A)/Q s + A) / (A s^2 + sqrt(A)/Q s + 1),

and the high shelf with 1/s for s. A band at 0 dB is left out: with all four there, the sound is unchanged, bit for bit.
"""

from typing import Any

import numpy as np

from livebass.compiling import jit
from livebass.kernels.effects.compressor import FOLLOWS, follow_knob
from livebass.kernels.effects.records import BANDS, EQ_FROM, KNOBS
from livebass.kernels.machine.elementary import exp, power, sin_cos
from livebass.rows.techniques import BASS_CORNER, HIGH_MID, HIGH_MIDS, LOW_MID, LOW_MIDS, TREBLE_CORNER

BASS, LOW, HIGH, TREBLE = range(BANDS)
GAINS = (EQ_FROM, EQ_FROM + 1, EQ_FROM + 3, EQ_FROM + 5)  # the bands' knobs, by number, and their frequencies'
CENTRES = (EQ_FROM + 2, EQ_FROM + 4)
OF_SHELF, OF_BELL = 0.7071067811865476, 0.8  # Q
DB_OF_TEN = 40.0  # dB, for which A is 10
HIGHEST = 0.45  # of the audio rate: the highest corner
assert GAINS[TREBLE] < KNOBS


@jit
def centre_of(which, knob, own):
    """Centre frequency (Hz) of the low (0) or high (1) middle band, for its knob and the bass's own (0: the usual)."""
    number: Any = np.int64(knob) - 1
    if number < 0:
        return own if own > 0.0 else (LOW_MID if which == 0 else HIGH_MID)
    if which == 0:
        return LOW_MIDS[min(number, len(LOW_MIDS) - 1)]
    return HIGH_MIDS[min(number, len(HIGH_MIDS) - 1)]


@jit
def wanted_gain(e, band, j):
    """The gain (dB) that a band goes to in frame j."""
    requested = e.requested[GAINS[band], j]
    return requested if requested != 0.0 else e.own_gain[band]


@jit
def wanted_centre(e, which, j):
    """The centre (Hz) that a middle band, 0 or 1, goes to in frame j."""
    return centre_of(which, e.requested[CENTRES[which], j], e.own_centre[which])


@jit
def begin_equaliser(e):
    """Sets the knobs to the first frame's values immediately."""
    for band in range(BANDS):
        e.band_gain[band] = wanted_gain(e, band, 0)
    for which in range(2):
        e.centre[which] = wanted_centre(e, which, 0)
    for band in range(BANDS):
        set_band(e, band)


@jit
def set_band(e, band):
    """Computes a band's coefficients: a1, a2, a3 of its integrators, m0, m1, m2 of its sum."""
    a = power(10.0, e.band_gain[band] / DB_OF_TEN)
    hertz = BASS_CORNER
    if band == TREBLE:
        hertz = TREBLE_CORNER
    elif band != BASS:
        hertz = e.centre[band - LOW]
    sine, cosine = sin_cos(np.pi * min(hertz / e.rate, HIGHEST))
    g = sine / cosine
    m = e.band[band]
    if band == BASS:
        g /= np.sqrt(a)
        k = 1.0 / OF_SHELF
        m[3], m[4], m[5] = 1.0, k * (a - 1.0), a * a - 1.0
    elif band == TREBLE:
        g *= np.sqrt(a)
        k = 1.0 / OF_SHELF
        m[3], m[4], m[5] = a * a, k * (1.0 - a) * a, 1.0 - a * a
    else:
        k = 1.0 / (OF_BELL * a)
        m[3], m[4], m[5] = 1.0, k * (a * a - 1.0), 0.0
    m[0] = 1.0 / (1.0 + g * (g + k))
    m[1] = g * m[0]
    m[2] = g * m[1]


@jit
def equalise(e, n):
    """Sends n frames of an EFFECTS' sound through its bands."""
    step = 1.0 - exp(-1.0 / (FOLLOWS * e.rate))
    for band in range(BANDS):
        m, state = e.band[band], e.band_state[band]
        for j in range(n):
            gain, moved = wanted_gain(e, band, j), False
            if LOW <= band <= HIGH:
                centre = wanted_centre(e, band - LOW, j)
                if e.centre[band - LOW] != centre:
                    near = e.centre[band - LOW] if e.band_gain[band] != 0.0 else centre  # nobody hears it move
                    e.centre[band - LOW] = follow_knob(near, centre, step)
                    moved = True
            if e.band_gain[band] != gain:
                e.band_gain[band] = follow_knob(e.band_gain[band], gain, step)
                moved = True
            if e.band_gain[band] == 0.0:
                state[0] = 0.0
                state[1] = 0.0
                continue
            if moved:
                set_band(e, band)
            x = e.sound[j]
            v3 = x - state[1]
            v1 = m[0] * state[0] + m[1] * v3
            v2 = state[1] + m[1] * state[0] + m[2] * v3
            state[0] = 2.0 * v1 - state[0]
            state[1] = 2.0 * v2 - state[1]
            e.sound[j] = m[3] * x + m[4] * v1 + m[5] * v2
            e.heard[j] = 1.0
            e.amp[j] = 1.0


@jit
def equalises(e):
    """True if a band is on, or goes on."""
    on = False
    for band in range(BANDS):
        on = on or e.own_gain[band] != 0.0 or e.band_gain[band] != 0.0
    return on


@jit
def silence_equaliser(e):
    """Resets the equaliser's filters."""
    e.band_state[:] = 0.0
