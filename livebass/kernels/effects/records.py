"""The record of the effects of a bass, EFFECTS, and the memory behind it. [any thread]"""

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.machine.native import floats_at, record_at
from livebass.techniques import EFFECTS as EFFECT_KNOBS

PART = 128  # frames of a partition of the response: the first one is convolved directly, without latency
TURNS = 2 * PART  # points of the Fourier transform
BINS = PART + 1  # of the spectrum of a real signal
LONGEST = 1.0  # s, of a response
LEAST_RATE, MOST_RATE = 8000, 192_000  # Hz, of a response
LATE = 24  # samples that a response comes later where it had to be resampled: half the length of the interpolation
WORD = 8  # bytes
ALLPASSES = 8  # of a half-band filter
KNOBS = len(EFFECT_KNOBS)
CURVE = 2049  # points of the valve's curve

EFFECTS = np.dtype(
    [
        ("rate", "f8"),  # Hz
        ("idle", "i8"),  # 1: all states are zero, so that silence stays silence
        ("quiet", "i8"),  # frames of silence that came in
        ("settles", "i8"),  # frames of silence after which nothing is heard any more
        # compressor
        ("own_compression", "f8"),  # of the bass, 0 to 1
        ("compression", "f8"),  # as it is now: follows what is asked for
        ("held", "f8"),  # dB of reduction that the release lets go ...
        ("reduction", "f8"),  # ... and that the attack follows
        # valve
        ("own_drive", "f8"),  # of the bass, 0 to 1
        ("drive", "f8"),  # as it is now
        ("wet", "f8"),  # part of the valve stage in what is heard, 0 to 1: it comes and goes gradually
        ("volts", "f8"),  # at the grid for a signal of full scale, for this drive ...
        ("level", "f8"),  # ... and what a volt behind the valve is worth
        ("up", "f8", (ALLPASSES, 2)),  # half-band filters: last input and output of each allpass
        ("down", "f8", (ALLPASSES, 2)),
        ("tone_b", "f8", (4,)),  # the tone stack at this rate ...
        ("tone_a", "f8", (4,)),
        ("tone", "f8", (3,)),  # ... and its state
        ("curve", "f8", (CURVE,)),  # V behind the valve over V at the grid
        # impulse response
        ("taps", "i8"),  # of the response at this rate; 0: there is none
        ("parts", "i8"),  # partitions behind the first one
        ("newest", "i8"),  # place of the newest spectrum of the input
        ("done", "i8"),  # partitions whose products for the next one are summed already
        ("response", "i8"),  # addresses: float64 (PART,), its first partition, ...
        ("line", "i8"),  # ... the input of the last partition and of this one, (TURNS,), ...
        ("tail", "i8"),  # ... what all but the first partition add to this one, (PART,), ...
        ("sums", "i8"),  # ... and to the next one, real and imaginary, (2, BINS)
        ("work", "i8"),  # of the transform, (2, TURNS)
        ("turns", "i8"),  # cosines and sines of its turns, (2, PART)
        ("spectra", "i8"),  # of the other partitions, (parts, 2, BINS)
        ("inputs", "i8"),  # of the input, likewise: a ring
        ("asked", "f8", (KNOBS, PART)),  # of the knobs, for each frame; 0: as the bass has it
        ("sound", "f8", (PART,)),  # as far as it is computed
        ("heard", "f8", (PART,)),  # 1 for a frame that any effect has changed, else 0 ...
        ("flags", "f4", (PART,)),  # ... as `add_effects` is told it
    ],
    align=True,
)

effects_at = record_at(EFFECTS)
EFFECTS_BYTES = EFFECTS.itemsize


@jit
def taps_at(count, given, rate):
    """Taps at `rate` (Hz) of a response of `count` samples at the rate `given` (Hz)."""
    if count == 0 or given == rate:
        return count
    return np.int64(np.ceil(count * rate / given + 2 * LATE * max(1.0, rate / given)))


@jit
def parts_of(taps):
    """Partitions of a response behind its first one."""
    return max(np.int64(0), (taps + PART - 1) // PART - 1)


@jit
def words_behind(taps):
    """Float64 behind an EFFECTS whose response has so many taps."""
    if taps == 0:
        return np.int64(0)
    return PART + TURNS + PART + 2 * BINS + 2 * TURNS + 2 * PART + 2 * parts_of(taps) * 2 * BINS


@inlined
def spectrum_at(address, k, which):
    """The real (0) or imaginary (1) numbers of spectrum `k` of those at an address, (BINS,)."""
    return floats_at(address + WORD * BINS * (2 * k + which), BINS)
