"""Less work under overload: strings go over to coarse operators, and come back. [audio thread]"""

import numpy as np
from numba import carray

from livebass import ahead, hands
from livebass.kernels import counted
from livebass.native import pointer
from livebass.performer import PERFORMER

HIGH, LOW = 0.75, 0.35  # of the time a block lasts: take some of the work away; give it back after CALM
CALM = 0.5  # s


@counted
def relieve(stage, load, n):
    """Under overload strings go to the coarse operators, newest contacts first; they come back in calm times."""
    if stage.bass == 0 or not stage.sheltered:
        return
    b = ahead.bass_at(stage.bass)
    if b.pool_size[1] == 0:
        return
    p = carray(pointer(b.performer), 1, PERFORMER)[0]
    if load > HIGH:
        stage.calm = 0
        best = np.int64(-1)
        rank = -np.inf
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                continue
            slots = ahead.string_of(b, i).slots
            sounding = slots[0].on or slots[1].on
            if not sounding:
                continue
            touching = slots[0].touching > 0 or slots[1].touching > 0
            # contacts, the newest first; then what only sounds, the oldest first
            value = p.age[i] if touching else -1e12 - p.age[i]
            if value > rank:
                rank = value
                best = i
        if best >= 0:
            exchange(b, best, np.int64(1), stage.frame)
            stage.overload += 1
        return
    stage.calm = 0 if load > LOW else stage.calm + n
    if stage.calm > CALM * stage.rate and b.coarse != 0:
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                exchange(b, i, np.int64(0), stage.frame)
                stage.overload -= 1
                stage.calm = 0
                return


@counted
def exchange(b, i, which, now):
    """String `i` goes on with the operators `which` from stage frame `now` on."""
    ahead.stay(b, i, now - b.frame)
    hands.exchange(
        ahead.string_of(b, i),
        ahead.operators_of(b, 1 - which)[i],
        ahead.operators_of(b, which)[i],
        ahead.pool_of(b, which),
    )
    b.coarse ^= 1 << i
