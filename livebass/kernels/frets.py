"""Fine steps of one string: contact for u, the polarisation away from the neck, friction for v, the one across.

Each step is one pass over the modes of a polarisation: it adds the forces of the step before, moves on, and sums the
displacements at the points near. Then the forces are solved for at these points alone. v feels eq. 7 where u touches,
u does not feel v. [any thread]

One string over frets from one audio frame to the next.

The step over a frame is tried first. A contact point needs a look only where it could have been reached: it moved
at most `fastest` metres a second since it was last known to be clear. Looked at, it is safe if its clearances at
both ends of the step add up to more than the way it can make in between. Otherwise the step is taken back, and
the frame is cut into parts, and the parts with a point in doubt into fine steps that solve the contact. Both
ways are the same exact solution; the choice depends on frame numbers and on the string alone, never on blocks.
[any thread]
"""

import numpy as np

from livebass.compiling import callback, jit
from livebass.kernels import contact
from livebass.kernels import contact as clearance
from livebass.kernels import contact as friction
from livebass.kernels import modal as rows
from livebass.kernels import slot as frame_call
from livebass.kernels.contact import NEVER, height, suspicious
from livebass.kernels.records import LONGER, MOST_NEAR, NEAR, OP_HEIGHT, PART, ROW, VOICE_SLOTS, WHOLE


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
        rows.copy_row(w.near_shape[i], pool, op.start + (op.phi + near[i]) * ROW, op.padded)
        w.force[near[i]] = 0.0
        w.force_before[near[i]] = 0.0
    for i in range(count + NEAR):
        w.pending[i] = 0.0


@jit
def move(w, near, count, n):
    """One fine step of `n` modes after the pending forces; free displacements at the points into CLEARANCE_NOW."""
    for i in range(NEAR, count):
        if w.pending[i] != 0.0:
            rows.kick(w, i, w.pending[i], n)
    if count == 1:
        w.clearance_now[near[0]] = rows.fine_1(w, w.pending[0], n)
    elif count == 2:
        u0, u1 = rows.fine_2(w, w.pending[0], w.pending[1], n)
        w.clearance_now[near[0]] = u0
        w.clearance_now[near[1]] = u1
    elif count == 3:
        u0, u1, u2 = rows.fine_3(w, w.pending[0], w.pending[1], w.pending[2], n)
        w.clearance_now[near[0]] = u0
        w.clearance_now[near[1]] = u1
        w.clearance_now[near[2]] = u2
    else:
        u0, u1, u2, u3 = rows.fine_4(w, w.pending[0], w.pending[1], w.pending[2], w.pending[3], n)
        w.clearance_now[near[0]] = u0
        w.clearance_now[near[1]] = u1
        w.clearance_now[near[2]] = u2
        w.clearance_now[near[3]] = u3
        for i in range(NEAR, count):
            w.clearance_now[near[i]] = rows.displacement_near(w, i, n)


@jit
def get_done(w, near, count, n, step):
    """The forces of the last step, and which step it was."""
    for i in range(count):
        if w.pending[i] != 0.0:
            rows.kick(w, i, w.pending[i], n)
        w.solved_at[near[i]] = step


@jit
def press(s, op, w, pool, near, count, coupling, step, log, voice):
    """Contact at `step`, the one that `move` made."""
    hit = False
    for i in range(count):
        m = near[i]
        free = pool[op.start + OP_HEIGHT * ROW + m] - w.clearance_now[m]
        hit = hit or free > 0.0 or w.eta_before[m] > 0.0
        w.clearance_now[m] = free - w.eta_before[m]
    if not hit:
        for i in range(count):
            m = near[i]
            eta = w.eta_before[m] + w.clearance_now[m]
            w.eta_before[m] = w.eta[m]
            w.eta[m] = eta
            w.force[m] = 0.0
            w.force_before[m] = 0.0
            w.pending[i] = 0.0
        return
    for i in range(count):  # the forces go on as they went
        m = near[i]
        last = w.force[m]
        w.force[m] = max(2.0 * last - w.force_before[m], 0.0)
        w.force_before[m] = last
    touching = contact.solve_points(
        near, count, w.clearance_now, w.eta_before, w.force, coupling, op.diagonal, op.stiffness,
        op.exponent, w.solver,
    )  # fmt: skip
    for i in range(count):
        m = near[i]
        eta = w.eta_before[m] + w.clearance_now[m] - felt(near, count, w.force, coupling, op.diagonal, i)
        if eta > 0.0 and w.eta[m] <= 0.0:
            s.touching += 1
            if voice.logged < log.shape[0]:
                log[voice.logged, 0] = step
                log[voice.logged, 1] = m
            voice.logged += 1
        w.eta_before[m] = w.eta[m]
        w.eta[m] = eta
        w.pending[i] = op.push * w.force[m]
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
    if friction.solve_friction(
        near, count, across.clearance_now, across.eta_before, w.eta, across.force, coupling,
        op.diagonal, op.friction, op.slip,
    ):  # fmt: skip
        s.swaying = op.padded
    for i in range(count):
        m = near[i]
        across.eta_before[m] = across.eta[m]
        across.eta[m] = across.clearance_now[m] + felt(near, count, across.force, coupling, op.diagonal, i)
        across.pending[i] = op.push * across.force[m]


@jit
def fine_steps(s, op, w, across, pool, near, count, steps, step, log, voice):
    """Takes `steps` fine steps with contact and friction solved for at the `count` points in `near`.

    In `across` the rows ETA and ETA_OLD hold v itself.
    """
    get_ready(op, w, pool, near, count)
    for i in range(count):
        m = near[i]
        if w.solved_at[m] != step:
            o = op.start + (op.phi + m) * ROW
            w.eta[m] = pool[op.start + OP_HEIGHT * ROW + m] - rows.displacement(w, pool, o, s.active)
            w.eta_before[m] = pool[op.start + OP_HEIGHT * ROW + m] - rows.displacement_before(w, pool, o, s.active)
    swaying = s.swaying > 0
    if swaying:
        get_ready(op, across, pool, near, count)
        for i in range(count):
            m = near[i]
            if across.solved_at[m] != step:
                o = op.start + (op.phi + m) * ROW
                across.eta[m] = rows.displacement(across, pool, o, s.swaying)
                across.eta_before[m] = rows.displacement_before(across, pool, o, s.swaying)
    coupling = w.coupling
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


@jit
def shape(op, m):
    """Where in the pool the shape at point m starts."""
    return op.start + (op.phi + m) * ROW


@jit
def contact_frame(s, op, w, across, pool, suspects, near, count, steps, step, log, voice):
    """A frame in which some of the `count` suspects may touch: parts, and fine steps where needed."""
    way = s.fastest * op.fine
    clearance.before_contact(w, suspects, count, step)
    end = step + steps
    for _ in range(op.parts):
        n = s.active
        rows.try_leap(w, PART, n)
        close = np.int64(0)
        for i in range(count):
            m = suspects[i]
            clear = rows.displacement(w, pool, shape(op, m), n) - height(op, pool, m)
            now = w.clearance[m]
            w.clearance_now[m] = clear
            held = w.solved_at[m] == step and w.eta_before[m] > 0.0
            if held or now <= 0.0 or now + clear <= way * op.part_steps:
                near[close] = m
                close += 1
        if close == 0:
            rows.leap(across, PART, s.swaying)
            for i in range(count):
                w.clearance[suspects[i]] = w.clearance_now[suspects[i]]
        else:
            rows.take_back(w, n)
            fine_steps(s, op, w, across, pool, near, close, op.part_steps, step, log, voice)
            for i in range(count):
                m = suspects[i]
                if w.solved_at[m] == step + op.part_steps:
                    w.clearance[m] = -w.eta[m]
                else:
                    w.clearance[m] = rows.displacement(w, pool, shape(op, m), s.active) - height(op, pool, m)
        step += op.part_steps
    if step < end:
        fine_steps(s, op, w, across, pool, suspects, count, end - step, step, log, voice)
        for i in range(count):
            w.clearance[suspects[i]] = -w.eta[suspects[i]]
    clearance.after_contact(w, suspects, count, end, way)
    s.due = end


@jit
def advance(s, op, w, across, pool, suspects, near, steps, step, log, voice):
    """Moves a slot from fine step `step` over one frame of `steps` fine steps in which something may touch."""
    n = s.active
    leap = LONGER if steps > op.steps else WHOLE
    end = step + steps
    rows.try_leap(w, leap, n)
    way = s.fastest * op.fine
    count = np.int64(0)  # a constant would be a type of its own
    looked = np.int64(0)
    least = NEVER
    for m in range(op.points):
        if end <= w.due[m]:
            least = min(least, w.due[m])
            continue
        near[looked] = m
        looked += 1
        if suspicious(op, w, pool, shape(op, m), m, step, end, way, n):
            suspects[count] = m
            count += 1
    if count > 0:
        rows.take_back(w, n)
        contact_frame(s, op, w, across, pool, suspects, near, count, steps, step, log, voice)
        return
    rows.leap(across, leap, s.swaying)
    clearance.stayed_clear(w, near, looked, end, way)
    for i in range(looked):
        least = min(least, w.due[near[i]])
    s.due = np.int64(least)


@callback("void(int64, int64, int64)")
def player(address, _, __):
    """`advance` as a C function, of what lies at `address`: frame_call.call put it there."""
    strings, ops, pool, log, k, steps = frame_call.arguments(address)
    string = strings[0]
    s, w, across, v, scratch = (
        string.slots[k],
        string.work[k],
        string.work[VOICE_SLOTS + k],
        string.voice,
        string.scratch,
    )
    advance(s, ops[s.fret], w, across, pool, scratch[0], scratch[1], steps, v.step, log, v)
