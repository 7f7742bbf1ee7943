"""How fingers, thumb and arm act on one string: plucks, strikes, bends, the change to another fret.

A new note on the fret that sounds already goes into the same motion. On another fret the motion goes over to the other
one of the string's two slots, whose modes have the new length (handover.py), and the stop moves into place (stop.py).
`string` is a STRING, `ops` the operators of its frets. [audio thread]
"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.hands import scrape, thumb
from livebass.kernels.machine.elementary import cos, exp, exp2, sin
from livebass.kernels.string import glide, handover, modal, stop, touch
from livebass.kernels.string.operators import heights, positions, tap_weights
from livebass.kernels.string.records import COMING, TOUCHES
from livebass.kernels.string.slot import (
    SAFETY,
    SAFETY_HANDED,
    SAFETY_STRUCK,
    change_operator,
    highest_frequency,
    invalidate_contact,
    load_tuned,
    remove_thumb,
    rms_velocity,
    tune_slot,
    wake_slot,
    wake_v,
)

PULLING_FINGER = 4e-3  # m, half width of the left hand's finger that plucks as it leaves a fret
USUAL_DAMPING = 90.0  # 1/s: how firmly hands end a note
# Where fingers lie that end a note, from the stop towards the nut, m, and how firmly, in impedances of the string. The
# distances are uneven, or what has nodes at all of them would ring; the last one is another finger, farther back.
EASED, EASING = (0.0, -21e-3, -58e-3, 95e-3), (1.8, 1.25, 1.25, 1.25)
PRESSED, EASING_OFF = 150.0, 25e-3  # the finger that leaves the fret first holds as firmly; s
# The same on an open string, parts of its length from the saddle: a finger of the right hand, then of the left
RESTED, RESTING = (0.17, 0.56, 0.665, 0.75), (0.7, 0.5, 0.5, 0.5)
FINGER_WIDTH, FRET_WIDTH = 3.5e-3, 1.2e-3  # m, half; the second one of the finger that eases off
ENDING = 12e-3  # s in which these fingers land
ALL_OVER = 12.0  # 1/s of all modes, by what else of the hands comes near
GENTLY = 0.0  # of a finger's speed
TOUCHED_BEFORE, THUMB_TOUCH = 0.5e-3, 3.0  # s from the touch of a string that sounds to the strike; N s/m
SLIDING_HAND = 0.5  # m/s, of a finger that crosses a crown
ONSET = 0.6  # s in which a vibrato gets a semitone deeper
FINGER_NEPERS = 5.0  # damping, at an antinode, of a finger that takes hold of a sounding string
GRIPPED, MOST_NEPERS = 2.35, 12.0  # of the fundamental, at least: near the saddle it holds more firmly, up to so much
# The same of a finger that hammers, near the stop, and what part of it a node gets: a fingertip is no point
HAMMER_NEPERS, HAMMER_SPARES = 80.0, 0.3
NARROW = 1.6  # `safety` times sqrt(p (1 - p)) of a pluck at the part p of the length: its pulses reached 1.4 on a board
BEND_FRAMES = 128  # pitch bend is followed so often, one string after the other ...
BEND_SPEED = 400.0  # semitones/s, ... and not faster


@jit
def shape_of_pluck(w, op, apex, position, rounding, release):
    """Fills w.held with the modal amplitudes that a pluck leaves (model.modes.pluck_amplitudes)."""
    length = op.length
    k1 = np.pi / length
    corner = np.sqrt(2 / length) * apex * length / (position * (length - position))
    for j in range(op.padded):
        w.held[j] = 0.0
    for j in range(op.modes):
        k = modal.mode_number(j) * k1
        smooth = exp(-0.5 * (k * rounding) ** 2) / (1 + op.held_stiffness * (k * k))
        smooth /= 1 + (w.omega[j] * w.omega[j] + w.sigma[j] * w.sigma[j]) * (release * release)
        w.held[j] = corner * sin(k * position) / (k * k) * smooth


@jit
def shape_of_strike(w, op, depth, position, width):
    """Fills w.strike with modal velocities: an impulse that pushes an endless string down by `depth`."""
    k1 = np.pi / op.length
    for j in range(op.padded):
        w.strike[j] = 0.0
    for j in range(op.modes):
        k = modal.mode_number(j) * k1
        smooth = exp(-0.5 * (k * width) ** 2)
        w.strike[j] = -2 * op.speed * depth * np.sqrt(2 / op.length) * sin(k * position) * smooth


@jit
def grazing(op, position):
    """Apex (m) of a pluck at `position` (m) that just reaches a fret: model.modes.grazing_apex."""
    a = op.length - position
    place, height = positions(op), heights(op)
    least = np.inf
    for m in range(op.points):
        x = place[m]
        shape = x / a if x < a else (op.length - x) / (op.length - a)
        least = min(least, -height[m] / shape)
    if np.isinf(least):
        return op.graze
    return least


@jit
def grip(voice, slot, op, position, frames, most, least):
    """Lays a finger on the string at `position` for some frames: modes with a node there go on.

    An antinode is damped by `most` nepers at the most, a node by the part `least` of that.
    """
    u = slot.u
    k1 = np.pi / op.length
    first = sin(k1 * position)
    nepers = max(FINGER_NEPERS, GRIPPED / max(first * first, GRIPPED / most))
    for j in range(op.padded):
        shape = sin(modal.mode_number(j) * k1 * position)
        u.finger[j] = exp(-nepers / frames * max(shape * shape, least))
    if slot.v_ready:
        modal.copy_row(slot.v.finger, u.finger, op.padded)
    voice.fingering = frames


@jit
def pull_profile(voice, left):
    """Returns the fraction of the held shape with `left` frames of the pull to go, and its rate of change (1/s).

    At the end of the pull it changes by voice.follow: the finger still moves as it lets go.
    """
    t = (voice.pull - left) / voice.pull
    seconds = voice.pull / voice.rate
    up = 0.5 - 0.5 * cos(np.pi * t) + voice.follow * seconds * (t * t * (t - 1.0))
    return up, 0.5 * np.pi * sin(np.pi * t) / voice.pull * voice.rate + voice.follow * (t * (3.0 * t - 2.0))


@jit
def end_pull(string, ops):
    """Ends a pull before its end: the string goes on from its present displacement and velocity."""
    voice = string.voice
    if 0 < voice.pulling <= voice.pull:
        slot = string.slots[voice.slot]
        op = glide.current_operator(string, ops, voice.slot)
        up, moving = pull_profile(voice, voice.pulling - 1)
        add_held_shape(slot.u, op, up, moving)
        if slot.v_ready:
            add_held_shape(slot.v, op, up, moving)
            slot.v_active = op.padded
        wake_slot(slot, op, voice.step)
    voice.pulling = 0
    voice.landing = 0
    slot = string.slots[voice.slot]
    if slot.active == 0 and slot.v_active == 0:
        slot.on = 0  # the finger had not pulled it yet


@jit
def add_held_shape(w, op, up, moving):
    """Adds `up` times the held shape, moving by `moving` times it a second."""
    for j in range(op.padded):
        x = w.held[j]
        w.q[j] += up * x
        w.p[j] += w.kappa[j] * (moving + w.sigma[j] * up) * x


@jit
def prepare_string(string, ops, fret):
    """Prepares the string to sound at `fret`; one that sounds at another fret is pressed down gently."""
    voice, slots = string.voice, string.slots
    voice.slide_to = -1
    end_pull(string, ops)
    slot = slots[voice.slot]
    if slot.on and not stands_at(slot, fret):
        change_fret(string, ops, fret, GENTLY, 0.0)
    elif not slot.on:
        load_slot(string, ops, voice.slot, fret)
    slots[voice.slot].hand = 1.0


@jit
def stands_at(slot, fret):
    """True if the slot plays `fret`."""
    return slot.fret == fret and not slot.between


@jit
def lift_fingers(string, frames):
    """Lifts all fingers off the string within `frames`; at once if it is at rest."""
    voice, slot = string.voice, string.slots[string.voice.slot]
    if slot.on:
        touch.lift_touches(voice, frames / voice.rate)
    else:
        touch.clear_touches(voice)


@jit
def begin_stroke(string, ops, fret, frames):
    """Prepares the string for a stroke at `fret`; returns its slot.

    What lies on it lifts within so many frames; a thumb that strikes it ends.
    """
    voice = string.voice
    prepare_string(string, ops, fret)
    lift_fingers(string, frames)
    slot = string.slots[voice.slot]
    slot.on = 1
    slot.touching = 0
    remove_thumb(slot)
    voice.striking = 0
    return slot


@jit
def load_slot(string, ops, k, fret):
    """Makes the silent slot `k` ready for `fret`, in tune with the bend."""
    slot = string.slots[k]
    slot.fret = fret
    load_tuned(slot, ops[fret], string.voice)


@jit
def change_fret(string, ops, fret, finger, held):
    """Hands the motion of a string that sounds over to another fret (handover.py).

    Going to a lower one the string leaves its fret at once, and sounds by that, for as much as `held`, from 0 to 1; a
    finger that eases off lets it down without a sound.
    """
    voice = string.voice
    k = 1 - voice.slot
    old, new = string.slots[voice.slot], string.slots[k]
    op, to = glide.current_operator(string, ops, voice.slot), ops[fret]
    voice.striking = 0
    voice.fingering = 0
    voice.landing = 0
    load_slot(string, ops, k, fret)
    new.on = 1
    new.hand = old.hand
    new.safety = max(old.safety, SAFETY_HANDED if op.length > to.length else SAFETY)
    if old.v_active > 0 or old.stop_v.place != 0.0:
        wake_v(new, to)
    shorter = op.length - to.length
    if abs(shorter) < handover.CLOSE:  # one fret stands so high that both end on it
        copy_motion(old, op, new, to)
        if old.between:
            stop.begin_path(new.stop_u, old.stop_u.place, old.stop_u.speed, GENTLY, voice)
            stop.begin_path(new.stop_v, old.stop_v.place, old.stop_v.speed, GENTLY, voice)
    elif shorter > 0.0:
        # a finger that presses gently has done so before: only what the string moves by is stopped
        crown = handover.crown_height(op, shorter) if finger > 0.0 else 0.0
        part = to.length / op.length  # of the line from a stop that still moves
        x, v, x_v, v_v = handover.to_shorter(old, op, new, to)
        u_stop, v_stop = old.stop_u, old.stop_v
        stop.begin_path(new.stop_u, x + part * u_stop.place - crown, v + part * u_stop.speed, finger, voice)
        if new.v_ready:
            stop.begin_path(new.stop_v, x_v + part * v_stop.place, v_v + part * v_stop.speed, finger, voice)
        new.moving = 1
        new.offset = crown + part * old.offset
        new.offset_speed = part * old.offset_speed
    else:
        crown = handover.crown_height(to, -shorter)
        new.offset = to.length / op.length * (old.offset - held * crown)
        new.offset_speed = to.length / op.length * old.offset_speed
        end = 1.0 if old.between else held  # what moves with a finger that glides is no shape that it holds
        at = held * crown + end * old.stop_u.place, end * old.stop_u.speed
        at_v = end * old.stop_v.place, end * old.stop_v.speed
        handover.to_longer(old, op, new, to, at, at_v)
    new.active = to.padded
    if new.v_ready:
        new.v_active = to.padded
    old.on = 0
    voice.slot = k
    if not new.moving:
        stop.lower_obstacles(new, to)
    wake_slot(new, to, voice.step)


@jit
def copy_motion(old, op, new, to):
    """Hands a motion over where the length stays."""
    n = min(op.modes, to.modes)
    handover.velocities(old.u, n)
    for j in range(n):
        handover.set_mode_state(new.u, j, old.u.q_before[j], old.u.p_before[j])
    if new.v_ready:
        handover.velocities(old.v, n)
        for j in range(n):
            handover.set_mode_state(new.v, j, old.v.q_before[j], old.v.p_before[j])
    stop.copy_stop(new.stop_u, old.stop_u)
    stop.copy_stop(new.stop_v, old.stop_v)
    new.moving = old.moving
    new.offset = old.offset
    new.offset_speed = old.offset_speed


@jit
def hammer_on(string, ops, event):
    """Presses the string down to the event's fret, without a pluck; one at rest from where it is when open.

    One that sounds is damped before by the finger that comes down on it.
    """
    voice = string.voice
    voice.slide_to = -1
    end_pull(string, ops)
    slot = string.slots[voice.slot]
    op = glide.current_operator(string, ops, voice.slot)
    x = op.length - ops[event.fret].length
    frames = np.int64(np.rint(event.seconds * voice.rate))
    if frames > 0 and slot.on and not slot.moving and x > handover.CLOSE:
        grip(voice, slot, op, x, frames, HAMMER_NEPERS, HAMMER_SPARES)
        voice.landing = frames
        voice.hammer_to = event.fret
        voice.hammer = event.speed
    else:
        press_down(string, ops, event.fret, event.speed)


@jit
def follow_hammer(string, ops):
    """Counts the landing of a hammering finger down, and presses the string down at its end."""
    voice = string.voice
    voice.landing -= 1
    if voice.landing == 0:
        press_down(string, ops, voice.hammer_to, voice.hammer)


@jit
def press_down(string, ops, fret, finger):
    """Presses the string down to `fret` at `finger` m/s."""
    voice = string.voice
    slot = string.slots[voice.slot]
    if not slot.on:
        load_slot(string, ops, voice.slot, np.int64(0))
        slot.on = 1
        slot.active = ops[0].padded
    slot.hand = 1.0
    if not stands_at(slot, fret):
        change_fret(string, ops, fret, finger, 1.0)
    string.slots[voice.slot].touching = 0


@jit
def pull_off(string, ops, event):
    """Takes the finger off: the string goes on at the event's lower fret, plucked by that finger where it was.

    It pulls the string along across the neck: the fret that it lay on leaves no way down.
    """
    fret, apex = event.fret, event.apex
    voice = string.voice
    voice.slide_to = -1
    end_pull(string, ops)
    slot = string.slots[voice.slot]
    if not slot.on:
        return
    before = glide.current_operator(string, ops, voice.slot).length
    if not stands_at(slot, fret):
        change_fret(string, ops, fret, GENTLY, 1.0)
    slot = string.slots[voice.slot]
    op = ops[fret]
    x = op.length - before
    if x > handover.CLOSE and apex != 0.0:
        wake_v(slot, op)
        shape_of_pluck(slot.u, op, 0.0, x, PULLING_FINGER, 0.0)
        shape_of_pluck(slot.v, op, apex, x, PULLING_FINGER, 0.0)
        voice.pulse = SAFETY
        release_held_shape(voice, slot, op, 0.0)
    slot.touching = 0


@jit
def lay_finger(string, ops, event):
    """Lays a finger on the string, or lifts it: touch.begin_touch."""
    voice = string.voice
    touch.begin_touch(voice, event.finger, event.place, event.resistance, event.width, event.seconds, touch.LANDING)
    slot = string.slots[voice.slot]
    if slot.on:
        touch.note_landing(voice, slot, glide.current_operator(string, ops, voice.slot))


@jit
def end_note(string, ops, damping):
    """Ends the note: the finger eases off its fret and stays on the string, on an open string both hands do.

    `damping` (1/s) is how firmly: USUAL_DAMPING is as a player's fingers damp, 0 lets the string ring on.
    """
    voice = string.voice
    slot = string.slots[voice.slot]
    if damping <= 0.0 or not slot.on:
        return
    voice.slide_to = -1
    end_pull(string, ops)
    if not slot.on:
        return
    remove_thumb(slot)
    firm = damping / USUAL_DAMPING * touch.characteristic_impedance(ops[0])
    stopped = glide.current_operator(string, ops, voice.slot).length
    x = ops[0].length - stopped
    voice.striking = 0
    if x > handover.CLOSE or slot.between:
        firm *= np.sqrt(stopped / ops[0].length)  # fingers cover more of a short string
        change_fret(string, ops, np.int64(0), GENTLY, 0.0)
        for i in range(TOUCHES):
            place = min(max(stopped + EASED[i], 0.0), 0.98 * ops[0].length)
            touch.begin_touch(voice, i, place, EASING[i] * firm, FINGER_WIDTH if i > 0 else FRET_WIDTH, 0.0, ENDING)
        touch.ramp_touch(voice, 0, PRESSED * firm, EASING_OFF)
    else:
        for i in range(TOUCHES):
            touch.begin_touch(voice, i, RESTED[i] * ops[0].length, RESTING[i] * firm, FINGER_WIDTH, 0.0, ENDING)
    slot = string.slots[voice.slot]
    slot.hand = exp(-ALL_OVER / USUAL_DAMPING * damping / voice.rate)
    touch.note_landing(voice, slot, ops[slot.fret])


@jit
def begin_pluck(string, ops, event):
    """Takes the string with a finger, which pulls it for voice.pull frames and lets go.

    Width, release and angle are the string's own where the event has none.
    """
    voice, slots = string.voice, string.slots
    sounding = slots[voice.slot].on
    op = ops[event.fret]
    slot = begin_stroke(string, ops, event.fret, voice.pull)
    apex, position = event.apex, event.place
    rounding = event.width if event.width != 0.0 else voice.rounding
    release = event.seconds if event.seconds != 0.0 else voice.release
    angle = event.angle if event.angle != 0.0 else voice.angle
    part = position / op.length
    voice.pulse = max(SAFETY, NARROW / np.sqrt(max(part * (1.0 - part), 1e-4)))
    if angle != 0.0:
        wake_v(slot, op)
    shape_of_pluck(slot.u, op, cos(angle) * apex, position, rounding, release)
    if slot.v_ready:
        shape_of_pluck(slot.v, op, sin(angle) * apex, position, rounding, release)
    if sounding and (slot.active > 0 or slot.v_active > 0):
        grip(voice, slot, op, position, max(voice.pull, 1), MOST_NEPERS, 0.0)
    for i in range(max(voice.pickups, 1)):
        voice.held[i] = modal.tap_held(slot.u, tap_weights(op, i), op.tap_modes)
        voice.held_across[i] = 0.0
        if slot.v_ready:
            row = i if voice.pickups > 0 else 2 * voice.denominator
            voice.held_across[i] = modal.tap_held(slot.v, tap_weights(op, row), op.tap_modes)
    voice.pulling = voice.pull + 1 if voice.pull > 0 else 0  # this frame counts one down already
    if voice.pull == 0:
        release_held_shape(voice, slot, op, voice.follow)


@jit
def release_held_shape(voice, slot, op, follow):
    """Releases the held shape, which grows by `follow` times itself a second."""
    u, n = slot.u, op.padded
    own = np.sqrt(modal.held_speed_square(u, follow, n) / op.length)
    fastest = slot.safety * rms_velocity(u, op, n) + voice.pulse * own
    modal.release_shape(u, follow, n)
    whole = rms_velocity(u, op, n)
    if whole > 0.0:  # what sounded before and the pluck need each its own
        slot.safety = max(SAFETY, min(max(slot.safety, voice.pulse), fastest / whole))
    if slot.v_ready:
        modal.release_shape(slot.v, follow, op.padded)
        slot.v_active = op.padded
        invalidate_contact(slot.v, op)
    wake_slot(slot, op, voice.step)


@jit
def begin_strike(string, ops, event):
    """Throws the string down with the thumb, over voice.strike frames."""
    voice, slots = string.voice, string.slots
    sounding = slots[voice.slot].on
    op, position = ops[event.fret], event.place
    slot = begin_stroke(string, ops, event.fret, voice.strike)
    if sounding and (slot.active > 0 or slot.v_active > 0):
        # it lies on the string, then throws it
        grip(voice, slot, op, position, max(voice.strike // 2, 1), MOST_NEPERS, 0.0)
    shape_of_strike(slot.u, op, event.apex, position, voice.strike_width)
    voice.striking = voice.strike
    slot.safety = SAFETY_STRUCK
    wake_slot(slot, op, voice.step)


@jit
def throw_mass(string, ops, event):
    """Throws the thumb, or the mass of the event, on the string; one that sounds is touched 0.5 ms before.

    Where the string has to get to another fret first, the thumb waits for it.
    """
    voice, op = string.voice, ops[event.fret]
    if not 0.0 < event.speed < np.inf:
        return
    sounding = string.slots[voice.slot].on
    slot = begin_stroke(string, ops, event.fret, np.int64(np.rint(TOUCHED_BEFORE * voice.rate)))
    voice.fingering = 0
    thumb.set_out(slot.thumb, voice, op, event)
    if sounding and (slot.active > 0 or slot.v_active > 0):
        t = slot.thumb
        t.wait = np.int64(np.rint(TOUCHED_BEFORE * voice.rate))
        touch.begin_touch(voice, TOUCHES - 1, t.place, THUMB_TOUCH, FINGER_WIDTH, TOUCHED_BEFORE, TOUCHED_BEFORE)
    slot.safety = SAFETY_STRUCK
    wake_slot(slot, op, voice.step)


@jit
def follow_bend(string, ops):
    """Tunes the string towards the bend, at BEND_SPEED at most: faster, the string would gain energy."""
    voice = string.voice
    most = exp2(BEND_SPEED * BEND_FRAMES / (12.0 * voice.rate))
    voice.tuned = min(max(voice.bend, voice.tuned / most), voice.tuned * most)
    for k in range(2):
        slot = string.slots[k]
        if slot.on:
            op = glide.current_operator(string, ops, k)
            tune_slot(slot, op, voice.tuned, highest_frequency(voice))
            wake_slot(slot, op, voice.step)


@jit
def set_vibrato(voice, depth, rate):
    """Begins or ends a vibrato of `depth` semitones at `rate` Hz."""
    if voice.depth == 0.0 and depth > 0.0:
        voice.phase = 0.0
    voice.depth_wanted = depth
    voice.waver = rate


@jit
def is_vibrating(voice):
    """True if the string is in vibrato, or was until now."""
    return voice.depth > 0.0 or voice.depth_wanted > 0.0


@jit
def vibrato_tension(voice, slot):
    """The part of its tension by which a string in vibrato is tighter in this frame.

    It grows by the square of the frequency ratio, less one: upwards from a fret, both ways on a board. Open strings
    have none.
    """
    most = 1.0 / (ONSET * voice.rate)
    voice.depth += min(max(voice.depth_wanted - voice.depth, -most), most)
    voice.phase += voice.waver / voice.rate
    voice.phase -= np.floor(voice.phase)
    if slot.fret == 0:
        return 0.0
    turn = 2 * np.pi * voice.phase
    up = sin(turn) if voice.fretless else 1.0 - cos(turn)
    return exp2(voice.depth * up / 12.0) - 1.0


@jit
def begin_slide(string, ops, fret, seconds):
    """Begins to slide to `fret`, `seconds` a fret: over the crowns, or along a board."""
    voice = string.voice
    voice.slide_every = np.int64(np.rint(seconds * voice.rate))
    voice.slide_left = 0
    voice.scraped = 0.0
    voice.landing = 0
    if string.slots[voice.slot].on and glides(voice):
        glide.begin_glide(string, ops, ops[fret].length, voice.slide_every)
    voice.slide_to = fret


@jit
def glides(voice):
    """True if a finger slides on the string without steps."""
    return voice.fretless and voice.denominator == 1


@jit
def follow_slide(string, ops):
    """Moves the sliding finger by one frame."""
    voice = string.voice
    slot = string.slots[voice.slot]
    if not slot.on or stands_at(slot, voice.slide_to):
        voice.slide_to = -1
    elif glides(voice):
        follow_glide(string, ops)
    else:
        follow_frets(string, ops)


@jit
def follow_frets(string, ops):
    """Moves the finger that slides over the next crown when it is time; until then it scrapes."""
    voice = string.voice
    slot = string.slots[voice.slot]
    up = voice.slide_to > slot.fret
    beside = slot.fret + 1 if up else slot.fret - 1
    if voice.slide_left > 0:
        distance = abs(ops[slot.fret].length - ops[beside].length)
        scrape.scrape(voice, slot, distance / voice.slide_every)
        voice.slide_left -= 1
        return
    if slot.moving:
        return
    end_pull(string, ops)
    change_fret(string, ops, beside, SLIDING_HAND if up else GENTLY, 1.0)
    scrape.fit_winding(voice, string.slots[voice.slot], ops[beside])
    voice.slide_left = voice.slide_every - 1


@jit
def follow_glide(string, ops):
    """Moves the finger that glides: to the next length when it is time, and towards that; at last to its fret."""
    voice = string.voice
    slot = string.slots[voice.slot]
    if slot.moving and not slot.between:
        return
    if voice.slide_left == 0:
        end_pull(string, ops)
        if voice.glide_frame >= voice.glide_frames:
            change_fret(string, ops, voice.slide_to, GENTLY, 0.0)
            voice.slide_to = -1
            return
        voice.slide_left = min(glide.period(voice), voice.glide_frames - voice.glide_frame)
        glide.hand_over(string, ops, glide.length_at(voice, voice.glide_frame + voice.slide_left))
        scrape.fit_winding(voice, string.slots[voice.slot], string.between[voice.slot].op)
    scrape.scrape(voice, string.slots[voice.slot], glide.steer_ends(string))
    voice.glide_frame += 1
    voice.slide_left -= 1


@jit
def excite(voice, slot, op):
    """Applies finger and thumb to the string before this frame's motion."""
    n = op.padded
    if voice.fingering > 0:
        modal.damp_by_finger(slot.u, n)
        modal.damp_by_finger(slot.v, slot.v_active)
        invalidate_contact(slot.u, op)  # it moves the string, so that a penetration known before is none
        invalidate_contact(slot.v, op)
        voice.fingering -= 1
    if voice.pulling > 0:
        voice.pulling -= 1
        if voice.pulling == 0:
            release_held_shape(voice, slot, op, voice.follow)
    if voice.striking > 0 and voice.fingering == 0:
        # a raised cosine of force whose sum over the frames is one
        t = (voice.strike - voice.striking) / voice.strike
        modal.add_strike(slot.u, (1 - cos(2 * np.pi * t)) / voice.strike, n)
        voice.striking -= 1
        wake_slot(slot, op, voice.step)
    if slot.thumb.on == COMING and not slot.moving:
        thumb.approach_string(slot, op)


@jit
def change_operators(string, old, ops):
    """Makes the string go on with operators `ops` in place of `old`: other modes, another contact rate.

    Both have whole fine steps in a frame. Displacement and velocity of the modes they share stay.
    """
    voice = string.voice
    voice.numerator = ops[0].steps
    voice.step = voice.frame * voice.numerator
    if string.slots[voice.slot].on and string.slots[voice.slot].between:
        change_fret(string, old, string.slots[voice.slot].fret, GENTLY, 0.0)
        voice.slide_to = -1
    for k in range(2):
        slot = string.slots[k]
        if slot.on:
            change_operator(slot, old[slot.fret], ops[slot.fret])
            if voice.tuned != 1.0:
                tune_slot(slot, ops[slot.fret], voice.tuned, highest_frequency(voice))
            wake_slot(slot, ops[slot.fret], voice.step)
