"""Samples of a sound: rounded to float32 and summed, alike in the audio thread, in files and in Python.

Numbers below the normal ones become zero, whether or not the thread flushes them: a rendered take has the bits that
were heard. [any thread]
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.machine.native import floats_at, samples_at

NORMAL = 1.1754943508222875e-38  # the smallest normal float32
LARGEST = 1.7976931348623157e308  # the largest float64


@jit
def single(x):
    """A number as a float32 sample."""
    return np.float32(0.0 if abs(x) < NORMAL else x)


@jit
def added(x, y):
    """The sum of two float32 samples."""
    return single(x + y)


@entry("int64(int64, float64, int64, int64)")
def scale_sound(sound, gain, out, n):
    """C function: rounds n float64 at the address `sound`, times `gain`, to the samples at `out`.

    Returns how many are NaN or infinite.
    """
    given, rounded, wrong = floats_at(sound, n), samples_at(out, n), np.int64(0)
    for j in range(n):
        rounded[j] = single(given[j] * gain)
        if not abs(given[j]) <= LARGEST:
            wrong += 1
    return wrong


@entry("void(int64, int64, int64)")
def add_sound(sound, mix, n):
    """C function: adds n samples at the address `sound` to those at `mix`."""
    own, mixed = samples_at(sound, n), samples_at(mix, n)
    for j in range(n):
        mixed[j] = added(mixed[j], own[j])
