"""The right hand: turns a force into the shape and speed of a pluck or a strike. [audio thread]

A row of `p.strokes`, a STROKE (constants.py), describes what plucks. `op` is the string's operator at the fret that
stops it, `open_op` the open string's.
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands.pulling import MIN_GRAZE, grazing, unit_apex
from livebass.kernels.machine.elementary import chance, cos, exp2, log2, power, square
from livebass.kernels.machine.native import copy_record
from livebass.kernels.machine.noise import amplitude
from livebass.kernels.player import touches
from livebass.kernels.player.constants import PICK, STROKES
from livebass.kernels.player.events import next_event, send_pluck, send_throw
from livebass.kernels.string.records import MAX_NEAR, STRIKE_EVENT
from livebass.kernels.string.touch import characteristic_impedance
from livebass.rows import techniques
from livebass.rows.units import OFF

MIN_PLUCK, MIN_STRIKE = 0.47, 0.12  # of the length: no nearer to the stop; the exact middle has no even partials
MAX_PLACE = 0.99  # of the length
DEFAULT_PLACE = 0.8  # of the length: a typical place to pluck
MIN_FORCE = 1e-3  # multiple of the grazing apex: a curve cannot start at zero
FASTEST_STRIKE = 8.0  # m/s: no hand is faster
THUMB_GENTLER = 0.2  # a thumb's force on a shorter string is scaled by its part of the open length to this power
GUEST_THUMB = 0.24  # part of a strike's depth on a bass levelled for fingers
HEARD_ACROSS = 0.45  # of a motion across the pickups, over the same motion towards them
PRESSED_APEX = 0.8  # part of the way to the frets that a stroke towards the neck may pull the string
RAKE = 80e-3  # s: a finger that moves to a lower string within this time rakes instead of alternating
# For an unevenness of 1: m; part of width and release; rad
UNEVEN_PLACE, UNEVEN_TIP, UNEVEN_ANGLE = 0.1, 1.6, 0.5
# Skin noise: its level over the corner's speed, as coil and tone take some of it; dB less for the softest than for the
# hardest (velocities 60, 90 and 127 give -24, -7 and 0 dB); the part heard from a pluck straight across
SKIN, SKIN_SOFTER, MIN_SKIN = 1.4, 95.0, 0.2
CLICK = 5.0  # the same for a pick's noise
MIN_PINCH, MAX_PINCH = 3, 8  # partials of pinch harmonics
PINCH_THUMB = 10e-3  # m from the pick to the thumb that touches the node behind it
MORE_CHANCE, HUMAN_CHANCE = 1 << 40, 1 << 41  # random numbers beyond those for force and place
MILLI = 1e-3
# The left hand's slap: fret, kg, half width (m) and stiffness (N/m^1.5) of its fingers
LEFT_FRET, LEFT_MASS, LEFT_WIDTH, LEFT_STIFFNESS = 7, 0.06, 15e-3, 3e5
LEFT_SPEED = 0.5  # part of the string's speed after a pluck of the same force


@jit
def fill_strokes(p, given):
    """Fills a performer's strokes from the `given` ones, with the player's own numbers in place of 0."""
    player = p.player
    for k in range(STROKES):
        row = p.strokes[k]
        copy_record(row, given[k])
        if row.hard_width == 0.0:
            row.soft_width = player.rounding_soft
            row.hard_width = player.rounding
        if row.hard_release == 0.0:
            row.soft_release = player.release_time_soft
            row.hard_release = player.release_time
        if row.place == 0.0:
            row.place = player.pluck_position
        if row.angle == 0.0:
            row.angle = player.pluck_angle
        if row.nearer == 0.0:
            row.nearer = player.nearer_when_hard


@jit
def part_at(p, velocity):
    """The part of a velocity, 0 for the softest note to 1 for the hardest, by the bass's curve and the player's."""
    part, curve = p.part[velocity], p.controls.settings[techniques.VELOCITY_CURVE]
    return part if curve == 0.0 or part == 0.0 else power(part, exp2(curve))


@jit
def force_at(p, part):
    """Force of the hand, as a multiple of the grazing force (`apex_by`); `part`: 0 the softest, 1 the hardest."""
    softest = max(p.player.softest, MIN_FORCE)
    return p.dynamics * softest * power(p.player.hardest / softest, part)


@jit
def hardness(p, force):
    """A force's hardness on a log scale, from 0, the player's softest, to 1, the hardest."""
    softest, hardest = max(p.player.softest, MIN_FORCE), p.player.hardest
    if hardest <= softest or force <= softest:
        return 1.0 if force >= hardest else 0.0
    return min(log2(force / softest) / log2(hardest / softest), 1.0)


@jit
def between(soft, hard, hardness):
    """Interpolates on a log scale: `soft` at hardness 0, `hard` at 1; always `hard` if `soft` is 0."""
    if soft == 0.0 or hard == 0.0:
        return hard
    return hard * power(soft / hard, 1.0 - hardness)


@jit
def soft_limit(x, maximum):
    """Soft limit: about x when small, increasing, always below `maximum`."""
    return x / np.sqrt(np.sqrt(1.0 + square(square(x / maximum))))


@jit
def over_body(open_op, op, place, aside, minimum):
    """Distance (m) from the stop to a hand over the body at `place` (fraction of the open string), `aside` m off it.

    Stays on the string, and no nearer to the stop than `minimum` of the length.
    """
    where = op.length - (1.0 - place) * open_op.length + aside
    return min(max(where, minimum * op.length), MAX_PLACE * op.length)


@jit
def position_at(p, x):
    """Position for PLUCK_POSITION `x`: -1 nearest to the bridge, 1 farthest from it, 0 the usual position."""
    default = p.player.pluck_position
    if x < 0.0:
        return default - x * (p.player.pluck_farthest - default)
    return default + x * (p.player.pluck_nearest - default)


@jit
def apex_by(open_op, op, where, gentler):
    """Returns the apex (m) at `where` (m from the stop) for the force that makes the open string just graze a fret.

    The open string is plucked at the same distance from the saddle. The same force pulls a shorter string less far, as
    x (L - x) / L, and hands scale it by its part of the length to the power `gentler`.
    """
    x = open_op.length - (op.length - where)
    part = op.length / open_op.length
    return unit_apex(open_op, x) * where / (x * part) * power(part, gentler)


@jit
def speed_of_pluck(p, op, i, force):
    """Speed (m/s) of the open string `i` after a pluck of `force` at DEFAULT_PLACE: c F / T.

    The left hand is equally fast wherever the right one plucks.
    """
    return speed_of_corner(p, op, i, force, DEFAULT_PLACE * op.length)


@jit
def speed_of_corner(p, op, i, force, x):
    """`speed_of_pluck` for a pluck at `x` (m)."""
    return p.slack[i] * force * apex_by(op, op, x, 0.0) * op.length / (x * (op.length - x)) * op.speed


@jit
def corner_speed(op, apex, where):
    """Speed (m/s) that the corner of a pluck gives the string; its `apex` (m) is at `where` (m from the stop)."""
    return 0.5 * apex * op.length / (where * (op.length - where)) * op.speed


@jit
def play_stroke(p, ops, i, fret, node, part, ghost, own_place):
    """Plucks or strikes string `i` at `fret`; `part`: 0 is the softest, 1 the hardest.

    `node`: number of the natural harmonic whose node a finger touches; 0: none. `own_place`: the note's own
    PLUCK_POSITION; NaN: none.
    """
    ghost = ghost or p.switched[techniques.LEFT_SLAP] > 0
    # A mass over a board takes too long to compute.
    left = p.switched[techniques.LEFT_SLAP] > 0 and ops[i, 0].points <= MAX_NEAR
    stop = 0 if ghost else fret
    uneven = 1.0 + p.unevenness * chance(p.seed, 2 * p.notes)
    aside = UNEVEN_PLACE * p.unevenness * chance(p.seed, 2 * p.notes + 1)
    weaker = touches.GHOST_FORCE if ghost and not left else 1.0
    if p.controls.settings[techniques.HUMANISE_FORCE] > 0.0:
        decibels = p.controls.settings[techniques.HUMANISE_FORCE] * chance(p.seed, HUMAN_CHANCE + 2 * p.notes)
        weaker *= power(10.0, decibels / 20.0)
    later = 0.5 + 0.5 * chance(p.seed, HUMAN_CHANCE + 2 * p.notes + 1)
    p.hands.late = MILLI * p.controls.settings[techniques.HUMANISE_TIME] * later
    force = force_at(p, part) * uneven * weaker
    position = position_at(p, own_place) if not np.isnan(own_place) else p.position
    touched = node if node > 0 else artificial_partial(p, ops, i, stop, position)
    if left:
        slap_left(p, ops, i, force)
    elif i < p.slapped and touched == 0 and p.player.thumb_mass > 0.0:
        throw_thumb(p, ops, i, stop, part, uneven, weaker, aside)
    elif i < p.slapped and touched == 0:
        strike_string(p, ops, i, stop, force, aside)
    else:
        touched = 2 if touched == 0 and p.switched[techniques.HARMONIC] > 0 else touched
        pluck_string(p, ops, i, stop, force, position, aside, touched)
        if touched > 0:
            touches.touch_node(p, ops[i, stop], i, touched)
    if touches.palm_is_on(p):
        touches.touch_palm(p, ops, i)
    touches.leave_string(p, i)
    if ghost:
        p.hands.ghosted |= 1 << i
        touches.touch_ghost(p, ops, i, stop, float(LEFT_FRET if left else fret if fret > 0 else touches.GHOST_PLACE))


@jit
def artificial_partial(p, ops, i, stop, position):
    """Returns the partial that a finger of the right hand brings out, by the held keys; 0: none."""
    if p.switched[techniques.PINCH] > 0:  # the thumb touches the node nearest to the plucking place
        length = ops[i, stop].length
        aside = (1.0 - position - p.strokes[p.stroke].place + p.player.pluck_position) * ops[i, 0].length
        return max(np.int64(np.rint(length / max(aside, length / MAX_PINCH))), MIN_PINCH)
    for n in range(techniques.ARTIFICIALS):
        if p.switched[techniques.ARTIFICIAL + n] > 0:
            return np.int64(2 + n)
    return np.int64(0)


@jit
def slap_left(p, ops, i, force):
    """Slaps the open string `i` on the neck with the fingers of the left hand."""
    op = ops[i, 0]
    speed = LEFT_SPEED * speed_of_pluck(p, op, i, p.strokes[p.stroke].lift * force)
    where = op.length - ops[i, min(LEFT_FRET, p.frets)].length
    send_throw(p, i, np.int64(0), soft_limit(speed, FASTEST_STRIKE), where, LEFT_MASS, LEFT_WIDTH, LEFT_STIFFNESS)


@jit
def throw_thumb(p, ops, i, stop, part, uneven, weaker, aside):
    """Throws a thumb with a mass on string `i`; `uneven` and `weaker` are factors for its speed."""
    op, player = ops[i, stop], p.player
    where = over_body(ops[i, 0], op, player.strike_position, aside, MIN_STRIKE)
    speed = player.strike_softest * power(player.strike_hardest / player.strike_softest, part)
    speed *= p.dynamics * uneven * weaker
    speed *= power(op.length / ops[i, 0].length, THUMB_GENTLER)
    if op.points == 0:  # no fret beyond the last stops the thumb: it goes no deeper than a hand pulls
        give = where * (op.length - where) / op.length / (characteristic_impedance(op) * op.speed)  # m/N, of the string
        speed = soft_limit(speed, player.greatest_apex / np.sqrt(give * player.thumb_mass))
    send_throw(p, i, stop, soft_limit(speed, FASTEST_STRIKE), where, 0.0, 0.0, 0.0)


@jit
def pull_angle(p, row, hard):
    """The angle (rad) of a pull of hardness `hard` by the stroke `row`: only the player's own angle turns."""
    return row.angle + p.player.angle_when_hard * hard if row.angle == p.player.pluck_angle else row.angle


@jit
def heard_part(angle):
    """The part of a pull at `angle` that a pickup hears. A guest's thumb is as loud as what else plucks the bass."""
    return np.sqrt(square(cos(angle)) + square(HEARD_ACROSS) * (1.0 - square(cos(angle))))


@jit
def strike_string(p, ops, i, stop, force, aside):
    """Strikes string `i` with a thumb; its impulse gives every string the same speed."""
    open_op, player = ops[i, 0], p.player
    where = over_body(open_op, ops[i, stop], player.strike_position, aside, MIN_STRIKE)
    depth = player.strike_force * np.sqrt(p.slack[i])
    depth *= soft_limit(force * unit_apex(open_op, 0.5 * open_op.length), player.greatest_apex)
    if p.default_slapped == 0:
        depth *= GUEST_THUMB * heard_part(pull_angle(p, p.strokes[p.default_stroke], hardness(p, force)))
    e = next_event(p, i, STRIKE_EVENT)
    e.wait = p.hands.late
    e.fret = stop
    e.apex = depth
    e.place = where


@jit
def pluck_string(p, ops, i, stop, force, position, aside, touched):
    """Plucks string `i` at `position`, `aside` m off it: shape and release follow the force.

    `touched`: the harmonic that another finger brings out, plucked at a place of its own; 0: none.
    """
    open_op, op, player, row = ops[i, 0], ops[i, stop], p.player, p.strokes[p.stroke]
    hard = hardness(p, force)
    uneven = 1.0 + UNEVEN_TIP * p.unevenness * chance(p.seed, MORE_CHANCE + 2 * p.notes)
    width = between(row.soft_width, row.hard_width, hard)
    release = between(row.soft_release, row.hard_release, hard)
    shift = aside + row.nearer * (hard - 0.5)
    angle, lift, level = pull_angle(p, row, hard), row.lift, 1.0
    if row.angle != player.pluck_angle:
        lift *= abs(cos(player.pluck_angle)) / cos(angle)
    if is_other(p, op, i) and (row.two_ways or p.unevenness > 0.0):
        shift += row.other_nearer
        level = row.other_level
        release *= row.other_release
        angle = row.other_angle if row.other_angle != 0.0 else angle
    if touched > 0:
        beside = PINCH_THUMB - op.length / touched if p.switched[techniques.PINCH] > 0 else -0.5 * op.length / touched
        where = min(op.length + beside + aside, MAX_PLACE * op.length)
    else:
        where = over_body(open_op, op, position + (row.place - player.pluck_position), shift, MIN_PLUCK)
    apex = soft_limit(lift * force * apex_by(open_op, op, where, row.gentler), player.greatest_apex)
    apex = level * p.slack[i] * apex
    if angle != 0.0:
        angle += UNEVEN_ANGLE * p.unevenness * chance(p.seed, MORE_CHANCE + 2 * p.notes + 1)
        if cos(angle) < 0.0:
            apex = min(apex, PRESSED_APEX * max(grazing(op, op.length - where), MIN_GRAZE) / -cos(angle))
    e = send_pluck(p, i, stop, apex, where, uneven * width, uneven * release, angle)
    clicks = p.stroke == PICK and player.pick_noise > OFF
    level = player.pick_noise if clicks else player.skin_noise - SKIN_SOFTER * square(1.0 - hard)
    noise = (CLICK if clicks else SKIN) * amplitude(level)
    noise = noise * corner_speed(op, apex, where) * max(abs(cos(angle)), MIN_SKIN)
    if clicks:
        e.value = noise
    else:
        e.speed = noise


@jit
def is_other(p, op, i):
    """True if string `i` is the middle finger's turn, or an up-stroke's; each call passes the turn.

    A finger that rakes on to a lower string keeps its turn.
    """
    hands = p.hands
    frame = p.out.frame
    seconds = (frame - hands.stroked_at) * op.steps * op.fine
    other = hands.other
    if not p.strokes[p.stroke].two_ways and i < hands.stroked and seconds <= RAKE:
        other = 1 - other
    hands.stroked = i
    hands.stroked_at = frame
    if p.switched[techniques.DOWN_STROKE] > 0:
        other = 0
    elif p.switched[techniques.UP_STROKE] > 0:
        other = 1
    hands.other = 1 - other
    return other != 0
