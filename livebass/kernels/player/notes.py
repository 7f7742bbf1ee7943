"""Begins notes, moves them to other keys with the left hand, and ends them. [audio thread]"""

import numpy as np

from livebass.compiling import SMALL, compiled
from livebass.kernels.hands.sliding import SLIDE_TIME
from livebass.kernels.player import fingering
from livebass.kernels.player.channels import follows, rings_on
from livebass.kernels.player.constants import KEYS
from livebass.kernels.player.events import next_event, send_slide, send_timed_slide, send_touch
from livebass.kernels.player.expression import end_note_expression, take_channel
from livebass.kernels.player.performer import ALL_ALIKE, ANY, FREE, HELD, PEDALLED, STACK, STRING_A_CHANNEL
from livebass.kernels.player.placing import lift_finger, place_finger
from livebass.kernels.player.strokes import force_at, part_at, play_stroke, speed_of_pluck
from livebass.kernels.player.touches import leave_string, palm_is_on, touch_palm
from livebass.kernels.string.records import CUT, HAMMER, HAND, PULL_OFF, TOUCHES
from livebass.rows import techniques

jit = compiled(attributes=SMALL)

MONO_STEP = 2  # semitones
HAMMER_SPEED = 0.36  # speed of a hammering finger over the string's speed after a pluck of the same force
HAMMER_LANDING = 4e-3  # s in which the hammering finger damps a sounding string
TAP_LIFTING = 0.5e-3  # s in which fingers leave a tapped string
# m across: how far a pull-off's finger takes the string along, to the side where pickups hear this pull in phase with
# the string leaving its fret
MIN_PULL, MAX_PULL = 0.1e-3, 0.9e-3
SLIDE_OFF = 5  # frets
EVERY_STRING, EVERY_KEY = -1, -1


@jit
def note_on(p, ops, channel, key, velocity):
    """Plays a channel's key: finds note and string, then sounds it with the left hand or a stroke."""
    hands = p.hands
    hold_key(p, channel, key)
    own_place, own_string = p.controls.place_of[key], p.controls.string_of[key]
    hands.latest = -1
    p.controls.place_of[key] = np.nan
    p.controls.string_of[key] = -1
    note, i, node = find_note(p, key, own_string)
    if note < 0:
        p.dropped += 1
        return
    tied = False
    if node == 0:
        i = tied_string(p, note, own_string)
        tied = i >= 0
    if i < 0:
        i = string_for(p, channel, note, own_string)
    if i < 0:
        p.dropped += 1
        return
    if note != key:
        p.transposed += 1
    fret, before = 0 if node > 0 else note - p.open[i], np.int64(-1)
    if tied:
        before = fingering.stopped_at(p, i, hands.fret[i])
        stack_key(p, i)
    else:
        hands.stacked[i] = 0
        if hands.state[i] != FREE and (hands.key[i] != key or not follows(p, i, channel)):
            p.stolen += 1
    if own_string < 0:
        stop_elsewhere(p, i, channel, key)
    take_string_for(p, i, fret, key)
    end_note_expression(p, i)
    take_channel(p, i, channel)
    sound_string(p, ops, i, before, node, velocity, own_place)


@jit
def sound_string(p, ops, i, before, node, velocity, own_place):
    """Sounds string `i` at its fret: with the left hand, if it comes from another fret `before`, else by a stroke.

    `before` is -1 for a note that begins. `node`, `own_place`: as in `play_stroke`.
    """
    part, fret = part_at(p, velocity), p.hands.fret[i]
    stop = fingering.stopped_at(p, i, fret)
    if p.switched[techniques.TAP] > 0 and fret > 0:
        tap_string(p, ops, i, stop, part)
    elif before >= 0 and stop != before:
        go_to_fret(p, ops, i, before, stop, part)
    else:
        ghost = p.switched[techniques.GHOST] > 0 or velocity < p.player.ghost_below
        play_stroke(p, ops, i, stop, node, part, ghost, own_place)
        if node == 0 and not ghost and not plays_harmonics(p) and p.switched[techniques.LEFT_SLAP] == 0:
            place_finger(p, ops[i, 0], i, stop)


@jit
def hold_key(p, channel, key):
    """Records that `channel` holds `key`, while channels have no meaning."""
    if p.controls.mode == ALL_ALIKE:
        p.hands.holding[key] |= 1 << channel


@jit
def forget_keys(p, channel):
    """Forgets the keys that `channel` holds, except keys that play a string."""
    for key in range(KEYS):
        p.hands.holding[key] &= ~(1 << channel)
    unstack_key(p, channel, np.int64(EVERY_KEY), np.int64(EVERY_STRING))


@jit
def find_note(p, key, own_string):
    """Returns a key's note, and the string and number of its natural harmonic (-1, 0: none).

    Keys out of range move by octaves; the note is -1 if that fails or is switched off.
    """
    i, node = -1, 0
    if p.switched[techniques.HARMONIC] > 0:
        i, node = fingering.natural_harmonic(p, key, own_string)
        if node > 0:  # harmonics reach beyond the last fret
            return key, i, node
    low, high = fingering.note_range(p)
    note = fingering.fold_note(key, low, high)
    if p.switched[techniques.HARMONIC] > 0 and note != key:
        i, node = fingering.natural_harmonic(p, note, own_string)
    if note < low or (note != key and p.drop):
        return np.int64(-1), i, node
    return note, i, node


@jit
def tied_string(p, note, own_string):
    """Returns the string whose note continues to `note` without a stroke: legato, sliding, mono; -1: none."""
    if (
        p.controls.mode == STRING_A_CHANNEL
        and fingering.has_note(p, own_string, note)
        and p.hands.state[own_string] == HELD
    ):
        return own_string
    legato = (p.controls.legato or p.switched[techniques.LEGATO] > 0) and not plays_harmonics(p)
    if not (legato or is_sliding(p) or p.controls.mono):
        return np.int64(-1)
    i = fingering.sounding_string(p, note)
    if legato or is_sliding(p) or i < 0 or abs(note - p.open[i] - p.hands.fret[i]) <= MONO_STEP:
        return i
    return np.int64(-1)


@jit
def plays_harmonics(p):
    """True if a key for harmonics is held."""
    held = p.switched[techniques.HARMONIC] + p.switched[techniques.PINCH]
    for n in range(techniques.ARTIFICIALS):
        held += p.switched[techniques.ARTIFICIAL + n]
    return held > 0


@jit
def string_for(p, channel, note, own_string):
    """Returns the string for a stroke of `note` of `channel`: the requested one, or the best; -1: none."""
    if fingering.has_note(p, own_string, note):
        return own_string
    if fingering.has_note(p, p.forced, note):
        return p.forced
    return fingering.choose_string(p, channel, note)


@jit
def is_sliding(p):
    """True if the player slides from note to note."""
    return p.controls.sliding > 0 or p.switched[techniques.SLIDE] > 0


@jit
def take_string_for(p, i, fret, key):
    """Gives string `i` to a key, at `fret`, and moves the left hand there."""
    hands = p.hands
    fingering.reach_fret(p, fret)
    p.notes += 1
    hands.clock += 1
    hands.state[i] = HELD
    hands.key[i] = key
    hands.fret[i] = fret
    hands.age[i] = hands.clock
    hands.latest = i


@jit
def stop_elsewhere(p, i, channel, key):
    """Stops a key of `channel` on all strings but `i`, which plays it now."""
    for k in range(p.strings):
        if k != i and p.hands.state[k] != FREE and p.hands.key[k] == key and follows(p, k, channel):
            stop_string(p, k)


@jit
def go_to_fret(p, ops, i, before, fret, part):
    """Moves string `i` from fret `before` to `fret` with the left hand: hammer-on, pull-off or slide.

    `part`: 0 is the softest, 1 the hardest.
    """
    if is_sliding(p) and p.controls.slide_time > 0.0:
        send_timed_slide(p, i, fret, p.controls.slide_time, 0.0)
    elif is_sliding(p):
        send_slide(p, i, fret, SLIDE_TIME)
    elif fret > before:
        hammer_string(p, ops, i, fret, part)
    else:
        e = next_event(p, i, PULL_OFF)
        e.fret = fret
        e.apex = -(MIN_PULL + (MAX_PULL - MIN_PULL) * part)


@jit
def hammer_string(p, ops, i, fret, part):
    """Hammers string `i` down to `fret`."""
    e = next_event(p, i, HAMMER)
    e.fret = fret
    e.speed = HAMMER_SPEED * speed_of_pluck(p, ops[i, 0], i, force_at(p, part))
    e.seconds = HAMMER_LANDING


@jit
def tap_string(p, ops, i, fret, part):
    """Hammers string `i` down to `fret`, whatever its state: fingers that ended its last note lift off."""
    for k in range(TOUCHES):
        send_touch(p, i, k, 0.0, 0.0, 0.0, TAP_LIFTING)
    leave_string(p, i)
    hammer_string(p, ops, i, fret, part)
    if palm_is_on(p):
        touch_palm(p, ops, i)


@jit
def note_off(p, ops, channel, key, velocity, own_string):
    """Releases the strings that the key holds; only `own_string` unless that is EVERY_STRING.

    A channel that holds the key ends its own notes; otherwise it ends any channel's notes. The first note-off ends a
    key, however often it was struck: waiting for one note-off per note-on would leave notes hanging whenever a note-off
    is missing. Pads and MIDI guitars strike again without one.
    """
    hands = p.hands
    if p.controls.mode != ALL_ALIKE or not (hands.holding[key] >> channel) & 1:
        channel = np.int64(ANY)
    else:
        hands.holding[key] &= ~(1 << channel)
    unstack_key(p, channel, key, own_string)  # first: a string does not go back to a key that was struck twice
    for i in range(p.strings):
        mine = (own_string < 0 or i == own_string) and follows(p, i, channel)
        if hands.state[i] == HELD and hands.key[i] == key and mine:
            end_held(p, ops, i, velocity)


@jit
def end_held(p, ops, i, velocity):
    """Ends the held note of string `i`, whose key is released at `velocity`, as the player's techniques ask."""
    if p.switched[techniques.DETACH] > 0:
        stop_string(p, i)
    elif p.switched[techniques.SLIDE_OFF_DOWN] + p.switched[techniques.SLIDE_OFF_UP] > 0 and p.hands.fret[i] > 0:
        slide_off(p, i)
    elif p.hands.stacked[i] > 0:
        go_back_to_key(p, ops, i, velocity)
    else:
        release_string(p, i)


@jit
def slide_off(p, i):
    """Ends the note of the fretted string `i` with a slide on which the finger lifts."""
    stop = fingering.stopped_at(p, i, p.hands.fret[i])
    to = max(stop - SLIDE_OFF, 1) if p.switched[techniques.SLIDE_OFF_DOWN] > 0 else min(stop + SLIDE_OFF, p.frets)
    default = SLIDE_TIME * abs(to - stop)
    p.hands.state[i] = FREE
    p.hands.stacked[i] = 0
    send_timed_slide(p, i, to, p.controls.slide_time if p.controls.slide_time > 0.0 else default, p.hand_damping)


@jit
def go_back_to_key(p, ops, i, velocity):
    """Returns string `i` to the key still held under the released one: by pull-off or hammer-on."""
    hands = p.hands
    hands.stacked[i] -= 1
    key = hands.stack[i, hands.stacked[i]]
    before = fingering.stopped_at(p, i, hands.fret[i])
    hands.key[i] = key
    hands.fret[i] = max(fingering.fold_note(key, p.open[i], p.open[i] + p.frets) - p.open[i], 0)
    take_channel(p, i, hands.stack_channel[i, hands.stacked[i]])
    go_to_fret(p, ops, i, before, fingering.stopped_at(p, i, hands.fret[i]), (max(velocity, 1) - 1) / 126.0)


@jit
def stack_key(p, i):
    """Pushes the key that string `i` plays onto its stack, before it plays the next."""
    hands = p.hands
    n = hands.stacked[i]
    if n == STACK:
        for k in range(1, STACK):
            move_stacked(p, i, k, k - 1)
        n -= 1
    hands.stack[i, n] = hands.key[i]
    hands.stack_channel[i, n] = hands.channel[i]
    hands.stacked[i] = n + 1


@jit
def move_stacked(p, i, place, to):
    """Moves the stacked key of string `i` at `place` to `to`."""
    p.hands.stack[i, to] = p.hands.stack[i, place]
    p.hands.stack_channel[i, to] = p.hands.stack_channel[i, place]


@jit
def unstack_key(p, channel, key, own_string):
    """Removes a released key of `channel` (or ANY) from the stacks; EVERY_KEY: all of its keys.

    Does so only on `own_string`, unless that is EVERY_STRING.
    """
    hands = p.hands
    for i in range(p.strings):
        if own_string >= 0 and i != own_string:
            continue
        kept = 0
        for k in range(hands.stacked[i]):
            of = hands.stack_channel[i, k]
            if (hands.stack[i, k] != key and key != EVERY_KEY) or (of != channel and of >= 0 and channel != ANY):
                move_stacked(p, i, k, kept)
                kept += 1
        hands.stacked[i] = kept


@jit
def release_string(p, i):
    """Releases a held note; the pedal may still hold it."""
    if rings_on(p, i):
        p.hands.state[i] = PEDALLED
    else:
        stop_string(p, i)


@jit
def stop_string(p, i):
    """Stops string `i` with the hand, which leaves it later."""
    e = next_event(p, i, HAND)
    e.fret = p.hands.fret[i]
    e.value = p.hand_damping
    lift_finger(p, i)
    p.hands.state[i] = FREE
    p.hands.stacked[i] = 0


@jit
def cut_string(p, i):
    """Ends the sound of string `i` at once and frees it from its key."""
    p.hands.state[i] = FREE
    p.hands.key[i] = -1
    p.hands.stacked[i] = 0
    next_event(p, i, CUT)


@jit
def cut_note(p, channel, key):
    """Ends the sound of the strings that played `key` of `channel`, whatever the pedal does."""
    for i in range(p.strings):
        if p.hands.key[i] == key and follows(p, i, channel):
            cut_string(p, i)
    unstack_key(p, channel, key, np.int64(EVERY_STRING))


@jit
def stop_pedalled(p, channel):
    """Stops the strings that the pedal of `channel` alone held."""
    for i in range(p.strings):
        if p.hands.state[i] == PEDALLED and follows(p, i, channel) and not rings_on(p, i):
            stop_string(p, i)


@jit
def release_all_notes(p, channel):
    """Releases every held note of `channel`."""
    forget_keys(p, channel)
    for i in range(p.strings):
        if not follows(p, i, channel):
            continue
        p.hands.stacked[i] = 0
        if p.hands.state[i] == HELD:
            release_string(p, i)
