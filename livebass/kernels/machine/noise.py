"""Band noise from random numbers that are a function of a seed and the frame.

So it is the same for any block sizes, and again after a string has gone back. Two poles at either end: a band is 6 dB
down at its corners, and falls by 12 dB per octave beyond. [any thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp, power
from livebass.rows.units import OFF

HIGHEST = 0.45  # of the rate: the highest corner
POLES = 2  # at either end
SETTLED = 30.0  # time constants of the lower corner after which a band's response has ended
EVEN = 3.0  # a uniform random number from -1 to 1 has the power 1 / EVEN

BAND = np.dtype(
    [
        ("up", "f8"),  # part of the way per frame for the upper corner's poles ...
        ("down", "f8"),  # ... and for the lower corner's
        ("scale", "f8"),  # gives the band an rms of 1 for one random number per frame
        ("low_pass", "f8", (POLES,)),  # memory
        ("high_pass", "f8", (POLES,)),
    ],
    align=True,
)


@jit
def amplitude(level):
    """Amplitude ratio of a level (dB); 0 if the level is off."""
    return power(10.0, level / 20.0) if level > OFF else 0.0


@jit
def tune_band(band, lowest, highest, rate):
    """Sets a BAND, at rest, from `lowest` to `highest` (Hz) at `rate` (Hz)."""
    band.up = 1.0 - exp(-2 * np.pi * min(highest, HIGHEST * rate) / rate)
    band.down = 1.0 - exp(-2 * np.pi * lowest / rate)
    clear_band(band)
    band.scale = 1.0
    power = 0.0
    for k in range(np.int64(SETTLED / band.down)):
        x = next_of_band(band, 1.0 if k == 0 else 0.0)
        power += x * x
    band.scale = np.sqrt(EVEN / power)
    clear_band(band)


@jit
def next_of_band(band, x):
    """Filters the next sample `x`; returns the band's next sample."""
    for k in range(POLES):
        band.low_pass[k] += band.up * (x - band.low_pass[k])
        x = band.low_pass[k]
    for k in range(POLES):
        band.high_pass[k] += band.down * (x - band.high_pass[k])
        x -= band.high_pass[k]
    return band.scale * x


@jit
def clear_band(band):
    """Clears the memory of a BAND."""
    band.low_pass[:] = 0.0
    band.high_pass[:] = 0.0
