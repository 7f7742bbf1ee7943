"""A limiter that ends the chain: no sound above CEILING, and no delay. [audio thread]

The gain falls at once by what the present sample needs (Giannoulis, Massberg and Reiss 2012, section 2, with a ratio of
infinity and no attack). It returns with RELEASE to what the loudest sample of this window and the last one needed; a
window lasts longer than a period of the lowest string. So the limiter flattens the first rise beyond the ceiling, and
later waves keep their shape. Below the ceiling the sound is unchanged, bit for bit.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.effects.compressor import FOLLOWS, follow_knob
from livebass.kernels.effects.records import LIMITER
from livebass.kernels.machine.elementary import exp
from livebass.rows.techniques import LIMITING

CEILING = 0.8912509381337456  # of full scale: -1 dB
WINDOW, RELEASE = 35e-3, 0.12  # s
WITH_AMP, OFF, ON = range(len(LIMITING))
DONE = 1e-4  # a smaller reduction ends


@jit
def limit(e, n):
    """Limits n frames of an EFFECTS' sound."""
    step = 1.0 - exp(-1.0 / (FOLLOWS * e.rate))
    window, release = np.int64(WINDOW * e.rate), exp(-1.0 / (RELEASE * e.rate))
    for j in range(n):
        choice = np.int64(e.requested[LIMITER, j]) - 1
        if choice < 0:
            choice = e.own_limiter
        wanted = 1.0 if choice == ON or (choice == WITH_AMP and e.amp[j] != 0.0) else 0.0
        if e.begins != 0:
            e.limiting = wanted
            e.begins = 0
        if e.limiting != wanted:
            e.limiting = follow_knob(e.limiting, wanted, step)
        if e.limiting == 0.0 and e.cut == 0.0:
            silence_limiter(e)
            continue
        loud = abs(e.sound[j]) * e.limiting  # fades in and out by a ceiling that comes down, and goes up
        needed = 1.0 - CEILING / loud if loud > CEILING else 0.0
        if e.left == 0:
            e.most_before = e.most
            e.most = 0.0
            e.left = window
        e.left -= 1
        e.most = max(e.most, needed)
        most = max(e.most, e.most_before)
        over = (e.cut - most) * release
        e.cut = most + over if over > DONE else most
        if e.cut > 0.0:
            e.sound[j] -= e.cut * e.sound[j]
            e.heard[j] = 1.0


@jit
def silence_limiter(e):
    """Resets the limiter."""
    e.cut = 0.0
    e.most = 0.0
    e.most_before = 0.0
    e.left = 0
