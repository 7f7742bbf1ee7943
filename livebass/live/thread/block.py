"""One block of sound: MIDI messages in, samples out, meters. All that the audio thread does. [audio thread]

No Python, allocation, lock, file or print in here. Under overload strings change to coarse operators, and back later.
What is left of a block's time lets strings run ahead of the clock (`ahead`).
"""

from typing import Any

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels import voice
from livebass.kernels.bass import floor, strings
from livebass.kernels.bass.records import EVENT_ROOM, SOUND_RING, bass_at
from livebass.kernels.effects import chain
from livebass.kernels.effects.records import KNOBS
from livebass.kernels.hands import fretting
from livebass.kernels.machine.elementary import log2, power
from livebass.kernels.machine.native import (
    float_control,
    flush_bits,
    load_acquire,
    nanoseconds,
    record_address,
    samples_at,
    set_float_control,
    store_release,
)
from livebass.kernels.pickup import tone
from livebass.kernels.player import controls, expression, messages, notes, parameters
from livebass.kernels.player.performer import ALL_ALIKE, CHANNELS, FADE, MOST_EVENTS, MOST_STRINGS, OVER
from livebass.kits import BANK, DRUMS, GM2_DRUMS, GM2_MELODIC, XG_DRUMS
from livebass.live.thread import ahead, helpers
from livebass.live.thread.records import (
    BLOCK_TIME,
    CAPTURE_RING,
    CHUNK,
    FADED_BASS,
    HISTOGRAM,
    HORIZON,
    KNOBS_PLACE,
    MOST_MESSAGES,
    NEXT_BASS,
    PANIC,
    PLAYED_RING,
    RINGING,
    RINGS,
    ahead_of,
    effects_of,
    events_of,
    operators_of,
    performer_of,
    sound_of,
    string_events_of,
    string_of,
    synth_at,
)
from livebass.live.thread.ring import (
    AMOUNT,
    CHANNEL_BIT,
    EFFECT,
    KIND_BIT,
    MIDI,
    NOTE_BEND,
    NOTE_CUT,
    NOTE_PLACE,
    NOTE_STRING,
    NOTE_VIBRATO,
    NOW,
    PARAMETER,
    STRING_BEND,
    controller_of,
    key_channel_of,
    next_frame,
    pop,
    push_midi,
    push_sound,
    unpack,
)
from livebass.techniques import GAIN_DB, LEARNED, LEAST, PARAMETERS

GAIN_POLE = 0.004  # part of the way to its target that the gain goes each frame
SAMPLE = 4  # bytes of a float32


@jit
def keep_message(synth, frame, status, first, second):
    """Hands a message that is played to the recorder, if there is one."""
    played = load_acquire(record_address(synth) + PLAYED_RING)
    if played != 0 and not push_midi(played, synth.played_size, frame, status, first, second):
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
    # plucking points and grazing apexes come from the fine operators, whichever play
    messages.handle_message(performer_for(b, frame), operators_of(b, 0), status, first, second)


@jit
def selects_kit(synth, b, channel):
    """True if a program of `channel` selects drums, which choose no bass: by its bank, or on channel 10.

    Where channels have strings or notes of their own there are no drums.
    """
    bank = synth.banks[channel] - 1
    if performer_of(b).controls.mode != ALL_ALIKE:
        return False
    return bank == GM2_DRUMS or bank in XG_DRUMS or (channel == DRUMS and bank != GM2_MELODIC)


@jit
def performer_for(b, frame):
    """The performer of `b`, whose next events are for synth frame `frame`."""
    p = performer_of(b)
    p.out.frame = frame - b.frame
    return p


@jit
def extend_gains(synth, until):
    """Computes the ramp of the gain up to frame `until` of this chunk."""
    gain = synth.gain
    for j in range(synth.gains_known, until):
        gain += GAIN_POLE * (synth.gain_target - gain)
        synth.gains[j] = gain
    synth.gain = gain
    synth.gains_known = max(synth.gains_known, until)


@jit
def extend_knobs(synth, until):
    """Writes down the knobs of effects up to frame `until` of this chunk."""
    for which in range(KNOBS):
        for j in range(synth.knobs_known, until):
            synth.knobs[which, j] = synth.effects[which]
    synth.knobs_known = max(synth.knobs_known, until)


@jit
def play_event(synth, b, frame, word, value):
    """Handles an event other than MIDI for synth frame `frame`."""
    kind, number = (word >> KIND_BIT) & 0xFF, word & 0xFF
    if kind == EFFECT and number < KNOBS:
        extend_knobs(synth, frame - synth.frame)
        synth.effects[number] = min(max(value, 0.0), 1.0) if not np.isnan(value) else 0.0
    if kind == PARAMETER and number < PARAMETERS:
        controller = controller_of(word)
        if controller >= 0:
            keep_message(synth, frame, 0xB0 | (word >> CHANNEL_BIT) & 0x0F, LEARNED + number, controller)
        synth.parameters[number] = parameters.within_limits(number, value)
        if number == GAIN_DB:
            extend_gains(synth, frame - synth.frame)
            set_gain(synth, synth.parameters[number])
            if frame == 0:
                synth.gain = synth.gain_target
            return
    send_event(synth, b, frame, word, value)


@jit
def set_gain(synth, value):
    """Sets the gain that is wanted to `value` dB; the least is silence."""
    synth.gain_target = power(10.0, value / 20.0) if value > LEAST[GAIN_DB] else 0.0


@jit
def send_event(synth, b, frame, word, value):
    """Hands an event other than MIDI to the performer of `b`."""
    p = performer_for(b, frame)
    kind, number = (word >> KIND_BIT) & 0xFF, word & 0xFF
    if kind == PARAMETER and number < PARAMETERS:
        parameters.set_parameter(p, number, synth.parameters[number])
    elif kind == AMOUNT:
        parameters.set_amount(p, operators_of(b, 0), number, value)
    elif kind == STRING_BEND:
        expression.bend_string(p, number, value)
    elif kind == NOTE_BEND:
        expression.bend_note(p, key_channel_of(word), number, value)
    elif kind == NOTE_VIBRATO:
        expression.vibrate_note(p, key_channel_of(word), number, value)
    elif kind == NOTE_CUT:
        notes.cut_note(p, key_channel_of(word), number)
    elif kind == NOTE_PLACE:
        parameters.place_note(p, number, value)
    elif kind == NOTE_STRING:
        parameters.string_note(p, number, value)


@jit
def apply_parameters(synth, b):
    """Sets the parameters of a bass that is new, and whose strings rest, as they were set for those before."""
    p = performer_of(b)
    for number in range(PARAMETERS):
        if synth.parameters[number] == 0.0:
            continue  # as the bass itself has it
        p.out.count = 0  # the strings are told below
        parameters.set_parameter(p, number, synth.parameters[number])
    for i in range(b.strings):
        v = string_of(b, i).voice
        v.tone_wanted = p.tone
        if v.tone != v.tone_wanted:
            tone.set_tone(v, v.tone_wanted)


@jit
def take_controllers(b, old):
    """Gives a bass that has not played yet volume, pedal, bend and the other controllers of the bass `old`."""
    p = performer_of(b)
    controls.take_over(p, performer_of(old))
    for i in range(b.strings):
        strings.set_controls(string_of(b, i).voice, p, i)
    b.floor.gain_wanted = expression.loudness(p, np.int64(0))  # whose events it follows


@entry("void(int64, int64)")
def keep_controllers(address, old):
    """C function: `take_controllers` for addresses, before a synth takes the bass."""
    take_controllers(bass_at(address), bass_at(old))


@jit
def ring_on(synth, b, before, frame, status, first, second):
    """Hands a message, which is the events of `b` from `before` on, to the bass that rings out, if there is one."""
    if synth.old_bass != 0:
        old = bass_at(synth.old_bass)
        p = performer_for(old, frame)
        messages.ring_on(p, operators_of(old, 0), performer_of(b), before, status, first, second)


@jit
def collect_events(synth, b, n):
    """Turns all messages for the next `n` frames, in order, into events of `b` and of the bass that rings out."""
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
                ring_on(synth, b, out.count, synth.frame, control, number, np.int64(0))
    last = synth.frame
    for _ in range(MOST_MESSAGES):  # a flood of messages waits, the sound does not
        if max(out.count, old_out.count) + MOST_EVENTS > EVENT_ROOM:
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
        if (word >> KIND_BIT) & 0xFF != MIDI:
            play_event(synth, b, last, word, value)
            if synth.old_bass != 0:
                send_event(synth, bass_at(synth.old_bass), last, word, value)
            continue
        status, first, second = unpack(word)
        before = out.count
        play_message(synth, b, last, status, first, second)
        ring_on(synth, b, before, last, status, first, second)


@jit
def mix_strings(synth, b, out, n, fade, whole):
    """Adds n frames of every string of `b` to out (n,) float32, and to the string's own output if there is one.

    `fade` of `whole` frames are left of a fade-out; RINGING: no fade. Where effects are on, `out` gets the mix behind
    them: they come before the gain.
    """
    events, string_events = events_of(b), string_events_of(b)
    start, count = synth.frame - b.frame, performer_of(b).out.count
    knobs = record_address(synth) + KNOBS_PLACE
    effects = chain.may_be_heard(effects_of(b), knobs, n, np.int64(CHUNK))
    if effects:
        for j in range(n):
            synth.before[j] = out[j]
            synth.dry[j] = 0.0
    played: Any = np.int64(0)  # strings, a bit each ...
    wanting: Any = np.int64(0)  # ... and those of them that are not ahead of the end of the chunk
    used = 0
    for i in range(b.strings):
        v, a = string_of(b, i).voice, ahead_of(b, i)
        a.events = used
        for k in range(count):
            if events[k].string == i:
                string_events[used] = events[k]
                used += 1
        a.count = used - a.events
        if v.still and v.frame == start and a.count == 0:
            voice.skip_to(v, start + n)
            continue
        played |= np.int64(1) << i
        if v.frame < start + n or a.count > 0:
            wanting |= np.int64(1) << i
    helpers.play_strings(synth, b, wanting, start + n)
    hisses = b.floor.level > 0.0 and hear_floor(synth, b, n, played)
    for i in range(b.strings):
        sounds, with_floor = (played >> i) & 1 != 0, hisses and i == 0
        if not sounds and not with_floor:
            continue
        sound = sound_of(ahead_of(b, i))
        apart = synth.apart[i] != 0
        own = samples_at(synth.apart[i] + SAMPLE * (synth.frame - synth.block_frame) if apart else np.int64(0), n)
        for j in range(n):
            x = sound[(start + j) % SOUND_RING] if sounds else 0.0
            if with_floor:
                x += synth.floor[j]
            if effects and abs(x) < 1e6:
                synth.dry[j] += np.float32(x)
            x *= synth.gains[j]
            if fade >= 0:
                x *= max(fade - j, 0) / whole
            if not abs(x) < 1e6:
                x = 0.0
                synth.faults += 1
            out[j] += np.float32(x)
            if apart:
                own[j] += np.float32(x)
    if effects:
        add_effects(synth, b, out, start, n, fade, whole)


@jit
def hear_floor(synth, b, n, played):
    """Fills synth.floor with n frames of the floor of `b`, whose strings `played`; returns whether it is heard."""
    loud, start = synth.floor[:n], synth.frame - b.frame
    for j in range(n):
        loud[j] = 0.0
    for i in range(b.strings):
        if (played >> i) & 1:
            sound = sound_of(ahead_of(b, i))
            for j in range(n):
                loud[j] = max(loud[j], abs(sound[(start + j) % SOUND_RING]))
    before = b.floor.left
    floor.play_floor(b.floor, loud, events_of(b), performer_of(b).out.count)
    return before > 0 or b.floor.left > 0


@jit
def add_effects(synth, b, out, start, n, fade, whole):
    """Puts the mix of `b` behind its effects in place of that before them, in the frames in which any is on."""
    knobs = record_address(synth) + KNOBS_PLACE
    chain.play_effects(effects_of(b), synth.dry, synth.heard, start, knobs, np.int64(CHUNK), n)
    for j in range(n):
        if synth.heard[j] == 0.0:
            continue
        x = np.float64(synth.dry[j]) * synth.gains[j]
        if fade >= 0:
            x *= max(fade - j, 0) / whole
        out[j] = synth.before[j] + np.float32(x)


@jit
def render_chunk(synth, out, n):
    """Plays n <= CHUNK frames into out (n,) float32, held within the synth's ceiling."""
    for j in range(n):
        out[j] = 0.0
    synth.gains_known = 0
    synth.knobs_known = 0
    if synth.bass != 0:
        b = bass_at(synth.bass)
        collect_events(synth, b, n)
        extend_gains(synth, n)
        extend_knobs(synth, n)
        mix_strings(synth, b, out, n, np.int64(RINGING), np.int64(1))
    if synth.old_bass != 0:
        mix_strings(synth, bass_at(synth.old_bass), out, n, synth.fade_left, fade_frames(synth))
        if synth.fade_left != RINGING:
            synth.fade_left = max(synth.fade_left - n, 0)
        if synth.fade_left == 0 or is_silent(bass_at(synth.old_bass), synth.frame + n):
            store_release(record_address(synth) + FADED_BASS, synth.old_bass)
            synth.old_bass = 0
    extend_gains(synth, n)
    most = synth.peak
    for j in range(n):
        level = abs(np.float64(out[j]))
        most = max(most, level)
        synth.clipped += level > 1.0
        out[j] = np.float32(min(max(np.float64(out[j]), -synth.ceiling), synth.ceiling))
    synth.peak = most
    synth.frame += n


@jit
def fade_frames(synth):
    return np.int64(FADE * synth.rate)


@jit
def is_silent(b, end):
    """True if no string or effect of `b` sounds or answers, nor its floor, and none is ahead of synth frame `end`."""
    if chain.rings(effects_of(b)) or b.floor.left > 0:
        return False
    for i in range(b.strings):
        string = string_of(b, i)
        moves = string.slots[0].on or string.slots[1].on or string.voice.answering
        moves = moves or abs(string.voice.block_out) > OVER  # its filters still hold some
        if moves or string.voice.frame > end - b.frame:
            return False
    return True


@jit
def end_old_bass(synth):
    """Begins to fade out the bass that rings out, if there is one."""
    if synth.old_bass != 0 and synth.fade_left == RINGING:
        synth.fade_left = fade_frames(synth)


@jit
def switch_bass(synth):
    """Starts the bass that Python has put ready; the present one starts no more notes and rings out.

    One that still rings out has to fade first.
    """
    here = record_address(synth)
    wanted = load_acquire(here + NEXT_BASS)
    if wanted == 0:
        return
    end_old_bass(synth)
    if synth.old_bass == 0 and load_acquire(here + FADED_BASS) == 0:
        store_release(here + NEXT_BASS, 0)
        synth.old_bass = synth.bass
        synth.fade_left = RINGING
        synth.bass = wanted
        bass_at(wanted).frame = synth.frame
        apply_parameters(synth, bass_at(wanted))
        if synth.old_bass != 0:
            bass_at(synth.old_bass).floor.closes = synth.frame - bass_at(synth.old_bass).frame
            take_controllers(bass_at(wanted), bass_at(synth.old_bass))
        synth.overload = 0


@jit
def capture(synth, out, n):
    """Hands the sound to the recorder and counts the frames that find no room in its ring."""
    address = load_acquire(record_address(synth) + CAPTURE_RING)
    if address != 0:
        synth.capture_lost += push_sound(address, synth.capture_size, out, n)


@entry("void(int64, int64, int64)")
def process(address, sound, n):
    """C function: plays n frames of the synth at `address` into the float32 at address `sound`."""
    out = samples_at(sound, n)
    before = float_control()
    set_float_control(before | flush_bits())  # denormal numbers become zero in here; the thread's owner may want them
    synth = synth_at(address)
    began = nanoseconds(synth.clock, synth.clock_id)
    synth.block_frame = synth.frame
    synth.block_frames = n
    store_release(address + BLOCK_TIME, began)
    switch_bass(synth)
    for i in range(MOST_STRINGS):
        if synth.apart[i] != 0:
            own = samples_at(synth.apart[i], n)
            for j in range(n):
                own[j] = 0.0
    done = 0
    while done < n:
        m = min(CHUNK, n - done)
        render_chunk(synth, out[done : done + m], m)
        done += m
    capture(synth, out, n)
    synth.blocks += 1
    if began != 0:
        load = (nanoseconds(synth.clock, synth.clock_id) - began) * 1e-9 * synth.rate / n
        update_meters(synth, load)
        adapt(synth, load, n)
        run_ahead(synth, began, n, load)
        synth.busy = nanoseconds(synth.clock, synth.clock_id) - began
        if synth.busy * 1e-9 * synth.rate > n:
            synth.late += 1
    set_float_control(before)


@entry("int64(int64)")
def is_still(address):
    """C function: 1 if the synth at `address` plays nothing but zeros until something is sent to it. [audio thread]"""
    synth = synth_at(address)
    if synth.bass == 0 or synth.old_bass != 0 or load_acquire(address + NEXT_BASS) != 0:
        return np.int64(0)
    for k in range(RINGS):
        if next_frame(synth.midi_ring[k], synth.midi_ring_size[k], np.int64(-2)) != -2:
            return np.int64(0)
    b = bass_at(synth.bass)
    if chain.rings(effects_of(b)) or b.floor.left > 0:
        return np.int64(0)
    for i in range(b.strings):
        v = string_of(b, i).voice
        if not v.still or v.frame != synth.frame - b.frame:
            return np.int64(0)
    return np.int64(1)


@entry("void(int64)")
def return_to_clock(address):
    """C function: takes all strings of the synth at `address` back to the clock and to their fine operators.

    What it plays from then on, without a clock, is what it plays without one from the start. [audio thread]
    """
    synth = synth_at(address)
    before = float_control()
    set_float_control(before | flush_bits())
    for k in range(2):
        bass = synth.old_bass if k else synth.bass
        if bass != 0:
            b = bass_at(bass)
            for i in range(b.strings):
                if (b.coarse >> i) & 1:
                    switch_operators(b, i, np.int64(0), synth.frame)
                else:
                    ahead.drop_ahead(b, i, synth.frame - b.frame)
    synth.overload = 0
    set_float_control(before)


MOST_SHARE = 0.6  # of a block's time to run ahead, whatever blocks took
FORGOTTEN = 5e-3  # of it a second


@jit
def touches(b):
    """True if a string of `b` has touched something since its last pluck."""
    for i in range(b.strings):
        slots = string_of(b, i).slots
        if (slots[0].on and slots[0].touching > 0) or (slots[1].on and slots[1].touching > 0):
            return True
    return False


@jit
def run_ahead(synth, began, n, load):
    """Lets strings play past the end of a block of n frames that began at `began` (ns) and took `load` of its time.

    They may for a share of its time: what two blocks lately took in which strings touched, so that no quiet block takes
    more than that. The system holds others up, and one of these now and then.
    """
    if synth.bass == 0:
        return
    b = bass_at(synth.bass)
    if b.share <= 0.0:
        return
    forgotten = FORGOTTEN * n / synth.rate
    b.share_now = max(b.share_now - forgotten, b.share)
    b.share_once = max(b.share_once - forgotten, b.share)
    if load > b.share_now and touches(b):
        took = min(load, MOST_SHARE)
        b.share_now = max(b.share_now, min(took, b.share_once))
        b.share_once = max(b.share_once, took)
    until = began + np.int64(b.share_now * 1e9 * n / synth.rate)
    end = synth.frame - b.frame
    while nanoseconds(synth.clock, synth.clock_id) < until:
        i = ahead.rearmost(b, end + HORIZON)
        if i < 0:
            return
        ahead.step_ahead(b, i, end)


@jit
def update_meters(synth, load):
    """Counts a block that needed `load` of its time."""
    synth.load = load
    synth.load_worst = max(synth.load_worst, load)
    place = 0 if load <= 0.0 else np.int64(32.0 + 4.0 * log2(load))
    synth.histogram[min(max(place, 0), HISTOGRAM - 1)] += 1


@entry("void(int64, float64, int64)")
def relieve(address, load, n):
    """Takes the `load` of the last n frames from a host that measures it, where the synth at `address` has no clock."""
    update_meters(synth_at(address), load)
    adapt(synth_at(address), load, n)


HIGH, LOW = 0.75, 0.35  # load above which a string is made coarse, below which the synth calms down
CALM = 0.5  # s of low load before a string gets its fine operators back


@jit
def adapt(synth, load, n):
    """Moves one string to the coarse operators under overload, newest contacts first; one back in calm times.

    Overload also ends a bass that rings out.
    """
    if synth.bass == 0 or not synth.adaptive:
        return
    b = bass_at(synth.bass)
    hands = performer_of(b).hands
    if load > HIGH:
        synth.calm_frames = 0
        end_old_bass(synth)
        best: Any = np.int64(-1)
        rank = -np.inf
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                continue
            slots = string_of(b, i).slots
            sounding = slots[0].on or slots[1].on
            if not sounding:
                continue
            touching = slots[0].touching > 0 or slots[1].touching > 0
            # strings with contacts, the newest first; then those that only sound, the oldest first
            value = hands.age[i] if touching else -1e12 - hands.age[i]
            if value > rank:
                rank = value
                best = i
        if best >= 0:
            switch_operators(b, best, np.int64(1), synth.frame)
            synth.overload += 1
        return
    synth.calm_frames = 0 if load > LOW else synth.calm_frames + n
    if synth.calm_frames > CALM * synth.rate and b.coarse != 0:
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                switch_operators(b, i, np.int64(0), synth.frame)
                synth.overload -= 1
                synth.calm_frames = 0
                return


@jit
def switch_operators(b, i, which, now):
    """Gives string `i` the operators `which` (0 fine, 1 coarse) from synth frame `now` on."""
    ahead.drop_ahead(b, i, now - b.frame)
    fretting.change_operators(string_of(b, i), operators_of(b, 1 - which)[i], operators_of(b, which)[i])
    b.coarse ^= 1 << i
