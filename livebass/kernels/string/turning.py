"""u and v exchange energy: the directions in which neck and saddle give way are not those of the frets.

With axes turned by theta (law.py), the modes q of u and r of v with the same number obey

    q'' + 2 sigma_u q' + omega_u^2 q + k r + 2 d r' = 0,   r'' + 2 sigma_v r' + omega_v^2 r + k q + 2 d q' = 0,
    k = s c (omega_a^2 - omega_b^2),   d = s c (sigma_a - sigma_b).

Stiffness on the diagonal is in the operators of u and v. The rest is slow: omega_a and omega_b differ by a thousandth.
So the parts that turn against the motion cancel, and what remains couples the amplitudes A = q - i (q' + sigma q) /
omega alone:

    A_u' = -sigma_u A_u + (i e - d) A_v,   A_v' = -sigma_v A_v + (i e - d) A_u,   e = k / (2 sqrt(omega_u omega_v)),

with relative errors of k / (4 omega^2). The operators of both have the least damping, that of one axis; Delta, the
damping matrix less that, takes energy or none. After every QUARTET of frames a pair advances by its exact flow:

    exp(t [[-Delta_u, g], [g, -Delta_v]]) = exp(-m t) (cosh z + sinh z / (z / t) [[-h, g], [g, h]]),   g = i e - d,
    m = (Delta_u + Delta_v) / 2,   h = (Delta_u - Delta_v) / 2,   z^2 = (h^2 + g^2) t^2,

for W = kappa omega q - i P, whose square is the energy that eq. 12 conserves (modal.py). So |W_u|^2 + |W_v|^2 never
rises, and without losses it is constant.

The exchange moves the string by nanometres. While it presses on an obstacle or on the thumb that would put in energy,
so exchanges wait; they are made up for, two a frame, as soon as the string is clear. `slot` is a SLOT, `op` its
OPERATOR, `voice` its string's VOICE. [audio thread]
"""

import numpy as np

from livebass.compiling import apart, jit
from livebass.kernels.machine.elementary import exp
from livebass.kernels.string import modal
from livebass.kernels.string.frame import invalidate_contact, is_touching
from livebass.kernels.string.operators import OMEGA, SIGMA, coefficient_at, exchange_row
from livebass.kernels.string.records import LONG_RUN, QUARTET, THERE
from livebass.rows.parts import EXCHANGES_AT_ONCE, MAX_OWED

# What exchanges pass on at once sounds as tones 11 dB fainter: 3 kHz beside the partials after long runs, 12 kHz after
# quartets. Before a long run it must be inaudible, 66 dB below the motion, or 48, and masked, 18 dB below the partials
# above HIGHS, Hz
INAUDIBLE, FAINT, MASKED, HIGHS = 5e-4, 4e-3, 0.125, 1500.0


@jit
def duration(voice, op):
    """Time (s) between two exchanges."""
    return QUARTET * op.fine * voice.numerator / voice.denominator


@jit
def along_axis(op, j, across):
    """omega (rad/s) and sigma (1/s) of mode `j` along axis a, or b if `across`, from u, v and their exchange.

    With D = omega_a^2 - omega_b^2, u and v differ by cos(2 theta) D, and k is half of sin(2 theta) D; so does sigma.
    """
    omega, sigma = coefficient_at(op.coefficients, op, OMEGA)[j], coefficient_at(op.coefficients, op, SIGMA)[j]
    if op.turned == 0:
        return omega, sigma
    cosine, sine = op.axes[0], op.axes[1]
    cosine_2, sine_2 = cosine * cosine - sine * sine, 2.0 * sine * cosine
    other = coefficient_at(op.coefficients_v, op, OMEGA)[j]
    k = 2.0 * exchange_row(op, 0)[j] * np.sqrt(omega * other)
    of_u, of_v, between = exchange_row(op, 1)[j], exchange_row(op, 2)[j], exchange_row(op, 3)[j]
    square = 0.5 * (cosine_2 * (omega * omega - other * other) + 2.0 * sine_2 * k)
    more = 0.5 * (cosine_2 * (of_u - of_v) + 2.0 * sine_2 * between)
    if across:
        square, more = -square, -more
    own = sigma + 0.5 * (of_u + of_v) + more
    natural = 0.5 * (omega * omega + other * other) + sigma * sigma + square
    return np.sqrt(natural - own * own), own


@jit
def set_flow(voice, slot, op):
    """Computes the flow of an exchange, unless it is up to date."""
    key = slot.flow_key
    if key[0] == op.turning and key[1] == op.length and key[2] == slot.ratio and key[3] == op.fine:
        return
    key[0], key[1], key[2], key[3] = op.turning, op.length, slot.ratio, op.fine
    time = duration(voice, op)
    fill_flow(slot, op, slot.flow, time)
    fill_flow(slot, op, slot.long_flow, LONG_RUN // QUARTET * time)
    for j in range(op.turned):
        scale_u, scale_v = slot.u.kappa[j] * slot.u.omega[j], slot.v.kappa[j] * slot.v.omega[j]
        slot.flow_scale[0, j] = scale_u
        slot.flow_scale[1, j] = scale_v
        slot.flow_scale[2, j] = 1.0 / scale_u
        slot.flow_scale[3, j] = 1.0 / scale_v


@jit
def fill_flow(slot, op, flow, time):
    """Fills the rows of `flow` for a `time` (s)."""
    rate, of_u, of_v, across = (exchange_row(op, 0), exchange_row(op, 1), exchange_row(op, 2), exchange_row(op, 3))
    for j in range(op.turned):
        e, d = rate[j] * slot.ratio * time, across[j] * time
        h = 0.5 * (of_u[j] - of_v[j]) * time
        square = h * h + d * d - e * e, -2.0 * e * d
        kept = times(exp(-0.5 * (of_u[j] + of_v[j]) * time), series(square, 2.0, 12.0, 30.0))
        part = times(exp(-0.5 * (of_u[j] + of_v[j]) * time), series(square, 6.0, 20.0, 42.0))
        flow[0, j] = kept[0] - h * part[0]
        flow[1, j] = kept[1] - h * part[1]
        flow[2, j] = kept[0] + h * part[0]
        flow[3, j] = kept[1] + h * part[1]
        flow[4, j] = -d * part[0] - e * part[1]
        flow[5, j] = e * part[0] - d * part[1]


@jit
def times(factor, z):
    """A complex number times a real one."""
    return factor * z[0], factor * z[1]


@jit
def series(z, a, b, c):
    """1 + z/a (1 + z/b (1 + z/c)) of a complex `z`: cosh and sinh of its root, over it, to 1e-16 for |z| < 1e-4."""
    x, y = 1.0 + z[0] / c, z[1] / c
    x, y = 1.0 + (x * z[0] - y * z[1]) / b, (x * z[1] + y * z[0]) / b
    return 1.0 + (x * z[0] - y * z[1]) / a, (x * z[1] + y * z[0]) / a


@jit
def count_frame(slot):
    """Counts a frame in which the slot has moved; True if it ends a quartet."""
    if slot.active == 0 and slot.v_active == 0:  # a finger may hold the string: quartets count from its release
        slot.fourth = 0
        slot.owed = 0
        return False
    slot.fourth = (slot.fourth + 1) % QUARTET
    return slot.fourth == 0


@apart
def exchange(voice, slot, op, step, due):
    """Exchanges energy between u and v if it is `due`, or owed, after the slot has moved to fine step `step`."""
    n = min(max(slot.active, slot.v_active), op.turned)
    if due:
        slot.owed = min(slot.owed + 1, MAX_OWED)
    if slot.owed == 0 or slot.thumb.on == THERE or is_touching(slot, op, step):
        return
    set_flow(voice, slot, op)
    times = min(slot.owed, EXCHANGES_AT_ONCE)
    for _ in range(times):
        modal.exchange(slot.u, slot.v, slot.flow, slot.flow_scale, n)
    slot.owed -= times
    slot.active = max(slot.active, n)
    slot.v_active = max(slot.v_active, n)
    if slot.due <= step:  # points solved in this frame have moved
        invalidate_contact(slot.u, op)
        invalidate_contact(slot.v, op)


@jit
def is_gentle(voice, slot, op):
    """True if what an exchange after a long run passes on would be inaudible."""
    if op.turned == 0:
        return True
    set_flow(voice, slot, op)
    first = np.int64(2.0 * HIGHS * op.length / op.speed)
    passed, size, highs = modal.speed_square_passed(slot.u, slot.v, slot.long_flow, op.turned, first)
    if passed <= INAUDIBLE * INAUDIBLE * size:
        return True
    return passed <= FAINT * FAINT * size and passed <= MASKED * MASKED * highs


@apart
def exchange_after_long_run(voice, slot, op):
    """Exchanges energy between u and v for all frames of a long run, in which the string was free."""
    n = min(max(slot.active, slot.v_active), op.turned)
    set_flow(voice, slot, op)
    modal.exchange(slot.u, slot.v, slot.long_flow, slot.flow_scale, n)
    slot.active = max(slot.active, n)
    slot.v_active = max(slot.v_active, n)


@jit
def exchanges_within(slot, frames):
    """The most exchanges that `frames` frames can bring."""
    return slot.owed + frames // QUARTET + 1


@jit
def rms_velocity_soon(voice, slot, op, frames):
    """Bounds u's root mean square velocity (m/s) within `frames` frames, as `slot.rms_velocity_with_answers` does."""
    set_flow(voice, slot, op)
    square = modal.speed_square(slot.u, slot.active) + slot.answer_speed
    square += modal.speed_square_to_come(slot.u, slot.v, slot.flow, exchanges_within(slot, frames), op.turned)
    return np.sqrt(square / op.length)


@jit
def amplitude_soon(voice, slot, op, frames):
    """Bounds what v adds to u's sum of modal amplitudes (m^1.5) within `frames` frames."""
    set_flow(voice, slot, op)
    return modal.amplitude_to_come(slot.v, slot.flow, exchanges_within(slot, frames), op.turned)
