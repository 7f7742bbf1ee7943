"""Carries strings that sound over to another version of the same bass: a bench parameter moves while a note rings.

Both basses come from the same instrument file, changed by the bench (kernels/bass/change.py). The new one takes over
its predecessor's frame count, hands, strings, floor and effects. Where the operators of a string are equal (pickups,
cable, fingers), its motion goes on bit for bit. Otherwise each mode keeps displacement and velocity, made smaller where
the new string would have more energy with them; and as after a fret change, an obstacle in the string starts lower and
rises while the string is clear of it (kernels/string/stop.py). So no change adds energy.

For CARRIED seconds both versions sound, one fading into the other: pickups and filters may have changed. [audio thread]
"""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.bass.instrument import WORD, copy_words
from livebass.kernels.bass.records import VOICE_WORDS
from livebass.kernels.effects.records import EFFECTS_BYTES, EFFECTS_STATE, effects_at, words_behind
from livebass.kernels.hands.fretting import GENTLY, change_fret
from livebass.kernels.machine.native import copy_record, floats_at, record_address
from livebass.kernels.pickup import tone
from livebass.kernels.player.performer import PERFORMER
from livebass.kernels.string import answers, modal, runs
from livebass.kernels.string.frame import invalidate_contact
from livebass.kernels.string.operators import EXCHANGE_ROWS, OMEGA, SIGMA, coefficient, coefficient_at, heights
from livebass.kernels.string.records import (
    GROUP_ROOM,
    MAX_NEAR,
    SLOT_STATE,
    VOICE_SLOTS,
    VOICE_STATE,
)
from livebass.kernels.string.slot import load_tuned, wake_slot, wake_v
from livebass.kernels.string.stop import lower_obstacles
from livebass.kernels.string.touch import linear_density
from livebass.live.thread import ahead
from livebass.live.thread.load import switch_operators
from livebass.live.thread.records import operators_of, performer_of, string_of

jit = compiled(attributes=SMALL)

CARRIED = 8e-3  # s
SAME_LENGTH = 1e-9  # m
HANDS_FROM, HANDS_TO = (PERFORMER.fields[name][1] // WORD for name in ("position", "out"))  # type: ignore[index]


@jit
def is_same_bass(b, old):
    """True if both basses are versions of the same instrument file."""
    return b.of != 0 and b.of == old.of and b.strings == old.strings and b.frets == old.frets


@jit
def carry_bass(synth, b, old):
    """Gives the bass `b`, which has not played yet, the state of `old` at the synth's frame."""
    b.frame = old.frame
    hands, old_hands = record_address(performer_of(b)), record_address(performer_of(old))
    copy_words(old_hands + WORD * HANDS_FROM, hands + WORD * HANDS_FROM, HANDS_TO - HANDS_FROM)
    carry_floor(b.floor, old.floor)
    carry_effects(b.effects, old.effects)
    for i in range(b.strings):
        if (old.coarse >> i) & 1:
            switch_operators(old, i, np.int64(0), synth.frame)
        else:
            ahead.drop_ahead(old, i, synth.frame - old.frame)
        carry_string(string_of(b, i), operators_of(b, 0)[i], string_of(old, i), operators_of(old, 0)[i])


@jit
def carry_floor(floor, old):
    """Goes on with the noise of the electronics, at its own level."""
    level, hum = floor.level, floor.hum
    copy_record(floor, old)
    floor.level, floor.hum = level, hum


@jit
def carry_effects(address, old_address):
    """Goes on with compressor, valve stage and impulse response."""
    e, old = effects_at(address), effects_at(old_address)
    if e.taps != old.taps:
        return
    copy_words(old_address, address, EFFECTS_STATE)
    e.newest, e.done = old.newest, old.done
    if old.idle == 0:
        copy_words(old_address + EFFECTS_BYTES, address + EFFECTS_BYTES, words_behind(e.taps))


@jit
def carry_string(string, ops, old, old_ops):
    """Gives a string at rest, on the operators `ops`, the state of `old` on `old_ops`.

    A glide ends at the fret that it has reached. A note whose string now rests on another crown ends.
    """
    voice, was = string.voice, old.voice
    if was.left > 0 and not are_equal(ops[old.slots[was.slot].fret], old_ops[old.slots[was.slot].fret]):
        runs.stop(old, old_ops)
    if old.slots[was.slot].on and old.slots[was.slot].between:
        change_fret(old, old_ops, old.slots[was.slot].fret, GENTLY, 0.0)
        was.slide_to = -1
    first = WORD * VOICE_STATE
    copy_words(record_address(was) + first, record_address(voice) + first, VOICE_WORDS - VOICE_STATE)
    voice.step = voice.frame * voice.numerator
    voice.report_count = voice.report_room + 1 if voice.report_room > 0 else 0  # its past cannot be told from here
    tone.set_tone(voice, voice.tone)
    tone.set_blend(voice, voice.blend)
    for k in range(VOICE_SLOTS):
        slot = old.slots[k]
        if slot.on and abs(ops[slot.fret].length - old_ops[slot.fret].length) < SAME_LENGTH:
            carry_slot(string.slots[k], ops[slot.fret], slot, old_ops[slot.fret], voice)
    voice.answering = 0
    had = old.answers
    if string.answers.count == had.count:
        answers.take_answers(voice, string.answers, was.answering, had.line, had.q, had.y)


@jit
def carry_slot(slot, op, old, old_op, voice):
    """Gives a silent slot, on the operator `op`, the motion of `old` on `old_op`."""
    load_tuned(slot, op, voice)
    if old.v_ready:
        wake_v(slot, op)
    ratio, heard, equal = slot.ratio, slot.heard, are_equal(op, old_op)
    copy_words(record_address(old), record_address(slot), SLOT_STATE)
    slot.ratio, slot.heard = ratio, heard
    if equal:
        copy_contact(slot, old, op)
        return
    lighter = linear_density(old_op) / linear_density(op)
    carry_motion(slot.u, op, old.u, old_op, lighter)
    slot.active = op.padded
    if old.v_ready:
        carry_motion(slot.v, op, old.v, old_op, lighter)
        slot.v_active = op.padded
        invalidate_contact(slot.v, op)
    if not slot.moving:
        lower_obstacles(slot, op)
    wake_slot(slot, op, voice.step)


@jit
def are_equal(op, old):
    """True if strings on both operators move and touch alike."""
    if op.modes != old.modes or op.split != old.split or op.points != old.points or op.turned != old.turned:
        return False
    if op.fine != old.fine or op.weight != old.weight or op.length != old.length or op.speed != old.speed:
        return False
    if op.loss != old.loss or op.stiffness != old.stiffness or op.exponent != old.exponent or op.slip != old.slip:
        return False
    if op.friction != old.friction or op.steps != old.steps:
        return False
    for row in (OMEGA, SIGMA):
        if not same_row(coefficient(op, row), coefficient(old, row), op.modes):
            return False
        mine, its = coefficient_at(op.coefficients_v, op, row), coefficient_at(old.coefficients_v, old, row)
        if not same_row(mine, its, op.modes):
            return False
    n = EXCHANGE_ROWS * op.turned
    if not same_row(floats_at(op.turning, n), floats_at(old.turning, n), n):
        return False
    return same_row(heights(op), heights(old), op.points)


@jit
def same_row(a, b, n):
    """True if `n` numbers are equal."""
    equal = True
    for j in range(n):
        equal = equal and a[j] == b[j]
    return equal


@jit
def copy_contact(slot, old, op):
    """Copies motion and contact over an equal operator."""
    copy_modes(slot.u, old.u, op.padded)
    modal.copy_row(slot.u.clearance, old.u.clearance, op.points)
    modal.copy_row(slot.u.height, old.u.height, op.points)
    modal.copy_row(slot.u.known_at, old.u.known_at, op.points)
    modal.copy_row(slot.u.due, old.u.due, op.points)
    modal.copy_row(slot.u.eta, old.u.eta, op.points)
    modal.copy_row(slot.u.eta_before, old.u.eta_before, op.points)
    modal.copy_row(slot.u.solved_at, old.u.solved_at, op.points)
    modal.copy_row(slot.v.moved, old.v.moved, op.points)
    modal.copy_row(slot.v.moved_before, old.v.moved_before, op.points)
    modal.copy_row(slot.v.solved_at, old.v.solved_at, op.points)
    if op.points > MAX_NEAR:
        modal.copy_row(slot.u.group_due, old.u.group_due, GROUP_ROOM)
        modal.copy_row(slot.u.group_known_at, old.u.group_known_at, GROUP_ROOM)
        modal.copy_row(slot.u.group_clearance, old.u.group_clearance, GROUP_ROOM)
        modal.copy_row(slot.u.group_clearance_now, old.u.group_clearance_now, GROUP_ROOM)
    if old.v_ready:
        copy_modes(slot.v, old.v, op.padded)


@jit
def copy_modes(w, old, n):
    """Copies `n` modes, and what hands do to them."""
    modal.widen(old, n)
    modal.copy_row(w.q, old.q, n)
    modal.copy_row(w.p, old.p, n)
    modal.narrow(w, n)
    copy_before(w.low, old.low, w.split)
    copy_before(w.high, old.high, n - w.split)
    copy_hands(w, old, n)


@jit
def copy_before(rows, old, n):
    """Copies the state before a run that has begun (kernels/string/runs.py)."""
    for j in range(n):
        rows.q_before[j] = old.q_before[j]
        rows.p_before[j] = old.p_before[j]


@jit
def copy_hands(w, old, n):
    """Copies the held shape, the thumb's push and the damping finger over `n` modes."""
    modal.copy_row(w.held, old.held, n)
    modal.copy_row(w.strike, old.strike, n)
    modal.copy_row(w.finger, old.finger, n)


@jit
def carry_motion(w, op, old, old_op, lighter):
    """Gives the modes of `op` the displacement and velocity of those of `old_op`, but no more energy.

    lighter: the old linear density over the new one.
    """
    shared = min(op.modes, old_op.modes)
    modal.widen(old, shared)
    w.q[: op.padded] = 0.0
    w.p[: op.padded] = 0.0
    for j in range(shared):
        x, y = old.q[j], old.p[j] / old.kappa[j]
        before = lighter * (y * y + (old.omega[j] * x) * (old.omega[j] * x))
        y += (w.sigma[j] - old.sigma[j]) * x
        after = y * y + (w.omega[j] * x) * (w.omega[j] * x)
        part = np.sqrt(before / after) if after > before else 1.0
        w.q[j] = part * x
        w.p[j] = part * y * w.kappa[j]
    modal.narrow(w, op.padded)
    copy_hands(w, old, shared)
    w.held[shared : op.padded] = 0.0
    w.strike[shared : op.padded] = 0.0
    w.finger[shared : op.padded] = 1.0
