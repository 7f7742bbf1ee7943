"""A mass strikes the string: the thumb of a slap, or a left-hand finger. It presses the string on the frets and bounces
off by itself.

With s_j = phi_j(x) exp(-(k_j a)^2 / 2), a its half width, the string below the thumb has the height
u_s = sum_j s_j q_j, and the thumb at height z sinks eta = u_s - z into its own flesh. The flesh stores the energy
psi = K eta^2.5 / 2.5 and resists with Hunt and Crossley's loss: F = K eta^1.5 (1 + beta eta'). Flesh is soft and moves
no wave shorter than its width, so F changes little within a frame. F is found before the frame and kept constant; the
frets and their fine steps need not know it:

A string under a constant force moves freely about the shape -F c_j that the force would hold it in,
c_j = dt^2 s_j / (mu b_j) in the terms of eq. 12's invariant, b_j = (kappa_j omega_j)^2. So q_j gets F c_j for the
frame, and every obstacle F sum_j phi_j c_j; both lose it afterwards. The energy that string and thumb lose to the flesh
is exactly F times the growth of eta, frets or not.

F follows from a discrete gradient. With psi = phi^2 / 2 and eta taken in the middle of the frame,

    F = g (phi^n + phi^{n+1}) / 2 + R r / h,    phi^{n+1} = phi^n + g r,    g = sqrt(1.25 K) eta^0.25,
    R = beta K eta^1.5,    r = eta^{n+1} - eta^n = r_free - A F,

where A is how far string and thumb yield to each other within a frame. r_free assumes that the frets push as in the
last frame; this frame's push is not known yet. So the flesh's energy is tracked: it gains the two's actual loss, less
R r^2 / h or all it has, and never exceeds psi; the thumb pays any deficit. So only the hand's work adds energy.
(Energy as a state of its own: Lopes, Helie, Falaize 2015; Bilbao, Ducceschi, Zama 2023.)

The hand throws the thumb, and lifts it from LIFTED on. `slot` is a SLOT, `op` its operator, t the slot's THUMB. [audio
thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp, sin, square
from livebass.kernels.string import modal
from livebass.kernels.string.operators import positions, shape_row
from livebass.kernels.string.records import BLOCK, COMING, THERE
from livebass.kernels.string.slot import SAFETY_HANDED, SAFETY_STRUCK, SLACK, remove_thumb, wake_slot

NARROWEST = 4.0  # of k a: the flesh moves no shorter waves ...
MAX_TURN = 1.5  # rad per fine step: ... nor faster ones
LIFTED, LIFT = 3e-3, 50.0  # s from its arrival until the hand begins to lift it, m/s^2: 1.5 N for a thumb of 30 g
THROUGH = 30e-3  # m of penetration that no flesh allows: a thumb without stiffness passes through, and is removed
GONE, AWAY = 20e-3, 4e-3  # s after which a clear thumb is removed, and m of clearance that removes it at once
LONGEST = 60e-3  # s after which it is removed, clear or not
NARROW = 1e-3  # s after its arrival in which its pulse may be narrow
TURNS = 3  # iterations for the depth in the middle of a frame


@jit
def set_out(t, voice, op, event):
    """Sets speed (m/s), place, mass and flesh of the thumb for the next frame, from a THROW."""
    t.on = COMING
    t.wait = 0
    t.frames = 0
    t.speed = -event.speed
    t.place = op.length - event.place
    t.mass = event.mass if event.mass > 0.0 else voice.thumb_mass
    t.width = event.width if event.width > 0.0 else voice.thumb_width
    t.stiffness = event.stiffness if event.stiffness > 0.0 else voice.thumb_stiffness
    t.loss = voice.thumb_loss


@jit
def approach_string(slot, op):
    """Brings the thumb to the string, once its time has come."""
    t = slot.thumb
    if t.wait > 0:
        t.wait -= 1
        return
    fit_thumb(slot, op)
    t.height = modal.displacement_under(slot.u, slot.thumb_modes, slot.thumb_shape)
    t.energy = t.force = t.pushed = 0.0
    t.on = THERE
    slot.safety = SAFETY_STRUCK


@jit
def shape_under(op, k, x, width):
    """The mode shape for wave number `k` (1/m), m^-0.5, under a thumb at `x` (m) of half width `width` (m)."""
    return np.sqrt(2 / op.length) * sin(k * x) * exp(-0.5 * square(k * width))


@jit
def fit_thumb(slot, op):
    """Computes mode shapes and compliances under the thumb if its place, width or the tuning has changed."""
    t, key, row, c = slot.thumb, slot.thumb_key, slot.thumb_shape, slot.thumb_yield
    if key[0] == t.place and key[1] == t.width and key[2] == op.coefficients and key[3] == slot.ratio:
        return
    key[0] = t.place
    key[1] = t.width
    key[2] = op.coefficients
    key[3] = slot.ratio
    k1 = np.pi / op.length
    x = min(max(op.length - t.place, 0.0), op.length)
    n: Any = np.int64(0)
    give = 0.0
    for j in range(op.padded):
        k = modal.mode_number(j) * k1
        row[j] = 0.0
        c[j] = 0.0
        if j < op.modes and k * t.width < NARROWEST and slot.u.omega[j] * op.fine < MAX_TURN:
            row[j] = shape_under(op, k, x, t.width)
            c[j] = op.weight * row[j] / square(slot.u.kappa[j] * slot.u.omega[j])
            give += row[j] * c[j] * (1.0 - modal.whole_leap(slot.u, j))
            n = j + 1
    n = (n + BLOCK - 1) // BLOCK * BLOCK
    slot.thumb_modes = n
    slot.thumb_give = give
    for m in range(op.points):
        slot.thumb_reach[m] = modal.dot_of_row(op, shape_row(op, m), c, n)


@jit
def press_on(slot, op, voice, steps, which):
    """Finds the thumb's force for the next frame (`steps` fine steps, leaps[which]) and applies it."""
    t = slot.thumb
    if t.on != THERE:
        return
    fit_thumb(slot, op)
    h = steps * op.fine
    lift = LIFT if t.frames > LIFTED * voice.rate else 0.0
    now, later = modal.displacement_now_and_later(slot.u, slot.thumb_modes, slot.thumb_shape, which)
    t.frames += 1
    t.force = 0.0
    t.depth = now - t.height
    path = t.depth + later - now - h * (t.speed + 0.5 * h * lift)  # depth after a frame without frets or force
    deep, free = max(t.depth, 0.0), max(path + t.pushed, 0.0)
    if t.frames > LONGEST * voice.rate or not deep < THROUGH:
        remove_thumb(slot)
    elif deep > 0.0 or free > 0.0:
        give = slot.thumb_give + 0.5 * h * h / t.mass
        f = find_force(t, deep, free, give, h)
        t.height += h * (t.speed + 0.5 * h * (lift + f / t.mass))
        t.speed += h * (lift + f / t.mass)
        if f > 0.0:
            t.force = f
            t.foreseen = path - t.depth - give * f
            add_force_to_string(slot, op, voice)
    else:
        t.height += h * (t.speed + 0.5 * h * lift)
        t.speed += h * lift
        t.energy = 0.0
        t.pushed = 0.0
        if (t.speed > 0.0 and t.depth < -AWAY) or t.frames > GONE * voice.rate:
            remove_thumb(slot)


@jit
def find_force(t, deep, free, give, h):
    """Force (N) in a frame of `h` s that begins `deep` m in the flesh and would end `free` m in it without force."""
    t.energy = min(t.energy, 0.4 * t.stiffness * deep * deep * np.sqrt(deep))
    end = free
    f = 0.0
    for _ in range(TURNS):
        middle = 0.5 * (deep + end)
        root = np.sqrt(middle)
        square = 1.25 * t.stiffness * root
        t.friction = t.loss * t.stiffness * middle * root / h
        resist = 0.5 * square + t.friction
        f = max((np.sqrt(2.0 * square * t.energy) + resist * (free - deep)) / (1.0 + resist * give), 0.0)
        end = max(free - give * f, 0.0)
    return f


@jit
def add_force_to_string(slot, op, voice):
    """Applies the frame's force to string and obstacles, and bounds the string's speed under it."""
    f, height, x = slot.thumb.force, slot.u.height, positions(op)
    modal.copy_row(slot.thumb_heights, height, op.points)
    bent = 0.0  # m^2/s^2, as in `rms_velocity`: from the energy of the bend that the frets hold
    for m in range(op.points):
        height[m] += f * slot.thumb_reach[m]
        if height[m] > 0.0:
            bent = max(bent, height[m] * height[m] / (x[m] * (op.length - x[m])))
    bent *= square(op.speed * slot.ratio)
    modal.shift(slot.u, slot.thumb_modes, slot.thumb_yield, f)
    slot.safety = SAFETY_STRUCK if slot.thumb.frames <= NARROW * voice.rate else SAFETY_HANDED
    wake_slot(slot, op, voice.step)
    rms = (slot.fastest - SLACK) / slot.safety
    slot.fastest = slot.safety * np.sqrt(max(rms * rms - bent, 0.0)) + SLACK


@jit
def take_off(slot, op, after):
    """Removes the force after the frame, which ended at fine step `after`; adds its work to the flesh's energy."""
    t, n = slot.thumb, slot.thumb_modes
    if t.on != THERE or not t.force > 0.0:
        return
    modal.copy_row(slot.u.height, slot.thumb_heights, op.points)
    modal.shift(slot.u, n, slot.thumb_yield, -t.force)
    change = modal.displacement_under(slot.u, n, slot.thumb_shape) - t.height - t.depth
    t.pushed = change - t.foreseen
    t.energy += t.force * change
    t.energy -= min(t.friction * change * change, max(t.energy, 0.0))
    if t.energy < 0.0:  # the thumb's kinetic energy makes up for it
        speed = np.sqrt(max(t.speed * t.speed + 2.0 * t.energy / t.mass, 0.0))
        t.speed = speed if t.speed > 0.0 else -speed
        t.energy = 0.0
    wake_slot(slot, op, after)
