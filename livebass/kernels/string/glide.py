"""A finger glides along a board: the string's length changes continuously, between the lengths of two semitones.

Every PERIOD the motion is handed over to the modes of the length that the finger will reach within it
(handover.to_shorter: beyond the old end the same motion continues as an odd function). Within the period the end of
these modes moves like the string between it and the finger, b(t) = (l(t) - L) u_x, with l(t) the string's length and L
the modes' length: the finger holds the string where it is, and within a fingertip's width the string is straight. u_x
is taken a frame ahead. So the end neither stops nor starts at a hand-over, and no tones arise at multiples of its rate.

Such a length gets its operator on the way: frequencies times length, and losses, are interpolated between the two
semitones; taps follow from the places of the pickups. It has no contact points: the finger's way is free, and contact
resumes where it stops. So it only needs the modes that are heard. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp, log2, sin_cos, square
from livebass.kernels.machine.native import record_address, record_at, words_at
from livebass.kernels.string import handover, modal, operators
from livebass.kernels.string.operators import (
    EXCHANGE_ROWS,
    coefficient,
    coefficient_at,
    coefficient_bytes,
    exchange_row,
    mixed_coefficient,
    put_number,
    tap_row,
)
from livebass.kernels.string.preparing import audible_weight
from livebass.kernels.string.records import BETWEEN, BLOCK, DOUBLE, OPERATOR, TOUCHES, WHOLE
from livebass.kernels.string.slot import SAFETY_STRUCK, load_tuned, wake_slot, wake_v

PERIOD = 1e-3  # s
MIN_TIME = 40e-3  # s of a glide: in less a hand would have to jump
FLESH = 6e-3  # m, half width of the fingertip
NARROWEST = 4.0  # of k a: shorter waves do not count for the slope under the fingertip
BETWEEN_BYTES = BETWEEN.itemsize
ROWS = BETWEEN.fields["rows"][1]  # type: ignore[index]
WORDS = OPERATOR.itemsize // DOUBLE
between_at = record_at(BETWEEN)


@jit
def between(string, k):
    """The BETWEEN of slot `k`."""
    return between_at(string.between + BETWEEN_BYTES * k)


@jit
def current_operator(string, ops, k):
    """The operator of slot `k`: for its fret, or for a length between two frets."""
    slot = string.slots[k]
    if slot.between:
        return between(string, k).op
    return ops[slot.fret]


@jit
def period(voice):
    """Frames between two hand-overs."""
    return max(1, np.int64(np.rint(PERIOD * voice.rate)))


@jit
def begin_glide(string, ops, length, frames_a_fret):
    """Begins to glide from the string's present length to `length` (m)."""
    voice = string.voice
    now = current_operator(string, ops, voice.slot).length
    if string.slots[voice.slot].between:
        now = length_at(voice, voice.glide_frame)
    voice.glide_from = now
    voice.glide_to = length
    frames = 12.0 * abs(log2(length / now)) * frames_a_fret
    voice.glide_frames = np.int64(np.rint(max(frames, MIN_TIME * voice.rate)))
    voice.glide_frame = 0


@jit
def length_at(voice, frame):
    """Length (m) of the string at a frame of the glide: the hand starts and stops smoothly."""
    t = min(frame / voice.glide_frames, 1.0)
    return voice.glide_from + (voice.glide_to - voice.glide_from) * (t * t * (3.0 - 2.0 * t))


@jit
def hand_over(string, ops, length):
    """Hands the motion over to the modes of `length` (m)."""
    voice = string.voice
    k = 1 - voice.slot
    old, new = string.slots[voice.slot], string.slots[k]
    op = current_operator(string, ops, voice.slot)
    voice.striking = 0
    voice.fingering = 0
    new.fret = make_operator(string, ops, k, length)
    to = between(string, k).op
    load_tuned(new, to, voice)
    new.between = 1
    new.moving = 1
    new.on = 1
    new.hand = old.hand
    new.safety = SAFETY_STRUCK
    part = to.length / op.length
    if old.v_active > 0 or old.stop_v.place != 0.0:
        wake_v(new, to)
    x, v, x_v, v_v = handover.to_shorter(old, op, new, to)
    new.stop_u.place = x + part * old.stop_u.place
    new.stop_u.speed = v + part * old.stop_u.speed
    new.active = to.padded
    if new.v_ready:
        new.stop_v.place = x_v + part * old.stop_v.place
        new.stop_v.speed = v_v + part * old.stop_v.speed
        new.v_active = to.padded
    new.offset = part * old.offset
    new.offset_speed = part * old.offset_speed
    old.on = 0
    voice.slot = k
    wake_slot(new, to, voice.step)


@jit
def steer_ends(string):
    """Sets the speed of the string's end for the next frame; returns the finger's travel (m) in it."""
    voice = string.voice
    slot, made = string.slots[voice.slot], between(string, voice.slot)
    then = length_at(voice, voice.glide_frame + 1)
    steer_end(slot.stop_u, slot.u, made, then - made.op.length)
    slot.active = made.op.padded
    if slot.v_ready:
        steer_end(slot.stop_v, slot.v, made, then - made.op.length)
        slot.v_active = made.op.padded
    return abs(then - length_at(voice, voice.glide_frame))


@jit
def steer_end(stop, w, made, behind):
    """Sets an end's speed to reach, after a frame, the straight line to a finger `behind` m out."""
    op = made.op
    h = op.steps * op.fine
    slope = modal.slope_ahead(w, made.slope_modes, made.slope, h) - (stop.place + h * stop.speed) / op.length
    speed = (behind * slope - stop.place) / h
    modal.kick_end(w, op.modes, (stop.speed - speed) * np.sqrt(2.0 * op.length) / np.pi)
    stop.speed = speed


@jit
def advance_ends(slot, h):
    """Moves the ends of u and v by a frame of `h` s."""
    slot.stop_u.place += slot.stop_u.speed * h
    slot.stop_v.place += slot.stop_v.speed * h


@jit
def make_operator(string, ops, k, length):
    """Makes the operator of slot `k` for `length` (m); returns the last fret that the finger has passed."""
    voice, slot, made = string.voice, string.slots[k], between(string, k)
    low = 0
    while low + 2 < ops.shape[0] and ops[low + 1].length >= length:
        low += 1
    a, b = ops[low], ops[low + 1]
    x = min(max((a.length - length) / (a.length - b.length), 0.0), 1.0)
    op = made.op
    modal.copy_row(words_at(record_address(op), WORDS), words_at(record_address(a), WORDS), WORDS)
    op.length = length
    op.speed = (1.0 - x) * a.speed + x * b.speed
    op.tap_modes = min(a.tap_modes, b.tap_modes)
    op.modes = min(min(a.modes, b.modes), op.tap_modes)
    op.padded = (op.modes + BLOCK - 1) // BLOCK * BLOCK
    op.split = min(min(a.split, b.split), op.padded)
    op.leaps = 1
    op.points = 0
    op.draped = 0
    op.coefficients = record_address(made) + ROWS
    op.coefficients_v = op.coefficients
    set_glide_coefficients(slot.u, op, op.coefficients, a, a.coefficients, b, b.coefficients, x)
    if a.coefficients_v != a.coefficients:
        op.coefficients_v += coefficient_bytes(op)
        set_glide_coefficients(slot.u, op, op.coefficients_v, a, a.coefficients_v, b, b.coefficients_v, x)
    op.turned = min(min(a.turned, b.turned), op.split)
    op.turning = op.coefficients_v + coefficient_bytes(op)
    set_glide_exchange(op, a, b, x)
    op.taps = op.turning + EXCHANGE_ROWS * DOUBLE * op.turned
    set_glide_taps(voice, op)
    set_slope(made, op)
    for i in range(TOUCHES):  # fingers on the string recompute their shapes
        slot.touch_key[i, 2] = 0.0
    return low if voice.glide_to < voice.glide_from or x == 0.0 else low + 1


@jit
def set_glide_coefficients(w, op, rows, a, rows_a, b, rows_b, x):
    """Fills the coefficients at `rows` for a length at the part `x` of the way from `a` to `b`.

    It computes them in the silent working set `w`, where the compiler knows the row distances.
    """
    omega_a, omega_b = coefficient_at(rows_a, a, operators.OMEGA), coefficient_at(rows_b, b, operators.OMEGA)
    sigma_a, sigma_b = coefficient_at(rows_a, a, operators.SIGMA), coefficient_at(rows_b, b, operators.SIGMA)
    of_a, of_b = (1.0 - x) * a.length / op.length, x * b.length / op.length
    for j in range(op.modes):
        w.omega[j] = of_a * omega_a[j] + of_b * omega_b[j]
        w.sigma[j] = (1.0 - x) * sigma_a[j] + x * sigma_b[j]
    w.omega[op.modes : op.padded] = 1.0
    w.sigma[op.modes : op.padded] = 0.0
    w.split = op.split
    modal.tune(w, op)
    modal.copy_row(coefficient_at(rows, op, operators.KAPPA), w.kappa, op.padded)
    modal.copy_row(coefficient_at(rows, op, operators.OMEGA), w.omega, op.padded)
    modal.copy_row(coefficient_at(rows, op, operators.SIGMA), w.sigma, op.padded)
    low, high, row = w.low.leaps[WHOLE], w.high.leaps[WHOLE], operators.LEAPS + 3 * WHOLE
    modal.put_row(op, mixed_coefficient(rows, op, operators.KEPT), w.low.kept, w.high.kept)
    modal.put_row(op, mixed_coefficient(rows, op, operators.SPRING), w.low.spring, w.high.spring)
    modal.put_row(op, mixed_coefficient(rows, op, operators.PACE), w.low.pace, w.high.pace)
    modal.put_row(op, mixed_coefficient(rows, op, row), low.a, high.a)
    modal.put_row(op, mixed_coefficient(rows, op, row + 1), low.b, high.b)
    modal.put_row(op, mixed_coefficient(rows, op, row + 2), low.g, high.g)


@jit
def set_glide_exchange(op, a, b, x):
    """Fills the exchange between u and v for a length at the part `x` of the way from `a` to `b`."""
    for row in range(EXCHANGE_ROWS):
        of_a, of_b = 1.0 - x, x
        if row == 0:  # a frequency
            of_a, of_b = of_a * a.length / op.length, of_b * b.length / op.length
        made, low, high = exchange_row(op, row), exchange_row(a, row), exchange_row(b, row)
        for j in range(op.turned):
            made[j] = of_a * low[j] + of_b * high[j]


@jit
def set_glide_taps(voice, op):
    """Fills the modes' weights at the pickups, or u's and v's at their sensors."""
    omega, sigma = coefficient(op, operators.OMEGA), coefficient(op, operators.SIGMA)
    for i in range(voice.pickups if voice.pickups > 0 else 2):
        row = tap_row(op, i if voice.pickups > 0 else 2 * i)
        k1 = np.pi / op.length
        before, now = 0.0, np.sqrt(2 / op.length)
        sine, cosine = sin_cos(k1 * (op.length - voice.saddle[i]))
        now *= sine
        window, ratio, step = gaussian_recurrence(square(k1 * voice.aperture[i]) / 24)
        for j in range(op.modes):
            put_number(row, op, j, now * window * audible_weight(voice.rate, omega[j], sigma[j]))
            before, now = now, 2.0 * cosine * now - before
            window *= ratio
            ratio *= step
        for j in range(op.modes, op.padded):
            put_number(row, op, j, 0.0)
        if voice.pickups == 0:
            row = tap_row(op, 2 * i + 1)
            for j in range(op.padded):
                put_number(row, op, j, 0.0)


@jit
def set_slope(made, op):
    """Fills the modes' weights in the slope at the stop."""
    k1 = np.pi / op.length
    n = (np.int64(NARROWEST / (k1 * FLESH)) + BLOCK) // BLOCK * BLOCK
    made.slope_modes = min(n, op.padded)
    window, ratio, step = gaussian_recurrence(0.5 * square(k1 * FLESH))
    for j in range(made.slope_modes):
        made.slope[j] = np.sqrt(2 / op.length) * k1 * (j + 1) * window
        window *= ratio
        ratio *= step


@jit
def gaussian_recurrence(a):
    """Returns exp(-a), the ratio of exp(-a j^2) at j = 2 to j = 1, and the ratio's factor from j to j + 1."""
    return exp(-a), exp(-3.0 * a), exp(-2.0 * a)
