"""Control changes and key switches: the bass's map decides, otherwise the MIDI standard. [audio thread]

`take_over` copies the settings that a change of bass keeps.
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.machine.native import copy_record
from livebass.kernels.player.channels import follows, has_own_notes, leading, owner_of
from livebass.kernels.player.constants import KEYS
from livebass.kernels.player.events import send_value_to_all
from livebass.kernels.player.expression import follow_wheel, send_bends, send_gains, send_vibratos
from livebass.kernels.player.fingering import HAND_SPAN, move_hand, note_range, string_called
from livebass.kernels.player.notes import cut_string, forget_keys, release_all_notes, stop_pedalled, stop_string
from livebass.kernels.player.parameters import adjust_player, set_amount, set_parameter, turn_parameter, within_limits
from livebass.kernels.player.performer import (
    ALL_ALIKE,
    ANY,
    IN_TUNE,
    MAX_RANGE,
    MAX_STRINGS,
    NO_RPN,
    operators_at,
    performer_at,
)
from livebass.kernels.player.touches import touch_palms
from livebass.kernels.string.records import BLEND
from livebass.rows import techniques

jit = compiled(attributes=SMALL)

BEND_UP = 2.0  # semitones of the controller that bends upwards
PEDAL = 64  # releases at 0 in every map that gives it no other function
# Controllers of MIDI
DATA, DATA_FINE, NRPN_FINE, NRPN, RPN_FINE, RPN = 6, 38, 98, 99, 100, 101
ALL_SOUND_OFF, RESET_CONTROLLERS, ALL_NOTES_OFF = 120, 121, 123  # and all that follow
BEND_RANGE_RPN, FINE_RPN, COARSE_RPN = 0, 1, 2  # range of the wheel; tuning, of a semitone and in semitones
COARSE_MIDDLE = 64


@jit
def control(p, ops, channel, number, value):
    """Handles a channel's control change by the bass's map, otherwise by the MIDI standard."""
    what = p.key_map.function[number]
    if what >= techniques.CC_PARAMETER:
        turn_parameter(p, what - techniques.CC_PARAMETER, value)
    elif what != techniques.NO_FUNCTION:
        use_function(p, ops, channel, what, value)
    elif number == PEDAL and value < 64:
        set_pedal(p, channel, value)
    elif DATA <= number <= RPN:
        set_rpn(p, channel, number, value)
    elif number == ALL_SOUND_OFF:
        forget_keys(p, channel)
        for i in range(p.strings):
            if follows(p, i, channel):
                cut_string(p, i)
        release_switches(p, ops)
    elif number == RESET_CONTROLLERS:
        reset_controllers(p, channel)
        follow_wheel(p, channel)
        send_bends(p, channel)
        send_gains(p, channel)
        send_vibratos(p, channel)
        touch_palms(p, ops)
        stop_pedalled(p, channel)
    elif number >= ALL_NOTES_OFF:
        release_all_notes(p, channel)
        release_switches(p, ops)


@jit
def use_function(p, ops, channel, what, value):
    """Performs the function that the bass's map gives a channel's controller (techniques.py)."""
    controls, own, bass = p.controls, p.controls.channel[channel], p.controls.channel[ANY]
    if what == techniques.CC_PLACE:
        p.position = p.player.pluck_nearest + (p.player.pluck_farthest - p.player.pluck_nearest) * value / 127.0
    elif what == techniques.CC_VOLUME:
        own.volume = bass.volume = value / 127.0
        send_gains(p, channel)
    elif what == techniques.CC_EXPRESSION:
        own.expression = bass.expression = value / 127.0
        send_gains(p, channel)
    elif what == techniques.CC_LET_RING:
        set_pedal(p, channel, value)
    elif what == techniques.CC_VIBRATO:
        own.vibrato = bass.vibrato = value / 127.0
        send_vibratos(p, channel)
    elif what == techniques.CC_PALM:
        controls.palm = value / 127.0
        touch_palms(p, ops)
    elif what == techniques.CC_SLIDE:
        controls.sliding = 1 if value >= 64 else 0
    elif what == techniques.CC_SLIDE_TIME:
        controls.slide_time = techniques.SLIDE_STEP * value
    elif what == techniques.CC_LEGATO:
        controls.legato = 1 if value >= 64 else 0
    elif what == techniques.CC_BEND:
        bend_upwards(own, value)
        bend_upwards(bass, value)
        if bass.bend_ready or (own.bend_ready and controls.mode == ALL_ALIKE):
            send_bends(p, channel)
    elif what == techniques.CC_HAND:
        move_hand(p, 1 + value * (p.frets - HAND_SPAN - 1) // 127)
    elif what == techniques.CC_BLEND:
        controls.blend = (value - 64) / 64.0 if value < 64 else (value - 64) / 63.0
        send_value_to_all(p, BLEND, controls.blend)


@jit
def bend_upwards(record, value):
    """Bends a record's strings up by the controller, once it has been near 0."""
    record.bend_ready = 1 if value < techniques.BEND_STARTS else record.bend_ready
    if record.bend_ready:
        record.bend_up = BEND_UP * value / 127.0


@jit
def set_pedal(p, channel, value):
    """Presses a channel's pedal, or releases it and stops the strings that it alone held."""
    pedal = 1 if value >= 64 else 0
    p.controls.channel[channel].pedal = pedal
    if not has_own_notes(p, channel):
        p.controls.channel[ANY].pedal = pedal
    if not pedal:
        stop_pedalled(p, channel)


@jit
def set_rpn(p, channel, number, value):
    """Selects a channel's registered parameter, or sets it: the wheel range or the tuning."""
    own, bass = p.controls.channel[channel], p.controls.channel[ANY]
    if number in (DATA, DATA_FINE):
        rpn = leading(p, channel).rpn
        set_data(own, rpn, number, value)
        if set_data(bass, rpn, number, value):
            send_bends(p, channel)
    else:
        own.rpn = rpn_with(own.rpn, number, value)
        bass.rpn = rpn_with(bass.rpn, number, value)


@jit
def rpn_with(rpn, number, value):
    """Returns the selected RPN after a controller from NRPN_FINE to RPN; `rpn` was selected before."""
    if number == RPN:
        return (value << 7) | (rpn & 127)
    if number == RPN_FINE:
        return (rpn & ~127) | value
    return np.int64(NO_RPN) if number in (NRPN, NRPN_FINE) else rpn


@jit
def set_data(record, rpn, number, value):
    """Sets part of the parameter `rpn` in a channel record; returns False if it does not affect the pitch."""
    if rpn == BEND_RANGE_RPN:
        record.range = range_with(record.range, number, value)
    elif rpn == FINE_RPN:
        record.fine = (value << 7) | (record.fine & 127) if number == DATA else (record.fine & ~127) | value
    elif rpn == COARSE_RPN and number == DATA:
        record.coarse = value - COARSE_MIDDLE
    else:
        return False
    return True


@jit
def range_with(semitones, number, value):
    """Returns a bend range, semitones, with its whole (DATA) or fine part (DATA_FINE, cents) set to `value`."""
    if number == DATA:
        return float(min(value, MAX_RANGE)) + (semitones - np.floor(semitones))
    return np.floor(semitones) + min(value, 99) / 100.0


@jit
def reset_controllers(p, channel):
    """Resets a channel's pedal, wheel, expression and RPN, and the controllers that all channels share.

    A channel with notes of its own resets only what is theirs. Palm and vibrato return to the host's values. Volume,
    range and tuning stay, as MIDI asks (RP-015).
    """
    controls = p.controls
    own = has_own_notes(p, channel)
    reset_channel(controls.channel[channel], controls.vibrato_set)
    if own:
        controls.channel_wheel[channel] = 0.0
        controls.channel_place[channel] = np.nan
    else:
        reset_channel(controls.channel[ANY], controls.vibrato_set)
        controls.palm = controls.palm_set
        controls.legato = 0
        controls.sliding = 0
        controls.slide_time = 0.0
        p.position = p.placed
    for i in range(MAX_STRINGS):
        if follows(p, i, channel) and (not own or owner_of(p, i) == channel):
            controls.string_bend[i] = 0.0
            controls.string_expression[i] = 1.0
            p.hands.note_bend[i] = 0.0
            p.hands.note_vibrato[i] = 0.0
            p.hands.string_vibrato[i] = 0.0


@jit
def reset_channel(record, vibrato):
    """`reset_controllers` for one channel record; sets its vibrato to `vibrato`."""
    record.pedal = 0
    record.wheel = 0.0
    record.expression = 1.0
    record.bend_up = 0.0
    record.bend_ready = 0
    record.rpn = NO_RPN
    record.vibrato = vibrato


@jit
def make_controls(p):
    """Fills a new performer's zeroed CONTROLS and its strings' channels; its player must already be set."""
    p.controls.level = 1.0
    p.controls.place_of[:] = np.nan
    p.controls.string_of[:] = -1
    p.hands.channel[:] = -1
    for channel in range(ANY + 1):
        record = p.controls.channel[channel]
        record.volume = 1.0
        record.range = p.ranged
        record.fine = IN_TUNE
        reset_channel(record, 0.0)
    reset_controllers(p, np.int64(ANY))


@jit
def is_switch(p, key):
    """True if `key` is a switch: it is in the map, and it lies outside the bass's notes or the map overrides them."""
    outside = key < note_range(p)[0] or key >= techniques.TOP_KEYS
    return p.key_map.action[key] != techniques.NO_SWITCH and (p.key_map.over_notes != 0 or outside)


@jit
def turn_switch(p, ops, key, on):
    """Handles the press or release of a key switch."""
    action, before = p.key_map.action[key], p.pressed[key]
    p.pressed[key] = max(before + (1 if on else -1), 0)
    use_technique(p, ops, action, p.pressed[key] - before)
    if action == techniques.ON_STRING:
        string = string_called(p, p.key_map.value[key])
        if on:
            p.forced = string
        elif p.forced == string:
            p.forced = -1
    elif on and techniques.STROKE_OF[action] != techniques.OWN:
        adjust_player(p, np.int64(techniques.TECHNIQUE), np.float64(techniques.STROKE_OF[action]))
    elif on and action == techniques.STOP_ALL:
        for i in range(p.strings):
            stop_string(p, i)
    elif on and action == techniques.HAND_AT:
        move_hand(p, p.key_map.value[key])


@jit
def use_technique(p, ops, action, more):
    """Counts `more` of what holds a technique: keys, or the host's switch."""
    p.switched[action] += more
    if action == techniques.PALM:
        touch_palms(p, ops)
    elif action == techniques.VIBRATO:
        send_vibratos(p, np.int64(ANY))
    elif action == techniques.LET_RING:
        stop_pedalled(p, np.int64(ANY))


@jit
def latch(p, ops, action, on):
    """Switches a technique on (1) or off (0) without a key."""
    more = on - p.controls.latched[action]
    if more != 0:
        p.controls.latched[action] = on
        use_technique(p, ops, action, more)


@jit
def set_value(p, ops, kind, number, value):
    """Sets a parameter's value by the `kind` and number of its event (techniques.event); others change nothing."""
    if kind == techniques.PARAMETER and number < techniques.PARAMETERS:
        set_parameter(p, number, within_limits(number, value))
    elif kind == techniques.AMOUNT:
        set_amount(p, ops, number, value)
    elif kind == techniques.SWITCHED and number < techniques.ACTIONS:
        latch(p, ops, number, np.int64(value > 0.5))
    elif kind == techniques.SETTING and number < techniques.SETTINGS:
        value = 0.0 if np.isnan(value) else value
        p.controls.settings[number] = min(max(value, techniques.MIN_SETTINGS[number]), techniques.MAX_SETTINGS[number])


@entry("void(int64, int64, int64, int64, float64)", SMALL)
def take_value(p, ops, kind, number, value):
    """C function: `set_value` for addresses."""
    performer = performer_at(p)
    set_value(performer, operators_at(ops, performer.strings, performer.frets + 1), kind, number, value)


@jit
def release_switches(p, ops):
    """Releases all key switches; latched techniques stay on."""
    p.pressed[:] = 0
    p.forced = -1
    for action in range(techniques.ACTIONS):
        held = p.switched[action] - p.controls.latched[action]
        if held > 0:
            use_technique(p, ops, action, -held)


@jit
def take_over(p, old):
    """Copies controllers and parameters from `old`, the previous performer, to a bass that has not played yet.

    Parameters apply to this bass's own numbers. The pluck position and each channel's wheel range are this bass's own
    too, unless a controller had moved them.
    """
    for number in range(techniques.GAIN_DB + 1, techniques.PARAMETERS):
        adjust_player(p, number, old.controls.adjusted[number])
    copy_record(p.controls, old.controls)
    for action in range(techniques.ACTIONS):
        p.switched[action] = p.controls.latched[action]
    for channel in range(ANY + 1):
        record = p.controls.channel[channel]
        if record.range == old.ranged:
            record.range = p.ranged
        if p.wheel_slides:
            p.hands.shift[channel] = np.int64(np.rint(record.wheel * record.range))
    nearest, farthest = old.player.pluck_nearest, old.player.pluck_farthest
    if old.position != old.placed and farthest != nearest:
        part = (old.position - nearest) / (farthest - nearest)
        p.position = p.player.pluck_nearest + (p.player.pluck_farthest - p.player.pluck_nearest) * part
    p.hands.channel_string[:] = -1
    for key in range(KEYS):
        p.hands.holding[key] = old.hands.holding[key]
        action, value = p.key_map.action[key], p.key_map.value[key]
        if action == old.key_map.action[key] and value == old.key_map.value[key]:
            p.pressed[key] = old.pressed[key]
            p.switched[action] += p.pressed[key]
            if p.pressed[key] > 0 and action == techniques.ON_STRING:
                p.forced = string_called(p, value)


@entry("void(int64, int64)", SMALL)
def follow_performer(p, old):
    """C function: `take_over` for addresses."""
    take_over(performer_at(p), performer_at(old))
