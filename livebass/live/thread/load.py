"""Management of a block's time: meters, relief under overload, and strings that run ahead in spare time.

Under overload strings switch to coarse operators, and back later. [audio thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import jit
from livebass.kernels.bass.records import bass_at
from livebass.kernels.hands import fretting
from livebass.kernels.machine.elementary import log2
from livebass.kernels.machine.native import nanoseconds
from livebass.live.thread import ahead
from livebass.live.thread.mix import end_old_bass
from livebass.live.thread.records import HISTOGRAM, HORIZON, operators_of, performer_of, string_of

MAX_SHARE = 0.6  # of a block's time to run ahead, at most
FORGOTTEN = 5e-3  # decrease of the shares per second
HIGH, LOW = 0.75, 0.35  # load above which a string becomes coarse, below which the synth calms down
CALM = 0.5  # s of low load before a string gets its fine operators back


@jit
def touches(b):
    """True if a string of `b` has touched something since its last pluck."""
    for i in range(b.strings):
        slots = string_of(b, i).slots
        if (slots[0].on and slots[0].touching > 0) or (slots[1].on and slots[1].touching > 0):
            return True
    return False


@jit
def run_ahead(synth, began, n, load):
    """Lets strings play past the end of a block of n frames that began at `began` (ns) and took `load` of its time.

    They may use a share of its time: as much as two recent blocks with contacts took. No quiet block takes more. Single
    long blocks do not count: the system may have held them up. Nor do blocks with events, whose work no string can do
    ahead.
    """
    if synth.bass == 0:
        return
    b = bass_at(synth.bass)
    if b.share <= 0.0:
        return
    forgotten = FORGOTTEN * n / synth.rate
    b.share_now = max(b.share_now - forgotten, b.share)
    b.share_once = max(b.share_once - forgotten, b.share)
    if load > b.share_now and performer_of(b).out.count == 0 and touches(b):
        took = min(load, MAX_SHARE)
        b.share_now = max(b.share_now, min(took, b.share_once))
        b.share_once = max(b.share_once, took)
    until = began + np.int64(b.share_now * 1e9 * n / synth.rate)
    end = synth.frame - b.frame
    while nanoseconds(synth.clock, synth.clock_id) < until:
        i = ahead.rearmost(b, end + HORIZON)
        if i < 0:
            return
        ahead.step_ahead(b, i, end)


@jit
def update_meters(synth, load):
    """Records a block that needed `load` of its time."""
    synth.load = load
    synth.load_worst = max(synth.load_worst, load)
    place = 0 if load <= 0.0 else np.int64(32.0 + 4.0 * log2(load))
    synth.histogram[min(max(place, 0), HISTOGRAM - 1)] += 1


@jit
def adapt(synth, load, n):
    """Moves one string to the coarse operators under overload, newest contacts first; moves one back in calm times.

    Overload also fades out a bass that rings out.
    """
    if synth.bass == 0 or not synth.adaptive:
        return
    b = bass_at(synth.bass)
    hands = performer_of(b).hands
    if load > HIGH:
        synth.calm_frames = 0
        end_old_bass(synth)
        best: Any = np.int64(-1)
        rank = -np.inf
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                continue
            slots = string_of(b, i).slots
            sounding = slots[0].on or slots[1].on
            if not sounding:
                continue
            touching = slots[0].touching > 0 or slots[1].touching > 0
            # strings with contacts, the newest first; then strings without, the oldest first
            value = hands.age[i] if touching else -1e12 - hands.age[i]
            if value > rank:
                rank = value
                best = i
        if best >= 0:
            switch_operators(b, best, np.int64(1), synth.frame)
            synth.overload += 1
        return
    synth.calm_frames = 0 if load > LOW else synth.calm_frames + n
    if synth.calm_frames > CALM * synth.rate and b.coarse != 0:
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                switch_operators(b, i, np.int64(0), synth.frame)
                synth.overload -= 1
                synth.calm_frames = 0
                return


@jit
def switch_operators(b, i, which, now):
    """Gives string `i` the operators `which` (0 fine, 1 coarse) from synth frame `now` on."""
    ahead.drop_ahead(b, i, now - b.frame)
    fretting.change_operators(string_of(b, i), operators_of(b, 1 - which)[i], operators_of(b, which)[i])
    b.coarse ^= 1 << i
