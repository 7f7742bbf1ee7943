"""Fingers and palm that lie on a string: dashpots, passive for any strength.

A finger of resistance R at x takes momentum from the string there. With the velocities v_j of the modes and
s_j = phi_j(x) exp(-(k_j a)^2 / 2), a its half width, the flow over a time h is v <- v - c (s v) s, where
c = (1 - exp(-R |s|^2 h / mu)) / |s|^2: the exact flow of the dashpot alone, once a frame, after the string has moved.
As c |s|^2 < 1, kinetic energy only falls. It is done in P, with s_j kappa_j / dt in place of s_j, so that the energy
that eq. 12 conserves falls, whatever R (modal.invariant).

Waves shorter than the finger meet flesh all over its width: all modes lose
exp(-R h / (2 mu L) (1 - exp(-(k_j a)^2))) a frame besides.

A finger lands and lifts in a ramp of R. Places are from the saddle: they outlive a change of fret. `slot` is a SLOT,
`op` its operator. [audio thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import jit
from livebass.kernels import modal
from livebass.kernels.elementary import exp, sin
from livebass.kernels.operators import KAPPA, coefficient
from livebass.kernels.records import BLOCK, TOUCHES
from livebass.kernels.slot import SAFETY_STRUCK, disturb

NARROWEST = 2.5  # of k a: shorter waves meet the flesh alone
MOST_TOUCHED = 352  # modes that a finger moves as one point
LANDING, LIFTING = 5e-3, 15e-3  # s
STAYS = -1  # in place of the frames until a finger lifts


@jit
def lay(voice, i, place, resistance, width, seconds, landing):
    """Lays finger `i` on the string at `place` (m from the saddle); it lifts after `seconds`, 0: it stays.

    `resistance` is in N s/m, `width`, half of it, in m, `landing` in s. With no resistance the finger lifts now, within
    `seconds`, 0: LIFTING.
    """
    t = voice.touches[i]
    if resistance <= 0.0:
        lift(voice, i, seconds if seconds > 0.0 else LIFTING)
        return
    if place != t.place or width != t.width:
        t.resistance = 0.0  # another place: it lands anew
    t.place = place
    t.width = width
    t.wanted = resistance
    t.ramp = resistance / max(landing * voice.rate, 1.0)
    t.lifts = max(np.int64(np.rint(seconds * voice.rate)), 1) if seconds > 0.0 else STAYS


@jit
def ease(voice, i, resistance, seconds):
    """Has finger `i` begin with another `resistance`, and come to the wanted one in `seconds`."""
    t = voice.touches[i]
    t.resistance = resistance
    t.ramp = abs(resistance - t.wanted) / max(seconds * voice.rate, 1.0)


@jit
def forget(voice):
    """Takes all fingers away from a string at rest."""
    for i in range(TOUCHES):
        t = voice.touches[i]
        t.resistance = 0.0
        t.wanted = 0.0
        t.lifts = STAYS


@jit
def lift(voice, i, seconds):
    """Lifts finger `i` within `seconds`."""
    t = voice.touches[i]
    t.wanted = 0.0
    t.lifts = STAYS
    t.ramp = t.resistance / max(seconds * voice.rate, 1.0)


@jit
def lift_all(voice, seconds):
    """Lifts all fingers within `seconds`."""
    for i in range(TOUCHES):
        lift(voice, i, seconds)


@jit
def land(voice, slot, op):
    """After fingers have landed: what they leave of the motion may be a narrow pulse, more peaked than a pluck."""
    slot.safety = SAFETY_STRUCK
    disturb(slot, op, voice.step)


@jit
def follow(t, rate):
    """Moves the resistance of a finger on by a frame."""
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
def shape_under(op, k, x, width):
    """The mode shape with the wave number `k` (1/m), m^-0.5, under a finger at `x` (m) of half that `width` (m)."""
    return np.sqrt(2 / op.length) * sin(k * x) * exp(-0.5 * (k * width) ** 2)


@jit
def take_place(slot, op, i, t):
    """Makes the mode shapes at finger `i`, where its place has changed."""
    key, kappa = slot.touch_key[i], coefficient(op, KAPPA)
    if key[0] == t.place and key[1] == t.width and key[2] == op.coefficients:
        return
    key[0] = t.place
    key[1] = t.width
    key[2] = op.coefficients
    k1 = np.pi / op.length
    n: Any = np.int64(NARROWEST / (k1 * max(t.width, 1e-4))) + 1
    n = min((min(n, MOST_TOUCHED) + BLOCK - 1) // BLOCK * BLOCK, op.padded)
    x = min(max(op.length - t.place, 0.0), op.length)
    row = slot.touch_shape[i]
    square = 0.0
    for j in range(n):
        k = modal.number(j) * k1
        s = shape_under(op, k, x, t.width) * kappa[j] / op.fine
        if j >= op.modes:
            s = 0.0
        row[j] = s
        square += s * s
    slot.touch_square[i] = square
    slot.touch_modes[i] = n


@jit
def take_flesh(voice, slot, op):
    """Makes the losses of waves shorter than the fingers, where these have changed."""
    key, same = slot.flesh_key, True
    for i in range(TOUCHES):
        t = voice.touches[i]
        same = same and key[2 * i] == t.wanted and key[2 * i + 1] == t.width
    if same and key[2 * TOUCHES] == op.coefficients:
        return
    for i in range(TOUCHES):
        key[2 * i] = voice.touches[i].wanted
        key[2 * i + 1] = voice.touches[i].width
    key[2 * TOUCHES] = op.coefficients
    k1 = np.pi / op.length
    h = op.steps * op.fine / (2 * mass(op) * op.length)
    for j in range(op.padded):
        lost = 0.0
        for i in range(TOUCHES):
            t = voice.touches[i]
            if t.wanted > 0.0:
                lost += t.wanted * (1.0 - exp(-((modal.number(j) * k1 * t.width) ** 2)))
        slot.flesh[j] = 1.0 - exp(-h * lost)


@jit
def mass(op):
    """Linear density, kg/m."""
    return op.fine * op.fine / op.weight


@jit
def impedance(op):
    """mu c, kg/s."""
    return mass(op) * op.speed


@jit
def damp(voice, slot, op):
    """Lets the fingers damp the slot for one frame, after it has moved."""
    whole = 0.0
    now = 0.0
    for i in range(TOUCHES):
        t = voice.touches[i]
        if t.resistance == 0.0 and t.wanted == 0.0:
            continue
        follow(t, voice.rate)
        whole += t.wanted
        now += t.resistance
        if t.resistance == 0.0 or slot.active + slot.v_active == 0:
            continue
        take_place(slot, op, i, t)
        n, square = slot.touch_modes[i], slot.touch_square[i]
        if square <= 0.0:
            continue
        c = (1.0 - exp(-t.resistance * square * op.steps * op.fine / mass(op))) / square
        if slot.active > 0:
            modal.touch(slot.u, slot.touch_shape[i], c, n)
            slot.active = max(slot.active, n)
        if slot.v_active > 0:
            modal.touch(slot.v, slot.touch_shape[i], c, n)
            slot.v_active = max(slot.v_active, n)
    if whole > 0.0 and slot.active + slot.v_active > 0:
        take_flesh(voice, slot, op)
        part = min(now / whole, 1.0)
        modal.fade(slot.u, slot.flesh, part, slot.active)
        modal.fade(slot.v, slot.flesh, part, slot.v_active)
