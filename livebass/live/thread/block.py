"""One block of sound: MIDI messages in, samples out, meters. Everything the audio thread does. [audio thread]

No Python, allocation, lock, file or print in here. events.py takes the messages, mix.py makes the sound, load.py uses
the remaining time.
"""

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.bass.records import bass_at
from livebass.kernels.effects import chain
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
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.live.thread import ahead, records
from livebass.live.thread.carry import CARRIED, carry_bass, is_same_bass
from livebass.live.thread.events import apply_parameters, collect_events, extend_gains, extend_knobs, take_controllers
from livebass.live.thread.load import adapt, run_ahead, switch_operators, update_meters
from livebass.live.thread.mix import begin_fade, end_old_bass, fill_fade, is_silent, mix_strings
from livebass.live.thread.ring import next_frame, push_sound


@jit
def render_chunk(synth, out, n):
    """Plays n <= CHUNK frames into out (n,) float32, limited to the synth's ceiling."""
    out[:n] = 0.0
    synth.gains_known = 0
    synth.knobs_known = 0
    if synth.bass != 0:
        b = bass_at(synth.bass)
        collect_events(synth, b, n)
        extend_gains(synth, n)
        extend_knobs(synth, n)
        comes = synth.old_bass != 0 and synth.carried != 0
        if comes:
            fill_fade(synth, n, True)
        mix_strings(synth, b, out, n, comes)
    if synth.old_bass != 0:
        fades = synth.fade_left != records.RINGING
        if fades:
            fill_fade(synth, n, False)
        mix_strings(synth, bass_at(synth.old_bass), out, n, fades)
        if synth.fade_left != records.RINGING:
            synth.fade_left = max(synth.fade_left - n, 0)
        over = not synth.carried and is_silent(bass_at(synth.old_bass), synth.frame + n)
        if synth.fade_left == 0 or over:
            let_go_of_old_bass(synth)
    extend_gains(synth, n)
    maximum = synth.peak
    for j in range(n):
        level = abs(np.float64(out[j]))
        maximum = max(maximum, level)
        synth.clipped += level > 1.0
        out[j] = np.float32(min(max(np.float64(out[j]), -synth.ceiling), synth.ceiling))
    synth.peak = maximum
    synth.frame += n


@jit
def let_go_of_old_bass(synth):
    """Lets Python free the old bass."""
    store_release(record_address(synth) + records.FADED_BASS, synth.old_bass)
    synth.old_bass = 0


@jit
def switch_bass(synth):
    """Starts the bass that Python has prepared; the present bass starts no more notes and rings out.

    Another version of the present bass carries on its notes, and the present one fades. A bass that still rings out
    has to fade first.
    """
    here = record_address(synth)
    wanted = load_acquire(here + records.NEXT_BASS)
    if wanted == 0:
        return
    end_old_bass(synth)
    if synth.old_bass == 0 and load_acquire(here + records.FADED_BASS) == 0:
        store_release(here + records.NEXT_BASS, 0)
        synth.old_bass = synth.bass
        synth.bass = wanted
        synth.overload = 0
        synth.carried = np.int64(synth.old_bass != 0 and is_same_bass(bass_at(wanted), bass_at(synth.old_bass)))
        if synth.carried:
            carry_bass(synth, bass_at(wanted), bass_at(synth.old_bass))
            begin_fade(synth, CARRIED)
            if is_silent(bass_at(synth.old_bass), synth.frame):
                let_go_of_old_bass(synth)
            return
        synth.fade_left = records.RINGING
        bass_at(wanted).frame = synth.frame
        apply_parameters(synth, bass_at(wanted))
        if synth.old_bass != 0:
            bass_at(synth.old_bass).floor.closes = synth.frame - bass_at(synth.old_bass).frame
            take_controllers(bass_at(wanted), bass_at(synth.old_bass))


@jit
def capture(synth, out, n):
    """Hands the sound to the recorder and counts the frames that do not fit into its ring."""
    address = load_acquire(record_address(synth) + records.CAPTURE_RING)
    if address != 0:
        synth.capture_lost += push_sound(address, synth.capture_size, out, n)


@entry("void(int64, int64, int64)")
def process(address, sound, n):
    """C function: plays n frames of the synth at `address` into the float32 at address `sound`."""
    out = samples_at(sound, n)
    before = float_control()
    set_float_control(before | flush_bits())  # denormal numbers become zero here; the thread's owner may want them
    synth = records.synth_at(address)
    began = nanoseconds(synth.clock, synth.clock_id)
    synth.block_frame = synth.frame
    synth.block_frames = n
    store_release(address + records.BLOCK_TIME, began)
    worked = nanoseconds(synth.clock, synth.work_clock_id)
    switch_bass(synth)
    for i in range(MAX_STRINGS):
        if synth.apart[i] != 0:
            samples_at(synth.apart[i], n)[:] = 0.0
    done = 0
    while done < n:
        m = min(records.CHUNK, n - done)
        render_chunk(synth, out[done : done + m], m)
        done += m
    capture(synth, out, n)
    synth.blocks += 1
    if began != 0:
        load = (nanoseconds(synth.clock, synth.work_clock_id) - worked) * 1e-9 * synth.rate / n
        update_meters(synth, load)
        adapt(synth, load, n)
        run_ahead(synth, began, n, load)
        synth.busy = nanoseconds(synth.clock, synth.clock_id) - began
        if synth.busy * 1e-9 * synth.rate > n:
            synth.late += 1
    set_float_control(before)


@entry("void(int64, float64, int64)")
def relieve(address, load, n):
    """Takes the last n frames' `load` from a host that measures it, if the synth at `address` has no clock."""
    update_meters(records.synth_at(address), load)
    adapt(records.synth_at(address), load, n)


@entry("int64(int64)")
def is_still(address):
    """C function: 1 if the synth at `address` plays only zeros until something is sent to it. [audio thread]"""
    synth = records.synth_at(address)
    if synth.bass == 0 or synth.old_bass != 0 or load_acquire(address + records.NEXT_BASS) != 0:
        return np.int64(0)
    for k in range(records.RINGS):
        if next_frame(synth.midi_ring[k], synth.midi_ring_size[k], np.int64(-2)) != -2:
            return np.int64(0)
    b = bass_at(synth.bass)
    if chain.rings(records.effects_of(b)) or b.floor.left > 0:
        return np.int64(0)
    for i in range(b.strings):
        v = records.string_of(b, i).voice
        if not v.still or v.frame != synth.frame - b.frame:
            return np.int64(0)
    return np.int64(1)


@entry("void(int64)")
def return_to_clock(address):
    """C function: returns all strings of the synth at `address` to the clock and their fine operators.

    From then on, without a clock, it plays exactly as it would without one from the start. [audio thread]
    """
    synth = records.synth_at(address)
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


@entry("void(int64, int64)")
def keep_controllers(address, old):
    """C function: `take_controllers` for addresses, before a synth takes the bass."""
    take_controllers(bass_at(address), bass_at(old))
