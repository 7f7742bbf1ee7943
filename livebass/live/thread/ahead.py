"""Strings run ahead of the clock, and go back when an event comes. [audio thread]

Without events a string's motion is known in advance. In quiet blocks it plays on beyond the block's end into a ring of
sound, so that a burst of contacts is computed over the blocks before it. Its state is saved every SAVE_EVERY frames.
When an event comes for a frame that has already been played, the string returns to the last state saved before it and
plays on from there. The sound is the same bit for bit, only computed at another time.
"""

from typing import Any

import numpy as np

from livebass.compiling import callback, counted, jit
from livebass.kernels import modal, voice
from livebass.kernels.native import call_4, carray, pointer, record_address
from livebass.kernels.records import (
    GROUP_ROOM,
    MOST_NEAR,
    POLARISATIONS,
    ROW,
    SLOT,
    VOICE,
    VOICE_SLOTS,
)
from livebass.live.thread.records import (
    SAVE_EVERY,
    SAVES,
    SOUND_RING,
    ahead_of,
    bass_at,
    no_log,
    operators_of,
    pool_of,
    settings_of,
    sound_of,
    string_events_of,
    string_of,
)


@jit
def copy(to, o, of, p, n):
    """Copies n numbers; numba's own assignment of slices allocates in case they overlap."""
    here = to[o : o + n]
    there = of[p : p + n]
    for j in range(n):
        here[j] = there[j]


@counted
def save(b, i):
    """Saves the state of string `i`, over the oldest one saved."""
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
    """Assigns all of `kept`: numba assigns records to elements of arrays only."""
    carray(pointer(record_address(string)), 1, VOICE)[0] = kept  # it stands first in the record


@jit
def rest(op, w):
    """Resets a polarisation that had not moved yet: nothing was saved of it."""
    modal.clear(w, op.padded)
    for m in range(op.points):
        w.solved_at[m] = -1.0


@counted
def go_back(b, i, frame):
    """Restores string `i` to the last saved state that is not after `frame`."""
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
    """C function: `play_to` for the bass at address `bass`."""
    b = bass_at(bass)
    a, string = ahead_of(b, i), string_of(b, i)
    v = string.voice
    events = string_events_of(b)
    if count > 0:
        if v.frame > events[0].frame:
            go_back(b, i, events[0].frame)
        a.first = a.saved  # states saved so far know nothing of these events
    sound = sound_of(a)
    which = (b.coarse >> i) & 1
    used = 0
    while v.frame < end:
        place = v.frame % SOUND_RING
        n = min(end - v.frame, SOUND_RING - place)
        used += voice.run(
            string,
            operators_of(b, which)[i],
            pool_of(b, which),
            events[used:],
            count - used,
            settings_of(b),
            no_log(b),
            count < 0,  # never raw; a constant would be a type of its own
            sound[place : place + n],
            sound[:0],
        )


@counted
def play_to(b, i, end, count):
    """Plays string `i` to frame `end` of its bass into its ring of sound, with `count` of b.string_events."""
    call_4(b.play_string, record_address(b), i, end, count)


@counted
def step_ahead(b, i, end):
    """Plays string `i` a few frames further; `end` is the first frame for which events may still come."""
    v = string_of(b, i).voice
    if v.frame == end or v.frame % SAVE_EVERY == 0:
        save(b, i)
    play_to(b, i, v.frame + b.stride - v.frame % b.stride, 0)


@counted
def drop_ahead(b, i, frame):
    """Takes string `i` back to `frame` if it ran ahead of it, and drops its saved states."""
    if string_of(b, i).voice.frame > frame:
        go_back(b, i, frame)
        play_to(b, i, frame, 0)
    a = ahead_of(b, i)
    a.first = a.saved


@counted
def rearmost(b, horizon):
    """Returns the string that is least far ahead, short of frame `horizon` and not being tuned; -1: none."""
    best: Any = np.int64(-1)
    least = horizon
    for i in range(b.strings):
        string = string_of(b, i)
        v, slots = string.voice, string.slots
        if v.frame < least and v.tuned == v.bend and (slots[0].on or slots[1].on):
            best, least = i, v.frame
    return best
