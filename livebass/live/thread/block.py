"""One block of the stage: messages in, sound out, meters. All that the audio thread does.

No Python, allocation, lock, file or print in here: addresses from the stage's record become arrays, rings are read
and written, and the kernels of `voice` and `performer` do the rest. [audio thread]

Less work under overload: strings go over to coarse operators, and come back. [audio thread]
"""

from typing import Any

import numpy as np

from livebass.compiling import callback, counted
from livebass.kernels import performer
from livebass.kernels import techniques as hands
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
    STAGE,
    STRETCH,
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
def hear(stage, b, frame, message, count):
    """Hands one message at stage frame `frame` to the performer; the new number of events."""
    status = message & 0xFF
    first = (message >> 8) & 0x7F
    second = (message >> 16) & 0x7F
    stage.messages += 1
    kind = status & 0xF0
    if kind == 0xC0:
        stage.program = stage.bank << 8 | first
        stage.program_count += 1
        return count
    if kind == 0xB0 and (first == 0 or first == 32):
        stage.bank = (stage.bank & 0x7F) | second << 7 if first == 0 else (stage.bank & ~0x7F) | second
        return count
    p = carray(pointer(b.performer), 1, PERFORMER)[0]
    events = carray(pointer(b.events), EVENT_ROOM, EVENT)
    # places and grazing apexes are those of the fine operators, whatever plays
    return performer.message(
        p, ahead.operators_of(b, 0), ahead.pool_of(b, 0), frame - b.frame, status, first, second, events, count
    )


@counted
def gather(stage, b, n):
    """All messages for the next `n` frames, in order, as events of `b`; their number."""
    end = stage.frame + n
    count = np.int64(0)  # a constant would be a type of its own: what is called with it would be compiled twice
    if load_acquire(stage.panic_address) != 0:
        store_release(stage.panic_address, 0)
        count = hear(stage, b, stage.frame, 0xB0 | stage.channel & 0x0F | 120 << 8, count)
        count = hear(stage, b, stage.frame, 0xB0 | stage.channel & 0x0F | 121 << 8, count)
    last = stage.frame
    for _ in range(min(MOST_MESSAGES, LEAST_MESSAGES + n // 8)):  # a flood waits, the sound does not
        if count + MOST_EVENTS > EVENT_ROOM:
            break
        best = end
        ring = -1
        for k in range(3):
            when = waiting(stage.ring[k], stage.ring_size[k], end)
            if when == NOW:
                when = stage.frame
            if when < best:
                best = when
                ring = k
        if ring < 0:
            break
        last = max(last, best)
        count = hear(stage, b, last, take(stage.ring[ring], stage.ring_size[ring]), count)
    return count


@counted
def play_strings(stage, b, count, out, n, fade, whole):
    """Adds n frames of every string of `b` to out (n,) float32, `fade` of `whole` frames before a fade's end.

    Without a fade `fade` is -1.
    """
    events = carray(pointer(b.events), EVENT_ROOM, EVENT)
    mine = carray(pointer(b.mine), EVENT_ROOM, EVENT)
    start = stage.frame - b.frame
    for i in range(b.strings):
        used = 0
        for k in range(count):
            if events[k].string == i:
                mine[used] = events[k]
                used += 1
        ahead.play_to(b, i, start + n, used)
        sound = carray(pointer(ahead.ahead_of(b, i).sound), SOUND_RING, np.float64)
        gain = stage.gain
        for j in range(n):
            gain += GAIN_POLE * (stage.gain_wanted - gain)
            x = sound[(start + j) % SOUND_RING] * gain
            if fade >= 0:
                x *= max(fade - j, 0) / whole
            if not abs(x) < 1e6:
                x = 0.0
                stage.faults += 1
            out[j] += np.float32(x)


@counted
def stretch(stage, out, n):
    """n <= STRETCH frames into out (n,) float32."""
    for j in range(n):
        out[j] = 0.0
    if stage.bass != 0:
        b = ahead.bass_at(stage.bass)
        count = gather(stage, b, n)
        play_strings(stage, b, count, out, n, np.int64(-1), np.int64(1))
    if stage.old_bass != 0:
        whole = np.int64(FADE * stage.rate)
        play_strings(stage, ahead.bass_at(stage.old_bass), np.int64(0), out, n, stage.fade, whole)
        stage.fade -= n
        if stage.fade <= 0:
            store_release(stage.free_address, stage.old_bass)
            stage.old_bass = 0
    for _ in range(n):
        stage.gain += GAIN_POLE * (stage.gain_wanted - stage.gain)
    most = stage.peak
    for j in range(n):
        most = max(most, abs(np.float64(out[j])))
        out[j] = min(max(out[j], np.float32(-1.0)), np.float32(1.0))
    stage.peak = most
    stage.frame += n


@counted
def adopt(stage):
    """Takes the bass that Python has put ready, once the one before the last is out."""
    if stage.old_bass == 0 and load_acquire(stage.free_address) == 0:
        wanted = load_acquire(stage.next_address)
        if wanted != 0:
            store_release(stage.next_address, 0)
            stage.old_bass = stage.bass
            stage.fade = np.int64(FADE * stage.rate)
            stage.bass = wanted
            ahead.bass_at(wanted).frame = stage.frame
            stage.overload = 0


@counted
def store(stage, out, n):
    """Hands the sound to the recorder; what finds no room is counted."""
    address = load_acquire(stage.record_address)
    if address == 0:
        return
    words = carray(pointer(address), ENTRIES, np.int64)
    data = carray(pointer(address + WORD * ENTRIES), stage.record_size, np.float32)
    head = words[HEAD]
    free = stage.record_size - (head - load_acquire(address + WORD * TAIL))
    fits = min(n, free)
    for j in range(fits):
        data[(head + j) % stage.record_size] = out[j]
    stage.record_lost += n - fits
    store_release(address + WORD * HEAD, head + fits)


@callback("void(int64, int64, int64)")
def block(address, sound, n):
    """A C function: n frames into float32 at address `sound`, from the stage at `address`."""
    out = carray(pointer(sound), n, np.float32)
    before = float_control()
    set_float_control(before | FLUSH)  # no denormal numbers in here; the thread's owner may want them
    stage = carray(pointer(address), 1, STAGE)[0]
    began = nanoseconds(stage.clock, stage.clock_kind)
    stage.time_frame = stage.frame
    stage.time_frames = n
    store_release(stage.time_address, began)
    adopt(stage)
    done = 0
    while done < n:
        m = min(STRETCH, n - done)
        stretch(stage, out[done : done + m], m)
        done += m
    store(stage, out, n)
    stage.blocks += 1
    if began != 0:
        load = (nanoseconds(stage.clock, stage.clock_kind) - began) * 1e-9 * stage.rate / n
        measure(stage, load)
        relieve(stage, load, n)
        run_ahead(stage, began, n)
        stage.busy = nanoseconds(stage.clock, stage.clock_kind) - began
        if stage.busy * 1e-9 * stage.rate > n:
            stage.late += 1
    set_float_control(before)


@counted
def run_ahead(stage, began, n):
    """Plays on, past the end of a block of n frames that began at `began` (ns), for a share of its time."""
    if stage.bass == 0:
        return
    b = ahead.bass_at(stage.bass)
    until = began + np.int64(b.share * 1e9 * n / stage.rate)
    end = stage.frame - b.frame
    while nanoseconds(stage.clock, stage.clock_kind) < until:
        i = ahead.rearmost(b, end + HORIZON)
        if i < 0:
            return
        ahead.step_ahead(b, i, end)


@counted
def measure(stage, load):
    """The meters of a block that needed `load` of its time."""
    stage.load = load
    stage.load_worst = max(stage.load_worst, load)
    place = 0 if load <= 0.0 else np.int64(32.0 + 4.0 * np.log2(load))
    stage.histogram[min(max(place, 0), HISTOGRAM - 1)] += 1


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
def relieve(stage, load, n):
    """Under overload strings go to the coarse operators, newest contacts first; they come back in calm times."""
    if stage.bass == 0 or not stage.sheltered:
        return
    b = ahead.bass_at(stage.bass)
    if b.pool_size[1] == 0:
        return
    p = carray(pointer(b.performer), 1, PERFORMER)[0]
    if load > HIGH:
        stage.calm = 0
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
            exchange(b, best, np.int64(1), stage.frame)
            stage.overload += 1
        return
    stage.calm = 0 if load > LOW else stage.calm + n
    if stage.calm > CALM * stage.rate and b.coarse != 0:
        for i in range(b.strings):
            if (b.coarse >> i) & 1:
                exchange(b, i, np.int64(0), stage.frame)
                stage.overload -= 1
                stage.calm = 0
                return


@counted
def exchange(b, i, which, now):
    """String `i` goes on with the operators `which` from stage frame `now` on."""
    ahead.stay(b, i, now - b.frame)
    hands.exchange(
        ahead.string_of(b, i),
        ahead.operators_of(b, 1 - which)[i],
        ahead.operators_of(b, which)[i],
        ahead.pool_of(b, which),
    )
    b.coarse ^= 1 << i
