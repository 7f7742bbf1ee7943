"""A bass's effects in series: compressor, valve stage, equaliser, cabinet, impulse response, limiter.

They stand as in a bass player's rig: pedals, then the amp's equaliser, its loudspeakers, the room around them, and the
desk. They process the mix of its strings, before the synth's gain. When all are off, the sound is unchanged, bit for
bit; block boundaries change nothing. Measurements never go through them.
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.effects.compressor import compress, silence_compressor
from livebass.kernels.effects.convolution import convolve, silence_response
from livebass.kernels.effects.equaliser import begin_equaliser, equalise, equalises, silence_equaliser
from livebass.kernels.effects.limiter import limit, silence_limiter
from livebass.kernels.effects.records import (
    ALLPASSES,
    BANDS,
    CABINETS,
    DOUBLINGS,
    EFFECTS_BYTES,
    KNOBS,
    PART,
    SECTIONS,
    WORD,
    effects_at,
    taps_at,
    words_behind,
)
from livebass.kernels.effects.response import place_response, take_response
from livebass.kernels.effects.speaker import begin_speaker, fill_speakers, silence_speaker, speak, speaks
from livebass.kernels.effects.valve import begin_valve, drive_valve, fill_valve, silence_valve
from livebass.kernels.machine.native import floats_at, samples_at
from livebass.kernels.machine.samples import single

COMPRESSION, DRIVE = range(2)  # in the order of techniques.EFFECTS
SETTLES = 1.0  # s of silence, beyond the response, after which a sound is gone
NOTHING = 1e-200  # smaller states become zero: numbers never become denormal


@jit
def bytes_of_effects(count, given, rate):
    """Bytes of effects at `rate` (Hz), with a response of `count` samples at the rate `given` (Hz)."""
    return EFFECTS_BYTES + WORD * words_behind(taps_at(count, given, rate))


@jit
def make_effects(address, rate, compression, drive, response, count, given):
    """Makes effects in zeroed memory: the bass's own knobs, and `count` samples of a response at an address.

    `take_amp` adds its amp.
    """
    e = effects_at(address)
    e.rate = rate
    e.own_compression = compression
    e.own_drive = drive
    fill_valve(e)
    fill_speakers(e)
    place_response(e, address + EFFECTS_BYTES, count, given)
    take_response(e, response, count, given)
    e.settles = e.taps + np.int64(SETTLES * rate)
    e.idle = 1


@jit
def take_amp(address, instrument):
    """Gives effects the amp of an INSTRUMENT."""
    e = effects_at(address)
    e.own_clean = instrument.clean_blend
    e.own_gain[0] = instrument.eq_bass
    e.own_gain[1] = instrument.eq_low_mid
    e.own_gain[2] = instrument.eq_high_mid
    e.own_gain[3] = instrument.eq_treble
    e.own_centre[0] = instrument.eq_low_mid_frequency
    e.own_centre[1] = instrument.eq_high_mid_frequency
    e.own_cabinet = instrument.cabinet
    e.own_limiter = instrument.limiter


@jit
def may_be_heard(e, knobs, n, stride):
    """True if any effect is on in these n frames; `knobs` as for `play_effects`."""
    if e.taps > 0 or e.own_compression > 0.0 or e.own_drive > 0.0 or e.compression > 0.0 or e.wet > 0.0:
        return True
    if equalises(e) or speaks(e) or e.own_limiter > 0 or e.limiting > 0.0 or e.cut > 0.0:
        return True
    if knobs == 0:
        return False
    for which in range(KNOBS):
        requested = floats_at(knobs + WORD * stride * which, n)
        for j in range(n):
            if requested[j] != 0.0:
                return True
    return False


@jit
def rings(e):
    """True if effects still sound after the strings have become silent."""
    return (e.taps > 0 or e.compression > 0.0 or e.wet > 0.0 or equalises(e) or speaks(e)) and e.idle == 0


@jit
def play_effects(e, sound, heard, frame, knobs, stride, n):
    """Sends n frames of `sound`, float32, through the effects; `frame`: frames before, since the bass began.

    knobs: address of the requested knobs, float64 (KNOBS, stride), 0: the bass's own; or address 0: all the bass's own.
    heard: (n,) float32, becomes 0 for frames without an active effect, which stay unchanged, else 1.
    """
    done = 0
    while done < n:
        place = (frame + done) % PART
        m = min(PART - place, n - done)
        for which in range(KNOBS):
            for j in range(m):
                e.requested[which, j] = 0.0
            if knobs != 0:
                requested = floats_at(knobs + WORD * (stride * which + done), m)
                for j in range(m):
                    e.requested[which, j] = requested[j]
        if frame + done == 0:
            begin(e)
        play_part(e, sound[done : done + m], heard[done : done + m], place, m)
        if place + m == PART:
            if e.quiet >= e.settles:
                silence_all(e)
            forget_nothings(e)
        done += m


@jit
def begin(e):
    """Sets the knobs to the first frame's values immediately."""
    wanted = e.requested[COMPRESSION, 0] if e.requested[COMPRESSION, 0] > 0.0 else e.own_compression
    e.compression = wanted
    begin_valve(e, e.requested[DRIVE, 0] if e.requested[DRIVE, 0] > 0.0 else e.own_drive)
    begin_equaliser(e)
    begin_speaker(e)
    e.begins = 1


@jit
def play_part(e, sound, heard, place, n):
    """Plays n frames from frame `place` of a partition on, not beyond its end."""
    for j in range(n):
        e.sound[j] = sound[j]
        e.heard[j] = 0.0
        e.amp[j] = 0.0
        if sound[j] != 0.0:
            e.idle = 0
    compress(e, e.requested[COMPRESSION], n)
    drive_valve(e, e.requested[DRIVE], n)
    equalise(e, n)
    speak(e, place, n)
    convolve(e, place, n)
    limit(e, n)
    for j in range(n):
        heard[j] = np.float32(e.heard[j])
        if e.heard[j] == 0.0:
            e.quiet = 0
            continue
        e.quiet = e.quiet + 1 if sound[j] == 0.0 else 0
        sound[j] = single(e.sound[j])


@jit
def silence_all(e):
    """Resets all effects."""
    silence_compressor(e)
    silence_valve(e)
    silence_equaliser(e)
    silence_speaker(e)
    silence_response(e)
    silence_limiter(e)
    e.idle = 1


@jit
def forget_nothings(e):
    """Sets negligible states to zero."""
    forget_rows(e.up, ALLPASSES)
    forget_rows(e.down, ALLPASSES)
    forget_row(e.tone, 3)
    if e.fine > 0.0:
        for doubling in range(DOUBLINGS):
            forget_rows(e.fine_up[doubling], ALLPASSES)
            forget_rows(e.fine_down[doubling], ALLPASSES)
            forget_rows(e.clean_down[doubling], ALLPASSES)
        forget_row(e.fine_tone, 3)
    forget_rows(e.band_state, BANDS)
    if e.spoke:
        for number in range(CABINETS):
            forget_rows(e.section_state[number], SECTIONS)
    e.held = e.held if abs(e.held) > NOTHING else 0.0
    e.reduction = e.reduction if abs(e.reduction) > NOTHING else 0.0


@jit
def forget_rows(states, n):
    """Sets negligible states of `n` rows to zero."""
    for k in range(n):
        forget_row(states[k], 2)


@jit
def forget_row(states, n):
    """Sets negligible ones of `n` states to zero."""
    for k in range(n):
        states[k] = states[k] if abs(states[k]) > NOTHING else 0.0


@entry("void(int64, int64, int64, int64)")
def add_effects(effects, sound, frame, n):
    """Sends n frames of float32 at the address `sound` through EFFECTS; `frame`: frames before."""
    e = effects_at(effects)
    done = 0
    while done < n:
        m = min(PART, n - done)
        out = samples_at(sound + 4 * done, m)
        play_effects(e, out, e.flags, frame + done, np.int64(0), np.int64(0), m)
        done += m


@entry("int64(int64)")
def still_ring(effects):
    """Returns 1 if EFFECTS still sound after the strings have become silent."""
    return np.int64(rings(effects_at(effects)))
