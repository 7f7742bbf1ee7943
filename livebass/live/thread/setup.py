"""Sets up a synth in the caller's memory. [any thread but the playing one]

kernels/bass/setup.py makes its basses.
"""

from livebass.compiling import SMALL, entry, jit
from livebass.kernels.bass.instrument import clear_memory, lines
from livebass.kernels.bass.records import WORD
from livebass.live.thread.records import RINGS, SYNTH, TEAM, TEAM_PLACE, synth_at
from livebass.live.thread.ring import DATA, ENTRY

TEAM_END = TEAM_PLACE + TEAM.itemsize
AFTER_TEAM = SYNTH.itemsize - TEAM_END


@entry("int64(int64)", SMALL)
def ring_bytes(size):
    """Returns the bytes of the synth's rings, with `size` messages each."""
    return ring_bytes_of(size)


@entry("void(int64, int64, int64, float64, int64, float64, int64)", SMALL)
def fill_synth(address, rings, size, rate, channel, gain, process):
    """Makes a new synth without a bass in the SYNTH at an address, with rings of `size` messages.

    `rings` is the address of their memory, `process` the address of block.process. The synth listens on `channel`
    (0-15; -1: all), has a linear `gain` and clips at full scale. Its team stays, since threads may look at it: the team
    must be zeros the first time.
    """
    clear_memory(address, TEAM_PLACE)
    clear_memory(address + TEAM_END, AFTER_TEAM)
    clear_memory(rings, ring_bytes_of(size))
    synth = synth_at(address)
    synth.process = process
    synth.rate = rate
    synth.channel = channel
    synth.gain = synth.gain_target = gain
    synth.ceiling = 1.0
    for k in range(RINGS):
        synth.midi_ring[k] = rings + k * (ring_bytes_of(size) // RINGS)
        synth.midi_ring_size[k] = size


@jit
def ring_bytes_of(size):
    """`ring_bytes`, for kernels."""
    return RINGS * lines(WORD * (DATA + ENTRY * size))
