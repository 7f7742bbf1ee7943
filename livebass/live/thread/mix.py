"""Mixes a bass's strings, floor and effects into the sound, and fades out a bass. [audio thread]"""

from typing import Any

import numpy as np

from livebass.compiling import jit
from livebass.kernels import voice
from livebass.kernels.bass import floor
from livebass.kernels.bass.records import SOUND_RING
from livebass.kernels.effects import chain
from livebass.kernels.machine.native import record_address, samples_at
from livebass.kernels.machine.samples import added, single
from livebass.kernels.player.performer import FADE, OVER
from livebass.live.thread import helpers, records

SAMPLE = 4  # bytes of a float32


@jit
def mix_strings(synth, b, out, n, fades):
    """Adds n frames of every string of `b` to out (n,) float32, and to the string's own output if there is one.

    If it `fades`, synth.fades holds the levels. If effects are on, `out` gets their output; they
    come before the gain.
    """
    events, string_events = records.events_of(b), records.string_events_of(b)
    start, count = synth.frame - b.frame, records.performer_of(b).out.count
    knobs = record_address(synth) + records.KNOBS_PLACE
    effects = chain.may_be_heard(records.effects_of(b), knobs, n, np.int64(records.CHUNK))
    if effects:
        for j in range(n):
            synth.before[j] = out[j]
            synth.dry[j] = 0.0
    played: Any = np.int64(0)  # strings, a bit each ...
    wanting: Any = np.int64(0)  # ... and those that have not reached the end of the chunk
    used = 0
    for i in range(b.strings):
        v, a = records.string_of(b, i).voice, records.ahead_of(b, i)
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
    hisses = b.floor.level + b.floor.hum > 0.0 and hear_floor(synth, b, n, played)
    for i in range(b.strings):
        sounds, with_floor = (played >> i) & 1 != 0, hisses and i == 0
        if not sounds and not with_floor:
            continue
        sound = records.sound_of(records.ahead_of(b, i))
        apart = synth.apart[i] != 0
        own = samples_at(synth.apart[i] + SAMPLE * (synth.frame - synth.block_frame) if apart else np.int64(0), n)
        for j in range(n):
            x = sound[(start + j) % SOUND_RING] if sounds else 0.0
            if with_floor:
                x += synth.floor[j]
            if effects and abs(x) < 1e6:
                synth.dry[j] = added(synth.dry[j], single(x))
            x *= synth.gains[j]
            if fades:
                x *= synth.fades[j]
            if not abs(x) < 1e6:
                x = 0.0
                synth.faults += 1
            out[j] = added(out[j], single(x))
            if apart:
                own[j] = added(own[j], single(x))
    if effects:
        add_effects(synth, b, out, start, n, fades)


@jit
def hear_floor(synth, b, n, played):
    """Fills synth.floor with n frames of `b`'s floor; returns whether it sounds. `played`: strings, a bit each."""
    loud, start = synth.floor[:n], synth.frame - b.frame
    loud[:] = 0.0
    for i in range(b.strings):
        if (played >> i) & 1:
            sound = records.sound_of(records.ahead_of(b, i))
            for j in range(n):
                loud[j] = max(loud[j], abs(sound[(start + j) % SOUND_RING]))
    before = b.floor.left
    floor.play_floor(b.floor, loud, records.events_of(b), records.performer_of(b).out.count)
    return before > 0 or b.floor.left > 0


@jit
def add_effects(synth, b, out, start, n, fades):
    """Replaces the mix of `b` by the effects' output, in the frames with an active effect."""
    knobs = record_address(synth) + records.KNOBS_PLACE
    chain.play_effects(records.effects_of(b), synth.dry, synth.heard, start, knobs, np.int64(records.CHUNK), n)
    for j in range(n):
        if synth.heard[j] == 0.0:
            continue
        x = np.float64(synth.dry[j]) * synth.gains[j]
        if fades:
            x *= synth.fades[j]
        out[j] = added(synth.before[j], single(x))


@jit
def begin_fade(synth, seconds):
    """Begins to fade out the old bass."""
    synth.fade_left = synth.fade_frames = max(np.int64(seconds * synth.rate), 1)


@jit
def end_old_bass(synth):
    """Begins to fade out the bass that rings out, if any."""
    if synth.old_bass != 0 and synth.fade_left == records.RINGING:
        begin_fade(synth, FADE)


@jit
def fill_fade(synth, n, comes):
    """Fills synth.fades with n frames of the old bass's fade-out, or of the fade-in of its next version."""
    for j in range(n):
        left = max(synth.fade_left - j, 0) / synth.fade_frames
        synth.fades[j] = 1.0 - left if comes else left


@jit
def is_silent(b, end):
    """True if no string, effect or floor of `b` sounds or answers, and no string is ahead of synth frame `end`."""
    if chain.rings(records.effects_of(b)) or b.floor.left > 0:
        return False
    for i in range(b.strings):
        string = records.string_of(b, i)
        moves = string.slots[0].on or string.slots[1].on or string.voice.answering
        moves = moves or abs(string.voice.block_out) > OVER  # its filters still hold some signal
        if moves or string.voice.frame > end - b.frame:
            return False
    return True
