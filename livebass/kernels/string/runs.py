"""Runs: a string that nothing touches moves four frames at once, a quartet.

A quartet begins only where its four frames are known to be free: no hand, no contact, no bend, no exchange owed.
Whether it begins depends on the string alone, never on blocks or on events to come. Its sound is computed when it
begins, and its motion too; then its frames are played one by one, in as many blocks as it takes. If an event comes
before its end, the string goes back to the quartet's begin, and by single frames to the event: what has sounded stays
as it was.

After a quartet u and v exchange energy (turning.py), and other strings with both (answers.py), and fingers on an ended
note act (touch.py). Qualities with float64 modes alone have no quartets, but the same exchanges. `string` is a STRING,
`ops` the operators of its frets. [audio thread]
"""

from livebass.compiling import apart, jit
from livebass.kernels.string import answers, modal, quartet, tension, touch, turning
from livebass.kernels.string.looks import look_ahead
from livebass.kernels.string.operators import is_exact, low_part, tap_row
from livebass.kernels.string.records import MAX_NEAR, NONE, QUARTET, WHOLE
from livebass.kernels.string.slot import REST_EVERY, is_touched

LOWEST, HIGHEST = 0.5, 2.0  # tuning of a string: bent farther, the shears of tension (quartet.py) may be unstable


@jit
def may_begin(string, ops):
    """True if a quartet can begin with this frame."""
    voice = string.voice
    slot = string.slots[voice.slot]
    if slot.fourth != 0 or not slot.on or slot.active == 0 or not slot.v_ready or slot.owed != 0:
        return False
    if voice.raw or voice.pickups == 0 or voice.denominator > 1 or string.slots[1 - voice.slot].on:
        return False
    if is_handled(voice, slot) or (voice.frame - voice.woken) % REST_EVERY > REST_EVERY - QUARTET:
        return False
    op = ops[slot.fret]
    end = voice.step + QUARTET * op.steps
    if op.draped and slot.hand < 1.0:  # hands take from its distance to rest
        return False
    if is_exact(op) or not LOWEST <= slot.ratio <= HIGHEST:
        return False
    if op.points == 0 or end <= slot.quiet or end <= slot.due:
        return True
    if op.points > MAX_NEAR:
        return False
    quartet.prepare(slot.u, op)
    return look_ahead(voice, slot, op)


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
def begin(string, ops):
    """Moves the string by a quartet, and keeps what its pickups sense in its frames."""
    voice = string.voice
    slot = string.slots[voice.slot]
    op, u, v = ops[slot.fret], slot.u, slot.v
    quartet.prepare(u, op)
    quartet.prepare(v, op)
    push = tension.push_ahead(voice, slot, op) if voice.stretch > 0.0 and not slot.steady else 0.0
    n, n_v = min(slot.active, slot.heard), min(slot.v_active, slot.heard)
    hand = slot.hand
    kept = hand * hand * (hand * hand)
    low = min(n, u.split)
    quartet.displace(u, low, push)
    for k in range(voice.pickups):
        now, then, last = quartet.displacements(u, low_part(tap_row(op, k), op), low)
        then, last = hand * hand * then, kept * last
        row = voice.run[2 * k]
        row[0], row[1], row[2], row[3] = now, 0.5 * (now + then), then, 0.5 * (then + last)
    for k in range(voice.pickups - 2):
        keep_velocities(voice, k, hand, quartet.sense(u, n, op, k, push), quartet.sense(v, n_v, op, k, push))
    k = voice.pickups - 1
    if k == 0:
        here, across = quartet.play_1(u, n, op, k, push, kept), quartet.play_1(v, n_v, op, k, push, kept)
        keep_velocities(voice, k, hand, here, across)
    else:
        last_two = k - 1, k
        here, there = quartet.play_2(u, n, op, last_two, push, kept)
        across_here, across_there = quartet.play_2(v, n_v, op, last_two, push, kept)
        keep_velocities(voice, k - 1, hand, here, across_here)
        keep_velocities(voice, k, hand, there, across_there)
    quartet.advance(u, n, slot.active, push, kept)
    quartet.advance(v, n_v, slot.v_active, push, kept)
    voice.left = QUARTET


@jit
def keep_velocities(voice, i, hand, up, across):
    """Keeps the velocities at pickup `i` in a quartet's frames, from those along u and v.

    `hand`: the factor by which they fade a frame.
    """
    row, heard = voice.run[2 * i + 1], voice.across[i]
    row[0] = up[0] + heard * across[0]
    row[1] = hand * (up[1] + heard * across[1])
    row[2] = hand * hand * (up[2] + heard * across[2])
    row[3] = hand * hand * (hand * (up[3] + heard * across[3]))


@jit
def read_sample(voice, y):
    """Fills y with what the pickups sense in the present frame of a quartet."""
    for i in range(2 * voice.pickups):
        y[i] = voice.run[i, QUARTET - voice.left]


@jit
def next_frame(string, ops):
    """Goes on to the next frame of a quartet; ends it after the last."""
    voice = string.voice
    slot = string.slots[voice.slot]
    op = ops[slot.fret]
    voice.step += op.steps
    voice.frame += 1
    voice.left -= 1
    if voice.left > 0:
        return
    if slot.hand < 1.0:
        touch.damp_ended(voice, slot, op)
    if op.turned > 0:
        turning.exchange(voice, slot, op, voice.step, True)
    if voice.idle != 0:
        answers.excite_answers(string, ops, voice.step, voice.frame - 1, True)


@apart
def stop(string, ops):
    """Ends a quartet before its end, if there is one: an event comes. The string moves on by single frames."""
    voice = string.voice
    if voice.left == 0:
        return
    slot = string.slots[voice.slot]
    op, frames = ops[slot.fret], QUARTET - voice.left
    quartet.restore(slot.u, slot.active)
    quartet.restore(slot.v, slot.v_active)
    for _ in range(frames):
        modal.leap_fading(slot.u, slot.active, WHOLE, slot.hand)
        modal.leap_fading(slot.v, slot.v_active, WHOLE, slot.hand)
        if voice.stretch > 0.0 and not slot.steady:
            tension.tighten_by_motion(voice, slot, op, op.steps * op.fine)
    slot.fourth = frames
    voice.left = 0


@jit
def resume(string, ops):
    """Begins a restored string's quartet again, at the frame that it had reached."""
    voice = string.voice
    left = voice.left
    if left > 0:
        begin(string, ops)
        voice.left = left
