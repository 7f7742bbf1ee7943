"""Sympathetic strings: a sounding string makes idle strings answer, through the neck that bends under it.

A sounding string moves the end of the neck, and so the ends of all other strings. It excites partials of unmuted open
strings at nearly the same frequency. The neck moves along the axes a and b (law.py), so each partial of a string has a
line along each. Lines along one axis answer each other. With A = q - i y of each, y = (q' + sigma q) / omega, a line i
of the sounding string s and a line j of an idle string t exchange

    A_j' = G r A_i,   A_i' = (G / r) A_j,   G = -Y sqrt(T_s T_t / (L_s L_t)),   r = sqrt(mu_s / mu_t) omega_i / omega_j,

on top of their own motion. Y is the neck's velocity at the nut along the axis, where t ends, over the force where s
ends (model/answers.py), at the complex frequency midway between i and j: at that of j alone, the slower of their two
motions may last twice as long as it should. A string's modes already include the losses and detunings by its own end.
Each j pairs with the nearest i within NEAR rad/s, and only pairs with an effect count.

An idle string touches nothing, so its lines along a and b are free oscillators, heard as pickups hear these directions.
The sounding string moves along u and v: with velocity amplitudes omega A, its line along a is c u + s v, along b
c v - s u, and what the line gains returns to both. This turn keeps the energy. Where the axes are u and v, only lines
along a are computed.

Strings are computed one after another, each ahead of the clock and back. So each string carries the answering lines of
all others as its own oscillators and sounds them itself: no string waits for another. Where lines of two idle strings
meet, one passes its answer on to the other by the part Im G of the same exchange, which keeps energy whatever else is
exchanged.

The exchange is passive. Once in EVERY frames, after a run of them, a pair advances by its exact flow, whose energy
norm is exp(|Re G| t): the losses of both lines are greater, as Re G is kept below the limit they allow. Pairs of one
line share that limit: those with the greatest effect come first. While the string presses on a fret, or owes exchanges
between u and v, its pairs wait.

Unless these RING_ON, hands that move to another fret mute the idle strings in passing, for MOVING s: answers to one
note do not ring on under the next.

`string` is a STRING, `slot` its sounding SLOT. [audio thread]
"""

import numpy as np

from livebass.compiling import apart, compiled, jit
from livebass.kernels.machine.elementary import cos, exp, sin
from livebass.kernels.machine.native import floats_at
from livebass.kernels.string import modal
from livebass.kernels.string.frame import is_touching
from livebass.kernels.string.modal import LANES
from livebass.kernels.string.operators import number_at, tap_row
from livebass.kernels.string.records import BLOCK, MAX_LINKS, RING_ON, THERE, UNKNOWN
from livebass.kernels.string.touch import linear_density
from livebass.kernels.string.turning import along_axis

NEAR = 2 * np.pi * 20.0  # rad/s
LINKED = 0.1  # |G| over the difference and the losses of two idle strings' lines: a weaker link is left out
WEAK = 0.006  # |G| over the frequency difference: an answer stays 44 dB below its partial
EVERY = 64  # frames between two exchanges of a pair; the pairs take turns
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
    """Gives string `i` of an INSTRUMENT the other strings' lines that may answer it; ops (strings, frets + 1)."""
    a, n = string.answers, 0
    a.own_density = linear_density(ops[i, 0])
    h = 1.0 / string.voice.rate
    for t in range(instrument.strings):
        if t == i:
            continue
        op, modes = ops[t, 0], instrument.answering_modes[t]
        for line in range(answering_lines(instrument, ops, t)):
            g, j, across = n, line % modes, np.int64(line >= modes)
            n += 1
            a.place[g] = UNKNOWN
            a.string[g] = t
            a.across[g] = across
            if j >= modes_along_axes(op):
                continue  # this quality has no such mode: it stays at rest
            w, s = along_axis(op, j, across)
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
            of_u, of_v = direction(op, across)
            if instrument.sensed:
                a.of_q[g] = of_u * number_at(tap_row(op, 0), op, j)
                own = tap_row(op, 2 * string.voice.denominator)
                a.of_q[g] += of_v * instrument.across[t, 0] * number_at(own, op, j)
            for k in range(instrument.pickups[t]):
                weight = instrument.mix[t, k] * number_at(tap_row(op, k), op, j)
                weight *= of_u + of_v * instrument.across[t, k]
                a.of_q[g] -= s * weight
                a.of_y[g] += w * weight
    a.count = n
    link_lines(string, i, instrument, ops)
    a.damped_for = UNKNOWN
    a.pairs_for[0] = UNKNOWN


@jit
def answering_lines(instrument, ops, t):
    """Number of lines of string `t` that may answer others, as law.py's `lines_of`."""
    return instrument.answering_modes[t] * (1 + (ops[t, 0].turned > 0))


@jit
def direction(op, across):
    """How far axis a, or b if `across`, points along u and along v."""
    return (-op.axes[1], op.axes[0]) if across else (op.axes[0], op.axes[1])


@jit
def link_lines(string, i, instrument, ops):
    """Links lines of different idle strings that meet along one axis, for string `i`."""
    a, time, own = string.answers, EVERY / string.voice.rate, answering_lines(instrument, ops, i)
    a.links = 0
    for g in range(a.count):
        t = a.string[g]
        admittance = floats_at(ops[t, 0].answers, 2 * ops[t, 0].answering)
        before = answering_lines(instrument, ops, t)  # in the list of string i, but not in that of string t
        for h in range(g + 1, a.count):
            if a.string[h] == t or a.across[h] != a.across[g] or a.omega[g] == 0.0 or a.omega[h] == 0.0:
                continue
            listed = h - before + (own if i < a.string[h] else 0)
            imaginary = -np.sqrt(a.stiffness[g] * a.stiffness[h]) * admittance[2 * listed + 1]
            away = abs(a.omega[h] - a.omega[g]) + a.sigma[g] + a.sigma[h]
            if a.links < MAX_LINKS and abs(imaginary) > LINKED * away:
                turned = min(max(imaginary * time, -MAX_FLOW), MAX_FLOW)
                r = np.sqrt(a.density[g] / a.density[h]) * a.omega[g] / a.omega[h]
                a.link_ends[a.links, 0], a.link_ends[a.links, 1] = g, h
                set_flow(a.link_flow[a.links], 0.0, turned, r)
                a.links += 1


@fast
def rotate_answers(a, n):
    """Returns the signal of the first `n` sounding lines, before the filters, and moves them by one frame: free motion,
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
    """Computes one frame of the sounding lines, damped by the hands that are on their strings now."""
    key = 4 * voice.idle + 2 * hands_move(voice) + voice.cut
    if a.damped_for == key:
        return
    a.damped_for = key
    for k in range(voice.answering):
        damp_answer(voice, a, k)


@jit
def damp_answer(voice, a, k):
    """`set_answer_damping` for the line at place `k`."""
    g = a.line[k]
    kept = a.rested[g] if (voice.idle >> a.string[g]) & 1 and not hands_move(voice) else a.muted[g]
    if voice.cut:
        kept = exp(-CUT_RATE / voice.rate)
    a.now_cosine[k] = kept * a.cosine[g]
    a.now_sine[k] = kept * a.sine[g]


@jit
def begin_answer(voice, a, g, q, y):
    """Lets the silent line `g` sound, from `q` and `y` on."""
    set_answer_damping(voice, a)
    k = voice.answering
    voice.answering += 1
    a.place[g] = k
    a.line[k] = g
    a.q[k] = q
    a.y[k] = y
    a.heard_q[k] = a.of_q[g]
    a.heard_y[k] = a.of_y[g]
    damp_answer(voice, a, k)


@jit
def end_answer(voice, a, k):
    """Silences the line at place `k`, which the last one takes."""
    voice.answering -= 1
    last = voice.answering
    a.place[a.line[k]] = UNKNOWN
    if k < last:
        a.place[a.line[last]] = k
        for row in (a.q, a.y, a.heard_q, a.heard_y, a.now_cosine, a.now_sine):
            row[k] = row[last]
        a.line[k] = a.line[last]
    a.q[last] = 0.0
    a.y[last] = 0.0


@jit
def silence_answers(voice, a):
    """Silences all lines."""
    while voice.answering > 0:
        end_answer(voice, a, voice.answering - 1)


@jit
def take_answers(voice, a, count, lines, q, y):
    """Lets `count` of the silent `lines` sound, in this order, from `q` and `y` on."""
    a.damped_for = UNKNOWN
    for k in range(count):
        begin_answer(voice, a, np.int64(lines[k]), q[k], y[k])


@jit
def modes_along_axes(op):
    """Number of modes whose motion along the axes is known: if these are turned, those that u and v exchange."""
    return min(op.modes, op.turned) if op.turned > 0 else op.modes


@jit
def sounding_line(slot, op, i, across):
    """omega (rad/s) and sigma (1/s) of the slot's mode `i` along axis a, or b if `across`."""
    if op.turned == 0:
        return slot.u.omega[i], slot.u.sigma[i]
    omega, sigma = along_axis(op, i, across)
    return slot.ratio * omega, sigma


@jit
def nearest_line(slot, op, across, omega):
    """The mode of the slot whose line along an axis is nearest to `omega`, and the frequency of that line (rad/s)."""
    n = modes_along_axes(op)
    i = min(max(np.int64(omega / sounding_line(slot, op, 0, across)[0]), 0), n - 1)
    own = sounding_line(slot, op, i, across)[0]
    for step in (-1, 1):
        while 0 <= i + step < n:
            beside = sounding_line(slot, op, i + step, across)[0]
            if not abs(beside - omega) < abs(own - omega):
                break
            i, own = i + step, beside
    return i, own


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
        if w == 0.0 or not (voice.idle >> a.string[g]) & 1 or (a.across[g] and op.turned == 0):
            continue
        i, own = nearest_line(slot, op, a.across[g], w)
        away = abs(own - w)
        root = -np.sqrt(gamma * a.stiffness[g])
        real, imaginary = root * admittance[2 * g], root * admittance[2 * g + 1]
        size = np.sqrt(real * real + imaginary * imaginary)
        if away > NEAR or size < WEAK * away or size == 0.0:
            continue
        minimum = min(1.0, MAX_FLOW / (size * time))
        a.pair_answer[n] = g
        a.pair_mode[n] = i
        a.pair_effect[n] = size / (away + a.sigma[g])
        a.pair_real[n] = real * minimum
        a.pair_imaginary[n] = imaginary * minimum
        n += 1
    for p in range(n):
        g = a.pair_answer[p]
        sigma, x = sounding_line(slot, op, a.pair_mode[p], a.across[g])[1], a.pair_real[p]
        a.pair_share[p] = x * x / max(sigma * a.sigma[g], 1e-300)
    for p in range(n):
        taken = 0.0
        for other in range(n):
            same = a.pair_mode[other] == a.pair_mode[p] and a.across[a.pair_answer[other]] == a.across[a.pair_answer[p]]
            if same and (a.pair_effect[other], p) > (a.pair_effect[p], other):
                taken += a.pair_share[other]
        left = max(MARGIN * MARGIN - taken, 0.0)
        a.pair_allowed[p] = np.sqrt(min(1.0, left / max(a.pair_share[p], 1e-300)))
    for p in range(n):
        g, i = a.pair_answer[p], a.pair_mode[p]
        r = np.sqrt(linear_density(op) / a.density[g]) * u.omega[i] / a.omega[g]
        set_flow(a.flow[p], a.pair_allowed[p] * a.pair_real[p] * time, a.pair_imaginary[p] * time, r)
        scale = u.kappa[i] * u.omega[i]
        a.flow[p, 6] = scale
        a.flow[p, 7] = 1.0 / scale
        if op.turned > 0:
            set_turn(a.flow[p], slot, op, i, a.across[g])
    a.pairs = n


@jit
def set_turn(flow, slot, op, i, across):
    """Sets a pair's `flow` between mode `i` of v and the line, in units of u's amplitude."""
    u, v = slot.u, slot.v
    of_u, of_v = direction(op, across)
    scale, ratio = v.kappa[i] * v.omega[i], v.omega[i] / u.omega[i]
    flow[8] = scale
    flow[9] = 1.0 / scale
    flow[10] = of_u
    flow[11] = of_v * ratio
    flow[12] = of_v / ratio


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
def exchange(string, slot, op, step, first, frames):
    """Exchanges energy in the pairs due in `frames` from `first` on, after the slot has moved to fine step `step`.

    A note that hands are ending no longer exchanges energy: answers must not keep its string awake.
    """
    pressed = op.turned > 0 and (slot.owed > 0 or slot.thumb.on == THERE)  # as in turning.py
    if slot.moving or slot.hand < 1.0 or slot.active == 0 or pressed or is_touching(slot, op, step):
        return
    voice, a = string.voice, string.answers
    if slot.fret != voice.answered_fret:
        voice.answered_fret = slot.fret
        if voice.answering:
            voice.hands_until = voice.frame + round(MOVING * voice.rate)
    find_pairs(string, slot, op)
    for frame in range(first, first + frames):
        for p in range((frame - voice.begun) % EVERY, a.pairs, EVERY):
            exchange_pair(voice, a, slot, op, p)


@jit
def exchange_pair(voice, a, slot, op, p):
    """Exchanges energy in pair `p`."""
    u, g, i = slot.u, a.pair_answer[p], a.pair_mode[p]
    flow = a.flow[p]
    own_q, own_p = modal.state_of(u, i)
    q, y = own_q, -flow[7] * own_p
    q_v = p_v = 0.0
    if op.turned > 0:
        q_v, p_v = modal.state_of(slot.v, i)
        q, y = flow[10] * q + flow[11] * q_v, flow[10] * y - flow[11] * flow[9] * p_v
    k = a.place[g]
    x, z = (a.q[k], -a.y[k]) if k != UNKNOWN else (0.0, 0.0)
    q_after, y_after, x, z = exchanged(flow, q, y, x, z)
    gained_q, gained_y = q_after - q, y_after - y
    if not put_answer(voice, a, g, x, z):
        return
    slot.active = max(slot.active, (i + BLOCK) // BLOCK * BLOCK)
    if op.turned == 0:
        modal.set_state(u, i, q_after, -flow[6] * y_after)
        return
    modal.set_state(u, i, own_q + flow[10] * gained_q, own_p - flow[6] * flow[10] * gained_y)
    modal.set_state(slot.v, i, q_v + flow[12] * gained_q, p_v - flow[8] * flow[12] * gained_y)
    slot.v_active = max(slot.v_active, slot.active)


@jit
def pass_on(string, first, frames):
    """Passes answers on in the links due in `frames` from `first` on."""
    voice, a = string.voice, string.answers
    for frame in range(first, first + frames):
        for p in range((frame - voice.begun) % EVERY, a.links, EVERY):
            pass_on_by(voice, a, p)


@jit
def pass_on_by(voice, a, p):
    """Passes answers on in link `p`."""
    g, h = a.link_ends[p, 0], a.link_ends[p, 1]
    k, m = a.place[g], a.place[h]
    idle = (voice.idle >> a.string[g]) & (voice.idle >> a.string[h]) & 1
    if not idle or (k == UNKNOWN and m == UNKNOWN):
        return
    q, y = (a.q[k], -a.y[k]) if k != UNKNOWN else (np.float32(0.0), np.float32(0.0))
    x, z = (a.q[m], -a.y[m]) if m != UNKNOWN else (np.float32(0.0), np.float32(0.0))
    q_after, y_after, x_after, z_after = exchanged(a.link_flow[p], q, y, x, z)
    put_answer(voice, a, g, q_after, y_after)
    put_answer(voice, a, h, x_after, z_after)


@jit
def exchanged(flow, q, y, x, z):
    """q - i y of one line and x - i z of another after an exchange; both are given and returned with y and z turned."""
    q_after = flow[0] * q - flow[1] * y + flow[4] * x - flow[5] * z
    y_after = flow[0] * y + flow[1] * q + flow[4] * z + flow[5] * x
    x_after = flow[0] * x - flow[1] * z + flow[2] * q - flow[3] * y
    z_after = flow[0] * z + flow[1] * x + flow[2] * y + flow[3] * q
    return q_after, y_after, x_after, z_after


@jit
def put_answer(voice, a, g, x, z):
    """Sets the motion of a line, as `exchanged` returns it; returns False for a silent one that stays DEAD."""
    k = a.place[g]
    if k != UNKNOWN:
        a.q[k], a.y[k] = x, -z
        return True
    if x * x + z * z > DEAD * DEAD:
        begin_answer(voice, a, g, x, -z)
        return True
    return False


@jit
def next_answer(string):
    """Returns the answers' signal in this frame and moves them to the next; while any sound."""
    voice, a = string.voice, string.answers
    set_answer_damping(voice, a)
    return rotate_answers(a, (voice.answering + BLOCK - 1) // BLOCK * BLOCK)


@apart
def excite_answers(string, ops, step, frame, frames):
    """Exchanges energy with the answers before `frame`, after the string has moved to fine step `step`.

    Only while strings are idle. A string that sounds does so after a quartet or a long run, for all its `frames`; 0:
    none ends.
    """
    voice, a = string.voice, string.answers
    slot = string.slots[voice.slot]
    if not slot.on:
        frames = 1
    elif a.count > 0 and not voice.cut and frames > 0:
        exchange(string, slot, ops[slot.fret], step, frame - frames, frames)
    if voice.answering and frames > 0:
        pass_on(string, frame - frames, frames)


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
        g = a.line[k]
        back = a.density[g] / a.own_density * square
        speed += a.omega[g] * a.omega[g] * back
        amplitude += np.sqrt(back)
    for k in range(2):
        string.slots[k].answer_speed = speed
        string.slots[k].answer_sum = amplitude
