"""EFFECTS, the record of a bass's effects, and the memory after it. [any thread]"""

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.machine.native import floats_at, record_at
from livebass.rows.techniques import EFFECTS as EFFECT_KNOBS

PART = 128  # frames of a partition of the response: the first is convolved directly, without latency
TURNS = 2 * PART  # points of the Fourier transform
BINS = PART + 1  # of the spectrum of a real signal
LONGEST = 1.0  # s, of a response
MIN_RATE, MAX_RATE = 8000, 192_000  # Hz, of a response
LATE = 24  # samples of delay of a resampled response: half the interpolation's length
WORD = 8  # bytes
ALLPASSES = 8  # of a half-band filter
KNOBS = len(EFFECT_KNOBS)
CURVE = 2049  # points of the valve's curve

EFFECTS = np.dtype(
    [
        ("rate", "f8"),  # Hz
        ("idle", "i8"),  # 1: all states are zero: silence stays silence
        ("quiet", "i8"),  # frames of silent input
        ("settles", "i8"),  # frames of silence after which all sound is gone
        # compressor
        ("own_compression", "f8"),  # of the bass, 0 to 1
        ("compression", "f8"),  # the present value, which follows the requested one
        ("held", "f8"),  # dB of reduction, with the release ...
        ("reduction", "f8"),  # ... and that the attack follows
        # valve
        ("own_drive", "f8"),  # of the bass, 0 to 1
        ("drive", "f8"),  # the present value
        ("wet", "f8"),  # part of the valve stage in the output, 0 to 1: it fades in and out
        ("volts", "f8"),  # at the grid for a full-scale signal, at this drive ...
        ("level", "f8"),  # ... and the level of a volt after the valve
        ("up", "f8", (ALLPASSES, 2)),  # half-band filters: each allpass's last input and output
        ("down", "f8", (ALLPASSES, 2)),
        ("tone_b", "f8", (4,)),  # the tone stack at this rate ...
        ("tone_a", "f8", (4,)),
        ("tone", "f8", (3,)),  # ... and its state
        ("curve", "f8", (CURVE,)),  # V after the valve over V at the grid
        # impulse response
        ("taps", "i8"),  # of the response at this rate; 0: none
        ("parts", "i8"),  # partitions after the first
        ("newest", "i8"),  # index of the input's newest spectrum
        ("done", "i8"),  # partitions whose products for the next one are already summed
        ("response", "i8"),  # addresses: float64 (PART,), its first partition, ...
        ("line", "i8"),  # ... the input of the last partition and this one, (TURNS,), ...
        ("tail", "i8"),  # ... the contribution of all but the first partition to this one, (PART,), ...
        ("sums", "i8"),  # ... and to the next, real and imaginary, (2, BINS)
        ("work", "i8"),  # the transform's workspace, (2, TURNS)
        ("turns", "i8"),  # cosines and sines of its turns, (2, PART)
        ("spectra", "i8"),  # of the other partitions, (parts, 2, BINS)
        ("inputs", "i8"),  # spectra of the input, the same shape: a ring
        ("requested", "f8", (KNOBS, PART)),  # requested knobs for each frame; 0: the bass's own
        ("sound", "f8", (PART,)),  # as computed so far
        ("heard", "f8", (PART,)),  # 1 for a frame that any effect has changed, else 0 ...
        ("flags", "f4", (PART,)),  # ... the same, for `add_effects`
    ],
    align=True,
)

effects_at = record_at(EFFECTS)
EFFECTS_BYTES = EFFECTS.itemsize
EFFECTS_STATE = EFFECTS.fields["curve"][1] // WORD  # type: ignore[index]


@jit
def taps_at(count, given, rate):
    """Taps at `rate` (Hz) for a response of `count` samples at the rate `given` (Hz)."""
    if count == 0 or given == rate:
        return count
    return np.int64(np.ceil(count * rate / given + 2 * LATE * max(1.0, rate / given)))


@jit
def parts_of(taps):
    """Partitions of a response after its first."""
    return max(np.int64(0), (taps + PART - 1) // PART - 1)


@jit
def words_behind(taps):
    """Float64 count after an EFFECTS whose response has `taps` taps."""
    if taps == 0:
        return np.int64(0)
    return PART + TURNS + PART + 2 * BINS + 2 * TURNS + 2 * PART + 2 * parts_of(taps) * 2 * BINS


@inlined
def spectrum_at(address, k, which):
    """The real (0) or imaginary (1) numbers of spectrum `k` at an address, (BINS,)."""
    return floats_at(address + WORD * BINS * (2 * k + which), BINS)
