"""One string from one audio frame to the next: a long exact step where nothing touches, fine steps where something may.

The step over a frame is tried first. A contact point needs a look only where it could have been reached: it moved
at most `fastest` metres a second since it was last known to be clear. Looked at, it is safe if its clearances at
both ends of the step add up to more than the way it can make in between. Otherwise the step is taken back, and
the frame is cut into parts, and the parts with a point in doubt into fine steps that solve the contact. Both
ways are the same exact solution; the choice depends on frame numbers and on the string alone, never on blocks.
[any thread]
"""

import numpy as np

from livebass import contact, rows
from livebass.kernels import jit
from livebass.layout import (
    BLOCK,
    CLEARANCE,
    CLEARANCE_NOW,
    COUPLING,
    DUE,
    ETA,
    ETA_OLD,
    FINE_A,
    FORCE,
    FORCE_OLD,
    FRAME,
    FRAME_1,
    KNOWN,
    MOST_NEAR,
    NEAR,
    NEAR_PHI,
    OMEGA,
    OP_COPIED,
    OP_HEIGHT,
    PENDING,
    ROW,
    SOLVE,
    STAMP,
    SUB,
)

NEVER = 1 << 60
# Fastest point over the root mean square velocity that the string's energy gives: plucks were seen to reach 3.8
# (hard, near the bridge); the narrow pulse of a thumb more.
SAFETY, SAFETY_STRUCK = 5.0, 10.0
SLACK = 0.02  # m/s
HOUSEKEEPING = 64  # frames between looks for dead modes
STEEPEST = 0.1  # root mean square velocity over wave speed that a string bears: no playing reaches a third of it

C0, C1, KN, DU = CLEARANCE * ROW, CLEARANCE_NOW * ROW, KNOWN * ROW, DUE * ROW
EN, EO, ST, FO, FB, PE = ETA * ROW, ETA_OLD * ROW, STAMP * ROW, FORCE * ROW, FORCE_OLD * ROW, PENDING * ROW


@jit
def load(s, op, w, pool, step):
    """Makes the silent slot `s` ready to play operator `op`."""
    n = op.padded
    for row in range(OP_COPIED):
        rows.copy_row(w, FINE_A + row, pool, op.start + row * ROW, n)
    rows.clear(w, n)
    s.ratio = 1.0
    s.heard = op.tap_modes
    s.safety = SAFETY
    s.active = 0
    s.touching = 0
    s.fading = 0
    s.hand = 1.0
    for m in range(op.points):
        w[ST + m] = -1.0
    disturb(s, op, w, step)


@jit
def disturb(s, op, w, step):
    """After an event: every point needs a look, all modes may sound."""
    if s.on:
        s.active = op.padded
        s.fastest = s.safety * np.sqrt(rows.speed_square(w, op.padded) / op.length) + SLACK
    s.due = step
    s.quiet = -1
    for m in range(op.points):
        w[DU + m] = -1.0
        w[KN + m] = -1.0


@jit
def bend(s, op, w, pool, ratio, most):
    """Tunes the slot to `ratio` times the operators' frequencies without a jump of displacement or velocity.

    Modes that get above `most` (rad/s) are not heard any more.
    """
    n = op.padded
    base = op.start + (OMEGA - FINE_A) * ROW
    for j in range(n):
        # sigma stays, the undamped frequency scales; sigma << omega
        w[OMEGA * ROW + j] = pool[base + j] * ratio
    rows.retune(w, ratio, op.fine, op.steps, op.part_steps, n)
    s.ratio = ratio
    s.heard = op.tap_modes
    if ratio > 1.0:
        while s.heard > 0 and w[OMEGA * ROW + min(s.heard, op.modes) - 1] > most:
            s.heard -= BLOCK


@jit
def exchange(s, old, op, w, pool, step):
    """Makes the sounding slot `s` go on with `op`, untuned."""
    rows.exchange(w, old.padded, op.padded)
    for row in range(OP_COPIED):
        rows.copy_row(w, FINE_A + row, pool, op.start + row * ROW, op.padded)
    rows.from_velocity(w, op.padded)
    s.ratio = 1.0
    s.heard = op.tap_modes
    s.active = op.padded
    for m in range(op.points):
        w[ST + m] = -1.0


@jit
def couple(s, op, pool, near, count, coupling):
    """Gathers W between the points in `near`, the modes left out included."""
    soft = 1.0 / (s.ratio * s.ratio)  # modes tuned higher are stiffer
    for i in range(count):
        o = op.start + (op.coupling + near[i]) * ROW
        for k in range(count):
            coupling[i * MOST_NEAR + k] = pool[o + near[k]] + soft * pool[o + MOST_NEAR + near[k]]


@jit
def fine_steps(s, op, w, pool, near, count, steps, step, log, voice):
    """Takes `steps` fine steps with the contact solved at the `count` points in `near`."""
    start = op.start
    for i in range(count):
        m = near[i]
        o = start + (op.phi + m) * ROW
        rows.copy_row(w, NEAR_PHI + i, pool, o, op.padded)
        if w[ST + m] != step:
            w[EN + m] = pool[start + OP_HEIGHT * ROW + m] - rows.displacement(w, pool, o, s.active)
            w[EO + m] = pool[start + OP_HEIGHT * ROW + m] - rows.displacement_before(w, pool, o, s.active)
        w[FO + m] = 0.0
        w[FB + m] = 0.0
        w[PE + i] = 0.0
    coupling = w[COUPLING * ROW : COUPLING * ROW + ROW]
    couple(s, op, pool, near, count, coupling)
    for i in range(count, count + NEAR):
        w[PE + i] = 0.0
    wanted = w[C1 : C1 + ROW]
    pending = False
    for _ in range(steps):
        n = s.active
        if pending:
            for i in range(NEAR, count):
                if w[PE + i] != 0.0:
                    rows.kick(w, NEAR_PHI + i, w[PE + i], n)
        if count == 1:
            w[C1 + near[0]] = rows.fine_1(w, w[PE], n)
        elif count == 2:
            u0, u1 = rows.fine_2(w, w[PE], w[PE + 1], n)
            w[C1 + near[0]] = u0
            w[C1 + near[1]] = u1
        elif count == 3:
            u0, u1, u2 = rows.fine_3(w, w[PE], w[PE + 1], w[PE + 2], n)
            w[C1 + near[0]] = u0
            w[C1 + near[1]] = u1
            w[C1 + near[2]] = u2
        else:
            u0, u1, u2, u3 = rows.fine_4(w, w[PE], w[PE + 1], w[PE + 2], w[PE + 3], n)
            w[C1 + near[0]] = u0
            w[C1 + near[1]] = u1
            w[C1 + near[2]] = u2
            w[C1 + near[3]] = u3
            for i in range(NEAR, count):
                w[C1 + near[i]] = rows.displacement_near(w, NEAR_PHI + i, n)
        step += 1
        hit = False
        for i in range(count):
            m = near[i]
            free = pool[start + OP_HEIGHT * ROW + m] - w[C1 + m]
            hit = hit or free > 0.0 or w[EO + m] > 0.0
            w[C1 + m] = free - w[EO + m]
        pending = False
        if hit:
            for i in range(count):  # the forces go on as they went
                m = near[i]
                last = w[FO + m]
                w[FO + m] = max(2.0 * last - w[FB + m], 0.0)
                w[FB + m] = last
            pending = contact.solve_points(
                near, count, wanted, w[EO : EO + ROW], w[FO : FO + ROW], coupling, op.diagonal, op.stiffness,
                op.exponent, w[SOLVE * ROW : SOLVE * ROW + 2 * ROW],
            ) > 0
            for i in range(count):
                m = near[i]
                r = w[C1 + m]
                if op.diagonal:
                    r -= coupling[i * MOST_NEAR + i] * w[FO + m]
                else:
                    for k in range(count):
                        r -= coupling[i * MOST_NEAR + k] * w[FO + near[k]]
                eta = w[EO + m] + r
                if eta > 0.0 and w[EN + m] <= 0.0:
                    s.touching += 1
                    if voice.logged < log.shape[0]:
                        log[voice.logged, 0] = step
                        log[voice.logged, 1] = m
                    voice.logged += 1
                w[EO + m] = w[EN + m]
                w[EN + m] = eta
                w[PE + i] = op.push * w[FO + m]
            if pending:
                s.active = op.padded
        else:
            for i in range(count):
                m = near[i]
                eta = w[EO + m] + w[C1 + m]
                w[EO + m] = w[EN + m]
                w[EN + m] = eta
                w[FO + m] = 0.0
                w[FB + m] = 0.0
                w[PE + i] = 0.0
    if pending:
        for i in range(count):
            if w[PE + i] != 0.0:
                rows.kick(w, NEAR_PHI + i, w[PE + i], s.active)
    for i in range(count):
        w[ST + near[i]] = step


@jit
def contact_frame(s, op, w, pool, suspects, near, count, steps, step, log, voice):
    """A frame in which some of the `count` suspects may touch: parts, and fine steps where needed."""
    start = op.start
    way = s.fastest * op.fine
    for i in range(count):
        m = suspects[i]
        if w[ST + m] == step:
            w[C0 + m] = -w[EN + m]
    end = step + steps
    for _ in range(op.parts):
        n = s.active
        rows.try_leap(w, SUB, n)
        close = np.int64(0)
        for i in range(count):
            m = suspects[i]
            height = pool[start + OP_HEIGHT * ROW + m]
            clear = rows.displacement(w, pool, start + (op.phi + m) * ROW, n) - height
            now = w[C0 + m]
            w[C1 + m] = clear
            held = w[ST + m] == step and w[EO + m] > 0.0
            if held or now <= 0.0 or now + clear <= way * op.part_steps:
                near[close] = m
                close += 1
        if close == 0:
            for i in range(count):
                w[C0 + suspects[i]] = w[C1 + suspects[i]]
        else:
            rows.take_back(w, n)
            fine_steps(s, op, w, pool, near, close, op.part_steps, step, log, voice)
            for i in range(count):
                m = suspects[i]
                if w[ST + m] == step + op.part_steps:
                    w[C0 + m] = -w[EN + m]
                else:
                    height = pool[start + OP_HEIGHT * ROW + m]
                    w[C0 + m] = rows.displacement(w, pool, start + (op.phi + m) * ROW, s.active) - height
        step += op.part_steps
    if step < end:
        fine_steps(s, op, w, pool, suspects, count, end - step, step, log, voice)
        for i in range(count):
            w[C0 + suspects[i]] = -w[EN + suspects[i]]
    for i in range(count):
        m = suspects[i]
        w[KN + m] = end
        w[DU + m] = end
        if w[C0 + m] > 0.0:
            w[DU + m] = end + np.floor(w[C0 + m] / way)
    s.due = end


@jit
def advance(s, op, w, pool, suspects, near, steps, step, log, voice):
    """Moves a slot from fine step `step` over one frame of `steps` fine steps."""
    n = s.active
    if n == 0:
        return
    leap = FRAME_1 if steps > op.steps else FRAME
    end = step + steps
    if op.points == 0 or s.fading or end <= s.quiet or end <= s.due:
        rows.leap(w, leap, n)
        return
    rows.try_leap(w, leap, n)
    start = op.start
    way = s.fastest * op.fine
    count = np.int64(0)  # a constant would be a type of its own
    for m in range(op.points):
        if end <= w[DU + m]:
            continue
        phi = start + (op.phi + m) * ROW
        height = pool[start + OP_HEIGHT * ROW + m]
        clear = rows.displacement(w, pool, phi, n) - height
        w[C1 + m] = clear
        known = w[KN + m]
        if known >= 0 and known < step and w[C0 + m] + clear > way * (end - known):
            continue
        if known < step:
            w[C0 + m] = rows.displacement_old(w, pool, phi, n) - height
            w[KN + m] = step
        held = w[ST + m] == step and (w[EN + m] > 0.0 or w[EO + m] > 0.0)
        if held or w[C0 + m] <= 0.0 or w[C0 + m] + clear <= way * steps:
            suspects[count] = m
            count += 1
    if count > 0:
        rows.take_back(w, n)
        if count > MOST_NEAR:
            count = np.int64(MOST_NEAR)
        contact_frame(s, op, w, pool, suspects, near, count, steps, step, log, voice)
        return
    least = float(NEVER)
    for m in range(op.points):
        if end > w[DU + m]:
            w[C0 + m] = w[C1 + m]
            w[KN + m] = end
            w[DU + m] = end + np.floor(w[C1 + m] / way)
        least = min(least, w[DU + m])
    s.due = np.int64(least)


@jit
def weaken(s, op, w, factor):
    """Takes a motion back to what a string bears; one that is no number ends."""
    if factor > 0.0:
        rows.scale(w, factor, s.active)
        for m in range(op.points):
            w[ST + m] = -1.0
    else:
        rows.clear(w, op.padded)
        s.active = 0
        s.on = 0


@jit
def keep_house(s, op, w, pool, step):
    """Drops dead modes, and finds out whether a contact is still possible. At fixed frame numbers only."""
    n = rows.living(w, s.active)
    s.active = n
    if n == 0:
        s.on = 0
        return
    speed = np.sqrt(rows.speed_square(w, n) / op.length)
    if not speed < STEEPEST * op.speed:
        weaken(s, op, w, STEEPEST * op.speed / speed)
        return
    if op.points == 0 or s.fading or s.quiet > step:
        return
    held = False
    lowest = np.inf
    for m in range(op.points):
        held = held or (w[ST + m] == step and (w[EN + m] > 0.0 or w[EO + m] > 0.0))
        lowest = min(lowest, -pool[op.start + OP_HEIGHT * ROW + m])
    if held:
        return
    s.fastest = min(s.fastest, s.safety * speed + SLACK)
    if np.sqrt(2.0 / op.length) * rows.amplitude_sum(w, n) < lowest:
        s.quiet = NEVER


def padded(modes: int) -> int:
    """Modes up to a whole BLOCK."""
    return -(-modes // BLOCK) * BLOCK
