"""Messages to the performer: gives MIDI's channels their meaning, and dispatches MIDI and other events. [audio thread]

The caller sets the frame of the message and the place for its events in `p.out` first.
"""

import numpy as np

from livebass.compiling import SMALL, compiled, entry
from livebass.kernels.machine.native import records_at
from livebass.kernels.player import expression, words
from livebass.kernels.player.channels import has_own_notes, leading, pedal_is_down, rings_on
from livebass.kernels.player.controls import (
    BEND_RANGE_RPN,
    COARSE_RPN,
    DATA,
    DATA_FINE,
    FINE_RPN,
    control,
    is_switch,
    range_with,
    set_value,
    turn_switch,
)
from livebass.kernels.player.events import send_value_to_all, send_vibrato
from livebass.kernels.player.fingering import has_note, natural_harmonic
from livebass.kernels.player.notes import EVERY_STRING, cut_note, note_off, note_on, stop_string
from livebass.kernels.player.parameters import place_note, string_note
from livebass.kernels.player.performer import (
    ALL_ALIKE,
    ALWAYS,
    ANY,
    CHANNELS,
    FREE,
    GUITAR_RANGE,
    MAX_STRINGS,
    MPE_RANGE,
    NEVER,
    NOTE_A_CHANNEL,
    STRING_A_CHANNEL,
    WHILE_HELD,
    operators_at,
    performer_at,
)
from livebass.kernels.player.tablature import play_by_string
from livebass.kernels.player.touches import hand_lies_across
from livebass.kernels.string.records import EVENT, IDLE, PLUCK, RING_ON, STRIKE_EVENT, THROW
from livebass.rows.techniques import CC_EXPRESSION, CC_VIBRATO, HARMONIC

jit = compiled(attributes=SMALL)

NOTE_OFF, NOTE_ON, CONTROL, PRESSURE, WHEEL = 0x80, 0x90, 0xB0, 0xD0, 0xE0  # kinds of messages
RELEASE = 64  # velocity of a note-off without one
BRIGHTNESS = 74  # an MPE channel's controller for the place of its next pluck
MONO, POLY = 126, 127  # channel mode messages: MIDI mode 4, and its end
MPE_RPN = 6

events_at = records_at(EVENT)


@entry("void(int64, int64, int64, int64, int64)", SMALL)
def take_message(p, ops, status, first, second):
    """C function: `handle_message` for addresses."""
    performer = performer_at(p)
    operators = operators_at(ops, performer.strings, performer.frets + 1)
    handle_message(performer, operators, status, first, second)


@entry("void(int64, int64, int64, float64)", SMALL)
def take_event(p, ops, word, value):
    """C function: `handle_event` for addresses."""
    performer = performer_at(p)
    handle_event(performer, operators_at(ops, performer.strings, performer.frets + 1), word, value)


@entry("void(int64, int64, int64, int64, float64)", SMALL)
def take_word_ringing(p, ops, player, word, value):
    """C function: `ring_on` for addresses, with all of `player`'s events."""
    performer = performer_at(p)
    operators = operators_at(ops, performer.strings, performer.frets + 1)
    ring_on(performer, operators, performer_at(player), np.int64(0), word, value)


@jit
def handle_message(p, ops, status, first, second):
    """Handles one channel message: writes at most MAX_EVENTS events to `p.out`.

    ops (strings, frets + 1) are the operators. Anything but a channel message with data bytes of 0 to 127 is ignored.
    """
    if 0x80 <= status <= 0xEF and first <= 127 and second <= 127:
        channel = status & 0x0F
        if not (has_own_notes(p, channel) and handle_own_message(p, ops, status, first, second)):
            handle_common_message(p, ops, status, first, second)
    update_idle(p)


@jit
def handle_event(p, ops, word, value):
    """Handles an event other than MIDI (words.py): writes at most MAX_EVENTS events to `p.out`."""
    kind, number = words.kind_of(word), word & words.NUMBER
    if kind == words.STRING_BEND:
        expression.bend_string(p, number, value)
    elif kind == words.NOTE_BEND:
        expression.bend_note(p, words.key_channel_of(word), number, value)
    elif kind == words.NOTE_VIBRATO:
        expression.vibrate_note(p, words.key_channel_of(word), number, value)
    elif kind == words.NOTE_CUT:
        cut_note(p, words.key_channel_of(word), number)
    elif kind == words.NOTE_PLACE:
        place_note(p, number, value)
    elif kind == words.NOTE_STRING:
        string_note(p, number, value)
    elif words.plays_strings(kind):
        play_by_string(p, ops, kind, word, value)
    else:
        set_value(p, ops, kind, number, value)
    update_idle(p)


@jit
def ring_on(p, ops, player, before, word, value):
    """Handles a word and its value for a bass that rings out while `player` plays: it starts no notes.

    `player` has turned the word into its events from `before` on. If it is a note's and they pluck or strike a string,
    the string of the same tuning is damped here.
    """
    status, first, second = words.unpack(word)
    kind = words.kind_of(word)
    if kind == words.STROKE or (kind == words.MIDI and status & 0xF0 == NOTE_ON and second > 0):
        damp_replaced(p, player, before)
    elif kind == words.MIDI:
        handle_message(p, ops, status, first, second)
    else:
        handle_event(p, ops, word, value)


@jit
def damp_replaced(p, player, before):
    """Damps each string with the tuning of one that `player` plucks or strikes in its events from `before` on."""
    events = events_at(player.out.events, player.out.count)
    for k in range(before, player.out.count):
        event = events[k]
        if event.kind in (PLUCK, STRIKE_EVENT, THROW):
            for i in range(p.strings):
                if p.open[i] == player.open[event.string]:
                    stop_string(p, i)


@jit
def handle_common_message(p, ops, status, first, second):
    """Handles a message of a channel without a string or zone of its own."""
    kind, channel = status & 0xF0, status & 0x0F
    if kind in (NOTE_ON, NOTE_OFF):
        on = kind == NOTE_ON and second > 0
        if is_switch(p, first):
            turn_switch(p, ops, first, on)
        elif on:
            note_on(p, ops, channel, first, second)
        else:
            note_off(p, ops, channel, first, second if kind == NOTE_OFF else RELEASE, np.int64(EVERY_STRING))
    elif kind == CONTROL and first == DATA and leading(p, channel).rpn == MPE_RPN:
        # this master channel's MPE zone
        members = min(second, CHANNELS - 1)
        set_mode(p, np.int64(NOTE_A_CHANNEL), 1 if channel == 0 else CHANNELS - 1 - members, members)
    elif kind == CONTROL:
        if first >= MONO:
            p.controls.mono = first == MONO and second < 2
            set_mode(p, STRING_A_CHANNEL if first == MONO else ALL_ALIKE, channel, min(second, CHANNELS - channel))
        control(p, ops, channel, first, second)
    elif kind == WHEEL:
        p.controls.channel[channel].wheel = expression.wheel_of(first, second)
        p.controls.channel[ANY].wheel = expression.wheel_of(first, second)
        if p.wheel_slides:
            expression.follow_wheel(p, channel)
        else:
            expression.send_bends(p, channel)


@jit
def set_mode(p, mode, first, channels):
    """Gives `channels` channels from `first` on a meaning."""
    controls = p.controls
    wanted = mode if channels > 1 else ALL_ALIKE
    if wanted != controls.mode:
        forget_channels(p)
    meant = wanted != ALL_ALIKE or controls.mode != ALL_ALIKE
    controls.mode = wanted
    controls.first_channel = first
    controls.channels = channels
    if meant:
        share_pedals(p)
    controls.channel_range = MPE_RANGE if mode == NOTE_A_CHANNEL else GUITAR_RANGE
    controls.channel_wheel[:] = 0.0
    controls.channel_place[:] = np.nan
    p.hands.channel_string[:] = -1
    for i in range(MAX_STRINGS):
        controls.string_bend[i] = 0.0
        if controls.string_expression[i] != 1.0:
            expression.express_string(p, i, 1.0)


@jit
def share_pedals(p):
    """Lets the pedals of all channels without notes of their own hold the whole bass."""
    pedals = 0
    for channel in range(CHANNELS):
        if not has_own_notes(p, channel):
            pedals |= p.controls.channel[channel].pedal
    p.controls.channel[ANY].pedal = pedals


@jit
def forget_channels(p):
    """Makes all strings follow ANY, whichever channel played them, and forgets which channels hold keys."""
    for i in range(p.strings):
        expression.take_channel(p, i, np.int64(-1))
    p.hands.holding[:] = 0


@jit
def handle_own_message(p, ops, status, first, second):
    """Handles a message of a channel with its own string or notes; False: it is for the bass."""
    controls, kind, channel = p.controls, status & 0xF0, status & 0x0F
    if (kind in (NOTE_OFF, NOTE_ON)) and is_switch(p, first):
        return False
    i = p.hands.channel_string[channel]
    if controls.mode == STRING_A_CHANNEL:
        i = max(p.strings - 1 - (channel - controls.first_channel), -1)  # the highest string has the first channel
    if kind == NOTE_ON and second > 0:
        play_own_note(p, ops, i, channel, first, second)
    elif kind in (NOTE_ON, NOTE_OFF):
        if controls.mode != STRING_A_CHANNEL:
            return False
        if i >= 0:
            note_off(p, ops, channel, first, second if kind == NOTE_OFF else RELEASE, i)
    elif kind == WHEEL:
        controls.channel_wheel[channel] = expression.wheel_of(first, second)
        if i >= 0:
            expression.bend_string(p, i, controls.channel_wheel[channel] * controls.channel_range)
    elif kind == PRESSURE or (kind == CONTROL and p.key_map.function[first] == CC_VIBRATO):
        pressure = first if kind == PRESSURE else second
        if i >= 0:
            send_vibrato(p, i, expression.VIBRATO_DEPTH * pressure / 127.0, expression.VIBRATO_RATE)
    elif kind == CONTROL and controls.mode == STRING_A_CHANNEL and p.key_map.function[first] == CC_EXPRESSION:
        if i >= 0:
            expression.express_string(p, i, second / 127.0)
    elif kind == CONTROL and first == BRIGHTNESS:
        controls.channel_place[channel] = 1.0 - second / 63.5  # up is brighter, nearer to the bridge
    elif kind == CONTROL and controls.channel[ANY].rpn == BEND_RANGE_RPN and (first in (DATA, DATA_FINE)):
        controls.channel_range = range_with(controls.channel_range, first, second)  # other channels set the bass's
    elif kind == CONTROL and (first in (DATA, DATA_FINE)):
        return controls.channel[ANY].rpn in (FINE_RPN, COARSE_RPN)  # no channel of a zone tunes the others
    else:
        return False
    return True


@jit
def play_own_note(p, ops, i, channel, key, velocity):
    """Plays a note of a zone's channel, with the channel's place and bend; on string `i` if it has one."""
    controls = p.controls
    if controls.mode == STRING_A_CHANNEL:
        if not (has_note(p, i, key) or has_harmonic(p, i, key)):  # a channel without a string has no notes
            p.dropped += 1
            return
        controls.string_of[key] = i
    if not np.isnan(controls.channel_place[channel]):
        controls.place_of[key] = controls.channel_place[channel]
    note_on(p, ops, channel, key, velocity)
    latest = p.hands.latest
    p.hands.channel_string[channel] = latest
    if latest >= 0:
        expression.bend_string(p, latest, controls.channel_wheel[channel] * controls.channel_range)


@jit
def has_harmonic(p, i, key):
    """True if harmonics are on and `key` is a natural harmonic of string `i`, which may be -1."""
    return i >= 0 and p.switched[HARMONIC] > 0 and natural_harmonic(p, key, i)[1] > 0


@jit
def update_idle(p):
    """Tells every string which strings are neither played nor muted, if that changed: they may answer (answers.py).

    With WHILE_HELD, the hands that end the last note also rest on the idle strings, and those that move mute them in
    passing. Under the pedal, or with ALWAYS, they ring on. A hand that lies across all strings mutes them in any case.
    """
    if p.answering == NEVER:
        return
    idle, held = 0, False
    for i in range(p.strings):
        held = held or p.hands.state[i] != FREE
    across = hand_lies_across(p)
    ringing_on = p.answering == ALWAYS or pedal_is_down(p)
    free = ringing_on or (p.answering == WHILE_HELD and held)
    for i in range(p.strings):
        if p.hands.state[i] == FREE and (free or rings_on(p, i)) and not across:
            idle |= 1 << i
    if ringing_on and idle != 0:
        idle |= RING_ON
    if idle == p.idle:
        return
    p.idle = idle
    send_value_to_all(p, IDLE, float(p.idle))
