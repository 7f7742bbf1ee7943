"""Sets up a synth in memory that the caller gives. [any thread, not the one that plays]

kernels/bass/setup.py makes its basses.
"""

from livebass.compiling import SMALL, entry, jit
from livebass.kernels.bass.instrument import clear_memory, lines
from livebass.kernels.bass.records import WORD
from livebass.live.thread.records import RINGS, SYNTH, synth_at
from livebass.live.thread.ring import DATA, ENTRY

SYNTH_BYTES = SYNTH.itemsize


@entry("int64(int64)", SMALL)
def ring_bytes(size):
    """Returns the bytes of the synth's rings, of `size` messages each."""
    return ring_bytes_of(size)


@entry("void(int64, int64, int64, float64, int64, float64, int64)", SMALL)
def fill_synth(address, rings, size, rate, channel, gain, process):
    """Makes a synth without a bass, as new, of the SYNTH at an address, with rings of `size` messages.

    `rings` is the address of their memory; `process` that of block.process. It is heard on `channel` (0-15; -1: all),
    at a linear `gain`; beyond full scale its sound is cut.
    """
    clear_memory(address, SYNTH_BYTES)
    clear_memory(rings, ring_bytes_of(size))
    synth = synth_at(address)
    synth.process = process
    synth.rate = rate
    synth.channel = channel
    synth.gain = gain
    synth.gain_target = gain
    synth.ceiling = 1.0
    for k in range(RINGS):
        synth.midi_ring[k] = rings + k * (ring_bytes_of(size) // RINGS)
        synth.midi_ring_size[k] = size


@jit
def ring_bytes_of(size):
    """`ring_bytes`, for kernels."""
    return RINGS * lines(WORD * (DATA + ENTRY * size))
