"""Controllers, parameters of hosts and key switches: how the notes to come are played. [audio thread]"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.machine.elementary import log2, power
from livebass.kernels.player.events import emit
from livebass.kernels.player.expression import tell_bend, tell_gain, tell_slide, tell_vibrato
from livebass.kernels.player.fingering import HAND_SPAN, move_hand, note_range, string_called
from livebass.kernels.player.notes import all_notes_off, stop_string
from livebass.kernels.player.performer import (
    CHANNELS,
    CONTROLLERS,
    FINGER,
    FREE,
    KEYS,
    MOST_RANGE,
    MOST_STRINGS,
    PEDALLED,
    PICK,
    POP,
    performer_at,
)
from livebass.kernels.player.strokes import place
from livebass.kernels.player.touches import tell_palm
from livebass.kernels.string.records import BLEND, CUT, TONE
from livebass.techniques import (
    ACTIONS,
    BEND_RANGE,
    CC_BEND,
    CC_BLEND,
    CC_EXPRESSION,
    CC_HAND,
    CC_LEGATO,
    CC_LET_RING,
    CC_PALM,
    CC_PARAMETER,
    CC_PLACE,
    CC_SLIDE,
    CC_VIBRATO,
    CC_VOLUME,
    DYNAMICS,
    GAIN_DB,
    HAND_AT,
    HAND_DAMPING,
    LEAST,
    MOST,
    NO_FUNCTION,
    NO_SWITCH,
    ON_STRING,
    PALM,
    PARAMETERS,
    PLUCK_POSITION,
    PLUCKED,
    STOP_ALL,
    TECHNIQUE,
    THUMB_ON_ALL,
    THUMB_ON_TWO,
    TONE_POT,
    UNEVENNESS,
    VIBRATO,
    WITH_FINGERS,
    WITH_PICK,
    WITH_THUMB,
)

MOST_UNEVENNESS = 0.5
VOLUME_LAW = 40.0 * 0.30102999566398120  # dB when a volume controller doubles
BEND_UP = 2.0  # semitones of the controller that bends upwards
BEND_STARTS = 3  # it bends once it has been lower: a file that sets a portamento time by it does not bend
PEDAL = 64  # at 0 it lets go in every map that gives it no other function


@jit
def reset_controllers(p):
    """Sets pedal, wheel, expression, RPN and pluck position as when new; palm and vibrato as a host has set them."""
    p.pedal = 0
    p.wheel = 0.0
    p.expression = 1.0
    p.bend_up = 0.0
    p.bend_ready = 0
    p.parameter = 16383
    p.position = p.placed
    p.palm = p.palm_set
    p.legato = 0
    p.sliding = 0
    p.vibrato = p.vibrato_set
    for i in range(MOST_STRINGS):
        p.string_bend[i] = 0.0
        p.note_bend[i] = 0.0
        p.note_vibrato[i] = 0.0


@jit
def held(number, value):
    """The value of parameter `number`, held within its limits; NaN is as usual."""
    if np.isnan(value):
        return 0.0
    return min(max(value, LEAST[number]), MOST[number])


@jit
def set_parameter(p, frame, number, value, events, count):
    """Sets parameter `number`, of those that the player has, to a value that is `held`; returns the new count."""
    adjust(p, number, value)
    if number == TONE_POT:
        for i in range(p.strings):
            count = emit(events, count, frame, TONE, i, 0, value, 0.0)
    elif number == BEND_RANGE:
        count = tell_bend(p, frame, events, count)
    return count


@jit
def adjust(p, number, value):
    """`set_parameter` for the player alone."""
    p.adjusted[number] = value
    if number == TONE_POT:
        p.tone = value
    elif number == PLUCK_POSITION:
        p.placed = place(p, value)
        p.position = p.placed
    elif number == DYNAMICS:
        p.dynamics = power(10.0, value / 20.0)
    elif number == TECHNIQUE:
        which = np.int64(np.rint(value))
        p.slapped = p.usual_slapped
        if which == PLUCKED:
            p.slapped = 0
        elif which == THUMB_ON_TWO:
            p.slapped = min(2, p.strings)
        elif which == THUMB_ON_ALL:
            p.slapped = p.strings
        if p.slapped > 0:
            p.stroke = POP
        elif p.stroke == POP:
            p.stroke = FINGER
    elif number == HAND_DAMPING:
        p.hand_damping = p.usual_damping * power(10.0, value)
    elif number == UNEVENNESS:
        p.unevenness = p.usual_unevenness
        if value != 0.0:
            p.unevenness = min(max(p.usual_unevenness + value, 0.0), MOST_UNEVENNESS)
    elif number == BEND_RANGE:
        p.ranged = p.usual_range if value == 0.0 else max(value, 1.0)
        p.range = p.ranged


@jit
def take_over(p, old):
    """Sets controllers and parameters of a bass that has not played as they stand at `old`, the performer before it."""
    for number in range(GAIN_DB + 1, PARAMETERS):
        adjust(p, number, old.adjusted[number])
    p.volume = old.volume
    p.expression = old.expression
    p.level = old.level
    p.blend = old.blend
    p.pedal = old.pedal
    p.wheel = old.wheel
    p.parameter = old.parameter
    p.bend_up = old.bend_up
    p.bend_ready = old.bend_ready
    if old.range != old.ranged:
        p.range = old.range
    if p.wheel_slides:
        p.shift = np.int64(np.rint(p.wheel * p.range))
    if old.position != old.placed and old.farthest != old.nearest:
        part = (old.position - old.nearest) / (old.farthest - old.nearest)
        p.position = p.nearest + (p.farthest - p.nearest) * part
    p.palm = old.palm
    p.palm_set = old.palm_set
    p.legato = old.legato
    p.sliding = old.sliding
    p.vibrato = old.vibrato
    p.vibrato_set = old.vibrato_set
    p.mode = old.mode
    p.mono = old.mono
    p.first_channel = old.first_channel
    p.channels = old.channels
    p.channel_range = old.channel_range
    for channel in range(CHANNELS):
        p.channel_wheel[channel] = old.channel_wheel[channel]
        p.channel_place[channel] = old.channel_place[channel]
        p.channel_string[channel] = -1
    for i in range(MOST_STRINGS):
        p.string_bend[i] = old.string_bend[i]
    for key in range(KEYS):
        if p.switch[key] == old.switch[key] and p.switch_value[key] == old.switch_value[key]:
            p.pressed[key] = old.pressed[key]
            p.switched[p.switch[key]] += p.pressed[key]
            if p.pressed[key] > 0 and p.switch[key] == ON_STRING:
                p.forced = string_called(p, p.switch_value[key])
        p.string_of[key] = old.string_of[key]
        p.place_of[key] = old.place_of[key]


@entry("void(int64, int64)")
def follow_performer(p, old):
    """C function: `take_over` for addresses."""
    take_over(performer_at(p), performer_at(old))


@jit
def place_note(p, key, x):
    """Has the next note of `key` plucked at a place of its own, given as PLUCK_POSITION."""
    if key < KEYS:
        p.place_of[key] = x if np.isnan(x) else held(PLUCK_POSITION, x)


@jit
def string_note(p, key, i):
    """Has the next note of `key` played on string `i`, where that has it."""
    if key < KEYS:
        p.string_of[key] = np.int64(i) if 0.0 <= i < p.strings else -1


@jit
def set_amount(p, ops, frame, function, amount, events, count):
    """Sets palm mute or vibrato to `amount`, 0 to 1, as its controller does; returns the new count.

    `function`: CC_PALM or CC_VIBRATO. NaN is none.
    """
    amount = min(max(amount, 0.0), 1.0) if not np.isnan(amount) else 0.0
    if function == CC_PALM:
        p.palm_set = amount
        if amount != p.palm:
            p.palm = amount
            return tell_palm(p, ops, frame, events, count)
    if function == CC_VIBRATO:
        p.vibrato_set = amount
        if amount != p.vibrato:
            p.vibrato = amount
            return tell_vibrato(p, frame, events, count)
    return count


@jit
def turn_switch(p, ops, key, on, frame, events, count):
    """Carries out a key switch that is pressed or released; returns the new count of events."""
    action, before = p.switch[key], p.pressed[key]
    p.pressed[key] = max(before + (1 if on else -1), 0)
    p.switched[action] += p.pressed[key] - before
    if action == ON_STRING:
        string = string_called(p, p.switch_value[key])
        if on:
            p.forced = string
        elif p.forced == string:
            p.forced = -1
    elif action == PALM:
        count = tell_palm(p, ops, frame, events, count)
    elif action == VIBRATO:
        count = tell_vibrato(p, frame, events, count)
    elif on and action == WITH_THUMB:
        p.slapped = p.usual_slapped if p.usual_slapped > 0 else min(2, p.strings)
        p.stroke = POP
    elif on and action in (WITH_FINGERS, WITH_PICK):
        p.slapped = 0
        p.stroke = PICK if action == WITH_PICK else FINGER
    elif on and action == STOP_ALL:
        for i in range(p.strings):
            count = stop_string(p, i, frame, events, count)
    elif on and action == HAND_AT:
        move_hand(p, p.switch_value[key])
    return count


@jit
def release_switches(p, ops, frame, events, count):
    """Releases all key switches; returns the new count of events."""
    for key in range(KEYS):
        p.pressed[key] = 0
    palm, vibrato = p.switched[PALM], p.switched[VIBRATO]
    for action in range(ACTIONS):
        p.switched[action] = 0
    p.forced = -1
    if palm > 0:
        count = tell_palm(p, ops, frame, events, count)
    if vibrato > 0:
        count = tell_vibrato(p, frame, events, count)
    return count


@jit
def is_switch(p, key):
    """True if `key` switches: if the map has it, and the bass has no such note or the map goes before notes."""
    return p.switch[key] != NO_SWITCH and (p.over_notes != 0 or key < note_range(p)[0])


@jit
def turned(number, value):
    """The value of parameter `number` for a controller at `value`, 0 to 127: the middle, 64, is as usual.

    The gain is that of a volume controller, from silence to 0 dB. Parameters that begin at 0 go from there to the most
    at 127: the bend range in whole numbers, the technique in equal parts.
    """
    least, most = LEAST[number], MOST[number]
    if number == GAIN_DB:
        return max(VOLUME_LAW * log2(value / 127.0), least) if value > 0 else least
    if number == TECHNIQUE:
        return np.float64(value * (np.int64(most) + 1) // CONTROLLERS)
    if number == BEND_RANGE:
        return np.float64(np.int64(value * most / 127.0 + 0.5))
    if least == 0.0:
        return value * most / 127.0
    if value < 64:
        return least * (64 - value) / 64.0
    return most * (value - 64) / 63.0


@jit
def turn_parameter(p, frame, number, value, events, count):
    """Moves parameter `number` by a controller, as a host would; returns the new count of events."""
    x = np.float64(np.float32(turned(number, value)))  # as precise as those of a host
    if number == GAIN_DB:
        p.level = power(10.0, x / 20.0) if x > LEAST[GAIN_DB] else 0.0
        return tell_gain(p, frame, events, count)
    return set_parameter(p, frame, number, x, events, count)


@jit
def control(p, ops, frame, number, value, events, count):
    """Carries out a control change: by the map of the bass, and else as MIDI has it."""
    what = p.controller[number]
    if what >= CC_PARAMETER:
        count = turn_parameter(p, frame, what - CC_PARAMETER, value, events, count)
    elif what == CC_PLACE:
        p.position = p.nearest + (p.farthest - p.nearest) * value / 127.0
    elif what == CC_VOLUME:
        p.volume = value / 127.0
        count = tell_gain(p, frame, events, count)
    elif what == CC_EXPRESSION:
        p.expression = value / 127.0
        count = tell_gain(p, frame, events, count)
    elif what == CC_LET_RING or (what == NO_FUNCTION and number == PEDAL and value < 64):
        p.pedal = 1 if value >= 64 else 0
        if not p.pedal:
            for i in range(p.strings):
                if p.state[i] == PEDALLED:
                    count = stop_string(p, i, frame, events, count)
    elif what == CC_VIBRATO:
        p.vibrato = value / 127.0
        count = tell_vibrato(p, frame, events, count)
    elif what == CC_PALM:
        p.palm = value / 127.0
        count = tell_palm(p, ops, frame, events, count)
    elif what == CC_SLIDE:
        p.sliding = 1 if value >= 64 else 0
    elif what == CC_LEGATO:
        p.legato = 1 if value >= 64 else 0
    elif what == CC_BEND:
        p.bend_ready = 1 if value < BEND_STARTS else p.bend_ready
        if p.bend_ready:
            p.bend_up = BEND_UP * value / 127.0
            count = tell_bend(p, frame, events, count)
    elif what == CC_HAND:
        move_hand(p, 1 + value * (p.frets - HAND_SPAN - 1) // 127)
    elif what == CC_BLEND:
        p.blend = (value - 64) / 64.0 if value < 64 else (value - 64) / 63.0
        for i in range(p.strings):
            count = emit(events, count, frame, BLEND, i, 0, p.blend, 0.0)
    elif number == 101:
        p.parameter = (value << 7) | (p.parameter & 127)
    elif number == 100:
        p.parameter = (p.parameter & ~127) | value
    elif number == 98 or number == 99:
        p.parameter = 16383
    elif number == 6 and p.parameter == 0:
        p.range = float(min(value, MOST_RANGE)) + (p.range - np.floor(p.range))
        count = tell_bend(p, frame, events, count)
    elif number == 38 and p.parameter == 0:
        p.range = np.floor(p.range) + min(value, 99) / 100.0
        count = tell_bend(p, frame, events, count)
    elif number == 120:
        for i in range(p.strings):
            p.state[i] = FREE
            p.key[i] = -1
            p.stacked[i] = 0
            count = emit(events, count, frame, CUT, i, 0, 0.0, 0.0)
        count = release_switches(p, ops, frame, events, count)
    elif number == 121:
        reset_controllers(p)
        count = tell_slide(p, frame, events, count)
        count = tell_bend(p, frame, events, count)
        count = tell_gain(p, frame, events, count)
        count = tell_vibrato(p, frame, events, count)
        count = tell_palm(p, ops, frame, events, count)
        for i in range(p.strings):
            if p.state[i] == PEDALLED:
                count = stop_string(p, i, frame, events, count)
    elif number >= 123:
        count = all_notes_off(p, frame, events, count)
        count = release_switches(p, ops, frame, events, count)
    return count
