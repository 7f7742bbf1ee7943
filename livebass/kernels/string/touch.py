"""Fingers and palm on a string: dashpots, passive at any strength.

A finger of resistance R presses hardest in its middle, at x: its resistance is spread along the string as a Gaussian of
standard deviation a. For waves longer than the finger, three dashpots do the same (Gauss-Hermite quadrature): 2/3 of R
at x and 1/6 each at x - sqrt(3) a and x + sqrt(3) a.

A dashpot takes momentum from the string at its place. With the modes' velocities v_j and s_j = phi_j there, the
implicit midpoint rule over a time h is v <- v - c (s v) s, c = r / (1 + r |s|^2 / 2), r = R h / mu: in steady motion
its force is R times the average velocity, however much the string gives back within a frame. It acts once per frame,
after the string has moved, and never reverses the velocity there: c |s|^2 is at most 1, so kinetic energy only falls.
It acts on P, with s_j kappa_j / dt in place of s_j, so the energy that eq. 12 conserves falls for any R
(modal.invariant). A finger's dashpots act one after another; products of their shapes give the momentum that each
leaves to the next, so two passes over the modes serve all three. A resting finger skips the modes that have died under
it (modal.drop_dead_modes); |s|^2 is that of the others.

Modes above HIGHEST turn too far within a frame, and waves shorter than the finger are too short for three dashpots.
Waves that lie wholly on the finger lose exp(-R h / (2 mu L)) per frame.

Once they lie still, fingers on a note that has ended only let it die. There a finger is one dashpot, after each quartet
of frames, h, on the velocity averaged under its pressure: s_j is phi_j at x, times exp(-(k a)^2 / 2), up to
HIGHEST_ENDED. What this average misses of a wave is lost at once: amplitudes fall to 1 / (1 + R h (1 - exp(-(k a)^2)) /
(2 mu L)). Both are passive at any R. Qualities with float64 modes alone have the three dashpots everywhere.

A finger lands and lifts by a ramp of R. Places are from the saddle, so they survive fret changes. `slot` is a SLOT,
`op` its operator. [audio thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import apart, jit
from livebass.kernels.machine.elementary import exp, sin
from livebass.kernels.string import modal, quartet
from livebass.kernels.string.operators import KAPPA, coefficient, is_exact
from livebass.kernels.string.records import BLOCK, DASHPOTS, QUARTET, TOUCHES
from livebass.kernels.string.slot import SAFETY_STRUCK, wake_slot

NARROWEST, HIGHEST = 4.5, 8e3  # of k a; Hz: limits of the modes that dashpots move ...
HIGHEST_ENDED = 2e3  # ... and on an ended note
ASIDE, PART = (0.0, np.sqrt(3.0), -np.sqrt(3.0)), (2 / 3, 1 / 6, 1 / 6)  # the dashpots' places, of a; strengths, of R
LANDING, LIFTING = 5e-3, 15e-3  # s
STAYS = -1  # instead of the frames until a finger lifts


@jit
def begin_touch(voice, i, place, resistance, width, seconds, landing):
    """Lays finger `i` on the string at `place` (m from the saddle); it lifts after `seconds`, 0: it stays.

    `resistance` is in N s/m, the half `width` in m, `landing` in s. With no resistance the finger lifts now, within
    `seconds`, 0: LIFTING.
    """
    t = voice.touches[i]
    if resistance <= 0.0:
        lift_touch(voice, i, seconds if seconds > 0.0 else LIFTING)
        return
    if place != t.place or width != t.width:
        t.resistance = 0.0  # another place: it lands again
    t.place = place
    t.width = width
    t.wanted = resistance
    t.ramp = resistance / max(landing * voice.rate, 1.0)
    t.lifts = max(np.int64(np.rint(seconds * voice.rate)), 1) if seconds > 0.0 else STAYS


@jit
def ramp_touch(voice, i, resistance, seconds):
    """Sets the `resistance` of finger `i`, and ramps it to the wanted value in `seconds`."""
    t = voice.touches[i]
    t.resistance = resistance
    t.ramp = abs(resistance - t.wanted) / max(seconds * voice.rate, 1.0)


@jit
def clear_touches(voice):
    """Takes all fingers away from a string at rest."""
    for i in range(TOUCHES):
        t = voice.touches[i]
        t.resistance = 0.0
        t.wanted = 0.0
        t.lifts = STAYS


@jit
def lift_touch(voice, i, seconds):
    """Lifts finger `i` within `seconds`."""
    t = voice.touches[i]
    t.wanted = 0.0
    t.lifts = STAYS
    t.ramp = t.resistance / max(seconds * voice.rate, 1.0)


@jit
def lift_touches(voice, seconds):
    """Lifts all fingers within `seconds`."""
    for i in range(TOUCHES):
        lift_touch(voice, i, seconds)


@jit
def note_landing(voice, slot, op):
    """Widens the slot's safety factor: landing fingers may leave a pulse more peaked than a pluck."""
    slot.safety = SAFETY_STRUCK
    wake_slot(slot, op, voice.step)


@jit
def follow_ramp(t, rate):
    """Ramps the resistance of a finger by one frame."""
    if t.lifts > 0:
        t.lifts -= 1
        if t.lifts == 0:
            t.ramp = t.resistance / max(LIFTING * rate, 1.0)
            t.wanted = 0.0
            t.lifts = STAYS
    if t.resistance < t.wanted:
        t.resistance = min(t.resistance + t.ramp, t.wanted)
    elif t.resistance > t.wanted:
        t.resistance = max(t.resistance - t.ramp, t.wanted)


@jit
def are_settled(voice):
    """True if no finger lands, lifts, or will lift by itself."""
    for i in range(TOUCHES):
        t = voice.touches[i]
        if t.resistance != t.wanted or t.lifts > 0:
            return False
    return True


@jit
def dashpot(t, d):
    """Place (m from the saddle) and resistance (N s/m) of dashpot `d` of a finger."""
    return t.place + ASIDE[d] * t.width, PART[d] * t.resistance


@jit
def modes_under(op, width, highest):
    """Number of modes, in whole BLOCKs, to `highest` (Hz), that dashpots of a finger of half width `width` (m) move."""
    maximum = min(NARROWEST / max(width, 1e-4), 2 * np.pi * highest / op.speed)
    n = np.int64(maximum * op.length / np.pi) + 1
    return min((n + BLOCK - 1) // BLOCK * BLOCK, op.padded)


@jit
def is_placed(slot, op, i, t, ended):
    """True if the shapes of finger `i` are up to date, as those of an `ended` note, 1, or not, 0; it sets their key."""
    key = slot.touch_key[i]
    if key[0] == t.place and key[1] == t.width and key[2] == op.coefficients and key[3] == ended:
        return True
    key[0] = t.place
    key[1] = t.width
    key[2] = op.coefficients
    key[3] = ended
    return False


@jit
def place_dashpots(slot, op, i, t):
    """Computes the mode shapes at finger `i`'s dashpots, if its place, width or operator has changed."""
    if is_placed(slot, op, i, t, 0.0):
        return
    kappa, n = coefficient(op, KAPPA), modes_under(op, t.width, HIGHEST)
    slot.touch_modes[i] = n
    k1 = np.pi / op.length
    shapes = slot.touch_shape[i]
    for d in range(DASHPOTS):
        place, _ = dashpot(t, d)
        x = min(max(op.length - place, 0.0), op.length)  # nothing moves beyond the string's ends
        shape = shapes[d]
        for j in range(n):
            shape[j] = np.sqrt(2 / op.length) * sin(modal.mode_number(j) * k1 * x) * kappa[j] / op.fine
        shape[op.modes : n] = 0.0
        modal.copy_row(slot.touch_shape_high[i, d], shape[op.split :], n - op.split)
    slot.touch_products_for[i] = 0


@jit
def place_fingertip(slot, op, i, t):
    """`place_dashpots` for an ended note: shapes 0 of the one dashpot, and 1, what it misses of each wave."""
    if is_placed(slot, op, i, t, 1.0):
        return
    kappa, n = coefficient(op, KAPPA), modes_under(op, t.width, HIGHEST_ENDED)
    slot.touch_modes[i] = n
    k1 = np.pi / op.length
    shape, missed = slot.touch_shape[i, 0], slot.touch_shape[i, 1]
    x = min(max(op.length - t.place, 0.0), op.length)
    for j in range(op.padded):
        wave = modal.mode_number(j) * k1 * t.width
        felt = exp(-0.5 * wave * wave)
        missed[j] = 1.0 - felt * felt
        if j < n:
            shape[j] = np.sqrt(2 / op.length) * sin(modal.mode_number(j) * k1 * x) * felt * kappa[j] / op.fine
    shape[op.modes : n] = 0.0
    modal.copy_row(slot.touch_shape_high[i, 0], shape[op.split :], n - op.split)
    slot.touch_products_for[i] = 0


@jit
def find_products(slot, i, n):
    """Computes squares and products of finger `i`'s shapes over `n` modes, if they cover another number of modes."""
    if slot.touch_products_for[i] == n:
        return
    slot.touch_products_for[i] = n
    slot.touch_factor_key[i] = 0.0
    shapes, squares, products = slot.touch_shape[i], slot.touch_square[i], slot.touch_product[i]
    for d in range(DASHPOTS):
        squares[d] = modal.dot(shapes[d], shapes[d], n)
    products[0] = modal.dot(shapes[0], shapes[1], n)
    products[1] = modal.dot(shapes[0], shapes[2], n)
    products[2] = modal.dot(shapes[1], shapes[2], n)


@jit
def modes_to_damp(slot, i, t):
    """Number of modes that finger `i` moves in this frame; a landed finger skips modes known to be dead.

    While it lands or lifts it may set resting modes in motion.
    """
    n = slot.touch_modes[i]
    if t.resistance != t.wanted:
        return n
    return min(n, max(slot.active, slot.v_active))


@jit
def dashpot_factor(resistance, square, over_mass):
    """c of a dashpot of a `resistance` (N s/m); `square` (1/m): of its mode shapes; `over_mass`: h / mu (s m/kg)."""
    r = resistance * over_mass
    return r / max(1.0 + 0.5 * r * square, r * square)


@jit
def find_factors(slot, i, t, over_mass):
    """Computes c of finger `i`'s dashpots, if its resistance or shapes have changed."""
    if slot.touch_factor_key[i] == t.resistance:
        return
    slot.touch_factor_key[i] = t.resistance
    for d in range(DASHPOTS):
        _, resistance = dashpot(t, d)
        slot.touch_factor[i, d] = dashpot_factor(resistance, slot.touch_square[i, d], over_mass)


@jit
def linear_density(op):
    """Linear density, kg/m."""
    return op.fine * op.fine / op.weight


@jit
def characteristic_impedance(op):
    """mu c, kg/s."""
    return linear_density(op) * op.speed


@jit
def touch_string(voice, slot, op, due):
    """Damps the slot with all fingers after a frame in which it has moved; `due`: it ends a quartet."""
    if slot.hand == 1.0 or is_exact(op) or not are_settled(voice):
        damp_by_touches(voice, slot, op)
    elif due:
        damp_ended(voice, slot, op)


@apart
def damp_ended(voice, slot, op):
    """Damps an ended note with all fingers for a quartet of frames."""
    over_mass = QUARTET * op.steps * op.fine / linear_density(op)
    changed = pressed = False
    for i in range(TOUCHES):
        t = voice.touches[i]
        pressed = pressed or t.resistance > 0.0
        if t.resistance == 0.0:
            changed = changed or slot.touch_factor_key[i] != 0.0
            slot.touch_factor_key[i] = 0.0
            continue
        place_fingertip(slot, op, i, t)
        n = min(slot.touch_modes[i], max(slot.active, slot.v_active))  # the others are known to be dead
        shape, high = slot.touch_shape[i, 0], slot.touch_shape_high[i, 0]
        if slot.touch_products_for[i] != n:
            slot.touch_products_for[i] = n
            slot.touch_factor_key[i] = 0.0
            slot.touch_square[i, 0] = modal.dot(shape, shape, n)
        if slot.touch_factor_key[i] != t.resistance:
            slot.touch_factor_key[i] = t.resistance
            slot.touch_factor[i, 0] = dashpot_factor(t.resistance, slot.touch_square[i, 0], over_mass)
            changed = True
        quartet.apply_dashpot(slot.u, slot.v, shape, high, slot.touch_factor[i, 0], n)
        slot.active = max(slot.active, n) if slot.active > 0 else 0
        slot.v_active = max(slot.v_active, n) if slot.v_active > 0 else 0
    if not pressed:
        return
    kept, kept_high = slot.touch_shape[0, 2], slot.touch_shape_high[0, 2]
    if changed:
        fill_kept(voice, slot, op, kept, 0.5 * over_mass / op.length)
        modal.copy_row(kept_high, kept[op.split :], op.padded - op.split)
    quartet.fade_each(slot.u, kept, kept_high, slot.active)
    quartet.fade_each(slot.v, kept, kept_high, slot.v_active)


@jit
def fill_kept(voice, slot, op, kept, decay):
    """Fills `kept` with what all fingers' widths leave of each mode; `decay`: h / (2 mu L), s/kg."""
    for j in range(op.padded):
        kept[j] = 1.0
    for i in range(TOUCHES):
        lost, missed = decay * voice.touches[i].resistance, slot.touch_shape[i, 1]
        if lost > 0.0:
            for j in range(op.padded):
                kept[j] /= 1.0 + lost * missed[j]


@jit
def damp_by_touches(voice, slot, op):
    """Damps the slot with all fingers for one frame, after it has moved."""
    over_mass = op.steps * op.fine / linear_density(op)
    all_over = 0.0
    above: Any = np.int64(0)
    for i in range(TOUCHES):
        t = voice.touches[i]
        if t.resistance == 0.0 and t.wanted == 0.0:
            continue
        follow_ramp(t, voice.rate)
        if t.resistance == 0.0 or slot.active + slot.v_active == 0:
            continue
        place_dashpots(slot, op, i, t)
        n = modes_to_damp(slot, i, t)
        find_products(slot, i, n)
        find_factors(slot, i, t, over_mass)
        shapes, high, products = slot.touch_shape[i], slot.touch_shape_high[i], slot.touch_product[i]
        c = slot.touch_factor[i]
        if slot.active > 0 and slot.v_active > 0:
            modal.apply_dashpots_to_both(slot.u, slot.v, shapes, high, products, c, n)
        elif slot.active > 0:
            modal.apply_dashpots(slot.u, shapes, high, products, c, n)
        else:
            modal.apply_dashpots(slot.v, shapes, high, products, c, n)
        if slot.active > 0:
            slot.active = max(slot.active, n)
        if slot.v_active > 0:
            slot.v_active = max(slot.v_active, n)
        all_over += t.resistance
        above = max(above, n)
    if all_over > 0.0:
        decay = 0.5 * all_over * over_mass / op.length
        if slot.touch_decay != decay:
            slot.touch_decay = decay
            slot.touch_kept = exp(-decay)
        modal.fade(slot.u, slot.active, above, slot.touch_kept)
        modal.fade(slot.v, slot.v_active, above, slot.touch_kept)
