"""Strings in parallel: threads that help the audio thread within a block.

Strings are independent within a chunk, so their bits are the same whichever thread plays them. The audio thread posts a
job: a bass, a frame to play to, and a word with a bit for each string not yet taken. It and its helpers take strings
from the word, one at a time, with one atomic instruction; the audio thread from the lowest up, helpers from the highest
down, so a string mostly stays in one core's cache. Once none is left, the audio thread waits for the strings that
helpers still play. There are no locks, and no thread is woken: helpers look for work by themselves, often while strings
sound, and now and then through rests; until they look, the audio thread plays alone.

A plugin's host may provide threads for this and wait for them: it gets the job first, and the audio thread then plays
the remaining strings, or all if the host declined.
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.bass.records import bass_at
from livebass.kernels.machine import native
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.live.thread import ahead
from livebass.live.thread.records import DONE, HELPED, HELPERS, JOB, STOP, synth_at

TAKEN = (1 << MAX_STRINGS) - 1  # a job's string bits; its number is above them
LOOKS = 200  # in a row, before a rest ...
SOON, LATER = 30, 500  # ... of this many us, in the first AWAKE rests after a job, and later
AWAKE = 10_000


@jit
def lowest(strings):
    """Returns the number of the lowest set bit of `strings`, which must not be 0."""
    i = np.int64(0)
    while not (strings >> i) & 1:
        i += 1
    return i


@jit
def highest(strings):
    """Returns the number of the highest set bit of `strings`, which must not be 0."""
    i = np.int64(0)
    while strings >> (i + 1):
        i += 1
    return i


@jit
def count_of(strings):
    """Returns the number of set bits of `strings`."""
    count = np.int64(0)
    while strings:
        count += strings & 1
        strings >>= 1
    return count


@jit
def play_strings(synth, b, strings, end):
    """Plays `strings` of `b`, a bit each, to its frame `end`; helpers share several strings. [audio thread]"""
    here, wanted = native.record_address(synth), count_of(strings)
    pool = synth.team.pool
    if wanted < 2 or (pool == 0 and native.load_acquire(here + HELPERS) == 0):
        for i in range(b.strings):
            if (strings >> i) & 1:
                ahead.play_to(b, i, end)
        return
    synth.team.bass = native.record_address(b)
    synth.team.end = end
    native.store_release(here + DONE, 0)
    number = (native.load_acquire(here + JOB) >> MAX_STRINGS) + 1
    native.store_release(here + JOB, number << MAX_STRINGS | strings)
    if pool != 0:
        native.call_2(pool, synth.team.owner, wanted)
    own = np.int64(0)
    while True:
        word = native.load_acquire(here + JOB)
        if word & TAKEN == 0:
            break
        i = lowest(word & TAKEN)
        if native.replace_word(here + JOB, word, word & ~(np.int64(1) << i)):
            ahead.play_to(b, i, end)
            own += 1
    while native.load_acquire(here + DONE) < wanted - own:
        pass


@jit
def help_once(address):
    """Plays one string of the job of the synth at `address`; returns 0 if none is left, else 1."""
    synth = synth_at(address)
    word = native.load_acquire(address + JOB)
    if word & TAKEN == 0:
        return np.int64(0)
    i = highest(word & TAKEN)
    if native.replace_word(address + JOB, word, word & ~(np.int64(1) << i)):
        ahead.play_to(bass_at(synth.team.bass), i, synth.team.end)
        add_to(address + HELPED, np.int64(1))
        add_to(address + DONE, np.int64(1))
    return np.int64(1)


@jit
def add_to(address, more):
    """Adds `more` to the word at `address`, atomically."""
    while True:
        word = native.load_acquire(address)
        if native.replace_word(address, word, word + more):
            return


@entry("void(int64)")
def help_now(address):
    """C function: plays strings of the job of the synth at `address` until none is left.

    For the threads of a host that has received the job; a late thread finds nothing, or strings of a later job.
    """
    before = native.float_control()
    native.set_float_control(before | native.flush_bits())
    while help_once(address):
        pass
    native.set_float_control(before)


@entry("void(int64, int64)")
def help_out(address, usleep):
    """C function: helps the synth at `address` until its `stop` is raised; `usleep`: address of that C function.

    For a dedicated thread that nothing else waits for.
    """
    before = native.float_control()
    native.set_float_control(before | native.flush_bits())
    add_to(address + HELPERS, np.int64(1))
    rests = np.int64(0)
    while native.load_acquire(address + STOP) == 0:
        for _ in range(LOOKS):
            if help_once(address):
                rests = np.int64(0)
        native.wait_by(usleep, np.int64(SOON if rests < AWAKE else LATER))
        rests += 1
    add_to(address + HELPERS, np.int64(-1))
    native.set_float_control(before)
