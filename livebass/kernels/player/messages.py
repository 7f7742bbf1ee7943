"""MIDI messages to the performer: of channels that have a meaning of their own, and of all others. [audio thread]"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.player.controls import control, is_switch, turn_switch
from livebass.kernels.player.events import emit
from livebass.kernels.player.expression import VIBRATO_DEPTH, VIBRATO_RATE, bend_string, tell_bend, tell_slide, wheel_of
from livebass.kernels.player.fingering import has_note
from livebass.kernels.player.notes import note_off, note_on, stop_string
from livebass.kernels.player.performer import (
    ALL_ALIKE,
    ALWAYS,
    CHANNELS,
    FREE,
    MOST_RANGE,
    MOST_STRINGS,
    NOTE_A_CHANNEL,
    STRING_A_CHANNEL,
    WITH_PEDAL,
    events_at,
    operators_at,
    performer_at,
)
from livebass.kernels.string.records import IDLE, PLUCK, STRIKE_EVENT, THROW, WAVER
from livebass.techniques import CC_VIBRATO

GUITAR_RANGE, MPE_RANGE = 12.0, 48.0  # semitones of a channel's wheel, until RPN 0 says another range


@entry("int64(int64, int64, int64, int64, int64, int64, int64, int64, int64)")
def take_message(p, ops, frame, status, first, second, events, room, count):
    """C function: `message` for addresses; there is room for `room` events."""
    performer = performer_at(p)
    operators = operators_at(ops, performer.strings, performer.frets + 1)
    return message(performer, operators, frame, status, first, second, events_at(events, room), count)


@entry("int64(int64, int64, int64, int64, int64, int64, int64, int64, int64, int64, int64)")
def take_message_ringing(p, ops, player, told, told_count, frame, status, first, second, events, room):
    """C function: `ring_on` for addresses, with events from the first on; there is room for `room` of them."""
    performer = performer_at(p)
    operators = operators_at(ops, performer.strings, performer.frets + 1)
    start = np.int64(0)
    return ring_on(
        performer, operators, performer_at(player), events_at(told, told_count), start, told_count, frame, status,
        first, second, events_at(events, room), start,
    )  # fmt: skip


@jit
def set_mode(p, mode, first, channels):
    """Gives channels a meaning: `channels` of them from `first` on."""
    p.mode = mode if channels > 1 else ALL_ALIKE
    p.first_channel = first
    p.channels = channels
    p.channel_range = MPE_RANGE if mode == NOTE_A_CHANNEL else GUITAR_RANGE
    for channel in range(CHANNELS):
        p.channel_wheel[channel] = 0.0
        p.channel_place[channel] = np.nan
        p.channel_string[channel] = -1
    for i in range(MOST_STRINGS):
        p.string_bend[i] = 0.0


@jit
def own_message(p, ops, frame, status, first, second, events, count):
    """A message of a channel that has a string, or notes, of its own; returns the new count, -1: it is for the bass."""
    channel, kind = status & 0x0F, status & 0xF0
    i = p.channel_string[channel]
    if p.mode == STRING_A_CHANNEL:
        i = max(p.strings - 1 - (channel - p.first_channel), -1)  # the highest string has the first channel
    if (kind == 0x80 or kind == 0x90) and is_switch(p, first):
        return np.int64(-1)
    if p.mode == STRING_A_CHANNEL and (kind == 0x80 or (kind == 0x90 and second == 0)):
        if i < 0:
            return count
        return note_off(p, ops, frame, first, second if kind == 0x80 else 64, i, events, count)
    if kind == 0x90 and second > 0:
        if p.mode == STRING_A_CHANNEL:
            if not has_note(p, i, first):  # none has any on a channel without a string
                p.dropped += 1
                return count
            p.string_of[first] = i
        if not np.isnan(p.channel_place[channel]):
            p.place_of[first] = p.channel_place[channel]
        count = note_on(p, ops, frame, first, second, events, count)
        p.channel_string[channel] = p.latest
        if p.latest >= 0:
            count = bend_string(p, frame, p.latest, p.channel_wheel[channel] * p.channel_range, events, count)
        return count
    if kind == 0xE0:
        p.channel_wheel[channel] = wheel_of(first, second)
        if i < 0:
            return count
        return bend_string(p, frame, i, p.channel_wheel[channel] * p.channel_range, events, count)
    if kind == 0xD0 or (kind == 0xB0 and p.controller[first] == CC_VIBRATO):
        pressure = first if kind == 0xD0 else second
        if i < 0:
            return count
        return emit(events, count, frame, WAVER, i, 0, VIBRATO_DEPTH * pressure / 127.0, VIBRATO_RATE)
    if kind == 0xB0 and first == 74:
        p.channel_place[channel] = 1.0 - second / 63.5  # up is brighter, nearer to the bridge
        return count
    if kind == 0xB0 and p.parameter == 0 and (first == 6 or first == 38):  # RPN 0 on any other channel is the bass's
        whole = float(min(second, MOST_RANGE)) if first == 6 else np.floor(p.channel_range)
        p.channel_range = whole + (
            min(second, 99) / 100.0 if first == 38 else p.channel_range - np.floor(p.channel_range)
        )
        return count
    return np.int64(-1)


@jit
def tell_idle(p, frame, events, count):
    """Tells every string which ones nobody plays or mutes, where that has changed: they may answer (answers.py)."""
    idle = 0
    if p.answering == ALWAYS or (p.answering == WITH_PEDAL and p.pedal):
        for i in range(p.strings):
            if p.state[i] == FREE:
                idle |= 1 << i
    if idle == p.idle:
        return count
    p.idle = idle
    for i in range(p.strings):
        count = emit(events, count, frame, IDLE, i, 0, float(idle), 0.0)
    return count


@jit
def message(p, ops, frame, status, first, second, events, count):
    """One channel message at `frame`; writes events from index `count` on and returns the new count.

    ops (strings, frets + 1) are the operators; `events` needs MOST_EVENTS places free. Anything that is not a channel
    message with data bytes of 0 to 127 is ignored.
    """
    count = carry_out(p, ops, frame, status, first, second, events, count)
    return tell_idle(p, frame, events, count)


@jit
def ring_on(p, ops, player, told, before, after, frame, status, first, second, events, count):
    """`message` for a bass that rings out while `player` plays: it starts no note; returns the new count.

    `player` has turned the message into the events told[before:after]: a string that is plucked or struck there is
    damped here, by its tuning.
    """
    if not (status & 0xF0 == 0x90 and second > 0):
        return message(p, ops, frame, status, first, second, events, count)
    for k in range(before, after):
        event = told[k]
        if event.kind in (PLUCK, STRIKE_EVENT, THROW):
            for i in range(p.strings):
                if p.open[i] == player.open[event.string]:
                    count = stop_string(p, i, frame, events, count)
    return count


@jit
def carry_out(p, ops, frame, status, first, second, events, count):
    """`message`, but for the strings that may answer."""
    if status < 0x80 or status > 0xEF or first > 127 or second > 127:
        return count
    kind, channel = status & 0xF0, status & 0x0F
    if p.mode != ALL_ALIKE and p.first_channel <= channel < p.first_channel + p.channels:
        after = own_message(p, ops, frame, status, first, second, events, count)
        if after >= 0:
            return after
    if kind == 0xB0 and first >= 126:
        p.mono = first == 126 and second < 2
        set_mode(p, STRING_A_CHANNEL if first == 126 else ALL_ALIKE, channel, min(second, CHANNELS - channel))
    if kind == 0xB0 and first == 6 and p.parameter == 6:  # the zone of MPE whose master is this channel
        members = min(second, CHANNELS - 1)
        set_mode(p, NOTE_A_CHANNEL, 1 if channel == 0 else CHANNELS - 1 - members, members)
        return count
    if (kind == 0x80 or kind == 0x90) and is_switch(p, first):
        return turn_switch(p, ops, first, kind == 0x90 and second > 0, frame, events, count)
    if kind == 0x90 and second > 0:
        return note_on(p, ops, frame, first, second, events, count)
    if kind == 0x80 or kind == 0x90:
        return note_off(p, ops, frame, first, second if kind == 0x80 else 64, np.int64(-1), events, count)
    if kind == 0xB0:
        return control(p, ops, frame, first, second, events, count)
    if kind == 0xE0:
        p.wheel = wheel_of(first, second)
        if p.wheel_slides:
            return tell_slide(p, frame, events, count)
        return tell_bend(p, frame, events, count)
    return count
