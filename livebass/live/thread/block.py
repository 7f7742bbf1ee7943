"""One block of sound: MIDI messages in, samples out, meters. All that the audio thread does. [audio thread]

No Python, allocation, lock, file or print in here. Under overload strings change to coarse operators, and back later.
What is left of a block's time lets strings run ahead of the clock (`ahead`).
"""

from typing import Any

import numpy as np

from livebass.compiling import callback, counted
from livebass.kernels import performer, techniques
from livebass.kernels.native import (
    FLUSH,
    float_control,
    load_acquire,
    nanoseconds,
    record_address,
    set_float_control,
    store_release,
)
from livebass.kernels.performer import MOST_EVENTS
from livebass.live.thread import ahead
from livebass.live.thread.records import (
    BLOCK_TIME,
    CAPTURE_RING,
    CHUNK,
    EVENT_ROOM,
    FADED_BASS,
    HISTOGRAM,
    HORIZON,
    LEAST_MESSAGES,
    MOST_MESSAGES,
    NEXT_BASS,
    PANIC,
    RINGS,
    SOUND_RING,
    ahead_of,
    bass_at,
    events_of,
    operators_of,
    performer_of,
    samples_at,
    sound_of,
    string_events_of,
    string_of,
    synth_at,
)
from livebass.live.thread.ring import NOW, next_frame, pop, push_sound

FADE = 0.03  # s of fade-out of a bass that was replaced
GAIN_POLE = 0.004  # part of the way to its target that the gain goes each frame


@counted
def handle_message(synth, b, frame, status, first, second, count):
    """Hands one message for synth frame `frame` to the performer; returns the new number of events."""
    synth.messages += 1
    kind = status & 0xF0
    if kind == 0xC0:
        synth.program = synth.bank << 8 | first
        synth.program_count += 1
        return count
    if kind == 0xB0 and (first == 0 or first == 32):
        synth.bank = (synth.bank & 0x7F) | second << 7 if first == 0 else (synth.bank & ~0x7F) | second
        return count
    # plucking points and grazing apexes come from the fine operators, whichever play
    return performer.message(
        performer_of(b), operators_of(b, 0), frame - b.frame, status, first, second, events_of(b), count
    )


@counted
def collect_events(synth, b, n):
    """Turns all messages for the next `n` frames, in order, into events of `b`; returns their number."""
    end = synth.frame + n
    count = np.int64(0)  # typed: functions called with a literal would be compiled a second time
    panic = record_address(synth) + PANIC
    if load_acquire(panic) != 0:
        store_release(panic, 0)
        control = np.int64(0xB0) | synth.channel & 0x0F
        for number in (np.int64(120), np.int64(121)):  # all sound off, reset all controllers
            count = handle_message(synth, b, synth.frame, control, number, np.int64(0), count)
    last = synth.frame
    for _ in range(min(MOST_MESSAGES, LEAST_MESSAGES + n // 8)):  # a flood of messages waits, the sound does not
        if count + MOST_EVENTS > EVENT_ROOM:
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
        status, first, second = pop(synth.midi_ring[ring], synth.midi_ring_size[ring])
        count = handle_message(synth, b, last, status, first, second, count)
    return count


@counted
def mix_strings(synth, b, count, out, n, fade, whole):
    """Adds n frames of every string of `b` to out (n,) float32.

    `fade` of `whole` frames are left of a fade-out; -1: no fade.
    """
    events, string_events = events_of(b), string_events_of(b)
    start = synth.frame - b.frame
    for i in range(b.strings):
        used = 0
        for k in range(count):
            if events[k].string == i:
                string_events[used] = events[k]
                used += 1
        ahead.play_to(b, i, start + n, used)
        sound = sound_of(ahead_of(b, i))
        gain = synth.gain
        for j in range(n):
            gain += GAIN_POLE * (synth.gain_target - gain)
            x = sound[(start + j) % SOUND_RING] * gain
            if fade >= 0:
                x *= max(fade - j, 0) / whole
            if not abs(x) < 1e6:
                x = 0.0
                synth.faults += 1
            out[j] += np.float32(x)


@counted
def render_chunk(synth, out, n):
    """Plays n <= CHUNK frames into out (n,) float32, held within full scale."""
    for j in range(n):
        out[j] = 0.0
    if synth.bass != 0:
        b = bass_at(synth.bass)
        count = collect_events(synth, b, n)
        mix_strings(synth, b, count, out, n, np.int64(-1), np.int64(1))
    if synth.fading_bass != 0:
        whole = np.int64(FADE * synth.rate)
        mix_strings(synth, bass_at(synth.fading_bass), np.int64(0), out, n, synth.fade_left, whole)
        synth.fade_left -= n
        if synth.fade_left <= 0:
            store_release(record_address(synth) + FADED_BASS, synth.fading_bass)
            synth.fading_bass = 0
    for _ in range(n):
        synth.gain += GAIN_POLE * (synth.gain_target - synth.gain)
    most = synth.peak
    for j in range(n):
        most = max(most, abs(np.float64(out[j])))
        out[j] = min(max(out[j], np.float32(-1.0)), np.float32(1.0))
    synth.peak = most
    synth.frame += n


@counted
def switch_bass(synth):
    """Starts the bass that Python has put ready and fades out the present one, unless one is fading already."""
    here = record_address(synth)
    if synth.fading_bass == 0 and load_acquire(here + FADED_BASS) == 0:
        wanted = load_acquire(here + NEXT_BASS)
        if wanted != 0:
            store_release(here + NEXT_BASS, 0)
            synth.fading_bass = synth.bass
            synth.fade_left = np.int64(FADE * synth.rate)
            synth.bass = wanted
            bass_at(wanted).frame = synth.frame
            synth.overload = 0


@counted
def capture(synth, out, n):
    """Hands the sound to the recorder and counts the frames that find no room in its ring."""
    address = load_acquire(record_address(synth) + CAPTURE_RING)
    if address != 0:
        synth.capture_lost += push_sound(address, synth.capture_size, out, n)


@callback("void(int64, int64, int64)")
def process(address, sound, n):
    """C function: plays n frames of the synth at `address` into the float32 at address `sound`."""
    out = samples_at(sound, n)
    before = float_control()
    set_float_control(before | FLUSH)  # denormal numbers become zero in here; the thread's owner may want them
    synth = synth_at(address)
    began = nanoseconds(synth.clock, synth.clock_id)
    synth.block_frame = synth.frame
    synth.block_frames = n
    store_release(address + BLOCK_TIME, began)
    switch_bass(synth)
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
        run_ahead(synth, began, n)
        synth.busy = nanoseconds(synth.clock, synth.clock_id) - began
        if synth.busy * 1e-9 * synth.rate > n:
            synth.late += 1
    set_float_control(before)


@counted
def run_ahead(synth, began, n):
    """Lets strings play past the end of a block of n frames that began at `began` (ns), for a share of its time."""
    if synth.bass == 0:
        return
    b = bass_at(synth.bass)
    until = began + np.int64(b.share * 1e9 * n / synth.rate)
    end = synth.frame - b.frame
    while nanoseconds(synth.clock, synth.clock_id) < until:
        i = ahead.rearmost(b, end + HORIZON)
        if i < 0:
            return
        ahead.step_ahead(b, i, end)


@counted
def update_meters(synth, load):
    """Counts a block that needed `load` of its time."""
    synth.load = load
    synth.load_worst = max(synth.load_worst, load)
    place = 0 if load <= 0.0 else np.int64(32.0 + 4.0 * np.log2(load))
    synth.histogram[min(max(place, 0), HISTOGRAM - 1)] += 1


HIGH, LOW = 0.75, 0.35  # load above which a string is made coarse, below which the synth calms down
CALM = 0.5  # s of low load before a string gets its fine operators back


@counted
def adapt(synth, load, n):
    """Moves one string to the coarse operators under overload, newest contacts first; one back in calm times."""
    if synth.bass == 0 or not synth.adaptive:
        return
    b = bass_at(synth.bass)
    p = performer_of(b)
    if load > HIGH:
        synth.calm_frames = 0
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
            value = p.age[i] if touching else -1e12 - p.age[i]
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


@counted
def switch_operators(b, i, which, now):
    """Gives string `i` the operators `which` (0 fine, 1 coarse) from synth frame `now` on."""
    ahead.drop_ahead(b, i, now - b.frame)
    techniques.change_operators(string_of(b, i), operators_of(b, 1 - which)[i], operators_of(b, which)[i])
    b.coarse ^= 1 << i
