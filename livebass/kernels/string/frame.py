"""One audio frame of a slot in which the string may touch something: the same over frets and over a board.

The step over the whole frame is tried first. A contact point needs a check only if the string could have reached it:
the string moves at most `fastest` metres per second, so a clearance known at one fine step gives the earliest step of
contact. A checked point is safe if its clearances at both ends of the frame add up to more than the string can travel
in between. Otherwise the frame is undone and cut into parts: parts with a doubtful point advance in fine steps that
solve contact, the others in one leap. Both are the same exact solution of the equations; the choice depends only on
frame numbers and the string, never on blocks.

`advance_frame` is the skeleton. frets.py and board.py pass it their search for points that may touch, their scheduling
of the next check, and their fine steps; it becomes part of their C functions. `slot` is a SLOT, `op` an OPERATOR,
`voice` the string's VOICE; `travel` is how far (m) the string can move in one fine step. [any thread]
"""

import numpy as np

from livebass.compiling import inlined, jit
from livebass.kernels.machine.native import record_at
from livebass.kernels.string import modal
from livebass.kernels.string.records import CONTACT, LONGER, MAX_NEAR, OPERATOR, PART, STRING, UNKNOWN, WHOLE

NEVER = 1 << 60  # a fine step
FAR = 1 << 40  # fine steps: days

string_at = record_at(STRING)
operator_at = record_at(OPERATOR)
contact_at = record_at(CONTACT)
CONTACT_BYTES = CONTACT.itemsize


@jit
def max_travel(slot, op):
    """Farthest (m) that any point of the string moves in one fine step."""
    return slot.fastest * op.fine


@jit
def steps_clear(clearance, travel):
    """Whole fine steps for which a point `clearance` (m) away is sure to stay clear; 0 for NaN."""
    steps = clearance / travel
    if steps > 0.0:
        return np.int64(steps) if steps < FAR else FAR
    return 0


@jit
def clearance_at(slot, op, m):
    """Clearance (m) of point `m` now."""
    return modal.displacement(slot.u, slot.active, op, m) - slot.u.height[m]


@jit
def may_touch(slot, op, m, step, end):
    """Checks point `m`; True if it may touch between `step` and `end`. u.clearance_now[m] gets `end`'s clearance."""
    u, travel = slot.u, max_travel(slot, op)
    clearance = clearance_at(slot, op, m)
    u.clearance_now[m] = clearance
    known = u.known_at[m]
    if 0 <= known < step and u.clearance[m] + clearance > travel * (end - known):
        return False
    if known < step:
        u.clearance[m] = modal.displacement_before_leap(u, slot.active, op, m) - slot.u.height[m]
        u.known_at[m] = step
    held = u.solved_at[m] == step and (u.eta[m] > 0.0 or u.eta_before[m] > 0.0)
    return held or u.clearance[m] <= 0.0 or u.clearance[m] + clearance <= travel * (end - step)


@jit
def suspect_between(slot, op, step, end, first, last, suspects, checks):
    """Checks the points from `first` to before `last` that are due. Returns the new numbers of suspects and checks."""
    for m in range(first, last):
        if end <= slot.u.due[m]:
            continue
        slot.checked[checks] = m
        checks += 1
        if may_touch(slot, op, m, step, end):
            slot.suspects[suspects] = m
            suspects += 1
    return suspects, checks


@inlined
def advance_frame(string, k, op, steps, find_suspects, next_check, fine_steps):
    """Moves slot `k` of a string over one frame of `steps` fine steps from voice.step on; `string`, `op`: addresses.

    find_suspects(slot, op, step, end) fills slot.suspects and slot.checked after a trial leap and returns their counts;
    next_check(slot, op, end) returns the fine step before which no point needs a check after a frame without contact;
    fine_steps(slot, op, voice, near, count, steps, step) takes `steps` fine steps with contact at the `count` points in
    `near` and leaves their clearance.
    """
    s, op = string_at(string), operator_at(op)
    slot, voice = s.slots[k], s.voice
    leap = LONGER if steps > op.steps else WHOLE
    step = voice.step
    end = step + steps
    modal.try_leap(slot.u, slot.active, leap)
    suspects, checks = find_suspects(slot, op, step, end)
    if suspects > 0:
        contact_frame(slot, op, voice, suspects, steps, fine_steps)
        return
    modal.leap(slot.v, slot.v_active, leap)
    note_clear(slot, op, checks, end)
    slot.due = next_check(slot, op, end)


@jit
def note_clear(slot, op, checks, end):
    """Saves the clearances at `end` of the checked points that did not touch."""
    u, travel = slot.u, max_travel(slot, op)
    for i in range(checks):
        m = slot.checked[i]
        u.clearance[m] = u.clearance_now[m]
        u.known_at[m] = end
        u.due[m] = end + steps_clear(u.clearance_now[m], travel)


@inlined
def contact_frame(slot, op, voice, count, steps, fine_steps):
    """Moves `slot` over a frame in which `count` suspects may touch: in parts, with fine steps where needed.

    It starts where the last modal.try_leap of u started.
    """
    u, suspects, travel = slot.u, slot.suspects, max_travel(slot, op)
    step = voice.step
    end = step + steps
    for i in range(count):  # the penetration of a point solved up to `step` is known
        m = suspects[i]
        if u.solved_at[m] == step:
            u.clearance[m] = -u.eta[m]
    for part in range(op.parts):
        if part == 0:
            modal.leap_from_before(u, slot.active, PART)
        else:
            modal.try_leap(u, slot.active, PART)
        close = find_near(slot, op, count, step)
        if close == 0:
            modal.leap(slot.v, slot.v_active, PART)
            for i in range(count):
                u.clearance[suspects[i]] = u.clearance_now[suspects[i]]
        else:
            fine_steps(slot, op, voice, slot.near, close, op.part_steps, step)
            update_clearances(slot, op, count, close)
        step += op.part_steps
    if step < end:
        if op.parts > 0:
            modal.keep(u, slot.active)
        fine_steps(slot, op, voice, suspects, count, end - step, step)
    for i in range(count):
        m = suspects[i]
        u.known_at[m] = end
        u.due[m] = end
        if u.clearance[m] > 0.0:
            u.due[m] = end + steps_clear(u.clearance[m], travel)
    slot.due = end


@jit
def find_near(slot, op, count, step):
    """Fills slot.near with the suspects that may touch within the tried part, which begins at `step`.

    u.clearance_now receives the clearances at its end; over a board a lower bound if that is enough.
    """
    u, reach = slot.u, max_travel(slot, op) * op.part_steps
    close = np.int64(0)  # a constant would have its own type
    for i in range(count):
        m = slot.suspects[i]
        before = u.clearance[m]
        held = u.solved_at[m] == step and u.eta_before[m] > 0.0
        if op.points > MAX_NEAR and not held and before > reach:
            u.clearance_now[m] = before - reach
            continue
        clearance = clearance_at(slot, op, m)
        u.clearance_now[m] = clearance
        if held or before <= 0.0 or before + clearance <= reach:
            slot.near[close] = m
            close += 1
    return close


@jit
def update_clearances(slot, op, count, close):
    """Updates the clearances of the suspects that a part's fine steps did not include.

    Over a board it assumes that the string came as near as it can; only if that may touch does it compute the value.
    """
    u, reach = slot.u, max_travel(slot, op) * op.part_steps
    k = 0
    for i in range(count):
        m = slot.suspects[i]
        if k < close and slot.near[k] == m:
            k += 1
            continue
        u.clearance[m] -= reach
        if op.points <= MAX_NEAR or u.clearance[m] <= 0.0:
            u.clearance[m] = clearance_at(slot, op, m)


@jit
def invalidate_contact(w, op):
    """Marks the penetrations at a polarisation's contact points as unknown."""
    w.solved_at[: op.points] = UNKNOWN


@jit
def is_touching(slot, op, step):
    """True if the string presses on an obstacle at fine step `step`, the end of a frame."""
    if slot.due > step:
        return False
    for m in range(op.points):
        if slot.u.solved_at[m] == step and (slot.u.eta[m] > 0.0 or slot.u.eta_before[m] > 0.0):
            return True
    return False


@jit
def log_contact(slot, voice, step, m, speed):
    """Counts a contact at point `m` that begins at `step` with a `speed` (m/s), and logs it if there is room."""
    slot.touching += 1
    if voice.log_room > 0:
        contact = contact_at(voice.log + CONTACT_BYTES * (voice.logged % voice.log_room))
        contact.step = step
        contact.point = m
        contact.fret = slot.fret
        contact.speed = speed
    voice.logged += 1
