"""A valve stage: a triode between two half-band filters, at twice the audio rate, followed by a tone stack.

The triode is half a 12AX7 with a load of 100 kohm at 250 V, by Koren's law (Koren 1996, "Improved vacuum-tube models
for SPICE"); its grid draws current through 68 kohm when positive. So one half of a wave clips gradually, the other
sooner. Together this is one curve, computed beforehand. The filters are two branches of allpasses each (Valenzuela and
Constantinides 1983): -99 dB from 0.54 of the audio rate on, and flat below 0.46. The tone stack is the passive circuit
of a '59 Bassman (Yeh and Smith 2006) with its knobs at LOW, MIDDLE and HIGH, discretised by the bilinear transform; it
blocks direct current. With the knob at 0 the sound is unchanged, bit for bit.

Beside a clean sound, the valve runs at FINE times the audio rate. The clean sound goes through the same filters up and
down, so that both arrive in phase. Without a clean part the stage at twice the rate plays, as in older projects.
[audio thread]
"""

import math

import numpy as np

from livebass.compiling import jit
from livebass.kernels.effects.compressor import FOLLOWS, follow_knob
from livebass.kernels.effects.records import ALLPASSES, CLEAN_BLEND, CURVE, DOUBLINGS, FINE
from livebass.kernels.machine.elementary import exp, log2, power

# --- the triode ---
MU, EXPONENT, KG1, KP, KVB = 100.0, 1.4, 1060.0, 600.0, 300.0  # of Koren's law, for a 12AX7
SUPPLY, LOAD = 250.0, 100e3  # V, ohm
BIAS = -1.3  # V at the grid, at rest
GRID, CONDUCTING, SOFT = 68e3, 2e3, 0.15  # ohm before the grid, ohm of the grid above 0 V, V over which it sets in
FARTHEST = 16.0  # V at the grid, to either side, that the curve covers
NEAR, STEPS = 1e-9, 60  # V, precision of a plate voltage; maximum number of steps
GAIN = 60.0  # of the triode, about: compensated afterwards
LN_2 = 0.6931471805599453
# --- the knob ---
CLEAN, DRIVEN = 0.35, 16.0  # V at the grid for full scale, with the knob near 0 and at 1
LOUDER = 0.4  # power of the knob's gain that remains after the valve
# --- the half-band filters: allpass coefficients, alternating between the two branches ---
BRANCHES = (
    0.04063346092419326, 0.1505051290226746, 0.3007570559918741, 0.4607745049614506,
    0.6095243148961883, 0.7385038411188573, 0.8492238103920661, 0.9497427837050002,
)  # fmt: skip
# Those of the next doublings, where only an ever smaller part of the band is in use: -110 dB from 0.365 of the doubled
# rate on, then -90 dB from 0.4325
SECOND_BRANCHES = (0.04494128238611239, 0.17882472325997537, 0.4053376861137386, 0.7535321475706449)
LAST_BRANCHES = (0.11370170771559016, 0.5430325159621627)
# --- the tone stack ---
R1, R2, R3, R4 = 250e3, 1e6, 25e3, 56e3  # ohm
C1, C2, C3 = 250e-12, 20e-9, 20e-9  # F
LOW, MIDDLE, HIGH = 0.3, 0.6, 0.5  # knobs
UNITY = 100.0  # Hz, where the stage leaves the level unchanged


def tone_stack() -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The tone stack's numerator and denominator in ascending powers of s, with the gain 1 at UNITY."""
    low, mid, high = LOW, MIDDLE, HIGH
    c12, c13, c23, c123 = C1 * C2, C1 * C3, C2 * C3, C1 * C2 * C3
    both = c13 + c23
    b1 = high * C1 * R1 + mid * C3 * R3 + low * (C1 + C2) * R2 + (C1 + C2) * R3
    b2 = (
        high * R1 * R4 * (c12 + c13)
        - mid * mid * R3 * R3 * both
        + mid * (c13 * R1 * R3 + R3 * R3 * both)
        + low * (c12 * R1 * R2 + c12 * R2 * R4 + c13 * R2 * R4)
        + low * mid * R2 * R3 * both
        + (c12 * R1 * R3 + c12 * R3 * R4 + c13 * R3 * R4)
    )
    b3 = c123 * (
        low * mid * R2 * R3 * (R1 + R4)
        - mid * mid * R3 * R3 * (R1 + R4)
        + mid * R3 * R3 * (R1 + R4)
        + high * R1 * R3 * R4 * (1.0 - mid)
        + high * low * R1 * R2 * R4
    )
    a1 = C1 * (R1 + R3) + C2 * (R3 + R4) + C3 * R4 + mid * C3 * R3 + low * (C1 + C2) * R2
    a2 = (
        mid * (c13 * R1 * R3 - c23 * R3 * R4 + R3 * R3 * both)
        + low * mid * R2 * R3 * both
        - mid * mid * R3 * R3 * both
        + low * (c12 * R2 * R4 + c12 * R1 * R2 + c13 * R2 * R4 + c23 * R2 * R4)
        + c12 * R1 * R4 + c13 * R1 * R4 + c12 * R3 * R4 + c12 * R1 * R3 + c13 * R3 * R4 + c23 * R3 * R4
    )  # fmt: skip
    a3 = c123 * (
        low * mid * R2 * R3 * (R1 + R4)
        - mid * mid * R3 * R3 * (R1 + R4)
        + mid * (R3 * R3 * (R1 + R4) - R1 * R3 * R4)
        + low * R1 * R2 * R4
        + R1 * R3 * R4
    )
    w = 2.0 * math.pi * UNITY
    top = (b1 * w - b3 * (w * w * w)) ** 2 + (b2 * (w * w)) ** 2
    under = (a1 * w - a3 * (w * w * w)) ** 2 + (1.0 - a2 * (w * w)) ** 2
    gain = math.sqrt(under / top)
    return (0.0, gain * b1, gain * b2, gain * b3), (1.0, a1, a2, a3)


STACK_B, STACK_A = tone_stack()


@jit
def soft_plus(x):
    """ln(1 + e^x), without overflow."""
    return max(x, 0.0) + LN_2 * log2(1.0 + exp(-abs(x)))


@jit
def plate_current(plate, grid):
    """Koren's law: the current (A) for given plate and grid voltages."""
    inner = KP * (1.0 / MU + grid / np.sqrt(KVB + plate * plate))
    drawn = plate / KP * soft_plus(inner)
    return 2.0 * power(drawn, EXPONENT) / KG1 if drawn > 0.0 else 0.0


@jit
def plate_voltage(volts, high):
    """The plate voltage for `volts` before the grid resistor, at most `high`, by the Illinois method."""
    grid = volts - GRID / (GRID + CONDUCTING) * SOFT * soft_plus(volts / SOFT)
    low, below = 0.0, -SUPPLY
    above = high + LOAD * plate_current(high, grid) - SUPPLY
    last = 0
    for _ in range(STEPS):
        if above <= 0.0 or high - low < NEAR:
            break
        v = high - above * (high - low) / (above - below)
        excess = v + LOAD * plate_current(v, grid) - SUPPLY
        if excess > 0.0:
            below = 0.5 * below if last > 0 else below
            high, above, last = v, excess, 1
        else:
            above = 0.5 * above if last < 0 else above
            low, below, last = v, excess, -1
        if abs(excess) < NEAR:
            return v
    return high


@jit
def fill_valve(e):
    """Computes the curve and the tone stack of an EFFECTS. [not the playing thread]"""
    plate = SUPPLY
    for k in range(CURVE):
        plate = plate_voltage(BIAS + FARTHEST * (2.0 * k / (CURVE - 1) - 1.0), plate + NEAR)
        e.curve[k] = plate
    rest = e.curve[CURVE // 2]
    for k in range(CURVE):
        e.curve[k] = rest - e.curve[k]
    c = 2.0 * e.rate
    e.tone_b[:] = 0.0
    e.tone_a[:] = 0.0
    add_term(e, 0, 1.0, 1.0, 3.0, 3.0, 1.0)
    add_term(e, 1, c, 1.0, 1.0, -1.0, -1.0)
    add_term(e, 2, c * c, 1.0, -1.0, -1.0, 1.0)
    add_term(e, 3, c * c * c, 1.0, -3.0, 3.0, -1.0)
    first = e.tone_a[0]
    for k in range(4):
        e.tone_b[k] /= first
        e.tone_a[k] /= first


@jit
def add_term(e, power_of_s, factor, z0, z1, z2, z3):
    """Adds the transform of a power of s, times (1 + 1/z)^3: `factor` times the polynomial in 1/z."""
    b, a = STACK_B[power_of_s] * factor, STACK_A[power_of_s] * factor
    e.tone_b[0] += b * z0
    e.tone_b[1] += b * z1
    e.tone_b[2] += b * z2
    e.tone_b[3] += b * z3
    e.tone_a[0] += a * z0
    e.tone_a[1] += a * z1
    e.tone_a[2] += a * z2
    e.tone_a[3] += a * z3


@jit
def set_drive(e, drive):
    """Sets the drive of an EFFECTS, 0 to 1."""
    e.drive = drive
    more = power(DRIVEN / CLEAN, drive)
    e.volts = CLEAN * more
    e.level = power(more, LOUDER) / (GAIN * e.volts)


@jit
def triode(curve, volts):
    """The curve at `volts`, interpolated by Catmull and Rom's cubic."""
    where = min(max((volts + FARTHEST) / (2.0 * FARTHEST) * (CURVE - 1), 1.0), CURVE - 3.0)
    k = np.int64(where)
    t = where - k
    p, q, r, s = curve[k - 1], curve[k], curve[k + 1], curve[k + 2]
    slope, next_slope = 0.5 * (r - p), 0.5 * (s - q)
    rise = r - q
    return q + t * (slope + t * ((3.0 * rise - 2.0 * slope - next_slope) + t * (slope + next_slope - 2.0 * rise)))


@jit
def branch(states, first, x):
    """Sends the next sample `x` through every second allpass from `first` on; returns the output."""
    for k in range(first, ALLPASSES, 2):
        y = states[k, 0] + BRANCHES[k] * (x - states[k, 1])
        states[k, 0] = x
        states[k, 1] = y
        x = y
    return x


@jit
def branch_at(states, doubling, first, x):
    """As `branch`, by the filters of a doubling of the rate: 0 is the first."""
    of = states[doubling]
    if doubling == 0:
        return branch(of, first, x)
    count = len(SECOND_BRANCHES) if doubling == 1 else len(LAST_BRANCHES)
    for k in range(first, count, 2):
        coefficient = SECOND_BRANCHES[k] if doubling == 1 else LAST_BRANCHES[k]
        y = of[k, 0] + coefficient * (x - of[k, 1])
        of[k, 0] = x
        of[k, 1] = y
        x = y
    return x


@jit
def stack_tone(e, state, y):
    """Sends the next sample through the tone stack, whose state is (3,)."""
    out = e.tone_b[0] * y + state[0]
    state[0] = e.tone_b[1] * y - e.tone_a[1] * out + state[1]
    state[1] = e.tone_b[2] * y - e.tone_a[2] * out + state[2]
    state[2] = e.tone_b[3] * y - e.tone_a[3] * out
    return out


@jit
def blend_valve(e, x):
    """The next sample of the valve beside the clean sound."""
    driven, clean = e.points[0], e.points[1]
    driven[0] = x
    count = 1
    for doubling in range(DOUBLINGS):
        for i in range(count):
            clean[i] = driven[i]
        for i in range(count):
            driven[2 * i] = branch_at(e.fine_up, doubling, 0, clean[i])
            driven[2 * i + 1] = branch_at(e.fine_up, doubling, 1, clean[i])
        count *= 2
    for i in range(FINE):
        clean[i] = driven[i]
        driven[i] = triode(e.curve, e.volts * clean[i])
    for doubling in range(DOUBLINGS - 1, -1, -1):
        count //= 2
        for i in range(count):
            even, odd = driven[2 * i], driven[2 * i + 1]
            y = branch_at(e.fine_down, doubling, 0, odd) + branch_at(e.fine_down, doubling, 1, even)
            driven[i] = 0.5 * y
            even, odd = clean[2 * i], clean[2 * i + 1]
            y = branch_at(e.clean_down, doubling, 0, odd) + branch_at(e.clean_down, doubling, 1, even)
            clean[i] = 0.5 * y
    return e.clean * clean[0] + (1.0 - e.clean) * stack_tone(e, e.fine_tone, e.level * driven[0])


@jit
def wanted_clean(e, j):
    """The part of the clean sound that frame j goes to."""
    return e.requested[CLEAN_BLEND, j] if e.requested[CLEAN_BLEND, j] > 0.0 else e.own_clean


@jit
def begin_valve(e, drive):
    """Sets the knobs to the first frame's values immediately."""
    if drive > 0.0:
        set_drive(e, drive)
        e.wet = 1.0
        e.clean = wanted_clean(e, 0)
        e.fine = 1.0 if e.clean > 0.0 else 0.0


@jit
def drive_valve(e, requested, n):
    """Sends n frames of an EFFECTS' sound through the valve stage; `requested` (n,) as for the compressor."""
    step = 1.0 - exp(-1.0 / (FOLLOWS * e.rate))
    for j in range(n):
        wanted, clean = requested[j] if requested[j] > 0.0 else e.own_drive, wanted_clean(e, j)
        share, fine = 1.0 if wanted > 0.0 else 0.0, 1.0 if clean > 0.0 else 0.0
        if wanted > 0.0 and e.wet == 0.0:
            set_drive(e, wanted)
            e.clean = clean
            e.fine = fine
        if e.wet != share:
            e.wet = follow_knob(e.wet, share, step)
            if e.wet == 0.0:
                silence_valve(e)
        if e.wet == 0.0:
            continue
        if wanted > 0.0 and e.drive != wanted:
            set_drive(e, follow_knob(e.drive, wanted, step))
        if e.clean != clean:
            e.clean = follow_knob(e.clean, clean, step)
        if e.fine != fine:
            e.fine = follow_knob(e.fine, fine, step)
            if e.fine == 0.0:
                silence_blend(e)
            elif e.fine == 1.0:
                silence_plain_valve(e)
        x = e.sound[j]
        out = 0.0
        if e.fine < 1.0:
            even = triode(e.curve, e.volts * branch(e.up, 0, x))
            odd = triode(e.curve, e.volts * branch(e.up, 1, x))
            y = 0.5 * e.level * (branch(e.down, 0, odd) + branch(e.down, 1, even))
            out = stack_tone(e, e.tone, y)
        if e.fine > 0.0:
            out += e.fine * (blend_valve(e, x) - out)
            e.amp[j] = 1.0
        e.sound[j] = out if e.wet == 1.0 else x + e.wet * (out - x)
        e.heard[j] = 1.0


@jit
def silence_valve(e):
    """Resets the valve stage."""
    silence_plain_valve(e)
    silence_blend(e)


@jit
def silence_plain_valve(e):
    """Resets the valve without a clean part."""
    e.up[:] = 0.0
    e.down[:] = 0.0
    e.tone[:] = 0.0


@jit
def silence_blend(e):
    """Resets the valve beside a clean sound."""
    e.fine_up[:] = 0.0
    e.fine_down[:] = 0.0
    e.clean_down[:] = 0.0
    e.fine_tone[:] = 0.0
