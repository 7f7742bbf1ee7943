"""Running ahead of the clock, and back.

A string nobody touches is deterministic: in quiet blocks it plays on beyond the block's end, into a ring of sound, and
the burst of work that contact is gets paid for over the blocks before it. Every SAVE_EVERY frames its state is kept.
When an event comes for a frame that has been played already, the string goes back to the state kept last before, and on
from there. The sound is the same bit for bit, only computed at another time. [audio thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import callback, counted, jit
from livebass.kernels import modal as rows
from livebass.kernels import voice
from livebass.kernels.native import call_4, carray, pointer, record_address
from livebass.kernels.records import (
    EVENT,
    GROUP_ROOM,
    MOST_NEAR,
    OPERATOR,
    POLARISATIONS,
    ROW,
    SLOT,
    STRING,
    VOICE,
    VOICE_SLOTS,
)
from livebass.live.thread.records import AHEAD, BASS, EVENT_ROOM, SAVE_EVERY, SAVES, SOUND_RING


@counted
def bass_at(address):
    return carray(pointer(address), 1, BASS)[0]


@counted
def ahead_of(b, i):
    return carray(pointer(b.ahead[i]), 1, AHEAD)[0]


@counted
def string_of(b, i):
    return carray(pointer(b.string[i]), 1, STRING)[0]


@counted
def operators_of(b, which):
    return carray(pointer(b.operators[which]), (b.strings, b.frets + 1), OPERATOR)


@counted
def pool_of(b, which):
    return carray(pointer(b.pool[which]), b.pool_size[which], np.float64)


@jit
def copy(to, o, of, p, n):
    """n numbers; numba's own assignment of slices allocates where they might overlap."""
    here = to[o : o + n]
    there = of[p : p + n]
    for j in range(n):
        here[j] = there[j]


@counted
def save(b, i):
    """Keeps the state of string `i` as it is now; the oldest one kept goes."""
    a, string = ahead_of(b, i), string_of(b, i)
    v, slots, w2 = string.voice, string.slots, string.work
    place = a.saved % SAVES
    a.saved += 1
    a.first = max(a.first, a.saved - SAVES)
    a.frame[place] = v.frame
    carray(pointer(a.voice), SAVES, VOICE)[place] = v
    kept_slots = carray(pointer(a.slots), (SAVES, VOICE_SLOTS), SLOT)
    memory = carray(pointer(a.memory), (SAVES, POLARISATIONS * VOICE_SLOTS, a.kept), np.float64)
    ops = operators_of(b, (b.coarse >> i) & 1)[i]
    for k in range(VOICE_SLOTS):
        kept_slots[place, k] = slots[k]
    for k in range(POLARISATIONS * VOICE_SLOTS):
        s = slots[k % VOICE_SLOTS]
        n = s.active if k < VOICE_SLOTS else s.swaying
        if not s.on or (k >= VOICE_SLOTS and n == 0):
            continue
        to, w = memory[place, k], w2[k]
        copy(to, 0, w.q, 0, n)
        copy(to, ROW, w.p, 0, n)
        points = ops[s.fret].points
        at = 2 * ROW
        for row in (w.clearance, w.known_at, w.due, w.eta, w.eta_before, w.solved_at):
            copy(to, at, row, 0, points)
            at += points
        if points > MOST_NEAR:
            for groups in (w.group_due, w.group_known_at, w.group_clear, w.group_clear_now):
                copy(to, at, groups, 0, GROUP_ROOM)
                at += GROUP_ROOM


@counted
def set_voice(string, kept):
    """All of `kept`: numba assigns records to places of arrays only."""
    carray(pointer(record_address(string)), 1, VOICE)[0] = kept  # it stands first in the record


@jit
def rest(op, w):
    """A polarisation that had not moved yet: nothing is kept of it."""
    rows.clear(w, op.padded)
    for m in range(op.points):
        w.solved_at[m] = -1.0


@counted
def go_back(b, i, frame):
    """String `i` is again as it was at the frame kept last that is not after `frame`."""
    a, string = ahead_of(b, i), string_of(b, i)
    slots, w2 = string.slots, string.work
    last = a.saved - 1
    while last > a.first and a.frame[last % SAVES] > frame:
        last -= 1
    if last < a.first:
        return
    place = last % SAVES
    a.saved = last + 1
    set_voice(string, carray(pointer(a.voice), SAVES, VOICE)[place])
    kept_slots = carray(pointer(a.slots), (SAVES, VOICE_SLOTS), SLOT)
    memory = carray(pointer(a.memory), (SAVES, POLARISATIONS * VOICE_SLOTS, a.kept), np.float64)
    ops = operators_of(b, (b.coarse >> i) & 1)[i]
    for k in range(VOICE_SLOTS):
        slots[k] = kept_slots[place, k]
    for k in range(POLARISATIONS * VOICE_SLOTS):
        s = slots[k % VOICE_SLOTS]
        if not s.on:
            continue
        n = s.active if k < VOICE_SLOTS else s.swaying
        kept, w = memory[place, k], w2[k]
        op = ops[s.fret]
        if k >= VOICE_SLOTS and n == 0:
            rest(op, w)
            continue
        copy(w.q, 0, kept, 0, n)
        copy(w.p, 0, kept, ROW, n)
        for j in range(n, op.padded):
            w.q[j] = 0.0
            w.p[j] = 0.0
        at = 2 * ROW
        for row in (w.clearance, w.known_at, w.due, w.eta, w.eta_before, w.solved_at):
            copy(row, 0, kept, at, op.points)
            at += op.points
        if op.points > MOST_NEAR:
            for groups in (w.group_due, w.group_known_at, w.group_clear, w.group_clear_now):
                copy(groups, 0, kept, at, GROUP_ROOM)
                at += GROUP_ROOM


@callback("void(int64, int64, int64, int64)")
def play_string(bass, i, end, count):
    """`play_to`, a C function for the bass at address `bass`."""
    b = bass_at(bass)
    a, string = ahead_of(b, i), string_of(b, i)
    v = string.voice
    mine = carray(pointer(b.mine), EVENT_ROOM, EVENT)
    if count > 0:
        if v.frame > mine[0].frame:
            go_back(b, i, mine[0].frame)
        a.first = a.saved  # what was kept knows nothing of these events
    ring = carray(pointer(a.sound), SOUND_RING, np.float64)
    which = (b.coarse >> i) & 1
    used = 0
    while v.frame < end:
        place = v.frame % SOUND_RING
        n = min(end - v.frame, SOUND_RING - place)
        used += voice.run(
            string,
            operators_of(b, which)[i],
            pool_of(b, which),
            mine[used:],
            count - used,
            carray(pointer(b.settings), 3, np.float64),
            carray(pointer(b.settings), (0, 2), np.int64),
            count < 0,  # not raw, and no constant, which would be a type of its own
            ring[place : place + n],
            ring[:0],
        )


@counted
def play_to(b, i, end, count):
    """String `i` plays on to frame `end` of its bass, with the first `count` events of b.mine, into its ring."""
    call_4(b.play_string, b.address, i, end, count)


@counted
def step_ahead(b, i, end):
    """String `i` plays a few frames on, past `end`, the first frame that may still hear of events."""
    v = string_of(b, i).voice
    if v.frame == end or v.frame % SAVE_EVERY == 0:
        save(b, i)
    play_to(b, i, v.frame + b.stride - v.frame % b.stride, 0)


@counted
def drop_ahead(b, i, frame):
    """String `i` forgets what it played beyond `frame`."""
    if string_of(b, i).voice.frame > frame:
        go_back(b, i, frame)
        play_to(b, i, frame, 0)
    a = ahead_of(b, i)
    a.first = a.saved


@counted
def rearmost(b, horizon):
    """The string that is the least ahead, short of frame `horizon` and not being tuned; -1: none."""
    best: Any = np.int64(-1)
    least = horizon
    for i in range(b.strings):
        string = string_of(b, i)
        v, slots = string.voice, string.slots
        if v.frame < least and v.tuned == v.bend and (slots[0].on or slots[1].on):
            best, least = i, v.frame
    return best
