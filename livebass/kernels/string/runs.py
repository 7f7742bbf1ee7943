"""Runs: a string that nothing touches moves many frames at once: four, a quartet, or LONG_RUN if it is held.

A run begins only where all its frames are known to be free: no hand, no contact, no bend, no exchange owed. Whether it
begins, and how long it is, depends on the string alone, never on blocks or on events to come. Its sound is computed
when it begins, and its motion too; then its frames are played one by one, in as many blocks as it takes. If an event
comes before its end, the string goes back to the run's begin, and by quartets and single frames to the event: what has
sounded stays as it was.

After a run u and v exchange energy (turning.py), and other strings with both (answers.py), and fingers on an ended note
act (touch.py), in quartets. Qualities with float64 modes alone have no runs, but the same exchanges. `string` is a
STRING, `ops` the operators of its frets. [audio thread]
"""

import numpy as np

from livebass.compiling import apart, jit
from livebass.kernels.string import answers, long_run, modal, quartet, tension, touch, turning
from livebass.kernels.string.looks import look_far, look_near
from livebass.kernels.string.operators import is_exact, low_part, tap_row
from livebass.kernels.string.records import FOUR, LONG_RUN, MANY, MAX_NEAR, NONE, QUARTET, WHOLE
from livebass.kernels.string.slot import is_touched, until_rest

LOWEST, HIGHEST = 0.5, 2.0  # tuning of a string: bent farther, the shears of tension (quartet.py) may be unstable


@jit
def frames_ahead(string, ops):
    """Frames of the run that can begin with this one: 0, QUARTET or LONG_RUN."""
    voice = string.voice
    slot, none = string.slots[voice.slot], np.int64(0)
    if slot.fourth != 0 or not slot.on or slot.active == 0 or not slot.v_ready or slot.owed != 0:
        return none
    if voice.raw or voice.pickups == 0 or voice.denominator > 1 or string.slots[1 - voice.slot].on:
        return none
    longest = until_rest(voice)
    if is_handled(voice, slot) or longest < QUARTET:
        return none
    op = ops[slot.fret]
    if op.draped and slot.hand < 1.0:  # hands take from its distance to rest
        return none
    if is_exact(op) or not LOWEST <= slot.ratio <= HIGHEST:
        return none
    longest = LONG_RUN if slot.hand == 1.0 and slot.gentle and longest >= LONG_RUN else QUARTET
    if op.points == 0:
        return longest
    known = max(slot.quiet, slot.due) - voice.step
    if known >= longest * op.steps:
        return longest
    near = known >= QUARTET * op.steps
    if op.points <= MAX_NEAR:
        quartet.prepare(slot.u, op)
        if look_far(voice, slot, op):
            return longest
        near = near or look_near(voice, slot, op)
    return QUARTET if near else none


@jit
def is_handled(voice, slot):
    """True if a hand, or a string's end, moves the string otherwise than by its own motion."""
    if slot.moving or slot.between or slot.offset != 0.0 or slot.sunk > 0 or slot.thumb.on != NONE:
        return True
    if voice.pulling + voice.waiting + voice.striking + voice.fingering + voice.landing + voice.ends_in > 0:
        return True
    if voice.slide_to >= 0 or voice.tuned != voice.bend or voice.depth != 0.0 or voice.depth_wanted != 0.0:
        return True
    if slot.hand < 1.0:
        return not touch.are_settled(voice)
    return is_touched(voice)


@apart
def begin(string, ops, frames):
    """Moves the string by a run of `frames`, and keeps what its pickups sense in them."""
    voice = string.voice
    slot = string.slots[voice.slot]
    op = ops[slot.fret]
    quartet.prepare(slot.u, op)
    quartet.prepare(slot.v, op)
    if frames == QUARTET:
        begin_quartet(voice, slot, op)
    else:
        begin_long(voice, slot, op)
    voice.length = frames
    voice.left = frames


@jit
def push_of(voice, slot, op, which):
    """A frame's kick by the tension that the motion adds, in the span `which` (quartet.py)."""
    return tension.push_ahead(voice, slot, op, which) if voice.stretch > 0.0 and not slot.steady else 0.0


@jit
def begin_long(voice, slot, op):
    """`begin` for a long run."""
    u, v = slot.u, slot.v
    push = push_of(voice, slot, op, MANY)
    n, n_v = min(slot.active, slot.heard), min(slot.v_active, slot.heard)
    long_run.prepare(u, op, voice.pickups)
    long_run.prepare(v, op, voice.pickups)
    for k in range(0, voice.pickups, 2):
        other = min(k + 1, voice.pickups - 1)
        long_run.begin(u, n, push)
        long_run.begin(v, n_v, push)
        for at in range(0, LONG_RUN, QUARTET):
            here, there = long_run.next_four(u, n, k, other)
            across_here, across_there = long_run.next_four(v, n_v, k, other)
            keep_velocities(voice, k, at, 1.0, here, across_here)
            keep_velocities(voice, other, at, 1.0, there, across_there)
    for k in range(voice.pickups):
        row, x = voice.run[2 * k], long_run.displacements(u, min(n, u.split), op, k, push)
        keep_displacements(row, 0, x[0], x[1], x[2])
        keep_displacements(row, 4, x[2], x[3], x[4])
        keep_displacements(row, 8, x[4], x[5], x[6])
        keep_displacements(row, 12, x[6], x[7], x[8])
    quartet.advance(u, MANY, 0, slot.active, push, 1.0)
    quartet.advance(v, MANY, 0, slot.v_active, push, 1.0)


@jit
def keep_displacements(row, at, now, then, last):
    """Keeps the displacements in four of a run's frames from `at` on: `now`, two frames later, four, and in between."""
    row[at], row[at + 1], row[at + 2], row[at + 3] = now, 0.5 * (now + then), then, 0.5 * (then + last)


@jit
def begin_quartet(voice, slot, op):
    """`begin` for a quartet."""
    u, v = slot.u, slot.v
    push = push_of(voice, slot, op, FOUR)
    n, n_v = min(slot.active, slot.heard), min(slot.v_active, slot.heard)
    hand = slot.hand
    kept = hand * hand * (hand * hand)
    low = min(n, u.split)
    quartet.displace(u, low, push)
    for k in range(voice.pickups):
        now, then, last = quartet.displacements(u, low_part(tap_row(op, k), op), low)
        then, last = hand * hand * then, kept * last
        keep_displacements(voice.run[2 * k], 0, now, then, last)
    for k in range(voice.pickups - 2):
        keep_velocities(voice, k, 0, hand, quartet.sense(u, n, op, k, push), quartet.sense(v, n_v, op, k, push))
    k = voice.pickups - 1
    if k == 0:
        here, across = quartet.play_1(u, n, op, k, push, kept), quartet.play_1(v, n_v, op, k, push, kept)
        keep_velocities(voice, k, 0, hand, here, across)
    else:
        last_two = k - 1, k
        here, there = quartet.play_2(u, n, op, last_two, push, kept)
        across_here, across_there = quartet.play_2(v, n_v, op, last_two, push, kept)
        keep_velocities(voice, k - 1, 0, hand, here, across_here)
        keep_velocities(voice, k, 0, hand, there, across_there)
    quartet.advance(u, FOUR, n, slot.active, push, kept)
    quartet.advance(v, FOUR, n_v, slot.v_active, push, kept)


@jit
def keep_velocities(voice, i, at, hand, up, across):
    """Keeps the velocities at pickup `i` in four of a run's frames, from `at` on, from those along u and v.

    `hand`: the factor by which they fade a frame.
    """
    row, heard = voice.run[2 * i + 1], voice.across[i]
    row[at] = up[0] + heard * across[0]
    row[at + 1] = hand * (up[1] + heard * across[1])
    row[at + 2] = hand * hand * (up[2] + heard * across[2])
    row[at + 3] = hand * hand * (hand * (up[3] + heard * across[3]))


@jit
def read_sample(voice, y):
    """Fills y with what the pickups sense in the present frame of a run."""
    for i in range(2 * voice.pickups):
        y[i] = voice.run[i, voice.length - voice.left]


@jit
def pass_frames(string, ops, frames):
    """Goes on by so many `frames` of a run; ends it after the last."""
    voice = string.voice
    op = ops[string.slots[voice.slot].fret]
    voice.step += frames * op.steps
    voice.frame += frames
    voice.left -= frames
    if voice.left == 0:
        end(string, ops, voice.length, voice.step, voice.frame)


@jit
def end(string, ops, frames, step, frame):
    """Lets fingers and other strings act after a run of `frames` that has ended before `frame`, at fine step `step`."""
    voice = string.voice
    slot = string.slots[voice.slot]
    op = ops[slot.fret]
    if slot.hand < 1.0:
        touch.damp_ended(voice, slot, op)
    if op.turned > 0 and frames == LONG_RUN:
        turning.exchange_after_long_run(voice, slot, op)
    elif op.turned > 0:
        turning.exchange(voice, slot, op, step, True)
    if voice.idle != 0:
        answers.excite_answers(string, ops, step, frame, frames)


@apart
def stop(string, ops):
    """Ends a run before its end, if there is one: an event comes. The string moves on by quartets and single frames."""
    voice = string.voice
    if voice.left == 0:
        return
    slot = string.slots[voice.slot]
    op, frames = ops[slot.fret], voice.length - voice.left
    quartet.restore(slot.u, slot.active)
    quartet.restore(slot.v, slot.v_active)
    voice.left = 0
    while frames >= QUARTET:
        frames -= QUARTET
        push = push_of(voice, slot, op, FOUR)
        quartet.advance(slot.u, FOUR, 0, slot.active, push, 1.0)
        quartet.advance(slot.v, FOUR, 0, slot.v_active, push, 1.0)
        end(string, ops, QUARTET, voice.step - frames * op.steps, voice.frame - frames)
    for _ in range(frames):
        modal.leap_fading(slot.u, slot.active, WHOLE, slot.hand)
        modal.leap_fading(slot.v, slot.v_active, WHOLE, slot.hand)
        if voice.stretch > 0.0 and not slot.steady:
            tension.tighten_by_motion(voice, slot, op, op.steps * op.fine)
    slot.fourth = frames


@jit
def resume(string, ops):
    """Begins a restored string's run again, at the frame that it had reached."""
    voice = string.voice
    left = voice.left
    if left > 0:
        begin(string, ops, voice.length)
        voice.left = left
