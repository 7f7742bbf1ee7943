"""The C functions that PortAudio and JACK call for sound. Compiled; `arg` is the address of a record. [audio thread]"""

from typing import Any

import numpy as np

from livebass.compiling import callback, counted
from livebass.kernels.native import address_of, call_3, carray, count_from, pointer, pointer_from, status_from
from livebass.live.thread.block import put
from livebass.live.thread.records import CHUNK, SYNTH

OUTPUT_UNDERFLOW = 4  # paOutputUnderflow
MOST_CHANNELS = 2
EVENT_BYTES = 24  # jack_midi_event_t: uint32 time, size_t size, pointer to the bytes

PORTAUDIO = np.dtype(
    [("synth", "i8"), ("channels", "i8"), ("mono", "i8")],  # mono: float32 (CHUNK,)
    align=True,
)
JACK = np.dtype(
    [
        ("synth", "i8"),
        ("get_buffer", "i8"),  # addresses of C functions
        ("event_count", "i8"),
        ("event_get", "i8"),
        ("outputs", "i8"),
        ("output", "i8", (MOST_CHANNELS,)),  # ports
        ("midi", "i8"),
        ("event", "i8", (3,)),  # room for one jack_midi_event_t
        ("event_address", "i8"),
    ],
    align=True,
)


@counted
def block(synth, sound, n):
    """n frames of the synth at address `synth` into float32 at address `sound`."""
    call_3(carray(pointer(synth), 1, SYNTH)[0].process, synth, sound, n)


@callback("int32(voidptr, voidptr, uint64, voidptr, uint64, voidptr)")
def portaudio(_input, output, frames, _time, flags, arg):
    """A PaStreamCallback with `PORTAUDIO` as user data; interleaved float32."""
    me = carray(arg, 1, PORTAUDIO)[0]
    n = np.int64(frames & np.uint64(0xFFFFFFFF))
    if flags & np.uint64(OUTPUT_UNDERFLOW):
        carray(pointer(me.synth), 1, SYNTH)[0].underruns += 1
    if me.channels == 1:
        block(me.synth, address_of(output), n)
        return np.int32(0)
    out = carray(output, n * me.channels, np.float32)
    mono = carray(pointer(me.mono), CHUNK, np.float32)
    done: Any = 0
    while done < n:
        m = min(CHUNK, n - done)
        block(me.synth, me.mono, m)
        for j in range(m):
            for k in range(me.channels):
                out[(done + j) * me.channels + k] = mono[j]
        done += m
    return np.int32(0)


@counted
def receive(me, n):
    """Puts what came in at the MIDI port into the synth's own ring, at its frames."""
    synth = carray(pointer(me.synth), 1, SYNTH)[0]
    buffer = pointer_from(me.get_buffer, me.midi, n)
    words = carray(pointer(me.event_address), 3, np.int64)
    for i in range(count_from(me.event_count, buffer)):
        if status_from(me.event_get, me.event_address, buffer, i) != 0:
            continue
        size = words[1]
        if size < 1 or size > 3:
            continue
        data = carray(pointer(words[2]), size, np.uint8)
        message = np.int64(data[0])
        if message < 0x80 or message >= 0xF0 or (synth.channel >= 0 and message & 0x0F != synth.channel):
            continue  # clocks and the like, and what is meant for others
        if size > 1:
            message |= np.int64(data[1]) << 8
        if size > 2:
            message |= np.int64(data[2]) << 16
        put(synth.ring[2], synth.ring_size[2], synth.frame + (words[0] & 0xFFFFFFFF), message)


@callback("int32(uint32, voidptr)")
def jack(frames, arg):
    """A JackProcessCallback with `JACK` as argument."""
    me = carray(arg, 1, JACK)[0]
    n = np.int64(frames)
    if me.midi != 0:
        receive(me, n)
    sound = pointer_from(me.get_buffer, me.output[0], n)
    block(me.synth, sound, n)
    first = carray(pointer(sound), n, np.float32)
    for k in range(1, me.outputs):
        other = carray(pointer(pointer_from(me.get_buffer, me.output[k], n)), n, np.float32)
        for j in range(n):
            other[j] = first[j]
    return np.int32(0)
