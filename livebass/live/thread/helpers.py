"""Strings side by side: threads that help the audio thread within a block.

Strings do not know of each other within a chunk, so that whoever plays one, its bits are the same. The audio thread
writes down a job: a bass, a frame to play to, and a word with a bit for each string that nobody plays yet. It and its
helpers take strings from the word, one at a time, by one atomic instruction; the audio thread from the lowest, helpers
from the highest on, so that a string mostly stays in the cache of one core. Once none is left, the audio thread waits
for those that a helper still plays. No lock is taken, and no thread is woken: a helper looks for work by itself, often
while strings sound, and now and then through rests; until it looks the audio thread plays alone.

A plugin may have a host with threads for that, which waits until they are done: they are told of the job first, and the
audio thread then plays what is left, all if the host declined.
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.bass.records import bass_at
from livebass.kernels.machine.native import (
    call_2,
    float_control,
    flush_bits,
    load_acquire,
    record_address,
    replace_word,
    set_float_control,
    store_release,
    wait_by,
)
from livebass.kernels.player.performer import MOST_STRINGS
from livebass.live.thread import ahead
from livebass.live.thread.records import DONE, HELPED, HELPERS, JOB, STOP, synth_at

TAKEN = (1 << MOST_STRINGS) - 1  # the strings' bits of a job; above them, its number
LOOKS = 200  # in a row, before a rest ...
SOON, LATER = 30, 500  # ... of so many us, in the first AWAKE rests after a job and then
AWAKE = 10_000


@jit
def lowest(strings):
    """Returns the number of the lowest bit of `strings`, which has one."""
    i = np.int64(0)
    while not (strings >> i) & 1:
        i += 1
    return i


@jit
def highest(strings):
    """Returns the number of the highest bit of `strings`, which has one."""
    i = np.int64(0)
    while strings >> (i + 1):
        i += 1
    return i


@jit
def count_of(strings):
    """Returns how many bits of `strings` are set."""
    count = np.int64(0)
    while strings:
        count += strings & 1
        strings >>= 1
    return count


@jit
def play_strings(synth, b, strings, end):
    """Plays `strings` of `b`, a bit each, to its frame `end`: with helpers, if there are several. [audio thread]"""
    here, wanted = record_address(synth), count_of(strings)
    pool = synth.team.pool
    if wanted < 2 or (pool == 0 and load_acquire(here + HELPERS) == 0):
        for i in range(b.strings):
            if (strings >> i) & 1:
                ahead.play_to(b, i, end)
        return
    synth.team.bass = record_address(b)
    synth.team.end = end
    store_release(here + DONE, 0)
    number = (load_acquire(here + JOB) >> MOST_STRINGS) + 1
    store_release(here + JOB, number << MOST_STRINGS | strings)
    if pool != 0:
        call_2(pool, synth.team.owner, wanted)
    own = np.int64(0)
    while True:
        word = load_acquire(here + JOB)
        if word & TAKEN == 0:
            break
        i = lowest(word & TAKEN)
        if replace_word(here + JOB, word, word & ~(np.int64(1) << i)):
            ahead.play_to(b, i, end)
            own += 1
    while load_acquire(here + DONE) < wanted - own:
        pass


@jit
def help_once(address):
    """Plays one string of the job of the synth at `address`, if there is one left; returns 1 if so, else 0."""
    synth = synth_at(address)
    word = load_acquire(address + JOB)
    if word & TAKEN == 0:
        return np.int64(0)
    i = highest(word & TAKEN)
    if replace_word(address + JOB, word, word & ~(np.int64(1) << i)):
        ahead.play_to(bass_at(synth.team.bass), i, synth.team.end)
        add_to(address + HELPED, np.int64(1))
        add_to(address + DONE, np.int64(1))
    return np.int64(1)


@jit
def add_to(address, more):
    """Adds `more` to the word at `address`, whoever else does."""
    while True:
        word = load_acquire(address)
        if replace_word(address, word, word + more):
            return


@entry("void(int64)")
def help_now(address):
    """C function: plays strings of the job of the synth at `address` until none is left.

    For a thread of a host that was told of the job; one that comes late finds nothing, or strings of a later job.
    """
    before = float_control()
    set_float_control(before | flush_bits())
    while help_once(address):
        pass
    set_float_control(before)


@entry("void(int64, int64)")
def help_out(address, usleep):
    """C function: helps the synth at `address` until its `stop` is raised; `usleep`: address of that C function.

    For a thread of its own, which nothing else waits for.
    """
    before = float_control()
    set_float_control(before | flush_bits())
    add_to(address + HELPERS, np.int64(1))
    rests = np.int64(0)
    while load_acquire(address + STOP) == 0:
        for _ in range(LOOKS):
            if help_once(address):
                rests = np.int64(0)
        wait_by(usleep, np.int64(SOON if rests < AWAKE else LATER))
        rests += 1
    add_to(address + HELPERS, np.int64(-1))
    set_float_control(before)
