"""Fine steps of one string: contact for u, the polarisation away from the neck, friction for v, the one across.

Each step is one pass over the modes of a polarisation: it adds the forces of the step before, moves on, and sums the
displacements at the points near. Then the forces are solved for at these points alone. v feels eq. 7 where u touches,
u does not feel v. [any thread]
"""

from livebass import contact, friction, rows
from livebass.kernels import jit
from livebass.layout import (
    CLEARANCE_NOW,
    COUPLING,
    ETA,
    ETA_OLD,
    FORCE,
    FORCE_OLD,
    MOST_NEAR,
    NEAR,
    NEAR_PHI,
    OP_HEIGHT,
    PENDING,
    ROW,
    SOLVE,
    STAMP,
)

C1, EN, EO, ST = CLEARANCE_NOW * ROW, ETA * ROW, ETA_OLD * ROW, STAMP * ROW
FO, FB, PE = FORCE * ROW, FORCE_OLD * ROW, PENDING * ROW


@jit
def couple(s, op, pool, near, count, coupling):
    """Gathers W between the points in `near`, the modes left out included."""
    soft = 1.0 / (s.ratio * s.ratio)  # modes tuned higher are stiffer
    for i in range(count):
        o = op.start + (op.coupling + near[i]) * ROW
        for k in range(count):
            coupling[i * MOST_NEAR + k] = pool[o + near[k]] + soft * pool[o + MOST_NEAR + near[k]]


@jit
def get_ready(op, w, pool, near, count):
    """Shapes at the points in `near`, and no forces yet."""
    for i in range(count):
        rows.copy_row(w, NEAR_PHI + i, pool, op.start + (op.phi + near[i]) * ROW, op.padded)
        w[FO + near[i]] = 0.0
        w[FB + near[i]] = 0.0
    for i in range(count + NEAR):
        w[PE + i] = 0.0


@jit
def move(w, near, count, n):
    """One fine step of `n` modes after the pending forces; free displacements at the points into CLEARANCE_NOW."""
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


@jit
def get_done(w, near, count, n, step):
    """The forces of the last step, and which step it was."""
    for i in range(count):
        if w[PE + i] != 0.0:
            rows.kick(w, NEAR_PHI + i, w[PE + i], n)
        w[ST + near[i]] = step


@jit
def press(s, op, w, pool, near, count, coupling, step, log, voice):
    """Contact at `step`, the one that `move` made."""
    hit = False
    for i in range(count):
        m = near[i]
        free = pool[op.start + OP_HEIGHT * ROW + m] - w[C1 + m]
        hit = hit or free > 0.0 or w[EO + m] > 0.0
        w[C1 + m] = free - w[EO + m]
    if not hit:
        for i in range(count):
            m = near[i]
            eta = w[EO + m] + w[C1 + m]
            w[EO + m] = w[EN + m]
            w[EN + m] = eta
            w[FO + m] = 0.0
            w[FB + m] = 0.0
            w[PE + i] = 0.0
        return
    for i in range(count):  # the forces go on as they went
        m = near[i]
        last = w[FO + m]
        w[FO + m] = max(2.0 * last - w[FB + m], 0.0)
        w[FB + m] = last
    touching = contact.solve_points(
        near, count, w[C1 : C1 + ROW], w[EO : EO + ROW], w[FO : FO + ROW], coupling, op.diagonal, op.stiffness,
        op.exponent, w[SOLVE * ROW : SOLVE * ROW + 2 * ROW],
    )  # fmt: skip
    for i in range(count):
        m = near[i]
        eta = w[EO + m] + w[C1 + m] - felt(near, count, w[FO : FO + ROW], coupling, op.diagonal, i)
        if eta > 0.0 and w[EN + m] <= 0.0:
            s.touching += 1
            if voice.logged < log.shape[0]:
                log[voice.logged, 0] = step
                log[voice.logged, 1] = m
            voice.logged += 1
        w[EO + m] = w[EN + m]
        w[EN + m] = eta
        w[PE + i] = op.push * w[FO + m]
    if touching > 0:
        s.active = op.padded


@jit
def felt(near, count, force, coupling, diagonal, i):
    """m by which forces move the i-th point at once."""
    if diagonal:
        return coupling[i * MOST_NEAR + i] * force[near[i]]
    x = 0.0
    for k in range(count):
        x += coupling[i * MOST_NEAR + k] * force[near[k]]
    return x


@jit
def slide(s, op, w, across, near, count, coupling):
    """Friction of the step that `move` made in `across`; before `press`, while `w` has the penetration at its start."""
    if friction.solve_points(
        near, count, across[C1 : C1 + ROW], across[EO : EO + ROW], w[EN : EN + ROW], across[FO : FO + ROW], coupling,
        op.diagonal, op.friction, op.slip,
    ):  # fmt: skip
        s.swaying = op.padded
    for i in range(count):
        m = near[i]
        across[EO + m] = across[EN + m]
        across[EN + m] = across[C1 + m] + felt(near, count, across[FO : FO + ROW], coupling, op.diagonal, i)
        across[PE + i] = op.push * across[FO + m]


@jit
def fine_steps(s, op, w, across, pool, near, count, steps, step, log, voice):
    """Takes `steps` fine steps with contact and friction solved for at the `count` points in `near`.

    In `across` the rows ETA and ETA_OLD hold v itself.
    """
    get_ready(op, w, pool, near, count)
    for i in range(count):
        m = near[i]
        if w[ST + m] != step:
            o = op.start + (op.phi + m) * ROW
            w[EN + m] = pool[op.start + OP_HEIGHT * ROW + m] - rows.displacement(w, pool, o, s.active)
            w[EO + m] = pool[op.start + OP_HEIGHT * ROW + m] - rows.displacement_before(w, pool, o, s.active)
    swaying = s.swaying > 0
    if swaying:
        get_ready(op, across, pool, near, count)
        for i in range(count):
            m = near[i]
            if across[ST + m] != step:
                o = op.start + (op.phi + m) * ROW
                across[EN + m] = rows.displacement(across, pool, o, s.swaying)
                across[EO + m] = rows.displacement_before(across, pool, o, s.swaying)
    coupling = w[COUPLING * ROW : COUPLING * ROW + ROW]
    couple(s, op, pool, near, count, coupling)
    for _ in range(steps):
        step += 1
        if swaying:
            move(across, near, count, s.swaying)
            slide(s, op, w, across, near, count, coupling)
        move(w, near, count, s.active)
        press(s, op, w, pool, near, count, coupling, step, log, voice)
    get_done(w, near, count, s.active, step)
    if swaying:
        get_done(across, near, count, s.swaying, step)
