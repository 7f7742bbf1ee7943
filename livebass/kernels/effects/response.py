"""Makes ready an impulse response for convolution: resamples it to the audio rate, and transforms its partitions.

[any thread, not the one that plays]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.effects.fourier import fill_turns, spectrum_of
from livebass.kernels.effects.records import (
    BINS,
    LATE,
    PART,
    TURNS,
    WORD,
    parts_of,
    spectrum_at,
    taps_at,
)
from livebass.kernels.machine.elementary import cos, sin
from livebass.kernels.machine.native import floats_at

# Blackman and Harris' window of four terms (Harris 1978)
WINDOW0, WINDOW1, WINDOW2, WINDOW3 = 0.35875, 0.48829, 0.14128, 0.01168


@jit
def place_response(e, address, count, given):
    """Gives an EFFECTS its memory at an address, and the response's taps at its rate: `count` samples at `given` Hz."""
    e.taps = taps_at(count, given, e.rate)
    e.parts = parts_of(e.taps)
    if e.taps == 0:
        return
    e.response = address
    e.line = e.response + WORD * PART
    e.tail = e.line + WORD * TURNS
    e.sums = e.tail + WORD * PART
    e.work = e.sums + WORD * 2 * BINS
    e.turns = e.work + WORD * 2 * TURNS
    e.spectra = e.turns + WORD * 2 * PART
    e.inputs = e.spectra + WORD * 2 * BINS * e.parts


@jit
def take_response(e, address, count, given):
    """Takes the response of an EFFECTS that has its memory: `count` float64 at an address, at the rate `given` (Hz)."""
    if e.taps == 0:
        return
    samples = floats_at(address, count)
    cosines, sines = floats_at(e.turns, PART), floats_at(e.turns + WORD * PART, PART)
    fill_turns(cosines, sines)
    first, line = floats_at(e.response, PART), floats_at(e.line, TURNS)
    real, imaginary = floats_at(e.work, TURNS), floats_at(e.work + WORD * TURNS, TURNS)
    for part in range(e.parts + 1):
        for k in range(PART):
            tap = part * PART + k
            line[k] = tap_of(samples, count, given / e.rate, tap) if tap < e.taps else 0.0
            line[PART + k] = 0.0
        if part == 0:
            for k in range(PART):
                first[k] = line[k]
        else:
            to_real, to_imaginary = spectrum_at(e.spectra, part - 1, 0), spectrum_at(e.spectra, part - 1, 1)
            spectrum_of(line, to_real, to_imaginary, real, imaginary, cosines, sines)
    for k in range(TURNS):
        line[k] = 0.0


@jit
def tap_of(samples, count, ratio, tap):
    """A tap of the response; ratio: samples of the file a tap. With another rate: LATE samples later, by a sinc.

    The sinc has a window, LATE samples of the slower rate to each side. Gains stay as they are below 0.4 of that rate.
    """
    if ratio == 1.0:
        return samples[tap]
    cut = min(1.0, 1.0 / ratio)  # of the file's band that fits
    reach = LATE / cut
    where = tap * ratio - reach
    total = 0.0
    for k in range(max(np.int64(0), np.int64(np.ceil(where - reach))), min(count, np.int64(where + reach) + 1)):
        away = where - k
        x = np.pi * cut * away
        c = cos(np.pi * away / reach)
        c2 = 2.0 * c * c - 1.0
        window = WINDOW0 + WINDOW1 * c + WINDOW2 * c2 + WINDOW3 * (2.0 * c2 - 1.0) * c
        total += samples[k] * window * (sin(x) / x if x != 0.0 else 1.0)
    return total * cut * ratio
