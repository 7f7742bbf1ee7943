"""The frame at which a message plays that arrives while sound is computed. [any thread]"""

import numpy as np

from livebass.compiling import SMALL, entry, jit
from livebass.kernels.machine.native import load_acquire, nanoseconds
from livebass.live.thread.records import BLOCK_FRAME, BLOCK_FRAMES, BLOCK_TIME, synth_at
from livebass.live.thread.ring import NOW


@jit
def frame_now(address, delay):
    """Returns the frame for a message that arrives now at the synth at `address`, `delay` frames late; see `Synth`."""
    synth = synth_at(address)
    began = load_acquire(address + BLOCK_TIME)
    while True:
        first, frames = load_acquire(address + BLOCK_FRAME), load_acquire(address + BLOCK_FRAMES)
        again = load_acquire(address + BLOCK_TIME)
        if again == began:
            break
        began = again
    if began == 0:
        return np.int64(NOW)
    since = np.int64(round((nanoseconds(synth.clock, synth.clock_id) - began) * 1e-9 * synth.rate))
    return first + min(since, 2 * frames) + delay


@entry("int64(int64, int64)", SMALL)
def arrival(address, delay):
    """C function: `frame_now`."""
    return frame_now(address, delay)
