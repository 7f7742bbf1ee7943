"""Convolves the mix with an impulse response, without latency and at the same cost in every block. [audio thread]

The response's first partition is a sum over its taps. The others are multiplied by the spectra of the input's earlier
partitions (Gardner 1995, Wefers 2015: uniform partitions, overlap-save): all these products except the newest
spectrum's are known a partition ahead, and are summed bit by bit during that partition. Partitions count from the
bass's first frame, so the host's block boundaries change nothing.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.effects.fourier import signal_of, spectrum_of
from livebass.kernels.effects.records import BINS, PART, TURNS, WORD, spectrum_at
from livebass.kernels.machine.native import floats_at


@jit
def convolve(e, place, n):
    """Convolves an EFFECTS' sound with its response: n frames from frame `place` of this partition on."""
    if e.taps == 0:
        return
    response, line, tail = floats_at(e.response, PART), floats_at(e.line, TURNS), floats_at(e.tail, PART)
    for j in range(n):
        line[PART + place + j] = e.sound[j]
        e.sound[j] = tail[place + j]
        e.heard[j] = 1.0
    add_products(e.sound, line, response, PART + place, n)
    add_ahead(e, 2 + (e.parts - 1) * (place + n) // PART)
    if place + n == PART:
        end_partition(e)


@jit
def add_products(sound, line, response, first, n):
    """Filters n frames of `line`, from `first` on, with the first partition's taps, and adds them to `sound`."""
    for i in range(PART):
        tap = response[i]
        for j in range(n):
            sound[j] += tap * line[first + j - i]


@jit
def add_ahead(e, end):
    """Sums products for the next partition, from the response's partitions 2 up to `end`."""
    real, imaginary = spectrum_at(e.sums, 0, 0), spectrum_at(e.sums, 0, 1)
    while e.done + 2 < end:
        k = e.done + 2
        at = (e.newest + e.parts - (k - 2)) % e.parts
        add_product(
            real, imaginary, spectrum_at(e.inputs, at, 0), spectrum_at(e.inputs, at, 1),
            spectrum_at(e.spectra, k - 1, 0), spectrum_at(e.spectra, k - 1, 1),
        )  # fmt: skip
        e.done += 1


@jit
def add_product(real, imaginary, x, y, u, v):
    """Adds the spectrum x + iy times u + iv, (BINS,) each."""
    for k in range(BINS):
        real[k] += x[k] * u[k] - y[k] * v[k]
    for k in range(BINS):
        imaginary[k] += x[k] * v[k] + y[k] * u[k]


@jit
def end_partition(e):
    """Transforms the finished partition, and prepares the contribution of all partitions so far to the next."""
    line, tail = floats_at(e.line, TURNS), floats_at(e.tail, PART)
    if e.parts > 0:
        cosines, sines = floats_at(e.turns, PART), floats_at(e.turns + WORD * PART, PART)
        work_real, work_imaginary = floats_at(e.work, TURNS), floats_at(e.work + WORD * TURNS, TURNS)
        real, imaginary = spectrum_at(e.sums, 0, 0), spectrum_at(e.sums, 0, 1)
        e.newest = (e.newest + 1) % e.parts
        x, y = spectrum_at(e.inputs, e.newest, 0), spectrum_at(e.inputs, e.newest, 1)
        spectrum_of(line, x, y, work_real, work_imaginary, cosines, sines)
        add_product(real, imaginary, x, y, spectrum_at(e.spectra, 0, 0), spectrum_at(e.spectra, 0, 1))
        signal_of(real, imaginary, work_real, work_imaginary, cosines, sines)
        for k in range(PART):
            tail[k] = work_real[PART + k]
        real[:] = 0.0
        imaginary[:] = 0.0
        e.done = 0
    for k in range(PART):
        line[k] = line[PART + k]


@jit
def silence_response(e):
    """Resets the convolution."""
    if e.taps == 0:
        return
    floats_at(e.line, TURNS)[:] = 0.0
    floats_at(e.tail, PART)[:] = 0.0
    floats_at(e.sums, 2 * BINS)[:] = 0.0
    floats_at(e.inputs, 2 * BINS * e.parts)[:] = 0.0
    e.newest = np.int64(0)
    e.done = 0
