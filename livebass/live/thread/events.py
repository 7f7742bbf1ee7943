"""A block's messages and other events: from the rings to the basses' performers. [audio thread]"""

import numpy as np

from livebass.compiling import jit
from livebass.kernels.bass import strings
from livebass.kernels.bass.records import EVENT_ROOM, bass_at
from livebass.kernels.effects.records import KNOBS
from livebass.kernels.machine.elementary import power
from livebass.kernels.machine.native import load_acquire, record_address, store_release
from livebass.kernels.pickup import tone
from livebass.kernels.player import controls, expression, messages, parameters, words
from livebass.kernels.player.performer import ALL_ALIKE, CHANNELS, MAX_EVENTS
from livebass.kernels.score.kits import BANK, DRUMS, GM2_DRUMS, GM2_MELODIC, XG_DRUMS
from livebass.live.thread.records import MAX_MESSAGES, PANIC, PLAYED_RING, RINGS, operators_of, performer_of, string_of
from livebass.live.thread.ring import NOW, next_frame, pop, push_midi, push_word
from livebass.rows.techniques import (
    EFFECT,
    GAIN_DB,
    LEARNED,
    MAX_EFFECTS,
    MIN_EFFECTS,
    MINIMUM,
    PARAMETER,
    PARAMETERS,
    TECHNIQUE,
)

GAIN_POLE = 0.004  # part of the way to its target that the gain moves each frame


@jit
def keep_message(synth, frame, status, first, second):
    """Hands a played message to the recorder, if there is one."""
    played = load_acquire(record_address(synth) + PLAYED_RING)
    if played != 0 and not push_midi(played, synth.played_size, frame, status, first, second):
        synth.played_lost += 1


@jit
def keep_event(synth, frame, word, value):
    """Hands a tablature's event to the recorder, if there is one."""
    played = load_acquire(record_address(synth) + PLAYED_RING)
    if played != 0 and not push_word(played, synth.played_size, frame, word & (1 << 32) - 1, np.float32(value)):
        synth.played_lost += 1


@jit
def play_message(synth, b, frame, status, first, second):
    """Hands one message for synth frame `frame` to the performer of `b`."""
    synth.messages += 1
    keep_message(synth, frame, status, first, second)
    if status & 0xF0 == 0xC0:
        if not selects_kit(synth, b, status & 0x0F):
            synth.program = first
            synth.program_count += 1
        return
    if status & 0xF0 == 0xB0 and first == BANK:
        synth.banks[status & 0x0F] = second + 1
    # plucking points and grazing apexes always come from the fine operators, even if the coarse ones play
    messages.handle_message(performer_for(b, frame), operators_of(b, 0), status, first, second)
    synth.parameters[TECHNIQUE] = performer_of(b).controls.adjusted[TECHNIQUE]  # keys and controllers move it, too


@jit
def selects_kit(synth, b, channel):
    """True if a program of `channel` selects drums, not a bass: by its bank, or on channel 10.

    If channels have their own strings or notes there are no drums.
    """
    bank = synth.banks[channel] - 1
    if performer_of(b).controls.mode != ALL_ALIKE:
        return False
    return bank == GM2_DRUMS or bank in XG_DRUMS or (channel == DRUMS and bank != GM2_MELODIC)


@jit
def performer_for(b, frame):
    """The performer of `b`, set to send its next events for synth frame `frame`."""
    p = performer_of(b)
    p.out.frame = frame - b.frame
    return p


@jit
def extend_gains(synth, until):
    """Computes the gain ramp up to frame `until` of this chunk."""
    gain = synth.gain
    for j in range(synth.gains_known, until):
        gain += GAIN_POLE * (synth.gain_target - gain)
        synth.gains[j] = gain
    synth.gain = gain
    synth.gains_known = max(synth.gains_known, until)


@jit
def extend_knobs(synth, until):
    """Records the effects' knobs up to frame `until` of this chunk."""
    for which in range(KNOBS):
        for j in range(synth.knobs_known, until):
            synth.knobs[which, j] = synth.effects[which]
    synth.knobs_known = max(synth.knobs_known, until)


@jit
def play_event(synth, b, frame, word, value):
    """Handles an event other than MIDI for synth frame `frame`."""
    kind, number = words.kind_of(word), word & words.NUMBER
    if words.plays_strings(kind):
        synth.messages += 1
        keep_event(synth, frame, word, value)
    if kind == EFFECT and number < KNOBS:
        extend_knobs(synth, frame - synth.frame)
        within = min(max(value, MIN_EFFECTS[number]), MAX_EFFECTS[number])
        synth.effects[number] = within if not np.isnan(value) else 0.0
    if kind == PARAMETER and number < PARAMETERS:
        controller = words.controller_of(word)
        if controller >= 0:
            keep_message(synth, frame, 0xB0 | (word >> words.CHANNEL_BIT) & 0x0F, LEARNED + number, controller)
        synth.parameters[number] = parameters.within_limits(number, value)
        if number == GAIN_DB:
            extend_gains(synth, frame - synth.frame)
            set_gain(synth, synth.parameters[number])
            if frame == 0:
                synth.gain = synth.gain_target
            return
    messages.handle_event(performer_for(b, frame), operators_of(b, 0), word, value)


@jit
def set_gain(synth, value):
    """Sets the gain's target to `value` dB; the minimum is silence."""
    synth.gain_target = power(10.0, value / 20.0) if value > MINIMUM[GAIN_DB] else 0.0


@jit
def ring_on(synth, b, before, frame, word, value):
    """Hands a word, which became the events of `b` from `before` on, to the bass that rings out, if any."""
    if synth.old_bass != 0:
        old = bass_at(synth.old_bass)
        p = performer_for(old, frame)
        messages.ring_on(p, operators_of(old, 0), performer_of(b), before, word, value)


@jit
def collect_events(synth, b, n):
    """Turns all messages for the next `n` frames, in order, into events of `b` and the bass that rings out."""
    end = synth.frame + n
    out = performer_of(b).out
    old_out = performer_of(bass_at(synth.old_bass)).out if synth.old_bass != 0 else out
    out.count = 0
    old_out.count = 0
    panic = record_address(synth) + PANIC
    if load_acquire(panic) != 0:
        store_release(panic, 0)
        for number in (np.int64(120), np.int64(121)):  # all sound off, reset all controllers
            # typed: functions called with a literal would be compiled a second time
            for channel in range(CHANNELS):
                control = np.int64(0xB0 | channel)
                play_message(synth, b, synth.frame, control, number, np.int64(0))
                ring_on(synth, b, out.count, synth.frame, words.pack(control, number, np.int64(0)), 0.0)
    last = synth.frame
    for _ in range(MAX_MESSAGES):  # a flood of messages must wait, the sound must not
        if max(out.count, old_out.count) + MAX_EVENTS > EVENT_ROOM:
            break
        best = end
        ring = -1
        for k in range(RINGS):
            when = next_frame(synth.midi_ring[k], synth.midi_ring_size[k], end)
            if when == NOW:
                when = synth.frame
            if when < best:
                best = when
                ring = k
        if ring < 0:
            break
        last = max(last, best)
        word, value = pop(synth.midi_ring[ring], synth.midi_ring_size[ring])
        before = out.count
        if words.kind_of(word) == words.MIDI:
            status, first, second = words.unpack(word)
            play_message(synth, b, last, status, first, second)
        else:
            play_event(synth, b, last, word, value)
        ring_on(synth, b, before, last, word, value)


@jit
def apply_parameters(synth, b):
    """Gives a new bass, with its strings at rest, the parameters that were set for earlier basses."""
    p = performer_of(b)
    for number in range(PARAMETERS):
        if synth.parameters[number] == 0.0:
            continue  # the bass's own
        p.out.count = 0  # the strings are set below
        parameters.set_parameter(p, number, synth.parameters[number])
    for i in range(b.strings):
        v = string_of(b, i).voice
        v.tone_wanted = p.tone
        if v.tone != v.tone_wanted:
            tone.set_tone(v, v.tone_wanted)


@jit
def take_controllers(b, old):
    """Gives a bass that has not played yet the volume, pedal, bend and other controllers of the bass `old`."""
    p = performer_of(b)
    controls.take_over(p, performer_of(old))
    for i in range(b.strings):
        strings.set_controls(string_of(b, i).voice, p, i)
    b.floor.gain_wanted = expression.loudness(p, np.int64(0))  # the floor follows string 0's events
