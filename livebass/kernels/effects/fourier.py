"""The discrete Fourier transform of TURNS points, in place: Cooley and Tukey's radix 2. [any thread]"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.effects.records import BINS, PART, TURNS
from livebass.kernels.machine.elementary import sin_cos


@jit
def fill_turns(cosines, sines):
    """Writes the transform's turns, (PART,) each."""
    for k in range(PART):
        sines[k], cosines[k] = sin_cos(np.pi * k / PART)


@jit
def transform(real, imaginary, cosines, sines):
    """Transforms `real` + i `imaginary`, (TURNS,) each: sums over n of x_n exp(-2 pi i n k / TURNS)."""
    other = 0
    for k in range(1, TURNS):  # bit-reversed order
        bit = TURNS >> 1
        while other & bit:
            other ^= bit
            bit >>= 1
        other |= bit
        if k < other:
            real[k], real[other] = real[other], real[k]
            imaginary[k], imaginary[other] = imaginary[other], imaginary[k]
    half = 1
    while half < TURNS:
        step = PART // half
        for first in range(0, TURNS, 2 * half):
            for k in range(half):
                c, s = cosines[k * step], sines[k * step]
                i, j = first + k, first + k + half
                x = real[j] * c + imaginary[j] * s
                y = imaginary[j] * c - real[j] * s
                real[j] = real[i] - x
                imaginary[j] = imaginary[i] - y
                real[i] += x
                imaginary[i] += y
        half *= 2


@jit
def spectrum_of(sound, real, imaginary, work_real, work_imaginary, cosines, sines):
    """Writes the spectrum, (BINS,) real and imaginary, of the signal `sound` (TURNS,); workspace: `work`, (TURNS,)."""
    for k in range(TURNS):
        work_real[k] = sound[k]
        work_imaginary[k] = 0.0
    transform(work_real, work_imaginary, cosines, sines)
    for k in range(BINS):
        real[k] = work_real[k]
        imaginary[k] = work_imaginary[k]


@jit
def signal_of(real, imaginary, work_real, work_imaginary, cosines, sines):
    """Writes the signal (TURNS,) with this spectrum, (BINS,) each, to `work_real`."""
    for k in range(BINS):
        work_real[k] = real[k] / TURNS
        work_imaginary[k] = -imaginary[k] / TURNS  # conjugate: the forward transform then serves as the inverse
    for k in range(1, PART):
        work_real[TURNS - k] = work_real[k]
        work_imaginary[TURNS - k] = -work_imaginary[k]
    transform(work_real, work_imaginary, cosines, sines)
