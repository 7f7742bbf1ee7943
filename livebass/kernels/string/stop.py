"""Moves the string's end at its stop when a finger presses it to another fret: hammer-on, slide, any fret change.

The displacement is u = sum q_m phi_m + b l(x), l(x) = (L - x) / L, with b the displacement of the end at the stop.
While b' is constant the modes move as if the stop stood still; when it changes they get a kick,
v_m <- v_m - l_m (b'_new - b'_old) with l_m = sqrt(2 L) / (pi m), the projection of l. This is exact for a path b(t) of
straight lines between frames. A hammering finger moves the end with constant acceleration and stops dead on the crown:
the last kick is the snap; the way before makes little sound. A finger that only presses the string down comes to rest
gently, by a fifth-degree polynomial in time.

Contact is off while the stop moves, for a few milliseconds: a string that ends above a fret is lifted off the next
frets. After that the string may be a few micrometres inside an obstacle, where contact would hold energy that nobody
put in; such an obstacle starts that much lower, and rises to its height while the string is clear of it. A crown that
carries the string at rest rises under it, too: the finger presses the string down over the crown (draped.py). `slot` is
a SLOT, `op` its operator. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.machine.elementary import exp
from livebass.kernels.string import modal
from livebass.kernels.string.frame import invalidate_contact
from livebass.kernels.string.operators import heights
from livebass.kernels.string.records import UNKNOWN
from livebass.kernels.string.slot import wake_slot

SHORTEST, LONGEST = 0.25e-3, 32e-3  # s, limits of a hammering finger's time to the fret
ROOM = 2e-6  # m, between the string and an obstacle freed from it
GENTLE = 4e-3  # s that a finger takes without hammering
FARTHEST, OVERSHOOT = 5e-3, 0.2  # m that a fast string carries the finger on; the same over first speed and duration
SETTLING = 1e-3  # s, time constant that fades out the step between two rest lines (at two frets) in the signal
RISING = 20e-3  # m/s of a crown that a finger presses the string on
NEAREST = 1e-9  # m: closer than this to rest, the end is at rest


@jit
def begin_path(stop, place, speed, finger, voice):
    """Begins the path of a string's end from `place` (m) and `speed` (m/s) to rest.

    A finger moves it and arrives at `finger` m/s; with 0 it comes to rest gently, within GENTLE seconds. A fast string
    is stopped sooner.
    """
    stop.place = place
    stop.speed = speed
    stop.first = speed
    stop.frame = 0
    stop.wanted = max(finger, 0.0)
    stop.away = place
    seconds = min(max(2.0 * abs(place) / finger, SHORTEST), LONGEST) if finger > 0.0 else GENTLE
    if abs(speed) * OVERSHOOT * seconds > FARTHEST:
        seconds = max(FARTHEST / (OVERSHOOT * abs(speed)), SHORTEST)
    stop.blend = max(1, np.int64(np.rint(seconds * voice.rate)))


@jit
def next_speed(stop, h):
    """The speed (m/s) in the next frame, of `h` s, on the way to rest."""
    stop.frame += 1
    t = min(stop.frame / stop.blend, 1.0)
    if stop.wanted == 0.0:
        x = stop.away * (1.0 - t * t * t * (10.0 - t * (15.0 - 6.0 * t)))
        x += stop.first * stop.blend * h * (t - t * t * t * (6.0 - t * (8.0 - 3.0 * t)))
    else:
        x = stop.away * (1.0 - t * t) + stop.first * stop.blend * h * t * (1.0 - t) * (1.0 - t)
    return (x - stop.place) / h


@jit
def advance_end(stop, w, op, h, n):
    """Moves the end by one frame, and kicks the modes if its speed changes; returns True once it is at rest."""
    stop.place += stop.speed * h
    if abs(stop.place) < NEAREST:
        stop.place = 0.0
    speed = next_speed(stop, h) if stop.place != 0.0 else 0.0
    if speed != stop.speed:
        modal.kick_end(w, n, (stop.speed - speed) * np.sqrt(2.0 * op.length) / np.pi)
        stop.speed = speed
    return stop.place == 0.0


@jit
def advance_stop(slot, op, h, after):
    """Moves the stop by a frame of `h` s, which ended at fine step `after`; once at rest, contact is on again."""
    done = advance_end(slot.stop_u, slot.u, op, h, op.modes)
    slot.active = op.padded
    if slot.v_ready:
        done = advance_end(slot.stop_v, slot.v, op, h, op.modes) and done
        slot.v_active = op.padded
    if done:
        slot.moving = 0
        lower_obstacles(slot, op)
        invalidate_contact(slot.v, op)
        wake_slot(slot, op, after)


@jit
def fade_offset(slot, rate):
    """Fades the offset between old and new rest line by one frame, critically damped, over about 1 ms."""
    pole = exp(-1.0 / (SETTLING * rate))
    toward = slot.offset_speed + slot.offset / SETTLING
    slot.offset = pole * (slot.offset + toward / rate)
    slot.offset_speed = pole * (slot.offset_speed - toward / (SETTLING * rate))
    if abs(slot.offset) + abs(slot.offset_speed) * SETTLING < NEAREST:
        slot.offset = 0.0
        slot.offset_speed = 0.0


@jit
def lower_obstacles(slot, op):
    """Lowers each obstacle in the string, or within ROOM of it, to ROOM below the string."""
    u, height = slot.u, heights(op)
    invalidate_contact(u, op)
    slot.sunk = 0
    modal.keep_step_before(u, slot.active)
    for m in range(op.points):
        now = modal.displacement(u, slot.active, op, m)
        before = modal.displacement_before_leap(u, slot.active, op, m)
        u.height[m] = min(height[m], min(now, before) - ROOM)
        if u.height[m] < height[m]:
            slot.sunk += 1


@jit
def raise_obstacles(slot, op, after):
    """Raises each lowered obstacle by half of its clearance at fine step `after`; carrying ones always."""
    u, height, step = slot.u, heights(op), RISING * op.steps * op.fine
    left = np.int64(0)
    modal.keep_step_before(u, slot.active)
    for m in range(op.points):
        if u.height[m] == height[m]:
            continue
        now = modal.displacement(u, slot.active, op, m)
        before = modal.displacement_before_leap(u, slot.active, op, m)
        clear = min(now, before) - u.height[m]
        rise = 0.5 * clear if clear > 0.0 else 0.0
        if height[m] > 0.0:
            rise = max(rise, step)
        if rise > 0.0:
            u.height[m] = min(height[m], u.height[m] + rise)
            u.solved_at[m] = UNKNOWN
        if u.height[m] != height[m]:
            left += 1
    slot.sunk = left
    wake_slot(slot, op, after)
