"""Prepares an impulse response: cuts off silence, sets the level, resamples, and transforms the partitions.

[any thread but the playing one]
"""

import numpy as np

from livebass.compiling import SMALL, entry, jit
from livebass.kernels.effects.fourier import fill_turns, spectrum_of
from livebass.kernels.effects.records import (
    BINS,
    LATE,
    LONGEST,
    PART,
    TURNS,
    WORD,
    parts_of,
    spectrum_at,
    taps_at,
)
from livebass.kernels.machine.elementary import cos, exp, sin
from livebass.kernels.machine.native import floats_at

# The 4-term Blackman-Harris window (Harris 1978)
WINDOW0, WINDOW1, WINDOW2, WINDOW3 = 0.35875, 0.48829, 0.14128, 0.01168

SILENT = 1e-6  # of the loudest sample: quieter samples at the end are silence
LEAD = 1e-3  # of the loudest sample: quieter samples at the start are silence, if the response loses its start
FAINT = 1e-6  # of the loudest SLICE's power: fainter slices at the end are silence, if the response is too long
SLICE = 10e-3  # s
NOTHING = 1e-15  # a response with no louder sample is silent
# A bass's spectrum, for the level: equal power in each octave around MIDDLE, less below LOWEST and above HIGHEST
LOWEST, MIDDLE, HIGHEST = 40.0, 150.0, 5000.0  # Hz
MAX_GAIN = 16.0  # for a set level, on average over 24 kHz: a response of only high notes must not become a scream
BAND = 48_000.0  # Hz


@entry("int64(int64, int64, float64, int64)", SMALL)
def cut_response(address, count, rate, normalized):
    """Cuts silence off `count` float64 at an address, at `rate` Hz, in place; returns the count left, 0 for silence.

    normalized: 1 cuts the silence before the sound and sets the level to keep a bass as loud as without the response;
    0 keeps the level, and also the silence before the sound unless the response is longer than LONGEST.
    """
    samples = floats_at(address, count)
    loudest = 0.0
    for k in range(count):
        loudest = max(loudest, abs(samples[k]))
    if loudest < NOTHING:
        return np.int64(0)
    begin, end = np.int64(0), count
    while abs(samples[end - 1]) <= SILENT * loudest:
        end -= 1
    if normalized == 1 or end > LONGEST * rate:
        while abs(samples[begin]) <= LEAD * loudest:
            begin += 1
    left = end - begin
    for k in range(left):
        samples[k] = samples[begin + k]
    if left > LONGEST * rate:
        left = without_faint_end(samples, left, rate)
    if normalized == 1:
        set_level(samples, left, rate, loudest)
    return left


@jit
def without_faint_end(samples, count, rate):
    """Number of samples up to the last SLICE that is not FAINT; fades out that slice."""
    size = np.int64(np.ceil(SLICE * rate))
    slices = (count + size - 1) // size
    loudest = 0.0
    for i in range(slices):
        loudest = max(loudest, power_of(samples, i * size, min((i + 1) * size, count)))
    while power_of(samples, (slices - 1) * size, min(slices * size, count)) <= FAINT * loudest:
        slices -= 1
    left = min(slices * size, count)
    for k in range((slices - 1) * size, left):
        samples[k] *= 0.5 + 0.5 * cos(np.pi * (k + 1 - (slices - 1) * size) / size)
    return left


@jit
def power_of(samples, begin, end):
    """Sum of squares of samples[begin:end]."""
    total = 0.0
    for k in range(begin, end):
        total += samples[k] * samples[k]
    return total


@jit
def set_level(samples, count, rate, loudest):
    """Scales a response to the energy without a response, weighted by a bass's spectrum."""
    for k in range(count):
        samples[k] /= loudest
    energy = np.float64(power_of(samples, 0, count)) * max(1.0, rate / BAND)
    maximum = MAX_GAIN / np.sqrt(energy)
    gain = np.sqrt(weighted_energy(samples, 0, rate) / max(weighted_energy(samples, count, rate), 1e-30))
    gain = min(gain, maximum)
    for k in range(count):
        samples[k] *= gain


@jit
def weighted_energy(samples, count, rate):
    """Energy of `count` samples (0: a single sample of 1), weighted by a bass's spectrum."""
    low = 1.0 - exp(-2.0 * np.pi * LOWEST / rate)
    middle = 1.0 - exp(-2.0 * np.pi * MIDDLE / rate)
    high = 1.0 - exp(-2.0 * np.pi * HIGHEST / rate)
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    total = 0.0
    for k in range(count + np.int64(rate / LOWEST * 4.0)):
        x = samples[k] if k < count else 0.0
        if count == 0 and k == 0:
            x = 1.0
        a += low * (x - a)
        b += low * (x - a - b)
        c += middle * (x - a - b - c)
        d += high * (c - d)
        total += d * d
    return total


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
    """Loads a response into an EFFECTS that has its memory: `count` float64 at an address, at the rate `given` (Hz)."""
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
    line[:] = 0.0


@jit
def tap_of(samples, count, ratio, tap):
    """A tap of the response; ratio: file samples per tap. At another rate: by a sinc, LATE samples later.

    The sinc's window spans LATE samples of the slower rate to each side. Below 0.4 of that rate gains stay unchanged.
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
