"""EFFECTS, the record of a bass's effects, and the memory after it. [any thread]"""

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.machine.native import floats_at, record_at
from livebass.rows.techniques import CABINETS as CABINET_NAMES
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
CLEAN_BLEND, EQ_FROM, CABINET, LIMITER = (
    EFFECT_KNOBS.index(knob) for knob in ("clean_blend", "eq_bass", "cabinet", "limiter")
)
CURVE = 2049  # points of the valve's curve
DOUBLINGS, FINE = 4, 16  # of the audio rate, for the valve beside a clean sound
BANDS = 4  # of the equaliser
CABINETS = len(CABINET_NAMES) - 1  # without none
PATHS = 256  # taps of the paths from a cabinet's drivers: 1.3 ms at the highest audio rate
SECTIONS = 8  # of a cabinet

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
        # the valve beside a clean sound
        ("own_clean", "f8"),  # part of the clean sound, of the bass, 0 to 1
        ("clean", "f8"),  # the present value
        ("fine", "f8"),  # part of this stage in the valve's output, 0 to 1: it fades in and out
        ("fine_up", "f8", (DOUBLINGS, ALLPASSES, 2)),  # as `up` and `down`, for each doubling of the rate
        ("fine_down", "f8", (DOUBLINGS, ALLPASSES, 2)),
        ("clean_down", "f8", (DOUBLINGS, ALLPASSES, 2)),
        ("fine_tone", "f8", (3,)),
        # equaliser
        ("own_gain", "f8", (BANDS,)),  # dB, of the bass
        ("own_centre", "f8", (2,)),  # Hz, of the middle bands; 0: the usual
        ("band_gain", "f8", (BANDS,)),  # dB, the present values
        ("centre", "f8", (2,)),  # Hz
        ("band", "f8", (BANDS, 6)),  # coefficients of each band
        ("band_state", "f8", (BANDS, 2)),
        # cabinet
        ("own_cabinet", "i8"),  # index in CABINETS of techniques.py
        ("share", "f8", (CABINETS,)),  # part of each in the output
        ("spoke", "i8"),  # 1: their states are not all zero
        ("section_state", "f8", (CABINETS, SECTIONS, 2)),
        ("line_of_paths", "f8", (PATHS + PART,)),  # the last sound before the cabinets, and this partition's
        # limiter
        ("own_limiter", "i8"),  # index in LIMITING of techniques.py
        ("limiting", "f8"),  # 0 off to 1 on
        ("cut", "f8"),  # the present reduction: 1 - gain
        ("most", "f8"),  # the most that any sample of this window needed, ...
        ("most_before", "f8"),  # ... of the last window
        ("left", "i8"),  # frames of this window
        ("begins", "i8"),  # 1 before the first frame
        # what does not change while it plays
        ("curve", "f8", (CURVE,)),  # V after the valve over V at the grid
        ("paths", "f8", (CABINETS, PATHS)),  # taps of each cabinet's paths ...
        ("reach", "i8", (CABINETS,)),  # ... and their number
        ("section", "f8", (CABINETS, SECTIONS, 5)),  # coefficients ...
        ("sections", "i8", (CABINETS,)),  # ... and number
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
        ("amp", "f8", (PART,)),  # 1 for a frame that equaliser, clean blend or cabinet has changed, else 0
        ("dry", "f8", (PART,)),  # part of the sound that goes by the cabinets
        ("shares", "f8", (CABINETS, PART)),  # parts of the cabinets
        ("spoken", "f8", (PART,)),  # a cabinet's output
        ("points", "f8", (2, FINE)),  # a frame at the valve's rate: its input, and the clean sound
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
