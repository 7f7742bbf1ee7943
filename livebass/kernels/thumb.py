"""A mass strikes the string: the thumb of a slap, or a finger of the left hand. It presses the string on the frets and
bounces off.

In fine steps the thumb is one more contact point, from above: with s_j = phi_j(x) exp(-(k_j a)^2 / 2), a its half
width, the string is u_s = sum_j s_j q_j high below it, and it goes eta = u_s - z deep into its own flesh, z its height.
Its force is that of eq. 12 with a stiffness and exponent 1.5 of its own, and the loss of Hunt and Crossley on top,

    F = (psi(eta^{n+1}) - psi(eta^{n-1})) / r + beta K [(eta^{n+1} + eta^{n-1}) / 2]_+^1.5 r / (2 dt),   never below 0,

r = eta^{n+1} - eta^{n-1}. It moves the modes by -dt^2 / mu s_j F, and the thumb gives way:
z^{n+1} = 2 z^n - z^{n-1} + dt^2 (F + H) / m, H the force of the hand. So the energy of string, frets and thumb, with
m ((z^n - z^{n-1}) / dt)^2 / 2 and psi, is constant without losses, and with them never grows but by the hand's work.

The hand throws the thumb, and lifts it from LIFTED on. While the string cannot reach it within a frame it flies, and
frames are as without it. `slot` is a SLOT, `op` its operator, t the slot's THUMB. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels import modal
from livebass.kernels.contact import ENOUGH, MOST_ITERATIONS, SETTLED, SMALL, force_of_three_halves
from livebass.kernels.elementary import exp, sin
from livebass.kernels.operators import shape
from livebass.kernels.records import COMING, THERE
from livebass.kernels.slot import SAFETY, SAFETY_STRUCK, SLACK, disturb, rms_velocity, take_thumb_away

MOST_TURNS = 100  # that thumb and contact points take with each other; they need two or three
LIFTED, LIFT = 3e-3, 50.0  # s after it came that the hand begins to lift it, m/s^2: 1.5 N for a thumb of 30 g
THROUGH = 30e-3  # m of penetration that no flesh allows: one without stiffness passes through the string, and is gone
GONE, AWAY = 20e-3, 4e-3  # s after which it is taken away once it is clear, and m of clearance at which it is at once
# No point of the string is faster than DRIVEN times the thumb's speed and SAFETY times its root mean square velocity;
# 1.8 times were seen of the latter.
DRIVEN = 2.0
FASTER = 1.25  # a bound of velocity that has to change is greater by as much than it need be
FEW = 4  # iterations from a good guess; one or two are enough
FAINT = 1e-9  # of the thumb's own share in a displacement: less does not count in turns


@jit
def throw(t, voice, op, event):
    """Sets out what a strike says, for the next frame: speed (m/s), place, and the mass if it is not the thumb's."""
    t.on = COMING
    t.wait = 0
    t.frames = 0
    t.pressing = 0
    t.speed = event.x
    t.place = op.length - event.y
    t.mass = event.z if event.z > 0.0 else voice.thumb_mass
    t.width = event.t if event.t > 0.0 else voice.thumb_width
    t.stiffness = event.w if event.w > 0.0 else voice.thumb_stiffness
    t.loss = voice.thumb_loss


@jit
def approach(slot, op, voice):
    """Brings the thumb to the string, once its time has come."""
    t = slot.thumb
    if t.wait > 0:
        t.wait -= 1
        return
    take_shape(slot, op)
    now = modal.displacement(slot.u, slot.thumb_shape, op.padded)
    before = modal.displacement_step_before(slot.u, slot.thumb_shape, op.padded)
    t.move = -t.speed * op.fine
    t.height = max(now, before + t.move)
    t.on = THERE
    t.known = 0
    slot.safety = SAFETY_STRUCK
    disturb(slot, op, voice.step)


@jit
def take_shape(slot, op):
    """Makes the mode shapes at the thumb, where its place has changed."""
    t, key, row, reach = slot.thumb, slot.thumb_key, slot.thumb_shape, slot.thumb_reach
    if key[0] == t.place and key[1] == t.width and key[2] == op.coefficients:
        return
    key[0] = t.place
    key[1] = t.width
    key[2] = op.coefficients
    k1 = np.pi / op.length
    x = min(max(op.length - t.place, 0.0), op.length)
    square = 0.0
    for j in range(op.padded):
        row[j] = 0.0
    for j in range(op.modes):
        k = (j + 1) * k1
        row[j] = np.sqrt(2 / op.length) * sin(k * x) * exp(-0.5 * (k * t.width) ** 2)
        square += row[j] * row[j]
    slot.thumb_square = square
    for m in range(op.points):
        reach[m] = modal.product(row, shape(op, m), op.padded)


@jit
def reaches(slot, op, voice, steps):
    """True if the thumb may touch the string in this frame of `steps` fine steps; then it is pressing."""
    t = slot.thumb
    t.pressing = 0
    if t.on != THERE:
        return False
    take_shape(slot, op)
    slot.active = op.padded
    needed = SAFETY * rms_velocity(slot.u, op, op.padded) + SLACK + DRIVEN * abs(t.move) / op.fine
    if needed > slot.fastest:
        disturb(slot, op, voice.step)
        slot.fastest = FASTER * needed
    elif FASTER * FASTER * needed < slot.fastest:
        slot.fastest = FASTER * needed
    t.lift = op.fine * op.fine * LIFT if t.frames >= LIFTED * voice.rate else 0.0
    now = modal.displacement(slot.u, slot.thumb_shape, op.padded)
    if now - t.height < -steps * (slot.fastest * op.fine + max(-t.move, 0.0)):
        return False
    if not t.known:
        before = modal.displacement_step_before(slot.u, slot.thumb_shape, op.padded)
        t.eta = now - t.height
        t.eta_before = before - t.height + t.move
        t.known = 1
        t.force = 0.0
        t.force_before = 0.0
    t.pending = 0.0
    t.pressing = 1
    return True


@jit
def follow(slot, op, voice, steps, after):
    """Moves a thumb that flies on by a frame, which ended at fine step `after`; takes it away when it has done."""
    t = slot.thumb
    if t.on != THERE:
        return
    t.frames += 1
    clear = t.eta < 0.0 and t.eta_before < 0.0
    if not t.pressing:
        t.height += steps * t.move + 0.5 * steps * (steps + 1) * t.lift
        t.move += steps * t.lift
        t.known = 0
        clear = True
    over = t.frames >= GONE * voice.rate
    if not over and clear and t.move > 0.0:
        over = t.height - modal.displacement(slot.u, slot.thumb_shape, op.padded) > AWAY
    if (over and (clear or not t.eta > 0.0)) or t.eta > THROUGH:
        take_thumb_away(slot)
        disturb(slot, op, after)


# In fine steps


@jit
def push(slot):
    """Adds the force of the last fine step to the modes."""
    if slot.thumb.pressing and slot.thumb.pending != 0.0:
        modal.kick(slot.u, slot.thumb_shape, slot.thumb.pending, slot.active)
        slot.thumb.pending = 0.0


@jit
def come(slot, u):
    """Moves the thumb on by a fine step without a force of the string, which has made it and is `u` m high there."""
    t = slot.thumb
    t.move += t.lift
    t.height += t.move
    t.free = u - t.height


@jit
def guess(slot):
    """First guess of the force (N): it goes on as it went."""
    return max(2.0 * slot.thumb.force - slot.thumb.force_before, 0.0)


@jit
def lifted(slot, op, near, count):
    """How far (m) the forces at the points in `near` raise the string below the thumb within the fine step."""
    x = 0.0
    for i in range(count):
        x += slot.thumb_reach[near[i]] * slot.u.force[near[i]]
    return op.push * x


@jit
def apart(slot, m):
    """True if contact point `m` and the thumb hardly move each other within a fine step."""
    return abs(slot.thumb_reach[m]) <= FAINT * slot.thumb_square


@jit
def give(slot, op):
    """How far (m) string and thumb give way to each other within a fine step, per N."""
    return op.weight * slot.thumb_square + op.fine * op.fine / slot.thumb.mass


@jit
def law(t, op, r):
    """Force (N) and its derivative for a penetration that has grown by `r` (m) in two fine steps."""
    f, slope = force_of_three_halves(r, t.eta_before, 0.4 * t.stiffness)
    middle = t.eta_before + 0.5 * r
    if middle > 0.0:
        resistance = 0.5 * t.loss / op.fine * t.stiffness * middle * np.sqrt(middle)
        f += resistance * r
        slope += resistance * (1.0 + 0.75 * r / middle)
        if f <= 0.0:
            return 0.0, 0.0
    return f, slope


@jit
def solve(slot, op, felt, first):
    """Force (N) of the thumb, r + give F(r) = r*, where contact points raise the string below it by `felt` (m).

    Newton's method from the force `first`; where that does not converge at once, between bounds.
    """
    t = slot.thumb
    weight = give(slot, op)
    wanted = t.free + felt - t.eta_before
    if t.eta_before <= 0.0 and t.eta_before + wanted <= 0.0:
        return 0.0
    r = wanted - weight * first
    for _ in range(FEW):
        f, slope = law(t, op, r)
        step = (r + weight * f - wanted) / (1.0 + weight * max(slope, 0.0))
        r -= step
        if f > 0.0 and abs(step) <= ENOUGH * abs(r) + SMALL:
            return max((wanted - r) / weight, 0.0)
    high = wanted
    elastic, _ = force_of_three_halves(wanted, t.eta_before, 0.4 * t.stiffness)
    f, slope = law(t, op, wanted)
    low = wanted - weight * max(elastic, f)
    r = high
    for _ in range(MOST_ITERATIONS):
        residual = r + weight * f - wanted
        if residual > 0.0:
            high = r
        else:
            low = r
        new = r - residual / (1.0 + weight * max(slope, 0.0))
        if not low <= new <= high:
            new = 0.5 * (low + high)
        step = new - r
        r = new
        if abs(step) <= ENOUGH * abs(r) + SMALL:
            break
        f, slope = law(t, op, r)
    return max((wanted - r) / weight, 0.0)


@jit
def settled(slot, op, change):
    """True if a change of the force (N) is as good as none."""
    return give(slot, op) * abs(change) <= SETTLED


@jit
def recoil(slot, op, force, felt):
    """Ends the fine step: the thumb gives way to `force` (N), and the string to it."""
    t = slot.thumb
    back = op.fine * op.fine / t.mass * force
    t.move += back
    t.height += back
    eta = t.free + felt - give(slot, op) * force
    t.eta_before = t.eta
    t.eta = eta
    t.force_before = t.force
    t.force = force
    t.pending = -op.weight * force
    if force > 0.0:
        slot.active = op.padded
