"""Strings run ahead of the clock, and go back when an event comes. [audio thread]

Without events a string's motion is known in advance. In quiet blocks it plays on beyond the block's end into a ring of
sound, which spreads a burst of contacts over the blocks before it. Its state is saved every SAVE_EVERY frames. When an
event comes for a frame already played, the string returns to the last state saved before it and plays on from there.
The sound is the same bit for bit, only computed at another time.
"""

from typing import Any

import numpy as np

from livebass.compiling import apart, entry, inlined, jit
from livebass.kernels import voice
from livebass.kernels.bass.records import SAVES, SOUND_RING, VOICE_WORDS, bass_at
from livebass.kernels.machine.native import call_3, floats_at, record_address, samples_at, words_at
from livebass.kernels.string import answers, runs
from livebass.kernels.string.frame import invalidate_contact
from livebass.kernels.string.modal import clear_motion, copy_row
from livebass.kernels.string.records import DOUBLE, GROUP_ROOM, MAX_NEAR, SINGLE, SLOT_STATE, VOICE_SLOTS
from livebass.live.thread.records import (
    SAVE_EVERY,
    ahead_of,
    operators_of,
    saved_answers,
    saved_motion,
    saved_slot,
    saved_voice,
    sound_of,
    string_events_of,
    string_of,
)


@jit
def save(b, i):
    """Saves the state of string `i`, over the oldest saved state."""
    a, string = ahead_of(b, i), string_of(b, i)
    place = a.saved % SAVES
    a.saved += 1
    a.first = max(a.first, a.saved - SAVES)
    a.frame[place] = string.voice.frame
    copy_row(saved_voice(a, place), words_at(record_address(string.voice), VOICE_WORDS), VOICE_WORDS)
    for k in range(VOICE_SLOTS):
        slot = string.slots[k]
        copy_row(saved_slot(a, place, k), words_at(record_address(slot), SLOT_STATE), SLOT_STATE)
        if slot.on:
            op, begun = operator_of(b, i, slot.fret), string.voice.left > 0
            move_u(save_row, save_single, saved_motion(a, place, k, 0), slot, op, begun)
            if slot.v_active > 0:
                move_v(save_row, save_single, saved_motion(a, place, k, 1), slot, op, begun)
    n = string.voice.answering
    copy_row(saved_answers(a, place, 0), string.answers.line, n)
    copy_row(saved_answers(a, place, 1), string.answers.q, n)
    copy_row(saved_answers(a, place, 2), string.answers.y, n)


@jit
def go_back(b, i, frame):
    """Restores string `i` to its last saved state not after `frame`."""
    a, string = ahead_of(b, i), string_of(b, i)
    last = a.saved - 1
    while last > a.first and a.frame[last % SAVES] > frame:
        last -= 1
    if last < a.first:
        return
    place = last % SAVES
    a.saved = last + 1
    answers.silence_answers(string.voice, string.answers)
    copy_row(words_at(record_address(string.voice), VOICE_WORDS), saved_voice(a, place), VOICE_WORDS)
    for k in range(VOICE_SLOTS):
        slot = string.slots[k]
        copy_row(words_at(record_address(slot), SLOT_STATE), saved_slot(a, place, k), SLOT_STATE)
        if slot.on:
            op = operator_of(b, i, slot.fret)
            clear_motion(slot.u, op.padded)
            clear_motion(slot.v, op.padded)
            move_u(restore_row, restore_single, saved_motion(a, place, k, 0), slot, op, False)
            if slot.v_active > 0:
                move_v(restore_row, restore_single, saved_motion(a, place, k, 1), slot, op, False)
            else:  # it had not moved yet: nothing was saved
                invalidate_contact(slot.v, op)
    n = string.voice.answering
    string.voice.answering = 0
    lines, q, y = saved_answers(a, place, 0), saved_answers(a, place, 1), saved_answers(a, place, 2)
    answers.take_answers(string.voice, string.answers, n, lines, q, y)
    runs.resume(string, operators_of(b, (b.coarse >> i) & 1)[i])


@jit
def operator_of(b, i, fret):
    """The operator of string `i` for `fret`."""
    return operators_of(b, (b.coarse >> i) & 1)[i, fret]


# Save and restore a polarisation row by row; `at` is the next row's address.
@apart
def save_row(at, row, n):
    copy_row(floats_at(at, n), row, n)
    return at + DOUBLE * n


@apart
def save_single(at, row, n):
    copy_row(samples_at(at, n), row, n)
    return at + SINGLE * n


@apart
def restore_row(at, row, n):
    copy_row(row, floats_at(at, n), n)
    return at + DOUBLE * n


@apart
def restore_single(at, row, n):
    copy_row(row, samples_at(at, n), n)
    return at + SINGLE * n


@inlined
def move_modes(move_row, move_single, at, w, n, begun):
    """Saves or restores the state of `n` modes, float64, then float32; returns the next address.

    begun: the state before the run that has begun (runs.py).
    """
    split = min(w.split, n)
    at = move_row(at, w.low.q_before if begun else w.low.q, split)
    at = move_row(at, w.low.p_before if begun else w.low.p, split)
    at = move_single(at, w.high.q_before if begun else w.high.q, n - split)
    return move_single(at, w.high.p_before if begun else w.high.p, n - split)


@inlined
def move_u(move_row, move_single, at, slot, op, begun):
    """Saves or restores u, from the address `at` on."""
    u, points = slot.u, op.points
    at = move_modes(move_row, move_single, at, u, slot.active, begun)
    at = move_row(at, u.clearance, points)
    at = move_row(at, u.height, points)
    at = move_row(at, u.known_at, points)
    at = move_row(at, u.due, points)
    at = move_row(at, u.eta, points)
    at = move_row(at, u.eta_before, points)
    at = move_row(at, u.solved_at, points)
    if points > MAX_NEAR:
        at = move_row(at, u.group_due, GROUP_ROOM)
        at = move_row(at, u.group_known_at, GROUP_ROOM)
        at = move_row(at, u.group_clearance, GROUP_ROOM)
        move_row(at, u.group_clearance_now, GROUP_ROOM)


@inlined
def move_v(move_row, move_single, at, slot, op, begun):
    """Saves or restores v, from the address `at` on."""
    v, points = slot.v, op.points
    at = move_modes(move_row, move_single, at, v, slot.v_active, begun)
    at = move_row(at, v.moved, points)
    at = move_row(at, v.moved_before, points)
    move_row(at, v.solved_at, points)


@entry("void(int64, int64, int64)")
def play_string(bass, i, end):
    """C function: `play_to` for the bass at address `bass`."""
    b = bass_at(bass)
    a, string = ahead_of(b, i), string_of(b, i)
    v = string.voice
    count = a.count
    events = string_events_of(b)[a.events : a.events + count]
    if count > 0:
        if v.frame > events[0].frame:
            go_back(b, i, events[0].frame)
        a.first = a.saved  # states saved so far lack these events
        a.count = 0
    sound = sound_of(a)
    which = (b.coarse >> i) & 1
    used = 0
    while v.frame < end:
        place = v.frame % SOUND_RING
        n = min(end - v.frame, SOUND_RING - place)
        out = sound[place : place + n]
        used += voice.run(string, operators_of(b, which)[i], events[used:], count - used, out, out[:0])


@jit
def play_to(b, i, end):
    """Plays string `i` to its bass's frame `end` into its ring of sound, with its string_events, if any."""
    call_3(b.play_string, record_address(b), np.int64(i), end)


@jit
def step_ahead(b, i, end):
    """Plays string `i` a few frames further; `end` is the first frame for which events may still come."""
    v = string_of(b, i).voice
    if v.frame == end or v.frame % SAVE_EVERY == 0:
        save(b, i)
    play_to(b, i, v.frame + b.stride - v.frame % b.stride)


@jit
def drop_ahead(b, i, frame):
    """Takes string `i` back to `frame` if it ran ahead, and drops its saved states."""
    if string_of(b, i).voice.frame > frame:
        go_back(b, i, frame)
        play_to(b, i, frame)
    a = ahead_of(b, i)
    a.first = a.saved


@jit
def rearmost(b, horizon):
    """Returns the string least far ahead, before frame `horizon` and not being tuned; -1: none."""
    best: Any = np.int64(-1)
    minimum = horizon
    for i in range(b.strings):
        string = string_of(b, i)
        v, slots = string.voice, string.slots
        settled = v.tuned == v.bend and v.slide_to < 0
        if v.frame < minimum and settled and (slots[0].on or slots[1].on):
            best, minimum = i, v.frame
    return best
