"""Sympathetic strings: a sounding string makes idle strings answer, through the neck that bends under it.

A sounding string moves the end of the neck, and so the ends of all other strings. It excites partials of unmuted open
strings at nearly the same frequency. With A = q - i y of each, y = (q' + sigma q) / omega, a mode i of the sounding
string s and a mode j of an idle string t exchange

    A_j' = G r A_i,   A_i' = (G / r) A_j,   G = -Y sqrt(T_s T_t / (L_s L_t)),   r = sqrt(mu_s / mu_t) omega_i / omega_j,

on top of their own motion. Y is the neck's velocity at the nut, where t ends, over the force where s ends, at the
frequency of j (model/answers.py). A string's modes already include the losses and detunings by its own end. Each j
pairs with the nearest i within NEAR rad/s, and only pairs with an effect count.

Strings are computed one after another, each ahead of the clock and back. So each string carries the answering modes of
all others as its own oscillators and sounds them itself: no string waits for another. Answers to answers are omitted.

The exchange is passive. Once in EVERY frames a pair advances by its exact flow, whose energy norm is exp(|Re G| t): the
losses of both modes are greater, as Re G is kept below the limit they allow. While the string presses on a fret, its
pairs wait.

Unless these RING_ON, hands that move to another fret mute the idle strings in passing, for MOVING s: answers to one
note do not ring on under the next.

`string` is a STRING, `slot` its sounding SLOT. [audio thread]
"""

import numpy as np

from livebass.compiling import compiled, jit
from livebass.kernels.machine.elementary import cos, exp, sin
from livebass.kernels.machine.native import floats_at
from livebass.kernels.string import modal
from livebass.kernels.string.frame import is_touching
from livebass.kernels.string.modal import LANES
from livebass.kernels.string.operators import OMEGA, SIGMA, coefficient, number_at, tap_row
from livebass.kernels.string.records import BLOCK, RING_ON, UNKNOWN
from livebass.kernels.string.touch import linear_density

NEAR = 2 * np.pi * 20.0  # rad/s
WEAK = 0.004  # |G| over the frequency difference: an answer stays 48 dB below its partial
EVERY = 32  # frames between two exchanges of a pair; the pairs take turns
MARGIN = 0.98  # of the greatest Re G that the losses allow
MAX_FLOW = 0.1  # |G| times the time between two exchanges
DEAD = 1e-12  # m^1.5: an answer below this is silence, and none begins
MOVING = 0.06  # s
CUT_RATE = 900.0  # 1/s of all-sound-off
# The hands resting on idle strings: places as part of the length, resistance (N s/m), and the rest nearby (1/s). Hands
# of another resistance damp in proportion.
RESTING, RESISTANCE, ALL_OVER = (0.17, 0.25), 3.0, 12.0

fast = compiled(fastmath=LANES)


@jit
def fill_answers(string, i, instrument, ops):
    """Gives string `i` of an INSTRUMENT the other strings' modes that may answer it; ops (strings, frets + 1)."""
    a, n = string.answers, 0
    a.own_density = linear_density(ops[i, 0])
    h = 1.0 / string.voice.rate
    for t in range(instrument.strings):
        if t == i:
            continue
        op = ops[t, 0]
        omega, sigma = coefficient(op, OMEGA), coefficient(op, SIGMA)
        for j in range(instrument.answering_modes[t]):
            g = n
            n += 1
            a.place[g] = UNKNOWN
            a.string[g] = t
            if j >= op.modes:
                continue  # this quality has no such mode: it stays at rest
            w, s = omega[j], sigma[j]
            a.omega[g] = w
            a.sigma[g] = s
            a.density[g] = linear_density(op)
            a.stiffness[g] = linear_density(op) * op.speed * op.speed / op.length
            a.cosine[g] = exp(-s * h) * cos(w * h)
            a.sine[g] = exp(-s * h) * sin(w * h)
            rate = ALL_OVER
            for place in RESTING:
                shape = sin((j + 1) * np.pi * place)
                rate += RESISTANCE / (linear_density(op) * op.length) * shape * shape
            a.muted[g] = exp(-rate * h)
            a.rested[g] = exp(-rate * h * instrument.player.resting_hand / RESISTANCE)
            if instrument.sensed:
                a.of_q[g] = number_at(tap_row(op, 0), op, j)
            for k in range(instrument.pickups[t]):
                weight = instrument.mix[t, k] * number_at(tap_row(op, k), op, j)
                a.of_q[g] -= s * weight
                a.of_y[g] += w * weight
    a.count = n
    a.damped_for = UNKNOWN
    a.pairs_for[0] = UNKNOWN


@fast
def rotate_answers(a, n):
    """Returns the signal of the first `n` sounding modes, before the filters, and moves them by one frame: free motion,
    damped by hands on their strings.
    """
    x = np.float32(0.0)
    for k in range(n):
        q = a.q[k]
        y = a.y[k]
        x += a.heard_q[k] * q + a.heard_y[k] * y
        a.q[k] = a.now_cosine[k] * q + a.now_sine[k] * y
        a.y[k] = a.now_cosine[k] * y - a.now_sine[k] * q
    return x


@jit
def hands_move(voice):
    """True while hands that move to another fret mute idle strings in passing."""
    return voice.frame < voice.hands_until and voice.idle & RING_ON == 0


@jit
def set_answer_damping(voice, a):
    """Computes one frame of the sounding modes, damped by the hands that are on their strings now."""
    key = 4 * voice.idle + 2 * hands_move(voice) + voice.cut
    if a.damped_for == key:
        return
    a.damped_for = key
    for k in range(voice.answering):
        damp_answer(voice, a, k)


@jit
def damp_answer(voice, a, k):
    """`set_answer_damping` for the mode at place `k`."""
    g = a.mode[k]
    kept = a.rested[g] if (voice.idle >> a.string[g]) & 1 and not hands_move(voice) else a.muted[g]
    if voice.cut:
        kept = exp(-CUT_RATE / voice.rate)
    a.now_cosine[k] = kept * a.cosine[g]
    a.now_sine[k] = kept * a.sine[g]


@jit
def begin_answer(voice, a, g, q, y):
    """Lets the silent mode `g` sound, from `q` and `y` on."""
    set_answer_damping(voice, a)
    k = voice.answering
    voice.answering += 1
    a.place[g] = k
    a.mode[k] = g
    a.q[k] = q
    a.y[k] = y
    a.heard_q[k] = a.of_q[g]
    a.heard_y[k] = a.of_y[g]
    damp_answer(voice, a, k)


@jit
def end_answer(voice, a, k):
    """Silences the mode at place `k`, which the last one takes."""
    voice.answering -= 1
    last = voice.answering
    a.place[a.mode[k]] = UNKNOWN
    if k < last:
        a.place[a.mode[last]] = k
        for row in (a.q, a.y, a.heard_q, a.heard_y, a.now_cosine, a.now_sine):
            row[k] = row[last]
        a.mode[k] = a.mode[last]
    a.q[last] = 0.0
    a.y[last] = 0.0


@jit
def silence_answers(voice, a):
    """Silences all modes."""
    while voice.answering > 0:
        end_answer(voice, a, voice.answering - 1)


@jit
def take_answers(voice, a, count, modes, q, y):
    """Lets `count` of the silent `modes` sound, in this order, from `q` and `y` on."""
    a.damped_for = UNKNOWN
    for k in range(count):
        begin_answer(voice, a, np.int64(modes[k]), q[k], y[k])


@jit
def nearest_mode(w, n, omega):
    """Of `n` modes of a working set, the one nearest to `omega`."""
    i = min(max(np.int64(omega / w.omega[0]), 0), n - 1)
    while i > 0 and abs(w.omega[i - 1] - omega) < abs(w.omega[i] - omega):
        i -= 1
    while i + 1 < n and abs(w.omega[i + 1] - omega) < abs(w.omega[i] - omega):
        i += 1
    return i


@jit
def find_pairs(string, slot, op):
    """Pairs the slot's modes with idle strings' modes, if these or the slot have changed."""
    voice, a, u = string.voice, string.answers, slot.u
    key = a.pairs_for
    if key[0] == op.coefficients and key[1] == voice.idle and a.pairs_ratio == slot.ratio:
        return
    key[0] = op.coefficients
    key[1] = voice.idle
    a.pairs_ratio = slot.ratio
    admittance = floats_at(op.answers, 2 * op.answering)
    gamma, time = linear_density(op) * op.speed * op.speed / op.length, EVERY / voice.rate
    n = 0
    for g in range(min(a.count, op.answering)):
        w = a.omega[g]
        if w == 0.0 or not (voice.idle >> a.string[g]) & 1:
            continue
        i = nearest_mode(u, op.modes, w)
        away = abs(u.omega[i] - w)
        root = -np.sqrt(gamma * a.stiffness[g])
        real, imaginary = root * admittance[2 * g], root * admittance[2 * g + 1]
        size = np.sqrt(real * real + imaginary * imaginary)
        if away > NEAR or size < WEAK * away or size == 0.0:
            continue
        minimum = min(1.0, MAX_FLOW / (size * time))
        a.pair_answer[n] = g
        a.pair_mode[n] = i
        a.pair_real[n] = real * minimum
        a.pair_imaginary[n] = imaginary * minimum
        n += 1
    for p in range(n):  # the part of the losses that pairs of one mode must share
        i, needed = a.pair_mode[p], 0.0
        for other in range(n):
            if a.pair_mode[other] == i:
                x = a.pair_real[other]
                needed += x * x / max(u.sigma[i] * a.sigma[a.pair_answer[other]], 1e-300)
        a.pair_allowed[p] = min(1.0, MARGIN / np.sqrt(max(needed, 1e-300)))
    for p in range(n):
        g, i = a.pair_answer[p], a.pair_mode[p]
        r = np.sqrt(linear_density(op) / a.density[g]) * u.omega[i] / a.omega[g]
        set_flow(a.flow[p], a.pair_allowed[p] * a.pair_real[p] * time, a.pair_imaginary[p] * time, r)
        scale = u.kappa[i] * u.omega[i]
        a.flow[p, 6] = scale
        a.flow[p, 7] = 1.0 / scale
    a.pairs = n


@jit
def set_flow(flow, x, y, r):
    """Sets a pair's `flow`: cosh and sinh of the small z = x + i y, with sinh both times and over `r`."""
    square_x, square_y = x * x - y * y, 2 * x * y
    c_x, c_y = 0.5 + square_x / 24.0, square_y / 24.0
    s_x, s_y = 1.0 + square_x / 6.0, square_y / 6.0
    flow[0] = 1.0 + square_x * c_x - square_y * c_y
    flow[1] = square_x * c_y + square_y * c_x
    sinh_x, sinh_y = x * s_x - y * s_y, x * s_y + y * s_x
    flow[2] = sinh_x * r
    flow[3] = sinh_y * r
    flow[4] = sinh_x / r
    flow[5] = sinh_y / r


@jit
def exchange(string, slot, op, step):
    """Exchanges energy in the pairs due this frame, after the slot has moved to fine step `step`.

    A note that hands are ending no longer exchanges energy: answers must not keep its string awake.
    """
    if slot.moving or slot.hand < 1.0 or slot.active == 0 or is_touching(slot, op, step):
        return
    voice, a, u = string.voice, string.answers, slot.u
    if slot.fret != voice.answered_fret:
        voice.answered_fret = slot.fret
        if voice.answering:
            voice.hands_until = voice.frame + round(MOVING * voice.rate)
    find_pairs(string, slot, op)
    for p in range((voice.frame - voice.begun) % EVERY, a.pairs, EVERY):
        g, i = a.pair_answer[p], a.pair_mode[p]
        flow = a.flow[p]
        c_x, c_y, on_x, on_y, back_x, back_y = flow[0], flow[1], flow[2], flow[3], flow[4], flow[5]
        q, y = modal.state_of(u, i)
        y *= -flow[7]
        k = a.place[g]
        x, z = (a.q[k], -a.y[k]) if k != UNKNOWN else (0.0, 0.0)
        q_after = c_x * q - c_y * y + back_x * x - back_y * z
        p_after = -flow[6] * (c_x * y + c_y * q + back_x * z + back_y * x)
        x, z = c_x * x - c_y * z + on_x * q - on_y * y, c_x * z + c_y * x + on_x * y + on_y * q
        if k != UNKNOWN:
            a.q[k], a.y[k] = x, -z
        elif x * x + z * z > DEAD * DEAD:
            begin_answer(voice, a, g, x, -z)
        else:
            continue
        modal.set_state(u, i, q_after, p_after)
        slot.active = max(slot.active, (i + BLOCK) // BLOCK * BLOCK)


@jit
def next_answer(string):
    """Returns the answers' signal in this frame and moves them to the next."""
    voice, a = string.voice, string.answers
    if not voice.answering:
        return 0.0
    set_answer_damping(voice, a)
    return rotate_answers(a, (voice.answering + BLOCK - 1) // BLOCK * BLOCK)


@jit
def excite_answers(string, ops, step):
    """Exchanges energy with the answers, after the string has moved to fine step `step`."""
    voice, a = string.voice, string.answers
    slot = string.slots[voice.slot]
    if voice.idle != 0 and slot.on and a.count > 0 and not voice.cut:
        exchange(string, slot, ops[slot.fret], step)


@jit
def drop_dead_answers(string):
    """Silences answers that have died away, and bounds the energy that slots may get back from the others."""
    voice, a = string.voice, string.answers
    if not voice.answering:
        return
    speed, amplitude = 0.0, 0.0
    for k in range(voice.answering - 1, -1, -1):
        square = np.float64(a.q[k] * a.q[k] + a.y[k] * a.y[k])
        if not square < np.inf:
            silence_answers(voice, a)
            speed, amplitude = 0.0, 0.0
            break
        if square < DEAD * DEAD:
            end_answer(voice, a, k)
            continue
        g = a.mode[k]
        back = a.density[g] / a.own_density * square
        speed += a.omega[g] * a.omega[g] * back
        amplitude += np.sqrt(back)
    for k in range(2):
        string.slots[k].answer_speed = speed
        string.slots[k].answer_sum = amplitude
