"""One block of the synth: messages in, sound out, meters. All that the audio thread does.

No Python, allocation, lock, file or print in here: addresses from the synth's record become arrays, rings are read
and written, and the kernels of `voice` and `performer` do the rest. [audio thread]

Less work under overload: strings go over to coarse operators, and come back. [audio thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import callback, counted
from livebass.kernels import performer, techniques
from livebass.kernels.native import (
    FLUSH,
    carray,
    float_control,
    load_acquire,
    nanoseconds,
    pointer,
    set_float_control,
    store_release,
)
from livebass.kernels.performer import MOST_EVENTS, PERFORMER
from livebass.kernels.records import EVENT
from livebass.live.thread import ahead
from livebass.live.thread.records import (
    CHUNK,
    ENTRIES,
    EVENT_ROOM,
    EVENT_WORDS,
    HEAD,
    HISTOGRAM,
    HORIZON,
    LEAST_MESSAGES,
    MOST_MESSAGES,
    NOW,
    SOUND_RING,
    SYNTH,
    TAIL,
)

FADE = 0.03  # s in which a bass that was replaced is heard out
GAIN_POLE = 0.004  # of the gain's way, each frame
WORD = 8  # bytes


@counted
def waiting(address, size, limit):
    """The frame of the next entry of an event ring, NOW, or `limit` if there is none."""
    words = carray(pointer(address), ENTRIES + EVENT_WORDS * size, np.int64)
    tail = words[TAIL]
    if load_acquire(address + WORD * HEAD) == tail:
        return limit
    return words[ENTRIES + EVENT_WORDS * (tail % size)]


@counted
def take(address, size):
    """The message of the next entry, which leaves the ring."""
    words = carray(pointer(address), ENTRIES + EVENT_WORDS * size, np.int64)
    tail = words[TAIL]
    message = words[ENTRIES + EVENT_WORDS * (tail % size) + 1]
    store_release(address + WORD * TAIL, tail + 1)
    return message


@counted
def put(address, size, frame, message):
    """Adds an entry; drops it where the ring is full."""
    words = carray(pointer(address), ENTRIES + EVENT_WORDS * size, np.int64)
    head = words[HEAD]
    if head - load_acquire(address + WORD * TAIL) >= size:
        return False
    words[ENTRIES + EVENT_WORDS * (head % size)] = frame
    words[ENTRIES + EVENT_WORDS * (head % size) + 1] = message
    store_release(address + WORD * HEAD, head + 1)
    return True


@counted
def handle_message(synth, b, frame, message, count):
    """Hands one message at synth frame `frame` to the performer; the new number of events."""
    status = message & 0xFF
    first = (message >> 8) & 0x7F
    second = (message >> 16) & 0x7F
    synth.messages += 1
    kind = status & 0xF0
    if kind == 0xC0:
        synth.program = synth.bank << 8 | first
        synth.program_count += 1
        return count
    if kind == 0xB0 and (first == 0 or first == 32):
        synth.bank = (synth.bank & 0x7F) | second << 7 if first == 0 else (synth.bank & ~0x7F) | second
        return count
    p = carray(pointer(b.performer), 1, PERFORMER)[0]
    events = carray(pointer(b.events), EVENT_ROOM, EVENT)
    # places and grazing apexes are those of the fine operators, whatever plays
    return performer.message(
        p, ahead.operators_of(b, 0), ahead.pool_of(b, 0), frame - b.frame, status, first, second, events, count
    )


@counted
def collect_events(synth, b, n):
    """All messages for the next `n` frames, in order, as events of `b`; their number."""
    end = synth.frame + n
    count = np.int64(0)  # a constant would be a type of its own: what is called with it would be compiled twice
    if load_acquire(synth.panic_address) != 0:
        store_release(synth.panic_address, 0)
        count = handle_message(synth, b, synth.frame, 0xB0 | synth.channel & 0x0F | 120 << 8, count)
        count = handle_message(synth, b, synth.frame, 0xB0 | synth.channel & 0x0F | 121 << 8, count)
    last = synth.frame
    for _ in range(min(MOST_MESSAGES, LEAST_MESSAGES + n // 8)):  # a flood waits, the sound does not
        if count + MOST_EVENTS > EVENT_ROOM:
            break
        best = end
        ring = -1
        for k in range(3):
            when = waiting(synth.ring[k], synth.ring_size[k], end)
            if when == NOW:
                when = synth.frame
            if when < best:
                best = when
                ring = k
        if ring < 0:
            break
        last = max(last, best)
        count = handle_message(synth, b, last, take(synth.ring[ring], synth.ring_size[ring]), count)
    return count


@counted
def mix_strings(synth, b, count, out, n, fade, whole):
    """Adds n frames of every string of `b` to out (n,) float32, `fade` of `whole` frames before a fade's end.

    Without a fade `fade` is -1.
    """
    events = carray(pointer(b.events), EVENT_ROOM, EVENT)
    mine = carray(pointer(b.mine), EVENT_ROOM, EVENT)
    start = synth.frame - b.frame
    for i in range(b.strings):
        used = 0
        for k in range(count):
            if events[k].string == i:
                mine[used] = events[k]
                used += 1
        ahead.play_to(b, i, start + n, used)
        sound = carray(pointer(ahead.ahead_of(b, i).sound), SOUND_RING, np.float64)
        gain = synth.gain
        for j in range(n):
            gain += GAIN_POLE * (synth.gain_wanted - gain)
            x = sound[(start + j) % SOUND_RING] * gain
            if fade >= 0:
                x *= max(fade - j, 0) / whole
            if not abs(x) < 1e6:
                x = 0.0
                synth.faults += 1
            out[j] += np.float32(x)


@counted
def render_chunk(synth, out, n):
    """n <= CHUNK frames into out (n,) float32."""
    for j in range(n):
        out[j] = 0.0
    if synth.bass != 0:
        b = ahead.bass_at(synth.bass)
        count = collect_events(synth, b, n)
        mix_strings(synth, b, count, out, n, np.int64(-1), np.int64(1))
    if synth.old_bass != 0:
        whole = np.int64(FADE * synth.rate)
        mix_strings(synth, ahead.bass_at(synth.old_bass), np.int64(0), out, n, synth.fade, whole)
        synth.fade -= n
        if synth.fade <= 0:
            store_release(synth.free_address, synth.old_bass)
            synth.old_bass = 0
    for _ in range(n):
        synth.gain += GAIN_POLE * (synth.gain_wanted - synth.gain)
    most = synth.peak
    for j in range(n):
        most = max(most, abs(np.float64(out[j])))
        out[j] = min(max(out[j], np.float32(-1.0)), np.float32(1.0))
    synth.peak = most
    synth.frame += n


@counted
def switch_bass(synth):
    """Takes the bass that Python has put ready, once the one before the last is out."""
    if synth.old_bass == 0 and load_acquire(synth.free_address) == 0:
        wanted = load_acquire(synth.next_address)
        if wanted != 0:
            store_release(synth.next_address, 0)
            synth.old_bass = synth.bass
            synth.fade = np.int64(FADE * synth.rate)
            synth.bass = wanted
            ahead.bass_at(wanted).frame = synth.frame
            synth.overload = 0


@counted
def capture(synth, out, n):
    """Hands the sound to the recorder; what finds no room is counted."""
    address = load_acquire(synth.record_address)
    if address == 0:
        return
    words = carray(pointer(address), ENTRIES, np.int64)
    data = carray(pointer(address + WORD * ENTRIES), synth.record_size, np.float32)
    head = words[HEAD]
    free = synth.record_size - (head - load_acquire(address + WORD * TAIL))
    fits = min(n, free)
    for j in range(fits):
        data[(head + j) % synth.record_size] = out[j]
    synth.record_lost += n - fits
    store_release(address + WORD * HEAD, head + fits)


@callback("void(int64, int64, int64)")
def process(address, sound, n):
    """A C function: n frames into float32 at address `sound`, from the synth at `address`."""
    out = carray(pointer(sound), n, np.float32)
    before = float_control()
    set_float_control(before | FLUSH)  # no denormal numbers in here; the thread's owner may want them
    synth = carray(pointer(address), 1, SYNTH)[0]
    began = nanoseconds(synth.clock, synth.clock_kind)
    synth.time_frame = synth.frame
    synth.time_frames = n
    store_release(synth.time_address, began)
    switch_bass(synth)
    done = 0
    while done < n:
        m = min(CHUNK, n - done)
        render_chunk(synth, out[done : done + m], m)
        done += m
    capture(synth, out, n)
    synth.blocks += 1
    if began != 0:
        load = (nanoseconds(synth.clock, synth.clock_kind) - began) * 1e-9 * synth.rate / n
        update_meters(synth, load)
        adapt(synth, load, n)
        run_ahead(synth, began, n)
        synth.busy = nanoseconds(synth.clock, synth.clock_kind) - began
        if synth.busy * 1e-9 * synth.rate > n:
            synth.late += 1
    set_float_control(before)


@counted
def run_ahead(synth, began, n):
    """Plays on, past the end of a block of n frames that began at `began` (ns), for a share of its time."""
    if synth.bass == 0:
        return
    b = ahead.bass_at(synth.bass)
    until = began + np.int64(b.share * 1e9 * n / synth.rate)
    end = synth.frame - b.frame
    while nanoseconds(synth.clock, synth.clock_kind) < until:
        i = ahead.rearmost(b, end + HORIZON)
        if i < 0:
            return
        ahead.step_ahead(b, i, end)


@counted
def update_meters(synth, load):
    """The meters of a block that needed `load` of its time."""
    synth.load = load
    synth.load_worst = max(synth.load_worst, load)
    place = 0 if load <= 0.0 else np.int64(32.0 + 4.0 * np.log2(load))
    synth.histogram[min(max(place, 0), HISTOGRAM - 1)] += 1


@counted
def read(address):
    """The word at `address`, with all that was written before it. [any thread]"""
    return load_acquire(address)


@counted
def write(address, value):
    """Writes the word at `address`, after all that was written before. [any thread]"""
    store_release(address, value)


HIGH, LOW = 0.75, 0.35  # of the time a block lasts: take some of the work away; give it back after CALM
CALM = 0.5  # s


@counted
def adapt(synth, load, n):
    """Under overload strings go to the coarse operators, newest contacts first; they come back in calm times."""
    if synth.bass == 0 or not synth.adaptive:
        return
    b = ahead.bass_at(synth.bass)
    if b.pool_size[1] == 0:
        return
    p = carray(pointer(b.performer), 1, PERFORMER)[0]
    if load > HIGH:
        synth.calm = 0
        best: Any = np.int64(-1)
        rank = -np.inf
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                continue
            slots = ahead.string_of(b, i).slots
            sounding = slots[0].on or slots[1].on
            if not sounding:
                continue
            touching = slots[0].touching > 0 or slots[1].touching > 0
            # contacts, the newest first; then what only sounds, the oldest first
            value = p.age[i] if touching else -1e12 - p.age[i]
            if value > rank:
                rank = value
                best = i
        if best >= 0:
            switch_operators(b, best, np.int64(1), synth.frame)
            synth.overload += 1
        return
    synth.calm = 0 if load > LOW else synth.calm + n
    if synth.calm > CALM * synth.rate and b.coarse != 0:
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                switch_operators(b, i, np.int64(0), synth.frame)
                synth.overload -= 1
                synth.calm = 0
                return


@counted
def switch_operators(b, i, which, now):
    """String `i` goes on with the operators `which` from synth frame `now` on."""
    ahead.drop_ahead(b, i, now - b.frame)
    techniques.exchange(
        ahead.string_of(b, i),
        ahead.operators_of(b, 1 - which)[i],
        ahead.operators_of(b, which)[i],
        ahead.pool_of(b, which),
    )
    b.coarse ^= 1 << i
