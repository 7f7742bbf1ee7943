"""How hands sound a string: plucks, strikes, hammer-ons, pull-offs and slides, by force. [audio thread]"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands.techniques import grazing
from livebass.kernels.machine.elementary import chance, cos, exp2, log2, power
from livebass.kernels.player.events import emit, lay
from livebass.kernels.player.expression import SLIDE_TIME
from livebass.kernels.player.performer import FINGER, PICK
from livebass.kernels.player.touches import (
    GHOST_FORCE,
    GHOST_FRETS,
    GHOST_PLACE,
    GHOST_RESISTANCE,
    GHOST_WIDTH,
    lay_on_node,
    lay_palm,
)
from livebass.kernels.string.records import GLIDE, HAMMER, MOST_NEAR, PLUCK, PULL_OFF, STRIKE_EVENT, THROW, TOUCHES
from livebass.kernels.string.touch import impedance
from livebass.techniques import DOWN_STROKE, HARMONIC, LEFT_SLAP, PALM, UP_STROKE

LEAST_PLUCK, LEAST_STRIKE = 0.47, 0.12  # of the length: no nearer to the stop; the middle itself has no even partials
MOST_PLACE = 0.99  # of the length
LEAST_GRAZE = 1e-4  # m, where a string lies on a fret
UNEVEN_PLACE = 0.1  # m, for an unevenness of 1
LEAST_FORCE = 1e-3  # multiple of the grazing apex: a curve cannot start at zero
# The left hand that slaps the strings: fret, kg, half width (m) and stiffness (N/m^1.5) of its fingers
LEFT_FRET, LEFT_MASS, LEFT_WIDTH, LEFT_STIFFNESS = 7, 0.06, 15e-3, 3e5
LEFT_SPEED = 0.5  # of that by which a pluck of the same force moves the string
FASTEST_STRIKE = 8.0  # m/s: no hand is faster
# What plucks, with half widths (m), release times (s), place (part of the open string), angle (rad), and how far it
# lifts the string from the neck, over a finger. 0: the player's own, as all are of a finger. Estimates: the tip of a
# pick bends and slips off where flesh rolls; a pop pulls the string up. A pick's place and release times are such that
# notes brighten by 4 dB from velocity 30 to 60 and to 90, and click by 8 dB more than a finger's at the least of these.
SOFT_WIDTH, HARD_WIDTH = (0.0, 1.5e-3, 2.5e-3, 3e-3), (0.0, 1e-3, 2e-3, 2.5e-3)
SOFT_RELEASE, HARD_RELEASE = (0.0, 240e-6, 400e-6, 300e-6), (0.0, 12e-6, 40e-6, 30e-6)
STROKE_PLACE, STROKE_ANGLE, STROKE_LIFT = (0.0, 0.94, 0.0, 0.70), (0.0, 0.8, 0.0, 0.2), (1.0, 0.75, 1.0, 1.7)
PICK_NEARER = 60e-3  # m, of a hard stroke, not a soft one
# Of a stroke that goes up, not down: m, factor, rad. A pickup hears v with its sign: mirrored, a stroke up would be
# 2.7 dB under one down; it lifts the string out of that more than one down does.
UP_NEARER, UP_LEVEL, UP_ANGLE = 3e-3, 0.89, -0.5
# The middle finger plucks otherwise than the index, which it follows; of an even player they are the same
MIDDLE_NEARER, MIDDLE_LEVEL, MIDDLE_RELEASE = 4e-3, 0.933, 0.9  # m, factors
RAKE = 80e-3  # s within which a finger goes on to a lower string, by which it does not take turns
UNEVEN_TIP, UNEVEN_ANGLE = 1.6, 0.5  # part of width and release, rad, for an unevenness of 1
MORE_CHANCE = 1 << 40  # chances beyond those of force and place
# A hand plays a shorter string more gently, by this power of its part of the open length: the same force would be heard
# up to 8 dB louder near the body, where a pickup lies under the middle of the string and no fret takes its fundamental;
# that of a pop, which frets take most from, up to 15 dB.
GENTLER, THUMB_GENTLER = (0.5, 0.5, 0.5, 0.8), 0.2  # likewise of the speed of a thumb with a mass
PRESSED_APEX = 0.8  # of the way down to the frets that a stroke towards the neck may pull the string
GUEST_THUMB = 0.38  # part of a strike's depth on a bass whose level is that of fingers
HAMMER_SPEED = 0.36  # speed of a finger that hammers over that by which a pluck of the same force moves the string
HAMMER_LANDING = 4e-3  # s in which the finger that hammers damps a string that sounds
TAP_LIFTING = 0.5e-3  # s in which fingers leave a string that is tapped
# m across, by which the finger of a pull-off takes the string along: to the side where pickups hear it with what the
# string does as it leaves its fret, not against that
LEAST_PULL, MOST_PULL = 0.1e-3, 0.9e-3


@jit
def over_body(open_op, op, place, aside, least):
    """Distance (m) from the stop of a hand over the body at `place` (fraction of the open string), `aside` m off it.

    Kept on the string, and no nearer to the stop than the part `least` of the length.
    """
    where = op.length - (1.0 - place) * open_op.length + aside
    return min(max(where, least * op.length), MOST_PLACE * op.length)


@jit
def soft_limit(x, most):
    """Soft limit: about x when small, increasing, always below `most`."""
    return x / np.sqrt(np.sqrt(1.0 + (x / most) ** 4))


@jit
def strength(p, part):
    """Force of the hand at `part` of the way from the softest to the hardest, in those that graze a fret (`pull`)."""
    softest = max(p.softest, LEAST_FORCE)
    return p.dynamics * softest * power(p.hardest / softest, part)


@jit
def pull(open_op, op, where, gentler):
    """Returns the apex (m) at `where` (m from the stop) of the force that has the open string just graze a fret.

    That is a pluck of the open string as far from the saddle. The same force pulls a shorter string less far, as
    x (L - x) / L, and hands play it by the power `gentler` of its length.
    """
    x = open_op.length - (op.length - where)
    part = op.length / open_op.length
    apex = max(grazing(open_op, x), LEAST_GRAZE)
    return apex * where / (x * part) * power(part, gentler)


@jit
def speed_of_pluck(p, op, i, force):
    """Speed (m/s) at which the corner of a pluck by `force` passes along the open string `i`: c F / T."""
    x = over_body(op, op, p.usual_position, 0.0, LEAST_PLUCK)
    return p.slack[i] * force * pull(op, op, x, 0.0) * op.length / (x * (op.length - x)) * op.speed


@jit
def hardness(p, force):
    """How hard a force is, from 0, the player's softest, to 1, the hardest: by its logarithm."""
    softest = max(p.softest, LEAST_FORCE)
    if p.hardest <= softest or force <= softest:
        return 1.0 if force >= p.hardest else 0.0
    return min(log2(force / softest) / log2(p.hardest / softest), 1.0)


@jit
def between(soft, hard, hardness):
    """Returns `soft` at hardness 0 and `hard` at 1, evenly in its logarithm; where `soft` is 0 it is always `hard`."""
    if soft == 0.0 or hard == 0.0:
        return hard
    return hard * power(soft / hard, 1.0 - hardness)


@jit
def place(p, x):
    """Position for PLUCK_POSITION `x`: -1 nearest to the bridge, 1 farthest from it, 0 the usual one."""
    if x < 0.0:
        return p.usual_position - x * (p.farthest - p.usual_position)
    return p.usual_position + x * (p.nearest - p.usual_position)


@jit
def stroke(p, ops, i, fret, node, part, ghost, own_place, frame, events, count):
    """Plucks or strikes string `i` at `fret`, at `part` of the way from the softest to the hardest.

    `node`: the number of a natural harmonic, on whose node a finger lies; 0: none.
    """
    ghost = ghost or p.switched[LEFT_SLAP] > 0
    left = p.switched[LEFT_SLAP] > 0 and ops[i, 0].points <= MOST_NEAR  # a mass over a board takes too long to compute
    stop = 0 if ghost else fret
    op = ops[i, stop]
    force = strength(p, part)
    force *= 1.0 + p.unevenness * chance(p.seed, 2 * p.notes)
    if ghost and not left:
        force *= GHOST_FORCE
    aside = UNEVEN_PLACE * p.unevenness * chance(p.seed, 2 * p.notes + 1)
    if left:
        speed = LEFT_SPEED * speed_of_pluck(p, ops[i, 0], i, STROKE_LIFT[p.stroke] * force)
        where = op.length - ops[i, min(LEFT_FRET, p.frets)].length
        count = emit(events, count, frame, THROW, i, stop, soft_limit(speed, FASTEST_STRIKE), where)
        e = events[count - 1]
        e.z = LEFT_MASS
        e.t = LEFT_WIDTH
        e.w = LEFT_STIFFNESS
    elif i < p.slapped and node == 0:
        where = over_body(ops[i, 0], op, p.strike_position, aside, LEAST_STRIKE)
        if p.thumb_mass > 0.0:
            speed = p.strike_softest * power(p.strike_hardest / p.strike_softest, part)
            speed *= p.dynamics * (1.0 + p.unevenness * chance(p.seed, 2 * p.notes)) * (GHOST_FORCE if ghost else 1.0)
            speed *= power(op.length / ops[i, 0].length, THUMB_GENTLER)
            if op.points == 0:  # at the last fret no other stops the thumb: it comes no deeper than a hand pulls
                give = where * (op.length - where) / op.length / (impedance(op) * op.speed)  # m/N, of the string
                speed = soft_limit(speed, p.greatest / np.sqrt(give * p.thumb_mass))
            count = emit(events, count, frame, THROW, i, stop, soft_limit(speed, FASTEST_STRIKE), where)
        else:
            depth = p.strike_force * np.sqrt(p.slack[i])  # the thumb gives every string the same speed
            depth *= soft_limit(force * max(grazing(ops[i, 0], 0.5 * ops[i, 0].length), LEAST_GRAZE), p.greatest)
            if p.usual_slapped == 0:
                depth *= GUEST_THUMB
            count = emit(events, count, frame, STRIKE_EVENT, i, stop, depth, where)
    else:
        position = place(p, own_place) if not np.isnan(own_place) else p.position
        touched = node if node > 0 else 2 if p.switched[HARMONIC] > 0 else 0
        count = pluck(p, ops[i, 0], op, i, stop, force, position, aside, touched, frame, events, count)
        if touched > 0:
            count = lay_on_node(op, i, touched, frame, events, count)
    if p.palm > 0.0 or p.switched[PALM] > 0:
        count = lay_palm(p, ops, i, frame, events, count)
    if ghost:
        at = float(LEFT_FRET if left else fret if fret > 0 else GHOST_PLACE)
        for k in range(2):
            finger_place = ops[i, 0].length * exp2(-(at + GHOST_FRETS[k]) / 12.0)
            resistance = GHOST_RESISTANCE * impedance(op)
            count = lay(events, count, frame, i, 2 + k, finger_place, resistance, GHOST_WIDTH, 0.0)
    return count


@jit
def pluck(p, open_op, op, i, stop, force, position, aside, touched, frame, events, count):
    """Plucks string `i` at `position`, `aside` m off it: the shape, and how it is let go, follow the force.

    `touched`: the harmonic that another finger brings out, whose pluck has a place of its own; 0: none.
    """
    hard = hardness(p, force)
    uneven = 1.0 + UNEVEN_TIP * p.unevenness * chance(p.seed, MORE_CHANCE + 2 * p.notes)
    turned = UNEVEN_ANGLE * p.unevenness * chance(p.seed, MORE_CHANCE + 2 * p.notes + 1)
    shift = aside + (PICK_NEARER if p.stroke == PICK else p.nearer) * (hard - 0.5)
    angle, lift, level = p.angle, STROKE_LIFT[p.stroke], 1.0
    if p.stroke == FINGER:
        width = between(p.rounding_soft, p.rounding, hard)
        release = between(p.release_soft, p.release, hard)
    else:
        width = between(SOFT_WIDTH[p.stroke], HARD_WIDTH[p.stroke], hard)
        release = between(SOFT_RELEASE[p.stroke], HARD_RELEASE[p.stroke], hard)
    if STROKE_PLACE[p.stroke] > 0.0:
        position += STROKE_PLACE[p.stroke] - p.usual_position
    if STROKE_ANGLE[p.stroke] > 0.0:
        angle = STROKE_ANGLE[p.stroke]
        lift *= abs(cos(p.angle)) / cos(angle)
    take_turns(p, op, i, frame)
    if p.other and p.stroke == PICK:
        angle = UP_ANGLE
        shift += UP_NEARER
        level = UP_LEVEL
    elif p.other and p.unevenness > 0.0:
        shift += MIDDLE_NEARER
        level = MIDDLE_LEVEL
        release *= MIDDLE_RELEASE
    p.other = 1 - p.other
    where = over_body(open_op, op, position, shift, LEAST_PLUCK)
    if touched > 0:
        where = min(op.length - 0.5 * op.length / touched + aside, MOST_PLACE * op.length)
    apex = level * p.slack[i] * soft_limit(lift * force * pull(open_op, op, where, GENTLER[p.stroke]), p.greatest)
    if angle != 0.0:
        angle += turned
        if cos(angle) < 0.0:
            apex = min(apex, PRESSED_APEX * max(grazing(op, op.length - where), LEAST_GRAZE) / -cos(angle))
    count = emit(events, count, frame, PLUCK, i, stop, apex, where)
    e = events[count - 1]
    e.z = uneven * width
    e.t = uneven * release
    e.w = angle
    return count


@jit
def take_turns(p, op, i, frame):
    """Sets p.other for the stroke on string `i`: a finger that rakes, on to a lower string, goes on itself."""
    seconds = (frame - p.stroked_at) * op.steps * op.fine
    if p.stroke != PICK and i < p.stroked and seconds <= RAKE:
        p.other = 1 - p.other
    p.stroked = i
    p.stroked_at = frame
    if p.switched[DOWN_STROKE] > 0:
        p.other = 0
    elif p.switched[UP_STROKE] > 0:
        p.other = 1


@jit
def press(p, ops, i, before, fret, part, frame, slides, events, count):
    """Has string `i` go from fret `before` to `fret` by the left hand: hammer-on, pull-off or slide.

    `part` is of the way from the softest to the hardest.
    """
    if slides:
        return emit(events, count, frame, GLIDE, i, fret, SLIDE_TIME, 0.0)
    if fret > before:
        finger = HAMMER_SPEED * speed_of_pluck(p, ops[i, 0], i, strength(p, part))
        return emit(events, count, frame, HAMMER, i, fret, finger, HAMMER_LANDING)
    return emit(events, count, frame, PULL_OFF, i, fret, -(LEAST_PULL + (MOST_PULL - LEAST_PULL) * part), 0.0)


@jit
def tap(p, ops, i, fret, part, frame, events, count):
    """Has string `i` hammered down to `fret`, whatever it does: fingers that ended its last note come off."""
    for k in range(TOUCHES):
        count = lay(events, count, frame, i, k, 0.0, 0.0, 0.0, TAP_LIFTING)
    count = press(p, ops, i, -1, fret, part, frame, False, events, count)
    if p.palm > 0.0 or p.switched[PALM] > 0:
        count = lay_palm(p, ops, i, frame, events, count)
    return count
