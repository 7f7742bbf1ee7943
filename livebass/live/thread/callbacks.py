"""The C functions that PortAudio and JACK call for sound; `arg` is a record's address. [audio thread]"""

from typing import Any

import numpy as np

from livebass.compiling import entry, jit
from livebass.kernels.machine.native import (
    address_of,
    bytes_at,
    call_3,
    count_from,
    pointer_from,
    record_address,
    record_at,
    samples_at,
    status_from,
)
from livebass.kernels.player.performer import MAX_STRINGS
from livebass.live.thread.arrival import frame_now
from livebass.live.thread.desk import add_clicks, desk_at, note_controller, play_score
from livebass.live.thread.records import CHUNK, field_offset, synth_at
from livebass.live.thread.ring import NOW, push_midi

OUTPUT_UNDERFLOW = 4  # paOutputUnderflow
MAX_CHANNELS = 2
MIDI_PORTS = 2  # of a client that only hears MIDI
MAX_FRAMES, SAMPLE = 8192, 4  # frames that a sheet holds: JACK's longest period; bytes of a sample

HEAD = [("synth", "i8"), ("desk", "i8")]  # addresses of a SYNTH and a DESK; desk 0: none
PORT_CALLS = [("get_buffer", "i8"), ("event_count", "i8"), ("event_get", "i8")]  # addresses of C functions of JACK
PORTAUDIO = np.dtype(
    [
        *HEAD,
        ("channels", "i8"),
        ("mono", "i8"),  # address of float32 (CHUNK,)
        ("thread", "i8"),  # number of the calling thread, after its first call
        ("gettid", "i8"),  # address of the C function that returns it, 0: none
    ],
    align=True,
)
JACK = np.dtype(
    [
        *HEAD,
        *PORT_CALLS,
        ("outputs", "i8"),
        ("output", "i8", (MAX_CHANNELS,)),  # ports
        ("strings", "i8"),
        ("string", "i8", (MAX_STRINGS,)),  # ports of single strings
        ("click", "i8"),  # port of the metronome, 0: it plays in the outputs
        ("sheets", "i8"),  # address of float32 (2 + MAX_STRINGS, MAX_FRAMES), zeros: what goes to the ports
        ("midi", "i8"),
        ("event", "i8", (3,)),  # room for a jack_midi_event_t: uint32 time, size_t size, pointer to the bytes
    ],
    align=True,
)
# A client that only hears MIDI
JACK_MIDI = np.dtype(
    [
        *HEAD,
        *PORT_CALLS,
        ("frames_since", "i8"),  # address of a C function of `client`: frames since the cycle began
        ("client", "i8"),
        ("rate", "f8"),  # of the server, Hz
        ("delay", "i8"),  # frames of the synth
        ("port", "i8", (MIDI_PORTS,)),  # 0: none
        ("event", "i8", (3,)),  # as in JACK
    ],
    align=True,
)
portaudio_at, jack_at, jack_midi_at = record_at(PORTAUDIO), record_at(JACK), record_at(JACK_MIDI)
EVENT_OFFSET, MIDI_EVENT_OFFSET = field_offset(JACK, "event"), field_offset(JACK_MIDI, "event")


@jit
def render(synth, desk, sound, n):
    """Plays n frames of the synth at address `synth` and the DESK's score into the float32 at address `sound`."""
    if desk != 0:
        play_score(desk_at(desk), synth_at(synth), n)
    call_3(synth_at(synth).process, synth, sound, n)


@jit
def click(synth, desk, sound, n):
    """Adds the metronome to the n frames that the synth has just played."""
    if desk != 0:
        add_clicks(desk_at(desk), synth_at(synth).frame - n, samples_at(sound, n), n)


@entry("int32(voidptr, voidptr, uint64, voidptr, uint64, voidptr)")
def portaudio(_input, output, frames, _time, flags, arg):
    """A PaStreamCallback with `PORTAUDIO` as user data; interleaved float32."""
    data = portaudio_at(address_of(arg))
    n = np.int64(frames & np.uint64(0xFFFFFFFF))
    if flags & np.uint64(OUTPUT_UNDERFLOW):
        synth_at(data.synth).underruns += 1
    if data.thread == 0 and data.gettid != 0:
        data.thread = count_from(data.gettid, np.int64(0))  # it takes no argument and ignores this one
    if data.channels == 1:
        render(data.synth, data.desk, address_of(output), n)
        click(data.synth, data.desk, address_of(output), n)
        return np.int32(0)
    out = samples_at(address_of(output), n * data.channels)
    mono = samples_at(data.mono, CHUNK)
    done: Any = 0
    while done < n:
        m = min(CHUNK, n - done)
        render(data.synth, data.desk, data.mono, m)
        click(data.synth, data.desk, data.mono, m)
        for j in range(m):
            for k in range(data.channels):
                out[(done + j) * data.channels + k] = mono[j]
        done += m
    return np.int32(0)


@entry("void(voidptr, int32, voidptr, int32, voidptr)")
def no_words(_file, _line, _function, _error, _format):
    """An alsa-lib error handler that says nothing."""


@jit
def is_message(message, size):
    """True for a complete channel message: a status and its number of data bytes, each below 128."""
    status = message[0]
    if status < 0x80 or status >= 0xF0 or size != (2 if status & 0xE0 == 0xC0 else 3):
        return False
    return message[1] < 0x80 and (size < 3 or message[2] < 0x80)


@jit
def read_midi(data, event, port, n, frame, step):
    """Moves the messages of a MIDI port of JACK's for these `n` frames into the synth's third ring.

    `frame` is the synth's at the port's first, or NOW; `step` is the synth's frames per frame of the port. `event` is
    the address of `data.event`. It skips clocks and other system messages, other channels, and truncated messages; a
    learned controller moves its parameter instead.
    """
    synth = synth_at(data.synth)
    buffer = pointer_from(data.get_buffer, port, n)
    for i in range(count_from(data.event_count, buffer)):
        if status_from(data.event_get, event, buffer, i) != 0:
            continue
        size = data.event[1]
        if size < 1 or size > 3:
            continue
        message = bytes_at(data.event[2], size)
        if not is_message(message, size):
            continue
        status = np.int64(message[0])
        if synth.channel >= 0 and status & 0x0F != synth.channel:
            continue
        first = np.int64(message[1])
        second = np.int64(message[2]) if size > 2 else np.int64(0)
        at = np.int64(NOW) if frame == NOW else frame + np.int64(round(step * (data.event[0] & 0xFFFFFFFF)))
        if data.desk != 0 and status & 0xF0 == 0xB0:
            ring, room = synth.midi_ring[2], synth.midi_ring_size[2]
            if note_controller(desk_at(data.desk), ring, room, at, status & 0x0F, first, second):
                continue
        push_midi(synth.midi_ring[2], synth.midi_ring_size[2], at, status, first, second)


@jit
def sheet(data, k):
    """Address of the sound (0), of the metronome (1) or of string `k` - 2, float32 (MAX_FRAMES,)."""
    return data.sheets + SAMPLE * MAX_FRAMES * k


@jit
def put(data, port, k, done, m, n):
    """Copies `m` frames of sheet `k` to frame `done` of the `n` of a port.

    It asks for the port's buffer as late as it can: in a crash under PipeWire 0.3.65, as the rate changed, the buffer
    was no longer mapped before the period was over.
    """
    buffer = pointer_from(data.get_buffer, port, n)
    if buffer != 0:
        out, ready = samples_at(buffer + SAMPLE * done, m), samples_at(sheet(data, k), m)
        for j in range(m):
            out[j] = ready[j]


@jit
def play_period(data, done, m, n):
    """Plays `m` <= MAX_FRAMES of the period's `n` frames, from frame `done` on."""
    synth = synth_at(data.synth)
    for k in range(data.strings):
        synth.apart[k] = sheet(data, 2 + k)
    render(data.synth, data.desk, sheet(data, 0), m)
    if data.click == 0:
        click(data.synth, data.desk, sheet(data, 0), m)
    else:
        samples_at(sheet(data, 1), m)[:] = 0.0
        click(data.synth, data.desk, sheet(data, 1), m)
    for k in range(data.outputs):
        put(data, data.output[k], 0, done, m, n)
    for k in range(data.strings):
        put(data, data.string[k], 2 + k, done, m, n)
    if data.click != 0:
        put(data, data.click, 1, done, m, n)


@entry("int32(uint32, voidptr)")
def jack(frames, arg):
    """A JackProcessCallback with `JACK` as argument."""
    data = jack_at(address_of(arg))
    n = np.int64(frames)
    if data.midi != 0:
        read_midi(data, record_address(data) + EVENT_OFFSET, data.midi, n, synth_at(data.synth).frame, 1.0)
    done: Any = 0
    while done < n:
        m = min(MAX_FRAMES, n - done)
        play_period(data, done, m, n)
        done += m
    return np.int32(0)


@entry("int32(uint32, voidptr)")
def jack_midi(frames, arg):
    """A JackProcessCallback with `JACK_MIDI` as argument, of a client beside the one that plays.

    A message plays `delay` frames after its place in the period, whenever this runs.
    """
    data = jack_midi_at(address_of(arg))
    step = synth_at(data.synth).rate / data.rate
    frame = frame_now(data.synth, data.delay)
    if frame != NOW:
        frame -= np.int64(round(step * count_from(data.frames_since, data.client)))
    for k in range(MIDI_PORTS):
        if data.port[k] != 0:
            read_midi(data, record_address(data) + MIDI_EVENT_OFFSET, data.port[k], np.int64(frames), frame, step)
    return np.int32(0)
